//! What is asked for.

use std::fs;
use std::path::Path;

use dynamics_runtime::model::{PrintedInC, SimulationModel, State};
use dynamics_view::FileError;

use crate::error::ExportError;
use crate::{example, plan, source};

/// Writes models in C.
pub trait ExportC: SimulationModel {
    /// Writes the model as C99 to a folder, which is created: `name.h`, `name.c`, an example `main.c` that
    /// moves it, and a `Makefile`. Files of these names are replaced, but for a `main.c` or a `Makefile`
    /// of your own. The name is that of the struct in small
    /// letters.
    ///
    /// [`in_c`](Self::in_c) has options.
    ///
    /// # Errors
    /// What cannot be written in C, by name, before any file exists; a file that cannot be written.
    fn write_c(&self, folder: impl AsRef<Path>) -> Result<(), ExportError>
    where
        Self: PrintedInC,
    {
        self.in_c().write(folder)
    }

    /// The model in C, with options: `model.in_c().start(start).single_precision().write("folder")?`.
    fn in_c(&self) -> CExport<'_, Self>
    where
        Self: PrintedInC,
    {
        CExport::new(self)
    }
}

impl<M: SimulationModel> ExportC for M {}

/// A model that is to be written in C.
#[must_use = "`.write(folder)` writes it"]
pub struct CExport<'a, M: SimulationModel + PrintedInC> {
    pub(crate) model: &'a M,
    pub(crate) start: Option<M::State>,
    pub(crate) step: f64,
    pub(crate) duration: f64,
    pub(crate) single: bool,
    pub(crate) library_sines: bool,
    pub(crate) example: bool,
}

/// Step of the example, in the unit of time, where none is given.
const STEP: f64 = 1e-3;
/// How long the example moves, where nothing else is said.
const DURATION: f64 = 10.0;

/// The files of the example.
const MAIN: &str = "main.c";
const MAKEFILE: &str = "Makefile";

/// Whether a file of the example was written here, by its first line.
fn is_ours(text: &[u8]) -> bool {
    let first = text.split(|&byte| byte == b'\n').next().unwrap_or_default();
    String::from_utf8_lossy(first).contains(example::OURS)
}

impl<'a, M: SimulationModel + PrintedInC> CExport<'a, M> {
    /// A model in doubles with the sines of `<math.h>`.
    pub fn new(model: &'a M) -> Self {
        let (step, duration) = (STEP, DURATION);
        Self { model, start: None, step, duration, single: false, library_sines: false, example: true }
    }

    /// Where the example begins, with the values of inputs and the modes of switched constraints, which it
    /// holds. Default: everything 0.
    pub fn start(mut self, start: State<M>) -> Self {
        self.start = Some(start);
        self
    }

    /// Step of the example, by default 0.001.
    pub fn step(mut self, step: f64) -> Self {
        self.step = step;
        self
    }

    /// For how long the example moves, by default 10. Its last step ends there and may be shorter.
    pub fn duration(mut self, duration: f64) -> Self {
        self.duration = duration;
        self
    }

    /// Numbers are floats instead of doubles.
    pub fn single_precision(mut self) -> Self {
        self.single = true;
        self
    }

    /// Sines and cosines are those of this library, which the text then contains, instead of those of
    /// `<math.h>`. Compiled with `-ffp-contract=off`, as the `Makefile` does, the programs then have the bits
    /// of Rust, as far as the other functions of `<math.h>` have.
    pub fn library_sines(mut self) -> Self {
        self.library_sines = true;
        self
    }

    /// Only `name.h` and `name.c` are made, no `main.c` and no `Makefile`. Start, step and duration are not
    /// looked at.
    pub fn without_example(mut self) -> Self {
        self.example = false;
        self
    }

    /// The files by their names, as [`write`](Self::write) writes them.
    ///
    /// # Errors
    /// What cannot be written in C, by name.
    pub fn files(&self) -> Result<Vec<(String, String)>, ExportError> {
        let plan = plan::plan(self)?;
        let name = M::C.name;
        let mut files = vec![
            (format!("{name}.h"), source::header(self)),
            (format!("{name}.c"), source::source(self, &plan)),
        ];
        if let Some(plan) = &plan.example {
            files.push((MAIN.to_owned(), example::main(self, plan)));
            files.push((MAKEFILE.to_owned(), example::makefile(name)));
        }
        Ok(files)
    }

    /// Header and source as one text without `#include`, for compilers that have no files: those of graphics
    /// cards. It needs what `<math.h>` and `<float.h>` have.
    ///
    /// # Errors
    /// What cannot be written in C, by name.
    pub fn text(&self) -> Result<String, ExportError> {
        let files = self.files()?;
        let name = M::C.name;
        let sources =
            files.iter().filter(|(file, _)| [".h", ".c"].iter().any(|end| *file == format!("{name}{end}")));
        let lines = sources.flat_map(|(_, text)| text.lines()).filter(|line| !line.starts_with("#include"));
        Ok(lines.map(|line| format!("{line}\n")).collect())
    }

    /// Writes all files to a folder, which is created. Files of these names are replaced, but for a `main.c`
    /// or a `Makefile` of your own.
    ///
    /// # Errors
    /// What cannot be written in C, by name, and a `main.c` or `Makefile` that was not written here, before
    /// any file is; a file that cannot be written.
    pub fn write(&self, folder: impl AsRef<Path>) -> Result<(), ExportError> {
        let folder = folder.as_ref();
        let files = self.files()?;
        let failed = |path: &Path, action| {
            let path = path.to_path_buf();
            move |source| FileError { path, action, source }
        };
        let names = files.iter().map(|(name, _)| name.as_str());
        for path in names.filter(|name| [MAIN, MAKEFILE].contains(name)).map(|name| folder.join(name)) {
            if fs::read(&path).is_ok_and(|text| !is_ours(&text)) {
                return Err(ExportError::Foreign { path });
            }
        }
        fs::create_dir_all(folder).map_err(failed(folder, "create the folder"))?;
        for (name, text) in files {
            let path = folder.join(name);
            fs::write(&path, text).map_err(failed(&path, "write"))?;
        }
        Ok(())
    }
}
