//! Equations with ranges of indices, and the report.

use std::collections::BTreeMap;

use crate::graph::{NodeId, Symbol};
use crate::schedule::{Staging, schedule};
use crate::text::{entry, statements};

use super::derive::{Derived, Element};
use super::dispersion;
use super::model::{Anchor, Axis, FamilyModel, Field, Local, Multiplier, NodeIndex, Range, Rounds, Source};
use super::rows::RowElement;
use super::shift::{multiplier, shifted};

/// Where several counts decide which node comes first.
const NOT_BY_ROWS: &str = "several counts order the nodes: the equations are not written row by row\n";

/// The equations of motion for reading.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct FamilyEquations {
    /// Plain text.
    pub plain: String,
    /// MathML: one `<p class="eq">` per equation.
    pub mathml: String,
}

/// The equations of motion: for every field a row for each range of nodes that have the same one. A row is
/// followed by what every round adds to it, as to an ordinary coordinate. May add nodes to the graph.
#[must_use]
pub fn equations(family: &mut FamilyModel, derived: &Derived) -> FamilyEquations {
    let mut out = format!("{}: equations of motion\n\n", family.model.name);
    let mut rows = Vec::new();
    let counts = family.counts.clone();
    for field in 0..family.fields.len() {
        let Some(cells) = cells(family, derived, field as u32) else {
            out.push_str(NOT_BY_ROWS);
            let mathml = format!("<p class=\"eq\">{}</p>\n", NOT_BY_ROWS.trim_end());
            return FamilyEquations { plain: out, mathml };
        };
        for cell in cells {
            let of_many = |axis: &Axis| cell.range(*axis).is_some_and(|range| single(range).is_none());
            let ranges = Axis::ALL.into_iter().filter(of_many);
            let ranges = ranges.filter_map(|axis| cell.range(axis).map(|range| (axis, range)));
            let appended = match ranges.collect::<Vec<_>>() {
                all if all.is_empty() => String::new(),
                all => format!("    {}", in_words(&all, &counts)),
            };
            for (summed, (left, right)) in row(family, derived, field as u32, cell) {
                let g = &family.model.graph;
                if summed.is_empty() {
                    rows.push((left, right, appended.clone()));
                } else if !g.is_zero(left) || !g.is_zero(right) {
                    let more = format!("{appended}    added {}", in_words(&summed, &counts));
                    rows.push((left, right, more));
                }
            }
        }
    }
    let [plain, mut mathml] = statements(&mut family.model, &rows);
    out.push_str(&plain);
    if !derived.rows.is_empty() {
        out.push_str("\nconstraints\n\n");
        let rows = restrictions(family, derived);
        let [plain, more] = statements(&mut family.model, &rows);
        out.push_str(&plain);
        mathml.push_str(&more);
    }
    FamilyEquations { plain: out, mathml }
}

/// What the constraints say: 0 = Φ, or 0 = A q̇ + b, a line for each range.
fn restrictions(family: &FamilyModel, derived: &Derived) -> Vec<(NodeId, NodeId, String)> {
    let (zero, mut rows) = (family.model.graph.zero(), Vec::new());
    for element in &derived.rows {
        let declared = &family.constraints[element.constraint];
        let range = match element.range {
            None => String::new(),
            Some(range) => {
                let words = in_words(&[(Axis::First, range)], &family.counts);
                if declared.numbered { format!("    {words}") } else { format!("    added {words}") }
            }
        };
        for term in &element.components {
            let node = if declared.is_holonomic() { term.residual } else { term.velocity_residual };
            if element.range.is_some() || declared.numbered || !family.model.graph.is_zero(node) {
                rows.push((zero, node, range.clone()));
            }
        }
    }
    rows
}

/// Indices over which is summed.
type Summed = Vec<(Axis, Range)>;

/// `for 1 <= i < rows, 0 <= j < columns`.
fn in_words(ranges: &[(Axis, Range)], counts: &[String]) -> String {
    let words = ranges.iter().map(|(axis, range)| {
        format!("{} <= {} < {}", range.start.text(counts), axis.name(), range.end.text(counts))
    });
    format!("for {}", words.collect::<Vec<_>>().join(", "))
}

/// The one node of a range that has one.
fn single(range: Range) -> Option<Anchor> {
    (range.start.shifted(1) == range.end).then_some(range.start)
}

/// The index of a field along an axis: its number, or its row and its column.
fn along(local: Local, axis: Axis) -> Option<NodeIndex> {
    match axis {
        Axis::First => Some(local.index),
        Axis::Second => local.column,
    }
}

/// The ranges of a field's nodes within which all have the same equation, of a grid those of its rows and of
/// its columns. `None` where several counts decide their order, and where the row and the column of a node
/// have the same index. An ordinary coordinate has no range.
fn cells(family: &FamilyModel, derived: &Derived, field: u32) -> Option<Vec<Rounds>> {
    let Field { length, columns, .. } = family.fields[field as usize];
    let mut cells = vec![Rounds::Once];
    for (axis, length) in Axis::ALL.into_iter().zip([length, columns]) {
        let Some(length) = length else { continue };
        let ranges = ranges(family, derived, field, axis, length)?;
        let inside = |cell: &Rounds, range| cell.with_inside(range);
        cells = cells.iter().flat_map(|cell| ranges.iter().filter_map(|r| inside(cell, *r))).collect();
    }
    Some(cells)
}

/// The ranges of a field's nodes along an axis.
fn ranges(
    family: &FamilyModel,
    derived: &Derived,
    field: u32,
    axis: Axis,
    length: Anchor,
) -> Option<Vec<Range>> {
    let mut cuts = vec![Anchor::Start(0), length];
    let of_elements = derived.elements.iter().map(|element| {
        let touched = element.forces.iter().map(|(a, _)| *a).chain(element.mass.iter().map(|(a, ..)| *a));
        (element.rounds, touched.collect::<Vec<_>>())
    });
    let of_rows = derived.rows.iter().map(|row| {
        let touched = row.components.iter().flat_map(|term| &term.jacobian).map(|(a, _)| *a);
        (row.rounds_of_loop(), touched.collect())
    });
    for (rounds, touched) in of_elements.chain(of_rows) {
        for local in touched.into_iter().map(|a| family.locals[a]).filter(|local| local.field == field) {
            if let (NodeIndex::Round(a, _), Some(NodeIndex::Round(b, _))) = (local.index, local.column)
                && a == b
            {
                return None;
            }
            if let Some(range) = along(local, axis).and_then(|index| index.values(rounds)) {
                cuts.extend([range.start, range.end]);
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
    Some(cuts.windows(2).map(|pair| Range { start: pair[0], end: pair[1] }).collect())
}

/// M q̈ and Q of the nodes of a cell. What is summed over an index stands by itself, with the range of that
/// index.
fn row(
    family: &mut FamilyModel,
    derived: &Derived,
    field: u32,
    cell: Rounds,
) -> BTreeMap<Summed, (NodeId, NodeId)> {
    let zero = family.model.graph.zero();
    let mut all = BTreeMap::from([(Vec::new(), (zero, zero))]);
    for element in &derived.elements {
        for (a, q) in &element.forces {
            if let Some((round, summed)) = covers(family, element.rounds, *a, field, cell) {
                let q = shifted(family, *q, round);
                let (_, right) = all.entry(summed).or_insert((zero, zero));
                *right = family.model.graph.add(*right, q);
            }
        }
        for (a, b, m) in &element.mass {
            if let Some((round, summed)) = covers(family, element.rounds, *a, field, cell) {
                let acceleration = family.model.graph.symbol(Symbol::Acceleration(*b as u32));
                let term = family.model.graph.mul(*m, acceleration);
                let term = shifted(family, term, round);
                let (left, _) = all.entry(summed).or_insert((zero, zero));
                *left = family.model.graph.add(*left, term);
            }
        }
    }
    for element in &derived.rows {
        let number = element.number().filter(|_| family.constraints[element.constraint].numbered);
        for (component, term) in element.components.iter().enumerate() {
            for (a, slope) in &term.jacobian {
                let rounds = element.rounds_of_loop();
                if let Some((round, summed)) = covers(family, rounds, *a, field, cell) {
                    let index = number;
                    let of_row = Multiplier { constraint: element.constraint, component, index };
                    let lambda = multiplier(family, of_row);
                    let reaction = family.model.graph.mul(*slope, lambda);
                    let reaction = shifted(family, reaction, round);
                    let (_, right) = all.entry(summed).or_insert((zero, zero));
                    *right = family.model.graph.add(*right, reaction);
                }
            }
        }
    }
    all
}

/// The indices of the rounds that reach the nodes of a cell by local `a`, in terms of those of the cell; with
/// indices over which is summed, as an ordinary coordinate is reached by every round. `None` where no round
/// reaches them.
fn covers(
    family: &FamilyModel,
    rounds: Rounds,
    a: usize,
    field: u32,
    cell: Rounds,
) -> Option<([NodeIndex; 2], Summed)> {
    let local = family.locals[a];
    if local.field != field {
        return None;
    }
    let mut round: [Option<NodeIndex>; 2] = [None; 2];
    let mut letters: Vec<Axis> = Axis::ALL.to_vec();
    for axis in Axis::ALL {
        let (Some(index), Some(nodes)) = (along(local, axis), cell.range(axis)) else { continue };
        let reached = index.values(rounds)?;
        if !(reached.start <= nodes.start && nodes.end <= reached.end) {
            return None;
        }
        let node = match single(nodes) {
            Some(at) => NodeIndex::Fixed(at),
            None => {
                letters.retain(|letter| *letter != axis);
                NodeIndex::Round(axis, 0)
            }
        };
        if let NodeIndex::Round(of, k) = index {
            round[of as usize] = Some(node.shifted(-k));
        }
    }
    // Indices over which is summed have the letters that are left.
    let (mut letters, mut summed) = (letters.into_iter(), Vec::new());
    for (axis, index) in Axis::ALL.into_iter().zip(&mut round) {
        if let (Some(range), None) = (rounds.range(axis), &index) {
            let letter = letters.next()?;
            summed.push((letter, range));
            *index = Some(NodeIndex::Round(letter, 0));
        }
    }
    let [i, j] = [Axis::First, Axis::Second].map(|axis| NodeIndex::Round(axis, 0));
    Some(([round[0].unwrap_or(i), round[1].unwrap_or(j)], summed))
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
                let lengths = [Some(length), field.columns].into_iter().flatten();
                let lengths = lengths.map(|length| format!("[{}]", length.text(&family.counts)));
                let lengths = lengths.collect::<String>();
                families.push(named(&format!("{}{lengths}", field.name), &field.unit));
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
    for (k, element) in derived.rows.iter().enumerate() {
        entry(&mut out, if k == 0 { "constraints" } else { "" }, &describe_rows(family, element));
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
    let ranges = Axis::ALL.into_iter();
    let ranges = ranges.filter_map(|axis| element.rounds.range(axis).map(|range| (axis, range)));
    let rounds = match ranges.collect::<Vec<_>>() {
        all if all.is_empty() => "once".to_owned(),
        all => in_words(&all, &family.counts),
    };
    let moved = element.forces.iter().map(|(a, _)| *a).chain(element.mass.iter().map(|(a, ..)| *a));
    let mut nodes: Vec<usize> = moved.collect();
    nodes.sort_unstable();
    nodes.dedup();
    let nodes: Vec<&str> = nodes.iter().map(|a| family.model.coordinates[*a].name.as_str()).collect();
    format!("{functions}, {rounds}: moves {}", nodes.join(", "))
}

fn describe_rows(family: &FamilyModel, element: &RowElement) -> String {
    let declared = &family.constraints[element.constraint];
    let kind = if declared.is_holonomic() { "holonomic" } else { "nonholonomic" };
    let rounds = match element.range {
        None => "one row".to_owned(),
        Some(range) => {
            let words = in_words(&[(Axis::First, range)], &family.counts);
            if declared.numbered { format!("a row {words}") } else { format!("one row, a sum {words}") }
        }
    };
    let mut nodes: Vec<usize> =
        element.components.iter().flat_map(|term| &term.jacobian).map(|(a, _)| *a).collect();
    nodes.sort_unstable();
    nodes.dedup();
    let nodes: Vec<&str> = nodes.iter().map(|a| family.model.coordinates[*a].name.as_str()).collect();
    format!("{}, {kind}, {rounds}: holds {}", declared.name, nodes.join(", "))
}

/// Operations of the forces of all elements with rounds, one round each.
#[must_use]
pub fn operations(family: &FamilyModel, derived: &Derived) -> usize {
    let rounds = derived.elements.iter().filter(|element| element.rounds != Rounds::Once);
    let cost = |element: &Element| {
        let results: Vec<NodeId> = element.forces.iter().map(|(_, q)| *q).collect();
        let program = schedule(&family.model.graph, "element", &results, Staging::Hoisted);
        // One addition for every force that a node gathers.
        program.cost.total() + results.len()
    };
    rounds.map(cost).sum()
}
