//! Files that are complete or absent, whenever the process ends: written under another name, then renamed.

use std::fs;
use std::io::{self, Write};
use std::path::{Path, PathBuf};

/// The ending of files that are not complete.
pub(crate) const PART: &str = "part";

/// Writes a file that is complete or absent, whenever the process ends. Until it is complete it lies in
/// `folder`.
pub(crate) fn write_whole(path: &Path, folder: &Path, bytes: &[u8]) -> io::Result<()> {
    let part = part_of(path, folder);
    let mut file = fs::File::create(&part)?;
    file.write_all(bytes)?;
    drop(file);
    fs::rename(&part, path)
}

/// The file that is written before one is complete: it lies in `folder` and has a name of this process and
/// thread.
pub(crate) fn part_of(path: &Path, folder: &Path) -> PathBuf {
    let mut name = path.file_name().unwrap_or_default().to_owned();
    let thread = format!("{:?}", std::thread::current().id());
    let thread: String = thread.chars().filter(char::is_ascii_digit).collect();
    name.push(format!(".{}-{thread}.{PART}", std::process::id()));
    folder.join(name)
}
