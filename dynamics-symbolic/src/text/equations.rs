//! The equations of motion for reading: row by row for small systems, M and Q element by element for larger
//! ones.

use std::rc::Rc;

use crate::graph::{Graph, NodeId, Number, Symbol};
use crate::mechanics::{ConstraintEquations, Equations, Model};

use super::expand::{Expanded, MOST_TERMS};
use super::formula::{Formula, Formulas, Key, product, sum};
use super::latex::Latex;
use super::mathml::{Dots, EQUALS, MathMl};
use super::plain::Plain;
use super::target::{Target, Text};

/// Most terms in all of M and Q up to which the equations are written row by row. Longer ones are written in
/// matrix form, with definitions.
const MOST_TERMS_IN_ROWS: usize = 80;
/// Most terms of an element of M or Q that is expanded. A longer one is shorter as a formula with
/// definitions.
const MOST_TERMS_OF_ELEMENT: usize = 20;
/// The same of a side of a row that stands for many nodes.
const MOST_TERMS_OF_ROW: usize = 6;
/// Longest text in bytes. Equations beyond it are left to the listing.
const LONGEST_TEXT: usize = 24_000;
/// The same in MathML, which takes six times the bytes of LaTeX (measured: 4.3 to 7.1).
const LONGEST_MATHML: usize = 6 * LONGEST_TEXT;
/// Columns of a line.
const WIDTH: usize = 100;

/// The equations for reading.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct EquationTexts {
    /// Plain text.
    pub plain: String,
    /// LaTeX.
    pub latex: String,
    /// MathML: one `<p class="eq">` per equation, each term a `<math>` of its own.
    pub mathml: String,
}

/// The equations for reading. May add nodes to the graph.
#[must_use]
pub fn equations(model: &mut Model, equations: &Equations) -> EquationTexts {
    let page = Page::new(model, equations);
    EquationTexts { plain: page.plain(model), latex: page.latex(model), mathml: page.mathml(model) }
}

/// Pairs of nodes as texts `left = right` with what is appended to each, like terms collected, and the
/// definitions that they use; wrapped, and as paragraphs of MathML. May add nodes to the graph.
#[must_use]
pub fn statements(model: &mut Model, rows: &[(NodeId, NodeId, String)]) -> [String; 2] {
    let nodes: Vec<NodeId> = rows.iter().flat_map(|(left, right, _)| [*left, *right]).collect();
    let mut expanded = expand(model, &nodes);
    expanded.iter_mut().for_each(|x| *x = x.take().filter(|x| x.len() <= MOST_TERMS_OF_ROW));
    let wanted =
        |(id, x): (&NodeId, &Option<Expanded>)| x.as_ref().map_or(vec![*id], |x| x.atoms().collect());
    let roots: Vec<NodeId> = nodes.iter().zip(&expanded).flat_map(wanted).collect();
    let formulas = Formulas::new(model, &roots);
    let target = Plain::READABLE;
    let formula = |k: usize| match &expanded[k] {
        Some(x) => x.formula(&model.graph, &formulas),
        None => formulas.formula(nodes[k]),
    };
    let mut out = String::new();
    let mut page = Limited { longest: LONGEST_MATHML, ..Limited::new(String::new()) };
    for (k, (.., appended)) in rows.iter().enumerate() {
        let sides = [formula(2 * k), formula(2 * k + 1)];
        let [left, right] = sides.each_ref().map(|side| formulas.write(&target, model, side));
        out.push_str(&wrap(&format!("{}{appended}", target.assign(&left, &right))));
        let [left, right] = [("", &sides[0]), (EQUALS, &sides[1])]
            .map(|(lead, side)| mathml_terms(&formulas, model, lead, side).join(" "));
        let appended = super::mathml::escaped(&appended.trim().replace("<=", "≤"));
        page.line(&format!("<p class=\"eq\">{left} {right} <span class=\"where\">{appended}</span></p>\n"));
    }
    if formulas.definitions() > 0 {
        out.push_str("\nwith\n\n");
    }
    for k in 0..formulas.definitions() {
        let (name, value) = formulas.definition(&target, model, k);
        out.push_str(&wrap(&target.assign(&name, &value)));
        let name = formulas.definition_name(&MathMl, k).text;
        let right = mathml_terms(&formulas, model, EQUALS, formulas.defined(k)).join(" ");
        page.line(&format!("<p class=\"eq\"><math>{name}</math> {right}</p>\n"));
    }
    [out, page.finish(more_equations)]
}

/// The terms of a formula in MathML, each a `<math>` of its own so that lines break on a phone.
fn mathml_terms(formulas: &Formulas, model: &Model, lead: &str, f: &Formula) -> Vec<String> {
    let text = |(minus, f): (bool, &Formula)| (minus, formulas.write(&MathMl, model, f));
    let terms: Vec<(bool, Text)> = top_level(f).into_iter().map(text).collect();
    MathMl.terms(lead, &terms)
}

fn more_equations(left: usize) -> String {
    format!("<p class=\"eq\">({left} more equations; the listing has everything)</p>\n")
}

/// A quotient of parameters as text, numerator and denominator expanded and without the factors that all
/// terms share; `None` where it is long. May add nodes to the graph.
#[must_use]
pub fn quotient(model: &mut Model, above: NodeId, below: NodeId) -> Option<String> {
    if model.graph.is_zero(above) {
        return Some(String::from("0"));
    }
    let target = Plain::READABLE;
    let mut side = |id: NodeId| {
        let short = |x: &Expanded| x.len() <= MOST_TERMS_OF_ROW;
        Expanded::new(&mut model.graph, id, MOST_TERMS).filter(short)
    };
    let (above, below) = (side(above)?, side(below)?);
    let atoms: Vec<NodeId> = above.atoms().chain(below.atoms()).collect();
    let formulas = Formulas::new(model, &atoms);
    let formula = above.over(&below, &model.graph, &formulas);
    (formulas.definitions() == 0).then(|| formulas.write(&target, model, &formula).text)
}

/// One statement: left = right.
struct Statement {
    left: Side,
    right: Rc<Formula>,
}

enum Side {
    Formula(Rc<Formula>),
    /// A letter with the coordinates that index it.
    Element(&'static str, Vec<usize>),
}

/// What the page shows, in the order of its nodes.
struct Contents {
    /// Below and on the diagonal of M, where it is not zero; ascending.
    lower: Vec<(usize, usize)>,
    /// M, Q, Φ_qᵀλ where there are constraints, then T and V, then the rows of the constraints.
    nodes: Vec<NodeId>,
    /// Where Φ_qᵀλ, the energies and the constraints begin.
    reaction: usize,
    energies: usize,
    constraints: usize,
}

impl Contents {
    fn new(g: &mut Graph, e: &Equations) -> Self {
        let n = e.generalized_force.len();
        let below = (0..e.mass_matrix.len()).flat_map(|i| (0..=i).map(move |j| (i, j)));
        let lower: Vec<(usize, usize)> = below.filter(|(i, j)| !g.is_zero(e.mass_matrix[*i][*j])).collect();
        let mut nodes: Vec<NodeId> = lower.iter().map(|(i, j)| e.mass_matrix[*i][*j]).collect();
        nodes.extend(&e.generalized_force);
        let reaction = nodes.len();
        if let Some(c) = &e.constraints {
            nodes.extend(reactions(g, c, n));
        }
        let energies = nodes.len();
        nodes.extend(e.energies.iter().flat_map(|(t, v)| [t, v]));
        let constraints = nodes.len();
        nodes.extend(e.constraints.iter().flat_map(|c| &c.rows).map(|row| row.node));
        Self { lower, nodes, reaction, energies, constraints }
    }

    fn mass(&self, i: usize, j: usize) -> usize {
        let at = self.lower.binary_search(&(i.max(j), i.min(j)));
        at.expect("only elements that are not zero are written")
    }
}

struct Page {
    formulas: Formulas,
    rows: bool,
    /// Whether M is left out.
    left_out: bool,
    motion: Vec<Statement>,
    /// The names of the constraints with the rows that are zero.
    constraints: Vec<(String, Statement)>,
    energies: Vec<Statement>,
}

impl Page {
    fn new(model: &mut Model, e: &Equations) -> Self {
        let n = e.generalized_force.len();
        let contents = Contents::new(&mut model.graph, e);
        let Contents { lower, nodes, .. } = &contents;
        let mut expanded = expand(model, nodes);
        let terms = |all: &[Option<Expanded>]| {
            all.iter().map(|x| x.as_ref().map(Expanded::len)).sum::<Option<usize>>()
        };
        let motion = &expanded[..contents.energies];
        let short = motion.iter().flatten().all(|x| x.len() <= MOST_TERMS_OF_ELEMENT);
        let rows = short
            && !e.leaves_out_mass_matrix()
            && terms(motion).is_some_and(|terms| terms <= MOST_TERMS_IN_ROWS);
        if !rows {
            // What is long is shorter as a formula with definitions.
            expanded.iter_mut().for_each(|x| *x = x.take().filter(|x| x.len() <= MOST_TERMS_OF_ELEMENT));
        }
        let wanted =
            |(id, x): (&NodeId, &Option<Expanded>)| x.as_ref().map_or(vec![*id], |x| x.atoms().collect());
        let roots: Vec<NodeId> = nodes.iter().zip(&expanded).flat_map(wanted).collect();
        let formulas = Formulas::new(model, &roots);
        let formula = |k: usize| match &expanded[k] {
            Some(x) => x.formula(&model.graph, &formulas),
            None => formulas.formula(nodes[k]),
        };
        let mass = |i: usize, j: usize| formula(contents.mass(i, j));
        let force = |i: usize| formula(lower.len() + i);
        let reaction = |i: usize| formula(contents.reaction + i);
        let constrained = e.constraints.is_some();
        let motion = if rows {
            let right = |i| match constrained {
                true => Rc::new(sum([(false, force(i)), (false, reaction(i))]
                    .into_iter()
                    .filter(|(_, f)| !is_zero(f)))),
                false => force(i),
            };
            (0..n).map(|i| row(model, e, i, &mass, right(i))).collect()
        } else {
            let m = lower
                .iter()
                .map(|(i, j)| Statement { left: Side::Element("M", vec![*i, *j]), right: mass(*i, *j) });
            let q = (0..n).map(|i| Statement { left: Side::Element("Q", vec![i]), right: force(i) });
            let carried =
                (0..n).filter(|i| constrained && !model.graph.is_zero(nodes[contents.reaction + i]));
            let r = carried.map(|i| Statement { left: Side::Element("R", vec![i]), right: reaction(i) });
            m.chain(q).chain(r).collect()
        };
        let names = ["T", "V"].into_iter().zip(contents.energies..contents.constraints);
        let energies =
            names.map(|(name, k)| Statement { left: Side::Element(name, Vec::new()), right: formula(k) });
        let energies = energies.collect();
        let zero = Rc::new(Formula::Number(Number::ZERO));
        let restricts = |k: usize| Statement { left: Side::Formula(formula(k)), right: zero.clone() };
        let named = e.constraints.iter().flat_map(|c| &c.rows).zip(contents.constraints..);
        let constraints = named.map(|(row, k)| (row.name.clone(), restricts(k))).collect();
        let left_out = e.leaves_out_mass_matrix();
        Self { rows, left_out, motion, constraints, energies, formulas }
    }

    fn side(
        &self,
        target: &dyn Target,
        model: &Model,
        side: &Side,
        index: &dyn Fn(&[usize]) -> String,
    ) -> Text {
        match side {
            Side::Formula(f) => self.formulas.write(target, model, f),
            Side::Element(letter, indices) if indices.is_empty() => Text::atom(*letter),
            Side::Element(letter, indices) => Text::atom(format!("{letter}{}", index(indices))),
        }
    }

    fn plain(&self, model: &Model) -> String {
        let target = Plain::READABLE;
        let index = |indices: &[usize]| {
            let names: Vec<&str> = indices.iter().map(|i| model.coordinates[*i].name.as_str()).collect();
            format!("[{}]", names.join(", "))
        };
        let mut out = Limited::new(format!("{}: equations of motion\n", model.name));
        if self.left_out {
            out.line("\nM q'' = Q; M is left out as too large, and q'' is found without it\n");
        } else if !self.rows && self.constraints.is_empty() {
            out.line("\nM q'' = Q with M symmetric; elements that are not listed are zero\n");
        } else if !self.rows {
            out.line(
                "\nM q'' = Q + R with M symmetric and reactions R; elements that are not listed are zero\n",
            );
        }
        out.line("\n");
        let write = |out: &mut Limited, s: &Statement| {
            let left = self.side(&target, model, &s.left, &index);
            let right = self.formulas.write(&target, model, &s.right);
            out.line(&wrap(&target.assign(&left, &right)));
        };
        self.motion.iter().for_each(|s| write(&mut out, s));
        if !self.constraints.is_empty() {
            out.line("\nconstraints\n\n");
        }
        for (name, s) in &self.constraints {
            let left = self.side(&target, model, &s.left, &index);
            let right = self.formulas.write(&target, model, &s.right);
            out.line(&wrap(&format!("{name}: {}", target.assign(&left, &right))));
        }
        if self.formulas.definitions() > 0 {
            out.line("\nwith\n\n");
        }
        for i in 0..self.formulas.definitions() {
            let (name, value) = self.formulas.definition(&target, model, i);
            out.line(&wrap(&target.assign(&name, &value)));
        }
        if !self.energies.is_empty() {
            out.line("\nenergies\n\n");
        }
        self.energies.iter().for_each(|s| write(&mut out, s));
        out.finish(|left| format!("\n({left} more lines; the listing has everything)\n"))
    }

    fn latex(&self, model: &Model) -> String {
        let target = Latex;
        let index = |indices: &[usize]| {
            let numbers: Vec<String> = indices.iter().map(|i| (i + 1).to_string()).collect();
            format!("_{{{}}}", numbers.join(","))
        };
        let mut out = Limited::new(String::new());
        let written = |s: &Statement| {
            let left = self.side(&target, model, &s.left, &index);
            broken(&self.formulas, &target, model, &s.left, left, &s.right)
        };
        let mut lines: Vec<String> = self.motion.iter().flat_map(written).collect();
        for (name, s) in &self.constraints {
            lines.extend(written(s));
            if let Some(last) = lines.last_mut() {
                last.push_str(&format!(" \\qquad ({})", super::latex::name(name, "")));
            }
        }
        lines.extend(self.energies.iter().flat_map(written));
        for i in 0..self.formulas.definitions() {
            let (name, value) = self.formulas.definition(&target, model, i);
            lines.push(target.assign(&name, &value));
        }
        out.line("\\begin{align*}\n");
        let last = lines.len().saturating_sub(1);
        for (i, line) in lines.iter().enumerate() {
            out.line(&format!("  {line}{}\n", if i == last { "" } else { " \\\\" }));
        }
        let mut text = out.finish(|left| format!("  & \\text{{({left} more lines)}}\n"));
        text.push_str("\\end{align*}\n");
        text
    }

    /// One paragraph per equation.
    fn mathml(&self, model: &Model) -> String {
        let target = MathMl;
        let index = |indices: &[usize]| {
            let numbers: Vec<String> = indices.iter().map(|i| format!("<mn>{}</mn>", i + 1)).collect();
            numbers.join("<mo>,</mo>")
        };
        let terms = |lead: &str, f: &Formula| mathml_terms(&self.formulas, model, lead, f);
        let equation = |s: &Statement| {
            let left = match &s.left {
                Side::Formula(f) => terms("", f),
                Side::Element(letter, indices) if indices.is_empty() => {
                    vec![format!("<math><mi>{letter}</mi></math>")]
                }
                Side::Element(letter, indices) => {
                    let index = index(indices);
                    vec![format!("<math><msub><mi>{letter}</mi><mrow>{index}</mrow></msub></math>")]
                }
            };
            [left, terms(EQUALS, &s.right)].concat().join(" ")
        };
        let mut paragraphs = Vec::new();
        paragraphs.extend(self.matrix_form());
        paragraphs.extend(self.motion.iter().map(equation));
        let named = |(name, s): &(String, Statement)| {
            let name = super::mathml::name(name, Dots::None);
            format!("{} <math class=\"name\"><mo>(</mo>{name}<mo>)</mo></math>", equation(s))
        };
        paragraphs.extend(self.constraints.iter().map(named));
        paragraphs.extend(self.energies.iter().map(equation));
        paragraphs.extend((0..self.formulas.definitions()).map(|i| {
            let name = self.formulas.definition_name(&target, i);
            let right = terms(EQUALS, self.formulas.defined(i));
            format!("<math>{}</math> {}", name.text, right.join(" "))
        }));
        let mut out = Limited { longest: LONGEST_MATHML, ..Limited::new(String::new()) };
        paragraphs.iter().for_each(|p| out.line(&format!("<p class=\"eq\">{p}</p>\n")));
        out.finish(more_equations)
    }

    /// In MathML the equation whose elements follow; `None` where equations are written row by row.
    fn matrix_form(&self) -> Option<String> {
        let (reactions, words) = match (self.left_out, self.constraints.is_empty()) {
            (true, _) => ("", "; M is left out as too large"),
            (false, _) if self.rows => return None,
            (false, true) => ("", " with M symmetric; elements that are not listed are zero"),
            (false, false) => {
                let words = " with M symmetric and reactions R; elements that are not listed are zero";
                ("<mo>+</mo><mi>R</mi>", words)
            }
        };
        let left = "<mi>M</mi><mover><mi>q</mi><mo>¨</mo></mover>";
        Some(format!("<math>{left}<mo>=</mo><mi>Q</mi>{reactions}</math>{words}"))
    }
}

/// Textbook forms where they are short; fewer attempts are made once the whole is not.
fn expand(model: &mut Model, nodes: &[NodeId]) -> Vec<Option<Expanded>> {
    let (mut terms, mut limit) = (0, MOST_TERMS);
    let mut all = Vec::new();
    for id in nodes {
        let expanded = Expanded::new(&mut model.graph, *id, limit);
        terms += expanded.as_ref().map_or(MOST_TERMS_IN_ROWS, Expanded::len);
        if terms > MOST_TERMS_IN_ROWS {
            limit = 2 * MOST_TERMS_OF_ELEMENT;
        }
        all.push(expanded);
    }
    all
}

/// Φ_qᵀλ, column by column.
fn reactions(g: &mut Graph, c: &ConstraintEquations, n: usize) -> Vec<NodeId> {
    let mut reactions = vec![g.zero(); n];
    for (r, row) in c.jacobian.iter().enumerate() {
        let lambda = g.symbol(Symbol::Multiplier(r as u32));
        for (sum, entry) in reactions.iter_mut().zip(row) {
            let term = g.mul(*entry, lambda);
            *sum = g.add(*sum, term);
        }
    }
    reactions
}

fn is_zero(formula: &Formula) -> bool {
    matches!(formula, Formula::Number(n) if n.value() == 0.0)
}

/// Σⱼ Mᵢⱼ q̈ⱼ = right-hand side.
fn row(
    model: &Model,
    e: &Equations,
    i: usize,
    mass: &dyn Fn(usize, usize) -> Rc<Formula>,
    force: Rc<Formula>,
) -> Statement {
    let g = &model.graph;
    let columns = (0..e.mass_matrix.len()).filter(|j| !g.is_zero(e.mass_matrix[i][*j]));
    let terms = columns.map(|j| {
        let acceleration = Rc::new(Formula::Symbol(Symbol::Acceleration(j as u32)));
        let key = Key::last(Symbol::Acceleration(j as u32));
        (false, Rc::new(product([(Key::FIRST, mass(i, j), 1), (key, acceleration, 1)])))
    });
    Statement { left: Side::Formula(Rc::new(sum(terms.collect::<Vec<_>>()))), right: force }
}

/// A LaTeX statement, broken between the terms of long sides.
fn broken(
    formulas: &Formulas,
    target: &dyn Target,
    model: &Model,
    left: &Side,
    name: Text,
    right: &Formula,
) -> Vec<String> {
    let whole = formulas.write(target, model, right);
    if visible(&name.text) + visible(&whole.text) <= WIDTH {
        return vec![target.assign(&name, &whole)];
    }
    let parts = |f: &Formula| sum_lines(formulas, target, model, f);
    let Side::Formula(formula) = left else {
        let mut lines = parts(right);
        lines[0] = format!("{} &= {}", name.text, lines[0]);
        lines[1..].iter_mut().for_each(|line| *line = format!("&\\quad {line}"));
        return lines;
    };
    // Both sides begin at the margin, what continues them is indented.
    let side = |f: &Formula, sign: &str| {
        let mut lines = parts(f);
        lines[0] = format!("&{sign}{}", lines[0]);
        lines[1..].iter_mut().for_each(|line| *line = format!("&\\qquad {line}"));
        lines
    };
    [side(formula, ""), side(right, "\\quad = ")].concat()
}

/// The terms of a sum in lines of limited width, each line after the first beginning with its sign.
fn sum_lines(formulas: &Formulas, target: &dyn Target, model: &Model, formula: &Formula) -> Vec<String> {
    let Formula::Sum(terms) = formula else { return vec![formulas.write(target, model, formula).text] };
    let mut lines: Vec<Vec<(bool, Text)>> = vec![Vec::new()];
    let mut width = 0;
    for (minus, term) in terms {
        let text = formulas.write(target, model, term);
        let own = visible(&text.text) + 3;
        if width > 0 && width + own > WIDTH * 3 / 4 {
            lines.push(Vec::new());
            width = 0;
        }
        width += own;
        if let Some(line) = lines.last_mut() {
            line.push((*minus, text));
        }
    }
    let written = lines.iter().enumerate().map(|(i, line)| {
        let text = target.sum(line).text;
        // A sum writes no sign before a positive first term.
        if i > 0 && line.first().is_some_and(|(minus, _)| !minus) { format!("+ {text}") } else { text }
    });
    written.collect()
}

/// The terms of a sum; those of its first term too where that is a sum, as no parentheses are written there.
fn top_level(formula: &Formula) -> Vec<(bool, &Formula)> {
    match formula {
        Formula::Sum(terms) => match &terms[..] {
            [(false, first), rest @ ..] => {
                let mut all = top_level(first);
                all.extend(rest.iter().map(|(minus, f)| (*minus, &**f)));
                all
            }
            all => all.iter().map(|(minus, f)| (*minus, &**f)).collect(),
        },
        Formula::Product(Number::Rational(1, 1), factors) => match &factors[..] {
            [one] if one.exponent == 1 => top_level(&one.formula),
            _ => vec![(false, formula)],
        },
        _ => vec![(false, formula)],
    }
}

/// Roughly how many characters of a LaTeX text are seen.
fn visible(latex: &str) -> usize {
    let mut count = 0;
    let mut command = false;
    for c in latex.chars() {
        command = c == '\\' || command && c.is_ascii_alphabetic();
        count += usize::from(!command && !matches!(c, '{' | '}' | '_' | '^' | ' '));
    }
    count
}

/// A statement in lines of limited width, broken before signs, preferably those outside all parentheses.
fn wrap(statement: &str) -> String {
    let mut out = String::new();
    let mut rest = statement.trim_end();
    let mut indent = 0;
    while rest.len() > WIDTH - indent {
        let Some(at) = break_point(rest, WIDTH - indent) else { break };
        out.push_str(&format!("{}{}\n", " ".repeat(indent), &rest[..at]));
        rest = &rest[at + 1..];
        indent = 4;
    }
    out.push_str(&format!("{}{rest}\n", " ".repeat(indent)));
    out
}

/// The space to break at: the last one of the least depth within the width, else the first one after it.
fn break_point(text: &str, width: usize) -> Option<usize> {
    let mut depth = 0usize;
    let mut best: Option<(usize, usize)> = None;
    for (i, c) in text.char_indices() {
        match c {
            '(' | '[' | '{' => depth += 1,
            ')' | ']' | '}' => depth = depth.saturating_sub(1),
            ' ' if ["+ ", "- ", "= "].iter().any(|s| text[i + 1..].starts_with(s)) => {
                let within = i <= width;
                // An equation reads best with each side in one piece.
                let depth = if text[i + 1..].starts_with('=') { 0 } else { depth + 1 };
                match best {
                    Some(_) if !within => return best.map(|(at, _)| at),
                    // Too early a break leaves ragged lines.
                    Some((at, d)) if depth > d && at > width / 3 => {}
                    _ => best = Some((i, depth)),
                }
            }
            _ => {}
        }
    }
    best.map(|(at, _)| at)
}

/// A text that stops growing, and says so.
struct Limited {
    text: String,
    longest: usize,
    left: usize,
}

impl Limited {
    fn new(text: String) -> Self {
        Self { text, longest: LONGEST_TEXT, left: 0 }
    }
    fn line(&mut self, line: &str) {
        if self.left > 0 || self.text.len() + line.len() > self.longest {
            self.left += 1;
        } else {
            self.text.push_str(line);
        }
    }
    fn finish(mut self, note: impl FnOnce(usize) -> String) -> String {
        if self.left > 0 {
            let note = note(self.left);
            self.text.push_str(&note);
        }
        self.text
    }
}
