//! The catalogue of messages against the cases below `tests/ui/`.

use std::collections::BTreeMap;
use std::fs;

use crate::messages::ENTRIES;

/// Entries that no model can bring about, with the reason.
const WITHOUT_CASE: &[(&str, &str)] = &[
    ("finding", "the engine's findings are all worded; this is for those that it may learn"),
    ("not_followed", "an error is always reported where a value is lost; this is the net below"),
];

/// Cases that show several errors on purpose.
const SEVERAL: &[&str] = &["several_mistakes_at_once"];

/// Text of every file of one kind below `tests/ui/`, by its stem.
fn cases(extension: &str) -> BTreeMap<String, String> {
    let folder = concat!(env!("CARGO_MANIFEST_DIR"), "/../tests/ui");
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

/// The entry that a file is named after: the longest that it starts with.
fn entry_of(stem: &str) -> Option<&'static str> {
    let named = |e: &&&str| stem == **e || stem.starts_with(&format!("{e}_"));
    ENTRIES.iter().filter(named).max_by_key(|e| e.len()).copied()
}

#[test]
fn every_message_has_a_case_and_every_case_a_message() {
    let cases = cases("rs");
    let missing: Vec<&&str> = ENTRIES
        .iter()
        .filter(|e| !WITHOUT_CASE.iter().any(|(exempt, _)| exempt == *e))
        .filter(|e| !cases.keys().any(|c| entry_of(c) == Some(*e)))
        .collect();
    assert!(missing.is_empty(), "without a case: {missing:?}");
    let strangers: Vec<&String> =
        cases.keys().filter(|c| entry_of(c).is_none() && !SEVERAL.contains(&c.as_str())).collect();
    assert!(strangers.is_empty(), "named after no message: {strangers:?}");
}

#[test]
fn one_mistake_gives_one_error() {
    for (stem, text) in cases("stderr") {
        let errors = text.lines().filter(|l| l.starts_with("error") || l.starts_with("warning")).count();
        assert!(errors == 1 || errors > 1 && SEVERAL.contains(&stem.as_str()), "{stem} has {errors} errors:\n{text}");
    }
}

#[test]
fn messages_name_problem_and_remedy() {
    for (stem, text) in cases("stderr") {
        for line in text.lines().filter(|l| l.starts_with("error")) {
            let message = line.trim_start_matches("error: ");
            let starts_small = message.starts_with(|c: char| !c.is_uppercase());
            let remedy = message.contains("; ");
            assert!(starts_small && remedy && !message.ends_with('.'), "{stem}: {message}");
        }
    }
}
