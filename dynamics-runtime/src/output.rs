//! What shows a motion: tables (CSV), charts (SVG, and PNG with the feature `png`) and animations (one HTML
//! page without network access).
//!
//! Everything renders to a `String` with the feature `alloc`; files are written with `std`. The pictures are
//! built with `libm` alone, so that the same data give the same bytes on every machine.
//!
//! | what | type | from a motion |
//! |---|---|---|
//! | a picture of one instant | [`Drawing`] | the `#[drawing]` function |
//! | a moving picture | [`Animation`] | `motion.animate("run.html")` |
//! | curves | [`Chart`], [`Panel`] | `motion.plot("run.svg")`, `.png` |
//! | numbers | [`csv::Csv`] | `motion.write_csv("run.csv")` |
//!
//! A path whose extension names another format is an error, before anything is written; a path without an
//! extension gets the first format of its row.

mod animation;
mod atlas;
mod chart;
mod color;
pub mod csv;
mod drawing;
mod error;
mod export;
#[cfg(feature = "std")]
pub(crate) mod file;
#[cfg(test)]
mod json_check;
mod motion;
mod places;
#[cfg(feature = "png")]
mod png;
mod point;
mod reduce;
mod svg;
pub(crate) mod text;
mod ticks;
#[cfg(test)]
mod xml_check;

pub use animation::{Animation, Film};
pub use chart::{Axis, Chart, Mark, Panel, Scale, Series};
pub use color::Color;
pub use drawing::{Drawing, Figure, Shape};
pub use error::OutputError;
#[cfg(feature = "std")]
pub use file::FileError;
pub use point::{Number, Placement, Places, Point};
