//! Differentiation on the graph: local partial derivatives, forward sweeps (directional derivatives), reverse
//! sweeps (gradients), the total time derivative.
//!
//! The derivative of a choice (`if`, min, max) is a choice between derivatives, never a sum weighted by 1 and
//! 0: the branch that is not taken may be NaN. The conventions at kinks are in one file with the local
//! derivatives.
//!
//! Shorter forms (like terms, sin² + cos², common factors, shared parts of products and sums) are looked
//! for in the terms of constrained systems. Each is kept only if all results together become cheaper.

mod collect_terms;
mod forward;
mod local;
mod remove_coordinates;
mod remove_time;
mod reverse;
mod share_parts;
mod substitute;
mod total;

pub use collect_terms::{Collected, collect_terms};
pub use forward::{ForwardSweeps, directional};
pub use remove_coordinates::remove_coordinates;
pub use remove_time::remove_time;
pub use reverse::{gradient, gradient_entries};
pub use share_parts::share_parts;
pub(crate) use substitute::rebuild;
pub use substitute::{ZeroDenominator, substitute};
pub use total::{NotDifferentiable, total_derivative};
