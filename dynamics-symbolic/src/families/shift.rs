//! Elements as one of their nodes sees them.

use std::collections::BTreeMap;

use crate::calculus::substitute;
use crate::graph::{Node, NodeId, Number, Symbol};
use crate::mechanics::{Coordinate, Parameter};

use super::derive::Element;
use super::model::{Anchor, FamilyModel, Local, NodeIndex, Source};

/// For every field the sum of the forces that elements with rounds give to node i, far from all ends; `None`
/// for ordinary coordinates. May add nodes to the graph.
#[must_use]
pub fn interior_forces(family: &mut FamilyModel, elements: &[Element]) -> Vec<Option<NodeId>> {
    let mut forces: Vec<Option<NodeId>> =
        family.fields.iter().map(|field| field.length.map(|_| family.model.graph.zero())).collect();
    for element in elements.iter().filter(|element| element.range.is_some()) {
        for (a, q) in &element.forces {
            let local = family.locals[*a];
            if let (NodeIndex::Round(k), Some(sum)) = (local.index, forces[local.field as usize]) {
                let q = shifted(family, *q, k, NodeIndex::Round(0));
                forces[local.field as usize] = Some(family.model.graph.add(sum, q));
            }
        }
    }
    forces
}

/// A node of an element in the round that is `shift` before `node`.
pub(super) fn shifted(family: &mut FamilyModel, id: NodeId, shift: i64, node: NodeIndex) -> NodeId {
    let moved = |index: NodeIndex| match (index, node) {
        (NodeIndex::Round(k), NodeIndex::Round(_)) => NodeIndex::Round(k - shift),
        (NodeIndex::Round(k), NodeIndex::Fixed(at)) => NodeIndex::Fixed(at.shifted(k - shift)),
        (fixed, _) => fixed,
    };
    let mut symbols: Vec<Symbol> = Vec::new();
    for id in family.model.graph.cone(&[id]) {
        if let Node::Symbol(symbol) = family.model.graph.node(id) {
            symbols.push(symbol);
        }
    }
    let mut new: BTreeMap<Symbol, NodeId> = BTreeMap::new();
    for symbol in symbols {
        let value = match symbol {
            Symbol::Coordinate(l) | Symbol::Rate(l) | Symbol::Acceleration(l) => {
                let Local { field, index } = family.locals[l as usize];
                let to = local(family, Local { field, index: moved(index) });
                family.model.graph.symbol(match symbol {
                    Symbol::Coordinate(_) => Symbol::Coordinate(to),
                    Symbol::Rate(_) => Symbol::Rate(to),
                    _ => Symbol::Acceleration(to),
                })
            }
            Symbol::Parameter(p) => match family.sources[p as usize] {
                Source::Numbered { parameter, index } => {
                    let to = source(family, Source::Numbered { parameter, index: moved(index) });
                    family.model.graph.symbol(Symbol::Parameter(to))
                }
                Source::Round => {
                    let (base, plus) = match moved(NodeIndex::Round(0)) {
                        NodeIndex::Round(k) => (Some(family.model.graph.symbol(symbol)), k),
                        NodeIndex::Fixed(Anchor::Start(k)) => (None, k),
                        NodeIndex::Fixed(Anchor::End { count, plus }) => {
                            let to = source(family, Source::Count(count));
                            (Some(family.model.graph.symbol(Symbol::Parameter(to))), plus)
                        }
                    };
                    let plus = family.model.graph.number(Number::integer(plus));
                    base.map_or(plus, |base| family.model.graph.add(base, plus))
                }
                Source::Scalar(_) | Source::Count(_) => continue,
            },
            _ => continue,
        };
        new.insert(symbol, value);
    }
    let replaced = substitute(&mut family.model.graph, &[id], &mut |_, symbol| new.get(&symbol).copied());
    replaced.map_or(id, |all| all[0])
}

/// The number of a local, which may be new.
fn local(family: &mut FamilyModel, wanted: Local) -> u32 {
    if let Some(known) = family.locals.iter().position(|local| *local == wanted) {
        return known as u32;
    }
    let field = &family.fields[wanted.field as usize];
    let name = format!("{}[{}]", field.name, wanted.index.text(&family.counts));
    let origin = family.model.coordinates.first().map(|c| c.origin).unwrap_or_default();
    family.model.coordinates.push(Coordinate { name, unit: field.unit.clone(), origin });
    family.locals.push(wanted);
    family.locals.len() as u32 - 1
}

/// The number of a parameter, which may be new.
fn source(family: &mut FamilyModel, wanted: Source) -> u32 {
    if let Some(known) = family.sources.iter().position(|source| *source == wanted) {
        return known as u32;
    }
    let name = match wanted {
        Source::Count(c) => family.counts[c as usize].clone(),
        Source::Round => "i".to_owned(),
        Source::Numbered { parameter, index } => {
            format!("{}[{}]", family.numbered[parameter as usize], index.text(&family.counts))
        }
        Source::Scalar(k) => family.model.parameters[k as usize].name.clone(),
    };
    let origin = family.model.coordinates.first().map(|c| c.origin).unwrap_or_default();
    family.model.parameters.push(Parameter { name, unit: String::new(), origin });
    family.sources.push(wanted);
    family.sources.len() as u32 - 1
}
