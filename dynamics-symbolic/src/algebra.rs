//! Linear algebra on the graph.

mod ldl;
mod unrolled;

pub use ldl::Factors;
pub use unrolled::{Elimination, Guard, Guarded, Unrolled};
