//! The pictures of `dynamics`: figures in, files out. This crate contains no mechanics.
//!
//! Drawings, charts and animations become text with an allocator alone, and files with the feature `std`.
//! The pictures are built with `libm` alone, so that the same data give the same bytes on every machine.
//!
//! Users name only the façade crate `dynamics`.
// Unit tests run on a machine with the standard library, whatever the features.
#![cfg_attr(not(any(feature = "std", test)), no_std)]

extern crate alloc;

mod animation;
mod chart;
mod color;
mod drawing;
mod error;
mod export;
#[cfg(feature = "std")]
pub mod file;
mod heat_map;
#[cfg(feature = "png")]
mod png;
mod point;
mod reduce;
#[doc(hidden)]
pub mod scripts;
mod suggest;
mod svg;
pub mod text;
mod ticks;

pub use animation::{Animation, Film};
pub use chart::{Axis, Chart, Mark, Panel, Scale, Series};
pub use color::Color;
pub use drawing::{Drawing, Figure, Shape};
pub use error::OutputError;
#[cfg(feature = "std")]
pub use file::FileError;
pub use heat_map::HeatMap;
pub use point::{Number, Placement, Places, Point};
pub use suggest::suggest;
