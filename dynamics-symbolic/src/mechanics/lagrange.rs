//! M and Q from a Lagrangian, in general: p = ∂L/∂q̇ by a reverse sweep, M = ∂p/∂q̇ by forward sweeps of p,
//! Coriolis and centripetal terms as ∂p/∂q·q̇ + ∂p/∂t, one forward sweep, minus ∂L/∂q.

use crate::calculus::{directional, gradient};
use crate::graph::{Graph, NodeId, Symbol};

/// d/dt(∂L/∂q̇) − ∂L/∂q = M q̈ − Q.
#[derive(Clone, Debug)]
pub(super) struct Inertia {
    /// M, N×N.
    pub(super) mass: Vec<Vec<NodeId>>,
    /// Q without applied forces.
    pub(super) force: Vec<NodeId>,
    /// ∂L/∂q̇.
    pub(super) momenta: Vec<NodeId>,
}

/// The symbols q or q̇ of n coordinates.
pub(super) fn symbols(n: usize, kind: fn(u32) -> Symbol) -> Vec<Symbol> {
    (0..n as u32).map(kind).collect()
}

/// Derives from L = `lagrangian` for n coordinates.
pub(super) fn lagrange(g: &mut Graph, lagrangian: NodeId, n: usize) -> Inertia {
    let one = g.one();
    let momenta = gradient(g, &[(lagrangian, one)], &symbols(n, Symbol::Rate));
    let mut mass = vec![vec![one; n]; n];
    for j in 0..n {
        let column = directional(g, &momenta[j..], &mut |g, s| (s == Symbol::Rate(j as u32)).then(|| g.one()));
        for (i, entry) in (j..n).zip(column) {
            mass[i][j] = entry;
            mass[j][i] = entry;
        }
    }
    let transport = directional(g, &momenta, &mut |g, s| match s {
        Symbol::Coordinate(i) => Some(g.symbol(Symbol::Rate(i))),
        Symbol::Time => Some(g.one()),
        _ => None,
    });
    let slope = gradient(g, &[(lagrangian, one)], &symbols(n, Symbol::Coordinate));
    let force = slope.into_iter().zip(transport).map(|(s, t)| g.sub(s, t)).collect();
    Inertia { mass, force, momenta }
}
