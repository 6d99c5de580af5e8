//! The elements, put together at small counts, against the same model unrolled.

use std::collections::BTreeMap;

use crate::calculus::rebuild;
use crate::graph::{Graph, Node, NodeId, Symbol};
use crate::mechanics::{Equations, Model};

use super::derive::{Derived, Element};
use super::model::{FamilyModel, Source};

/// A row of the equations in which the loops and the unrolled model differ.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Mismatch {
    /// The coordinate of the unrolled model.
    pub coordinate: String,
    /// Q, M, T or V.
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
        total += field.length.map_or(1, |length| length.at(counts));
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
        let rounds = match element.range {
            Some(range) => range.start.at(counts)..range.end.at(counts),
            None => 0..1,
        };
        for i in rounds {
            let round = Round { family, counts, offsets: &offsets, parameters: &parameters, i };
            if round.add(g, element, &mut sums).is_none() {
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
    let Some((kinetic, potential)) = equations.energies else { return Ok(()) };
    for (own, known, what) in [(sums.energies[0], kinetic, "T"), (sums.energies[1], potential, "V")] {
        if !same(own, known) {
            return Err(Mismatch { coordinate: family.model.name.clone(), what });
        }
    }
    Ok(())
}

/// What the elements add up to, as nodes of the unrolled model.
struct Sums {
    forces: Vec<NodeId>,
    mass: BTreeMap<(usize, usize), NodeId>,
    /// T and V.
    energies: [NodeId; 2],
}

/// One round of an element in the unrolled model.
struct Round<'a> {
    family: &'a FamilyModel,
    counts: &'a [i64],
    offsets: &'a [i64],
    parameters: &'a BTreeMap<String, u32>,
    i: i64,
}

impl Round<'_> {
    /// The unrolled model's coordinate that a local is.
    fn coordinate(&self, local: u32) -> u32 {
        let local = self.family.locals[local as usize];
        let at = self.offsets[local.field as usize] + local.index.at(self.i, self.counts);
        u32::try_from(at).unwrap_or(u32::MAX)
    }

    /// Adds the element; `None` where a denominator is zero or a parameter is not there.
    fn add(&self, g: &mut Graph, element: &Element, sums: &mut Sums) -> Option<()> {
        let from = &self.family.model.graph;
        let energies = [element.kinetic, element.potential];
        let forces = element.forces.iter().map(|(_, node)| *node);
        let mass = element.mass.iter().map(|(.., node)| *node);
        let roots: Vec<NodeId> = forces.chain(mass).chain(energies.into_iter().flatten()).collect();
        let mut made: BTreeMap<NodeId, NodeId> = BTreeMap::new();
        for id in from.cone(&roots) {
            let node = from.node(id);
            let value = match node {
                Node::Symbol(symbol) => self.symbol(g, symbol)?,
                _ => rebuild(g, node, &|child| made[&child]).ok()?,
            };
            made.insert(id, value);
        }
        let place = |a: usize| self.coordinate(a as u32) as usize;
        for (a, force) in &element.forces {
            let sum = &mut sums.forces[place(*a)];
            *sum = g.add(*sum, made[force]);
        }
        for (a, b, entry) in &element.mass {
            let sum = sums.mass.entry((place(*a), place(*b))).or_insert_with(|| g.zero());
            *sum = g.add(*sum, made[entry]);
        }
        for (sum, energy) in sums.energies.iter_mut().zip(energies) {
            if let Some(energy) = energy {
                *sum = g.add(*sum, made[&energy]);
            }
        }
        Some(())
    }

    fn symbol(&self, g: &mut Graph, symbol: Symbol) -> Option<NodeId> {
        Some(match symbol {
            Symbol::Coordinate(l) => g.symbol(Symbol::Coordinate(self.coordinate(l))),
            Symbol::Rate(l) => g.symbol(Symbol::Rate(self.coordinate(l))),
            Symbol::Parameter(p) => match self.family.sources[p as usize] {
                Source::Scalar(k) => g.symbol(Symbol::Parameter(k)),
                Source::Count(c) => g.integer(self.counts[c as usize]),
                Source::Round => g.integer(self.i),
                Source::Numbered { parameter, index } => {
                    let name = &self.family.numbered[parameter as usize];
                    let element = format!("{name}[{}]", index.at(self.i, self.counts));
                    g.symbol(Symbol::Parameter(*self.parameters.get(&element)?))
                }
            },
            other => g.symbol(other),
        })
    }
}
