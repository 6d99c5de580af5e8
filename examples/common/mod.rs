//! Where the examples put what they show.

use std::error::Error;
use std::path::{Path, PathBuf};

use dynamics::live::{LiveError, LivePage};

/// What `main` of an example returns.
pub(crate) type Outcome = Result<(), Box<dyn Error>>;

/// A live page of an example: the example writes it beside its animation, the gallery into its folder.
#[allow(dead_code)] // some examples have none
pub(crate) type Page = Result<LivePage, Box<dyn Error>>;

/// The files of one example, under `target/examples-output/<example>/`.
pub(crate) struct Files {
    folder: PathBuf,
    written: Vec<PathBuf>,
}

impl Files {
    /// The files of the named example.
    pub(crate) fn of(example: &str) -> Self {
        let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("target/examples-output").join(example);
        Self { folder, written: Vec::new() }
    }

    /// The path of a file to be written.
    pub(crate) fn path(&mut self, name: &str) -> PathBuf {
        let path = self.folder.join(name);
        self.written.push(path.clone());
        path
    }

    /// Writes the example's live page.
    #[allow(dead_code)] // some examples have none
    pub(crate) fn live(&mut self, page: LivePage) -> Result<(), LiveError> {
        page.write_html(self.path("live.html"))
    }

    /// Prints the paths, relative to where the program runs if they lie below.
    pub(crate) fn list(self) {
        let here = std::env::current_dir().unwrap_or_default();
        println!("\nto look at:");
        for path in &self.written {
            println!("  {}", path.strip_prefix(&here).unwrap_or(path).display());
        }
    }
}

#[allow(dead_code)] // the tour shows its motion by the motion's own plots
/// Times from 0 to `end` at equal distances.
pub(crate) fn times(end: f64, intervals: u32) -> impl Iterator<Item = f64> + Clone {
    (0..=intervals).map(move |k| end * f64::from(k) / f64::from(intervals))
}
