//! Readable formulas: sums and products without superfluous parentheses, powers, the user's names, and
//! definitions for what is long and shared.

use std::rc::Rc;

use crate::graph::{Binary, Comparison, Dependence, FunctionId, Graph, Node, NodeId, Number, Symbol, Unary};
use crate::mechanics::Model;

use super::target::{Target, Text};

/// A formula; its size is bounded, because what grows beyond becomes a definition.
#[derive(Clone, Debug)]
pub(super) enum Formula {
    Number(Number),
    Symbol(Symbol),
    /// The definition with this index.
    Defined(usize),
    Sum(Vec<(bool, Rc<Formula>)>),
    /// coefficient · Π factorᵉ.
    Product(Number, Vec<Factor>),
    Unary(Unary, Rc<Formula>),
    Binary(Binary, Rc<Formula>, Rc<Formula>),
    Select(Comparison, [Rc<Formula>; 4]),
    Smooth(FunctionId, u8, Rc<Formula>),
}

/// A factor of a product.
#[derive(Clone, Debug)]
pub(super) struct Factor {
    pub(super) key: Key,
    pub(super) formula: Rc<Formula>,
    pub(super) exponent: i32,
}

/// Order of factors: parameters, then functions of the state, then rates, then accelerations and multipliers;
/// symbols before others, in the order of declaration.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) struct Key(u8, Option<Symbol>, u64);

impl Key {
    /// Before everything else.
    pub(super) const FIRST: Self = Self(0, None, 0);

    /// After everything else: accelerations.
    pub(super) const fn last(symbol: Symbol) -> Self {
        Self(6, Some(symbol), 0)
    }

    pub(super) fn of(g: &Graph, id: NodeId) -> Self {
        let d = g.dependence(id);
        let class = if d.on(Dependence::ACCELERATIONS.with(Dependence::MULTIPLIERS)) {
            3
        } else if d.on(Dependence::RATES) {
            2
        } else {
            u8::from(!g.is_constant(id))
        };
        match g.node(id) {
            Node::Symbol(s) => Self(2 * class, Some(s), 0),
            _ => Self(2 * class + 1, None, id.index() as u64),
        }
    }
}

#[derive(Clone, Debug)]
struct Entry {
    formula: Rc<Formula>,
    /// Operations and operands when written out.
    weight: usize,
}

/// Largest formula, in nodes, that is repeated wherever it is used. A larger one is defined once.
const MOST_REPEATED: usize = 16;
/// Largest formula in nodes, used once or often. A larger one is cut into definitions; this is some lines of
/// text.
const LARGEST_FORMULA: usize = 120;

/// The formulas of some nodes and the definitions that they use.
#[derive(Clone, Debug)]
pub struct Formulas {
    entries: Vec<Option<Entry>>,
    definitions: Vec<Rc<Formula>>,
    prefix: &'static str,
}

/// Whether a user's name could be mistaken for `prefix` and a number.
pub(super) fn is_taken(model: &Model, prefix: &str) -> bool {
    let names = model.coordinates.iter().map(|c| &c.name).chain(model.inputs.iter().map(|i| &i.name));
    let names =
        names.chain(model.parameters.iter().map(|p| &p.name)).chain(model.functions.iter().map(|f| &f.name));
    names.map(|n| n.as_str()).any(|n| {
        n.strip_prefix(prefix).is_some_and(|rest| rest.starts_with(|c: char| c.is_ascii_digit() || c == '['))
    })
}

impl Formulas {
    /// Formulas for `roots`, where what is long and shared is defined once.
    #[must_use]
    pub fn new(model: &Model, roots: &[NodeId]) -> Self {
        Self::sharing(model, roots, MOST_REPEATED)
    }

    /// The text of one node without definitions; `None` where it is too long for that.
    #[must_use]
    pub fn whole(target: &dyn Target, model: &Model, id: NodeId) -> Option<Text> {
        let formulas = Self::sharing(model, &[id], LARGEST_FORMULA);
        (formulas.definitions() == 0).then(|| formulas.text(target, model, id))
    }

    /// Formulas for `roots`; what is used several times and larger than `shared` is defined once.
    fn sharing(model: &Model, roots: &[NodeId], shared: usize) -> Self {
        let g = &model.graph;
        let end = roots.iter().map(|r| r.index() + 1).max().unwrap_or(0);
        let mut uses = vec![0u32; end];
        roots.iter().for_each(|r| uses[r.index()] += 1);
        for id in g.ids().take(end).rev().filter(|id| id.index() < end) {
            if uses[id.index()] > 0 {
                g.node(id).children().for_each(|c| uses[c.index()] += 1);
            }
        }
        let prefix = ["w", "z", "h", "aux"].into_iter().find(|p| !is_taken(model, p)).unwrap_or("_");
        let mut all = Self { entries: vec![None; end], definitions: Vec::new(), prefix };
        for id in g.ids().take(end) {
            let count = uses[id.index()];
            if count == 0 {
                continue;
            }
            let mut entry = all.build(g, id);
            if entry.weight > LARGEST_FORMULA || count > 1 && entry.weight > shared {
                all.definitions.push(entry.formula);
                entry = Entry { formula: Rc::new(Formula::Defined(all.definitions.len() - 1)), weight: 1 };
            }
            all.entries[id.index()] = Some(entry);
        }
        all
    }

    /// Number of definitions.
    #[must_use]
    pub fn definitions(&self) -> usize {
        self.definitions.len()
    }

    /// The name and text of a definition.
    #[must_use]
    pub fn definition(&self, target: &dyn Target, model: &Model, index: usize) -> (Text, Text) {
        (self.definition_name(target, index), self.write(target, model, self.defined(index)))
    }

    /// The name of a definition.
    pub(super) fn definition_name(&self, target: &dyn Target, index: usize) -> Text {
        target.variable(self.prefix, index + 1)
    }

    /// What a definition stands for.
    pub(super) fn defined(&self, index: usize) -> &Formula {
        &self.definitions[index]
    }

    /// The text of one of the nodes.
    #[must_use]
    pub fn text(&self, target: &dyn Target, model: &Model, id: NodeId) -> Text {
        self.write(target, model, &self.entry(id).formula)
    }

    pub(super) fn formula(&self, id: NodeId) -> Rc<Formula> {
        self.entry(id).formula.clone()
    }

    fn entry(&self, id: NodeId) -> &Entry {
        self.entries[id.index()].as_ref().expect("arguments and roots have been built")
    }

    fn build(&self, g: &Graph, id: NodeId) -> Entry {
        let at = |x: NodeId| self.entry(x).formula.clone();
        let weight = 1 + g.node(id).children().map(|c| self.entry(c).weight).sum::<usize>();
        let formula = match g.node(id) {
            Node::Number(n) => Formula::Number(n),
            Node::Symbol(s) => Formula::Symbol(s),
            Node::Add(a, b) => sum([(false, at(a)), (false, at(b))]),
            Node::Sub(a, b) => sum([(false, at(a)), (true, at(b))]),
            Node::Neg(a) => sum([(true, at(a))]),
            Node::Mul(a, b) => product([(Key::of(g, a), at(a), 1), (Key::of(g, b), at(b), 1)]),
            Node::Div(a, b) => product([(Key::of(g, a), at(a), 1), (Key::of(g, b), at(b), -1)]),
            Node::Unary(f, a) => Formula::Unary(f, at(a)),
            Node::Binary(f, a, b) => Formula::Binary(f, at(a), at(b)),
            Node::Select { comparison, left, right, then, otherwise } => {
                Formula::Select(comparison, [left, right, then, otherwise].map(at))
            }
            Node::Smooth { function, order, argument } => Formula::Smooth(function, order, at(argument)),
        };
        Entry { formula: Rc::new(formula), weight }
    }

    /// The text of a formula whose definitions are these.
    pub(super) fn write(&self, target: &dyn Target, model: &Model, formula: &Formula) -> Text {
        let text = |f: &Formula| self.write(target, model, f);
        match formula {
            Formula::Number(n) => target.number(*n),
            Formula::Symbol(s) => target.symbol(model, *s),
            Formula::Defined(i) => target.variable(self.prefix, i + 1),
            Formula::Sum(terms) => {
                let terms: Vec<(bool, Text)> = terms.iter().map(|(minus, f)| (*minus, text(f))).collect();
                target.sum(&terms)
            }
            Formula::Product(coefficient, factors) => {
                let power = |f: &Factor| match f.exponent.unsigned_abs() {
                    1 => text(&f.formula),
                    e => target.power(&text(&f.formula), e),
                };
                let (first, last) = target.coefficient(*coefficient);
                let side =
                    |positive: bool| factors.iter().filter(move |f| (f.exponent > 0) == positive).map(power);
                let above: Vec<Text> = first.into_iter().chain(side(true)).collect();
                let below: Vec<Text> = last.into_iter().chain(side(false)).collect();
                // Factors are never products themselves, so that a single sum among them needs its
                // parentheses.
                if below.is_empty() && above.len() == 1 {
                    above[0].clone()
                } else {
                    target.product(&above, &below)
                }
            }
            Formula::Unary(f, a) => target.unary(*f, &text(a)),
            Formula::Binary(f, a, b) => target.binary(*f, &text(a), &text(b)),
            Formula::Select(comparison, [left, right, then, otherwise]) => {
                target.select(*comparison, [&text(left), &text(right)], &text(then), &text(otherwise))
            }
            Formula::Smooth(function, order, a) => {
                target.smooth(&model.functions[function.0 as usize].name, *order, &text(a))
            }
        }
    }
}

/// Σ ± terms, flattened, the first positive term in front.
pub(super) fn sum(terms: impl IntoIterator<Item = (bool, Rc<Formula>)>) -> Formula {
    let mut all: Vec<(bool, Rc<Formula>)> = Vec::new();
    for (minus, term) in terms {
        match &*term {
            Formula::Sum(inner) => all.extend(inner.iter().map(|(m, f)| (*m != minus, f.clone()))),
            Formula::Product(c, factors) if c.value() < 0.0 => {
                all.push((!minus, Rc::new(Formula::Product(c.opposite(), factors.clone()))));
            }
            Formula::Number(n) if n.value() < 0.0 => {
                all.push((!minus, Rc::new(Formula::Number(n.opposite()))))
            }
            _ => all.push((minus, term)),
        }
    }
    if let Some(first) = all.iter().position(|(minus, _)| !minus) {
        let term = all.remove(first);
        all.insert(0, term);
    }
    match &all[..] {
        [] => Formula::Number(Number::ZERO),
        [(false, only)] => (**only).clone(),
        _ => Formula::Sum(all),
    }
}

/// Π factorᵉ, flattened, powers of one factor together.
pub(super) fn product(parts: impl IntoIterator<Item = (Key, Rc<Formula>, i32)>) -> Formula {
    let mut coefficient = Number::ONE;
    let mut factors: Vec<Factor> = Vec::new();
    for (key, part, exponent) in parts {
        match &*part {
            Formula::Number(n) => scale(&mut coefficient, &mut factors, *n, exponent),
            Formula::Product(c, inner) => {
                scale(&mut coefficient, &mut factors, *c, exponent);
                for f in inner {
                    multiply(&mut factors, Factor { exponent: f.exponent * exponent, ..f.clone() });
                }
            }
            // −a as a factor is a sign of the whole.
            Formula::Sum(terms) if matches!(&terms[..], [(true, _)]) => {
                coefficient = coefficient.opposite();
                match &*terms[0].1 {
                    Formula::Product(c, inner) => {
                        scale(&mut coefficient, &mut factors, *c, exponent);
                        for f in inner {
                            multiply(&mut factors, Factor { exponent: f.exponent * exponent, ..f.clone() });
                        }
                    }
                    _ => multiply(&mut factors, Factor { key, formula: terms[0].1.clone(), exponent }),
                }
            }
            _ => multiply(&mut factors, Factor { key, formula: part, exponent }),
        }
    }
    factors.retain(|f| f.exponent != 0);
    factors.sort_by_key(|f| f.key);
    if factors.is_empty() {
        return Formula::Number(coefficient);
    }
    if coefficient.value() < 0.0 {
        let positive = Formula::Product(coefficient.opposite(), factors);
        return Formula::Sum(vec![(true, Rc::new(positive))]);
    }
    Formula::Product(coefficient, factors)
}

/// Multiplies a number into the coefficient, or, where that does not fit, among the factors.
fn scale(coefficient: &mut Number, factors: &mut Vec<Factor>, n: Number, exponent: i32) {
    let power = if exponent > 0 { Some(n) } else { n.recip() };
    match power.and_then(|p| coefficient.times(p)) {
        Some(product) => *coefficient = product,
        None => factors.push(Factor { key: Key::FIRST, formula: Rc::new(Formula::Number(n)), exponent }),
    }
}

fn multiply(factors: &mut Vec<Factor>, factor: Factor) {
    match factors.iter_mut().find(|f| f.key == factor.key) {
        Some(f) => f.exponent += factor.exponent,
        None => factors.push(factor),
    }
}
