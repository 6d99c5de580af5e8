//! From nodes to straight-line programs: which operations, in which order, computed when.
//!
//! What depends on parameters alone is hoisted. There is one `sin_cos` per angle. Angles that are known at
//! the same time have their sines and cosines together, in calls of four. The rest is in depth-first order.

mod order;
mod program;

pub use order::{Staging, schedule};
pub use program::{Cost, Program, Step};
