//! Differentiation on the graph: local partial derivatives, forward sweeps (directional derivatives), reverse
//! sweeps (gradients), the total time derivative.
//!
//! The derivative of a choice (`if`, min, max) is a choice between derivatives, never a sum weighted by 1 and
//! 0: the branch that is not taken may be NaN. The conventions at kinks are in one file with the local
//! derivatives.
//!
//! Shorter forms (like terms, sin² + cos², common factors, shared parts of products and sums) are looked
//! for in the terms of constrained systems. Each is kept only if all results together become cheaper.

mod collect;
mod forward;
mod local;
mod placeless;
mod reverse;
mod share;
mod substitute;
mod timeless;
mod total;

pub use collect::{Collected, collect};
pub use forward::directional;
pub use placeless::placeless;
pub use reverse::gradient;
pub use share::share;
pub(crate) use substitute::rebuild;
pub use substitute::{ZeroDenominator, substitute};
pub use timeless::timeless;
pub use total::{NotDifferentiable, total_derivative};
