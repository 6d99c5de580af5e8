//! The files that are tested: pages of models of the tests, and those of the folder `DYNAMICS_GALLERY`.

use std::path::Path;
use std::sync::OnceLock;
use std::{env, fs};

/// A file that a browser opens.
pub(crate) struct File {
    pub(crate) name: String,
    pub(crate) address: String,
    /// Whether it is a page with a motion; others are indexes of such pages.
    pub(crate) live: bool,
}

impl File {
    fn of(path: &Path) -> Self {
        let text = fs::read_to_string(path).unwrap_or_else(|e| panic!("{}: {e}", path.display()));
        let path = path.canonicalize().unwrap();
        Self {
            name: path.file_stem().unwrap().to_string_lossy().into_owned(),
            address: format!("file://{}", path.display()),
            live: text.contains("id=\"packed\""),
        }
    }
}

/// All files, written once for all tests of this process.
pub(crate) fn files() -> &'static [File] {
    static FILES: OnceLock<Vec<File>> = OnceLock::new();
    FILES.get_or_init(|| {
        let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("live-pages");
        let mut files: Vec<File> = crate::shown::pages()
            .into_iter()
            .map(|(name, html)| {
                let path = folder.join(format!("{name}.html"));
                fs::create_dir_all(&folder).unwrap();
                fs::write(&path, html).unwrap();
                File::of(&path)
            })
            .collect();
        files.push(File::of(&crate::shown::gallery().write(folder.join("gallery")).unwrap()));
        if let Some(gallery) = env::var_os("DYNAMICS_GALLERY") {
            files.extend(gallery_of(Path::new(&gallery)));
        }
        files
    })
}

fn gallery_of(folder: &Path) -> Vec<File> {
    let entries = fs::read_dir(folder).unwrap_or_else(|e| panic!("{}: {e}", folder.display()));
    let mut paths: Vec<_> = entries.map(|entry| entry.unwrap().path()).collect();
    paths.retain(|path| path.extension().is_some_and(|extension| extension == "html"));
    paths.sort();
    assert!(!paths.is_empty(), "no pages in {}", folder.display());
    paths.iter().map(|path| File::of(path)).collect()
}
