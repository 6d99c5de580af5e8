//! The rows of all constraints with their derivatives, in a graph of their own: what the checks build must
//! not decide which form of an expression the derivation finds first.

use crate::calculus::{directional, gradient, substitute};
use crate::check::unused::Reads;
use crate::graph::{Graph, NodeId, Symbol};
use crate::mechanics::Model;

/// The rows Φ(q,t) and A q̇ + b, holonomic ones first, as they are in λ.
pub(super) struct ConstraintRows {
    /// A copy of the model's graph with the nodes below.
    pub(super) graph: Graph,
    /// Number of coordinates.
    pub(super) coordinates: usize,
    /// Number of holonomic rows.
    pub(super) holonomic: usize,
    /// Φ and A q̇ + b.
    pub(super) values: Vec<NodeId>,
    /// Φ_q and A: the entries that are not identically zero, by coordinate.
    pub(super) jacobian: Vec<Vec<(usize, NodeId)>>,
    /// Φ_t and b.
    pub(super) offset: Vec<NodeId>,
    /// The constraint of each row, by its index in the model.
    pub(super) constraint: Vec<usize>,
    /// Names of the rows.
    pub(super) names: Vec<String>,
}

impl ConstraintRows {
    pub(super) fn of(model: &Model) -> Self {
        let mut rows = Self {
            graph: model.graph.clone(),
            coordinates: model.coordinates.len(),
            holonomic: 0,
            values: Vec::new(),
            jacobian: Vec::new(),
            offset: Vec::new(),
            constraint: Vec::new(),
            names: Vec::new(),
        };
        for (i, c) in model.constraints.iter().enumerate() {
            for (suffix, node) in &c.components {
                let kind = if c.is_holonomic() { Symbol::Coordinate } else { Symbol::Rate };
                let read = Reads::of(model, &[*node]);
                let moving: Vec<usize> =
                    (0..rows.coordinates).filter(|j| read.symbol(kind(*j as u32))).collect();
                rows.holonomic += usize::from(c.is_holonomic());
                rows.values.push(*node);
                rows.constraint.push(i);
                rows.names.push(format!("{}{suffix}", c.name));
                rows.differentiate(*node, &moving, kind);
            }
        }
        rows
    }

    fn differentiate(&mut self, node: NodeId, moving: &[usize], kind: fn(u32) -> Symbol) {
        let g = &mut self.graph;
        let symbols: Vec<Symbol> = moving.iter().map(|j| kind(*j as u32)).collect();
        let one = g.one();
        let slopes = gradient(g, &[(node, one)], &symbols);
        let entries: Vec<(usize, NodeId)> = moving.iter().copied().zip(slopes).collect();
        let offset = if kind(0) == Symbol::Coordinate(0) {
            directional(g, &[node], &mut |g, s| (s == Symbol::Time).then(|| g.one()))[0]
        } else {
            at_rest(g, node, &entries)
        };
        self.jacobian.push(entries.into_iter().filter(|(_, slope)| !g.is_zero(*slope)).collect());
        self.offset.push(offset);
    }

    /// R.
    pub(super) fn len(&self) -> usize {
        self.values.len()
    }

    /// Names of some rows as a message about row `of` needs them: a nonholonomic row is compared with the
    /// rates of holonomic ones.
    pub(super) fn named(&self, of: usize, rows: impl IntoIterator<Item = usize>) -> Vec<String> {
        let rate = |r: &usize| of >= self.holonomic && *r < self.holonomic;
        let name =
            |r: usize| if rate(&r) { format!("{}.dt()", self.names[r]) } else { self.names[r].clone() };
        rows.into_iter().map(name).collect()
    }
}

/// b of a row A q̇ + b: its value at rest; where a denominator vanishes there, the row less A q̇.
fn at_rest(g: &mut Graph, row: NodeId, slopes: &[(usize, NodeId)]) -> NodeId {
    let zero = g.zero();
    let rest = substitute(g, &[row], &mut |_, s| matches!(s, Symbol::Rate(_)).then_some(zero));
    match rest {
        Ok(values) => values[0],
        Err(_) => slopes.iter().fold(row, |rest, (j, slope)| {
            let rate = g.symbol(Symbol::Rate(*j as u32));
            let term = g.mul(*slope, rate);
            g.sub(rest, term)
        }),
    }
}
