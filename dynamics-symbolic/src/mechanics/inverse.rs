//! Derivatives of q̈ by the implicit function theorem: with r(q̈; x) = M q̈ − Q = 0, ∂q̈/∂x = −M⁻¹ ∂r/∂x at fixed q̈.

use crate::algebra::Factors;
use crate::calculus::{ZeroDenominator, directional, gradient, substitute};
use crate::graph::{Dependence, Graph, NodeId, Symbol};

use super::equations::Jacobians;
use super::lagrange::symbols;

/// r = M q̈ − Q with symbols for q̈, from the entries of M and Q.
pub(super) fn residual_by_entries(g: &mut Graph, mass: &[Vec<NodeId>], force: &[NodeId]) -> Vec<NodeId> {
    let mut residual = Vec::with_capacity(force.len());
    for (row, f) in mass.iter().zip(force) {
        let mut sum = g.neg(*f);
        for (j, entry) in row.iter().enumerate() {
            let a = g.symbol(Symbol::Acceleration(j as u32));
            let term = g.mul(*entry, a);
            sum = g.add(sum, term);
        }
        residual.push(sum);
    }
    residual
}

/// A way to write r.
pub(super) type Residual<'a> = &'a dyn Fn(&mut Graph) -> Vec<NodeId>;

/// Most coordinates for which all ways to derive Jacobians are tried; above, copies of the graph would take longer than the rest.
const SMALL: usize = 4;

/// All derivatives of q̈, by the cheapest of the given ways; the first of them, swept as `sweep` says, where trying them takes too long.
pub(super) fn jacobians(
    g: &mut Graph,
    ways: &[Residual],
    sweep: Sweep,
    (factors, accelerations): (&Factors, &[NodeId]),
    (inputs, parameters): (usize, usize),
) -> Result<Jacobians, Failure> {
    let n = accelerations.len();
    let mut best = (usize::MAX, ways[0], sweep);
    if n <= SMALL {
        for (way, sweep) in ways.iter().flat_map(|way| [(way, Sweep::Forward), (way, Sweep::Reverse)]) {
            // On a copy, so that what is not taken leaves no trace.
            let mut trial = g.clone();
            let residual = way(&mut trial);
            let implicit = Implicit { residual: &residual, factors, accelerations };
            let moving = [symbols(n, Symbol::Coordinate), symbols(n, Symbol::Rate)].concat();
            let roots = implicit.jacobian(&mut trial, &moving, sweep)?.concat();
            let operations = trial.operations(&[&roots, accelerations].concat());
            if operations < best.0 {
                best = (operations, *way, sweep);
            }
        }
    }
    let (_, way, sweep) = best;
    let residual = way(g);
    Implicit { residual: &residual, factors, accelerations }.jacobians(g, sweep, inputs, parameters)
}

/// How ∂r/∂x is swept.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Sweep {
    /// One forward sweep per symbol x.
    Forward,
    /// One reverse sweep per coordinate.
    Reverse,
}

/// Why there are no derivatives.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Failure {
    /// A denominator becomes identically zero.
    ZeroDenominator,
    /// More nodes than can end in programs that are emitted.
    TooLarge(usize),
}

impl From<ZeroDenominator> for Failure {
    fn from(_: ZeroDenominator) -> Self {
        Self::ZeroDenominator
    }
}

/// Nodes after which deriving Jacobians is given up: three for each operation that can be emitted. The largest model that fits takes half.
pub(super) const MOST_NODES: usize = 60_000;

/// What all derivatives of q̈ need.
struct Implicit<'a> {
    /// r with symbols for q̈.
    residual: &'a [NodeId],
    /// Factors of M.
    factors: &'a Factors,
    /// q̈.
    accelerations: &'a [NodeId],
}

impl Implicit<'_> {
    /// All derivatives of a model with as many coordinates as M, and so many inputs and parameters.
    fn jacobians(&self, g: &mut Graph, sweep: Sweep, inputs: usize, parameters: usize) -> Result<Jacobians, Failure> {
        let n = self.residual.len();
        Ok(Jacobians {
            by_q: self.jacobian(g, &symbols(n, Symbol::Coordinate), sweep)?,
            by_u: self.jacobian(g, &symbols(n, Symbol::Rate), sweep)?,
            by_inputs: self.jacobian(g, &symbols(inputs, Symbol::Input), Sweep::Forward)?,
            by_parameters: self.jacobian(g, &symbols(parameters, Symbol::Parameter), Sweep::Reverse)?,
        })
    }

    /// ∂q̈/∂x for the given symbols x: one row per coordinate.
    pub(super) fn jacobian(&self, g: &mut Graph, by: &[Symbol], sweep: Sweep) -> Result<Vec<Vec<NodeId>>, Failure> {
        let start = g.len();
        let columns: Vec<Vec<NodeId>> = match sweep {
            Sweep::Forward => {
                by.iter().map(|x| directional(g, self.residual, &mut |g, s| (s == *x).then(|| g.integer(-1)))).collect()
            }
            Sweep::Reverse => {
                let minus = g.integer(-1);
                let rows: Vec<_> = self.residual.iter().map(|r| gradient(g, &[(*r, minus)], by)).collect();
                (0..by.len()).map(|j| rows.iter().map(|row| row[j]).collect()).collect()
            }
        };
        let mut result = vec![Vec::with_capacity(by.len()); self.residual.len()];
        for column in columns {
            let right = with_accelerations(g, &column, self.accelerations)?;
            for (row, x) in result.iter_mut().zip(self.factors.solve(g, &right)) {
                row.push(x);
            }
            if g.len() - start > MOST_NODES {
                return Err(Failure::TooLarge(g.len() - start));
            }
        }
        Ok(result)
    }
}

/// Replaces the symbols q̈ by their values.
pub(super) fn with_accelerations(
    g: &mut Graph,
    roots: &[NodeId],
    accelerations: &[NodeId],
) -> Result<Vec<NodeId>, ZeroDenominator> {
    if roots.iter().all(|r| !g.dependence(*r).on(Dependence::ACCELERATIONS)) {
        return Ok(roots.to_vec());
    }
    substitute(g, roots, &mut |_, s| match s {
        Symbol::Acceleration(i) => accelerations.get(i as usize).copied(),
        _ => None,
    })
}
