//! How nodes gather the forces of the rounds beside them: what all languages share that print loops, so that
//! their sums have one order.

use crate::graph::NodeId;
use crate::schedule::{Staging, schedule};

use super::derive::{Element, Gathering};
use super::model::{FamilyModel, NodeIndex};

/// What the rounds of an element give to the nodes of a field.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Given {
    /// The number of the element.
    pub element: usize,
    /// How much further than the round the node is, along each index.
    pub offsets: [i64; 2],
    /// The number of its buffer, see [`buffers`].
    pub buffer: usize,
    /// Whether it is the opposite of what the buffer holds.
    pub opposite: bool,
}

/// The forces that need a buffer each, and for every force its buffer and whether it is the opposite.
#[must_use]
pub fn buffers(family: &FamilyModel, element: &Element) -> (Vec<NodeId>, Vec<(usize, bool)>) {
    let graph = &family.model.graph;
    let mut buffers: Vec<NodeId> = Vec::new();
    let used = element.forces.iter().map(|(_, node)| {
        for (k, known) in buffers.iter().enumerate() {
            if graph.fingerprint(*known) == graph.fingerprint(*node) {
                return (k, false);
            }
            if graph.are_opposite(*known, *node) {
                return (k, true);
            }
        }
        buffers.push(*node);
        (buffers.len() - 1, false)
    });
    let used = used.collect();
    (buffers, used)
}

/// What the rounds of all elements give to the nodes of a field, of those whose forces come there in this
/// way.
#[must_use]
pub fn gathered(family: &FamilyModel, elements: &[Element], field: usize, way: Gathering) -> Vec<Given> {
    let mut all = Vec::new();
    for (e, element) in elements.iter().enumerate() {
        if element.gathering(family) != Some(way) {
            continue;
        }
        let (_, used) = buffers(family, element);
        for ((a, _), (buffer, opposite)) in element.forces.iter().zip(used) {
            let local = family.locals[*a];
            let column = local.column.map_or(Some(0), NodeIndex::offset);
            if let (true, Some(row), Some(column)) =
                (local.field as usize == field, local.index.offset(), column)
            {
                all.push(Given { element: e, offsets: [row, column], buffer, opposite });
            }
        }
    }
    all
}

/// Most operations of the forces of a node far from all ends, for each force that is gathered there, up to
/// which they are made anew at every node.
const MOST_CHEAP: usize = 8;

/// Whether nodes with one index make the forces of their elements anew: where that is cheap, and nothing else
/// is made of the rounds. `interior` is what [`interior_forces`](super::interior_forces) has.
#[must_use]
pub fn is_cheap(family: &FamilyModel, elements: &[Element], interior: &[Option<NodeId>]) -> bool {
    let fixed = |(a, _): &(usize, NodeId)| matches!(family.locals[*a].index, NodeIndex::Fixed(_));
    let roots: Vec<NodeId> = interior.iter().flatten().copied().collect();
    let cost = schedule(&family.model.graph, "node", &roots, Staging::Hoisted).cost;
    let lines = (0..family.fields.len()).filter(|k| {
        let field = &family.fields[*k];
        field.length.is_some() && field.columns.is_none()
    });
    let count: usize = lines.map(|field| gathered(family, elements, field, Gathering::Line).len()).sum();
    let of_lines = elements.iter().filter(|element| element.gathering(family) == Some(Gathering::Line));
    cost.roots + cost.divisions + cost.sin_cos + cost.functions == 0
        && cost.total() <= MOST_CHEAP * count
        && !of_lines.flat_map(|element| &element.forces).any(fixed)
}
