//! The elements, put together at small counts, against the same model unrolled.

use std::collections::BTreeMap;

use crate::calculus::rebuild;
use crate::graph::{Graph, Node, NodeId, Symbol};
use crate::mechanics::{Equations, Model};

use super::derive::{Derived, Element};
use super::model::{FamilyModel, Source};
use super::rows::RowElement;

/// A row of the equations in which the loops and the unrolled model differ.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Mismatch {
    /// The coordinate of the unrolled model, or the row of a constraint.
    pub coordinate: String,
    /// Q, M, T, V, Φ, Φ_q or γ.
    pub what: &'static str,
}

/// Puts M and Q together from the elements at these counts, in the graph of the model that was unrolled at
/// them, and compares them with what was derived there, by fingerprints.
///
/// # Errors
/// The first row that differs.
pub fn verify(
    family: &FamilyModel,
    derived: &Derived,
    counts: &[i64],
    unrolled: &mut Model,
    equations: &Equations,
) -> Result<(), Mismatch> {
    let mut offsets = Vec::new();
    let mut total = 0;
    for field in &family.fields {
        offsets.push(total);
        total += field.nodes(counts);
    }
    let parameters: BTreeMap<String, u32> =
        unrolled.parameters.iter().enumerate().map(|(k, p)| (p.name.clone(), k as u32)).collect();
    let n = unrolled.coordinates.len();
    let differs = |row: usize, what| Mismatch {
        coordinate: unrolled.coordinates.get(row).map(|c| c.name.clone()).unwrap_or_default(),
        what,
    };
    if i64::try_from(n) != Ok(total) {
        return Err(differs(0, "the number of coordinates"));
    }
    if equations.mass_matrix.len() != n {
        // The unrolled model is so small that its mass matrix is never left out.
        return Err(differs(0, "the size of M"));
    }
    let g = &mut unrolled.graph;
    let zero = g.zero();
    let mut sums = Sums { forces: vec![zero; n], mass: BTreeMap::new(), energies: [zero; 2] };
    for element in &derived.elements {
        for indices in element.rounds.all(counts) {
            let round = Round { family, counts, offsets: &offsets, parameters: &parameters, indices };
            if sums.add(g, element, &round).is_none() {
                return Err(Mismatch { coordinate: family.model.name.clone(), what: "a denominator" });
            }
        }
    }
    let same = |a: NodeId, b: NodeId| g.fingerprint(a) == g.fingerprint(b);
    for (row, (own, known)) in sums.forces.iter().zip(&equations.generalized_force).enumerate() {
        if !same(*own, *known) {
            return Err(differs(row, "Q"));
        }
    }
    for (row, entries) in equations.mass_matrix.iter().enumerate() {
        for (column, known) in entries.iter().enumerate() {
            if !same(sums.mass.get(&(row, column)).copied().unwrap_or(zero), *known) {
                return Err(differs(row, "M"));
            }
        }
    }
    // A model that gives L directly has no T and V of its own.
    if let Some((kinetic, potential)) = equations.energies {
        for (own, known, what) in [(sums.energies[0], kinetic, "T"), (sums.energies[1], potential, "V")] {
            if !same(own, known) {
                return Err(Mismatch { coordinate: family.model.name.clone(), what });
            }
        }
    }
    let sizes = Sizes { family, counts, offsets: &offsets, parameters: &parameters };
    verify_rows(&sizes, &derived.rows, g, equations)
}

/// What the elements add up to, as nodes of the unrolled model.
struct Sums {
    forces: Vec<NodeId>,
    mass: BTreeMap<(usize, usize), NodeId>,
    /// T and V.
    energies: [NodeId; 2],
}

impl Sums {
    /// Adds a round; `None` where a denominator is zero or a parameter is not there.
    fn add(&mut self, g: &mut Graph, element: &Element, round: &Round<'_>) -> Option<()> {
        let energies = [element.kinetic, element.potential];
        let forces = element.forces.iter().map(|(_, node)| *node);
        let mass = element.mass.iter().map(|(.., node)| *node);
        let roots: Vec<NodeId> = forces.chain(mass).chain(energies.into_iter().flatten()).collect();
        let mut values = round.values(g, &roots)?.into_iter();
        let place = |a: usize| round.coordinate(a as u32) as usize;
        for ((a, _), value) in element.forces.iter().zip(values.by_ref()) {
            let sum = &mut self.forces[place(*a)];
            *sum = g.add(*sum, value);
        }
        for ((a, b, _), value) in element.mass.iter().zip(values.by_ref()) {
            let sum = self.mass.entry((place(*a), place(*b))).or_insert_with(|| g.zero());
            *sum = g.add(*sum, value);
        }
        for (sum, _) in self.energies.iter_mut().zip(energies).filter(|(_, energy)| energy.is_some()) {
            *sum = g.add(*sum, values.next()?);
        }
        Some(())
    }
}

/// What is known at the counts.
struct Sizes<'a> {
    family: &'a FamilyModel,
    counts: &'a [i64],
    offsets: &'a [i64],
    parameters: &'a BTreeMap<String, u32>,
}

/// The same of the rows of constraints: Φ, Φ̇, γ and Φ_q.
fn verify_rows(
    sizes: &Sizes<'_>,
    rows: &[RowElement],
    g: &mut Graph,
    equations: &Equations,
) -> Result<(), Mismatch> {
    let Some(known) = &equations.constraints else {
        let differs = Mismatch { coordinate: sizes.family.model.name.clone(), what: "the constraints" };
        return if rows.is_empty() { Ok(()) } else { Err(differs) };
    };
    let zero = g.zero();
    let total = known.rows.len();
    let (mut own, mut jacobian) =
        ([vec![zero; total], vec![zero; total], vec![zero; total]], BTreeMap::new());
    // The number of the first row of every constraint, and of the one after the last.
    let mut firsts = vec![0];
    for (constraint, declared) in sizes.family.constraints.iter().enumerate() {
        let of = rows.iter().filter(|row| row.constraint == constraint);
        let rounds: i64 = match declared.numbered {
            true => of.map(|row| row.rounds(sizes.counts).count() as i64).sum(),
            false => 1,
        };
        firsts.push(firsts[constraint] + rounds * declared.components.len() as i64);
    }
    let differs = |row: usize, what| Mismatch {
        coordinate: known.rows.get(row).map(|named| named.name.clone()).unwrap_or_default(),
        what,
    };
    if firsts.last().copied() != i64::try_from(total).ok() {
        return Err(differs(0, "the number of rows"));
    }
    for element in rows {
        let declared = &sizes.family.constraints[element.constraint];
        let first_row = element.first_row(sizes.counts);
        let rounds = element.rounds(sizes.counts);
        for (k, i) in rounds.enumerate() {
            let Sizes { family, counts, offsets, parameters } = *sizes;
            let round = Round { family, counts, offsets, parameters, indices: [i, 0] };
            let number = if declared.numbered { first_row + k as i64 } else { 0 };
            for (c, term) in element.components.iter().enumerate() {
                let row = firsts[element.constraint] + number * element.components.len() as i64 + c as i64;
                let row = usize::try_from(row).unwrap_or(usize::MAX);
                let parts = [term.residual, term.velocity_residual, term.gamma];
                let roots: Vec<NodeId> =
                    parts.into_iter().chain(term.jacobian.iter().map(|(_, node)| *node)).collect();
                let values = round.values(g, &roots);
                let Some(values) = values.filter(|_| row < total) else {
                    return Err(differs(row, "a denominator"));
                };
                for (all, value) in own.iter_mut().zip(&values) {
                    all[row] = g.add(all[row], *value);
                }
                for ((a, _), value) in term.jacobian.iter().zip(&values[3..]) {
                    let sum = jacobian.entry((row, round.coordinate(*a as u32) as usize)).or_insert(zero);
                    *sum = g.add(*sum, *value);
                }
            }
        }
    }
    let same = |a: NodeId, b: NodeId| g.fingerprint(a) == g.fingerprint(b);
    let all = [("Φ", &known.residual), ("Φ̇", &known.velocity_residual), ("γ", &known.gamma)];
    for (own, (what, known)) in own.iter().zip(all) {
        // Nonholonomic rows have no Φ; they come last.
        if let Some(row) = own.iter().zip(known).position(|(own, known)| !same(*own, *known)) {
            return Err(differs(row, what));
        }
    }
    for (row, entries) in known.jacobian.iter().enumerate() {
        for (column, known) in entries.iter().enumerate() {
            if !same(jacobian.get(&(row, column)).copied().unwrap_or(zero), *known) {
                return Err(differs(row, "Φ_q"));
            }
        }
    }
    Ok(())
}

/// One round of an element in the unrolled model.
struct Round<'a> {
    family: &'a FamilyModel,
    counts: &'a [i64],
    offsets: &'a [i64],
    parameters: &'a BTreeMap<String, u32>,
    indices: [i64; 2],
}

impl Round<'_> {
    /// The unrolled model's coordinate that a local is.
    fn coordinate(&self, local: u32) -> u32 {
        let local = self.family.locals[local as usize];
        let field = local.field as usize;
        let column = local.column.map_or(0, |column| column.at(self.indices, self.counts));
        let row = local.index.at(self.indices, self.counts);
        let at = self.offsets[field] + row * self.family.fields[field].width(self.counts) + column;
        u32::try_from(at).unwrap_or(u32::MAX)
    }

    /// Nodes of the element as nodes of the unrolled model; `None` where a denominator is zero or a parameter
    /// is not there.
    fn values(&self, g: &mut Graph, roots: &[NodeId]) -> Option<Vec<NodeId>> {
        let from = &self.family.model.graph;
        let mut made: BTreeMap<NodeId, NodeId> = BTreeMap::new();
        for id in from.cone(roots) {
            let node = from.node(id);
            let value = match node {
                Node::Symbol(symbol) => self.symbol(g, symbol)?,
                _ => rebuild(g, node, &|child| made[&child]).ok()?,
            };
            made.insert(id, value);
        }
        Some(roots.iter().map(|root| made[root]).collect())
    }

    fn symbol(&self, g: &mut Graph, symbol: Symbol) -> Option<NodeId> {
        Some(match symbol {
            Symbol::Coordinate(l) => g.symbol(Symbol::Coordinate(self.coordinate(l))),
            Symbol::Rate(l) => g.symbol(Symbol::Rate(self.coordinate(l))),
            Symbol::Parameter(p) => match self.family.sources[p as usize] {
                Source::Scalar(k) => g.symbol(Symbol::Parameter(k)),
                Source::Count(c) => g.integer(self.counts[c as usize]),
                Source::Round(axis) => g.integer(self.indices[axis as usize]),
                Source::Numbered { parameter, index } => {
                    let name = &self.family.numbered[parameter as usize];
                    let element = format!("{name}[{}]", index.at(self.indices, self.counts));
                    g.symbol(Symbol::Parameter(*self.parameters.get(&element)?))
                }
            },
            other => g.symbol(other),
        })
    }
}
