//! Output of motions: tables (CSV), charts (SVG, and PNG with the feature `png`) and animations (one HTML
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

mod chart_switching;
pub mod csv;
mod motion;

#[cfg(feature = "std")]
pub use dynamics_view::FileError;
pub use dynamics_view::{
    Animation, Axis, Chart, Color, Drawing, Figure, Film, Mark, Number, OutputError, Panel, Placement,
    Places, Point, Scale, Series, Shape,
};
