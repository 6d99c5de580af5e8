//! The graph against plain arithmetic: whatever the constructors fold, merge, move or recognise, the value
//! stays, and the derivatives are those of dual numbers carried through the same operations.

use crate::common;

use common::Values;
use dynamics_symbolic::calculus::{directional, gradient, substitute};
use dynamics_symbolic::graph::{Binary, Comparison, FunctionId, Graph, NodeId, Number, Symbol, Unary};
use proptest::prelude::*;

/// A value, its derivative along a direction, and bounds of the rounding errors of both in units of eps.
#[derive(Clone, Copy, Debug)]
struct Dual {
    v: f64,
    d: f64,
    ev: f64,
    ed: f64,
}

impl Dual {
    fn constant(v: f64) -> Self {
        Self { v, d: 0.0, ev: v.abs(), ed: 0.0 }
    }
    /// f(x) with f, f′, f″ at x.
    fn chain(self, [f, df, ddf]: [f64; 3]) -> Self {
        let d = df * self.d;
        Self {
            v: f,
            d,
            ev: df.abs() * self.ev + f.abs(),
            ed: (ddf * self.d).abs() * self.ev + df.abs() * self.ed + d.abs(),
        }
    }
    fn plus(self, o: Self, sign: f64) -> Self {
        let (v, d) = (self.v + sign * o.v, self.d + sign * o.d);
        Self { v, d, ev: self.ev + o.ev + v.abs(), ed: self.ed + o.ed + d.abs() }
    }
    fn times(self, o: Self) -> Self {
        Self {
            v: self.v * o.v,
            d: self.d * o.v + self.v * o.d,
            ev: self.v.abs() * o.ev + o.v.abs() * self.ev + (self.v * o.v).abs(),
            ed: self.d.abs() * o.ev
                + o.v.abs() * self.ed
                + self.v.abs() * o.ed
                + o.d.abs() * self.ev
                + (self.d * o.v).abs()
                + (self.v * o.d).abs(),
        }
    }
    fn unary(self, f: Unary) -> Self {
        let x = self.v;
        self.chain(match f {
            Unary::Sin => [x.sin(), x.cos(), -x.sin()],
            Unary::Cos => [x.cos(), -x.sin(), -x.cos()],
            Unary::Tan => {
                let t = x.tan();
                [t, 1.0 + t * t, 2.0 * t * (1.0 + t * t)]
            }
            Unary::Asin => {
                let s = 1.0 - x * x;
                [x.asin(), s.powf(-0.5), x * s.powf(-1.5)]
            }
            Unary::Acos => {
                let s = 1.0 - x * x;
                [x.acos(), -s.powf(-0.5), -x * s.powf(-1.5)]
            }
            Unary::Atan => {
                let s = 1.0 + x * x;
                [x.atan(), 1.0 / s, -2.0 * x / (s * s)]
            }
            Unary::Sinh => [x.sinh(), x.cosh(), x.sinh()],
            Unary::Cosh => [x.cosh(), x.sinh(), x.cosh()],
            Unary::Tanh => {
                let (t, s) = (x.tanh(), x.cosh().powi(-2));
                [t, s, -2.0 * t * s]
            }
            Unary::Exp => [x.exp(), x.exp(), x.exp()],
            Unary::Ln => [x.ln(), 1.0 / x, -1.0 / (x * x)],
            Unary::Sqrt => [x.sqrt(), 0.5 / x.sqrt(), -0.25 / x.powf(1.5)],
            Unary::Cbrt => {
                let r = x.cbrt();
                [r, 1.0 / (3.0 * r * r), -2.0 / (9.0 * r.powi(5))]
            }
            Unary::Abs => [x.abs(), x.signum(), 0.0],
            Unary::Signum => [x.signum(), 0.0, 0.0],
        })
    }
}

const UNARY: [Unary; 15] = [
    Unary::Sin,
    Unary::Cos,
    Unary::Tan,
    Unary::Asin,
    Unary::Acos,
    Unary::Atan,
    Unary::Sinh,
    Unary::Cosh,
    Unary::Tanh,
    Unary::Exp,
    Unary::Ln,
    Unary::Sqrt,
    Unary::Cbrt,
    Unary::Abs,
    Unary::Signum,
];

/// One operation on earlier results, chosen by index modulo how many there are.
type Operation = (u8, u8, u8);

fn operations() -> impl Strategy<Value = Vec<Operation>> {
    // Sums, products, sines and cosines more often than the rest.
    let kind = prop_oneof![4 => 0u8..3, 2 => 5u8..7, 1 => 3u8..26, 2 => Just(26u8)];
    prop::collection::vec((kind, any::<u8>(), any::<u8>()), 1..40)
}

/// The symbols that expressions start from, with literals.
fn leaves(g: &mut Graph) -> Vec<NodeId> {
    let symbols = [
        Symbol::Coordinate(0),
        Symbol::Coordinate(1),
        Symbol::Rate(0),
        Symbol::Parameter(0),
        Symbol::Parameter(1),
        Symbol::Time,
    ];
    let mut nodes: Vec<NodeId> = symbols.map(|s| g.symbol(s)).to_vec();
    for text in ["1", "2", "0.5", "3", "0.1"] {
        let number = Number::parse(text).expect("a literal");
        nodes.push(g.number(number));
    }
    nodes
}

fn start(values: &Values, direction: &[f64; 4]) -> Vec<Dual> {
    let symbols = [values.q[0], values.q[1], values.u[0], values.p[0], values.p[1], values.t];
    let moves = [direction[0], direction[1], direction[2], 0.0, 0.0, direction[3]];
    let mut duals: Vec<Dual> =
        symbols.into_iter().zip(moves).map(|(v, d)| Dual { v, d, ev: v.abs(), ed: d.abs() }).collect();
    duals.extend([1.0, 2.0, 0.5, 3.0, 0.1].map(Dual::constant));
    duals
}

/// Builds on the graph and in dual numbers; an operation without a value at this point is left out of both.
fn build(
    g: &mut Graph,
    operations: &[Operation],
    values: &Values,
    direction: &[f64; 4],
) -> (Vec<NodeId>, Vec<Dual>) {
    let (mut nodes, mut duals) = (leaves(g), start(values, direction));
    for (kind, i, j) in operations {
        let (i, j) = (usize::from(*i) % nodes.len(), usize::from(*j) % nodes.len());
        let (a, b, x, y) = (nodes[i], nodes[j], duals[i], duals[j]);
        let (node, dual) = match kind {
            0 => (g.add(a, b), x.plus(y, 1.0)),
            1 => (g.sub(a, b), x.plus(y, -1.0)),
            2 => (g.mul(a, b), x.times(y)),
            3 => match g.div(a, b) {
                Some(node) if y.v.abs() > 1e-3 => {
                    (node, x.times(y.chain([1.0 / y.v, -y.v.powi(-2), 2.0 * y.v.powi(-3)])))
                }
                _ => continue,
            },
            4 => (g.neg(a), x.chain([-x.v, -1.0, 0.0])),
            5..=19 => {
                let f = UNARY[usize::from(kind - 5)];
                let mut dual = x.unary(f);
                // 1 − tanh² is good to eps of its largest value, not of itself.
                if f == Unary::Tanh {
                    dual.ed += x.d.abs();
                }
                (g.unary(f, a), dual)
            }
            20 => {
                let (n, power) = (i as i32 % 4, x.v.powi(i as i32 % 4));
                let n64 = f64::from(n);
                let slopes = [n64 * x.v.powi(n - 1), n64 * (n64 - 1.0) * x.v.powi(n - 2)];
                if x.v == 0.0 {
                    continue;
                }
                let Some(node) = g.powi(a, n) else { continue };
                (node, x.chain([power, slopes[0], slopes[1]]))
            }
            21 => {
                let h = x.v.hypot(y.v);
                let d = (x.v * x.d + y.v * y.d) / h;
                let e = x.ev + y.ev + h;
                let spread = (x.d.abs() + y.d.abs()) / h;
                (
                    g.binary(Binary::Hypot, a, b),
                    Dual { v: h, d, ev: e, ed: 4.0 * e * spread + x.ed + y.ed + d.abs() },
                )
            }
            22 => {
                let (v, s) = (x.v.atan2(y.v), x.v * x.v + y.v * y.v);
                let d = (y.v * x.d - x.v * y.d) / s;
                let e = (x.ev + y.ev) / s.sqrt() + v.abs();
                let spread = (x.d.abs() + y.d.abs()) / s.sqrt();
                let ed = 4.0 * e * spread + (x.ed + y.ed) / s.sqrt() + d.abs();
                (g.binary(Binary::Atan2, a, b), Dual { v, d, ev: e, ed })
            }
            23 => (g.binary(Binary::Min, a, b), if y.v < x.v { y } else { x }),
            24 => (g.binary(Binary::Max, a, b), if y.v > x.v { y } else { x }),
            26 => {
                let [first, second] = [(i + 3 * j) % nodes.len(), (3 * i + j) % nodes.len()];
                let node = g.select(Comparison::Less, a, b, nodes[first], nodes[second]);
                (node, if x.v < y.v { duals[first] } else { duals[second] })
            }
            _ => {
                let (s, c) = (x.v.sin(), x.v.cos());
                (g.smooth(FunctionId(0), 0, a), x.chain([s + x.v / 2.0, c + 0.5, -s]))
            }
        };
        // Far from where a comparison turns and from the cut of atan2, and within reach of f64.
        let near_tie = matches!(kind, 23 | 24 | 26) && (x.v - y.v).abs() < 1e-6 * (1.0 + x.ev + y.ev)
            || matches!(kind, 18 | 19 | 22) && x.v.abs() < 1e-6 * (1.0 + x.ev);
        let tame = |z: f64| z.is_finite() && z.abs() < 1e9;
        if near_tie || ![dual.v, dual.d, dual.ev, dual.ed].into_iter().all(tame) {
            continue;
        }
        nodes.push(node);
        duals.push(dual);
    }
    (nodes, duals)
}

fn point() -> impl Strategy<Value = (Values, [f64; 4])> {
    let x = || prop_oneof![-2.0..-0.1f64, 0.1..2.0f64];
    ([x(), x(), x(), x(), x(), x()], [x(), x(), x(), x()]).prop_map(|([q0, q1, u, p0, p1, t], direction)| {
        (Values { t, q: vec![q0, q1], u: vec![u], p: vec![p0, p1], ..Values::default() }, direction)
    })
}

/// Within a rounding-error bound; reordered sums and products cost a constant factor.
fn close(x: f64, y: f64, bound: f64) -> bool {
    (x - y).abs() <= 200.0 * f64::EPSILON * bound.max(f64::MIN_POSITIVE)
}

proptest! {
    #![proptest_config(ProptestConfig {
        cases: 1000,
        failure_persistence: None,
        ..ProptestConfig::default()
    })]

    #[test]
    fn values_and_derivatives_are_those_of_plain_arithmetic(
        ops in operations(),
        (values, direction) in point()
    ) {
        let mut g = Graph::new();
        let (nodes, duals) = build(&mut g, &ops, &values, &direction);
        let found = g.evaluate(&nodes, &values);
        for (node, dual) in nodes.iter().zip(&duals) {
            prop_assert!(
                close(found[node.index()], dual.v, dual.ev),
                "value {} {dual:?}",
                found[node.index()]
            );
        }
        let moving = [Symbol::Coordinate(0), Symbol::Coordinate(1), Symbol::Rate(0), Symbol::Time];
        let forward = directional(&mut g, &nodes, &mut |g, s| {
            let at = moving.iter().position(|m| *m == s)?;
            Some(g.number(Number::finite(direction[at]).expect("finite")))
        });
        let one = g.one();
        let last = *nodes.last().expect("leaves");
        let backward = gradient(&mut g, &[(last, one)], &moving);
        let all: Vec<NodeId> = forward.iter().chain(&backward).copied().collect();
        let found = g.evaluate(&all, &values);
        for (node, dual) in forward.iter().zip(&duals) {
            prop_assert!(close(found[node.index()], dual.d, dual.ed), "derivative {} \
                {dual:?}", found[node.index()]);
        }
        let along: f64 = backward.iter().zip(direction).map(|(b, d)| found[b.index()] * d).sum();
        let size: f64 = backward.iter().zip(direction).map(|(b, d)| (found[b.index()] * d).abs()).sum();
        let dual = duals.last().expect("leaves");
        prop_assert!(close(along, dual.d, dual.ed + size), "gradient {along} {dual:?}");
    }

    #[test]
    fn substituting_symbols_by_expressions_is_composition(
        ops in operations(),
        (values, direction) in point()
    ) {
        let mut g = Graph::new();
        let (nodes, _) = build(&mut g, &ops, &values, &direction);
        // q₀ → sin q₁ + 2.
        let replacement = {
            let q1 = g.symbol(Symbol::Coordinate(1));
            let (s, two) = (g.unary(Unary::Sin, q1), g.integer(2));
            g.add(s, two)
        };
        let last = *nodes.last().expect("leaves");
        let replaced = |s| (s == Symbol::Coordinate(0)).then_some(replacement);
        if let Ok(new) = substitute(&mut g, &[last], &mut |_, s| replaced(s)) {
            let moved = Values { q: vec![values.q[1].sin() + 2.0, values.q[1]], ..values.clone() };
            let (x, y) =
                (g.evaluate(&[last], &moved)[last.index()], g.evaluate(&new, &values)[new[0].index()]);
            let comparable = x.is_finite() && x.abs() < 1e6;
            let mut fresh = Graph::new();
            let (_, duals) = build(&mut fresh, &ops, &moved, &direction);
            let bound = duals.iter().map(|d| d.ev).fold(1.0, f64::max);
            prop_assert!(!comparable || (x - y).abs() <= 1e-9 * bound.max(x.abs()) * 10.0, "{x} {y}");
        }
    }
}

#[test]
fn identities_are_found_without_rules() {
    let mut g = Graph::new();
    let [x, y] = [0, 1].map(|i| g.symbol(Symbol::Coordinate(i)));
    let (s, c) = (g.unary(Unary::Sin, x), g.unary(Unary::Cos, x));
    let (ss, cc) = (g.mul(s, s), g.mul(c, c));
    let sum = g.add(ss, cc);
    assert!(g.is_one(sum));
    // cos(x + y) = cos x cos y − sin x sin y.
    let angle = g.add(x, y);
    let whole = g.unary(Unary::Cos, angle);
    let (sy, cy) = (g.unary(Unary::Sin, y), g.unary(Unary::Cos, y));
    let (p, q) = (g.mul(c, cy), g.mul(s, sy));
    assert_eq!(g.sub(p, q), whole);
    // (x + y)² − x² − 2xy = y².
    let square = g.mul(angle, angle);
    let (xx, yy, xy) = (g.mul(x, x), g.mul(y, y), g.mul(x, y));
    let rest = g.sub(square, xx);
    let double = g.add(xy, xy);
    assert_eq!(g.sub(rest, double), yy);
    // x / x = 1, and 0 is recognised however it is written.
    assert_eq!(g.div(x, x), Some(g.one()));
    let difference = g.sub(rest, double);
    let zero = g.sub(difference, yy);
    assert!(g.is_zero(zero));
}

#[test]
fn what_cancels_never_stands_for_what_does_not() {
    let mut g = Graph::new();
    let x = g.symbol(Symbol::Coordinate(0));
    let (one, c) = (g.one(), g.unary(Unary::Cos, x));
    let cc = g.mul(c, c);
    let cancelling = g.sub(one, cc);
    let twice = g.add(cancelling, cancelling);
    let s = g.unary(Unary::Sin, x);
    let ss = g.mul(s, s);
    let two = g.integer(2);
    let double = g.mul(two, ss);
    let negative = g.neg(double);
    let v = Values { q: vec![1e-9], ..Values::default() };
    let found = g.evaluate(&[cancelling, twice, ss, double, negative], &v);
    assert_eq!(found[cancelling.index()], 0.0);
    assert!((found[ss.index()] / 1e-18 - 1.0).abs() < 1e-15);
    assert!((found[double.index()] / 2e-18 - 1.0).abs() < 1e-15);
    assert!((found[negative.index()] / -2e-18 - 1.0).abs() < 1e-15);
    // And the other way round: once sin² is there, it also stands for 1 − cos².
    assert_eq!(g.sub(one, cc), ss);
}

/// A choice is known by what its branches are, and stands for itself: a root that is taken where it has a
/// value is never masked by a factor.
#[test]
fn choices_are_those_of_their_branches() {
    let mut g = Graph::new();
    let (x, y) = (g.symbol(Symbol::Coordinate(0)), g.symbol(Symbol::Coordinate(1)));
    let (zero, one) = (g.zero(), g.one());
    let select = |g: &mut Graph, then, otherwise| g.select(Comparison::Less, zero, x, then, otherwise);
    let (chosen, [back, down]) = (select(&mut g, y, one), [y, one].map(|branch| g.neg(branch)));
    let opposite = select(&mut g, back, down);
    assert_eq!(g.neg(chosen), opposite);
    let sum = g.add(chosen, opposite);
    assert!(g.is_zero(sum));
    let (mask, root) = (select(&mut g, one, zero), g.unary(Unary::Sqrt, x));
    let masked = g.mul(mask, root);
    let guarded = select(&mut g, root, zero);
    let negative = g.neg(root);
    let below = select(&mut g, negative, zero);
    let again = select(&mut g, negative, zero);
    let v = Values { q: vec![-4.0, 2.0], ..Values::default() };
    let found = g.evaluate(&[masked, guarded, below, chosen, opposite], &v);
    assert!(found[masked.index()].is_nan() && found[guarded.index()] == 0.0 && found[below.index()] == 0.0);
    assert_eq!([found[chosen.index()], found[opposite.index()]], [1.0, -1.0]);
    assert_eq!(below, again);
}

#[test]
fn deep_chains_do_not_overflow_the_stack() {
    let mut g = Graph::new();
    let mut angle = g.symbol(Symbol::Coordinate(0));
    let mut nested = angle;
    for i in 1..20_000 {
        let q = g.symbol(Symbol::Coordinate(i));
        angle = g.add(angle, q);
        let sum = g.add(nested, q);
        nested = g.unary(Unary::Sin, sum);
    }
    let sine = g.unary(Unary::Sin, angle);
    let slope = gradient(&mut g, &[(sine, angle), (nested, sine)], &[Symbol::Coordinate(0)]);
    let moved = directional(&mut g, &slope, &mut |g, _| Some(g.one()));
    let v = Values { q: vec![1e-4; 20_000], ..Values::default() };
    assert!(g.evaluate(&moved, &v)[moved[0].index()].is_finite());
}

#[test]
fn folding_makes_nothing_that_is_not_finite() {
    let mut g = Graph::new();
    let (zero, minus) = (g.zero(), g.integer(-1));
    let huge = g.number(Number::parse("1e300").expect("finite"));
    let roots =
        [g.unary(Unary::Ln, zero), g.unary(Unary::Sqrt, minus), g.mul(huge, huge), g.unary(Unary::Exp, huge)];
    for root in roots {
        assert!(g.as_number(root).is_none(), "left as it stands for the checks to see");
    }
    let three = g.integer(3);
    assert!(g.div(three, zero).is_none());
    let condition = g.select(Comparison::Less, minus, zero, three, huge);
    assert_eq!(condition, three);
}
