//! The catalogue of messages against the cases below `tests/ui/`.

use std::collections::BTreeMap;
use std::fs;

/// Entries that no model can bring about, with the reason.
const WITHOUT_CASE: &[(&str, &str)] = &[
    ("finding", "the engine's findings are all worded; this is for those that it may learn"),
    ("not_followed", "an error is always reported where a value is lost; this is the net below"),
];

/// Cases that show several errors on purpose.
const SEVERAL: &[&str] = &["several_mistakes_at_once", "several_mistakes_of_several_kinds"];

/// Cases where the two macros miss each other, which neither can see: the words are rustc's. With the number
/// of errors.
const RUSTC: &[(&str, usize, &str)] = &[
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
        14,
        "whatever a block implements exists twice; the name of a trait says why",
    ),
];

/// How many errors a case shows where the words are rustc's.
fn of_rustc(stem: &str) -> Option<usize> {
    RUSTC.iter().find(|(name, ..)| *name == stem).map(|(_, errors, _)| *errors)
}

/// Text of every file of one kind below `tests/ui/`, by its stem.
fn cases(extension: &str) -> BTreeMap<String, String> {
    let folder = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/ui");
    let entries = fs::read_dir(folder).expect("the workspace has the folder tests/ui");
    let paths = entries.map(|e| e.expect("readable").path());
    let wanted = paths.filter(|p| p.extension().is_some_and(|e| e == extension));
    wanted
        .map(|p| {
            let stem = p.file_stem().expect("has a name").to_string_lossy().into_owned();
            (stem, fs::read_to_string(&p).expect("readable"))
        })
        .collect()
}

/// Names of the catalogue's entries, read from its source: one per line, `name(arguments) "text";`.
fn entries() -> Vec<String> {
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/dynamics-macros/src/messages.rs");
    let source = fs::read_to_string(path).expect("the catalogue is where it was");
    let (_, table) = source.split_once("\ncatalogue! {").expect("the catalogue is a table");
    let name = |line: &str| {
        let (name, rest) = line.trim().split_once('(')?;
        let plain = name.chars().all(|c| c.is_ascii_lowercase() || c.is_ascii_digit() || c == '_');
        (plain && rest.contains(") \"")).then(|| name.to_owned())
    };
    let entries: Vec<String> = table.lines().filter_map(name).collect();
    assert!(entries.len() > 100, "the catalogue was not read: {entries:?}");
    entries
}

/// The entry that a file is named after: the longest that it starts with.
fn entry_of<'a>(stem: &str, entries: &'a [String]) -> Option<&'a String> {
    entries.iter().filter(|e| stem == **e || stem.starts_with(&format!("{e}_"))).max_by_key(|e| e.len())
}

#[test]
fn every_message_has_a_case_and_every_case_a_message() {
    let (cases, entries) = (cases("rs"), entries());
    let missing: Vec<&String> = entries
        .iter()
        .filter(|e| !WITHOUT_CASE.iter().any(|(exempt, _)| exempt == e))
        .filter(|e| !cases.keys().any(|c| entry_of(c, &entries) == Some(*e)))
        .collect();
    assert!(missing.is_empty(), "without a case: {missing:?}");
    let known = |c: &str| entry_of(c, &entries).is_some() || SEVERAL.contains(&c) || of_rustc(c).is_some();
    let strangers: Vec<&String> = cases.keys().filter(|c| !known(c)).collect();
    assert!(strangers.is_empty(), "named after no message: {strangers:?}");
}

#[test]
fn one_mistake_gives_one_error() {
    for (stem, text) in cases("stderr") {
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
    for (stem, text) in cases("stderr").into_iter().filter(|(stem, _)| of_rustc(stem).is_none()) {
        for line in text.lines().filter(|l| l.starts_with("error")) {
            let message = line.trim_start_matches("error: ");
            let starts_small = message.starts_with(|c: char| !c.is_uppercase());
            let remedy = message.contains("; ");
            assert!(starts_small && remedy && !message.ends_with('.'), "{stem}: {message}");
        }
    }
}
