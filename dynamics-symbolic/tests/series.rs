//! Taylor series against what they solve: the polynomial of the coefficients, put into M q̈ = Q, leaves a
//! remainder that vanishes with the power of time that its order says. M and Q are evaluated as they are, so
//! that no recurrence is checked against itself.

use crate::common;

use common::taylor::{eliminate, polynomial};
use common::{Values, arm, chain, double_pendulum, kepler, relative_chain, spherical_pendulum, zoo};
use dynamics_symbolic::graph::{
    Binary, Bindings, Comparison, FunctionId, Graph, NodeId, Number, Symbol, Unary,
};
use dynamics_symbolic::mechanics::{Model, derive};
use dynamics_symbolic::series::{Series, Unexpandable, expand_free};
use proptest::prelude::*;

/// Symbols of the programs of order k.
struct Order<'a> {
    k: usize,
    scale: f64,
    q: &'a [f64],
    u: &'a [f64],
    kept: &'a [f64],
    sums: &'a [f64],
}

impl Bindings for Order<'_> {
    fn symbol(&self, symbol: Symbol) -> f64 {
        match symbol {
            Symbol::Time => {
                if self.k == 1 {
                    self.scale
                } else {
                    0.0
                }
            }
            Symbol::Coordinate(i) => self.q[i as usize],
            Symbol::Rate(i) => self.u[i as usize],
            Symbol::Parameter(i) => self.kept[i as usize],
            Symbol::Multiplier(i) => self.sums[i as usize],
            Symbol::Input(0) => self.k as f64,
            Symbol::Input(1) => 1.0 / self.k as f64,
            other => panic!("{other:?} is no symbol of a series"),
        }
    }
    fn smooth(&self, _: FunctionId, _: u8, _: f64) -> f64 {
        unreachable!("smooth functions are not expanded")
    }
}

/// Coefficients 0 to `order` of q, time in units of `scale`, by interpreting the programs. `at` holds the
/// accelerations.
fn coefficients(series: &Series, base: &Graph, at: &Values, scale: f64, order: usize) -> Vec<Vec<f64>> {
    let (n, lanes) = (at.q.len(), series.lanes);
    let values = base.evaluate(&series.start.results, at);
    let kept: Vec<f64> = series.start.results.iter().map(|id| values[id.index()]).collect();
    let mut q = vec![at.q.clone(), at.u.iter().map(|u| scale * u).collect::<Vec<f64>>()];
    let mut u = vec![at.u.clone(), at.a.iter().map(|a| scale * a).collect::<Vec<f64>>()];
    let (mut left, mut right) = (vec![vec![0.0; lanes]], vec![vec![0.0; lanes]]);
    for k in 1..order {
        let cauchy = |i: usize| (1..k).map(|j| left[j][i] * right[k - j][i]).sum();
        let sums: Vec<f64> = (0..lanes).map(cauchy).collect();
        let order = Order { k, scale, q: &q[k], u: &u[k], kept: &kept, sums: &sums };
        let values = series.graph.evaluate(&series.next.results, &order);
        let found: Vec<f64> = series.next.results.iter().map(|id| values[id.index()]).collect();
        left.push(found[n..n + lanes].to_vec());
        right.push(found[n + lanes..].to_vec());
        q.push(u[k].iter().map(|u| scale * u / (k + 1) as f64).collect());
        u.push(found[..n].iter().map(|a| scale * a / (k + 1) as f64).collect());
    }
    q
}

/// Largest |M q̈ − Q| of the polynomial at time s·scale after the start, and the size of what it is a
/// difference of.
fn remainder(
    g: &Graph,
    mass: &[Vec<NodeId>],
    force: &[NodeId],
    at: &Values,
    c: &[Vec<f64>],
    scale: f64,
    s: f64,
) -> f64 {
    let jets: Vec<[f64; 3]> = (0..at.q.len()).map(|i| polynomial(c, i, s)).collect();
    let moved = Values {
        t: at.t + s * scale,
        q: jets.iter().map(|x| x[0]).collect(),
        u: jets.iter().map(|x| x[1] / scale).collect(),
        ..at.clone()
    };
    let roots: Vec<NodeId> = mass.iter().flatten().chain(force).copied().collect();
    let values = g.evaluate(&roots, &moved);
    let mut worst: f64 = 0.0;
    for (row, force) in mass.iter().zip(force) {
        let (mut sum, mut size) = (-values[force.index()], values[force.index()].abs());
        for (entry, jet) in row.iter().zip(&jets) {
            let term = values[entry.index()] * jet[2] / (scale * scale);
            sum += term;
            size += term.abs();
        }
        worst = worst.max(sum.abs() / (1.0 + size));
    }
    worst
}

/// q̈ at a state, from M and Q alone.
fn accelerations(g: &Graph, mass: &[Vec<NodeId>], force: &[NodeId], at: &Values) -> Vec<f64> {
    let roots: Vec<NodeId> = mass.iter().flatten().chain(force).copied().collect();
    let values = g.evaluate(&roots, at);
    let matrix = mass.iter().map(|row| row.iter().map(|entry| values[entry.index()]).collect()).collect();
    eliminate(matrix, force.iter().map(|f| values[f.index()]).collect())
}

/// Asserts that the series of order 14 has a remainder that falls with the 13th power of time, down to
/// rounding.
fn assert_solves(g: &mut Graph, mass: &[Vec<NodeId>], force: &[NodeId], mut at: Values, name: &str) {
    let series = expand_free(g, mass, force).unwrap_or_else(|e| panic!("{name}: {e:?}"));
    at.a = accelerations(g, mass, force, &at);
    const ORDER: usize = 14;
    for scale in [1.0, -0.25] {
        let c = coefficients(&series, g, &at, scale, ORDER);
        assert!(c.iter().flatten().all(|x| x.is_finite()), "{name}: {c:?}");
        // The radius of convergence, by the last coefficients.
        let size = |k: usize| c[k].iter().fold(0.0f64, |m, x| m.max(x.abs()));
        let radius =
            (ORDER - 4..=ORDER).map(|k| size(k).powf(-1.0 / k as f64)).fold(f64::INFINITY, f64::min).min(1e3);
        // The branch that a choice takes at the start is the series' own only for a while.
        let radius = if series.chooses { radius.min(0.4 / scale.abs()) } else { radius };
        let at_part = |part: f64| remainder(g, mass, force, &at, &c, scale, part * radius);
        let (near, far) = (at_part(0.02), at_part(0.25));
        assert!(near < 1e-12, "{name}, scale {scale}: remainder {near:e} close to the start, {c:?}");
        assert!(far < 1e-3, "{name}, scale {scale}: remainder {far:e}, radius {radius}");
        // 0.25/0.125: a factor of 2¹³ = 8192 in theory.
        let half = at_part(0.125);
        assert!(
            half < 1e-11 || far / half > 500.0,
            "{name}, scale {scale}: {half:e} → {far:e} is no order 13"
        );
    }
}

/// One coordinate, q̈ = f(q, q̇, t).
fn assert_function(name: &str, f: impl FnOnce(&mut Graph, NodeId, NodeId, NodeId) -> NodeId) {
    let mut g = Graph::new();
    let (q, u, t) = (g.symbol(Symbol::Coordinate(0)), g.symbol(Symbol::Rate(0)), g.symbol(Symbol::Time));
    let (f, one) = (f(&mut g, q, u, t), g.one());
    let at = Values { t: 0.3, q: vec![0.4], u: vec![0.7], ..Values::default() };
    assert_solves(&mut g, &[vec![one]], &[f], at, name);
}

#[test]
fn every_function_of_one_argument_has_its_series() {
    use Unary::{Abs, Acos, Asin, Atan, Cbrt, Cos, Cosh, Exp, Ln, Signum, Sin, Sinh, Sqrt, Tan, Tanh};
    let all = [Sin, Cos, Tan, Asin, Acos, Atan, Sinh, Cosh, Tanh, Exp, Ln, Sqrt, Cbrt, Abs, Signum];
    for f in all {
        assert_function(&format!("{f:?} q"), |g, q, _, _| g.unary(f, q));
        // An argument that changes in a way of its own: q u / 2 + t / 5 = 0.2.
        assert_function(&format!("{f:?} of a sum"), |g, q, u, t| {
            let (half, fifth) = (g.number(Number::ratio(1, 2)), g.number(Number::ratio(1, 5)));
            let (product, time) = (g.mul(q, u), g.mul(fifth, t));
            let product = g.mul(half, product);
            let argument = g.add(product, time);
            g.unary(f, argument)
        });
    }
}

#[test]
fn every_function_of_two_arguments_has_its_series() {
    use Binary::{Atan2, Hypot, Max, Min, Powf};
    for f in [Atan2, Powf, Hypot, Min, Max] {
        assert_function(&format!("{f:?}(q, u)"), |g, q, u, _| g.binary(f, q, u));
        assert_function(&format!("{f:?}(u, q t)"), |g, q, u, t| {
            let product = g.mul(q, t);
            g.binary(f, u, product)
        });
        assert_function(&format!("{f:?}(q, 5/2)"), |g, q, _, _| {
            let p = g.number(Number::ratio(5, 2));
            g.binary(f, q, p)
        });
    }
}

#[test]
fn arithmetic_and_choices_have_their_series() {
    assert_function("q u t", |g, q, u, t| {
        let product = g.mul(q, u);
        g.mul(product, t)
    });
    assert_function("q / (u + t)", |g, q, u, t| {
        let sum = g.add(u, t);
        g.div(q, sum).expect("not zero")
    });
    assert_function("1 / q", |g, q, _, _| {
        let one = g.one();
        g.div(one, q).expect("not zero")
    });
    assert_function("if u < q { q² } else { sin q − u }", |g, q, u, _| {
        let square = g.mul(q, q);
        let sin = g.unary(Unary::Sin, q);
        let other = g.sub(sin, u);
        g.select(Comparison::Less, u, q, square, other)
    });
}

#[test]
fn a_free_fall_ends_with_its_second_coefficient() {
    let mut g = Graph::new();
    let (one, force) = (g.one(), g.number(Number::ratio(-981, 100)));
    let series = expand_free(&mut g, &[vec![one]], &[force]).expect("expands");
    assert_eq!(series.lanes, 0);
    let at = Values { q: vec![1.0], u: vec![2.0], a: vec![-9.81], ..Values::default() };
    let c = coefficients(&series, &g, &at, 0.5, 6);
    assert_eq!(c, [[1.0], [1.0], [-9.81 / 8.0], [0.0], [0.0], [0.0], [0.0]]);
}

#[test]
fn smooth_functions_and_singular_masses_say_so() {
    let mut g = Graph::new();
    let (q, one) = (g.symbol(Symbol::Coordinate(0)), g.one());
    let f = g.smooth(FunctionId(3), 1, q);
    assert_eq!(expand_free(&mut g, &[vec![one]], &[f]).unwrap_err(), Unexpandable::Smooth(FunctionId(3)));
    let zero = g.zero();
    assert_eq!(expand_free(&mut g, &[vec![zero]], &[q]).unwrap_err(), Unexpandable::Singular(0));
}

/// Some state of a model.
fn state(model: &Model, seed: f64) -> Values {
    let n = model.coordinates.len();
    let wave = |i: usize, phase: f64| (1.7 * i as f64 + phase + seed).sin();
    Values {
        t: 0.1,
        q: (0..n).map(|i| 0.8 + 0.5 * wave(i, 0.3)).collect(),
        u: (0..n).map(|i| wave(i, 1.1)).collect(),
        a: vec![0.0; n],
        w: (0..model.inputs.len()).map(|i| wave(i, 2.0)).collect(),
        p: (0..model.parameters.len()).map(|i| 1.2 + 0.4 * wave(i, 0.0)).collect(),
        lambda: Vec::new(),
    }
}

#[test]
fn motions_of_mechanisms_solve_their_equations() {
    let models =
        [double_pendulum(), chain(1), chain(4), relative_chain(3), spherical_pendulum(), kepler(), arm(3)];
    for mut model in models {
        let e = derive(&mut model).expect("derives");
        for seed in [0.0, 0.9] {
            let at = state(&model, seed);
            let name = model.name.clone();
            assert_solves(&mut model.graph, &e.mass_matrix, &e.generalized_force, at, &name);
        }
    }
}

/// Random expressions, in postfix: pushes a symbol or number, or applies an operation to what is on the
/// stack. Arguments are put where functions are defined and smooth.
fn random(g: &mut Graph, codes: &[u8]) -> NodeId {
    let symbols =
        [Symbol::Coordinate(0), Symbol::Rate(0), Symbol::Coordinate(1), Symbol::Rate(1), Symbol::Time];
    let mut stack = vec![g.symbol(Symbol::Coordinate(0)), g.symbol(Symbol::Rate(1))];
    for code in codes {
        let top = stack.pop().expect("never empty");
        let under = stack.last().copied().unwrap_or(top);
        let one = g.one();
        let bounded = g.unary(Unary::Sin, top);
        // 2 + sin x: positive and away from zero.
        let two = g.integer(2);
        let positive = g.add(two, bounded);
        let third = g.number(Number::ratio(1, 3));
        let small = g.mul(third, bounded);
        let next = match code % 20 {
            0..5 => {
                stack.push(top);
                g.symbol(symbols[usize::from(code % 5)])
            }
            5 => g.add(under, top),
            6 => g.sub(under, bounded),
            7 => g.mul(under, bounded),
            8 => g.div(under, positive).expect("positive"),
            9 => g.unary(Unary::Sqrt, positive),
            10 => g.unary(Unary::Ln, positive),
            11 => g.unary(Unary::Exp, small),
            12 => g.unary(Unary::Atan, top),
            13 => g.unary(Unary::Asin, small),
            14 => g.unary(Unary::Tanh, top),
            15 => g.unary(Unary::Cosh, small),
            16 => g.binary(Binary::Powf, positive, small),
            17 => g.binary(Binary::Atan2, bounded, positive),
            18 => g.binary(Binary::Hypot, positive, under),
            _ => g.add(bounded, one),
        };
        stack.push(next);
    }
    let mut sum = stack.pop().expect("never empty");
    while let Some(x) = stack.pop() {
        let bounded = g.unary(Unary::Sin, x);
        sum = g.add(sum, bounded);
    }
    sum
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 96, ..ProptestConfig::default() })]
    #[test]
    fn random_equations_are_solved(
        forces in [proptest::collection::vec(0u8..20, 0..12), proptest::collection::vec(0u8..20, 0..12)],
        coupling in proptest::collection::vec(0u8..20, 0..6),
        start in proptest::array::uniform4(-1.0..1.0),
    ) {
        let mut g = Graph::new();
        let force = forces.map(|codes| random(&mut g, &codes));
        let coupling = random(&mut g, &coupling);
        let coupling = g.unary(Unary::Sin, coupling);
        // M may not depend on velocities of what is solved for; a symmetric, positive matrix of functions of
        // anything will do here.
        let (two, three) = (g.integer(2), g.integer(3));
        let mass = [vec![two, coupling], vec![coupling, three]];
        let [q0, q1, u0, u1] = start;
        let at = Values { t: 0.2, q: vec![q0, q1], u: vec![u0, u1], ..Values::default() };
        assert_solves(&mut g, &mass, &force, at, "random");
    }
}

#[test]
fn the_zoo_expands_but_for_what_is_known_by_values_only() {
    let mut model = zoo();
    let e = derive(&mut model).expect("derives");
    match expand_free(&mut model.graph, &e.mass_matrix, &e.generalized_force) {
        Ok(series) => assert!(series.lanes > 0),
        Err(reason) => assert!(matches!(reason, Unexpandable::Smooth(_)), "{reason:?}"),
    }
}
