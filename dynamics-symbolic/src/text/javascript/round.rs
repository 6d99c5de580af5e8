//! One round of a loop over elements in JavaScript.

use std::collections::{BTreeMap, BTreeSet};

use crate::graph::{Node, NodeId, Symbol};
use crate::mechanics::Model;
use crate::schedule::{Program, Staging, Step, schedule};

use super::super::program::{lines, lines_of_block};
use super::super::source::STYLE;
use super::JavaScript;

/// A printed round.
pub(crate) struct PrintedRound {
    /// What is the same in all rounds, to stand before the loop.
    pub(crate) before: Vec<String>,
    /// The statements of a round.
    pub(crate) body: Vec<String>,
    /// Its results.
    pub(crate) values: Vec<String>,
}

/// Prints what computes `roots` of one round. `names` says how symbols are read; `fixed` are those that are
/// the same in all rounds. `in_block`: the Rust code makes these rounds in blocks, and takes reciprocals of
/// roots.
pub(crate) fn round(
    model: &Model,
    roots: &[NodeId],
    names: BTreeMap<Symbol, String>,
    fixed: &dyn Fn(Symbol) -> bool,
    in_block: bool,
) -> PrintedRound {
    let functions = model.functions.iter().map(|f| f.name.clone()).collect();
    let language = JavaScript { functions, parameters: u32::MAX, extras: Vec::new(), names };
    let program = schedule(&model.graph, "element", roots, Staging::Inline);
    let program = staged(model, &program, fixed);
    let print = if in_block { lines_of_block } else { lines };
    let (lines, values) = print(&language, model, &program, STYLE);
    let (before, body): (Vec<_>, Vec<_>) = lines.into_iter().partition(|line| line.hoisted);
    let texts = |lines: Vec<super::Line>| lines.into_iter().map(|line| line.text).collect();
    PrintedRound {
        before: texts(before),
        body: texts(body),
        values: values.into_iter().map(|value| value.text).collect(),
    }
}

/// The program with what is the same in all rounds in its hoisted part.
fn staged(model: &Model, program: &Program, fixed: &dyn Fn(Symbol) -> bool) -> Program {
    let graph = &model.graph;
    let defined = |step: &Step| -> Vec<NodeId> {
        match step {
            Step::Node(id) => vec![*id],
            Step::SinCos { sin, cos, .. } => sin.iter().chain(cos).copied().collect(),
            Step::Smooth { orders } => orders.iter().flatten().copied().collect(),
        }
    };
    let children = |step: &Step| -> Vec<NodeId> {
        defined(step).into_iter().flat_map(|id| graph.node(id).children().collect::<Vec<_>>()).collect()
    };
    let mut moving: BTreeSet<NodeId> = BTreeSet::new();
    let moves = |id: NodeId, moving: &BTreeSet<NodeId>| match graph.node(id) {
        Node::Symbol(symbol) => !fixed(symbol),
        _ => moving.contains(&id),
    };
    let (mut before, mut body) = (Vec::new(), Vec::new());
    for step in program.hoisted.iter().chain(&program.body) {
        if children(step).into_iter().any(|child| moves(child, &moving)) {
            moving.extend(defined(step));
            body.push(*step);
        } else {
            before.push(*step);
        }
    }
    let known: BTreeSet<NodeId> = before.iter().flat_map(defined).collect();
    let read = body.iter().flat_map(children).chain(program.results.iter().copied());
    let constants: BTreeSet<NodeId> = read.filter(|id| known.contains(id)).collect();
    Program { hoisted: before, body, constants: constants.into_iter().collect(), ..program.clone() }
}
