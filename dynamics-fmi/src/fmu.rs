//! What is asked for.

use std::path::Path;

use dynamics_runtime::integrate::tables::{DOP853, DORMAND_PRINCE5, Embedded};
use dynamics_runtime::methods;
use dynamics_runtime::model::{PrintedInC, SimulationModel, State};
use dynamics_view::file::{self, Content};

use crate::error::FmuError;
use crate::{archive, binary, description, documentation, plan, sources};

/// Writes models as functional mock-up units.
pub trait ExportFmu: SimulationModel {
    /// The model as a functional mock-up unit of FMI 3.0 that begins at `start`:
    /// `model.fmu(start).write("pendulum.fmu")?`.
    ///
    /// The struct needs `#[model(targets(c))]`.
    fn fmu(&self, start: State<Self>) -> Fmu<'_, Self>
    where
        Self: PrintedInC,
    {
        Fmu::new(self, start)
    }
}

impl<M: SimulationModel> ExportFmu for M {}

/// A method of Co-Simulation. Those of [`methods`] that units have, too, convert into it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum FmuMethod {
    /// Dormand–Prince 5(4): for the short steps between which tools communicate.
    DormandPrince5,
    /// DOP853: for long steps and small tolerances.
    Dop853,
}

impl FmuMethod {
    pub(crate) fn table(self) -> &'static Embedded {
        match self {
            Self::DormandPrince5 => &DORMAND_PRINCE5,
            Self::Dop853 => &DOP853,
        }
    }

    pub(crate) fn name(self) -> &'static str {
        match self {
            Self::DormandPrince5 => "the method of Dormand and Prince of order 5(4)",
            Self::Dop853 => "the method DOP853",
        }
    }
}

impl From<methods::DormandPrince5> for FmuMethod {
    fn from(_: methods::DormandPrince5) -> Self {
        Self::DormandPrince5
    }
}

impl From<methods::Dop853> for FmuMethod {
    fn from(_: methods::Dop853) -> Self {
        Self::Dop853
    }
}

/// A file within a unit.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct FmuFile {
    /// Its path, with `/`: `sources/pendulum.c`.
    pub name: String,
    /// What it holds.
    pub bytes: Vec<u8>,
}

/// A model that is to be written as a functional mock-up unit.
#[must_use = "`.write(path)` writes it"]
pub struct Fmu<'a, M: SimulationModel + PrintedInC> {
    pub(crate) model: &'a M,
    pub(crate) start: State<M>,
    pub(crate) method: FmuMethod,
    pub(crate) tolerance: f64,
    pub(crate) duration: f64,
    pub(crate) binary: bool,
    pub(crate) live_page: bool,
}

/// Tolerance of Co-Simulation, relative and absolute, where none is given: that of simulations.
const TOLERANCE: f64 = 1e-8;
/// How long the default experiment lasts, where nothing else is said.
const DURATION: f64 = 10.0;

impl<'a, M: SimulationModel + PrintedInC> Fmu<'a, M> {
    /// A unit of the model that begins at `start`, with its inputs and the modes of switched constraints.
    pub fn new(model: &'a M, start: State<M>) -> Self {
        let (method, tolerance, duration) = (FmuMethod::DormandPrince5, TOLERANCE, DURATION);
        Self { model, start, method, tolerance, duration, binary: false, live_page: true }
    }

    /// The method of Co-Simulation: [`methods::DormandPrince5`] (default) or [`methods::Dop853`].
    pub fn method(mut self, method: impl Into<FmuMethod>) -> Self {
        self.method = method.into();
        self
    }

    /// The tolerance of Co-Simulation, where the importer gives none: relative, and absolute in nominal
    /// values of the states. The drift from constraints in Model Exchange is kept below a tenth of it.
    /// Default 1e-8.
    pub fn tolerance(mut self, tolerance: f64) -> Self {
        self.tolerance = tolerance;
        self
    }

    /// How long the default experiment lasts, from the time of the start. Default 10.
    pub fn duration(mut self, duration: f64) -> Self {
        self.duration = duration;
        self
    }

    /// Adds a shared library for this platform, made by its compiler of C: the environment variable `CC`, or
    /// `cc`. Without it importers compile the sources.
    pub fn with_binary(mut self) -> Self {
        self.binary = true;
        self
    }

    /// The documentation is a page of equations and variables, without scripts, instead of the live page.
    pub fn without_live_page(mut self) -> Self {
        self.live_page = false;
        self
    }

    /// The files of the unit, as [`write`](Self::write) puts them into its archive.
    ///
    /// # Errors
    /// What cannot be written, by name; a compiler that is not there or refuses.
    pub fn files(&self) -> Result<Vec<FmuFile>, FmuError> {
        let plan = plan::plan(self)?;
        let text = |name: &str, text: String| FmuFile { name: name.to_owned(), bytes: text.into_bytes() };
        let sources = sources::sources(self, &plan);
        let mut files = vec![text("modelDescription.xml", description::model(self, &plan))];
        files.push(text("sources/buildDescription.xml", description::build::<M>(&sources)));
        let named = |(name, source): &(String, String)| text(&format!("sources/{name}"), source.clone());
        files.extend(sources.iter().map(named));
        files.push(text("documentation/index.html", documentation::page(self, &plan)));
        files.push(text("documentation/licenses/fmi-headers.txt", sources::HEADERS_LICENSE.to_owned()));
        if self.binary {
            files.push(binary::library(M::C.name, &sources)?);
        }
        Ok(files)
    }

    /// Writes the unit, whose extension is `.fmu`, and creates the folders of its path.
    ///
    /// # Errors
    /// What cannot be written, by name, before there is a file; another extension; a file that cannot be
    /// written.
    pub fn write(&self, path: impl AsRef<Path>) -> Result<(), FmuError> {
        let path = path.as_ref();
        file::check(path, Content::Unit)?;
        let bytes = archive::archive(&self.files()?)?;
        Ok(file::write(path, Content::Unit, &bytes)?)
    }
}
