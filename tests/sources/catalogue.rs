//! The catalogue of messages against the cases below `tests/ui/`.

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};

/// Sections of the catalogue, and the folders below `tests/ui/` with their cases.
const FOLDERS: &[(&str, &str)] = &[
    ("The struct.", "structs"),
    ("The impl block and its roles.", "roles"),
    ("Families.", "families"),
    ("Names.", "names"),
    ("Shapes.", "shapes"),
    ("Numbers.", "numbers"),
    ("Statements.", "statements"),
    ("Time.", "time"),
    ("Reactions.", "reactions"),
    ("Speeds.", "speeds"),
    ("Units.", "units"),
    ("What the engine finds.", "models"),
    ("What the engine finds of constraints.", "constraints"),
];

/// Entries that no model can bring about, with the reason.
const WITHOUT_CASE: &[(&str, &str)] = &[
    ("elements_differ", "the loops equal the unrolled model; this is for a mistake of the library's own"),
    ("finding", "the engine's findings are all worded; this is for those that it may learn"),
    ("not_followed", "an error is always reported where a value is lost; this is the net below"),
];

/// Cases that show several errors on purpose.
const SEVERAL: &[&str] = &["several_mistakes_at_once", "several_mistakes_of_several_kinds"];

/// Cases where the two macros miss each other, which neither can see: the words are rustc's. With the number
/// of errors.
const RUSTC: &[(&str, usize, &str)] = &[
    ("closure_in_a_page", 1, "a trait that nothing implements; the message has the remedy in its notes"),
    (
        "function_of_the_library",
        1,
        "only the library's function mixes numbers and expressions; a name has the remedy",
    ),
    ("no_attribute", 1, "a trait that only the attribute implements; the message has the remedy"),
    (
        "no_derive",
        2,
        "the attribute calls a macro of the struct's name, which the derive would have left there",
    ),
    ("no_impl", 1, "a trait that only the impl block implements; the message has the remedy"),
    ("no_target", 1, "a trait that only models with the target implement; the message has the remedy"),
    ("private_model", 1, "the struct is private where it is imported, and so is the macro beside it"),
    ("type_of_the_library", 1, "a trait that only the library's type fulfils; the message has the remedy"),
    (
        "two_models_of_a_name",
        4,
        "the structs, and the modules that derive and block make; the other error is ours",
    ),
    (
        "two_impls",
        2,
        "a module that is made by each block exists twice; the other error is ours, at the second block",
    ),
    ("two_impls_identical", 2, "as of two blocks that differ"),
    (
        "two_impls_in_two_modules",
        15,
        "whatever a block implements exists twice; the name of a trait says why",
    ),
];

/// How many errors a case shows where the words are rustc's.
fn of_rustc(stem: &str) -> Option<usize> {
    RUSTC.iter().find(|(name, ..)| *name == stem).map(|(_, errors, _)| *errors)
}

/// A file of a case.
struct Case {
    /// Its folder below `tests/ui/`.
    folder: String,
    text: String,
}

/// Every file of one kind below `tests/ui/`, by its stem.
fn cases(extension: &str) -> BTreeMap<String, Case> {
    let mut found = BTreeMap::new();
    for folder in readable(Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/../ui"))) {
        if !folder.is_dir() {
            continue;
        }
        for path in readable(&folder) {
            if path.extension().is_some_and(|e| e == extension) {
                let text = fs::read_to_string(&path).expect("readable");
                let previous = found.insert(name_of(&path), Case { folder: name_of(&folder), text });
                assert!(previous.is_none(), "there are two cases of this name: {}", path.display());
            }
        }
    }
    found
}

fn readable(folder: &Path) -> impl Iterator<Item = PathBuf> {
    fs::read_dir(folder).expect("a readable folder").map(|entry| entry.expect("a readable entry").path())
}

/// A file's or folder's name without its extension.
fn name_of(path: &Path) -> String {
    path.file_stem().expect("an entry has a name").to_string_lossy().into_owned()
}

/// An entry of the catalogue.
#[derive(Debug)]
struct Entry {
    name: String,
    /// The comment above the entries that belong together.
    section: String,
}

/// The catalogue's entries, read from its source: one per line, `name(arguments) "text";`.
fn entries() -> Vec<Entry> {
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/../../dynamics-macros/src/messages.rs");
    let source = fs::read_to_string(path).expect("the catalogue is where it was");
    let (_, table) = source.split_once("\ncatalogue! {").expect("the catalogue is a table");
    let (mut entries, mut section) = (Vec::new(), String::new());
    for line in table.lines().map(str::trim) {
        if let Some(comment) = line.strip_prefix("// ") {
            comment.clone_into(&mut section);
        } else if let Some((name, rest)) = line.split_once('(') {
            let plain = name.chars().all(|c| c.is_ascii_lowercase() || c.is_ascii_digit() || c == '_');
            if plain && rest.contains(") \"") {
                entries.push(Entry { name: name.to_owned(), section: section.clone() });
            }
        }
    }
    assert!(entries.len() > 100, "the catalogue was not read: {entries:?}");
    entries
}

/// The entry that a file is named after: the longest that it starts with.
fn entry_of<'a>(stem: &str, entries: &'a [Entry]) -> Option<&'a Entry> {
    let named = |e: &&Entry| stem == e.name || stem.starts_with(&format!("{}_", e.name));
    entries.iter().filter(named).max_by_key(|e| e.name.len())
}

#[test]
fn every_message_has_a_case_and_every_case_a_message() {
    let (cases, entries) = (cases("rs"), entries());
    let missing: Vec<&str> = entries
        .iter()
        .map(|e| e.name.as_str())
        .filter(|name| !WITHOUT_CASE.iter().any(|(exempt, _)| exempt == name))
        .filter(|name| !cases.keys().any(|c| entry_of(c, &entries).is_some_and(|e| e.name == *name)))
        .collect();
    assert!(missing.is_empty(), "without a case: {missing:?}");
    let known = |c: &str| entry_of(c, &entries).is_some() || SEVERAL.contains(&c) || of_rustc(c).is_some();
    let strangers: Vec<&String> = cases.keys().filter(|c| !known(c)).collect();
    assert!(strangers.is_empty(), "named after no message: {strangers:?}");
}

#[test]
fn cases_are_in_the_folder_of_their_message() {
    let entries = entries();
    for (stem, case) in cases("rs") {
        let folder = match entry_of(&stem, &entries) {
            Some(entry) => {
                let row = FOLDERS.iter().find(|(section, _)| *section == entry.section);
                row.unwrap_or_else(|| panic!("name a folder for the section \"{}\"", entry.section)).1
            }
            None if SEVERAL.contains(&stem.as_str()) => "several",
            None => "rustc",
        };
        assert_eq!(case.folder, folder, "move {stem} to tests/ui/{folder}/");
    }
}

#[test]
fn one_mistake_gives_one_error() {
    for (stem, Case { text, .. }) in cases("stderr") {
        let errors = text.lines().filter(|l| l.starts_with("error") || l.starts_with("warning")).count();
        let expected = of_rustc(&stem).unwrap_or(1);
        assert!(
            errors == expected || errors > 1 && SEVERAL.contains(&stem.as_str()),
            "{stem} has {errors} errors:\n{text}"
        );
    }
}

#[test]
fn messages_name_problem_and_remedy() {
    for (stem, Case { text, .. }) in cases("stderr").into_iter().filter(|(stem, _)| of_rustc(stem).is_none())
    {
        for line in text.lines().filter(|l| l.starts_with("error")) {
            let message = line.trim_start_matches("error: ");
            let starts_small = message.starts_with(|c: char| !c.is_uppercase());
            let remedy = message.contains("; ");
            assert!(starts_small && remedy && !message.ends_with('.'), "{stem}: {message}");
        }
    }
}
