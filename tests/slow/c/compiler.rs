//! The compilers of C that are there.

use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::{env, fs};

/// Warnings are errors.
pub(crate) const STRICT: &[&str] =
    &["-std=c99", "-O1", "-ffp-contract=off", "-Wall", "-Wextra", "-Wpedantic", "-Werror"];

/// Compilers that answer: `cc`, and `gcc` and `clang` where they are others. Empty, with a line, where there
/// is none.
pub(crate) fn compilers() -> Vec<String> {
    let answer = |name: &str| {
        let output = Command::new(name).arg("--version").stderr(Stdio::null()).output().ok()?;
        output.status.success().then(|| String::from_utf8_lossy(&output.stdout).into_owned())
    };
    let (mut found, mut answers) = (Vec::new(), Vec::new());
    for name in ["cc", "gcc", "clang"] {
        let Some(text) = answer(name) else { continue };
        // `cc` is most often another name of one of the others, which differs in the first word alone.
        let rest = text.split_once(' ').map(|(_, rest)| rest.to_owned()).unwrap_or_default();
        if !answers.contains(&rest) {
            answers.push(rest);
            found.push(name.to_owned());
        }
    }
    if found.is_empty() {
        eprintln!("skipped: there is no compiler of C");
    }
    found
}

/// An empty folder of a name.
pub(crate) fn folder(name: &str) -> PathBuf {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("c").join(name);
    let _ = fs::remove_dir_all(&folder);
    fs::create_dir_all(&folder).unwrap();
    folder
}

/// Compiles files of a folder to the program `out` there.
#[track_caller]
pub(crate) fn compile(compiler: &str, folder: &Path, flags: &[&str], files: &[&str], out: &str) {
    let mut command = Command::new(compiler);
    command.current_dir(folder).args(STRICT).args(flags).args(files).args(["-o", out, "-lm"]);
    let output = command.output().unwrap();
    let text = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success() && text.is_empty(), "{compiler} in {}:\n{text}", folder.display());
}
