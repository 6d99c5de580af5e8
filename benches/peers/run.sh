#!/usr/bin/env bash
# Measures other solvers on the problems of `examples/work_precision.rs`, then ours beside them, on this machine.
#
#   benches/peers/run.sh [all | heyoka | scipy | sundials | casadi | crates | ours]...
#
# Needs Rust; python3 with venv for heyoka, SciPy and whatever integrates Andrews' mechanism; gcc for the crates; SUNDIALS 6 with its headers
# (Debian: libsundials-dev). What cannot be had is passed over, and says so. Everything is installed into a folder of its own below
# `$CARGO_TARGET_DIR` or `benches/peers/target`; about 20 minutes in all, most of it for SciPy's implicit methods and for compiling.
#
# PEERS_PYTHON names a Python that has heyoka, scipy, numba and casadi already. PEERS_PREFIX is put before every measurement, for example
# `nice -n -20 taskset -c 1`. Results are lines of JSON in `results/`: see `Study::add_outside`. They are true of one machine and are not committed.
set -euo pipefail
here="$(cd "$(dirname "$0")" && pwd)"
work="${CARGO_TARGET_DIR:-$here/target}/peers"
read -r -a prefix <<<"${PEERS_PREFIX:-}"
mkdir -p "$here/results" "$work/generated"
python="${PEERS_PYTHON:-$work/venv/bin/python}"

skip() { echo "$1 passed over: $2" >&2; }

# Whether Python has these packages, installed one by one if it has to be: one that is missing for this platform does not take the others along.
have() {
    if [ ! -x "$python" ]; then
        if [ -n "${PEERS_PYTHON:-}" ] || ! python3 -m venv "$work/venv" 2>/dev/null; then
            rm -rf "$work/venv"
            return 1
        fi
    fi
    local package
    for package in "$@"; do
        if "$python" -c "import $package" 2>/dev/null; then continue; fi
        if [ -n "${PEERS_PYTHON:-}" ] || ! "$python" -m pip install --quiet --disable-pip-version-check "$package"; then return 1; fi
    done
}

# Andrews' mechanism as C, which CasADi writes.
andrews() {
    [ -e "$work/generated/andrews.h" ] || { have casadi && "$python" "$here/python/andrews_c.py" "$work/generated"; }
}

# A part that fails leaves what it had measured before.
measure() {
    local name="$1"
    shift
    echo "== $name"
    if ! "${prefix[@]}" "$@" >"$work/$name.jsonl"; then
        echo "$name failed: its curves are those of an earlier run, if there are any" >&2
        return
    fi
    mv "$work/$name.jsonl" "$here/results/$name.jsonl"
    echo "$(wc -l <"$here/results/$name.jsonl") runs in results/$name.jsonl"
}

heyoka() {
    have heyoka || { skip heyoka "it cannot be installed for python3 here"; return; }
    measure heyoka "$python" "$here/python/run_heyoka.py"
}

scipy() {
    have scipy numba || { skip SciPy "it or numba cannot be installed for python3 here"; return; }
    measure scipy "$python" "$here/python/run_scipy.py"
}

sundials() {
    command -v gcc >/dev/null || { skip SUNDIALS "there is no gcc"; return; }
    andrews || { skip SUNDIALS "CasADi, which writes its right-hand side, cannot be installed for python3 here"; return; }
    local libraries="cvode ida nvecserial sunmatrixdense sunlinsoldense sunnonlinsolfixedpoint"
    # shellcheck disable=SC2046
    if ! gcc -O3 -march=native -I"$work/generated" "$here/sundials/run.c" -o "$work/sundials" \
        $(printf -- '-lsundials_%s ' $libraries) -lm 2>"$work/sundials.log"; then
        skip SUNDIALS "its headers or libraries are not installed, or are of another version ($work/sundials.log)"
        return
    fi
    measure sundials "$work/sundials"
}

# SUNDIALS as CasADi's wheel brings it along: an older one, but it installs everywhere.
casadi() {
    command -v gcc >/dev/null || { skip "CasADi's SUNDIALS" "there is no gcc"; return; }
    have casadi || { skip "CasADi's SUNDIALS" "CasADi cannot be installed for python3 here"; return; }
    # CasADi leaves the C that it writes where it runs.
    (cd "$work/generated" && measure casadi "$python" "$here/python/run_casadi.py")
}

crates() {
    command -v gcc >/dev/null || { skip "the crates" "there is no gcc"; return; }
    andrews || { skip "the crates" "CasADi, which writes a right-hand side, cannot be installed for python3 here"; return; }
    if ! PEERS_GENERATED="$work/generated" RUSTFLAGS="-C target-cpu=native" cargo build --release --quiet \
        --manifest-path "$here/crates/Cargo.toml" --target-dir "$work/crates"; then
        skip "the crates" "they cannot be built"
        return
    fi
    measure crates "$work/crates/release/dynamics-peers-crates"
}

ours() {
    RUSTFLAGS="-C target-cpu=native" cargo build --release --quiet --manifest-path "$here/../../Cargo.toml" --example work_precision --target-dir "$work/ours"
    "${prefix[@]}" "$work/ours/release/examples/work_precision"
}

parts=("$@")
if [ ${#parts[@]} -eq 0 ] || [ "${parts[0]}" = all ]; then
    parts=(heyoka scipy sundials casadi crates ours)
fi
for name in "${parts[@]}"; do
    case "$name" in
    heyoka | scipy | sundials | casadi | crates | ours) ;;
    *)
        echo "there is no part $name; there are heyoka, scipy, sundials, casadi, crates, ours" >&2
        exit 2
        ;;
    esac
done
for name in "${parts[@]}"; do "$name"; done
