//! Models as functional mock-up units (FMUs) of FMI 3.0, for other simulation tools: Model Exchange and
//! Co-Simulation, as sources in C99.
//!
//! ```ignore
//! model.fmu(start).tolerance(1e-9).write("pendulum.fmu")?;
//! ```
//!
//! The programs are those that `#[model(targets(c))]` prints. This crate adds the functions of the standard
//! (`c/`), the description of all variables, and the archive.
//!
//! | file | what it does |
//! |---|---|
//! | `fmu` | [`Fmu`], the builder: what the user chooses |
//! | `plan` | what can be written, and what not |
//! | `variables` | the variables, their names and value references |
//! | `units` | units as powers of base units |
//! | `dependencies` | what results depend on |
//! | `description` | `modelDescription.xml`, `buildDescription.xml` |
//! | `sources` | the templates of `c/`, filled |
//! | `table` | the table of the method as C |
//! | `documentation` | `documentation/index.html` |
//! | `binary` | a shared library, by the compiler of the platform |
//! | `archive` | the file itself |

mod archive;
mod binary;
mod dependencies;
mod description;
mod documentation;
mod error;
mod fmu;
mod plan;
mod sources;
mod table;
mod units;
mod variables;

pub use error::FmuError;
pub use fmu::{ExportFmu, Fmu, FmuFile, FmuMethod};
