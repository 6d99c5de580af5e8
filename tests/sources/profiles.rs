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

/// The lines below the first header of this name, up to an empty line or the next header.
fn section<'a>(text: &'a str, header: &str) -> Vec<&'a str> {
    let (_, section) = text.split_once(header).unwrap_or_else(|| panic!("no {header}"));
    section.lines().skip(1).take_while(|line| !line.is_empty() && !line.starts_with(['[', '"'])).collect()
}

#[test]
fn packages_outside_of_the_workspace_have_its_levels() {
    let texts = [
        "Cargo.toml",
        "tests/fuzz/Cargo.toml",
        "tests/random_models/Cargo.toml",
        "tests/random_models/src/batch.rs",
    ]
    .map(read);
    let [workspace, fuzz, package, models] = texts.each_ref().map(|text| levels(text));
    let found = [fuzz.len(), package.len(), models.len()];
    assert!(found[0] >= 2 && found[1] >= 2 && found[2] >= 3, "{found:?} levels were found");
    for line in fuzz.iter().chain(&package).chain(&models) {
        assert!(workspace.contains(line), "the workspace has not `{line}`");
    }
    // Build scripts and macros of others, too.
    let built = texts.each_ref().map(|text| section(text, "[profile.dev.build-override]"));
    assert!(built.iter().all(|lines| *lines == ["opt-level = 1"]), "{built:?}");
    let developed = texts.each_ref().map(|text| section(text, "[profile.dev]"));
    for line in ["debug = \"line-tables-only\"", "incremental = false"] {
        assert!(developed[..3].iter().all(|lines| lines.contains(&line)), "{line}: {developed:?}");
    }
}
