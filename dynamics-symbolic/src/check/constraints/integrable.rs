//! Integrability of nonholonomic rows.
//!
//! The rows A dq + b dt (joined by the gradients of the holonomic ones) leave free the directions of a
//! distribution D. Combinations of the rows are integrable, that is a holonomic constraint with a free
//! constant, exactly if they vanish on the smallest involutive distribution that contains D (Frobenius): on
//! D, on the Lie brackets of its fields, on the brackets of those, and so on until the rank settles. One step
//! is not enough: the upright rolling disk looks half integrable after the first.
//!
//! With the pivots of an elimination as dependent coordinates, the fields of D are Xᵢ = ∂ᵢ + Σ c_di ∂_d;
//! their brackets have components along the dependent coordinates alone. Ranks are exact modulo 2⁶¹ − 31;
//! where functions are opaque to that, numeric at random states.

use crate::calculus::directional;
use crate::check::modular::null_space;
use crate::graph::{Fingerprint, Graph, Node, NodeId, Symbol, Unary};
use crate::mechanics::{ConstraintKind, Model};

use super::exact::{Echelon, Outcome};
use super::manifold::evaluate;
use super::orthogonal::Basis;
use super::rows::ConstraintRows;
use super::sample::{Sample, random};

/// Most rows of a group that are eliminated on the graph. With more, which would take too long, integrability
/// is not determined.
const MOST_ROWS: usize = 16;
/// Most nodes that Lie brackets may add to the graph. Beyond, integrability is not determined.
const MOST_BRACKET_NODES: usize = 60_000;

/// Largest element of a bracket that cancels: rounding errors of sums whose terms are about 1.
const CANCELLED: f64 = 1e-9;
/// Component of a unit vector up to which a row takes no part in a combination.
const NO_PART: f64 = 1e-6;

/// What can be integrated.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct Integrability {
    /// Number of independent combinations that can be.
    pub(super) dimension: usize,
    /// Rows that take part in them.
    pub(super) rows: Vec<usize>,
    /// Those that are not declared so, by groups of rows that share coordinates.
    pub(super) undeclared: Vec<Undeclared>,
}

/// Combinations that can be integrated and are not declared so.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Undeclared {
    pub(super) integrable: usize,
    /// The number of nonholonomic rows that share coordinates with them.
    pub(super) of: usize,
    /// The rows that take part.
    pub(super) rows: Vec<usize>,
    /// With the holonomic rows beside them they leave no velocity free: only t is left, along which anything
    /// can be integrated.
    pub(super) determined: bool,
}

/// Decides for all nonholonomic rows; `None` where that would take too long.
pub(super) fn integrability(
    model: &Model,
    rows: &ConstraintRows,
    superfluous: &[usize],
) -> Option<Integrability> {
    let mut all = Integrability::default();
    let mut g = rows.graph.clone();
    for group in groups(rows, superfluous) {
        let nonholonomic: Vec<usize> = group.iter().copied().filter(|r| *r >= rows.holonomic).collect();
        if nonholonomic.is_empty() {
            continue;
        }
        let vertical = Distribution::of(&mut g, rows, &group)?.closure()?;
        // Σ νᵣ (row r · V) = 0 for all V.
        let said = |r: &usize| {
            let c = &model.constraints[rows.constraint[*r]];
            c.switched || c.kind == ConstraintKind::Nonholonomic { integrable: true }
        };
        let along =
            |chosen: &[usize]| -> Vec<usize> { chosen.iter().map(|r| position(&group, *r)).collect() };
        let solutions = |chosen: &[usize]| vertical.annihilators(&along(chosen));
        let (dimension, support) = solutions(&nonholonomic)?;
        all.dimension += dimension;
        all.rows.extend(support.into_iter().map(|i| nonholonomic[i]));
        let silent: Vec<usize> = nonholonomic.iter().copied().filter(|r| !said(r)).collect();
        let (integrable, support) = solutions(&silent)?;
        if integrable > 0 {
            let involved = support.into_iter().map(|i| silent[i]).collect();
            let mut moved: Vec<usize> =
                group.iter().flat_map(|r| rows.jacobian[*r].iter().map(|(j, _)| *j)).collect();
            moved.sort_unstable();
            moved.dedup();
            let determined = group.len() >= moved.len();
            all.undeclared.push(Undeclared {
                integrable,
                of: nonholonomic.len(),
                rows: involved,
                determined,
            });
        }
    }
    Some(all)
}

fn position(group: &[usize], row: usize) -> usize {
    group.iter().position(|r| *r == row).expect("the row is chosen from the group")
}

/// Independent rows that are connected by coordinates, in their order.
fn groups(rows: &ConstraintRows, superfluous: &[usize]) -> Vec<Vec<usize>> {
    let mut label: Vec<usize> = (0..rows.coordinates).collect();
    fn root(label: &[usize], mut j: usize) -> usize {
        while label[j] != j {
            j = label[j];
        }
        j
    }
    let independent: Vec<usize> = (0..rows.len()).filter(|r| !superfluous.contains(r)).collect();
    let touched: Vec<Vec<usize>> = (0..rows.len()).map(|r| coordinates(rows, r)).collect();
    for r in &independent {
        for pair in touched[*r].windows(2) {
            let (a, b) = (root(&label, pair[0]), root(&label, pair[1]));
            label[a.max(b)] = a.min(b);
        }
    }
    let mut found: Vec<(usize, Vec<usize>)> = Vec::new();
    for r in independent {
        let Some(first) = touched[r].first() else { continue };
        let own = root(&label, *first);
        match found.iter_mut().find(|(l, _)| *l == own) {
            Some((_, group)) => group.push(r),
            None => found.push((own, vec![r])),
        }
    }
    found.into_iter().map(|(_, group)| group).collect()
}

/// The coordinates that a row moves or depends on.
fn coordinates(rows: &ConstraintRows, r: usize) -> Vec<usize> {
    let nodes: Vec<NodeId> = rows.jacobian[r].iter().map(|(_, node)| *node).chain([rows.offset[r]]).collect();
    let mut found: Vec<usize> = rows.jacobian[r].iter().map(|(j, _)| *j).collect();
    found.extend(rows.graph.cone(&nodes).into_iter().filter_map(|id| match rows.graph.node(id) {
        Node::Symbol(Symbol::Coordinate(j)) => Some(j as usize),
        _ => None,
    }));
    found.sort_unstable();
    found.dedup();
    found
}

/// Fields that span the free directions of a group of rows: Xᵢ = ∂ᵢ + Σ_d c_di ∂_d.
struct Distribution<'g> {
    g: &'g mut Graph,
    /// The rows by the dependent coordinates.
    dependent_part: Vec<Vec<NodeId>>,
    /// Dependent symbols.
    dependent: Vec<Symbol>,
    /// Free symbols, each with c.
    fields: Vec<(Symbol, Vec<NodeId>)>,
    exact: bool,
    limit: usize,
}

/// The closure: vertical fields by their components, and the products of the rows with them.
struct Closure {
    /// Per field and row of the group.
    products: Products,
}

enum Products {
    Exact(Vec<Vec<Fingerprint>>),
    Numeric(Vec<Vec<f64>>),
}

impl<'g> Distribution<'g> {
    fn of(g: &'g mut Graph, rows: &ConstraintRows, group: &[usize]) -> Option<Self> {
        if group.len() > MOST_ROWS {
            return None;
        }
        let mut columns: Vec<usize> = group.iter().flat_map(|r| coordinates(rows, *r)).collect();
        columns.sort_unstable();
        columns.dedup();
        let mut symbols: Vec<Symbol> = columns.iter().map(|j| Symbol::Coordinate(*j as u32)).collect();
        symbols.push(Symbol::Time);
        let zero = g.zero();
        let matrix: Vec<Vec<NodeId>> = group
            .iter()
            .map(|r| {
                let entry = |j: &usize| {
                    rows.jacobian[*r].iter().find(|(k, _)| k == j).map_or(zero, |(_, node)| *node)
                };
                columns.iter().map(entry).chain([rows.offset[*r]]).collect()
            })
            .collect();
        let nodes: Vec<NodeId> = matrix.iter().flatten().copied().collect();
        let exact = !g.cone(&nodes).into_iter().any(|id| opaque(g.node(id)));
        // ∂ₜ commutes with everything where nothing depends on time.
        let mut read = g.cone(&nodes).into_iter().map(|id| g.node(id));
        let timed = read.any(|n| matches!(n, Node::Symbol(Symbol::Time)))
            || group.iter().any(|r| !g.is_zero(rows.offset[*r]));
        let limit = g.len() + MOST_BRACKET_NODES;
        let (pivots, solved) = eliminate(g, matrix.clone())?;
        let free =
            (0..symbols.len()).filter(|j| !pivots.contains(j) && (timed || symbols[*j] != Symbol::Time));
        let fields: Vec<(Symbol, Vec<NodeId>)> =
            free.map(|j| (symbols[j], solved.iter().map(|row| g.neg(row[j])).collect())).collect();
        let dependent_part = matrix.iter().map(|row| pivots.iter().map(|p| row[*p]).collect()).collect();
        let dependent = pivots.iter().map(|p| symbols[*p]).collect();
        Some(Self { g, dependent_part, dependent, fields, exact, limit })
    }

    /// Derivatives of the components of a field along another.
    fn along(&mut self, components: &[NodeId], free: Option<Symbol>, vertical: &[NodeId]) -> Vec<NodeId> {
        let dependent = &self.dependent;
        directional(self.g, components, &mut |g, s| {
            if Some(s) == free {
                return Some(g.one());
            }
            dependent.iter().position(|d| *d == s).map(|i| vertical[i]).filter(|node| !g.is_zero(*node))
        })
    }

    /// [X, Y] = DY·X − DX·Y for two fields given by free symbol, if any, and dependent components.
    fn bracket(
        &mut self,
        x: &(Option<Symbol>, Vec<NodeId>),
        y: &(Option<Symbol>, Vec<NodeId>),
    ) -> Vec<NodeId> {
        let forth = self.along(&y.1, x.0, &x.1);
        let back = self.along(&x.1, y.0, &y.1);
        forth.into_iter().zip(back).map(|(f, b)| self.g.sub(f, b)).collect()
    }

    /// Brackets of brackets until the rank settles; `None` where they grow too large or have no finite
    /// values.
    fn closure(mut self) -> Option<Closure> {
        let mut fields: Vec<(Option<Symbol>, Vec<NodeId>)> =
            self.fields.clone().into_iter().map(|(s, c)| (Some(s), c)).collect();
        let mut rank = Rank::of(self.exact, &self);
        let mut vertical: Vec<Vec<NodeId>> = Vec::new();
        // Every pair once; new fields join at the end.
        let mut second = 1;
        while second < fields.len() && vertical.len() < self.dependent.len() {
            for first in 0..second {
                let (x, y) = (fields[first].clone(), fields[second].clone());
                let v = self.bracket(&x, &y);
                if v.iter().all(|node| self.g.is_zero(*node)) {
                    continue;
                }
                if rank.adds(self.g, &v)? {
                    fields.push((None, v.clone()));
                    vertical.push(v);
                }
                if self.g.len() > self.limit {
                    return None;
                }
            }
            second += 1;
        }
        let mut products: Vec<Vec<NodeId>> = Vec::new();
        for v in &vertical {
            let rows = self.dependent_part.clone();
            products.push(rows.iter().map(|row| dot(self.g, row, v)).collect());
        }
        Some(Closure { products: rank.products(self.g, &products)? })
    }
}

fn dot(g: &mut Graph, a: &[NodeId], b: &[NodeId]) -> NodeId {
    let zero = g.zero();
    a.iter().zip(b).fold(zero, |sum, (x, y)| {
        let term = g.mul(*x, *y);
        g.add(sum, term)
    })
}

/// Functions whose relations fingerprints do not contain.
fn opaque(node: Node) -> bool {
    match node {
        Node::Unary(f, _) => !matches!(f, Unary::Sin | Unary::Cos | Unary::Tan),
        Node::Binary(..) | Node::Smooth { .. } | Node::Select { .. } => true,
        _ => false,
    }
}

/// Gauss–Jordan: the pivot column of every row, and the matrix with unit columns there. The last column,
/// time, is never a pivot.
fn eliminate(g: &mut Graph, mut matrix: Vec<Vec<NodeId>>) -> Option<(Vec<usize>, Vec<Vec<NodeId>>)> {
    let mut pivots = Vec::new();
    for r in 0..matrix.len() {
        let candidates = (0..matrix[r].len() - 1).filter(|j| g.fingerprint(matrix[r][*j]).is_unit());
        let pivot = candidates.min_by_key(|j| g.operations(&[matrix[r][*j]]))?;
        let reciprocal = {
            let one = g.one();
            g.div(one, matrix[r][pivot])?
        };
        matrix[r].iter_mut().for_each(|x| *x = g.mul(*x, reciprocal));
        let own = matrix[r].clone();
        for (i, row) in matrix.iter_mut().enumerate() {
            let factor = row[pivot];
            if i == r || g.is_zero(factor) {
                continue;
            }
            for (x, o) in row.iter_mut().zip(&own) {
                let term = g.mul(factor, *o);
                *x = g.sub(*x, term);
            }
        }
        pivots.push(pivot);
    }
    Some((pivots, matrix))
}

/// Rank of vertical fields at a random point.
enum Rank {
    Exact(Echelon),
    Numeric(Basis, Sample),
}

impl Rank {
    fn of(exact: bool, d: &Distribution) -> Self {
        if exact {
            return Self::Exact(Echelon::default());
        }
        let nodes: Vec<NodeId> = d.fields.iter().flat_map(|(_, c)| c.iter().copied()).collect();
        let (mut q, mut p) = (0, 0);
        for id in d.g.cone(&nodes) {
            match d.g.node(id) {
                Node::Symbol(Symbol::Coordinate(i)) => q = q.max(i as usize + 1),
                Node::Symbol(Symbol::Parameter(i)) => p = p.max(i as usize + 1),
                _ => {}
            }
        }
        // Positive, where square roots and logarithms have values.
        let values = |kind: u64, n: usize| (0..n).map(|i| 0.5 + random(kind, i as u64)).collect();
        let sample = Sample { time: 0.7, q: values(0x2000, q), u: Vec::new(), parameters: values(0x2001, p) };
        Self::Numeric(Basis::default(), sample)
    }

    fn adds(&mut self, g: &Graph, v: &[NodeId]) -> Option<bool> {
        match self {
            Self::Exact(echelon) => {
                let row = v.iter().map(|node| g.fingerprint(*node)).enumerate();
                let row = row.filter(|(_, x)| *x != Fingerprint::ZERO).collect();
                Some(echelon.add(echelon.rank(), &row, Fingerprint::ZERO) == Outcome::Independent)
            }
            Self::Numeric(basis, sample) => {
                let row = evaluate(g, sample, v);
                if row.iter().any(|x| !x.is_finite()) {
                    return None;
                }
                // A bracket that cancels leaves rounding errors.
                let vanishes = row.iter().all(|x| x.abs() < CANCELLED);
                Some(!vanishes && basis.add(basis.rank(), &row).is_none())
            }
        }
    }

    fn products(&self, g: &Graph, nodes: &[Vec<NodeId>]) -> Option<Products> {
        Some(match self {
            Self::Exact(_) => {
                Products::Exact(nodes.iter().map(|v| v.iter().map(|n| g.fingerprint(*n)).collect()).collect())
            }
            Self::Numeric(_, sample) => {
                let values: Vec<Vec<f64>> = nodes.iter().map(|v| evaluate(g, sample, v)).collect();
                if values.iter().flatten().any(|x| !x.is_finite()) {
                    return None;
                }
                Products::Numeric(values)
            }
        })
    }
}

impl Closure {
    /// Dimension of the combinations ν of some rows that vanish on all fields, and which of these rows take
    /// part.
    fn annihilators(&self, chosen: &[usize]) -> Option<(usize, Vec<usize>)> {
        let n = chosen.len();
        let vectors: Vec<Vec<bool>> = match &self.products {
            Products::Exact(fields) => {
                let rows = fields.iter().map(|v| chosen.iter().map(|r| v[*r]).collect()).collect();
                null_space(rows, n)
                    .iter()
                    .map(|v| v.iter().map(|x| *x != Fingerprint::ZERO).collect())
                    .collect()
            }
            Products::Numeric(fields) => {
                let mut basis = Basis::default();
                for v in fields {
                    let row: Vec<f64> = chosen.iter().map(|r| v[*r]).collect();
                    if row.iter().any(|x| x.abs() > CANCELLED) {
                        basis.add(basis.rank(), &row);
                    }
                }
                basis.complement(n).iter().map(|v| v.iter().map(|x| x.abs() > NO_PART).collect()).collect()
            }
        };
        let support = (0..n).filter(|i| vectors.iter().any(|v| v[*i])).collect();
        Some((vectors.len(), support))
    }
}
