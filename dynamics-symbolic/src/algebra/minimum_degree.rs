//! q̈ and λ together, sparse: the symmetric system
//!
//!   ⎡ M  Φ_qᵀ ⎤ ⎡  q̈ ⎤   ⎡ Q ⎤
//!   ⎣ Φ_q  0  ⎦ ⎣ −λ ⎦ = ⎣ γ ⎦
//!
//! as LDLᵀ with the fewest neighbours first, a multiplier only after every coordinate in its row. Coordinates
//! then have the positive pivots of M and multipliers the negative ones of −Φ_q M⁻¹ Φ_qᵀ, so that no pivoting
//! is needed while M is definite and Φ_q has full rank. A coordinate without inertia waits until multipliers
//! of its rows have given it some. For open and closed chains the work grows linearly.

use crate::graph::{Graph, NodeId};

use super::ldl::{Elsewhere, Factors, Rest};
use super::unrolled::{Guard, Guarded, LEAST_INERTIA_RATIO};

/// Smallest sin² of the angle, in the metric of M⁻¹, between a constraint and those eliminated before.
/// Nearer ones, within 1e-4 rad, go to the general solver.
const LEAST_SINE_SQUARED: f64 = 1e-8;

/// The factored system.
#[derive(Clone, Debug)]
pub(crate) struct MinimumDegree {
    factors: Factors,
    coordinates: usize,
    pub(crate) guards: Vec<Guard>,
}

impl MinimumDegree {
    /// Factors the system of M (N×N) and Φ_q (R×N); `None` where only pivots that are zero in every state are
    /// left.
    pub(crate) fn new(g: &mut Graph, mass: &[Vec<NodeId>], jacobian: &[Vec<NodeId>]) -> Option<Self> {
        let (n, r) = (mass.len(), jacobian.len());
        let mut rest = Rest::new(n + r);
        for (i, row) in mass.iter().enumerate() {
            row[..=i].iter().enumerate().for_each(|(j, entry)| rest.set(g, i, j, *entry));
        }
        for (i, row) in jacobian.iter().enumerate() {
            row.iter().enumerate().for_each(|(j, entry)| rest.set(g, n + i, j, *entry));
        }
        let mut system = Self { factors: Factors::empty(g, n + r), coordinates: n, guards: Vec::new() };
        // What the coordinates give to the diagonal of a multiplier, before other multipliers take from it,
        // or the other way round.
        let mut given = vec![g.zero(); n + r];
        while !rest.is_done() {
            let has_pivot = |k: usize| !g.is_zero(rest.diagonal(g, k));
            let ready =
                |k: usize| has_pivot(k) && (k < n || !rest.neighbours(k).any(|i| i < n && has_pivot(i)));
            let k = rest.fewest_neighbours(ready)?;
            let pivot = rest.diagonal(g, k);
            for (i, product) in system.factors.eliminate(g, &mut rest, k)? {
                if (k < n) != (i < n) {
                    given[i] = g.add(given[i], product);
                }
            }
            if g.as_number(pivot).is_none() {
                let (of, scale, tolerance) = match k.checked_sub(n) {
                    Some(row) => (Guarded::Row(row), given[k], LEAST_SINE_SQUARED),
                    // A coordinate without inertia of its own has that of its constraints.
                    None if g.is_zero(mass[k][k]) => (Guarded::Coordinate(k), given[k], LEAST_SINE_SQUARED),
                    None => (Guarded::Coordinate(k), mass[k][k], LEAST_INERTIA_RATIO),
                };
                system.guards.push(Guard { of, pivot, scale, tolerance });
            }
        }
        Some(system)
    }

    /// δ.
    pub(super) fn correct(&self, g: &mut Graph, right: &[NodeId]) -> Vec<NodeId> {
        let zero = vec![g.zero(); self.coordinates];
        self.solve(g, &zero, right).0
    }

    /// q̈ and λ.
    pub(super) fn solve(
        &self,
        g: &mut Graph,
        force: &[NodeId],
        gamma: &[NodeId],
    ) -> (Vec<NodeId>, Vec<NodeId>) {
        let right = [force, gamma].concat();
        let mut x = self.factors.solve(g, &right);
        let opposite = x.split_off(self.coordinates);
        (x, opposite.into_iter().map(|y| g.neg(y)).collect())
    }

    /// q̈ and λ, joined, where right-hand sides (Q and γ, joined) and solution are nodes of another graph.
    pub(crate) fn solve_elsewhere(&self, other: &mut impl Elsewhere, right: &[NodeId]) -> Vec<NodeId> {
        let mut x = self.factors.solve_elsewhere(other, right);
        x[self.coordinates..].iter_mut().for_each(|y| *y = other.graph().neg(*y));
        x
    }
}
