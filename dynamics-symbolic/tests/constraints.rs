//! Equations with constraints, against hand results and numeric derivatives.

mod common;

use common::{Builder, Values};
use dynamics_symbolic::compile::{Compiled, compile};
use dynamics_symbolic::graph::NodeId;
use dynamics_symbolic::mechanics::{ConstraintEquations, EnergyRole, Model};

/// A bob at (x, y) on a rod: Φ = x² + y² − l²; parameters m, l, g.
fn cartesian_pendulum() -> Model {
    let mut b = Builder::new("CartesianPendulum");
    let place = [b.coordinate("x"), b.coordinate("y")];
    let [m, l, g] = ["m", "l", "g"].map(|n| b.parameter(n));
    let kinetic = b.kinetic(m, &place);
    b.energy("kinetic", EnergyRole::Kinetic, kinetic);
    let h = b.mul(m, place[1]);
    let gravity = b.mul(g, h);
    b.energy("gravity", EnergyRole::Potential, gravity);
    let (square, l2) = (b.norm_squared(&place), b.mul(l, l));
    let rod = b.sub(square, l2);
    b.holonomic("rod", &[rod]);
    b.model
}

fn constraints(c: &Compiled) -> &ConstraintEquations {
    c.equations.constraints.as_ref().expect("it has constraints")
}

fn at(c: &Compiled, nodes: &[NodeId], v: &Values) -> Vec<f64> {
    let found = c.model.graph.evaluate(nodes, v);
    nodes.iter().map(|x| found[x.index()]).collect()
}

#[test]
fn the_cartesian_pendulum_has_its_hand_derived_constraint() {
    let c = compile(cartesian_pendulum()).expect("a good model");
    let e = constraints(&c);
    let [x, y, vx, vy] = [0.3, -1.1, 0.7, -0.4];
    let v = Values { q: vec![x, y], u: vec![vx, vy], p: vec![1.5, 0.9, 9.81], ..Values::default() };
    let roots =
        [e.residual[0], e.velocity_residual[0], e.jacobian[0][0], e.jacobian[0][1], e.velocity_offset[0], e.gamma[0]];
    let expected = [x * x + y * y - 0.81, 2.0 * (x * vx + y * vy), 2.0 * x, 2.0 * y, 0.0, -2.0 * (vx * vx + vy * vy)];
    for (value, expected) in at(&c, &roots, &v).into_iter().zip(expected) {
        assert!((value - expected).abs() < 1e-14, "{value} {expected}");
    }
}
