//! Texts: the listing, readable equations, LaTeX, MathML, the report.
//!
//! A target language is one file: an implementation of [`Target`], which says how symbols, numbers, operators
//! and assignments are written. Two drivers feed it: `program` writes programs exactly, step by step, as a
//! compiler needs them; `formula` writes single values readably. `source` writes programs as functions of a
//! language that computes.

mod c;
mod equations;
mod expand;
mod formula;
mod javascript;
mod latex;
mod listing;
mod mathml;
mod names;
mod plain;
mod program;
mod report;
mod series;
mod source;
mod target;
mod wgsl;

pub use c::{ForC, InC, PlainProgram, c};
pub use equations::{EquationTexts, equations, quotient, statements};
pub use formula::Formulas;
pub use javascript::{Portability, Portable, javascript, picture_entry};
pub(crate) use javascript::{PrintedRound, quoted, round};
pub use latex::Latex;
pub use listing::listing;
pub use mathml::{Dots, MathMl, symbol_mathml};
pub use plain::Plain;
pub use program::{Line, Style, divisors, lines};
pub(crate) use report::entry;
pub use report::report;
pub use series::{series_entry, series_section, unexpandable};
pub use target::{Level, Target, Text};
pub use wgsl::{InWgsl, wgsl};
