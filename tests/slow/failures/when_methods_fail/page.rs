//! The page of the documentation and these tests say the same.

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

const PAGE: &str = include_str!("../../../../docs/when-methods-fail.md");
const TESTS: [&str; 6] = [
    include_str!("branches.rs"),
    include_str!("conservation.rs"),
    include_str!("growth.rs"),
    include_str!("hidden.rs"),
    include_str!("limits.rs"),
    include_str!("stiffness.rs"),
];

/// What stands in backticks in the last column of the tables.
fn tests_of_rows() -> BTreeSet<String> {
    let rows = PAGE.lines().filter(|line| line.starts_with("| "));
    let last = rows.filter_map(|row| row.trim_end_matches([' ', '|']).rsplit("| ").next());
    last.filter(|cell| *cell != "test").map(|cell| cell.trim_matches(['`', ' ']).to_string()).collect()
}

fn written_tests() -> BTreeSet<String> {
    let names = |source: &'static str| {
        source.split("#[test]\nfn ").skip(1).filter_map(|rest| rest.split('(').next()).map(str::to_string)
    };
    TESTS.into_iter().flat_map(names).collect()
}

#[test]
fn every_row_is_a_test_and_every_test_a_row() {
    assert_eq!(tests_of_rows(), written_tests());
    assert!(written_tests().len() >= 11);
}

/// All sources below a folder, one after the other.
fn sources(folder: &Path) -> String {
    let entries = std::fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path());
    let text = |path: PathBuf| match path.is_dir() {
        true => sources(&path),
        false => std::fs::read_to_string(path).unwrap(),
    };
    entries.map(text).collect()
}

/// What the page quotes is what the library says: every piece of it stands in its sources.
#[test]
fn what_is_quoted_is_what_is_said() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("../..");
    let sources = ["dynamics-runtime/src", "dynamics-analysis/src"].map(|folder| sources(&root.join(folder)));
    let sources = sources.concat();
    // In a string that goes on in the next line words stand apart.
    let sources = sources.replace("\\\n", "").split_whitespace().collect::<Vec<_>>().join(" ");
    let (mut column, mut quoted) = (None, 0);
    for line in PAGE.lines() {
        let line = line.replace("\\|", "");
        let cells: Vec<&str> = line.split('|').map(str::trim).collect();
        if cells.len() < 3 {
            column = None;
            continue;
        }
        let Some(says) = column else {
            column = cells.iter().position(|cell| *cell == "what the library says");
            assert!(column.is_some(), "{line}");
            continue;
        };
        for quote in cells[says].split('`').skip(1).step_by(2) {
            // What stands for a number, and the brackets of a value, are no words.
            for piece in quote
                .split("..")
                .flat_map(|piece| piece.split(['(', ')']))
                .map(|piece| piece.trim_matches(['.', ' ']))
            {
                assert!(sources.contains(piece), "nobody says `{piece}`, as in: {line}");
            }
            quoted += 1;
        }
    }
    assert!(quoted > 30, "{quoted}");
}

#[test]
fn every_chart_is_shown() {
    let shown: BTreeSet<String> = PAGE
        .split("](charts/")
        .skip(1)
        .filter_map(|rest| rest.split(')').next())
        .map(str::to_string)
        .collect();
    let files = std::fs::read_dir(super::charts::folder()).unwrap();
    let files: BTreeSet<String> =
        files.map(|file| file.unwrap().file_name().into_string().unwrap()).collect();
    assert_eq!(shown, files);
}
