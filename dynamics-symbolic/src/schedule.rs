//! From nodes to programs: which operations, in which order, computed when.

mod program;

pub use program::{Cost, Program, Step};
