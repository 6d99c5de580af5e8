//! Linear algebra on the graph.

mod block;
mod ldl;
mod lengths;
mod levers;
mod minimum_degree;
mod modular;
mod null_space;
mod partition;
mod solver;
mod sparse;
mod structure;
mod tensions;
mod unrolled;

pub(crate) use ldl::Elsewhere;
pub use ldl::Factors;
pub use levers::{Definition, Levers, Stationary};
pub(crate) use minimum_degree::MinimumDegree;
pub(crate) use solver::applies;
pub use solver::{Constrained, Solver, States, Stuck, unroll, unroll_by_speeds};
pub use unrolled::{Elimination, Guard, Guarded, Unrolled};
