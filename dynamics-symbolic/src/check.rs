//! Model checks: one rule per file, called from a visible list.

mod finding;
pub mod units;

pub use finding::Finding;
