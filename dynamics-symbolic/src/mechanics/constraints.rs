//! What follows from the constraints: Φ, Φ̇, Φ_q, γ and their derivatives.
//!
//! Everything is a directional derivative of what the user wrote; nothing is expanded. With D the derivative
//! along q → q̇, t → 1 at fixed q̇,
//!
//!   Φ̇ = DΦ = Φ_q q̇ + Φ_t,    γ = −DΦ̇ = −(Φ_q q̇)_q q̇ − 2 Φ_qt q̇ − Φ_tt,
//!
//! and a row A q̇ + b of a nonholonomic constraint stands in the place of Φ̇: A its gradient by q̇, b its
//! value at q̇ = 0, γ = −D(A q̇ + b).

use crate::calculus::{ForwardSweeps, directional, gradient, gradient_entries, remove_time, substitute};
use crate::graph::{Dependence, Graph, NodeId, Symbol};

use super::equations::{ConstraintDerivatives, Named};
use super::limits::MOST_NODES;
use super::model::{Constraint, Model};
use super::model::{make_symbols, symbols};
use super::velocity_form::transport;

/// The constraints' own equations; N coordinates, R rows, the first H of them holonomic.
pub(super) struct ConstraintTerms {
    /// By name, with what the user wrote.
    pub(super) named: Vec<Named>,
    /// H.
    pub(super) holonomic: usize,
    pub(super) residual: Vec<NodeId>,
    pub(super) velocity_residual: Vec<NodeId>,
    pub(super) jacobian: Vec<Vec<NodeId>>,
    pub(super) velocity_offset: Vec<NodeId>,
    pub(super) gamma: Vec<NodeId>,
}

impl ConstraintTerms {
    /// Of a model's constraints; `None` without any.
    pub(super) fn of(model: &mut Model) -> Option<Self> {
        let n = model.coordinates.len();
        let named: Vec<Named> = model.constraints.iter().flat_map(named_rows).collect();
        if named.is_empty() {
            return None;
        }
        let holonomic =
            model.constraints.iter().filter(|c| c.is_holonomic()).map(|c| c.components.len()).sum();
        let g = &mut model.graph;
        let written: Vec<NodeId> = named.iter().map(|r| r.node).collect();
        let (places, velocities) = written.split_at(holonomic);
        let mut velocity_residual = directional(g, places, &mut transport);
        velocity_residual.extend(velocities);
        let rates = directional(g, &velocity_residual, &mut transport);
        let gamma: Vec<NodeId> = rates.into_iter().map(|rate| g.neg(rate)).collect();
        let velocity_offset = offsets(g, places, velocities);
        let jacobian = jacobian(g, places, velocities, n);
        Some(Self {
            residual: remove_time(g, places),
            velocity_residual: remove_time(g, &velocity_residual),
            jacobian: jacobian.iter().map(|row| remove_time(g, row)).collect(),
            velocity_offset: remove_time(g, &velocity_offset),
            gamma: remove_time(g, &gamma),
            named,
            holonomic,
        })
    }
}

/// The rows of a constraint by name: `closure.x`.
fn named_rows(c: &Constraint) -> impl Iterator<Item = Named> {
    let name = &c.name;
    debug_assert_eq!(c.units.len(), c.components.len(), "every row of `{name}` has a unit");
    c.components.iter().zip(&c.units).map(move |((suffix, node), unit)| Named {
        name: format!("{name}{suffix}"),
        unit: unit.clone(),
        node: *node,
    })
}

/// Φ_t joined by b. Φ_t is a partial derivative; b is what is left of a row at rest.
pub(super) fn offsets(g: &mut Graph, places: &[NodeId], velocities: &[NodeId]) -> Vec<NodeId> {
    let mut offsets = directional(g, places, &mut |g, s| (s == Symbol::Time).then(|| g.one()));
    for row in velocities {
        let zero = g.zero();
        let at_rest =
            |g: &mut Graph| substitute(g, &[*row], &mut |_, s| matches!(s, Symbol::Rate(_)).then_some(zero));
        // Linear in q̇, so no denominator contains q̇ without cancelling; where one does, b is the row less
        // A q̇, which its Jacobian gives.
        let b = match at_rest(g) {
            Ok(values) => values[0],
            Err(_) => less_linear_part(g, *row),
        };
        offsets.push(b);
    }
    offsets
}

/// row − (∂row/∂q̇) q̇.
fn less_linear_part(g: &mut Graph, row: NodeId) -> NodeId {
    let along = directional(g, &[row], &mut |g, s| match s {
        Symbol::Rate(_) => Some(g.symbol(s)),
        _ => None,
    })[0];
    g.sub(row, along)
}

/// Φ_q joined by A: a reverse sweep per row, which visits only what the row is made of.
pub(super) fn jacobian(
    g: &mut Graph,
    places: &[NodeId],
    velocities: &[NodeId],
    n: usize,
) -> Vec<Vec<NodeId>> {
    let (zero, one) = (g.zero(), g.one());
    let mut rows = Vec::with_capacity(places.len() + velocities.len());
    for (all, kind) in [(places, Symbol::Coordinate as fn(u32) -> Symbol), (velocities, Symbol::Rate)] {
        if !all.is_empty() {
            make_symbols(g, n, kind);
        }
        for row in all {
            let mut slopes = vec![zero; n];
            let entries = gradient_entries(g, &[(*row, one)], kind, n);
            entries.into_iter().for_each(|(j, slope)| slopes[j] = slope);
            rows.push(slopes);
        }
    }
    rows
}

/// Φ_qᵀλ of rows, with symbols for λ: two reverse sweeps. The first `holonomic` rows are Φ, the others
/// A q̇ + b.
pub(crate) fn reaction(g: &mut Graph, rows: &[Named], holonomic: usize, n: usize) -> Vec<NodeId> {
    let seeded = rows.iter().enumerate();
    let seeded: Vec<(NodeId, NodeId)> =
        seeded.map(|(r, row)| (row.node, g.symbol(Symbol::Multiplier(r as u32)))).collect();
    let (places, velocities) = seeded.split_at(holonomic);
    let holonomic = gradient(g, places, &symbols(n, Symbol::Coordinate));
    let nonholonomic = gradient(g, velocities, &symbols(n, Symbol::Rate));
    holonomic.into_iter().zip(nonholonomic).map(|(a, b)| g.add(a, b)).collect()
}

/// ∂(Φ_qᵀλ)/∂q, ∂γ/∂q, ∂γ/∂q̇, a forward sweep per symbol. Else how many nodes they had
/// taken when they were given up.
pub(super) fn derivatives(
    g: &mut Graph,
    rows: &ConstraintTerms,
    n: usize,
) -> Result<ConstraintDerivatives, usize> {
    let start = g.len();
    let reaction = reaction(g, &rows.named, rows.holonomic, n);
    let mut swept = |roots: &[NodeId], by: fn(u32) -> Symbol| {
        let (zero, one) = (g.zero(), g.one());
        let mut sweeps = ForwardSweeps::new(g, roots);
        let mut rows = vec![vec![zero; n]; roots.len()];
        for (j, x) in symbols(n, by).into_iter().enumerate() {
            let (of, column): (Vec<usize>, Vec<NodeId>) = sweeps.along(g, x, one).into_iter().unzip();
            of.into_iter().zip(remove_time(g, &column)).for_each(|(i, entry)| rows[i][j] = entry);
            if g.len() - start > MOST_NODES {
                return Err(g.len() - start);
            }
        }
        Ok(rows)
    };
    Ok(ConstraintDerivatives {
        reaction_by_q: swept(&reaction, Symbol::Coordinate)?,
        gamma_by_q: swept(&rows.gamma, Symbol::Coordinate)?,
        gamma_by_u: swept(&rows.gamma, Symbol::Rate)?,
    })
}

/// ∂Q/∂λ, N×R, where Q contains multipliers: a forward sweep per row.
pub(super) fn force_by_multipliers(g: &mut Graph, force: &[NodeId], rows: usize) -> Option<Vec<Vec<NodeId>>> {
    if force.iter().all(|f| !g.dependence(*f).on(Dependence::MULTIPLIERS)) {
        return None;
    }
    let (zero, one) = (g.zero(), g.one());
    let mut sweeps = ForwardSweeps::new(g, force);
    let mut by = vec![vec![zero; rows]; force.len()];
    for (r, lambda) in symbols(rows, Symbol::Multiplier).into_iter().enumerate() {
        let column = sweeps.along(g, lambda, one);
        column.into_iter().for_each(|(i, entry)| by[i][r] = entry);
    }
    Some(by)
}

/// Powers of the constraints that move, by name: −λᵀΦ_t or −λᵀb. The reason is that
/// q̇ᵀΦ_qᵀλ = (Φ̇ − Φ_t)ᵀλ and Φ̇ = 0.
pub(super) fn powers(g: &mut Graph, constraints: &[Constraint], offset: &[NodeId]) -> Vec<Named> {
    let mut first = 0;
    let mut powers = Vec::new();
    for c in constraints {
        let mut power = g.zero();
        for (row, offset) in offset.iter().enumerate().skip(first).take(c.components.len()) {
            let lambda = g.symbol(Symbol::Multiplier(row as u32));
            let term = g.mul(*offset, lambda);
            power = g.sub(power, term);
        }
        first += c.components.len();
        if !g.is_zero(power) {
            powers.push(Named { name: c.name.clone(), unit: String::new(), node: power });
        }
    }
    powers
}
