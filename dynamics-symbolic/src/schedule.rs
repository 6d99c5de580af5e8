//! From nodes to programs: which operations, in which order, computed when.

mod order;
mod program;

pub use order::{Staging, schedule};
pub use program::{Cost, Program, Step};
