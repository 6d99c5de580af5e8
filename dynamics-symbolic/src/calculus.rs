//! Differentiation on the graph: local partial derivatives, forward and reverse sweeps, the total time
//! derivative, shorter forms of polynomials in sines and cosines, shared parts of products and sums.

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
