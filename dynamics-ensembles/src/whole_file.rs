//! Files that are complete or absent, whenever the process ends or the power fails: written under another
//! name, brought to the disk, then renamed.

use std::fs::{self, File};
use std::hash::{BuildHasher, Hasher, RandomState};
use std::io::{self, Write};
use std::path::{Path, PathBuf};

/// The ending of files that are not complete.
pub(crate) const PART: &str = "part";

/// Writes a file that is complete or absent, whenever the process ends. Until it is complete it lies in
/// `folder`.
pub(crate) fn write_whole(path: &Path, folder: &Path, bytes: &[u8]) -> io::Result<()> {
    let part = part_of(path, folder);
    let mut file = File::create(&part)?;
    file.write_all(bytes)?;
    name_whole(&file, &part, path)
}

/// Gives a file that is complete its name. Some disks report only now that they are full.
pub(crate) fn name_whole(file: &File, part: &Path, path: &Path) -> io::Result<()> {
    file.sync_all()?;
    fs::rename(part, path)
}

/// Brings the names in the folder of a file to the disk, so that others may be removed.
pub(crate) fn sync_names_beside(path: &Path) -> io::Result<()> {
    let folder = path.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."));
    // Only there is a folder opened as a file.
    if cfg!(unix) {
        match File::open(folder)?.sync_all() {
            // Some file systems have no such thing.
            Err(error)
                if !matches!(error.kind(), io::ErrorKind::InvalidInput | io::ErrorKind::Unsupported) =>
            {
                return Err(error);
            }
            _ => {}
        }
    }
    Ok(())
}

/// The file that is written before one is complete: it lies in `folder`. Its name has a random number, since
/// other machines may write the same file.
pub(crate) fn part_of(path: &Path, folder: &Path) -> PathBuf {
    let mut name = path.file_name().unwrap_or_default().to_owned();
    let random = RandomState::new().build_hasher().finish();
    name.push(format!(".{}-{random:016x}.{PART}", std::process::id()));
    folder.join(name)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn parts_have_names_of_their_own() {
        let part = || part_of(Path::new("a/runs.csv"), Path::new("b"));
        assert_ne!(part(), part());
        assert!(part().starts_with("b") && part().extension().is_some_and(|of| of == PART));
    }
}
