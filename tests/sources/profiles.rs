//! Packages outside of the workspace repeat its levels of optimisation. Only then do they find, in a shared
//! target folder, the crates of others that it compiled.

use std::fs;
use std::path::Path;

fn read(path: &str) -> String {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("../..");
    fs::read_to_string(root.join(path)).unwrap_or_else(|error| panic!("{path}: {error}"))
}

/// The levels of the development profile, a line each.
fn levels(text: &str) -> Vec<&str> {
    let (_, section) = text.split_once("[profile.dev.package]").expect("a section of levels");
    let lines = section.lines().skip(1).take_while(|line| !line.starts_with(['[', '"']));
    lines.filter(|line| line.contains(".opt-level = ")).collect()
}

#[test]
fn random_models_have_the_levels_of_the_workspace() {
    let texts =
        ["Cargo.toml", "tests/random_models/Cargo.toml", "tests/random_models/src/batch.rs"].map(read);
    let [workspace, package, models] = texts.each_ref().map(|text| levels(text));
    assert!(package.len() >= 2 && models.len() >= 3, "{package:?}, {models:?}");
    for line in package.iter().chain(&models) {
        assert!(workspace.contains(line), "the workspace has not `{line}`");
    }
}
