//! Shorter forms of a set of results. Inertia that is the sum of squares of velocities,
//! m a²cos²φ + m a²sin²φ + …, does not show that it is a constant or one cosine of a difference, as
//! like terms are apart. Here each result is written as a polynomial in symbols, sines, cosines and roots.
//! Like terms and squares of sines and cosines are added up, and common factors are taken out. Of every
//! result the form is taken that makes all of them together the cheapest. Chains of links, where sharing
//! saves more, stay as they are.

use std::collections::BTreeMap;

use crate::graph::{Dependence, Graph, Node, NodeId, Unary};

use super::substitute::rebuild;

/// Most terms of a polynomial that is expanded. A longer one is rarely a short form, and expanding takes
/// time.
const MOST_TERMS: usize = 96;
/// Most factors of one term. Each is written down, and repeated squaring doubles their number every time.
const MOST_FACTORS: usize = 64;
/// Most operations of the results together, and most results, up to which shorter forms are tried one by one.
/// Beyond, trying takes too long.
const LARGEST_COLLECTED: (usize, usize) = (2500, 160);

/// Factors in ascending order, repeated for powers; by them the coefficient, which depends on parameters
/// alone.
type NodePolynomial = BTreeMap<Vec<NodeId>, NodeId>;

/// What became of some results.
#[derive(Clone, Debug)]
pub struct Collected {
    /// The results in the order in which they were given.
    pub nodes: Vec<NodeId>,
    /// Of those that are squares and were rewritten: the new form, and the constant in it, which is about the
    /// size of what was squared. Where the whole is far smaller than its constant, digits are lost that a sum
    /// of squares keeps.
    pub squares: Vec<(NodeId, NodeId)>,
}

/// `roots`, rewritten where that makes them cheaper together. Operations that stay are built anew as well, so
/// that all share their parts. `squares` are those of them that cannot be negative.
#[must_use]
pub fn collect_terms(g: &mut Graph, roots: &[NodeId], squares: &[NodeId]) -> Collected {
    let mut distinct = roots.to_vec();
    distinct.sort_unstable();
    distinct.dedup();
    distinct.retain(|r| !g.is_constant(*r));
    let unchanged = Collected { nodes: roots.to_vec(), squares: Vec::new() };
    if g.operations(&distinct) > LARGEST_COLLECTED.0 || distinct.len() > LARGEST_COLLECTED.1 {
        return unchanged;
    }
    let mut forms: Vec<Vec<NodePolynomial>> = distinct.iter().map(|r| polynomials(g, *r)).collect();
    for (root, forms) in distinct.iter().zip(&mut forms) {
        forms.retain(|form| !squares.contains(root) || form.contains_key(&Vec::new()));
    }
    let choice = choose(g, &distinct, &forms);
    if choice.iter().all(Option::is_none) {
        return unchanged;
    }
    let kept = atoms(g, &distinct);
    let source = g.clone();
    let built = g.afresh(&kept, |g| {
        build(g, &source, &distinct, &choice, &|id| kept.binary_search(&id).is_ok().then_some(id))
    });
    let constants = choice.iter().map(|form| form.and_then(|form| form.get(&Vec::new()).copied()));
    let rewritten =
        distinct.iter().zip(&built).zip(constants).filter(|((root, _), _)| squares.contains(root));
    let squares = rewritten.filter_map(|((_, new), constant)| constant.map(|c| (*new, c))).collect();
    let new: BTreeMap<NodeId, NodeId> = distinct.into_iter().zip(built).collect();
    Collected { nodes: roots.iter().map(|r| new.get(r).copied().unwrap_or(*r)).collect(), squares }
}

/// For every root the polynomial that it is to be written as, if any: by trying, on graphs of their own.
fn choose<'a>(
    g: &Graph,
    roots: &[NodeId],
    forms: &'a [Vec<NodePolynomial>],
) -> Vec<Option<&'a NodePolynomial>> {
    let cost = |choice: &[Option<&NodePolynomial>]| {
        let mut trial = Graph::new();
        let built = build(&mut trial, g, roots, choice, &|_| None);
        trial.weight(&built)
    };
    let alone = |root: usize, form: Option<&NodePolynomial>| {
        let mut trial = Graph::new();
        let built = build(&mut trial, g, &roots[root..=root], &[form], &|_| None);
        trial.weight(&built)
    };
    // All that are shorter by themselves at once, as what they share falls away only together; then one by
    // one.
    let mut choice: Vec<Option<&NodePolynomial>> = vec![None; roots.len()];
    let mut best = cost(&choice);
    let mut together = choice.clone();
    let mut promising = Vec::new();
    for (root, forms) in forms.iter().enumerate() {
        let as_it_is = alone(root, None);
        let shorter = forms.iter().map(|form| (alone(root, Some(form)), form)).min_by_key(|(cost, _)| *cost);
        let Some((cost, form)) = shorter.filter(|(cost, _)| *cost <= as_it_is + as_it_is / 4) else {
            continue;
        };
        promising.push(root);
        together[root] = (cost < as_it_is).then_some(form);
    }
    let all = cost(&together);
    if all < best {
        (best, choice) = (all, together);
    }
    for &root in &promising {
        for form in forms[root].iter().map(Some).chain([None]) {
            let mut next = choice.clone();
            next[root] = form;
            let cost = cost(&next);
            if cost < best {
                (best, choice) = (cost, next);
            }
        }
    }
    choice
}

/// The roots in `g`, each from its polynomial or else as it is; `known` says what is there already of the
/// nodes of `source`.
fn build(
    g: &mut Graph,
    source: &Graph,
    roots: &[NodeId],
    choice: &[Option<&NodePolynomial>],
    known: &dyn Fn(NodeId) -> Option<NodeId>,
) -> Vec<NodeId> {
    // What is needed of the source: roots that stay, factors and coefficients of the others.
    let mut needed = Vec::new();
    for (root, form) in roots.iter().zip(choice) {
        match form {
            None => needed.push(*root),
            Some(form) => form.iter().for_each(|(factors, c)| needed.extend(factors.iter().chain([c]))),
        }
    }
    let ids = source.cone(&needed);
    let mut new: Vec<Option<NodeId>> = vec![None; ids.last().map_or(0, |id| id.index() + 1)];
    for id in ids {
        let at = |c: NodeId| new[c.index()].unwrap_or(c);
        // The denominators of the source are not zero, and its values are kept.
        new[id.index()] = known(id).or_else(|| rebuild(g, source.node(id), &at).ok());
    }
    let zero = g.zero();
    let at = |id: &NodeId| new[id.index()].unwrap_or(zero);
    let mut terms: Vec<Option<Vec<SumTerm>>> = Vec::with_capacity(choice.len());
    for form in choice {
        let products = form.map(|form| form.iter());
        terms.push(
            products.map(|p| p.map(|(f, c)| SumTerm::new(g, at(c), f.iter().map(at).collect())).collect()),
        );
    }
    let copies: Vec<NodeId> =
        roots.iter().map(|r| new.get(r.index()).copied().flatten().unwrap_or(*r)).collect();
    terms.into_iter().zip(copies).map(|(terms, copy)| terms.map_or(copy, |terms| sum(g, terms))).collect()
}

/// A product of a number and factors, parameters among them.
#[derive(Clone, Debug)]
struct SumTerm {
    number: NodeId,
    factors: Vec<NodeId>,
}

impl SumTerm {
    fn new(g: &mut Graph, coefficient: NodeId, mut factors: Vec<NodeId>) -> Self {
        let (sign, size) = match g.node(coefficient) {
            Node::Neg(x) => (g.integer(-1), x),
            _ => (g.one(), coefficient),
        };
        let (number, rest) = match g.node(size) {
            Node::Number(_) => (size, None),
            Node::Mul(number, rest) if g.as_number(number).is_some() => (number, Some(rest)),
            _ => (g.one(), Some(size)),
        };
        factors.extend(rest);
        Self { number: g.mul(sign, number), factors }
    }

    fn without(&self, factor: NodeId) -> Option<Self> {
        let at = self.factors.iter().position(|f| *f == factor)?;
        let mut rest = self.clone();
        rest.factors.remove(at);
        Some(rest)
    }

    fn product(&self, g: &mut Graph) -> NodeId {
        let one = g.one();
        let product = self.factors.iter().fold(one, |p, f| g.mul(p, *f));
        g.mul(self.number, product)
    }
}

/// Σ terms: products of two sums where there are such, else the factor that most terms share taken out first.
fn sum(g: &mut Graph, terms: Vec<SumTerm>) -> NodeId {
    let groups = bilinear(g, &terms);
    if groups.len() < terms.len() && groups.iter().any(|(left, right)| left.len() > 1 && right.len() > 1) {
        let zero = g.zero();
        return groups.into_iter().fold(zero, |total, (left, right)| {
            let (left, right) = (factored(g, left), factored(g, right));
            let product = g.mul(left, right);
            g.add(total, product)
        });
    }
    factored(g, terms)
}

/// Σ terms, the factor that most of them share taken out first.
fn factored(g: &mut Graph, terms: Vec<SumTerm>) -> NodeId {
    let Some(factor) = shared(g, &terms) else {
        let zero = g.zero();
        return terms.iter().fold(zero, |sum, term| {
            let product = term.product(g);
            g.add(sum, product)
        });
    };
    let (mut inside, mut outside) = (Vec::new(), Vec::new());
    for term in terms {
        match term.without(factor) {
            Some(rest) => inside.push(rest),
            None => outside.push(term),
        }
    }
    let inner = factored(g, inside);
    let product = g.mul(factor, inner);
    let rest = factored(g, outside);
    g.add(rest, product)
}

/// Two sums whose product is a part of a sum.
type ProductOfSums = (Vec<SumTerm>, Vec<SumTerm>);

/// The terms as products of a sum of symbols and parameters with a sum of functions: w² s − w² c − u² s + u²
/// c = (w² − u²)(s − c). Products of single terms are left over where nothing of that kind is found.
fn bilinear(g: &mut Graph, terms: &[SumTerm]) -> Vec<ProductOfSums> {
    // By the symbols of each term: the functions that they stand before, with numbers.
    let mut rows: BTreeMap<Vec<NodeId>, BTreeMap<Vec<NodeId>, NodeId>> = BTreeMap::new();
    for term in terms {
        let is_function = |id: &NodeId| !g.is_constant(*id) && !matches!(g.node(*id), Node::Symbol(_));
        let (mut functions, mut symbols): (Vec<NodeId>, Vec<NodeId>) =
            term.factors.iter().partition(|id| is_function(id));
        functions.sort_unstable();
        symbols.sort_unstable();
        rows.entry(symbols).or_default().insert(functions, term.number);
    }
    let mut found: Vec<(Vec<SumTerm>, NodePolynomial)> = Vec::new();
    for (factors, row) in rows {
        let mut place = None;
        for (at, (_, other)) in found.iter().enumerate() {
            if let Some(ratio) = ratio(g, &row, other) {
                place = Some((at, ratio));
                break;
            }
        }
        match place {
            Some((at, number)) => found[at].0.push(SumTerm { number, factors }),
            None => found.push((vec![SumTerm { number: g.one(), factors }], row)),
        }
    }
    let right = |row: BTreeMap<Vec<NodeId>, NodeId>| {
        row.into_iter().map(|(factors, number)| SumTerm { number, factors }).collect::<Vec<_>>()
    };
    found.into_iter().map(|(left, row)| (left, right(row))).collect()
}

/// The number k with a = k·b.
fn ratio(
    g: &mut Graph,
    a: &BTreeMap<Vec<NodeId>, NodeId>,
    b: &BTreeMap<Vec<NodeId>, NodeId>,
) -> Option<NodeId> {
    let (first, number) = a.iter().next()?;
    if !a.keys().eq(b.keys()) {
        return None;
    }
    let k = g.div(*number, b[first])?;
    a.iter().all(|(key, x)| g.mul(k, b[key]) == *x).then_some(k)
}

/// The factor of most terms, of two at least; functions before symbols, these before parameters, as a sum of
/// their products is more often met again.
fn shared(g: &Graph, terms: &[SumTerm]) -> Option<NodeId> {
    let mut count: BTreeMap<NodeId, usize> = BTreeMap::new();
    for term in terms {
        let mut factors = term.factors.clone();
        factors.sort_unstable();
        factors.dedup();
        factors.into_iter().for_each(|f| *count.entry(f).or_default() += 1);
    }
    let rank = |id: NodeId| match g.node(id) {
        _ if g.is_constant(id) => 0,
        Node::Symbol(_) => 1,
        _ => 2,
    };
    let best =
        count.into_iter().filter(|(_, n)| *n > 1).max_by_key(|(f, n)| (*n, rank(*f), core::cmp::Reverse(*f)));
    best.map(|(factor, _)| factor)
}

/// Ways to write a node as a polynomial: with everything multiplied out, and with sums of rates left
/// together.
fn polynomials(g: &mut Graph, root: NodeId) -> Vec<NodePolynomial> {
    let mut found: Vec<NodePolynomial> = Vec::new();
    for sums in [false, true] {
        let mut memo = BTreeMap::new();
        let Some(polynomial) = expand(g, root, sums, &mut memo) else { continue };
        let polynomial = without_squares(g, polynomial);
        if !found.contains(&polynomial) {
            found.push(polynomial);
        }
    }
    found
}

fn expand(
    g: &mut Graph,
    id: NodeId,
    sums: bool,
    memo: &mut BTreeMap<NodeId, Option<NodePolynomial>>,
) -> Option<NodePolynomial> {
    if let Some(known) = memo.get(&id) {
        return known.clone();
    }
    let one = g.one();
    let atom = NodePolynomial::from([(vec![id], one)]);
    let found = match g.node(id) {
        _ if g.is_zero(id) => Some(NodePolynomial::new()),
        _ if g.is_constant(id) => Some(NodePolynomial::from([(Vec::new(), id)])),
        Node::Add(..) | Node::Sub(..) if sums && g.dependence(id).within(Dependence::RATES) => Some(atom),
        Node::Add(a, b) => {
            expand(g, a, sums, memo).zip(expand(g, b, sums, memo)).map(|(a, b)| plus(g, a, b, false))
        }
        Node::Sub(a, b) => {
            expand(g, a, sums, memo).zip(expand(g, b, sums, memo)).map(|(a, b)| plus(g, a, b, true))
        }
        Node::Neg(a) => expand(g, a, sums, memo).map(|a| plus(g, NodePolynomial::new(), a, true)),
        Node::Mul(a, b) => {
            expand(g, a, sums, memo).zip(expand(g, b, sums, memo)).and_then(|(a, b)| times(g, &a, &b))
        }
        _ => Some(atom),
    };
    let found = found.filter(|p| p.len() <= MOST_TERMS);
    memo.insert(id, found.clone());
    found
}

fn put(g: &mut Graph, to: &mut NodePolynomial, factors: Vec<NodeId>, coefficient: NodeId) {
    let sum = match to.get(&factors) {
        Some(old) => g.add(*old, coefficient),
        None => coefficient,
    };
    if g.is_zero(sum) {
        to.remove(&factors);
    } else {
        to.insert(factors, sum);
    }
}

fn plus(g: &mut Graph, mut a: NodePolynomial, b: NodePolynomial, subtract: bool) -> NodePolynomial {
    for (factors, c) in b {
        let c = if subtract { g.neg(c) } else { c };
        put(g, &mut a, factors, c);
    }
    a
}

fn times(g: &mut Graph, a: &NodePolynomial, b: &NodePolynomial) -> Option<NodePolynomial> {
    if a.len() * b.len() > 4 * MOST_TERMS {
        return None;
    }
    let degree = |p: &NodePolynomial| p.keys().map(Vec::len).max().unwrap_or(0);
    if degree(a) + degree(b) > MOST_FACTORS {
        return None;
    }
    let mut product = NodePolynomial::new();
    for (x, c) in a {
        for (y, d) in b {
            let mut factors = [x.as_slice(), y].concat();
            factors.sort_unstable();
            let coefficient = g.mul(*c, *d);
            put(g, &mut product, factors, coefficient);
        }
    }
    Some(product)
}

/// a sin²x r + a cos²x r = a r, wherever both coefficients are the same.
fn without_squares(g: &mut Graph, mut polynomial: NodePolynomial) -> NodePolynomial {
    while let Some((sine, cosine, rest)) = square(g, &polynomial) {
        let coefficient = polynomial[&sine];
        polynomial.remove(&sine);
        polynomial.remove(&cosine);
        put(g, &mut polynomial, rest, coefficient);
    }
    polynomial
}

/// The first pair of terms a sin²x r and a cos²x r, with r.
fn square(g: &Graph, polynomial: &NodePolynomial) -> Option<(Vec<NodeId>, Vec<NodeId>, Vec<NodeId>)> {
    for (factors, coefficient) in polynomial {
        for pair in factors.windows(2) {
            let (Node::Unary(Unary::Sin, angle), true) = (g.node(pair[0]), pair[0] == pair[1]) else {
                continue;
            };
            let mut rest = factors.clone();
            let at = rest.iter().position(|f| *f == pair[0])?;
            rest.drain(at..at + 2);
            for (other, c) in polynomial.iter().filter(|(other, _)| other.len() == factors.len()) {
                let cosines: Vec<NodeId> = other
                    .iter()
                    .copied()
                    .filter(|f| matches!(g.node(*f), Node::Unary(Unary::Cos, x) if x == angle))
                    .take(2)
                    .collect();
                let [cosine, _] = cosines[..] else { continue };
                let mut left = other.clone();
                let at = left.iter().position(|f| *f == cosine)?;
                left.drain(at..at + 2);
                if left == rest && g.fingerprint(*c) == g.fingerprint(*coefficient) {
                    return Some((factors.clone(), other.clone(), rest));
                }
            }
        }
    }
    None
}

/// What the roots are made of besides sums and products, with what that is made of, ascending.
fn atoms(g: &Graph, roots: &[NodeId]) -> Vec<NodeId> {
    let is_atom =
        |id: &NodeId| !matches!(g.node(*id), Node::Add(..) | Node::Sub(..) | Node::Mul(..) | Node::Neg(_));
    let found: Vec<NodeId> = g.cone(roots).into_iter().filter(is_atom).collect();
    g.cone(&found)
}
