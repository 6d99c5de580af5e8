//! What is noted of bodies is used where it is right and shorter, and never where it is not.

use super::super::derive::derive;
use super::super::equations::Derivation;
use super::*;
use crate::calculus::total_derivative;
use crate::graph::{Origin, Symbol, Unary};
use crate::mechanics::{Coordinate, Energy, EnergyRole};

/// What is changed, by its name.
type Change = (&'static str, fn(&mut Model));

/// Rotation about a coordinate axis.
fn rotation(g: &mut Graph, k: usize, angle: NodeId) -> M3 {
    let (i, j) = ((k + 1) % 3, (k + 2) % 3);
    let (sin, cos) = (g.unary(Unary::Sin, angle), g.unary(Unary::Cos, angle));
    let mut rows = [zero(g); 3];
    (rows[i][i], rows[j][j], rows[j][i], rows[k][k]) = (cos, cos, sin, g.one());
    rows[i][j] = g.neg(sin);
    rows
}

/// Three links on hinges about z, x and y: T and V from velocities and places in the world, and the bodies
/// noted beside them.
fn chain() -> Model {
    let mut model = Model { name: "chain".into(), ..Model::default() };
    let g = &mut model.graph;
    let (mut parameters, mut steps) = (0, Vec::new());
    let (mut origin, mut axes, mut omega) = (zero(g), [zero(g); 3], zero(g));
    (0..3).for_each(|i| axes[i][i] = g.one());
    let (mut kinetic, mut potential, mut bodies) = (g.zero(), g.zero(), Vec::new());
    let half = g.number(Number::ratio(1, 2));
    for (link, k) in [2, 0, 1].into_iter().enumerate() {
        let mut parameter = |g: &mut Graph| {
            parameters += 1;
            g.symbol(Symbol::Parameter(parameters))
        };
        let shift = [(); 3].map(|()| parameter(g));
        let (angle, rate) = (g.symbol(Symbol::Coordinate(link as u32)), g.symbol(Symbol::Rate(link as u32)));
        let turn = rotation(g, k, angle);
        let carried = turned(g, &axes, &shift);
        origin = added(g, &origin, &carried);
        let columns = transposed(&turn).map(|column| turned(g, &axes, &column));
        axes = transposed(&columns);
        omega = turned(g, &transposed(&turn), &omega);
        omega[k] = g.add(omega[k], rate);
        let mut along = zero(g);
        along[k] = rate;
        steps.extend([FrameStep::Shift(shift), FrameStep::Turn { rotation: turn, rate: along }]);

        let (mass, center) = (parameter(g), [(); 3].map(|()| parameter(g)));
        let inertia = [(); 3].map(|()| [(); 3].map(|()| parameter(g)));
        let arm = turned(g, &axes, &center);
        let place = added(g, &origin, &arm);
        let velocity = total_derivative(g, &place).expect("no input stands in a place");
        let velocity = [velocity[0], velocity[1], velocity[2]];
        let spin = turned(g, &inertia, &omega);
        let (square, turning) = (dot(g, &velocity, &velocity), dot(g, &omega, &spin));
        let square = g.mul(mass, square);
        let twice = g.add(square, turning);
        let energy = g.mul(half, twice);
        kinetic = g.add(kinetic, energy);
        let gravity = [g.zero(), g.zero(), g.integer(-10)];
        let drop = dot(g, &place, &gravity);
        let weight = g.mul(mass, drop);
        let weight = g.neg(weight);
        potential = g.add(potential, weight);
        let weight = Some((gravity, weight));
        bodies.push(Body { steps: steps.clone(), mass, center, inertia, kinetic: energy, weight });
    }
    for (name, role, node) in
        [("kinetic", EnergyRole::Kinetic, kinetic), ("weight", EnergyRole::Potential, potential)]
    {
        model.energies.push(Energy { name: name.into(), role, node, origin: Origin(0) });
    }
    for name in ["a", "b", "c"] {
        model.coordinates.push(Coordinate { name: name.into(), unit: String::new(), origin: Origin(0) });
    }
    model.bodies = bodies;
    model
}

/// How it was derived, and M and Q at the random points.
fn derived(mut model: Model) -> (Derivation, Vec<crate::graph::Fingerprint>, usize) {
    let equations = derive(&mut model).expect("every link has inertia");
    let g = &model.graph;
    let all: Vec<NodeId> =
        equations.mass_matrix.concat().into_iter().chain(equations.generalized_force).collect();
    (
        equations.derivation,
        all.iter().map(|x| g.fingerprint(*x)).collect(),
        g.operations(&equations.accelerations),
    )
}

#[test]
fn bodies_give_the_same_equations_in_fewer_operations() {
    let mut written = chain();
    written.bodies.clear();
    let (general, expected, long) = derived(written);
    let (bodies, found, short) = derived(chain());
    assert_eq!((general, bodies), (Derivation::Mixed, Derivation::Bodies));
    assert_eq!(found, expected);
    assert!(2 * short < long, "{short} operations instead of {long}");
}

/// Each note is wrong in one way. The energies are what was said: the equations stay theirs.
#[test]
fn a_wrong_note_is_not_believed() {
    let mut written = chain();
    written.bodies.clear();
    let (_, expected, _) = derived(written);
    let changes: [Change; 7] = [
        ("mass", |m| m.bodies[1].mass = m.bodies[0].mass),
        ("center", |m| m.bodies[2].center.swap(0, 1)),
        ("inertia", |m| m.bodies[0].inertia.swap(0, 2)),
        ("step left out", |m| {
            m.bodies[2].steps.remove(2);
        }),
        ("rate", |m| {
            let still = m.graph.zero();
            let Some(FrameStep::Turn { rate, .. }) = m.bodies[2].steps.last_mut() else { unreachable!() };
            *rate = [still; 3];
        }),
        ("turned back", |m| {
            let Some(FrameStep::Turn { rotation, .. }) = m.bodies[2].steps.last_mut() else { unreachable!() };
            *rotation = transposed(rotation);
        }),
        ("gravity", |m| {
            for body in &mut m.bodies {
                let down = m.graph.integer(-9);
                body.weight.as_mut().expect("every body has weight").0[2] = down;
            }
        }),
    ];
    for (what, change) in changes {
        let mut model = chain();
        change(&mut model);
        let (derivation, found, _) = derived(model);
        assert_eq!(found, expected, "{what}");
        assert_ne!(derivation, Derivation::Bodies, "{what}");
    }
}

/// What the recursions do not hold for is left to the general derivation.
#[test]
fn what_is_no_tree_of_rotations_is_derived_otherwise() {
    let changes: [Change; 4] = [
        ("steps that move with time", |m| {
            let t = m.graph.symbol(Symbol::Time);
            let Some(FrameStep::Shift(by)) = m.bodies[0].steps.first_mut() else { unreachable!() };
            by[0] = t;
        }),
        ("inertia that changes", |m| m.bodies[0].mass = m.graph.symbol(Symbol::Coordinate(0))),
        ("a turn that stretches", |m| {
            let two = m.graph.integer(2);
            let Some(FrameStep::Turn { rotation, .. }) = m.bodies[0].steps.last_mut() else { unreachable!() };
            rotation[2][2] = two;
        }),
        ("a mirror", |m| {
            let back = m.graph.integer(-1);
            let Some(FrameStep::Turn { rotation, .. }) = m.bodies[0].steps.last_mut() else { unreachable!() };
            rotation[2][2] = back;
        }),
    ];
    for (what, change) in changes {
        let mut model = chain();
        let (kinetic, potential) = (model.energies[0].node, model.energies[1].node);
        assert!(Tree::of(&mut model, kinetic, potential).is_some());
        change(&mut model);
        assert!(Tree::of(&mut model, kinetic, potential).is_none(), "{what}");
    }
}
