//! The page of the documentation and these tests say the same.

use std::collections::BTreeSet;

const PAGE: &str = include_str!("../../docs/when-methods-fail.md");
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

#[test]
fn every_chart_is_shown() {
    let shown: BTreeSet<String> =
        PAGE.split("](charts/").skip(1).filter_map(|rest| rest.split(')').next()).map(str::to_string).collect();
    let files = std::fs::read_dir(crate::charts::folder()).unwrap();
    let files: BTreeSet<String> = files.map(|file| file.unwrap().file_name().into_string().unwrap()).collect();
    assert_eq!(shown, files);
}
