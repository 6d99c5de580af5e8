//! Constraints by index: Φ̇, γ, Φ_q and ∂(Φ_qᵀλ)/∂q of one round.
//!
//! The formulas are those of `mechanics/constraints.rs`: with D the derivative along q → q̇, t → 1 at fixed
//! q̇, Φ̇ = DΦ and γ = −DΦ̇; a row A q̇ + b of a nonholonomic constraint stands in the place of Φ̇.

use std::collections::BTreeMap;

use crate::calculus::{directional, remove_time};
use crate::graph::{Graph, NodeId, Symbol};
use crate::mechanics::ConstraintKind;

use super::model::{Anchor, Axis, FamilyModel, NodeIndex, Range, Rounds};
use super::slopes::{entries, slopes};

/// What one round says of one component of a constraint; nodes of the model's graph, coordinates by their
/// numbers among the locals.
#[derive(Clone, Debug)]
pub struct RowTerm {
    /// Φ; 0 for nonholonomic constraints.
    pub residual: NodeId,
    /// Φ̇, or A q̇ + b.
    pub velocity_residual: NodeId,
    /// γ.
    pub gamma: NodeId,
    /// Φ_q or A, where it is not zero.
    pub jacobian: Vec<(usize, NodeId)>,
    /// −∂(Φ_qᵀλ)/∂q over λ, where it is not zero.
    pub stiffness: Vec<(usize, usize, NodeId)>,
    /// Whether it moves by itself: Φ_t or b is not zero. It does work then.
    pub moves: bool,
}

/// What the rounds of a range say of a constraint.
#[derive(Clone, Debug)]
pub struct RowElement {
    /// Its number among the constraints.
    pub constraint: usize,
    /// The rounds; `None`: once, with no index.
    pub range: Option<Range>,
    /// The lengths of the parts before: where its own rows begin. Empty where all rounds add to one row.
    pub before: Vec<Range>,
    /// How many rows without rounds come before.
    pub alone_before: i64,
    /// Its components.
    pub components: Vec<RowTerm>,
}

/// Derives all rows. Adds nodes to the graph.
pub(super) fn derive(model: &mut FamilyModel) -> Vec<RowElement> {
    let n = model.locals.len();
    let mut elements = Vec::new();
    for (constraint, declared) in model.constraints.iter().enumerate() {
        let (mut before, mut alone_before) = (Vec::new(), 0);
        for part in &declared.parts {
            let g = &mut model.model.graph;
            let components = part.values.iter().map(|node| term(g, *node, declared.kind, n)).collect();
            elements.push(RowElement {
                constraint,
                range: part.range,
                before: before.clone(),
                alone_before,
                components,
            });
            match part.range {
                _ if !declared.numbered => {}
                Some(range) => before.push(range),
                None => alone_before += 1,
            }
        }
    }
    elements
}

fn term(g: &mut Graph, node: NodeId, kind: ConstraintKind, n: usize) -> RowTerm {
    let holonomic = kind == ConstraintKind::Holonomic;
    let mut moved = |g: &mut Graph, symbol: Symbol| match symbol {
        Symbol::Coordinate(i) => Some(g.symbol(Symbol::Rate(i))),
        Symbol::Time => Some(g.one()),
        _ => None,
    };
    let velocity_residual = if holonomic { directional(g, &[node], &mut moved)[0] } else { node };
    let rate = directional(g, &[velocity_residual], &mut moved)[0];
    let gamma = g.neg(rate);
    let one = g.one();
    let by: fn(u32) -> Symbol = if holonomic { Symbol::Coordinate } else { Symbol::Rate };
    let jacobian = entries(g, &[(node, one)], by, n);
    let stiffness = slopes(g, &jacobian, Symbol::Coordinate, n);
    let residual = if holonomic { node } else { g.zero() };
    let steady = remove_time(g, &[residual, velocity_residual, gamma]);
    let mut carried = g.zero();
    for (a, slope) in &jacobian {
        let rate = g.symbol(Symbol::Rate(*a as u32));
        let product = g.mul(*slope, rate);
        carried = g.add(carried, product);
    }
    RowTerm {
        residual: steady[0],
        velocity_residual: steady[1],
        gamma: steady[2],
        jacobian,
        stiffness,
        moves: g.fingerprint(carried) != g.fingerprint(velocity_residual),
    }
}

impl RowElement {
    /// Its rounds.
    #[must_use]
    pub fn rounds_of_loop(&self) -> Rounds {
        self.range.map_or(Rounds::Once, Rounds::Over)
    }

    /// The number of the row of round i, in terms of i; `None` where it is no index of the usual form.
    #[must_use]
    pub fn number(&self) -> Option<NodeIndex> {
        // A sum of a number and of counts with factors.
        let (mut number, mut counts) = (self.alone_before, BTreeMap::new());
        let mut add = |anchor: Anchor, sign: i64| match anchor {
            Anchor::Start(k) => number += sign * k,
            Anchor::End { count, plus } => {
                number += sign * plus;
                *counts.entry(count).or_insert(0) += sign;
            }
        };
        for range in &self.before {
            add(range.end, 1);
            add(range.start, -1);
        }
        if let Some(range) = self.range {
            add(range.start, -1);
        }
        counts.retain(|_, factor| *factor != 0);
        match (self.range, counts.iter().next(), counts.len()) {
            (Some(_), None, _) => Some(NodeIndex::Round(Axis::First, number)),
            (None, None, _) => Some(NodeIndex::Fixed(Anchor::Start(number))),
            (None, Some((count, 1)), 1) => {
                Some(NodeIndex::Fixed(Anchor::End { count: *count, plus: number }))
            }
            _ => None,
        }
    }

    /// The number of its first row, at these counts.
    #[must_use]
    pub fn first_row(&self, counts: &[i64]) -> i64 {
        let length = |range: &Range| (range.end.at(counts) - range.start.at(counts)).max(0);
        self.alone_before + self.before.iter().map(length).sum::<i64>()
    }

    /// The rounds at these counts; one where it has no index.
    #[must_use]
    pub fn rounds(&self, counts: &[i64]) -> core::ops::Range<i64> {
        let range = self.range.unwrap_or(Range { start: Anchor::Start(0), end: Anchor::Start(1) });
        range.start.at(counts)..range.end.at(counts)
    }
}
