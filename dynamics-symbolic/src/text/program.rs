//! Programs, exactly as they are computed: every step in order, parentheses wherever the order of operations
//! would be lost otherwise.

use std::collections::{BTreeMap, BTreeSet};

use crate::graph::{Dependence, Graph, Node, NodeId, Unary};
use crate::mechanics::Model;
use crate::schedule::{Program, Step};

use super::target::{Level, Target, Text};

/// How much of a program is written into one line.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Style<'a> {
    /// A step that is used once is written where it is used, as long as the text there stays this short; 0:
    /// every step has its own line.
    pub inline: usize,
    /// Sines and cosines of arguments this short are written where they are used, however often.
    pub inline_angle: usize,
    /// Prefixes of the names of hoisted and of other steps.
    pub prefixes: [&'a str; 2],
}

/// A line of a program.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Line {
    /// The assignment.
    pub text: String,
    /// Whether it belongs to the hoisted part.
    pub hoisted: bool,
}

/// The assignments of a program, and the texts of its results.
pub fn lines(
    target: &dyn Target,
    model: &Model,
    program: &Program,
    style: Style<'_>,
) -> (Vec<Line>, Vec<Text>) {
    lines_from(target, model, program, style, &[])
}

/// The same of a round of a loop over blocks, where the Rust code takes the reciprocals of roots that
/// something is divided by, see `dynamics-simd/src/reciprocal_root.rs`.
pub(super) fn lines_of_block(
    target: &dyn Target,
    model: &Model,
    program: &Program,
    style: Style<'_>,
) -> (Vec<Line>, Vec<Text>) {
    lines_with(target, model, program, style, &[], true)
}

/// The same where some values are given under names of their own.
pub(super) fn lines_from(
    target: &dyn Target,
    model: &Model,
    program: &Program,
    style: Style<'_>,
    given: &[(NodeId, Text)],
) -> (Vec<Line>, Vec<Text>) {
    lines_with(target, model, program, style, given, false)
}

fn lines_with(
    target: &dyn Target,
    model: &Model,
    program: &Program,
    style: Style<'_>,
    given: &[(NodeId, Text)],
    in_block: bool,
) -> (Vec<Line>, Vec<Text>) {
    let g = &model.graph;
    let mut results = vec![false; g.len()];
    program.results.iter().for_each(|r| results[r.index()] = true);
    let mut names = vec![None; g.len()];
    given.iter().for_each(|(id, name)| names[id.index()] = Some(name.clone()));
    let mut writer = Writer {
        target,
        model,
        style,
        uses: uses(g, program),
        results,
        names,
        divisors: if in_block { divisors(g, program) } else { BTreeSet::new() },
        reciprocals: BTreeMap::new(),
        lines: Vec::new(),
        counts: [0, 0],
    };
    for step in &program.hoisted {
        writer.step(step, Some(&program.constants));
    }
    for step in &program.body {
        writer.step(step, None);
    }
    let results = program.results.iter().map(|r| writer.value(*r)).collect();
    (writer.lines, results)
}

/// Roots that something is divided by. Those of parameters alone are no part of a round.
#[must_use]
pub fn divisors(g: &Graph, program: &Program) -> BTreeSet<NodeId> {
    let divisor = |step: &Step| {
        let Step::Node(id) = step else { return None };
        let Node::Div(_, root) = g.node(*id) else { return None };
        let moves = !g.dependence(root).within(Dependence::PARAMETERS);
        (moves && matches!(g.node(root), Node::Unary(Unary::Sqrt, _))).then_some(root)
    };
    program.hoisted.iter().chain(&program.body).filter_map(divisor).collect()
}

/// How often each node is read.
fn uses(g: &Graph, program: &Program) -> Vec<u32> {
    let mut uses = vec![0; g.len()];
    for step in program.hoisted.iter().chain(&program.body) {
        match step {
            Step::Node(id) => g.node(*id).children().for_each(|c| uses[c.index()] += 1),
            Step::SinCos { angle, .. } => uses[angle.index()] += 1,
            Step::Smooth { orders } => {
                let any = orders.iter().flatten().next();
                any.into_iter().flat_map(|id| g.node(*id).children()).for_each(|c| uses[c.index()] += 1);
            }
        }
    }
    program.results.iter().for_each(|r| uses[r.index()] += 1);
    uses
}

struct Writer<'a> {
    target: &'a dyn Target,
    model: &'a Model,
    style: Style<'a>,
    uses: Vec<u32>,
    results: Vec<bool>,
    names: Vec<Option<Text>>,
    /// Roots that come with their reciprocals, and these.
    divisors: BTreeSet<NodeId>,
    reciprocals: BTreeMap<NodeId, Text>,
    lines: Vec<Line>,
    counts: [usize; 2],
}

impl Writer<'_> {
    fn value(&self, id: NodeId) -> Text {
        match (self.model.graph.node(id), &self.names[id.index()]) {
            (Node::Number(n), _) => self.target.number(n),
            (Node::Symbol(s), _) => self.target.symbol(self.model, s),
            (_, Some(name)) => name.clone(),
            (node, None) => unreachable!("a step before its arguments: {node:?}"),
        }
    }

    fn step(&mut self, step: &Step, constants: Option<&[NodeId]>) {
        match step {
            Step::Node(id) if self.divisors.contains(id) && self.assign_root(*id, constants.is_some()) => {}
            Step::Node(id) => self.assign(*id, self.style.inline, constants),
            Step::SinCos { angle, sin: Some(sin), cos: Some(cos) }
                if self.assign_sin_cos(*angle, [*sin, *cos], constants.is_some()) => {}
            Step::SinCos { angle, sin, cos } => {
                let short = self.value(*angle).text.len() <= self.style.inline_angle;
                for id in [sin, cos].into_iter().copied().flatten() {
                    let kept = constants.is_some_and(|c| c.contains(&id));
                    if short && !kept {
                        self.names[id.index()] = Some(self.operation(id));
                    } else {
                        self.assign(id, self.style.inline, constants);
                    }
                }
            }
            Step::Smooth { orders } => {
                orders.iter().flatten().for_each(|id| self.assign(*id, self.style.inline, constants));
            }
        }
    }

    /// Writes both at once; false where the language cannot.
    fn assign_sin_cos(&mut self, angle: NodeId, pair: [NodeId; 2], hoisted: bool) -> bool {
        let stage = usize::from(!hoisted);
        let name = |above| self.target.variable(self.style.prefixes[stage], self.counts[stage] + above);
        let names = [name(1), name(2)];
        let Some(text) = self.target.assign_sin_cos(names.each_ref(), &self.value(angle)) else {
            return false;
        };
        self.counts[stage] += names.len();
        self.lines.push(Line { text, hoisted });
        for (id, name) in pair.into_iter().zip(names) {
            self.names[id.index()] = Some(name);
        }
        true
    }

    /// Writes a root and its reciprocal at once; false where the language cannot.
    fn assign_root(&mut self, root: NodeId, hoisted: bool) -> bool {
        let Node::Unary(Unary::Sqrt, square) = self.model.graph.node(root) else { return false };
        let stage = usize::from(!hoisted);
        let name = |above| self.target.variable(self.style.prefixes[stage], self.counts[stage] + above);
        let names = [name(1), name(2)];
        let Some(text) = self.target.assign_root(names.each_ref(), &self.value(square)) else { return false };
        self.counts[stage] += names.len();
        self.lines.push(Line { text, hoisted });
        let [own, reciprocal] = names;
        self.names[root.index()] = Some(own);
        self.reciprocals.insert(root, reciprocal);
        true
    }

    /// Writes a step, or keeps its text for the one place that uses it.
    fn assign(&mut self, id: NodeId, inline: usize, constants: Option<&[NodeId]>) {
        let text = self.operation(id);
        let kept = constants.is_some_and(|c| c.contains(&id));
        let length = if self.results[id.index()] { usize::MAX } else { inline };
        if !kept && self.uses[id.index()] == 1 && inline > 0 && text.text.len() <= length {
            self.names[id.index()] = Some(text);
            return;
        }
        let hoisted = constants.is_some();
        let stage = usize::from(!hoisted);
        self.counts[stage] += 1;
        let name = self.target.variable(self.style.prefixes[stage], self.counts[stage]);
        self.lines.push(Line { text: self.target.assign(&name, &text), hoisted });
        self.names[id.index()] = Some(name);
    }

    fn operation(&self, id: NodeId) -> Text {
        let t = self.target;
        let v = |x: NodeId| self.value(x);
        // The right operand of equal rank keeps its parentheses: a + (b + c) is not (a + b) + c.
        let right = |x: NodeId, least: Level| {
            let text = v(x);
            if text.level < least { t.group(&text) } else { text }
        };
        match self.model.graph.node(id) {
            Node::Number(_) | Node::Symbol(_) => v(id),
            Node::Add(a, b) => t.sum(&[(false, v(a)), (false, right(b, Level::Product))]),
            Node::Sub(a, b) => t.sum(&[(false, v(a)), (true, right(b, Level::Product))]),
            Node::Neg(a) => t.sum(&[(true, v(a))]),
            Node::Mul(a, b) => t.product(&[v(a), right(b, Level::Power)], &[]),
            Node::Div(a, b) => match self.reciprocals.get(&b) {
                Some(reciprocal) if self.model.graph.is_one(a) => reciprocal.clone(),
                Some(reciprocal) => t.product(&[v(a), reciprocal.clone()], &[]),
                None => t.product(&[v(a)], &[right(b, Level::Power)]),
            },
            Node::Unary(f, a) => t.unary(f, &v(a)),
            Node::Binary(f, a, b) => t.binary(f, &v(a), &v(b)),
            Node::Select { comparison, left, right, then, otherwise } => {
                t.select(comparison, [&v(left), &v(right)], &v(then), &v(otherwise))
            }
            Node::Smooth { function, order, argument } => {
                t.smooth(&self.model.functions[function.0 as usize].name, order, &v(argument))
            }
        }
    }
}
