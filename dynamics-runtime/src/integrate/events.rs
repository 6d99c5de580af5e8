//! Zero crossings of event functions within a step: `crossing` brackets them, `root` locates them.

mod crossing;
mod root;

pub use crossing::{Crossing, Direction, Scan, ScanError, sample_position};
pub use root::root;
