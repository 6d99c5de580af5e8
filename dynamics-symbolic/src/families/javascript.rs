//! Loops over elements in JavaScript: what a live page of a model with families runs.
//!
//! The text is a function of the counts and of the numbered parameters. It returns the object of which
//! `family(..)` in `dynamics-live/src/motion/families.js` makes programs. Operations have the order of the
//! Rust loops (`dynamics-macros/src/emit/families/loops`): rounds go into buffers, nodes gather them, sums go
//! block by block. So accelerations and energies have the same bits where M is diagonal.
//!
//! | name | what it is |
//! |---|---|
//! | `C`, `P` | counts, numbered parameters |
//! | `n0` | a count |
//! | `l0`, `c0`, `o0` | of a field: nodes or rows, columns, where it begins in q |
//! | `b1_0` | a buffer: element, number |
//! | `p`, `f`, `t` | scalar parameters, smooth functions, time |
//! | `q`, `u`, `w`, `a` | state, inputs, accelerations |
//! | `s`, `out` | factors of the forces, results |

mod forces;
mod sums;

use std::collections::BTreeMap;

use crate::graph::{Node, NodeId, Symbol};
use crate::schedule::{Staging, schedule};
use crate::text::{Dots, PrintedRound, quoted, round, symbol_mathml};

use super::derive::{Derived, Element};
use super::model::{Anchor, Axis, FamilyModel, Local, NodeIndex, Range, Rounds, Shown, ShownPart, Source};

/// Most operations of one round of all loops of a page together.
const MOST_OPERATIONS: usize = 20_000;

/// What a model with families brings along for a page.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct FamilyPortability {
    /// The function that returns all loops; empty where the obstacles say why.
    pub javascript: String,
    /// The symbols of fields, inputs and scalar parameters in MathML, in this order.
    pub symbols: Vec<String>,
    /// What a page cannot do with the model, in words.
    pub obstacles: Vec<String>,
    /// Whether its picture shows anything of space.
    pub spatial: bool,
}

/// The loops of a model in JavaScript. `shown` is what the page shows, with the units of outputs.
#[must_use]
pub fn javascript(
    family: &FamilyModel,
    derived: &Derived,
    interior: &[Option<NodeId>],
    shown: &[(&Shown, String)],
) -> FamilyPortability {
    let symbols = symbols(family);
    let refused = |obstacle: String| FamilyPortability {
        symbols: symbols.clone(),
        obstacles: vec![obstacle],
        ..FamilyPortability::default()
    };
    if let Some(constraint) = family.constraints.first() {
        let words = "a page has no constraints of models with families yet";
        return refused(format!("{words}, and it has `{}`", constraint.name));
    }
    let operations = all_operations(family, derived, shown);
    if operations > MOST_OPERATIONS {
        let most = format!("a page holds at most {MOST_OPERATIONS}");
        return refused(format!("one round of its loops takes {operations} operations; {most}"));
    }
    let loops = Loops { family, elements: &derived.elements, interior };
    let spatial = shown.iter().any(|(shown, _)| shown.is_place && loops.dimension(shown) == 3);
    FamilyPortability { javascript: loops.all(derived, shown), symbols, obstacles: Vec::new(), spatial }
}

/// Operations of one round of everything that is printed.
fn all_operations(family: &FamilyModel, derived: &Derived, shown: &[(&Shown, String)]) -> usize {
    let of =
        |nodes: Vec<NodeId>| schedule(&family.model.graph, "element", &nodes, Staging::Inline).cost.total();
    let elements = derived.elements.iter().map(|element| {
        let forces = element.forces.iter().map(|(_, node)| *node);
        let entries = element.mass.iter().chain(&element.stiffness).chain(&element.damping);
        let energies = element.kinetic.iter().chain(&element.potential).chain(&element.power).copied();
        of(forces.collect()) + of(entries.map(|(.., node)| *node).collect()) + of(energies.collect())
    });
    let shown = shown.iter().flat_map(|(shown, _)| &shown.parts).map(|part| of(part.values.clone()));
    elements.chain(shown).sum()
}

/// The symbols of fields, inputs and scalar parameters in MathML.
fn symbols(family: &FamilyModel) -> Vec<String> {
    let fields = family.fields.iter().map(|field| &field.name);
    let inputs = family.model.inputs.iter().map(|input| &input.name);
    let scalars = family.model.parameters.iter().zip(&family.sources);
    let scalars = scalars.filter(|(_, source)| matches!(source, Source::Scalar(_))).map(|(p, _)| &p.name);
    fields.chain(inputs).chain(scalars).map(|name| symbol_mathml(name, Dots::None)).collect()
}

/// What writes the loops of one model.
struct Loops<'a> {
    family: &'a FamilyModel,
    elements: &'a [Element],
    interior: &'a [Option<NodeId>],
}

/// Lines of a text, each with its depth of nesting.
#[derive(Default)]
struct Lines {
    text: String,
    depth: usize,
}

impl Lines {
    /// A line; what ends with a bracket opens a block.
    fn open(&mut self, line: &str) {
        self.line(line);
        self.depth += 1;
    }
    fn close(&mut self, line: &str) {
        self.depth -= 1;
        self.line(line);
    }
    fn line(&mut self, line: &str) {
        self.text.extend(std::iter::repeat_n(' ', self.depth));
        self.text.push_str(line);
        self.text.push('\n');
    }
    fn lines<'a>(&mut self, lines: impl IntoIterator<Item = &'a String>) {
        lines.into_iter().for_each(|line| self.line(line));
    }
}

/// Entries of a matrix of an element.
type EntriesOf = dyn Fn(&Element) -> &Vec<(usize, usize, NodeId)>;

impl Loops<'_> {
    /// The whole text.
    fn all(&self, derived: &Derived, shown: &[(&Shown, String)]) -> String {
        let mut out = Lines::default();
        out.open("(({ counts: C, numbered: P }) => {");
        self.sizes(&mut out);
        self.declare_buffers(&mut out);
        out.open("return {");
        out.line("n,");
        out.line(&format!("velocity_forces: {},", derived.velocity_forces));
        out.line(&format!("conservative: {},", derived.conservative));
        out.line(&format!("balanced: {},", derived.balanced));
        out.line(&format!("diagonal: {},", derived.diagonal));
        self.fields(&mut out);
        self.forces(&mut out);
        self.energies(&mut out);
        self.entries(&mut out, "mass(p, f, add) {", &|element| &element.mass);
        self.entries(&mut out, "stiffness(p, f, t, q, u, w, add) {", &|element| &element.stiffness);
        self.entries(&mut out, "damping(p, f, t, q, u, w, add) {", &|element| &element.damping);
        for (name, is_place) in [("outputs", false), ("places", true)] {
            out.open(&format!("{name}: ["));
            for (shown, unit) in shown.iter().filter(|(shown, _)| shown.is_place == is_place) {
                if is_place { self.place(&mut out, shown) } else { self.output(&mut out, shown, unit) }
            }
            out.close("],");
        }
        out.close("};");
        out.close("})");
        out.text.trim_end().to_owned()
    }

    /// Counts, and where fields begin.
    fn sizes(&self, out: &mut Lines) {
        for k in 0..self.family.counts.len() {
            out.line(&format!("const n{k} = C[{k}];"));
        }
        let mut start = "0".to_owned();
        for (k, field) in self.family.fields.iter().enumerate() {
            let length = field.length.map_or_else(|| "1".to_owned(), anchor);
            out.line(&format!("const l{k} = {length}, o{k} = {start};"));
            start = format!("o{k} + l{k}");
            if let Some(columns) = field.columns {
                out.line(&format!("const c{k} = {};", anchor(columns)));
                start = format!("o{k} + l{k}*c{k}");
            }
        }
        out.line(&format!("const n = {start};"));
    }

    /// The declared coordinates.
    fn fields(&self, out: &mut Lines) {
        out.open("fields: [");
        for (k, field) in self.family.fields.iter().enumerate() {
            let columns = if field.columns.is_some() { format!("c{k}") } else { "1".to_owned() };
            let numbered = field.length.is_some();
            out.line(&format!("{{ from: o{k}, rows: l{k}, columns: {columns}, numbered: {numbered} }},"));
        }
        out.close("],");
    }

    /// One round that computes these values, see [`round`].
    fn round(&self, roots: &[NodeId], in_block: bool) -> PrintedRound {
        let graph = &self.family.model.graph;
        let mut names = BTreeMap::new();
        for id in graph.cone(roots) {
            let Node::Symbol(symbol) = graph.node(id) else { continue };
            let node =
                |array: &str, l: u32| format!("{array}[{}]", self.node(self.family.locals[l as usize]));
            let name = match symbol {
                Symbol::Coordinate(l) => node("q", l),
                Symbol::Rate(l) => node("u", l),
                Symbol::Acceleration(l) => node("a", l),
                Symbol::Parameter(p) => self.parameter(p),
                _ => continue,
            };
            names.insert(symbol, name);
        }
        let fixed = |symbol: Symbol| match symbol {
            Symbol::Parameter(p) => {
                matches!(self.family.sources[p as usize], Source::Scalar(_) | Source::Count(_))
            }
            _ => false,
        };
        round(&self.family.model, roots, names, &fixed, in_block)
    }

    fn parameter(&self, p: u32) -> String {
        match self.family.sources[p as usize] {
            Source::Scalar(k) => format!("p[{k}]"),
            Source::Count(c) => format!("n{c}"),
            Source::Round(axis) => axis.name().to_owned(),
            Source::Numbered { parameter, index: of } => format!("P[{parameter}][{}]", index(of)),
        }
    }

    /// Where the node of a local is in q, given `i` and `j`.
    fn node(&self, local: Local) -> String {
        let (field, row) = (local.field, index(local.index));
        match local.column {
            Some(column) => format!("o{field} + {}*c{field} + {}", factor(&row), index(column)),
            None if self.family.fields[field as usize].length.is_none() => format!("o{field}"),
            None => format!("o{field} + {row}"),
        }
    }

    /// Opens the loops of these rounds; returns how many blocks are open.
    fn open_rounds(out: &mut Lines, rounds: Rounds) -> usize {
        let mut open = 0;
        for axis in Axis::ALL {
            let Some(range) = rounds.range(axis) else { continue };
            let ([start, end], i) = (ends(range), axis.name());
            out.open(&format!("for (let {i} = {start}; {i} < {end}; {i}++) {{"));
            open += 1;
        }
        open
    }

    /// The entries of a matrix, element by element.
    fn entries(&self, out: &mut Lines, head: &str, of: &EntriesOf) {
        out.open(head);
        for element in self.elements.iter().filter(|element| !of(element).is_empty()) {
            let entries = of(element);
            let roots: Vec<NodeId> = entries.iter().map(|(.., node)| *node).collect();
            let PrintedRound { before, body, values } = self.round(&roots, false);
            out.open("{");
            out.lines(&before);
            let open = Self::open_rounds(out, element.rounds);
            out.lines(&body);
            for ((a, b, _), value) in entries.iter().zip(&values) {
                let [row, column] = [a, b].map(|a| self.node(self.family.locals[*a]));
                out.line(&format!("add({row}, {column}, {value});"));
            }
            (0..open).for_each(|_| out.close("}"));
            out.close("}");
        }
        out.close("},");
    }

    /// An output: a value for every index, or one.
    fn output(&self, out: &mut Lines, shown: &Shown, unit: &str) {
        let name = quoted(plain(&shown.function));
        let components = self.dimension(shown);
        out.open("{");
        let suffixes: Vec<String> = shown.suffixes.iter().map(|suffix| quoted(suffix)).collect();
        out.line(&format!("name: {name}, unit: {}, suffixes: [{}],", quoted(unit), suffixes.join(", ")));
        let lengths: Vec<String> = shown.parts.iter().map(|part| rounds_in(part.rounds)).collect();
        let count = if shown.numbered { sum_of(&lengths) } else { "1".to_owned() };
        out.line(&format!("numbered: {}, count: {count},", shown.numbered));
        out.open("run(p, f, t, q, u, w, a, out, at) {");
        if !shown.numbered {
            (0..components).for_each(|k| out.line(&format!("out[at + {k}] = 0;")));
        }
        for part in &shown.parts {
            let PrintedRound { before, body, values } = self.round(&part.values, false);
            out.open("{");
            out.lines(&before);
            let open = Self::open_rounds(out, part.rounds);
            out.lines(&body);
            for (k, value) in values.iter().enumerate() {
                match shown.numbered {
                    true => out.line(&format!("out[at++] = {value};")),
                    false => out.line(&format!("out[at + {k}] += {value};")),
                }
            }
            (0..open).for_each(|_| out.close("}"));
            out.close("}");
        }
        out.close("},");
        out.close("},");
    }

    /// Where a helper places a node: of one index, or of two.
    fn place(&self, out: &mut Lines, shown: &Shown) {
        let (name, dimension) = (quoted(plain(&shown.function)), self.dimension(shown));
        out.open("{");
        out.line(&format!("name: {name}, dimension: {dimension},"));
        let ranges: Vec<String> = (0..shown.parts.first().map_or(0, |part| part.indices.len()))
            .map(|k| {
                let values = |part: &ShownPart| part.indices[k].values(part.rounds).map(ends);
                let all: Vec<[String; 2]> = shown.parts.iter().filter_map(values).collect();
                let side = |k: usize| all.iter().map(|ends| ends[k].clone()).collect::<Vec<_>>().join(", ");
                format!("[Math.min({}), Math.max({})]", side(0), side(1))
            })
            .collect();
        out.line(&format!("ranges: [{}],", ranges.join(", ")));
        out.open("run(p, f, t, q, u, w, first, second, out, at) {");
        for part in &shown.parts {
            let PrintedRound { before, body, values } = self.round(&part.values, false);
            Self::open_part(out, part);
            out.lines(before.iter().chain(&body));
            values.iter().enumerate().for_each(|(k, value)| {
                out.line(&format!("out[at + {k}] = {value};"));
            });
            out.line("return;");
            out.close("}");
        }
        out.close("},");
        // The coordinates that move it.
        out.open("touched(first, second) {");
        for part in &shown.parts {
            let graph = &self.family.model.graph;
            let moved = graph.cone(&part.values).into_iter().filter_map(|id| match graph.node(id) {
                Node::Symbol(Symbol::Coordinate(l)) => Some(self.node(self.family.locals[l as usize])),
                _ => None,
            });
            let moved: Vec<String> = moved.collect();
            Self::open_part(out, part);
            out.line(&format!("return [{}];", moved.join(", ")));
            out.close("}");
        }
        out.line("return [];");
        out.close("},");
        out.close("},");
    }

    /// Opens the block of the indices of a part of a place, which are `first` and `second`.
    fn open_part(out: &mut Lines, part: &ShownPart) {
        let (mut conditions, mut names) = (Vec::new(), Vec::new());
        for (of, name) in part.indices.iter().zip(["first", "second"]) {
            match (of, of.values(part.rounds)) {
                (NodeIndex::Round(axis, 0), Some(range)) => {
                    let [start, end] = ends(range);
                    conditions.push(format!("{name} >= {start} && {name} < {end}"));
                    names.push(format!("{} = {name}", axis.name()));
                }
                _ => conditions.push(format!("{name} === {}", index(*of))),
            }
        }
        let all = if conditions.is_empty() { "true".to_owned() } else { conditions.join(" && ") };
        out.open(&format!("if ({all}) {{"));
        if !names.is_empty() {
            out.line(&format!("const {};", names.join(", ")));
        }
    }

    fn dimension(&self, shown: &Shown) -> usize {
        shown.parts.iter().map(|part| part.values.len()).max().unwrap_or(0)
    }
}

/// How many rounds there are.
fn rounds_in(rounds: Rounds) -> String {
    let lengths = rounds.ranges().map(|range| {
        let [start, end] = ends(range);
        format!("Math.max(0, {end} - ({start}))")
    });
    let all: Vec<String> = lengths.collect();
    if all.is_empty() { "1".to_owned() } else { all.join("*") }
}

fn sum_of(terms: &[String]) -> String {
    if terms.is_empty() { "0".to_owned() } else { terms.join(" + ") }
}

/// An index that no round changes.
fn anchor(anchor: Anchor) -> String {
    match anchor {
        Anchor::Start(k) => k.to_string(),
        Anchor::End { count, plus } => offset(&format!("n{count}"), plus),
    }
}

fn ends(range: Range) -> [String; 2] {
    [anchor(range.start), anchor(range.end)]
}

/// An index of a round.
fn index(index: NodeIndex) -> String {
    match index {
        NodeIndex::Round(axis, k) => offset(axis.name(), k),
        NodeIndex::Fixed(at) => anchor(at),
    }
}

/// `name`, `name + 2`, `name - 1`.
fn offset(name: &str, plus: i64) -> String {
    match plus {
        0 => name.to_owned(),
        1.. => format!("{name} + {plus}"),
        _ => format!("{name} - {}", -plus),
    }
}

/// An index as a factor.
fn factor(text: &str) -> String {
    if text.contains(' ') { format!("({text})") } else { text.to_owned() }
}

/// A name of Rust as texts have it.
fn plain(name: &str) -> &str {
    name.strip_prefix("r#").unwrap_or(name)
}
