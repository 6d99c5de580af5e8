//! Derivatives along one direction: how fast everything changes where state, inputs, parameters and time
//! move.
//!
//! One forward sweep through the solved equations. It costs about three evaluations, whatever the number of
//! coordinates; a matrix of all derivatives costs one for each of them. Implicit integrators without
//! matrices, observers and importers of functional mock-up units ask for such products.

use crate::calculus::directional;
use crate::graph::{Graph, NodeId, Symbol};

use super::{Equations, Model, Solution};

/// The symbols behind a model's own: rates of what they follow. `Coordinate(n + i)` is the rate of the
/// coordinate i along the direction, `Coordinate(2n)` that of time.
fn direction_of(model: &Model, symbol: Symbol) -> Option<Symbol> {
    let (n, w, p) =
        (model.coordinates.len() as u32, model.inputs.len() as u32, model.parameters.len() as u32);
    match symbol {
        Symbol::Time => Some(Symbol::Coordinate(2 * n)),
        Symbol::Coordinate(i) if i < n => Some(Symbol::Coordinate(n + i)),
        Symbol::Rate(i) if i < n => Some(Symbol::Rate(n + i)),
        Symbol::Input(i) if i < w => Some(Symbol::Input(w + i)),
        Symbol::Parameter(i) if i < p => Some(Symbol::Parameter(p + i)),
        _ => None,
    }
}

/// Rates of q̈ and λ along a direction, then those of `others`, which may read q̈ and λ as symbols. `None`
/// where q̈ is found by the general solver, and where constraints are switched, because every set of them has
/// a solution of its own.
pub fn directions(model: &mut Model, equations: &Equations, others: &[NodeId]) -> Option<Vec<NodeId>> {
    let (accelerations, multipliers): (&[NodeId], &[NodeId]) = match &equations.constraints {
        None => (&equations.accelerations, &[]),
        Some(_) if model.constraints.iter().any(|constraint| constraint.switched) => return None,
        Some(constraints) => match &constraints.solution {
            Solution::Unrolled(unrolled) => (&unrolled.accelerations, &unrolled.multipliers),
            Solution::General(_) => return None,
        },
    };
    let solved = [accelerations, multipliers].concat();
    let mut graph = std::mem::take(&mut model.graph);
    let own = |g: &mut Graph, symbol| direction_of(model, symbol).map(|rate| g.symbol(rate));
    let mut all = directional(&mut graph, &solved, &mut |g, symbol| own(g, symbol));
    let (of_accelerations, of_multipliers) = all.split_at(accelerations.len());
    let mut seed = |g: &mut Graph, symbol| match symbol {
        Symbol::Acceleration(i) => of_accelerations.get(i as usize).copied(),
        Symbol::Multiplier(i) => of_multipliers.get(i as usize).copied(),
        other => own(g, other),
    };
    let rest = directional(&mut graph, others, &mut seed);
    all.extend(rest);
    model.graph = graph;
    Some(all)
}
