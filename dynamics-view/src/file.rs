//! Files: the extension of a path says the format, and errors name the path.

use core::fmt;
use std::fs;
use std::io::{self, BufWriter};
use std::path::{Path, PathBuf};

/// A file could not be written.
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

/// Its sentence: that is what `main` and `unwrap` print.
impl fmt::Debug for FileError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        fmt::Display::fmt(self, f)
    }
}

impl core::error::Error for FileError {
    fn source(&self) -> Option<&(dyn core::error::Error + 'static)> {
        Some(&self.source)
    }
}

/// The format of a file. A path without an extension gets the first format of the list. A path with the
/// extension of another format is refused, because the file would not be what its name says.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Content {
    /// A chart in whatever format the path asks for.
    Chart,
    /// A chart as SVG.
    Svg,
    /// A page for browsers.
    Page,
    /// Comma-separated values.
    Table,
    /// A JSON value in every line.
    JsonLines,
    /// A functional mock-up unit.
    Unit,
}

/// The formats of charts.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Picture {
    Svg,
    Png,
}

impl Content {
    fn extensions(self) -> &'static [&'static str] {
        match self {
            Self::Chart => &["svg", "png"],
            Self::Svg => &["svg"],
            Self::Page => &["html", "htm"],
            Self::Table => &["csv", "txt"],
            Self::JsonLines => &["jsonl", "json"],
            Self::Unit => &["fmu"],
        }
    }

    fn refusal(self, extension: &str) -> String {
        match self {
            Self::Chart => format!("charts are written as `.svg` or `.png`, not as `.{extension}`"),
            Self::Svg if extension == "png" => {
                String::from("this method writes `.svg`; `Chart::write` and `Motion::plot` write `.png`, too")
            }
            Self::Svg => format!("this method writes charts as `.svg`, not as `.{extension}`"),
            Self::Page => format!("pages and animations are written as `.html`, not as `.{extension}`"),
            Self::Table => format!("tables are written as `.csv`, not as `.{extension}`"),
            Self::Unit => format!("functional mock-up units are written as `.fmu`, not as `.{extension}`"),
            Self::JsonLines => format!("lines of JSON are written as `.jsonl`, not as `.{extension}`"),
        }
    }
}

/// An error where the extension of `path` names a format that is not written; case does not count.
pub fn check(path: &Path, content: Content) -> Result<(), FileError> {
    let Some(extension) = path.extension().map(|extension| extension.to_string_lossy().to_lowercase()) else {
        return Ok(());
    };
    if content.extensions().contains(&extension.as_str()) {
        return Ok(());
    }
    let source = io::Error::new(io::ErrorKind::InvalidInput, content.refusal(&extension));
    Err(FileError { path: path.to_path_buf(), action: "write", source })
}

/// The format of a chart that `path` asks for.
pub(crate) fn picture(path: &Path) -> Result<Picture, FileError> {
    check(path, Content::Chart)?;
    let is_png = path.extension().is_some_and(|extension| extension.eq_ignore_ascii_case("png"));
    Ok(if is_png { Picture::Png } else { Picture::Svg })
}

/// Opens a file for writing. Folders that its path needs are made: results go to places such as
/// `target/charts` that do not exist before the first run.
pub fn create(path: &Path, content: Content) -> Result<BufWriter<fs::File>, FileError> {
    check(path, content)?;
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
pub fn write(path: &Path, content: Content, bytes: &[u8]) -> Result<(), FileError> {
    let mut file = create(path, content)?;
    io::Write::write_all(&mut file, bytes)
        .and_then(|()| io::Write::flush(&mut file))
        .map_err(|source| FileError { path: path.to_path_buf(), action: "write", source })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn folders_are_made_and_errors_name_the_path() {
        let folder = std::env::temp_dir().join(format!("dynamics-file-{}", std::process::id()));
        let path = folder.join("a/b/c.txt");
        let write = |path: &Path| write(path, Content::Table, b"text");
        write(&path).unwrap();
        assert_eq!(fs::read(&path).unwrap(), b"text");

        let error = write(&folder.join("a/b")).unwrap_err();
        assert_eq!(error.action, "create");
        assert!(error.to_string().contains("a/b`: "), "{error}");

        let error = write(&path.join("below/a/file")).unwrap_err();
        assert_eq!(error.action, "create the folder");
        fs::remove_dir_all(&folder).unwrap();
    }

    #[test]
    fn a_file_is_what_its_name_says_or_is_not_written() {
        let all = [Content::Chart, Content::Svg, Content::Page, Content::Table, Content::JsonLines];
        let refused = ["gif", "parquet", "pdf", "xlsx", "mp4", "png.bak"];
        for content in all {
            check(Path::new("results.v2/run"), content).unwrap();
            for extension in content.extensions() {
                check(Path::new(&format!("run.{extension}")), content).unwrap();
                check(Path::new(&format!("run.2.{}", extension.to_uppercase())), content).unwrap();
            }
            for extension in refused {
                let error = check(Path::new(&format!("run.{extension}")), content).unwrap_err();
                let named = format!("`.{}`", content.extensions()[0]);
                assert!(error.to_string().contains(&named), "{error}");
            }
        }
        let path = std::env::temp_dir().join(format!("dynamics-{}.parquet", std::process::id()));
        let error = write(&path, Content::Table, b"t\n").unwrap_err();
        assert!(error.to_string().ends_with("tables are written as `.csv`, not as `.parquet`"), "{error}");
        assert!(!path.exists());
        let formats = ["a.svg", "a.PNG", "a"].map(|path| picture(Path::new(path)).unwrap());
        assert_eq!(formats, [Picture::Svg, Picture::Png, Picture::Svg]);
    }
}
