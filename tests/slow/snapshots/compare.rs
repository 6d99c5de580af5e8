//! Text against a file, and what differs.

use std::fmt::Write as _;
use std::path::PathBuf;
use std::{env, fs};

fn folder() -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("snapshots")
}

/// Compares `text` with `snapshots/<name>.txt`, or writes the file where `UPDATE_SNAPSHOTS` is set to
/// something.
#[track_caller]
pub(crate) fn snapshot(name: &str, text: &str) {
    let path = folder().join(format!("{name}.txt"));
    if env::var_os("UPDATE_SNAPSHOTS").is_some_and(|value| !value.is_empty()) {
        fs::write(&path, text).expect("the folder of the snapshots can be written");
        return;
    }
    // A checkout may have turned the ends of lines.
    let stored = fs::read_to_string(&path).unwrap_or_default().replace("\r\n", "\n");
    assert!(
        stored == text,
        "{name}.txt differs from what the model compiles to now (- stored, + now).\n\
         If the change is meant: UPDATE_SNAPSHOTS=1 cargo test -p dynamics-slow-tests --test snapshots\n\n{}",
        difference(&stored, text)
    );
}

/// Fails where a file is not named by the tests.
pub(crate) fn no_leftovers(tests: &str) {
    for entry in fs::read_dir(folder()).expect("the folder of the snapshots can be read") {
        let path = entry.expect("an entry of the folder").path();
        if path.extension().is_some_and(|e| e == "txt") {
            let name = path.file_stem().expect("a file has a name").to_string_lossy().into_owned();
            assert!(
                tests.contains(&format!("snapshot(\"{name}\"")),
                "no test compares {name}.txt; remove it"
            );
        }
    }
}

/// Lines that differ, with up to two unchanged ones around each group.
fn difference(old: &str, new: &str) -> String {
    let (old, new): (Vec<&str>, Vec<&str>) = (old.lines().collect(), new.lines().collect());
    let marked = aligned(&old, &new);
    let changed: Vec<usize> = (0..marked.len()).filter(|i| marked[*i].0 != ' ').collect();
    let mut out = String::new();
    let mut previous = None;
    for (i, (mark, line)) in marked.iter().enumerate() {
        if changed.iter().any(|c| c.abs_diff(i) <= 2) {
            if previous.is_some_and(|p| p + 1 != i) || (previous.is_none() && i > 0) {
                out.push_str("  ...\n");
            }
            writeln!(out, "{mark} {line}").expect("a string takes all text");
            previous = Some(i);
        }
    }
    out
}

/// Both texts as one list of marked lines, by a longest common subsequence.
fn aligned<'a>(old: &[&'a str], new: &[&'a str]) -> Vec<(char, &'a str)> {
    let mut common = vec![vec![0usize; new.len() + 1]; old.len() + 1];
    for i in (0..old.len()).rev() {
        for j in (0..new.len()).rev() {
            common[i][j] = if old[i] == new[j] {
                common[i + 1][j + 1] + 1
            } else {
                common[i + 1][j].max(common[i][j + 1])
            };
        }
    }
    let (mut i, mut j, mut out) = (0, 0, Vec::new());
    while i < old.len() || j < new.len() {
        if i < old.len() && j < new.len() && old[i] == new[j] {
            out.push((' ', old[i]));
            (i, j) = (i + 1, j + 1);
        } else if j == new.len() || (i < old.len() && common[i + 1][j] >= common[i][j + 1]) {
            out.push(('-', old[i]));
            i += 1;
        } else {
            out.push(('+', new[j]));
            j += 1;
        }
    }
    out
}

#[test]
fn differences_are_shown_with_their_surroundings() {
    let old = "a\nb\nc\nd\ne\nf\ng\nh";
    let new = "a\nb\nc\nd\nE\nf\ng\nh\ni";
    assert_eq!(difference(old, new), "  ...\n  c\n  d\n- e\n+ E\n  f\n  g\n  h\n+ i\n");
    assert_eq!(difference(old, old), "");
}
