//! Total time derivative d/dt.

use crate::graph::{Dependence, Graph, NodeId, Symbol};

use super::forward::directional;

/// Why an expression has no time derivative in terms of q, q̇, q̈, t.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum NotDifferentiable {
    /// It contains an input, whose rate is unknown.
    Input,
    /// It contains an acceleration, whose rate is unknown.
    Acceleration,
    /// It contains a multiplier, whose rate is unknown.
    Multiplier,
}

/// d/dt of `roots`: q → q̇ → q̈, t → 1, parameters constant.
pub fn total_derivative(g: &mut Graph, roots: &[NodeId]) -> Result<Vec<NodeId>, NotDifferentiable> {
    for root in roots {
        if g.dependence(*root).on(Dependence::INPUTS) {
            return Err(NotDifferentiable::Input);
        }
        if g.dependence(*root).on(Dependence::ACCELERATIONS) {
            return Err(NotDifferentiable::Acceleration);
        }
        if g.dependence(*root).on(Dependence::MULTIPLIERS) {
            return Err(NotDifferentiable::Multiplier);
        }
    }
    Ok(directional(g, roots, &mut |g, symbol| match symbol {
        Symbol::Time => Some(g.one()),
        Symbol::Coordinate(i) => Some(g.symbol(Symbol::Rate(i))),
        Symbol::Rate(i) => Some(g.symbol(Symbol::Acceleration(i))),
        // A mode changes at events only.
        Symbol::Acceleration(_)
        | Symbol::Input(_)
        | Symbol::Parameter(_)
        | Symbol::Multiplier(_)
        | Symbol::Mode(_) => None,
    }))
}
