//! Models in other languages: C99 for controllers and other programs.
//!
//! The macro prints a model's programs in C where `#[model(targets(c))]` stands on the struct
//! ([`PrintedInC`](dynamics_runtime::model::PrintedInC)). This crate makes files of them: the smooth
//! functions of the model as tables, an example with its parameters and a start, and a `Makefile`.
//!
//! | file | what it does |
//! |---|---|
//! | `export` | [`CExport`], the builder: what the user chooses |
//! | `plan` | what can be written, and what not |
//! | `source` | header and source as they are compiled |
//! | `functions` | smooth functions as tables |
//! | `example` | `main.c` and the `Makefile` |

mod error;
mod example;
mod export;
mod functions;
mod plan;
mod source;

pub use error::ExportError;
pub use export::{CExport, ExportC};
