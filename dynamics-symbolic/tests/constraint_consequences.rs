//! What constraints do to the checks of models without them: inertia is asked for along free directions only,
//! reactions spoil what they act on.

use crate::common;

use common::Builder;
use common::constrained::{HOLONOMIC, NONHOLONOMIC, constrain, particles};
use dynamics_symbolic::check::Finding;
use dynamics_symbolic::check::constraints::ConstraintFinding as Fault;
use dynamics_symbolic::compile::{Compiled, compile};
use dynamics_symbolic::graph::{Binary, Comparison, NodeId, Origin, Symbol, Unary};
use dynamics_symbolic::mechanics::{EnergyRole, Model};
use proptest::prelude::*;

fn compiled(model: Model) -> Compiled {
    compile(model).unwrap_or_else(|found| panic!("{found:?}"))
}

fn faults(model: Model) -> Vec<Finding> {
    compile(model).map(|_| Vec::new()).unwrap_or_else(|found| found)
}

fn conserved(model: Model) -> Vec<String> {
    compiled(model).equations.conserved.into_iter().map(|c| c.quantity.name).collect()
}

/// T = ½ẋ², with y and what else has no inertia, and V that contains them all.
fn light(names: &[&str]) -> (Builder, Vec<NodeId>) {
    let mut b = Builder::new("Light");
    let q: Vec<NodeId> = names.iter().map(|n| b.coordinate(n)).collect();
    let one = b.ratio(1, 1);
    let t = b.kinetic(one, &q[..1]);
    b.energy("kinetic", EnergyRole::Kinetic, t);
    let v = b.norm_squared(&q);
    b.energy("springs", EnergyRole::Potential, v);
    (b, q)
}

fn without_inertia(direction: &str, origins: &[u32]) -> Vec<Finding> {
    let origins = origins.iter().map(|o| Origin(*o)).collect();
    vec![Finding::Constraint(Fault::FreeWithoutInertia { direction: direction.into(), origins })]
}

#[test]
fn a_coordinate_that_the_constraints_determine_needs_no_inertia() {
    let (mut b, q) = light(&["x", "y"]);
    let s = b.sin(q[0]);
    let gear = b.sub(q[1], s);
    constrain(&mut b, "gear", HOLONOMIC, &[gear]);
    compiled(b.model);
    let (mut b, q) = light(&["x", "y", "z"]);
    let s = b.sin(q[0]);
    let gear = b.sub(q[1], s);
    constrain(&mut b, "gear", HOLONOMIC, &[gear]);
    assert_eq!(faults(b.model), without_inertia("z", &[2]));
}

#[test]
fn a_free_combination_without_inertia_is_named() {
    // ẏ + 2ż = 0 leaves 2y − z free.
    let (mut b, q) = light(&["x", "y", "z"]);
    let sum = b.linear(&[0, 1, 2], &q, 0);
    constrain(&mut b, "gear", HOLONOMIC, &[sum]);
    assert_eq!(faults(b.model), without_inertia("2 y - z", &[1, 2]));
}

/// A row that holds y away from the manifold and lets it go on it: (x² + y² − 1)(y + 3) repeats the rod, so
/// that z alone stays determined.
#[test]
fn directions_that_are_free_where_the_constraints_hold_need_inertia() {
    let (mut b, q) = light(&["x", "y", "z"]);
    let (square, one, three) = (b.norm_squared(&q[..2]), b.ratio(1, 1), b.ratio(3, 1));
    let (rod, shift) = (b.sub(square, one), b.add(q[2], three));
    let again = b.mul(rod, shift);
    constrain(&mut b, "rod", HOLONOMIC, &[rod]);
    constrain(&mut b, "again", HOLONOMIC, &[again]).redundant = true;
    assert_eq!(faults(b.model), without_inertia("z", &[2]));
}

/// The inertia of a hole, taken away from the body that it is in: negative by itself, not where it moves with
/// the body.
#[test]
fn negative_inertia_counts_along_free_directions_only() {
    let model = |hole: i128| {
        let (mut b, q) = particles(&["body"]);
        let x = b.coordinate("hole");
        let minus = b.ratio(-hole, 2);
        let t = b.kinetic(minus, &[x]);
        b.energy("hole", EnergyRole::Kinetic, t);
        let gap = b.sub(q[0], x);
        constrain(&mut b, "fit", HOLONOMIC, &[gap]);
        b.model
    };
    compiled(model(1));
    let found = faults(model(4));
    assert!(matches!(&found[..], [Finding::NegativeInertia { .. }]), "{found:?}");
}

#[test]
fn fixed_constraints_keep_the_energy_and_moving_ones_do_not() {
    let pendulum = |moving: bool| {
        let (mut b, q) = particles(&["x", "y"]);
        let l = b.parameter("l");
        let (square, ll) = (b.norm_squared(&q), b.mul(l, l));
        let mut rod = b.sub(square, ll);
        if moving {
            let time = b.g().symbol(Symbol::Time);
            let s = b.sin(time);
            rod = b.sub(rod, s);
        }
        constrain(&mut b, "rod", HOLONOMIC, &[rod]);
        conserved(b.model)
    };
    assert_eq!(pendulum(false), ["energy"]);
    assert_eq!(pendulum(true), [""; 0]);
    let sleigh = |offset: i64| {
        let (mut b, q) = particles(&["x", "y", "psi"]);
        let (u, v) = (b.dt(q[0]), b.dt(q[1]));
        let (s, c) = (b.sin(q[2]), b.cos(q[2]));
        let (us, vc) = (b.mul(u, s), b.mul(v, c));
        let edge = b.sub(us, vc);
        let blown = b.linear(&[1], &[edge], offset);
        constrain(&mut b, "edge", NONHOLONOMIC, &[blown]);
        conserved(b.model)
    };
    assert_eq!(sleigh(0), ["energy", "momentum of psi"]);
    assert_eq!(sleigh(1), ["momentum of psi"]);
}

/// Two masses on a rod: the rod pushes them apart, so that only their common momenta stay; a wall takes one
/// of these as well.
#[test]
fn reactions_take_momenta_that_they_act_on() {
    let (mut b, q) = particles(&["x", "y", "u", "v"]);
    let (dx, dy) = (b.sub(q[0], q[2]), b.sub(q[1], q[3]));
    let (square, one) = (b.norm_squared(&[dx, dy]), b.ratio(1, 1));
    let rod = b.sub(square, one);
    constrain(&mut b, "rod", HOLONOMIC, &[rod]);
    assert_eq!(conserved(b.model.clone()), ["energy", "momentum of x + u", "momentum of y + v"]);
    constrain(&mut b, "wall", HOLONOMIC, &q[..1]);
    assert_eq!(conserved(b.model.clone()), ["energy", "momentum of y + v"]);
    let report = compiled(b.model).report;
    assert!(!report.contains("ignorable"), "the constraints read every coordinate\n{report}");
}

/// Expressions of every kind, by a list of instructions on a stack.
fn expression(b: &mut Builder, q: &[NodeId], program: &[(u8, u8)]) -> NodeId {
    let mut stack = q.to_vec();
    for (what, with) in program {
        let (x, y) = (stack[stack.len() - 1], stack[usize::from(*with) % stack.len()]);
        let node = match what % 14 {
            0 => b.add(x, y),
            1 => b.sub(x, y),
            2 | 3 => b.mul(x, y),
            4 => b.g().div(x, y).unwrap_or(y),
            5 => b.sin(x),
            6 => b.g().unary(Unary::Sqrt, x),
            7 => b.g().unary(Unary::Exp, x),
            8 => b.g().unary(Unary::Abs, x),
            9 => b.g().unary(Unary::Ln, x),
            10 => b.g().binary(Binary::Max, x, y),
            11 => b.g().binary(Binary::Atan2, x, y),
            12 => b.g().select(Comparison::Less, x, y, y, x),
            _ => b.ratio(i128::from(*with) - 100, 7),
        };
        stack.push(node);
    }
    stack[stack.len() - 1]
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 600, failure_persistence: None, ..ProptestConfig::default() })]

    /// Whatever is declared, the checks end with findings or without, and never by a panic.
    #[test]
    fn nothing_panics(
        programs in prop::collection::vec(
            (prop::collection::vec((any::<u8>(), any::<u8>()), 1..12), 0..6u8),
            1..5,
        ),
        nominal in any::<bool>(),
    ) {
        let (mut b, q) = particles(&["x", "y", "z"]);
        let l = b.parameter("l");
        let mut all = q.clone();
        all.extend([l, b.g().symbol(Symbol::Time)]);
        if nominal {
            b.nominal(0, 1.5);
        }
        b.model.read_elsewhere.push("l".into());
        let mut rows: Vec<(bool, u8, NodeId)> = Vec::new();
        for (program, options) in &programs {
            let free = expression(&mut b, &all, program);
            let node = b.add(free, q[usize::from(*options) % 3]);
            let holonomic = options % 2 == 0;
            rows.push((holonomic, *options, if holonomic { node } else { b.dt(node) }));
        }
        rows.sort_by_key(|(holonomic, ..)| !holonomic);
        for (i, (holonomic, options, node)) in rows.into_iter().enumerate() {
            let kind = if holonomic { HOLONOMIC } else { NONHOLONOMIC };
            let c = constrain(&mut b, &format!("row{i}"), kind, &[node]);
            c.redundant = options > 3;
            c.switched = options == 2;
        }
        let _ = compile(b.model);
    }
}
