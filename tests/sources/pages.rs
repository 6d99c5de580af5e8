//! The pages for readers: their paths and links lead to something, and their examples can be pasted.

use std::collections::BTreeSet;
use std::fs;
use std::path::Path;

/// Pages that name files and folders in backticks. A page that is absent names nothing.
const MAPS: &[&str] = &["ARCHITECTURE.md", "CONTRIBUTING.md", "tests/README.md"];

/// The folder of the gallery as the course has it, where both are built.
const GALLERY: &str = "../gallery/";

/// Short forms of ARCHITECTURE.md: `runtime/` stands for `dynamics-runtime/src/`.
const CRATES: &[&str] = &[
    "simd",
    "symbolic",
    "vocabulary",
    "macros",
    "view",
    "runtime",
    "analysis",
    "families",
    "live",
    "export",
    "fmi",
];

fn root() -> &'static Path {
    Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/../.."))
}

/// All files and folders of the tree, without build outputs and without hidden folders but `.ci`.
fn tree() -> BTreeSet<String> {
    fn collect(folder: &Path, prefix: &str, found: &mut BTreeSet<String>) {
        for entry in fs::read_dir(folder).unwrap().map(Result::unwrap) {
            let name = entry.file_name().into_string().unwrap();
            if name == "target" || name.starts_with('.') && name != ".ci" {
                continue;
            }
            let path = format!("{prefix}{name}");
            if entry.path().is_dir() {
                collect(&entry.path(), &format!("{path}/"), found);
            }
            found.insert(path);
        }
    }
    let mut found = BTreeSet::new();
    collect(root(), "", &mut found);
    found
}

/// The text without its fenced blocks.
fn prose(text: &str) -> String {
    let outside = text.split("```").step_by(2).collect::<Vec<_>>();
    outside.join("\n")
}

/// Whether `name` is a path of the tree, or the end of one: a map may leave out the folders before.
fn leads_somewhere(name: &str, tree: &BTreeSet<String>) -> bool {
    let name = name.trim_end_matches('/');
    let long = CRATES.iter().find_map(|krate| {
        let rest = name.strip_prefix(krate)?;
        (rest.is_empty() || rest.starts_with('/')).then(|| format!("dynamics-{krate}/src{rest}"))
    });
    // A folder of modules may be a file alone: `constrain` for `constrain.rs`.
    let exists = |path: &str| tree.contains(path) || tree.contains(&format!("{path}.rs"));
    let end = format!("/{name}");
    exists(name) || long.is_some_and(|long| exists(&long)) || tree.iter().any(|path| path.ends_with(&end))
}

#[test]
fn maps_name_what_exists() {
    let tree = tree();
    let is_path = |word: &&str| {
        let plain = word.chars().all(|c| c.is_ascii_alphanumeric() || "_-./".contains(c));
        plain && (word.contains('/') || [".rs", ".md", ".toml"].iter().any(|end| word.ends_with(end)))
    };
    let mut missing = Vec::new();
    for page in MAPS {
        let Ok(text) = fs::read_to_string(root().join(page)) else { continue };
        let text = prose(&text);
        let words = text.split('`').skip(1).step_by(2).filter(is_path);
        missing
            .extend(words.filter(|word| !leads_somewhere(word, &tree)).map(|word| format!("{page}: {word}")));
    }
    assert!(missing.is_empty(), "paths that do not exist: {missing:#?}");
}

/// The anchors of a page: its headings as GitHub writes them.
fn anchors(text: &str) -> BTreeSet<String> {
    let headings = text.lines().filter(|line| line.starts_with('#'));
    headings.map(|line| anchor(line.trim_start_matches('#').trim())).collect()
}

fn anchor(heading: &str) -> String {
    let kept = heading.chars().filter(|c| c.is_alphanumeric() || " -_".contains(*c));
    kept.collect::<String>().to_lowercase().replace(' ', "-")
}

#[test]
fn links_lead_somewhere() {
    let (mut missing, tree) = (Vec::new(), tree());
    for page in tree.iter().filter(|path| path.ends_with(".md")) {
        let text = fs::read_to_string(root().join(page)).unwrap();
        let folder = root().join(page).parent().unwrap().to_path_buf();
        for link in prose(&text).replace('\n', " ").split("](").skip(1) {
            let link = link.split(')').next().unwrap_or("");
            if link.contains("://") || link.starts_with("mailto:") || link.starts_with(GALLERY) {
                continue;
            }
            let (file, place) = link.split_once('#').unwrap_or((link, ""));
            let target = if file.is_empty() { root().join(page) } else { folder.join(file) };
            let found = target.exists()
                && (place.is_empty()
                    || fs::read_to_string(&target).is_ok_and(|text| anchors(&prose(&text)).contains(place)));
            if !found {
                missing.push(format!("{page}: {link}"));
            }
        }
    }
    assert!(missing.is_empty(), "links that lead nowhere: {missing:#?}");
}

/// The course shows live pages, in frames and by links. The gallery writes them beside it.
#[test]
fn live_pages_are_in_the_gallery() {
    let gallery = fs::read_to_string(root().join("examples/gallery/main.rs")).unwrap();
    for page in tree().iter().filter(|path| path.ends_with(".md")) {
        let text = fs::read_to_string(root().join(page)).unwrap();
        for link in text.split(GALLERY).skip(1) {
            let name = link.split(".html").next().unwrap_or("");
            assert!(gallery.contains(&format!("(\"{name}\", ")), "{page}: the gallery has no page {name}");
        }
    }
}

/// An example on a page is a whole `main.rs`: nothing in it is hidden, as only rustdoc would hide it, and
/// nothing refers to this repository. It is also compiled and run, as a doctest of `tests/guides/`.
#[test]
fn examples_can_be_pasted() {
    let tested = fs::read_to_string(root().join("tests/guides/lib.rs")).unwrap();
    for page in tree().iter().filter(|path| path.ends_with(".md")) {
        let text = fs::read_to_string(root().join(page)).unwrap();
        let examples: Vec<&str> =
            text.split("```rust\n").skip(1).filter_map(|e| e.split("```").next()).collect();
        assert!(
            examples.is_empty() || tested.contains(&format!("page!(\"../../{page}\")")),
            "{page} has examples that `tests/guides/lib.rs` does not test"
        );
        for example in examples {
            let hidden = example.lines().map(str::trim).find(|line| *line == "#" || line.starts_with("# "));
            assert_eq!(hidden, None, "{page} shows a line that is meant to be hidden");
            for needed in ["use dynamics::", "fn main()"] {
                assert!(example.contains(needed), "{page}: an example without `{needed}`:\n{example}");
            }
            for foreign in ["include!", "env!", "dynamics_"] {
                assert!(!example.contains(foreign), "{page}: an example with `{foreign}`:\n{example}");
            }
        }
    }
}

/// Users depend on `dynamics` alone, so the examples of all crates name it. The line that makes that name is
/// hidden: `# use dynamics_runtime as dynamics;`.
#[test]
fn examples_in_comments_name_dynamics_alone() {
    let is_library = |path: &&String| path.starts_with("dynamics-") && path.contains("/src/");
    for file in tree().iter().filter(is_library).filter(|path| path.ends_with(".rs")) {
        let mut in_example = false;
        for line in fs::read_to_string(root().join(file)).unwrap().lines() {
            let line = line.trim_start();
            let comment = line.strip_prefix("///").or_else(|| line.strip_prefix("//!")).map(str::trim);
            let Some(comment) = comment else {
                in_example = false;
                continue;
            };
            if comment.starts_with("```") {
                in_example = !in_example;
            } else if in_example && !comment.starts_with("# ") {
                assert!(!comment.contains("dynamics_"), "{file}: {comment}");
            }
        }
    }
}
