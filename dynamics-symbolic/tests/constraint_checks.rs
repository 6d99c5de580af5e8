//! Every rule of the constraints' checks finds the mistake that it is for, and one mistake is one finding.

use crate::common;

use common::Builder;
use common::constrained::{HOLONOMIC, NONHOLONOMIC, constrain};
use dynamics_symbolic::check::constraints::ConstraintFinding as Fault;
use dynamics_symbolic::check::{Finding, declared};
use dynamics_symbolic::graph::{Binary, Comparison, NodeId, Origin, Symbol, Unary};
use dynamics_symbolic::mechanics::{EnergyRole, Event, Input, Model};

/// A free particle in the plane, with its symbols x, y.
fn particle() -> (Builder, NodeId, NodeId) {
    let mut b = Builder::new("Particle");
    let (x, y, m) = (b.coordinate("x"), b.coordinate("y"), b.parameter("m"));
    let t = b.kinetic(m, &[x, y]);
    b.energy("kinetic", EnergyRole::Kinetic, t);
    (b, x, y)
}

/// The only finding, which is one about a constraint.
fn fault(model: &Model) -> Fault {
    match &declared(model)[..] {
        [Finding::Constraint(fault)] => fault.clone(),
        other => panic!("{other:?}"),
    }
}

fn name(name: &str) -> String {
    name.to_owned()
}

const ORIGIN: Origin = Origin(1000);

#[test]
fn a_row_that_is_zero_restricts_nothing() {
    let (mut b, x, y) = particle();
    let (s, c) = (b.sin(x), b.cos(x));
    let square = b.norm_squared(&[s, c]);
    let one = b.ratio(1, 1);
    let zero = b.sub(square, one);
    constrain(&mut b, "identity", HOLONOMIC, &[y, zero]);
    assert_eq!(fault(&b.model), Fault::AlwaysZero { name: name("identity[1]"), origin: ORIGIN });
}

#[test]
fn a_row_of_parameters_and_time_restricts_nothing_that_moves() {
    for kind in [HOLONOMIC, NONHOLONOMIC] {
        let (mut b, ..) = particle();
        let (l, t) = (b.parameter("l"), b.g().symbol(Symbol::Time));
        let node = b.mul(l, t);
        constrain(&mut b, "length", kind, &[node]);
        assert_eq!(fault(&b.model), Fault::WithoutCoordinate { name: name("length"), origin: ORIGIN });
    }
}

#[test]
fn velocities_belong_into_nonholonomic_rows_and_only_there() {
    let (mut b, x, y) = particle();
    let v = b.dt(x);
    let sum = b.add(v, y);
    constrain(&mut b, "skate", HOLONOMIC, &[sum]);
    assert_eq!(fault(&b.model), Fault::HolonomicWithVelocities { name: name("skate"), origin: ORIGIN });
    let (mut b, x, y) = particle();
    let sum = b.add(x, y);
    constrain(&mut b, "rod", NONHOLONOMIC, &[sum]);
    assert_eq!(fault(&b.model), Fault::NonholonomicWithoutVelocities { name: name("rod"), origin: ORIGIN });
}

#[test]
fn nonholonomic_rows_are_linear_in_the_velocities() {
    let (mut b, x, y) = particle();
    let (u, v) = (b.dt(x), b.dt(y));
    let speed = b.norm_squared(&[u, v]);
    let one = b.ratio(1, 1);
    let appell = b.sub(speed, one);
    constrain(&mut b, "constant_speed", NONHOLONOMIC, &[u, appell]);
    assert_eq!(fault(&b.model), Fault::NotLinear { name: name("constant_speed[1]"), origin: ORIGIN });
}

#[test]
fn affine_rows_with_time_are_sound() {
    let (mut b, x, y) = particle();
    let (u, v, t) = (b.dt(x), b.dt(y), b.g().symbol(Symbol::Time));
    let (s, c) = (b.sin(t), b.cos(x));
    let (su, cv) = (b.mul(s, u), b.mul(c, v));
    let sum = b.add(su, cv);
    let row = b.add(sum, t);
    constrain(&mut b, "conveyor", NONHOLONOMIC, &[row]);
    assert_eq!(declared(&b.model), []);
}

#[test]
fn what_follows_from_constraints_is_not_in_them() {
    let symbols = [
        (Symbol::Acceleration(0), "accelerations"),
        (Symbol::Multiplier(0), "reactions"),
        (Symbol::Input(0), "inputs"),
        (Symbol::Mode(0), "modes"),
    ];
    for (symbol, expected) in symbols {
        for kind in [HOLONOMIC, NONHOLONOMIC] {
            let (mut b, x, y) = particle();
            b.model.inputs.push(Input { name: name("w"), unit: String::new(), origin: Origin(7) });
            let w = b.g().symbol(Symbol::Input(0));
            b.model.read_elsewhere.push(name("w"));
            b.model.events.push(Event { name: name("e"), node: w, origin: Origin(8) });
            let (u, s) = (b.dt(y), b.g().symbol(symbol));
            let moving = if kind == HOLONOMIC { x } else { u };
            let row = b.add(moving, s);
            constrain(&mut b, "rod", kind, &[row]);
            let Fault::Contains { name, what, .. } = fault(&b.model) else { panic!("{symbol:?}") };
            assert_eq!((name.as_str(), what), ("rod", expected));
        }
    }
}

#[test]
fn energies_contain_neither_reactions_nor_modes() {
    for (symbol, expected) in [(Symbol::Multiplier(0), "reactions"), (Symbol::Mode(0), "modes")] {
        let (mut b, x, _) = particle();
        let s = b.g().symbol(symbol);
        let v = b.mul(x, s);
        b.energy("sticky", EnergyRole::Potential, v);
        let found = declared(&b.model);
        assert!(matches!(&found[..], [Finding::Contains { what, .. }] if *what == expected), "{found:?}");
    }
}

#[test]
fn a_parameter_that_only_a_constraint_reads_is_used() {
    let (mut b, x, _) = particle();
    let l = b.parameter("l");
    let row = b.sub(x, l);
    constrain(&mut b, "wall", HOLONOMIC, &[row]);
    assert_eq!(declared(&b.model), []);
}

/// A track with a kink: the slope is chosen by the place, the row is linear in the velocities on both sides.
/// Chosen by a velocity it is not.
#[test]
fn choices_between_linear_rows_are_linear() {
    let kinked = |by_velocity: bool| {
        let (mut b, x, y) = particle();
        let (u, v, zero, two) = (b.dt(x), b.dt(y), b.g().zero(), b.ratio(2, 1));
        let steep = b.mul(two, u);
        let decider = if by_velocity { u } else { x };
        let chosen = b.g().select(Comparison::Less, decider, zero, u, steep);
        let row = b.sub(v, chosen);
        constrain(&mut b, "track", NONHOLONOMIC, &[row]);
        b.model
    };
    assert_eq!(declared(&kinked(false)), []);
    assert_eq!(fault(&kinked(true)), Fault::NotLinear { name: name("track"), origin: ORIGIN });
}

/// √f and ∛f are zero where their gradient is infinite, f^1.5 where it vanishes; what only contains a root is
/// sound.
#[test]
fn rows_that_are_roots_are_found_whatever_they_are_multiplied_by() {
    let row = |of: &dyn Fn(&mut Builder, NodeId, NodeId) -> NodeId, switched: bool| {
        let (mut b, x, y) = particle();
        let (square, l) = (b.norm_squared(&[x, y]), b.parameter("l"));
        let ll = b.mul(l, l);
        let inside = b.sub(square, ll);
        let node = of(&mut b, inside, l);
        constrain(&mut b, "rod", HOLONOMIC, &[node]).switched = switched;
        declared(&b.model)
    };
    let root = |b: &mut Builder, x: NodeId| b.g().unary(Unary::Sqrt, x);
    let power = |b: &mut Builder, x: NodeId, n: i128| {
        let exponent = b.ratio(n, 2);
        b.g().binary(Binary::Powf, x, exponent)
    };
    type Row<'r> = &'r dyn Fn(&mut Builder, NodeId, NodeId) -> NodeId;
    let faulty: [Row<'_>; 6] = [
        &|b, x, _| root(b, x),
        &|b, x, _| b.g().unary(Unary::Cbrt, x),
        &|b, x, _| power(b, x, 3),
        &|b, x, l| {
            let product = root(b, x);
            b.mul(l, product)
        },
        &|b, x, l| {
            let product = root(b, x);
            b.g().div(product, l).unwrap()
        },
        &|b, x, _| {
            let negative = root(b, x);
            b.neg(negative)
        },
    ];
    let gone = Finding::Constraint(Fault::GradientVanishes { name: name("rod"), origin: ORIGIN });
    for (i, of) in faulty.iter().enumerate() {
        for switched in [false, true] {
            assert_eq!(row(*of, switched), std::slice::from_ref(&gone), "{i} {switched}");
        }
    }
    let sound: [Row<'_>; 4] = [
        // √(x² + y² − l²) − l.
        &|b, x, l| {
            let distance = root(b, x);
            b.sub(distance, l)
        },
        // √f f: zero to the power of 3/2, and for another check to see.
        &|b, x, _| {
            let distance = root(b, x);
            b.mul(distance, x)
        },
        &|b, x, l| {
            let length = root(b, l);
            b.mul(length, x)
        },
        &|b, x, l| {
            let length = power(b, l, 1);
            b.g().div(x, length).unwrap()
        },
    ];
    for (i, of) in sound.iter().enumerate() {
        assert_eq!(row(*of, false), [], "{i}");
    }
}
