//! Linear algebra on the graph, without mechanics.
//!
//! M q̈ = Q is solved by LDLᵀ, unrolled, zeros skipped, the unknown with the fewest neighbours first.
//! Where velocities are sums of other velocities (long chains and trees), `articulated_bodies.rs` eliminates
//! without M, in operations proportional to the number of joints, and `rod_forces.rs` solves for the forces
//! in rods. With constraints `solver.rs` takes the cheaper of two orders: dependent coordinates loop by loop,
//! or q̈ and λ together.
//!
//! Every pivot that can vanish has a guard, behind which the general solver of the runtime stands. Solutions
//! that a guard accepts are accurate (`tests/elimination.rs`). Orders of elimination are compared at states
//! that the checks of the constraints find. An order has to apply where motions are likely to begin, and
//! should apply across headings and on every branch. Of orders that are nearly as short, the best conditioned
//! is taken.

mod articulated_bodies;
mod block;
mod ldl;
mod lengths;
mod minimum_degree;
mod modular;
mod null_space;
mod partition;
mod rod_forces;
mod solver;
mod sparse;
mod structure;
mod unrolled;

pub use articulated_bodies::{ArticulatedForm, Definition, Stationary};
pub(crate) use ldl::Elsewhere;
pub use ldl::Factors;
pub(crate) use minimum_degree::MinimumDegree;
pub(crate) use modular::FreeColumns;
pub(crate) use solver::applies;
pub use solver::{ConstrainedEquations, NotUnrolled, Solver, States, unroll, unroll_by_speeds};
pub use unrolled::{Elimination, Guard, Guarded, Unrolled};
