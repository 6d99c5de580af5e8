//! Differentiation on the graph: local partial derivatives, forward and reverse sweeps, the total time derivative.

mod forward;
mod local;
mod reverse;
mod substitute;
mod timeless;
mod total;

pub use forward::directional;
pub use reverse::gradient;
pub use substitute::{ZeroDenominator, substitute};
pub use timeless::timeless;
pub use total::{NotDifferentiable, total_derivative};
