//! Files: the errors name the path.

use core::fmt;
use std::fs;
use std::io::{self, BufWriter};
use std::path::{Path, PathBuf};

/// A file could not be written.
#[derive(Debug)]
pub struct FileError {
    /// The file, or the folder that it needs.
    pub path: PathBuf,
    /// What was tried: `create the folder`, `create`, `write`.
    pub action: &'static str,
    /// Why it failed.
    pub source: io::Error,
}

impl fmt::Display for FileError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { path, action, source } = self;
        write!(f, "cannot {action} `{}`: {source}", path.display())
    }
}

impl core::error::Error for FileError {
    fn source(&self) -> Option<&(dyn core::error::Error + 'static)> {
        Some(&self.source)
    }
}

/// Opens a file for writing. Folders that its path needs are made: results go to places such as `target/charts` that do not
/// exist before the first run.
pub(super) fn create(path: &Path) -> Result<BufWriter<fs::File>, FileError> {
    let failed = |path: &Path, action| {
        let path = path.to_path_buf();
        move |source| FileError { path, action, source }
    };
    if let Some(folder) = path.parent().filter(|folder| !folder.as_os_str().is_empty()) {
        fs::create_dir_all(folder).map_err(failed(folder, "create the folder"))?;
    }
    let file = fs::File::create(path).map_err(failed(path, "create"))?;
    Ok(BufWriter::new(file))
}

/// Writes a whole file.
pub(crate) fn write(path: &Path, bytes: &[u8]) -> Result<(), FileError> {
    let mut file = create(path)?;
    io::Write::write_all(&mut file, bytes).and_then(|()| io::Write::flush(&mut file)).map_err(|source| FileError {
        path: path.to_path_buf(),
        action: "write",
        source,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn folders_are_made_and_errors_name_the_path() {
        let folder = std::env::temp_dir().join(format!("dynamics-file-{}", std::process::id()));
        let path = folder.join("a/b/c.txt");
        write(&path, b"text").unwrap();
        assert_eq!(fs::read(&path).unwrap(), b"text");

        let error = write(&folder.join("a/b"), b"text").unwrap_err();
        assert_eq!(error.action, "create");
        assert!(error.to_string().contains("a/b`: "), "{error}");

        let error = write(&path.join("below/a/file"), b"text").unwrap_err();
        assert_eq!(error.action, "create the folder");
        fs::remove_dir_all(&folder).unwrap();
    }
}
