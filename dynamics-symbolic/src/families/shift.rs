//! Elements as one of their nodes sees them.

use std::collections::BTreeMap;

use crate::calculus::substitute;
use crate::graph::{Node, NodeId, Number, Symbol};
use crate::mechanics::{Constraint, Coordinate, Parameter};

use super::derive::{Element, Gathering};
use super::model::{Anchor, FamilyModel, Field, Local, Multiplier, NodeIndex, Source};

/// For every field with one index the sum of the forces that elements with rounds give to node i, far from
/// all ends; `None` for ordinary coordinates and grids. May add nodes to the graph.
#[must_use]
pub fn interior_forces(family: &mut FamilyModel, elements: &[Element]) -> Vec<Option<NodeId>> {
    let line = |field: &Field| field.length.is_some() && field.columns.is_none();
    let mut forces: Vec<Option<NodeId>> =
        family.fields.iter().map(|field| line(field).then(|| family.model.graph.zero())).collect();
    for element in elements {
        if element.gathering(family) != Some(Gathering::Line) {
            continue;
        }
        for (a, q) in &element.forces {
            let local = family.locals[*a];
            if let (NodeIndex::Round(axis, k), Some(sum)) = (local.index, forces[local.field as usize]) {
                let q = shifted(family, *q, [NodeIndex::Round(axis, -k); 2]);
                forces[local.field as usize] = Some(family.model.graph.add(sum, q));
            }
        }
    }
    forces
}

/// What an element has in the round with these indices.
pub(super) fn shifted(family: &mut FamilyModel, id: NodeId, round: [NodeIndex; 2]) -> NodeId {
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
                let to = local(family, family.locals[l as usize].with(round));
                family.model.graph.symbol(match symbol {
                    Symbol::Coordinate(_) => Symbol::Coordinate(to),
                    Symbol::Rate(_) => Symbol::Rate(to),
                    _ => Symbol::Acceleration(to),
                })
            }
            Symbol::Multiplier(l) => {
                let known = family.multipliers[l as usize];
                let index = known.index.map(|index| index.with(round));
                multiplier(family, Multiplier { index, ..known })
            }
            Symbol::Parameter(p) => match family.sources[p as usize] {
                Source::Numbered { parameter, index } => {
                    let to = source(family, Source::Numbered { parameter, index: index.with(round) });
                    family.model.graph.symbol(Symbol::Parameter(to))
                }
                Source::Round(axis) => {
                    let (base, plus) = match round[axis as usize] {
                        NodeIndex::Round(axis, k) => (Some(Source::Round(axis)), k),
                        NodeIndex::Fixed(Anchor::Start(k)) => (None, k),
                        NodeIndex::Fixed(Anchor::End { count, plus }) => (Some(Source::Count(count)), plus),
                    };
                    let base = base.map(|base| {
                        let to = source(family, base);
                        family.model.graph.symbol(Symbol::Parameter(to))
                    });
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
    let name = wanted.text(&field.name, &family.counts);
    let origin = family.model.coordinates.first().map(|c| c.origin).unwrap_or_default();
    family.model.coordinates.push(Coordinate { name, unit: field.unit.clone(), origin });
    family.locals.push(wanted);
    family.locals.len() as u32 - 1
}

/// The symbol of a multiplier, which may be new.
pub(super) fn multiplier(family: &mut FamilyModel, wanted: Multiplier) -> NodeId {
    let known = family.multipliers.iter().position(|known| *known == wanted);
    let number = known.unwrap_or_else(|| {
        let declared = &family.constraints[wanted.constraint];
        let index = wanted.index.map_or_else(String::new, |at| format!("[{}]", at.text(&family.counts)));
        // Texts find the names of multipliers at the constraints of the model.
        family.model.constraints.push(Constraint {
            name: format!("{}{index}", declared.name),
            kind: declared.kind,
            components: vec![(declared.components[wanted.component].clone(), family.model.graph.zero())],
            units: vec![declared.units[wanted.component].clone()],
            redundant: false,
            switched: false,
            origin: declared.origin,
        });
        family.multipliers.push(wanted);
        family.multipliers.len() - 1
    });
    family.model.graph.symbol(Symbol::Multiplier(number as u32))
}

/// The number of a parameter, which may be new.
fn source(family: &mut FamilyModel, wanted: Source) -> u32 {
    if let Some(known) = family.sources.iter().position(|source| *source == wanted) {
        return known as u32;
    }
    let name = match wanted {
        Source::Count(c) => family.counts[c as usize].clone(),
        Source::Round(axis) => axis.name().to_owned(),
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
