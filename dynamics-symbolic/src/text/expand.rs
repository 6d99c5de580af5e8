//! Textbook form of small expressions: expanded, sines and cosines of two angles combined, parameters
//! collected.
//!
//! Only for reading. The programs keep what the user wrote; here (m₁l₁²cos²θ + m₁l₁²sin²θ + m₂l₁²) θ̈ becomes
//! (m₁ + m₂) l₁² θ̈.

use std::collections::{BTreeMap, BTreeSet};
use std::rc::Rc;

use crate::graph::{Fingerprint, Graph, Node, NodeId, Number, Symbol, Unary};

use super::formula::{Formula, Formulas, Key, product, sum};

/// Π atomᵉ by atom, no exponent zero.
type Monomial = BTreeMap<NodeId, i32>;
type NumberPolynomial = BTreeMap<Monomial, Number>;

/// Most terms of an expanded node before angles are combined. More are not textbook material.
pub(super) const MOST_TERMS: usize = 64;

/// Highest power of an expanded node. Nobody reads x^1000, and exponents of repeated squares would outgrow
/// their type.
const HIGHEST_POWER: i32 = 32;

/// A polynomial in atoms: symbols, functions, denominators.
#[derive(Clone, Debug)]
pub(super) struct Expanded(NumberPolynomial);

impl Expanded {
    /// Expands a node; `None` where an intermediate gets longer than `limit`, or where the result cannot be
    /// verified. May add nodes (sums of angles) to the graph.
    pub(super) fn new(g: &mut Graph, root: NodeId, limit: usize) -> Option<Self> {
        let mut known: BTreeMap<NodeId, NumberPolynomial> = BTreeMap::new();
        for id in arithmetic(g, root, limit)? {
            let p = polynomial(g, id, &known, limit)?;
            known.insert(id, p);
        }
        let mut expanded = Self(known.remove(&root)?);
        while combine_angles(g, &mut expanded.0) {}
        (expanded.fingerprint(g) == g.fingerprint(root)).then_some(expanded)
    }

    /// The atoms, for which formulas are needed.
    pub(super) fn atoms(&self) -> impl Iterator<Item = NodeId> + '_ {
        self.0.keys().flat_map(|m| m.keys().copied())
    }

    /// Number of terms.
    pub(super) fn len(&self) -> usize {
        self.0.len()
    }

    /// The fingerprint of the value. Not by building nodes: √x·√x would become x, which has another one.
    fn fingerprint(&self, g: &Graph) -> Fingerprint {
        self.0.iter().fold(Fingerprint::ZERO, |sum, (monomial, c)| {
            let term = monomial.iter().fold(Fingerprint::number(*c), |product, (atom, e)| {
                let factor = g.fingerprint(*atom);
                let times = |p: Fingerprint, _| if *e > 0 { p.mul(factor) } else { p.div(factor) };
                (0..e.unsigned_abs()).fold(product, times)
            });
            sum.add(term)
        })
    }

    /// As a formula: for each factor that moves the parameters collected, common ones in front.
    pub(super) fn formula(&self, g: &Graph, formulas: &Formulas) -> Rc<Formula> {
        let factor = |(atom, e): (&NodeId, &i32)| (Key::of(g, *atom), formulas.formula(*atom), *e);
        let mut groups: BTreeMap<Monomial, Vec<(Monomial, Number)>> = BTreeMap::new();
        for (monomial, c) in &self.0 {
            let (fixed, moving) =
                monomial.iter().map(|(a, e)| (*a, *e)).partition(|(a, _)| g.is_constant(*a));
            groups.entry(moving).or_default().push((fixed, *c));
        }
        let terms = groups.iter().map(|(moving, fixed)| {
            let (common, number, rest) = common_factor(fixed);
            let inner = rest.iter().map(|(m, c)| {
                let number = (Key::FIRST, Rc::new(Formula::Number(*c)), 1);
                (false, Rc::new(product([number].into_iter().chain(m.iter().map(factor)))))
            });
            let number = (Key::FIRST, Rc::new(Formula::Number(number)), 1);
            let inner = (Key::FIRST, Rc::new(sum(inner)), 1);
            let parts =
                [number, inner].into_iter().chain(common.iter().map(factor)).chain(moving.iter().map(factor));
            (false, Rc::new(product(parts)))
        });
        Rc::new(sum(terms.collect::<Vec<_>>()))
    }

    /// This over another: factors that all terms share are cancelled.
    pub(super) fn over(&self, other: &Self, g: &Graph, formulas: &Formulas) -> Rc<Formula> {
        let factor = |(atom, e): (&NodeId, &i32)| (Key::of(g, *atom), formulas.formula(*atom), *e);
        let parts = |of: &Self| {
            let terms: Vec<(Monomial, Number)> = of.0.iter().map(|(m, c)| (m.clone(), *c)).collect();
            let (common, number, rest) = common_factor(&terms);
            let rest = rest.iter().map(|(m, c)| {
                let number = (Key::FIRST, Rc::new(Formula::Number(*c)), 1);
                (false, Rc::new(product([number].into_iter().chain(m.iter().map(factor)))))
            });
            (common, Rc::new(Formula::Number(number)), Rc::new(sum(rest.collect::<Vec<_>>())))
        };
        let (above, below) = (parts(self), parts(other));
        // The sums are different factors: so are their keys.
        let behind = Key::last(Symbol::Time);
        let fixed = [
            (Key::FIRST, above.1, 1),
            (Key::FIRST, below.1, -1),
            (Key::FIRST, above.2, 1),
            (behind, below.2, -1),
        ];
        let below = below.0.iter().map(factor).map(|(key, formula, e)| (key, formula, -e));
        Rc::new(product(fixed.into_iter().chain(above.0.iter().map(factor)).chain(below)))
    }
}

/// What sums, products and quotients below a node reach, arguments first; `None` where that is too much.
fn arithmetic(g: &Graph, root: NodeId, limit: usize) -> Option<BTreeSet<NodeId>> {
    let (mut found, mut stack) = (BTreeSet::new(), vec![root]);
    while let Some(id) = stack.pop() {
        if !found.insert(id) {
            continue;
        }
        if found.len() > 8 * limit {
            return None;
        }
        let node = g.node(id);
        if matches!(node, Node::Add(..) | Node::Sub(..) | Node::Neg(_) | Node::Mul(..) | Node::Div(..)) {
            stack.extend(node.children());
        }
    }
    Some(found)
}

fn polynomial(
    g: &Graph,
    id: NodeId,
    known: &BTreeMap<NodeId, NumberPolynomial>,
    limit: usize,
) -> Option<NumberPolynomial> {
    let at = |x: NodeId| known.get(&x);
    let minus = Number::integer(-1);
    let single = |atom: NodeId, e: i32| NumberPolynomial::from([(Monomial::from([(atom, e)]), Number::ONE)]);
    let p = match g.node(id) {
        Node::Number(n) => NumberPolynomial::from([(Monomial::new(), n)]),
        Node::Add(a, b) => add(at(a)?, at(b)?, Number::ONE)?,
        Node::Sub(a, b) => add(at(a)?, at(b)?, minus)?,
        Node::Neg(a) => add(&NumberPolynomial::new(), at(a)?, minus)?,
        Node::Mul(a, b) => multiply(at(a)?, at(b)?, limit)?,
        Node::Div(a, b) => {
            let below = at(b)?;
            let reciprocal = match below.iter().next() {
                Some((m, c)) if below.len() == 1 => {
                    NumberPolynomial::from([(m.iter().map(|(a, e)| (*a, -e)).collect(), c.recip()?)])
                }
                _ => single(b, -1),
            };
            multiply(at(a)?, &reciprocal, limit)?
        }
        _ => single(id, 1),
    };
    (p.len() <= limit).then_some(p)
}

/// a + c·b; `None`, here and below, where a coefficient does not fit.
fn add(a: &NumberPolynomial, b: &NumberPolynomial, c: Number) -> Option<NumberPolynomial> {
    let mut sum = a.clone();
    for (m, x) in b {
        accumulate(&mut sum, m.clone(), x.times(c)?)?;
    }
    Some(sum)
}

fn multiply(a: &NumberPolynomial, b: &NumberPolynomial, limit: usize) -> Option<NumberPolynomial> {
    if a.len() * b.len() > 4 * limit {
        return None;
    }
    let mut out = NumberPolynomial::new();
    for (ma, ca) in a {
        for (mb, cb) in b {
            let mut m = ma.clone();
            mb.iter().for_each(|(atom, e)| shift(&mut m, *atom, *e));
            // Nobody reads x^1000, and exponents of repeated squares would outgrow their type.
            if m.values().any(|e| e.abs() > HIGHEST_POWER) {
                return None;
            }
            accumulate(&mut out, m, ca.times(*cb)?)?;
        }
    }
    Some(out)
}

fn accumulate(p: &mut NumberPolynomial, m: Monomial, c: Number) -> Option<()> {
    let sum = p.get(&m).map_or(Some(c), |old| old.plus(c))?;
    if sum.value() == 0.0 {
        p.remove(&m);
    } else {
        p.insert(m, sum);
    }
    Some(())
}

fn shift(m: &mut Monomial, atom: NodeId, e: i32) {
    let sum = m.get(&atom).copied().unwrap_or(0) + e;
    if sum == 0 {
        m.remove(&atom);
    } else {
        m.insert(atom, sum);
    }
}

fn same(a: Number, b: Number) -> bool {
    a.plus(b.opposite()).is_some_and(|d| d.value() == 0.0)
}

/// (common factor, common coefficient, what is left of each term).
fn common_factor(terms: &[(Monomial, Number)]) -> (Monomial, Number, Vec<(Monomial, Number)>) {
    let (first, number) = (&terms[0].0, terms[0].1);
    let mut common = Monomial::new();
    for (atom, e) in first {
        let exponents = || terms.iter().map(|(m, _)| m.get(atom).copied().unwrap_or(0));
        let shared = if *e > 0 {
            exponents().min().unwrap_or(0).max(0)
        } else {
            exponents().max().unwrap_or(0).min(0)
        };
        if shared != 0 {
            common.insert(*atom, shared);
        }
    }
    let equal = terms.iter().all(|(_, c)| same(*c, number));
    let negative = terms.iter().all(|(_, c)| c.value() < 0.0);
    let divisor = if equal { number } else { Number::integer(if negative { -1 } else { 1 }) };
    let rest = terms.iter().map(|(m, c)| {
        let mut m = m.clone();
        common.iter().for_each(|(atom, e)| shift(&mut m, *atom, -e));
        (m, divisor.recip().and_then(|r| c.times(r)).unwrap_or(*c))
    });
    (common.clone(), divisor, rest.collect())
}

/// One step of cos a cos b ± sin a sin b = cos(a ∓ b), sin a cos b ± cos a sin b = sin(a ± b), cos² + sin² =
/// 1; whether there was one.
fn combine_angles(g: &mut Graph, p: &mut NumberPolynomial) -> bool {
    for (m, c) in p.clone() {
        let trigonometric: Vec<(NodeId, Unary, NodeId)> = m
            .iter()
            .filter(|(_, e)| **e > 0)
            .filter_map(|(atom, _)| match g.node(*atom) {
                Node::Unary(f @ (Unary::Sin | Unary::Cos), angle) => Some((*atom, f, angle)),
                _ => None,
            })
            .collect();
        for (i, first) in trigonometric.iter().enumerate() {
            for second in &trigonometric[i..] {
                if first.0 == second.0 && m[&first.0] < 2 {
                    continue;
                }
                if let Some((partner, replacement, sign)) = partner(g, p, (&m, c), *first, *second) {
                    p.remove(&m);
                    p.remove(&partner);
                    let c = if sign { c.opposite() } else { c };
                    return accumulate(p, replacement, c).is_some();
                }
            }
        }
    }
    false
}

/// The term that combines with c·m = c·r·f(a)·h(b), what the two become, and whether the sign changes.
fn partner(
    g: &mut Graph,
    p: &NumberPolynomial,
    (m, c): (&Monomial, Number),
    (first, f, a): (NodeId, Unary, NodeId),
    (second, h, b): (NodeId, Unary, NodeId),
) -> Option<(Monomial, Monomial, bool)> {
    let other = |f: Unary| if f == Unary::Sin { Unary::Cos } else { Unary::Sin };
    let mut rest = m.clone();
    shift(&mut rest, first, -1);
    shift(&mut rest, second, -1);
    let with = |x: NodeId, y: NodeId| {
        let mut m = rest.clone();
        shift(&mut m, x, 1);
        shift(&mut m, y, 1);
        m
    };
    let (x, y) = (g.unary(other(f), a), g.unary(other(h), b));
    let partner = with(x, y);
    let coefficient = *p.get(&partner)?;
    let (equal, opposite) = (same(coefficient, c), same(coefficient, c.opposite()));
    if a == b {
        return (f == h && equal).then_some((partner, rest, false));
    }
    if !equal && !opposite {
        return None;
    }
    let cosine = f == h;
    // cos cos + sin sin is of the difference, sin cos + cos sin of the sum.
    let sum = cosine != equal;
    let angle = if sum { g.add(a, b) } else { g.sub(a, b) };
    let combined = g.unary(if cosine { Unary::Cos } else { Unary::Sin }, angle);
    let (combined, negated) = match g.node(combined) {
        Node::Neg(inner) => (inner, true),
        _ => (combined, false),
    };
    if !matches!(g.node(combined), Node::Unary(..)) {
        return None;
    }
    // c·(sin a cos b − cos a sin b) = c·sin(a − b); from cos a sin b it is −c·sin(a − b). sin a sin b − cos a
    // cos b = −cos(a + b).
    let flipped = match (cosine, sum) {
        (true, true) => f == Unary::Sin,
        (false, false) => f == Unary::Cos,
        _ => false,
    };
    let mut replacement = rest.clone();
    shift(&mut replacement, combined, 1);
    Some((partner, replacement, flipped != negated))
}

#[cfg(test)]
mod tests {
    use super::{Expanded, Graph, MOST_TERMS, Unary};
    use crate::graph::Symbol;

    #[test]
    fn angles_are_combined_to_the_textbook_form() {
        let mut g = Graph::new();
        let (a, b) = (g.symbol(Symbol::Coordinate(0)), g.symbol(Symbol::Coordinate(1)));
        let [sa, ca, sb, cb] =
            [(Unary::Sin, a), (Unary::Cos, a), (Unary::Sin, b), (Unary::Cos, b)].map(|(f, x)| g.unary(f, x));
        let [cc, ss, sc, cs] = [(ca, cb), (sa, sb), (sa, cb), (ca, sb)].map(|(x, y)| g.mul(x, y));
        let one = g.one();
        let outside = g.sub(ss, cc);
        for node in [g.add(cc, ss), g.sub(cc, ss), outside, g.add(sc, cs), g.sub(sc, cs), g.sub(cs, sc)] {
            let product = g.mul(node, a);
            let total = g.add(product, one);
            let expanded = Expanded::new(&mut g, total, MOST_TERMS).expect("short and verified");
            assert_eq!(expanded.len(), 2);
        }
    }

    #[test]
    fn repeated_squares_do_not_overflow() {
        let mut g = Graph::new();
        let mut x = g.symbol(Symbol::Coordinate(0));
        for _ in 0..40 {
            x = g.mul(x, x);
        }
        assert!(Expanded::new(&mut g, x, MOST_TERMS).is_none());
    }

    #[test]
    fn squares_add_up_to_one() {
        let mut g = Graph::new();
        let (a, m, n) =
            (g.symbol(Symbol::Coordinate(0)), g.symbol(Symbol::Parameter(0)), g.symbol(Symbol::Parameter(1)));
        let (s, c) = (g.unary(Unary::Sin, a), g.unary(Unary::Cos, a));
        let (ms, mc) = (g.mul(m, s), g.mul(m, c));
        let (mss, mcc) = (g.mul(ms, s), g.mul(mc, c));
        let x = g.mul(n, mcc);
        let sum = g.add(mss, x);
        assert_eq!(
            Expanded::new(&mut g, sum, MOST_TERMS).map(|e| e.len()),
            Some(2),
            "different factors stay"
        );
        let y = g.mul(n, mss);
        let sum = g.add(x, y);
        assert_eq!(Expanded::new(&mut g, sum, MOST_TERMS).map(|e| e.len()), Some(1));
    }
}
