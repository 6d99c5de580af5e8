//! Rounding errors: M, Q and q̈ as the derived programs compute them in `f64`, against formulas derived by
//! hand and evaluated to 70 digits. The same nodes evaluated to 70 digits agree with the formulas to 60, so
//! that what is left is rounding.

use crate::common;

use common::{Values, chain, double_pendulum, spherical_pendulum};
use dashu_float::FBig;
use dashu_float::round::mode::HalfEven;
use dynamics_symbolic::compile::{Compiled, compile};
use dynamics_symbolic::graph::{Graph, Node, NodeId, Number, Symbol, Unary};
use proptest::prelude::*;

type Real = FBig<HalfEven, 2>;
const BITS: usize = 240;

fn exact(x: f64) -> Real {
    Real::try_from(x).expect("finite").with_precision(BITS).value()
}

fn whole(n: i128) -> Real {
    Real::from(n).with_precision(BITS).value()
}

/// Values of `roots` to 70 digits.
fn evaluate(g: &Graph, roots: &[NodeId], v: &Values) -> Vec<Real> {
    let mut found: Vec<Option<Real>> = vec![None; g.len()];
    for id in g.cone(roots) {
        let at = |x: NodeId| found[x.index()].clone().expect("children come first");
        let value = match g.node(id) {
            Node::Number(Number::Rational(n, d)) => whole(n) / whole(d),
            Node::Symbol(Symbol::Coordinate(i)) => exact(v.q[i as usize]),
            Node::Symbol(Symbol::Rate(i)) => exact(v.u[i as usize]),
            Node::Symbol(Symbol::Parameter(i)) => exact(v.p[i as usize]),
            Node::Add(a, b) => at(a) + at(b),
            Node::Sub(a, b) => at(a) - at(b),
            Node::Mul(a, b) => at(a) * at(b),
            Node::Div(a, b) => at(a) / at(b),
            Node::Neg(a) => -at(a),
            Node::Unary(Unary::Sin, a) => at(a).sin(),
            Node::Unary(Unary::Cos, a) => at(a).cos(),
            other => panic!("not in these models: {other:?}"),
        };
        found[id.index()] = Some(value);
    }
    roots.iter().map(|r| found[r.index()].clone().expect("evaluated")).collect()
}

/// M, Q by hand, and the size of the terms of Q, which its rounding error is measured by.
struct Truth {
    m: Vec<Vec<Real>>,
    m_size: Vec<Vec<f64>>,
    q: Vec<Real>,
    q_size: Vec<f64>,
}

fn f64_of(x: &Real) -> f64 {
    x.to_f64().value()
}

/// Adds a term to a sum and to its size.
fn push(sum: &mut Real, size: &mut f64, term: Real) {
    *size += f64_of(&term).abs();
    *sum = sum.clone() + term;
}

/// Links in absolute angles from a pivot (no cart) or from a cart: M_jk = μ lⱼ lₖ cos(θⱼ − θₖ) with μ the
/// mass beyond the farther joint.
fn links(cart: Option<f64>, m: &[f64], l: &[f64], gravity: f64, v: &Values) -> Truth {
    let n = m.len();
    let first = usize::from(cart.is_some());
    let size = n + first;
    let beyond: Vec<Real> = (0..n).map(|i| m[i..].iter().fold(whole(0), |s, m| s + exact(*m))).collect();
    let [theta, rate] =
        [&v.q[first..], &v.u[first..]].map(|x| x.iter().map(|x| exact(*x)).collect::<Vec<_>>());
    let l: Vec<Real> = l.iter().map(|l| exact(*l)).collect();
    let mut t = Truth {
        m: vec![vec![whole(0); size]; size],
        m_size: vec![vec![0.0; size]; size],
        q: vec![whole(0); size],
        q_size: vec![0.0; size],
    };
    for j in 0..n {
        for k in 0..n {
            let weight = beyond[j.max(k)].clone() * &l[j] * &l[k];
            let difference = theta[j].clone() - &theta[k];
            t.m_size[first + j][first + k] = f64_of(&weight);
            t.m[first + j][first + k] = weight.clone() * difference.cos();
            let term = -(weight * difference.sin() * &rate[k] * &rate[k]);
            // sin(θⱼ − θₖ) as it may be formed from products of sines and cosines.
            let (s, q) = (&mut t.q_size[first + j], &mut t.q[first + j]);
            *s += f64_of(&(beyond[j.max(k)].clone() * &l[j] * &l[k] * &rate[k] * &rate[k])).abs();
            *q = q.clone() + term;
        }
        let weight = beyond[j].clone() * &l[j];
        push(
            &mut t.q[first + j],
            &mut t.q_size[first + j],
            -(weight.clone() * exact(gravity) * theta[j].sin()),
        );
        if first == 1 {
            t.m_size[0][j + 1] = f64_of(&weight);
            t.m_size[j + 1][0] = f64_of(&weight);
            let entry = weight.clone() * theta[j].cos();
            t.m[0][j + 1] = entry.clone();
            t.m[j + 1][0] = entry;
            push(&mut t.q[0], &mut t.q_size[0], weight * theta[j].sin() * &rate[j] * &rate[j]);
        }
    }
    if let Some(cart) = cart {
        t.m[0][0] = exact(cart) + &beyond[0];
        t.m_size[0][0] = f64_of(&t.m[0][0]);
    }
    t
}

fn spherical(v: &Values) -> Truth {
    let [m, l, g] = [0, 1, 2].map(|i| exact(v.p[i]));
    let (s, c) = (exact(v.q[0]).sin(), exact(v.q[0]).cos());
    let [a, b] = [0, 1].map(|i| exact(v.u[i]));
    let inertia = m.clone() * &l * &l;
    let out = inertia.clone() * &s * &s;
    let mut t = Truth {
        m: vec![vec![inertia.clone(), whole(0)], vec![whole(0), out.clone()]],
        m_size: vec![vec![f64_of(&inertia), 0.0], vec![0.0, f64_of(&out)]],
        q: vec![whole(0); 2],
        q_size: vec![0.0; 2],
    };
    push(&mut t.q[0], &mut t.q_size[0], inertia.clone() * &s * &c * &b * &b);
    push(&mut t.q[0], &mut t.q_size[0], -(m * g * l * &s));
    push(&mut t.q[1], &mut t.q_size[1], -(whole(2) * inertia * s * c * a * b));
    t
}

/// x with M x = Q by elimination with pivots, and ‖M⁻¹‖∞.
fn solve(m: &[Vec<Real>], q: &[Real]) -> (Vec<Real>, f64) {
    let n = q.len();
    let mut rows: Vec<Vec<Real>> = (0..n)
        .map(|i| {
            let unit = (0..n).map(|j| whole(i128::from(i == j)));
            m[i].iter().cloned().chain([q[i].clone()]).chain(unit).collect()
        })
        .collect();
    for k in 0..n {
        let best = (k..n).max_by(|a, b| f64_of(&rows[*a][k]).abs().total_cmp(&f64_of(&rows[*b][k]).abs()));
        rows.swap(k, best.expect("a row is left"));
        let pivot = rows[k].clone();
        for (_, row) in rows.iter_mut().enumerate().filter(|(i, _)| *i != k) {
            let factor = row[k].clone() / &pivot[k];
            for (x, p) in row.iter_mut().zip(&pivot) {
                *x = x.clone() - &factor * p;
            }
        }
    }
    let scaled = |i: usize, j: usize| rows[i][j].clone() / &rows[i][i];
    let norm =
        (0..n).map(|i| (0..n).map(|j| f64_of(&scaled(i, n + 1 + j)).abs()).sum::<f64>()).fold(0.0, f64::max);
    ((0..n).map(|i| scaled(i, n)).collect(), norm)
}

fn check(c: &Compiled, truth: &Truth, v: &Values) -> Result<(), TestCaseError> {
    let (e, g, n) = (&c.equations, &c.model.graph, truth.q.len());
    let roots = [e.mass_matrix.concat(), e.generalized_force.clone(), e.accelerations.clone()].concat();
    let (long, short) = (evaluate(g, &roots, v), g.evaluate(&roots, v));
    let (a, inverse) = solve(&truth.m, &truth.q);
    let norm = |rows: &[Vec<f64>]| rows.iter().map(|r| r.iter().sum::<f64>()).fold(0.0, f64::max);
    let (force, size) = (truth.q_size.iter().fold(0.0, |s: f64, x| s.max(*x)), norm(&truth.m_size));
    let longest = a.iter().map(|a| f64_of(a).abs()).fold(0.0, f64::max);
    // ‖δq̈‖ ≤ ‖M⁻¹‖ (‖δM‖ ‖q̈‖ + ‖δQ‖).
    let a_size = inverse * (size * longest + force);
    let expected = truth.m.concat().into_iter().chain(truth.q.clone()).chain(a);
    let sizes = truth.m_size.concat().into_iter().chain(truth.q_size.iter().copied()).chain(vec![a_size; n]);
    for (((root, long), expected), size) in roots.iter().zip(long).zip(expected).zip(sizes) {
        let identity = f64_of(&(long - &expected)).abs();
        prop_assert!(identity <= 1e-60 * size.max(1e-300), "not the same function: {identity}");
        let error = f64_of(&(exact(short[root.index()]) - &expected)).abs();
        prop_assert!(error <= 20.0 * f64::EPSILON * size, "error {error} at size {size}");
    }
    Ok(())
}

fn numbers(n: usize, low: f64, high: f64) -> impl Strategy<Value = Vec<f64>> {
    prop::collection::vec(low..high, n)
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 12, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn double_pendulum_within_20_eps(
        q in numbers(2, -10.0, 10.0),
        u in numbers(2, -5.0, 5.0),
        p in numbers(4, 0.1, 3.0)
    ) {
        let c = compile(double_pendulum()).expect("a good model");
        let v = Values { q, u, p: [&p[..], &[9.81]].concat(), ..Values::default() };
        check(&c, &links(None, &p[..2], &p[2..], 9.81, &v), &v)?;
    }

    #[test]
    fn spherical_pendulum_within_20_eps(
        q in numbers(2, -10.0, 10.0),
        u in numbers(2, -5.0, 5.0),
        p in numbers(2, 0.1, 3.0)
    ) {
        let c = compile(spherical_pendulum()).expect("a good model");
        let v = Values { q, u, p: vec![p[0], p[1], 9.81], ..Values::default() };
        check(&c, &spherical(&v), &v)?;
    }

    #[test]
    fn cart_pole_within_20_eps(
        q in numbers(2, -10.0, 10.0),
        u in numbers(2, -5.0, 5.0),
        p in numbers(3, 0.5, 2.0)
    ) {
        let c = compile(chain(1)).expect("a good model");
        let v = Values { q, u, p: [&p[..], &[9.81]].concat(), ..Values::default() };
        check(&c, &links(Some(p[0]), &p[1..2], &p[2..3], 9.81, &v), &v)?;
    }

    #[test]
    fn chain_of_ten_within_20_eps(
        q in numbers(11, -10.0, 10.0),
        u in numbers(11, -5.0, 5.0),
        p in numbers(21, 0.5, 2.0)
    ) {
        let c = compile(chain(10)).expect("a good model");
        let v = Values { q, u, p: [&p[..], &[9.81]].concat(), ..Values::default() };
        check(&c, &links(Some(p[0]), &p[1..11], &p[11..21], 9.81, &v), &v)?;
    }

    // Solved through levers, without M.
    #[test]
    fn chain_of_sixteen_within_20_eps(
        q in numbers(17, -10.0, 10.0),
        u in numbers(17, -5.0, 5.0),
        p in numbers(33, 0.5, 2.0)
    ) {
        let c = compile(chain(16)).expect("a good model");
        let v = Values { q, u, p: [&p[..], &[9.81]].concat(), ..Values::default() };
        check(&c, &links(Some(p[0]), &p[1..17], &p[17..33], 9.81, &v), &v)?;
    }

    // Solved for the tensions of rods, masses over four decades.
    #[test]
    fn uneven_chain_of_six_within_20_eps(
        q in numbers(7, -10.0, 10.0),
        u in numbers(7, -5.0, 5.0),
        l in numbers(6, 0.5, 2.0),
        m in numbers(7, -2.0, 2.0)
    ) {
        let c = compile(chain(6)).expect("a good model");
        let m: Vec<f64> = m.into_iter().map(|m| 10f64.powf(m)).collect();
        let v = Values { q, u, p: [&m[..], &l, &[9.81]].concat(), ..Values::default() };
        check(&c, &links(Some(m[0]), &m[1..], &l, 9.81, &v), &v)?;
    }
}
