//! Derived equations against equations worked out by hand.

mod common;

use common::{Values, double_pendulum};
use dynamics_symbolic::compile::compile;

#[test]
fn double_pendulum_equals_the_hand_derived_equations() {
    let compiled = compile(double_pendulum()).expect("a good model");
    let (g, e) = (&compiled.model.graph, &compiled.equations);
    let v = Values { q: vec![0.7, -1.1], u: vec![0.4, 2.3], p: vec![1.5, 0.8, 1.2, 0.6, 9.81], ..Values::default() };
    let [m1, m2, l1, l2, gravity] = [1.5, 0.8, 1.2, 0.6, 9.81];
    let (d, [u1, u2]) = (v.q[0] - v.q[1], [v.u[0], v.u[1]]);
    let m = [[(m1 + m2) * l1 * l1, m2 * l1 * l2 * d.cos()], [m2 * l1 * l2 * d.cos(), m2 * l2 * l2]];
    let q = [
        -m2 * l1 * l2 * d.sin() * u2 * u2 - (m1 + m2) * gravity * l1 * v.q[0].sin(),
        m2 * l1 * l2 * d.sin() * u1 * u1 - m2 * gravity * l2 * v.q[1].sin(),
    ];
    let det = m[0][0] * m[1][1] - m[0][1] * m[1][0];
    let a = [(m[1][1] * q[0] - m[0][1] * q[1]) / det, (m[0][0] * q[1] - m[1][0] * q[0]) / det];
    let roots: Vec<_> = e.mass_matrix.iter().flatten().chain(&e.generalized_force).chain(&e.accelerations).collect();
    let roots: Vec<_> = roots.into_iter().copied().collect();
    let values = g.evaluate(&roots, &v);
    let expected = [m[0][0], m[0][1], m[1][0], m[1][1], q[0], q[1], a[0], a[1]];
    for (root, x) in roots.iter().zip(expected) {
        let y = values[root.index()];
        assert!((x - y).abs() <= 1e-13 * x.abs().max(1.0), "{x} {y}");
    }
}
