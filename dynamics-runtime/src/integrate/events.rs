//! Where event functions change sign within a step.

mod crossing;
mod root;

pub use crossing::{Crossing, Direction, Scan, ScanError, place};
pub use root::root;
