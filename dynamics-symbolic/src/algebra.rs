//! Linear algebra on the graph. Nothing here knows mechanics.
//!
//! M q̈ = Q is solved by LDLᵀ, unrolled, zeros skipped, the unknown with the fewest neighbours first.
//! Where velocities are made of one another (long chains and trees), `levers.rs` eliminates without M, in
//! operations proportional to the joints, and `tensions.rs` solves for the forces in rods. With constraints
//! `solver.rs` takes the cheaper of two ways: independent coordinates with the others loop by loop, or q̈
//! and λ together.
//!
//! Every pivot that can vanish has a guard. Behind it the general solver of the runtime stands. What a guard
//! lets pass has its digits (`tests/elimination.rs`). Orders of elimination are judged by states that the
//! checks of the constraints find: an order has to apply where motions are likely to begin, should apply
//! across headings and on every branch, and of orders that are nearly as short the best conditioned is taken.

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
pub use solver::{ConstrainedEquations, Solver, States, Stuck, unroll, unroll_by_speeds};
pub use unrolled::{Elimination, Guard, Guarded, Unrolled};
