#!/usr/bin/env bash
# The course, the gallery of live pages and the documentation of the library as one folder, target/site. Its
# index.html can be opened from disk, and the folder can be served as it is. The course needs mdbook; without
# it the script says how to get it, and leaves the course out. `--quick` leaves out the documentation of the
# library.
set -euo pipefail
cd "$(dirname "$0")/.."
export CARGO_TERM_COLOR=never CARGO_INCREMENTAL=0
target="$(cargo metadata --format-version 1 --no-deps | sed 's/.*"target_directory":"\([^"]*\)".*/\1/')"
site=target/site
quick=false
[ "${1:-}" = --quick ] && quick=true

rm -rf "$site"
mkdir -p "$site"
cargo run --release --example gallery
cp -r target/gallery "$site/gallery"

# A live page that the course shows has to be there.
for page in $(grep -oh 'gallery/[a-z_]*\.html' docs/book/src/*.md | sort -u); do
    [ -f "$site/$page" ] || { echo "the course shows $page, which the gallery does not write" >&2; exit 1; }
done

# Screenshots of six pages, for the guide. They are made anew where there is a Chromium.
chromium=""
for name in "${DYNAMICS_CHROMIUM:-chromium}" chromium-browser google-chrome; do
    chromium="$(command -v "$name")" && break
done
if [ -n "$chromium" ]; then
    flags=(--headless --no-sandbox --disable-gpu --no-first-run --hide-scrollbars --window-size=1100,760)
    profile="$(mktemp -d)"
    for page in double_pendulum four_bar coaster_jump rolling_coin andrews planets; do
        "$chromium" "${flags[@]}" --user-data-dir="$profile" --virtual-time-budget=6000 \
            --screenshot="docs/guide/screenshots/$page.png" "file://$PWD/$site/gallery/$page.html" 2>/dev/null
    done
    rm -rf "$profile"
else
    echo "left as they are: the screenshots of the guide need Chromium" >&2
fi

book="" api=""
if mdbook --version >/dev/null 2>&1; then
    mdbook build docs/book --dest-dir "$PWD/$site/book"
    book='<li><a href="book/index.html">The course</a>: ten pages, each with a model and a live page.</li>'
else
    echo "left out: the course needs mdbook: cargo install --locked mdbook" >&2
fi
if ! $quick; then
    # The root re-exports the others, and links to their pages.
    crates=(dynamics dynamics-{analysis,export,families,live,macros,runtime,view,vocabulary})
    cargo doc --no-deps "${crates[@]/#/--package=}"
    cp -r "$target/doc" "$site/api"
    api='<li><a href="api/dynamics/index.html">The library</a>: every type and function.</li>'
fi
cat >"$site/index.html" <<EOF
<!DOCTYPE html>
<html lang="en">
<meta charset="utf-8">
<meta name="viewport" content="width=device-width, initial-scale=1">
<title>dynamics</title>
<style>
:root { color-scheme: light dark; }
body { font: 1.1rem/1.5 system-ui, sans-serif; max-width: 40rem; margin: 3rem auto; padding: 0 1rem; }
li { margin: .6rem 0; }
</style>
<h1>Mechanics in motion</h1>
<p>A mechanical system, written as energies and constraints in Rust, becomes equations while it is compiled,
and then moves.</p>
<ul>
$book
<li><a href="gallery/index.html">The gallery</a>: simulations that compute in your browser.</li>
$api
</ul>
</html>
EOF
echo
echo "to look at:"
echo "  $PWD/$site/index.html"
