//! Derivatives of q̈ by the implicit function theorem: with r(q̈; x) = M q̈ − Q = 0, ∂q̈/∂x = −M⁻¹ ∂r/∂x at
//! fixed q̈.
//!
//! With constraints r is joined by Φ_q q̈ − γ = Φ̈, Φ_qᵀλ enters its first part, and the derivatives of q̈
//! and λ together solve the same system as q̈ and λ themselves.

use crate::calculus::{ForwardSweeps, ZeroDenominator, gradient, gradient_entries, remove_time, substitute};
use crate::graph::{Dependence, Graph, NodeId, Symbol};

use super::equations::{Jacobians, Variations};
use super::limits::MOST_NODES;
use super::model::{make_symbols, symbols};

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

/// Most coordinates for which all ways to derive Jacobians are tried and the cheapest is taken. With more,
/// copying the graph takes longer than everything else.
const MOST_COORDINATES_COMPARED: usize = 4;

/// Equations that were solved: their solution, and the way to solve them for other right-hand sides.
pub(super) struct SolvedFor<'a> {
    /// q̈, N.
    pub(super) accelerations: &'a [NodeId],
    /// λ; empty without constraints.
    pub(super) multipliers: &'a [NodeId],
    /// The first N unknowns of the linear system for a right-hand side as long as r.
    pub(super) solve: &'a dyn Fn(&mut Graph, &[NodeId]) -> Vec<NodeId>,
}

/// All derivatives of q̈, by the cheapest of the given ways; the first of them, swept as `sweep` says, where
/// trying them takes too long.
pub(super) fn jacobians(
    g: &mut Graph,
    ways: &[Residual],
    sweep: SweepDirection,
    solved: &SolvedFor,
    (inputs, parameters): (usize, usize),
) -> Result<Jacobians, Failure> {
    let n = solved.accelerations.len();
    let mut best = (usize::MAX, ways[0], sweep);
    if n <= MOST_COORDINATES_COMPARED {
        for (way, sweep) in
            ways.iter().flat_map(|way| [(way, SweepDirection::Forward), (way, SweepDirection::Reverse)])
        {
            // On a copy, so that what is not taken leaves no trace.
            let mut trial = g.clone();
            let residual = way(&mut trial);
            let implicit = ImplicitDerivatives { residual: &residual, solved };
            let moving = [symbols(n, Symbol::Coordinate), symbols(n, Symbol::Rate)].concat();
            let roots = implicit.jacobian(&mut trial, &moving, sweep)?.concat();
            let operations = trial.operations(&[&roots, solved.accelerations].concat());
            if operations < best.0 {
                best = (operations, *way, sweep);
            }
        }
    }
    let (_, way, sweep) = best;
    let residual = way(g);
    ImplicitDerivatives { residual: &residual, solved }.jacobians(g, sweep, inputs, parameters)
}

/// How ∂r/∂x is swept.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum SweepDirection {
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

/// What all derivatives of q̈ need.
struct ImplicitDerivatives<'a> {
    /// r with symbols for q̈ and λ.
    residual: &'a [NodeId],
    solved: &'a SolvedFor<'a>,
}

impl ImplicitDerivatives<'_> {
    /// All derivatives of a model with so many inputs and parameters.
    fn jacobians(
        &self,
        g: &mut Graph,
        sweep: SweepDirection,
        inputs: usize,
        parameters: usize,
    ) -> Result<Jacobians, Failure> {
        let n = self.solved.accelerations.len();
        Ok(Jacobians {
            by_q: self.jacobian(g, &symbols(n, Symbol::Coordinate), sweep)?,
            by_u: self.jacobian(g, &symbols(n, Symbol::Rate), sweep)?,
            by_inputs: self.jacobian(g, &symbols(inputs, Symbol::Input), SweepDirection::Forward)?,
            by_parameters: self.jacobian(
                g,
                &symbols(parameters, Symbol::Parameter),
                SweepDirection::Reverse,
            )?,
        })
    }

    /// ∂q̈/∂x for the given symbols x: one row per coordinate.
    pub(super) fn jacobian(
        &self,
        g: &mut Graph,
        by: &[Symbol],
        sweep: SweepDirection,
    ) -> Result<Vec<Vec<NodeId>>, Failure> {
        let start = g.len();
        let within = |g: &Graph| match g.len() - start {
            nodes if nodes > MOST_NODES => Err(Failure::TooLarge(nodes)),
            _ => Ok(()),
        };
        let rows = match sweep {
            SweepDirection::Forward => Vec::new(),
            SweepDirection::Reverse => {
                let minus = g.integer(-1);
                let row = |r: &NodeId| {
                    let row = gradient(g, &[(*r, minus)], by);
                    within(g).map(|()| row)
                };
                self.residual.iter().map(row).collect::<Result<Vec<_>, _>>()?
            }
        };
        let mut result = vec![Vec::with_capacity(by.len()); self.solved.accelerations.len()];
        let mut sweeps = ForwardSweeps::new(g, self.residual);
        for (j, x) in by.iter().enumerate() {
            let column = match sweep {
                SweepDirection::Forward => {
                    let mut column = vec![g.zero(); self.residual.len()];
                    let minus = g.integer(-1);
                    sweeps.along(g, *x, minus).into_iter().for_each(|(i, entry)| column[i] = entry);
                    column
                }
                SweepDirection::Reverse => rows.iter().map(|row| row[j]).collect(),
            };
            let right = put_in(g, &column, self.solved.accelerations, self.solved.multipliers)?;
            for (row, x) in result.iter_mut().zip((self.solved.solve)(g, &right)) {
                row.push(x);
            }
            within(g)?;
        }
        Ok(result)
    }
}

/// Derivatives of r and of the rows of velocities; inputs as many as given.
///
/// # Errors
/// The nodes that were taken, where they are more than can end in programs that are emitted.
pub(super) fn variations(
    g: &mut Graph,
    residual: &[NodeId],
    velocities: &[NodeId],
    sweep: SweepDirection,
    (n, inputs): (usize, usize),
) -> Result<Variations, usize> {
    let (q, u): (Symbols, Symbols) = ((Symbol::Coordinate, n), (Symbol::Rate, n));
    let start = g.len();
    let mut by = |roots: &[NodeId], by: Symbols, sweep: SweepDirection| {
        derivatives(g, roots, by, sweep, start + MOST_NODES).ok_or_else(|| g.len() - start)
    };
    Ok(Variations {
        by_q: by(residual, q, sweep)?,
        by_u: by(residual, u, sweep)?,
        by_inputs: by(residual, (Symbol::Input, inputs), SweepDirection::Forward)?,
        velocity_by_q: by(velocities, q, SweepDirection::Reverse)?,
    })
}

/// Derivatives of outputs by all that they may contain; as many coordinates, rows and inputs as given.
///
/// # Errors
/// The nodes that were taken, where they are more than can end in programs that are emitted.
pub(super) fn output_variations(
    g: &mut Graph,
    outputs: &[NodeId],
    (n, rows, inputs): (usize, usize, usize),
) -> Result<Vec<NodeId>, usize> {
    let start = g.len();
    let mut by = |count: usize, symbol: fn(u32) -> Symbol| {
        let most = start + MOST_NODES;
        derivatives(g, outputs, (symbol, count), SweepDirection::Reverse, most).ok_or_else(|| g.len() - start)
    };
    let all = [
        by(n, Symbol::Coordinate)?,
        by(n, Symbol::Rate)?,
        by(n, Symbol::Acceleration)?,
        by(rows, Symbol::Multiplier)?,
        by(inputs, Symbol::Input)?,
    ];
    Ok(all.into_iter().flatten().flatten().collect())
}

/// Symbols of one kind, numbered below the second.
type Symbols = (fn(u32) -> Symbol, usize);

/// ∂roots/∂by, a row per root; `None` once the graph has more than `most` nodes.
fn derivatives(
    g: &mut Graph,
    roots: &[NodeId],
    (kind, count): Symbols,
    sweep: SweepDirection,
    most: usize,
) -> Option<Vec<Vec<NodeId>>> {
    let (zero, one) = (g.zero(), g.one());
    let mut rows = vec![vec![zero; count]; roots.len()];
    let within = |g: &Graph| (g.len() <= most).then_some(());
    match sweep {
        SweepDirection::Reverse => {
            make_symbols(g, count, kind);
            for (row, root) in rows.iter_mut().zip(roots) {
                let entries = gradient_entries(g, &[(*root, one)], kind, count);
                entries.into_iter().for_each(|(j, entry)| row[j] = entry);
                within(g)?;
            }
        }
        SweepDirection::Forward => {
            let mut sweeps = ForwardSweeps::new(g, roots);
            for (j, x) in symbols(count, kind).into_iter().enumerate() {
                let column = sweeps.along(g, x, one);
                column.into_iter().for_each(|(i, entry)| rows[i][j] = entry);
                within(g)?;
            }
        }
    }
    let rows = rows.iter().map(|row| remove_time(g, row)).collect();
    within(g).map(|()| rows)
}

/// Replaces the symbols q̈ and λ by their values.
pub(super) fn put_in(
    g: &mut Graph,
    roots: &[NodeId],
    accelerations: &[NodeId],
    multipliers: &[NodeId],
) -> Result<Vec<NodeId>, ZeroDenominator> {
    if roots.iter().all(|r| !g.dependence(*r).on(SOLVED_FOR)) {
        return Ok(roots.to_vec());
    }
    substitute(g, roots, &mut |_, s| match s {
        Symbol::Acceleration(i) => accelerations.get(i as usize).copied(),
        Symbol::Multiplier(i) => multipliers.get(i as usize).copied(),
        _ => None,
    })
}

/// What is known only once the equations are solved.
pub(super) const SOLVED_FOR: Dependence = Dependence::ACCELERATIONS.with(Dependence::MULTIPLIERS);
