//! Linear algebra on the graph.

mod ldl;

pub use ldl::Factors;
