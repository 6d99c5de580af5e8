//! Files that are complete or absent, whenever the process ends: written under another name, then renamed.

use std::fs;
use std::io::{self, Write};
use std::path::{Path, PathBuf};

/// The ending of files that are not complete.
pub(crate) const PART: &str = "part";

/// Writes a file that is complete or absent, whenever the process ends.
pub(crate) fn write_whole(path: &Path, bytes: &[u8]) -> io::Result<()> {
    let part = part_of(path);
    let mut file = fs::File::create(&part)?;
    file.write_all(bytes)?;
    drop(file);
    fs::rename(&part, path)
}

/// The name under which a file is written before it is complete: one of this process and thread.
pub(crate) fn part_of(path: &Path) -> PathBuf {
    let mut name = path.file_name().unwrap_or_default().to_owned();
    let thread = format!("{:?}", std::thread::current().id());
    let thread: String = thread.chars().filter(char::is_ascii_digit).collect();
    name.push(format!(".{}-{thread}.{PART}", std::process::id()));
    path.with_file_name(name)
}
