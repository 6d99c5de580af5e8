//! Equations with ranges of indices, and the report.

use crate::graph::{NodeId, Symbol};
use crate::schedule::{Staging, schedule};
use crate::text::{entry, statements};

use super::derive::{Derived, Element};
use super::dispersion;
use super::model::{Anchor, FamilyModel, NodeIndex, Range, Source};
use super::shift::shifted;

/// The equations of motion: for every field a row for each range of nodes that have the same one. A row of an
/// ordinary coordinate is followed by what every round adds to it. May add nodes to the graph.
#[must_use]
pub fn equations(family: &mut FamilyModel, derived: &Derived) -> String {
    let mut out = format!("{}: equations of motion\n\n", family.model.name);
    let mut rows = Vec::new();
    let counts = family.counts.clone();
    let rounds =
        |range: Range| format!("for {} <= i < {}", range.start.text(&counts), range.end.text(&counts));
    for field in 0..family.fields.len() {
        let Some(ranges) = ranges(family, derived, field as u32) else {
            out.push_str("several counts order the nodes: the equations are not written row by row\n");
            return out;
        };
        for range in ranges {
            let (left, right) = row(family, derived, field as u32, range, None);
            let appended = match range.filter(|range| single(*range).is_none()) {
                Some(range) => format!("    {}", rounds(range)),
                None => String::new(),
            };
            rows.push((left, right, appended));
            for element in derived.elements.iter().filter(|_| range.is_none()) {
                let Some(of) = element.range else { continue };
                let (left, right) = row(family, derived, field as u32, range, Some(of));
                let g = &family.model.graph;
                if !g.is_zero(left) || !g.is_zero(right) {
                    rows.push((left, right, format!("    added {}", rounds(of))));
                }
            }
        }
    }
    out.push_str(&statements(&mut family.model, &rows));
    out
}

/// The one node of a range that has one.
fn single(range: Range) -> Option<Anchor> {
    (range.start.shifted(1) == range.end).then_some(range.start)
}

/// The ranges of a field's nodes within which all have the same equation; `None` where several counts
/// decide their order. An ordinary coordinate has one row without a range.
fn ranges(family: &FamilyModel, derived: &Derived, field: u32) -> Option<Vec<Option<Range>>> {
    let Some(length) = family.fields[field as usize].length else { return Some(vec![None]) };
    let mut cuts = vec![Anchor::Start(0), length];
    for element in &derived.elements {
        let touched = element.forces.iter().map(|(a, _)| *a).chain(element.mass.iter().map(|(a, ..)| *a));
        for local in touched.map(|a| family.locals[a]).filter(|local| local.field == field) {
            match (local.index, element.range) {
                (NodeIndex::Round(k), Some(range)) => {
                    cuts.extend([range.start.shifted(k), range.end.shifted(k)]);
                }
                (NodeIndex::Fixed(at), _) => cuts.extend([at, at.shifted(1)]),
                (NodeIndex::Round(_), None) => {}
            }
        }
    }
    let counts = cuts.iter().filter_map(|cut| match cut {
        Anchor::End { count, .. } => Some(*count),
        Anchor::Start(_) => None,
    });
    let mut counts: Vec<u32> = counts.collect();
    counts.sort_unstable();
    counts.dedup();
    if counts.len() > 1 {
        return None;
    }
    cuts.sort_unstable();
    cuts.dedup();
    Some(cuts.windows(2).map(|pair| Some(Range { start: pair[0], end: pair[1] })).collect())
}

/// M q̈ and Q of the nodes of a range; of an ordinary coordinate what the rounds of one range, or what no
/// rounds add.
fn row(
    family: &mut FamilyModel,
    derived: &Derived,
    field: u32,
    range: Option<Range>,
    rounds: Option<Range>,
) -> (NodeId, NodeId) {
    let node = match range {
        None => NodeIndex::Fixed(Anchor::Start(0)),
        Some(range) => single(range).map_or(NodeIndex::Round(0), NodeIndex::Fixed),
    };
    let (mut left, mut right) = (family.model.graph.zero(), family.model.graph.zero());
    let elements = derived.elements.iter().filter(|e| range.is_some() || e.range == rounds);
    for element in elements {
        for (a, q) in &element.forces {
            if let Some(shift) = covers(family, element, *a, field, range) {
                let q = shifted(family, *q, shift, node);
                right = family.model.graph.add(right, q);
            }
        }
        for (a, b, m) in &element.mass {
            if let Some(shift) = covers(family, element, *a, field, range) {
                let acceleration = family.model.graph.symbol(Symbol::Acceleration(*b as u32));
                let term = family.model.graph.mul(*m, acceleration);
                let term = shifted(family, term, shift, node);
                left = family.model.graph.add(left, term);
            }
        }
    }
    (left, right)
}

/// By how much the node of a range is further than the round that reaches it by local `a`; `None` where no
/// round does. An ordinary coordinate, which has no range, is reached by every round.
fn covers(
    family: &FamilyModel,
    element: &Element,
    a: usize,
    field: u32,
    range: Option<Range>,
) -> Option<i64> {
    let local = family.locals[a];
    if local.field != field {
        return None;
    }
    match (local.index, element.range, range) {
        (NodeIndex::Fixed(_), _, None) => Some(0),
        (NodeIndex::Fixed(at), _, Some(range)) => (single(range) == Some(at)).then_some(0),
        (NodeIndex::Round(k), Some(of), Some(range)) => {
            let (start, end) = (of.start.shifted(k), of.end.shifted(k));
            (start <= range.start && range.end <= end).then_some(k)
        }
        _ => None,
    }
}

/// The report on a model with families; `conserved` are the names of what the unrolled model conserves.
#[must_use]
pub fn report(family: &FamilyModel, derived: &Derived, conserved: &[String]) -> String {
    let mut out = format!("{}\n\n", family.model.name);
    let named = |name: &str, unit: &str| match unit {
        "" => name.to_owned(),
        unit => format!("{name} ({unit})"),
    };
    let (mut families, mut ordinary) = (Vec::new(), Vec::new());
    for field in &family.fields {
        match field.length {
            Some(length) => {
                let length = length.text(&family.counts);
                families.push(named(&format!("{}[{length}]", field.name), &field.unit));
            }
            None => ordinary.push(named(&field.name, &field.unit)),
        }
    }
    entry(&mut out, "families", &families.join(", "));
    if !ordinary.is_empty() {
        entry(&mut out, "coordinates beside", &ordinary.join(", "));
    }
    let at_least = |(name, least): (&String, &i64)| match least {
        ..=1 => name.clone(),
        least => format!("{name} (at least {least})"),
    };
    let counts: Vec<String> = family.counts.iter().zip(&family.least).map(at_least).collect();
    entry(&mut out, "counts", &counts.join(", "));
    let scalars = family.model.parameters.iter().zip(&family.sources);
    let scalars = scalars.filter(|(_, source)| matches!(source, Source::Scalar(_)));
    let scalars: Vec<String> = scalars.map(|(p, _)| named(&p.name, &p.unit)).collect();
    entry(&mut out, "parameters", &or_none(&scalars));
    if !family.numbered.is_empty() {
        entry(&mut out, "by index", &family.numbered.join(", "));
    }
    if !family.model.inputs.is_empty() {
        let inputs: Vec<String> = family.model.inputs.iter().map(|i| named(&i.name, &i.unit)).collect();
        entry(&mut out, "inputs", &inputs.join(", "));
    }
    out.push('\n');
    for (k, element) in derived.elements.iter().enumerate() {
        entry(&mut out, if k == 0 { "elements" } else { "" }, &describe(family, element));
    }
    out.push('\n');
    let structure = if derived.diagonal { "constant, diagonal" } else { "constant, banded" };
    entry(&mut out, "mass matrix", structure);
    let forces = match (derived.conservative, derived.velocity_forces) {
        (true, false) => "conservative, free of velocities",
        (false, false) => "free of velocities",
        (true, true) => "conservative, with velocities",
        (false, true) => "with velocities",
    };
    entry(&mut out, "forces", forces);
    entry(&mut out, "conserved", &or_none(conserved));
    let cost = format!("{} per node, all fields together", operations(family, derived));
    entry(&mut out, "operations", &cost);
    let waves = dispersion::describe(family, derived);
    if !waves.is_empty() {
        out.push('\n');
    }
    waves.iter().for_each(|(heading, text)| entry(&mut out, heading, text));
    out
}

fn or_none(all: &[String]) -> String {
    if all.is_empty() { "none".to_owned() } else { all.join(", ") }
}

fn describe(family: &FamilyModel, element: &Element) -> String {
    let functions = element.functions.join(" + ");
    let rounds = match element.range {
        None => "once".to_owned(),
        Some(range) => {
            let (start, end) = (range.start.text(&family.counts), range.end.text(&family.counts));
            format!("for {start} <= i < {end}")
        }
    };
    let moved = element.forces.iter().map(|(a, _)| *a).chain(element.mass.iter().map(|(a, ..)| *a));
    let mut nodes: Vec<usize> = moved.collect();
    nodes.sort_unstable();
    nodes.dedup();
    let nodes: Vec<&str> = nodes.iter().map(|a| family.model.coordinates[*a].name.as_str()).collect();
    format!("{functions}, {rounds}: moves {}", nodes.join(", "))
}

/// Operations of the forces of all elements with rounds, one round each.
#[must_use]
pub fn operations(family: &FamilyModel, derived: &Derived) -> usize {
    let rounds = derived.elements.iter().filter(|element| element.range.is_some());
    let cost = |element: &Element| {
        let results: Vec<NodeId> = element.forces.iter().map(|(_, q)| *q).collect();
        let program = schedule(&family.model.graph, "element", &results, Staging::Hoisted);
        // One addition for every force that a node gathers.
        program.cost.total() + results.len()
    };
    rounds.map(cost).sum()
}
