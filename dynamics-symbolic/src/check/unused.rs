//! Everything declared is used: what no role reads is a mistake, usually a forgotten term.
//!
//! Elements of one array, vector or matrix stand or fall together, because a planar model may well ignore the
//! z of a vector.

use std::collections::BTreeSet;

use crate::graph::{FunctionId, Node, NodeId, Origin, Symbol};
use crate::mechanics::{ForceTerm, Model};

use super::Finding;

/// Coordinates, inputs, parameters and functions that nothing reads.
pub(super) fn unused(model: &Model, found: &mut Vec<Finding>) {
    let reads = Reads::new(model);
    let coordinates =
        model.coordinates.iter().enumerate().map(|(i, c)| (&c.name, c.origin, reads.coordinate(i as u32)));
    let inputs = model
        .inputs
        .iter()
        .enumerate()
        .map(|(i, c)| (&c.name, c.origin, reads.symbol(Symbol::Input(i as u32))));
    let parameters = model
        .parameters
        .iter()
        .enumerate()
        .map(|(i, c)| (&c.name, c.origin, reads.symbol(Symbol::Parameter(i as u32))));
    let functions = model
        .functions
        .iter()
        .enumerate()
        .map(|(i, c)| (&c.name, c.origin, reads.functions.contains(&FunctionId(i as u32))));
    let elsewhere = &model.read_elsewhere;
    group("coordinate", coordinates, &[], found);
    group("parameter", parameters, elsewhere, found);
    group("input", inputs, &[], found);
    group("function", functions, elsewhere, found);
}

/// Reports declarations of which no element is read.
fn group<'a>(
    what: &'static str,
    all: impl Iterator<Item = (&'a String, Origin, bool)>,
    elsewhere: &[String],
    found: &mut Vec<Finding>,
) {
    let mut declared: Vec<(&str, Origin, bool)> = Vec::new();
    for (name, origin, read) in all {
        let base = name.split(['[', '.']).next().unwrap_or(name);
        match declared.iter_mut().find(|(n, ..)| *n == base) {
            Some((_, _, any)) => *any |= read,
            None => declared.push((base, origin, read)),
        }
    }
    let missed = declared.into_iter().filter(|(name, _, read)| !read && !elsewhere.iter().any(|e| e == name));
    found.extend(missed.map(|(name, origin, _)| Finding::Unused { what, name: name.to_owned(), origin }));
}

/// What the roles read.
pub(super) struct Reads {
    symbols: BTreeSet<Symbol>,
    functions: Vec<FunctionId>,
}

impl Reads {
    fn new(model: &Model) -> Self {
        Self::of(model, &roots(model))
    }

    /// What `roots` read.
    pub(super) fn of(model: &Model, roots: &[NodeId]) -> Self {
        let g = &model.graph;
        let (mut symbols, mut functions) = (BTreeSet::new(), Vec::new());
        for id in g.cone(roots) {
            match g.node(id) {
                Node::Symbol(s) => drop(symbols.insert(s)),
                Node::Smooth { function, .. } => functions.push(function),
                _ => {}
            }
        }
        Self { symbols, functions }
    }

    pub(super) fn symbol(&self, symbol: Symbol) -> bool {
        self.symbols.contains(&symbol)
    }

    /// All symbols, ascending.
    pub(super) fn symbols(&self) -> impl Iterator<Item = Symbol> + '_ {
        self.symbols.iter().copied()
    }

    /// The coordinates that are read, they or their derivatives.
    pub(super) fn coordinates(&self) -> BTreeSet<usize> {
        let of = |s: Symbol| match s {
            Symbol::Coordinate(i) | Symbol::Rate(i) | Symbol::Acceleration(i) => Some(i as usize),
            _ => None,
        };
        self.symbols().filter_map(of).collect()
    }

    pub(super) fn any_function(&self) -> bool {
        !self.functions.is_empty()
    }

    pub(super) fn coordinate(&self, i: u32) -> bool {
        [Symbol::Coordinate(i), Symbol::Rate(i), Symbol::Acceleration(i)].into_iter().any(|s| self.symbol(s))
    }
}

/// Every node that has a role.
fn roots(model: &Model) -> Vec<NodeId> {
    let mut roots: Vec<NodeId> = model.energies.iter().map(|e| e.node).collect();
    for term in model.forces.iter().flat_map(|f| &f.terms) {
        match term {
            ForceTerm::At { point, vector } => roots.extend(point.iter().chain(vector)),
            ForceTerm::Along { expression, magnitude } => roots.extend([expression, magnitude]),
        }
    }
    roots.extend(model.constraints.iter().flat_map(|c| &c.components).map(|(_, node)| *node));
    roots.extend(model.outputs.iter().flat_map(|o| &o.components).map(|(_, node)| *node));
    roots.extend(model.speeds.iter().map(|s| s.node));
    roots.extend(model.events.iter().map(|e| e.node));
    roots
}
