//! The rows of K and M of a node far from the ends, at rest with all coordinates zero.

use std::collections::{BTreeMap, BTreeSet};

use crate::calculus::rebuild;
use crate::graph::{Binary, Dependence, Graph, Node, NodeId, Number, Symbol, Unary};

use super::super::derive::{Derived, Element};
use super::super::model::{Anchor, Axis, FamilyModel, NodeIndex, Source};
use super::super::shift::shifted;

/// Couplings by field, field and offset of the second's node against the first's.
#[derive(Default)]
pub(super) struct Couplings(BTreeMap<(usize, usize, i64), NodeId>);

/// The rows of a node, and which fields are coupled.
pub(super) struct Stencil {
    pub(super) stiffness: Couplings,
    pub(super) mass: Couplings,
    /// Families that are coupled with each other, in the order of declaration.
    pub(super) blocks: Vec<Vec<usize>>,
    /// Numbered parameters, which are taken to be equal for all nodes.
    pub(super) alike: Vec<String>,
    /// Whether nodes are coupled to ordinary coordinates or to single nodes.
    pub(super) border: bool,
}

impl Stencil {
    /// The error is why there is none, in words.
    pub(super) fn at_rest(family: &mut FamilyModel, derived: &Derived) -> Result<Self, String> {
        let mut all = Self {
            stiffness: Couplings::default(),
            mass: Couplings::default(),
            blocks: Vec::new(),
            alike: Vec::new(),
            border: false,
        };
        let mut counts: BTreeMap<usize, BTreeSet<u32>> = BTreeMap::new();
        let mut rest: BTreeMap<usize, NodeId> = BTreeMap::new();
        for element in &derived.elements {
            let Some(count) = interior(element).transpose()? else { continue };
            let nodes: Vec<usize> = element.forces.iter().map(|(a, _)| *a).collect();
            let nodes = nodes.into_iter().chain(element.mass.iter().map(|(a, ..)| *a));
            for local in nodes.map(|a| family.locals[a]) {
                if let NodeIndex::Round(..) = local.index {
                    counts.entry(local.field as usize).or_default().insert(count);
                }
            }
            for (a, force) in &element.forces {
                let local = family.locals[*a];
                let NodeIndex::Round(_, k) = local.index else { continue };
                let force = all.entry(family, *force, k)?;
                let g = &mut family.model.graph;
                let sum = rest.entry(local.field as usize).or_insert_with(|| g.zero());
                *sum = g.add(*sum, force);
            }
            for (a, b, entry) in &element.stiffness {
                all.add(family, false, (*a, *b), *entry)?;
            }
            for (_, _, entry) in &element.damping {
                let at_rest = at_zero(family, *entry)?;
                if !family.model.graph.is_zero(at_rest) {
                    return Err(String::from("forces depend on velocities"));
                }
            }
            for (a, b, entry) in &element.mass {
                all.add(family, true, (*a, *b), *entry)?;
            }
        }
        if counts.values().any(|counts| counts.len() > 1) {
            return Err(String::from("two counts divide the nodes"));
        }
        if let Some((field, _)) = rest.iter().find(|(_, force)| !family.model.graph.is_zero(**force)) {
            let name = &family.fields[*field].name;
            return Err(format!("forces on `{name}` do not vanish where all coordinates are zero"));
        }
        all.check_symmetry(family)?;
        all.couple(family);
        all.alike.sort_unstable();
        all.alike.dedup();
        Ok(all)
    }

    /// Adds what an element has at locals a and b to the row of a node.
    fn add(
        &mut self,
        family: &mut FamilyModel,
        of_mass: bool,
        (a, b): (usize, usize),
        entry: NodeId,
    ) -> Result<(), String> {
        let (row, column) = (family.locals[a], family.locals[b]);
        let (NodeIndex::Round(_, k), NodeIndex::Round(_, l)) = (row.index, column.index) else {
            self.border |= matches!(row.index, NodeIndex::Round(..));
            return Ok(());
        };
        let value = self.entry(family, entry, k)?;
        let entries = if of_mass { &mut self.mass } else { &mut self.stiffness };
        let g = &mut family.model.graph;
        let place = (row.field as usize, column.field as usize, l - k);
        let sum = entries.0.entry(place).or_insert_with(|| g.zero());
        *sum = g.add(*sum, value);
        Ok(())
    }

    /// The value for node i of what belongs to the node `k` behind the round's index.
    fn entry(&mut self, family: &mut FamilyModel, id: NodeId, k: i64) -> Result<NodeId, String> {
        let own = shifted(family, id, [NodeIndex::Round(Axis::First, -k); 2]);
        let value = at_zero(family, own)?;
        let mut symbols = Vec::new();
        for id in family.model.graph.cone(&[value]) {
            if let Node::Symbol(Symbol::Parameter(p)) = family.model.graph.node(id) {
                symbols.push(family.sources[p as usize]);
            }
        }
        for source in symbols {
            match source {
                Source::Round(_) => return Err(String::from("the entries depend on the index")),
                Source::Numbered { parameter, .. } => {
                    self.alike.push(format!("`{}`", family.numbered[parameter as usize]));
                }
                Source::Scalar(_) | Source::Count(_) => {}
            }
        }
        Ok(value)
    }

    fn check_symmetry(&self, family: &FamilyModel) -> Result<(), String> {
        let g = &family.model.graph;
        for ((a, b, d), entry) in &self.stiffness.0 {
            let other = self.stiffness.0.get(&(*b, *a, -d)).copied().unwrap_or(g.zero());
            if g.fingerprint(*entry) != g.fingerprint(other) {
                return Err(String::from("the tangent stiffness is not symmetric"));
            }
        }
        Ok(())
    }

    /// Groups families that are coupled.
    fn couple(&mut self, family: &FamilyModel) {
        let g = &family.model.graph;
        let families = family.fields.iter().enumerate().filter(|(_, field)| field.length.is_some());
        let mut blocks: Vec<Vec<usize>> = families.map(|(k, _)| vec![k]).collect();
        for ((a, b, _), entry) in self.stiffness.0.iter().chain(&self.mass.0) {
            let holds = |field: usize| blocks.iter().position(|block| block.contains(&field));
            if let (Some(i), Some(j), false) = (holds(*a), holds(*b), g.is_zero(*entry))
                && i != j
            {
                let moved = blocks.remove(i.max(j));
                blocks[i.min(j)].extend(moved);
            }
        }
        blocks.iter_mut().for_each(|block| block.sort_unstable());
        self.blocks = blocks;
    }
}

impl Couplings {
    /// c with Σ_d entry_d e^{iκd} = Σ_d c\[d\] cos(κd) of a field on itself; `None` where there is none.
    pub(super) fn cosines(&self, g: &mut Graph, field: usize) -> Option<Vec<NodeId>> {
        let mut coefficients: Vec<NodeId> = Vec::new();
        for ((a, b, d), entry) in &self.0 {
            if (*a, *b) == (field, field) && !g.is_zero(*entry) {
                add(g, &mut coefficients, *d, *entry)?;
            }
        }
        if coefficients.is_empty() {
            coefficients.push(g.zero());
        }
        Some(coefficients)
    }

    /// The same of Re(own conj(other)), both between two fields.
    pub(super) fn product(&self, g: &mut Graph, other: &Self, [a, b]: [usize; 2]) -> Option<Vec<NodeId>> {
        let mut coefficients = vec![g.zero()];
        let between = |all: &Self| -> Vec<(i64, NodeId)> {
            let own = all.0.iter().filter(|((i, j, _), _)| (*i, *j) == (a, b));
            own.map(|((.., d), entry)| (*d, *entry)).collect()
        };
        let (left, right) = (between(self), between(other));
        for (d, x) in &left {
            for (e, y) in &right {
                let term = g.mul(*x, *y);
                add(g, &mut coefficients, d - e, term)?;
            }
        }
        Some(coefficients)
    }
}

fn add(g: &mut Graph, coefficients: &mut Vec<NodeId>, d: i64, term: NodeId) -> Option<()> {
    let d = usize::try_from(d.unsigned_abs()).ok()?;
    if coefficients.len() <= d {
        coefficients.resize(d + 1, g.zero());
    }
    coefficients[d] = g.add(coefficients[d], term);
    Some(())
}

/// The count that ends the rounds of an element between the ends. The error: two counts.
fn interior(element: &Element) -> Option<Result<u32, String>> {
    let range = element.rounds.range(Axis::First)?;
    if element.rounds.range(Axis::Second).is_some() {
        return Some(Err(String::from("a sum over the nodes has two indices")));
    }
    match (range.start, range.end) {
        (Anchor::Start(_), Anchor::End { count, .. }) => Some(Ok(count)),
        (Anchor::End { count: a, .. }, Anchor::End { count: b, .. }) if a != b => {
            Some(Err(String::from("two counts divide the nodes")))
        }
        _ => None,
    }
}

/// An entry with all coordinates and velocities zero and equal numbered parameters. Lengths are taken to be
/// positive: √(h²) is h.
fn at_zero(family: &mut FamilyModel, root_id: NodeId) -> Result<NodeId, String> {
    let no_value = || String::from("an entry has no value where all coordinates are zero");
    let mut made: BTreeMap<NodeId, NodeId> = BTreeMap::new();
    for id in family.model.graph.cone(&[root_id]) {
        let g = &mut family.model.graph;
        let value = match g.node(id) {
            Node::Symbol(Symbol::Coordinate(_) | Symbol::Rate(_)) => g.zero(),
            Node::Symbol(Symbol::Parameter(p)) => match family.sources[p as usize] {
                Source::Numbered { parameter, index: NodeIndex::Round(..) } => {
                    let here = Source::Numbered { parameter, index: NodeIndex::Round(Axis::First, 0) };
                    let known = family.sources.iter().position(|source| *source == here);
                    let first = family.sources.iter().position(
                        |source| matches!(source, Source::Numbered { parameter: p, .. } if *p == parameter),
                    );
                    g.symbol(Symbol::Parameter(known.or(first).map_or(p, |known| known as u32)))
                }
                _ => id,
            },
            Node::Unary(Unary::Sqrt, a) => {
                let a = made[&a];
                match root(g, a) {
                    Some(root) => root,
                    None => g.unary(Unary::Sqrt, a),
                }
            }
            Node::Binary(Binary::Hypot, a, b) if g.is_zero(made[&a]) => made[&b],
            Node::Binary(Binary::Hypot, a, b) if g.is_zero(made[&b]) => made[&a],
            node => rebuild(g, node, &|child| made[&child]).map_err(|_| no_value())?,
        };
        made.insert(id, value);
    }
    let value = made.get(&root_id).copied().unwrap_or(root_id);
    if !family.model.graph.dependence(value).within(Dependence::PARAMETERS) {
        return Err(String::from("it depends on inputs or on time"));
    }
    Ok(value)
}

/// A positive root of a product, with squares in front of it: √(h² ρ/E) is h √(ρ/E). `None` where it is no
/// shorter than the square root of the whole.
pub(super) fn root(g: &mut Graph, square: NodeId) -> Option<NodeId> {
    let mut factors: BTreeMap<NodeId, i32> = BTreeMap::new();
    let mut number = Number::ONE;
    let mut left = vec![(square, 1)];
    while let Some((id, power)) = left.pop() {
        match g.node(id) {
            Node::Mul(a, b) => left.extend([(a, power), (b, power)]),
            Node::Div(a, b) => left.extend([(a, power), (b, -power)]),
            Node::Number(n) if power == 1 => number = number.times(n)?,
            Node::Number(n) if power == -1 => number = number.over(n)?,
            _ => *factors.entry(id).or_default() += power,
        }
    }
    let (outside, inside) = number_root(number)?;
    let (mut front, mut under) = (g.number(outside), g.number(inside));
    let mut moved = !outside.is(1);
    for (id, power) in factors {
        let half = g.powi(id, power / 2)?;
        moved |= power / 2 != 0;
        front = g.mul(front, half);
        let rest = g.powi(id, power % 2)?;
        under = g.mul(under, rest);
    }
    if !moved {
        return None;
    }
    let under = if g.is_one(under) { under } else { g.unary(Unary::Sqrt, under) };
    Some(g.mul(front, under))
}

/// √(n/d) as a rational number times √ of another.
fn number_root(number: Number) -> Option<(Number, Number)> {
    let Number::Rational(n, d) = number else { return None };
    if n <= 0 {
        return None;
    }
    let split = |mut n: i128| {
        let mut outside = 1;
        for k in 2..=100i128 {
            while n % (k * k) == 0 {
                n /= k * k;
                outside *= k;
            }
        }
        (outside, n)
    };
    let ((a, b), (c, e)) = (split(n), split(d));
    Some((Number::ratio(a, c), Number::ratio(b, e)))
}
