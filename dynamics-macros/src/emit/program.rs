//! Straight-line programs as Rust.
//!
//! One step is one `let` on `f64`. A block of some thousands of `let`s crashes rustc when debug info is on
//! (rust-lang/rust#122357), so steps stand in nested blocks of at most [`STEPS_OF_BLOCK`] that return what
//! later blocks read; above [`MOST_UNSPLIT`] operations a program is cut into functions of about
//! [`OPERATIONS_OF_PART`] operations, which halves the compile time of large models for some run time, or,
//! where runs do not ask for it at every step, made a table (`program/table.rs`).

mod fused;
mod operand;
mod parts;
mod table;

use std::collections::{BTreeMap, BTreeSet};

use dynamics_symbolic::graph::{Graph, Node, NodeId};
use dynamics_symbolic::schedule::{Program, Step};
use dynamics_symbolic::text::divisors;
use fused::Fused;
use proc_macro2::TokenStream;
use quote::quote;

pub(super) use operand::{Access, Block, LANES_OF_BLOCK};
pub(super) use parts::{Body, Printed};

/// Most `let`s of one block. Blocks of some thousands crash rustc, see the head of the file.
const STEPS_OF_BLOCK: usize = 256;
/// Most angles of one call of sine and cosine: two vectors of two doubles, or one of four.
const ANGLES_OF_CALL: usize = 4;
/// Operations above which a program is cut into functions. A smaller bound compiles faster and runs slower.
const MOST_UNSPLIT: usize = 4_000;
/// Operations of one such function.
const OPERATIONS_OF_PART: usize = 1_024;

/// The nodes that a step defines.
pub(super) fn defined(step: &Step) -> Vec<NodeId> {
    match step {
        Step::Node(id) => vec![*id],
        Step::SinCos { sin, cos, .. } => sin.iter().chain(cos).copied().collect(),
        Step::Smooth { orders } => orders.iter().flatten().copied().collect(),
    }
}

/// The nodes that a step reads.
pub(super) fn read(graph: &Graph, step: &Step) -> Vec<NodeId> {
    match step {
        Step::Node(id) => graph.node(*id).children().collect(),
        Step::SinCos { angle, .. } => vec![*angle],
        Step::Smooth { orders } => {
            orders.iter().flatten().next().map(|id| graph.node(*id).children().collect()).unwrap_or_default()
        }
    }
}

/// Prints the steps of one function: where every value is found, and the `let`s.
///
/// Statements are printed as text and parsed once: handing tens of thousands of tokens to the compiler one by
/// one took most of the time of a large model.
struct Printer<'a> {
    access: &'a Access<'a>,
    /// Values at hand and how they are written.
    values: BTreeMap<NodeId, String>,
    /// Values that are read once, in the block that computes them: they are written where they are read.
    inline: BTreeSet<NodeId>,
    /// How deep the expression of such a value is nested.
    depths: BTreeMap<NodeId, usize>,
    /// Products that are written with the sums that read them.
    fused: Fused,
    /// Roots that something is divided by, in loops over blocks: how their reciprocals are written, once they
    /// are known.
    reciprocals: BTreeMap<NodeId, String>,
    divisors: BTreeSet<NodeId>,
    /// Locals used so far, for their numbers.
    locals: usize,
}

/// Deepest nesting of values that are written where they are read. A larger value writes longer expressions
/// in fewer `let`s.
const MOST_NESTED: usize = 8;

impl<'a> Printer<'a> {
    fn new(access: &'a Access<'a>) -> Self {
        Self {
            access,
            values: BTreeMap::new(),
            inline: BTreeSet::new(),
            depths: BTreeMap::new(),
            fused: Fused::default(),
            reciprocals: BTreeMap::new(),
            divisors: BTreeSet::new(),
            locals: 0,
        }
    }

    /// How a value is read here.
    fn value(&self, id: NodeId) -> String {
        self.values.get(&id).cloned().unwrap_or_else(|| self.access.leaf(id))
    }

    /// How a value is read here, as tokens.
    fn result(&self, id: NodeId) -> TokenStream {
        parsed(&self.value(id))
    }

    /// Steps in blocks, with what they refer to; `wanted` is what must be at hand afterwards.
    fn statements(&mut self, steps: &[Step], wanted: &BTreeSet<NodeId>) -> TokenStream {
        let (imports, steps) = (self.access.imports(), parsed(&self.steps(steps, wanted)));
        quote!(#imports #steps)
    }

    fn steps(&mut self, steps: &[Step], wanted: &BTreeSet<NodeId>) -> String {
        self.find_inline(steps, wanted);
        if steps.len() <= STEPS_OF_BLOCK {
            return self.lines(steps);
        }
        let blocks: Vec<&[Step]> = steps.chunks(STEPS_OF_BLOCK).collect();
        let mut needed = vec![wanted.clone(); blocks.len()];
        for i in (0..blocks.len() - 1).rev() {
            needed[i] = needed[i + 1].clone();
            needed[i].extend(blocks[i + 1].iter().flat_map(|step| self.fused.read(self.access.graph, step)));
        }
        blocks.iter().zip(&needed).map(|(block, needed)| self.block(block, needed)).collect()
    }

    /// Fewer `let`s are less work for the compiler, which sees the same operations in the same order.
    fn find_inline(&mut self, steps: &[Step], wanted: &BTreeSet<NodeId>) {
        let mut readers: BTreeMap<NodeId, (usize, usize)> = BTreeMap::new();
        for (i, step) in steps.iter().enumerate() {
            for id in self.fused.read(self.access.graph, step) {
                let (count, block) = readers.entry(id).or_default();
                (*count, *block) = (*count + 1, i / STEPS_OF_BLOCK);
            }
        }
        self.inline = steps
            .iter()
            .enumerate()
            .filter_map(|(i, step)| match step {
                Step::Node(id)
                    if !wanted.contains(id) && readers.get(id) == Some(&(1, i / STEPS_OF_BLOCK)) =>
                {
                    Some(*id)
                }
                _ => None,
            })
            .collect();
    }

    /// One block that returns those of its values that are needed later.
    fn block(&mut self, steps: &[Step], needed: &BTreeSet<NodeId>) -> String {
        let body = self.lines(steps);
        let out: String = steps
            .iter()
            .flat_map(defined)
            .filter(|id| needed.contains(id))
            .map(|id| format!("{},", self.value(id)))
            .collect();
        format!("let ({out})={{{body}({out})}};\n")
    }

    /// Steps one after the other; sines and cosines that stand together are evaluated side by side.
    fn lines(&mut self, mut steps: &[Step]) -> String {
        let mut lines = String::new();
        while let [step, rest @ ..] = steps {
            let run = self.known_angles(steps);
            if run > 1 && !self.access.accurate && !self.access.lanes && self.access.block.is_none() {
                let (together, rest) = steps.split_at(run);
                lines.push_str(&self.sines_and_cosines(together));
                steps = rest;
            } else {
                lines.push_str(&self.step(step));
                steps = rest;
            }
        }
        lines
    }

    /// How many of the first steps are sines and cosines of angles that are known before: none is a sine or
    /// cosine of these.
    fn known_angles(&self, steps: &[Step]) -> usize {
        let mut found: Vec<NodeId> = Vec::new();
        let known = |step: &&Step| match step {
            Step::SinCos { angle, .. } if !found.contains(angle) => {
                found.extend(defined(step));
                true
            }
            _ => false,
        };
        steps.iter().take_while(known).take(ANGLES_OF_CALL).count()
    }

    /// Several angles in one call.
    fn sines_and_cosines(&mut self, steps: &[Step]) -> String {
        let (mut angles, mut sines, mut cosines) = (String::new(), String::new(), String::new());
        for step in steps {
            let Step::SinCos { angle, sin, cos } = step else { continue };
            angles += &format!("{},", self.value(*angle));
            let mut name = |id: &Option<NodeId>| id.map_or_else(|| "_".to_owned(), |id| self.define(id));
            sines += &format!("{},", name(sin));
            cosines += &format!("{},", name(cos));
        }
        format!("let ([{sines}],[{cosines}])=__sin_cos::lanes([{angles}]);\n")
    }

    fn step(&mut self, step: &Step) -> String {
        match step {
            Step::Node(id) if self.divisors.contains(id) => self.root(*id),
            Step::Node(id) => {
                let value = self.operation(*id);
                let read = self.fused.read(self.access.graph, step);
                let below = read.iter().filter_map(|id| self.depths.get(id)).max();
                let depth = below.map_or(1, |depth| depth + 1);
                if depth <= MOST_NESTED && self.inline.contains(id) {
                    self.values.insert(*id, format!("({value})"));
                    self.depths.insert(*id, depth);
                    return String::new();
                }
                format!("let {}={value};\n", self.define(*id))
            }
            Step::SinCos { angle, sin, cos } => self.sin_cos(*angle, *sin, *cos),
            Step::Smooth { orders } => self.smooth(orders),
        }
    }

    /// A root that something is divided by, and its reciprocal.
    fn root(&mut self, id: NodeId) -> String {
        let Node::Unary(_, square) = self.access.graph.node(id) else { return String::new() };
        let square = self.value(square);
        let (root, near) = (self.define(id), self.access.block == Some(Block::Near));
        self.reciprocals.insert(id, format!("__r{root}"));
        let pair = match near {
            true => "__far|=__loops::roots::is_far(__x);let __r=__loops::roots::near(__x);(__r,__x*__r)",
            // x/√x is no number at 0.
            false => "__loops::roots::reciprocal_and_root(__x)",
        };
        self.access.has_range.set(true);
        format!("let (__r{root},{root})={{let __x={square};{pair}}};\n")
    }

    fn sin_cos(&mut self, angle: NodeId, sin: Option<NodeId>, cos: Option<NodeId>) -> String {
        let angle = self.value(angle);
        if self.access.block == Some(Block::Near) && !self.access.accurate {
            let mut name = |id: Option<NodeId>| id.map_or_else(|| "_".to_owned(), |id| self.define(id));
            let (sin, cos) = (name(sin), name(cos));
            self.access.has_range.set(true);
            return format!(
                "let ({sin},{cos})={{let __x={angle};__far|=__sin_cos::is_far(__x);__sin_cos::near(__x)}};\n"
            );
        }
        if self.access.lanes {
            let both = if self.access.accurate { "sin_cos_accurate" } else { "sin_cos" };
            let mut name = |id: Option<NodeId>| id.map_or_else(|| "_".to_owned(), |id| self.define(id));
            let (sin, cos) = (name(sin), name(cos));
            return format!("let ({sin},{cos})={angle}.{both}();\n");
        }
        let (module, both) = if self.access.accurate { ("__math", "sin_cos") } else { ("__sin_cos", "fast") };
        let mut name = |id: Option<NodeId>| id.map(|id| self.define(id));
        match (name(sin), name(cos)) {
            (Some(sin), Some(cos)) => format!("let ({sin},{cos})={module}::{both}({angle});\n"),
            (Some(sin), None) => format!("let {sin}={module}::sin({angle});\n"),
            (None, Some(cos)) => format!("let {cos}={module}::cos({angle});\n"),
            (None, None) => String::new(),
        }
    }

    /// Names the value that is computed next.
    fn define(&mut self, id: NodeId) -> String {
        let name = format!("__v{}", self.locals);
        self.locals += 1;
        self.values.insert(id, name.clone());
        name
    }

    fn smooth(&mut self, orders: &[Option<NodeId>; 4]) -> String {
        let Some((function, argument)) =
            orders.iter().flatten().find_map(|id| match self.access.graph.node(*id) {
                Node::Smooth { function, argument, .. } => Some((function, argument)),
                _ => None,
            })
        else {
            return String::new();
        };
        let (function, argument) = (self.access.function(function), self.value(argument));
        let names = orders.map(|order| order.map_or_else(|| "_".to_owned(), |id| self.define(id)));
        format!("let [{}]=__Smooth::derivatives(&{function},{argument});\n", names.join(","))
    }
}

/// A short program without staging: its statements, and its results as expressions after them.
pub(super) fn straight(access: &Access<'_>, program: &Program) -> (TokenStream, Vec<TokenStream>) {
    let wanted: BTreeSet<NodeId> = program.results.iter().copied().collect();
    let mut printer = Printer::new(access);
    let steps = all_steps(program, false);
    if access.block.is_some() {
        printer.divisors = divisors(access.graph, program);
    }
    let statements = printer.statements(&steps, &wanted);
    let results = program.results.iter().map(|id| printer.result(*id)).collect();
    (statements, results)
}

/// Printed code as tokens.
fn parsed(code: &str) -> TokenStream {
    code.parse().expect("printed statements are Rust")
}

/// Steps of `program` that are computed where `hoisted` says: with the body, or apart.
fn all_steps(program: &Program, staged: bool) -> Vec<Step> {
    let hoisted = if staged { &[][..] } else { &program.hoisted[..] };
    hoisted.iter().chain(&program.body).copied().collect()
}
