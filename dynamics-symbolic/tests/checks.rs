//! Every rule of the model checks finds the mistake that it is for, and one mistake is one finding.

use crate::common;

use common::{Builder, chain, double_pendulum};
use dynamics_symbolic::check::Finding;
use dynamics_symbolic::compile::compile;
use dynamics_symbolic::graph::{Comparison, NodeId, Origin, Symbol, Unary};
use dynamics_symbolic::mechanics::{EnergyRole, Event, Force, ForceTerm, Input, Model};

fn findings(model: Model) -> Vec<Finding> {
    compile(model).map(|_| Vec::new()).unwrap_or_else(|found| found)
}

fn conserved(model: Model) -> Vec<(String, String)> {
    let compiled = compile(model).unwrap_or_else(|found| panic!("{found:?}"));
    compiled.equations.conserved.into_iter().map(|c| (c.quantity.name, c.quantity.unit)).collect()
}

fn names(model: Model) -> Vec<String> {
    conserved(model).into_iter().map(|(name, _)| name).collect()
}

/// A mass on a line, with its symbols x, m.
fn particle() -> (Builder, NodeId, NodeId) {
    let mut b = Builder::new("Particle");
    let (x, m) = (b.coordinate("x"), b.parameter("m"));
    let t = b.kinetic(m, &[x]);
    b.energy("kinetic", EnergyRole::Kinetic, t);
    (b, x, m)
}

fn no_inertia(direction: &str, origins: &[u32]) -> Vec<Finding> {
    vec![Finding::NoInertia {
        direction: direction.into(),
        origins: origins.iter().map(|o| Origin(*o)).collect(),
    }]
}

#[test]
fn sound_models_pass() {
    for model in [double_pendulum(), chain(4), particle().0.model] {
        assert_eq!(findings(model), []);
    }
}

#[test]
fn what_nothing_reads_is_unused() {
    let (mut b, ..) = particle();
    b.parameter("k");
    b.parameter("v.x");
    b.coordinate("y");
    b.model.inputs.push(Input { name: "push".into(), unit: String::new(), origin: Origin(7) });
    let unused =
        |what, name: &str, origin| Finding::Unused { what, name: name.into(), origin: Origin(origin) };
    let expected = [
        unused("coordinate", "y", 1),
        unused("parameter", "k", 101),
        unused("parameter", "v", 102),
        unused("input", "push", 7),
    ];
    assert_eq!(findings(b.model), expected);
}

#[test]
fn elements_of_one_array_are_read_together() {
    let (mut b, x, _) = particle();
    let k = b.parameters("k", 3);
    let square = b.mul(x, x);
    let v = b.mul(k[1], square);
    b.energy("spring", EnergyRole::Potential, v);
    assert_eq!(findings(b.model), []);
}

#[test]
fn a_coordinate_without_inertia_is_named() {
    let (mut b, x, _) = particle();
    let y = b.coordinate("y");
    let product = b.mul(x, y);
    b.energy("spring", EnergyRole::Potential, product);
    assert_eq!(findings(b.model), no_inertia("y", &[1]));
}

/// T = ½ m (ẋ + 2 ẏ)²: moving x by 2 and y by −1 costs nothing.
#[test]
fn a_direction_without_inertia_is_named() {
    let mut b = Builder::new("Rope");
    let (x, y, m) = (b.coordinate("x"), b.coordinate("y"), b.parameter("m"));
    let two = b.ratio(2, 1);
    let double = b.mul(two, y);
    let rope = b.add(x, double);
    let t = b.kinetic(m, &[rope]);
    b.energy("kinetic", EnergyRole::Kinetic, t);
    assert_eq!(findings(b.model), no_inertia("2 x - y", &[0, 1]));
}

/// A point on a sphere of two angles and a radius, with a fourth coordinate that turns it the same way: the
/// direction depends on the state.
#[test]
fn a_direction_that_depends_on_the_state_names_its_coordinates() {
    let mut b = Builder::new("Redundant");
    let (r, a, c, m) = (b.coordinate("r"), b.coordinate("a"), b.coordinate("c"), b.parameter("m"));
    let angle = b.mul(a, c);
    let (s, k) = (b.sin(angle), b.cos(angle));
    let place = [b.mul(r, s), b.mul(r, k)];
    let t = b.kinetic(m, &place);
    b.energy("kinetic", EnergyRole::Kinetic, t);
    assert_eq!(
        findings(b.model),
        no_inertia("a combination of a, c that depends on state or parameters", &[1, 2])
    );
}

#[test]
fn kinetic_energy_is_quadratic_and_may_come_from_a_moving_frame() {
    let (mut b, x, m) = particle();
    let v = b.dt(x);
    let cube = {
        let square = b.mul(v, v);
        b.mul(square, v)
    };
    b.energy("odd", EnergyRole::Kinetic, cube);
    let expected = vec![Finding::NotQuadratic { name: "odd".into(), origin: Origin(0), chooses: false }];
    assert_eq!(findings(b.model), expected);

    let mut b = Builder::new("Conveyor");
    let (x, m2, time) = (b.coordinate("x"), b.parameter("m"), b.g().symbol(Symbol::Time));
    let s = b.sin(time);
    let place = b.add(x, s);
    let t = b.kinetic(m2, &[place]);
    b.energy("kinetic", EnergyRole::Kinetic, t);
    assert_eq!(findings(b.model), []);
    let _ = m;
}

/// What jumps across the place of a choice is found, by whatever name the choice goes; what only looks like
/// it is not.
#[test]
fn energies_do_not_jump() {
    // T of a particle at (x, y + f), or its L, from f and from what m is multiplied by.
    let found = |role: EnergyRole, make: &dyn Fn(&mut Builder, NodeId) -> [NodeId; 2]| {
        let mut b = Builder::new("Ramp");
        let (x, y, m) = (b.coordinate("x"), b.coordinate("y"), b.parameter("m"));
        let [height, factor] = make(&mut b, x);
        let (place, mass) = ([x, b.add(y, height)], b.mul(m, factor));
        let t = b.kinetic(mass, &place);
        b.energy("energy", role, t);
        findings(b.model)
    };
    let jumps = vec![Finding::EnergyJumps { name: "energy".into(), origin: Origin(0), at_rest: false }];
    let (kinetic, lagrangian) = (EnergyRole::Kinetic, EnergyRole::Lagrangian);
    let abs = |b: &mut Builder, x: NodeId| [b.g().unary(Unary::Abs, x), b.ratio(1, 1)];
    assert_eq!(found(kinetic, &abs), jumps);
    assert_eq!(found(lagrangian, &abs), jumps);
    let root = |b: &mut Builder, x: NodeId| {
        let square = b.mul(x, x);
        [b.g().unary(Unary::Sqrt, square), b.ratio(1, 1)]
    };
    assert_eq!(found(kinetic, &root), jumps);
    // Somewhere else than at zero, and of no single coordinate.
    let aside = |b: &mut Builder, x: NodeId| {
        let (a, s) = (b.parameter("a"), b.sin(x));
        let from = b.sub(s, a);
        [b.g().unary(Unary::Abs, from), b.ratio(1, 1)]
    };
    let with_nominal = |role| {
        let mut b = Builder::new("Ramp");
        let (x, y, m) = (b.coordinate("x"), b.coordinate("y"), b.parameter("m"));
        let [height, _] = aside(&mut b, x);
        b.model.nominal.push((1, 0.3));
        let place = [x, b.add(y, height)];
        let t = b.kinetic(m, &place);
        b.energy("energy", role, t);
        findings(b.model)
    };
    assert_eq!(with_nominal(kinetic), jumps);
    let heavier = |b: &mut Builder, x: NodeId| {
        let (zero, one, two) = (b.g().zero(), b.ratio(1, 1), b.ratio(2, 1));
        [zero, b.g().select(Comparison::Less, zero, x, two, one)]
    };
    assert_eq!(found(kinetic, &heavier), jumps);
    // A base that sets off at once.
    let pushed = |b: &mut Builder, _: NodeId| {
        let time = b.g().symbol(Symbol::Time);
        let one = b.ratio(1, 1);
        let late = b.sub(time, one);
        [b.g().unary(Unary::Abs, late), one]
    };
    assert_eq!(found(kinetic, &pushed), jumps);
    // x|x| is smooth enough, and so is a mass that begins to grow, and a mass that is left behind.
    let smooth = |b: &mut Builder, x: NodeId| {
        let size = b.g().unary(Unary::Abs, x);
        [b.mul(x, size), b.ratio(1, 1)]
    };
    assert_eq!(found(kinetic, &smooth), []);
    let growing = |b: &mut Builder, x: NodeId| {
        let (zero, one) = (b.g().zero(), b.ratio(1, 1));
        let more = b.add(one, x);
        [zero, b.g().select(Comparison::Less, zero, x, more, one)]
    };
    assert_eq!(found(kinetic, &growing), []);
    let dropped = |b: &mut Builder, _: NodeId| {
        let (zero, one, two) = (b.g().zero(), b.ratio(1, 1), b.ratio(2, 1));
        let time = b.g().symbol(Symbol::Time);
        [zero, b.g().select(Comparison::Less, time, one, two, one)]
    };
    assert_eq!(found(kinetic, &dropped), []);
    // A spring that is met, alone in its potential, begins at zero; a step does not.
    let buffer = |stepped: bool| {
        let mut b = Builder::new("Buffer");
        let (x, m, k, at) = (b.coordinate("x"), b.parameter("m"), b.parameter("k"), b.parameter("at"));
        let t = b.kinetic(m, &[x]);
        b.energy("kinetic", kinetic, t);
        let into = b.sub(x, at);
        let square = b.mul(into, into);
        let (zero, pushed) = (b.g().zero(), b.mul(k, square));
        let inside = if stepped { k } else { pushed };
        let v = b.g().select(Comparison::Less, at, x, inside, zero);
        b.energy("buffer", EnergyRole::Potential, v);
        findings(b.model)
    };
    assert_eq!(buffer(false), []);
    assert_eq!(
        buffer(true),
        [Finding::EnergyJumps { name: "buffer".into(), origin: Origin(0), at_rest: true }]
    );
}

/// What is infinite where a choice changes is no step: atoms on a line that cannot pass one another, and a
/// barrier of which the far side is left out.
#[test]
fn energies_that_are_infinite_do_not_jump() {
    let found = |make: &dyn Fn(&mut Builder, NodeId) -> NodeId| {
        let mut b = Builder::new("Atoms");
        let (x, y, m) = (b.coordinate("x"), b.coordinate("y"), b.parameter("m"));
        let t = b.kinetic(m, &[x, y]);
        b.energy("kinetic", EnergyRole::Kinetic, t);
        let apart = b.sub(x, y);
        let v = make(&mut b, apart);
        b.energy("bond", EnergyRole::Potential, v);
        findings(b.model)
    };
    // Lennard-Jones, of the distance √((x − y)²).
    let atoms = |b: &mut Builder, apart: NodeId| {
        let square = b.mul(apart, apart);
        let (distance, size) = (b.g().unary(Unary::Sqrt, square), b.parameter("size"));
        let ratio = b.g().div(size, distance).expect("no zero");
        let sixth = b.g().powi(ratio, 6).expect("a power");
        let (twelfth, depth) = (b.mul(sixth, sixth), b.parameter("depth"));
        let difference = b.sub(twelfth, sixth);
        b.mul(depth, difference)
    };
    assert_eq!(found(&atoms), []);
    // A logarithm grows most slowly.
    let barrier = |b: &mut Builder, apart: NodeId| {
        let (zero, k) = (b.g().zero(), b.parameter("k"));
        let logarithm = b.g().unary(Unary::Ln, apart);
        let held = b.mul(k, logarithm);
        b.g().select(Comparison::Less, zero, apart, held, zero)
    };
    assert_eq!(found(&barrier), []);
}

#[test]
fn energies_contain_what_they_may() {
    let (mut b, x, m) = particle();
    let v = b.dt(x);
    let a = b.dt(v);
    let product = b.mul(m, a);
    b.energy("jerky", EnergyRole::Kinetic, product);
    let bad = b.mul(v, x);
    b.energy("moving", EnergyRole::Potential, bad);
    let input = b.g().symbol(Symbol::Input(0));
    b.model.inputs.push(Input { name: "w".into(), unit: String::new(), origin: Origin(7) });
    let driven = b.mul(input, v);
    b.energy("driven", EnergyRole::Lagrangian, driven);
    let lifted = b.mul(input, x);
    b.energy("lifted", EnergyRole::Potential, lifted);
    let found: Vec<(String, &str)> = findings(b.model)
        .into_iter()
        .map(|f| match f {
            Finding::Contains { name, what, .. } => (name, what),
            other => panic!("{other:?}"),
        })
        .collect();
    let expected = [("jerky", "accelerations"), ("moving", "velocities"), ("driven", "inputs")];
    assert_eq!(found, expected.map(|(n, w)| (n.to_owned(), w)));
}

#[test]
fn forces_act_at_places_and_do_not_contain_accelerations() {
    let (mut b, x, m) = particle();
    let v = b.dt(x);
    let a = b.dt(v);
    let force = |name: &str, expression, magnitude| Force {
        name: name.into(),
        terms: vec![ForceTerm::Along { expression, magnitude }],
        origin: Origin(9),
    };
    b.model.forces = vec![force("feedback", x, a), force("misplaced", v, m), force("fine", x, v)];
    let found: Vec<String> = findings(b.model).iter().map(|f| format!("{f:?}")).collect();
    assert_eq!(found.len(), 2);
    assert!(found[0].contains("feedback") && found[0].contains("accelerations"));
    assert!(found[1].contains("misplaced") && found[1].contains("velocities"));
}

#[test]
fn what_changes_nothing_is_reported() {
    let (mut b, x, m) = particle();
    let g = b.parameter("g");
    let weight = b.mul(m, g);
    b.energy("gravity", EnergyRole::Potential, weight);
    b.energy("drag", EnergyRole::Dissipation, x);
    b.model.events.push(Event { name: "never".into(), node: g, origin: Origin(5) });
    let found: Vec<String> = findings(b.model)
        .into_iter()
        .map(|f| match f {
            Finding::NoEffect { role, name, reason, .. } => format!("{role} {name} {reason}"),
            other => panic!("{other:?}"),
        })
        .collect();
    let expected = [
        "potential energy gravity does not depend on any coordinate",
        "dissipation function drag does not depend on any velocity",
        "event never never crosses zero because it is constant",
    ];
    assert_eq!(found, expected);
}

#[test]
fn a_force_on_a_fixed_point_does_nothing() {
    let (mut b, _, m) = particle();
    let zero = b.g().zero();
    let terms = vec![ForceTerm::At { point: vec![zero, m], vector: vec![m, m] }];
    b.model.forces.push(Force { name: "anchor".into(), terms, origin: Origin(3) });
    assert!(
        matches!(&findings(b.model)[..], [Finding::NoEffect { role: "force", name, .. }] if name == "anchor")
    );
}

#[test]
fn negative_inertia_is_found_with_and_without_nominal_values() {
    let (mut b, x, m) = particle();
    let t = b.kinetic(m, &[x]);
    let minus = b.neg(t);
    b.model.energies.clear();
    b.energy("kinetic", EnergyRole::Kinetic, minus);
    let negative =
        |nominal| vec![Finding::NegativeInertia { direction: "x".into(), nominal, origins: vec![Origin(0)] }];
    assert_eq!(findings(b.model.clone()), negative(false));
    b.model.nominal = vec![(0, 2.0)];
    assert_eq!(findings(b.model), negative(true));

    // ½ẋ² + c ẋẏ + ½ẏ² is positive only for |c| < 1: without a value for c there is nothing to say.
    let mut b = Builder::new("Coupled");
    let (x, y, c, one) = (b.coordinate("x"), b.coordinate("y"), b.parameter("c"), b.ratio(1, 1));
    let both = b.kinetic(one, &[x, y]);
    let (u, v) = (b.dt(x), b.dt(y));
    let product = b.mul(u, v);
    let coupling = b.mul(c, product);
    let t = b.add(both, coupling);
    b.energy("kinetic", EnergyRole::Kinetic, t);
    assert_eq!(findings(b.model.clone()), []);
    b.model.nominal = vec![(0, 0.5)];
    assert_eq!(findings(b.model.clone()), []);
    b.model.nominal = vec![(0, 2.0)];
    assert!(matches!(findings(b.model)[..], [Finding::NegativeInertia { nominal: true, .. }]));
}

/// L = ẋẏ is regular and indefinite: x − y moves with negative energy, and no elimination without exchange
/// gets through.
#[test]
fn an_indefinite_lagrangian_is_not_called_singular() {
    let mut b = Builder::new("Saddle");
    let (x, y) = (b.coordinate("x"), b.coordinate("y"));
    let (u, v) = (b.dt(x), b.dt(y));
    let l = b.mul(u, v);
    b.energy("saddle", EnergyRole::Lagrangian, l);
    let [Finding::NegativeInertia { direction, .. }] = &findings(b.model)[..] else { panic!("one finding") };
    assert_eq!(direction, "a combination of x, y");
}

#[test]
fn nothing_at_all_does_not_panic() {
    assert_eq!(findings(Model::default()), []);
}

#[test]
fn energy_and_ignorable_momenta_are_conserved() {
    assert_eq!(names(double_pendulum()), ["energy"]);
    assert_eq!(names(chain(3)), ["energy", "momentum of x"]);
    let (mut b, ..) = particle();
    b.model.coordinates[0].unit = "m".into();
    let expected = [("energy", "J"), ("momentum of x", "kg*m/s")].map(|(n, u)| (n.to_owned(), u.to_owned()));
    assert_eq!(conserved(b.model), expected);
}

/// Two bodies of different mass joined by a spring: only the sum of their momenta stays. And a free pair of
/// angles, geared 2 : 1.
#[test]
fn momenta_of_constant_combinations_are_found() {
    let mut b = Builder::new("Pair");
    let (x, y) = (b.coordinate("x"), b.coordinate("y"));
    let [m1, m2, k] = ["m1", "m2", "k"].map(|n| b.parameter(n));
    let (t1, t2) = (b.kinetic(m1, &[x]), b.kinetic(m2, &[y]));
    let t = b.add(t1, t2);
    b.energy("kinetic", EnergyRole::Kinetic, t);
    let mut geared = b.model.clone();
    let spring = |b: &mut Builder, factor: i128| {
        let n = b.ratio(factor, 1);
        let scaled = b.mul(n, y);
        let stretch = b.sub(scaled, x);
        let c = b.cos(stretch);
        let v = b.mul(k, c);
        b.energy("spring", EnergyRole::Potential, v);
    };
    spring(&mut b, 1);
    assert_eq!(names(b.model), ["energy", "momentum of x + y"]);
    let mut b = Builder { model: core::mem::take(&mut geared) };
    spring(&mut b, 2);
    assert_eq!(names(b.model), ["energy", "momentum of 2 x + y"]);
}

#[test]
fn forces_that_do_work_spoil_energy_and_internal_ones_leave_momentum() {
    let (mut b, x, m) = particle();
    let y = b.coordinate("y");
    let t = b.kinetic(m, &[y]);
    b.energy("other", EnergyRole::Kinetic, t);
    let stretch = b.sub(x, y);
    let rate = b.dt(stretch);
    let magnitude = b.neg(rate);
    let terms = vec![ForceTerm::Along { expression: stretch, magnitude }];
    b.model.forces.push(Force { name: "damper".into(), terms, origin: Origin(3) });
    assert_eq!(names(b.model), ["momentum of x + y"]);
}

/// A bead in a tube that turns at a given rate: T + V grows, the energy function does not.
#[test]
fn the_energy_function_is_told_from_the_energy() {
    let mut b = Builder::new("Tube");
    let (r, m, omega) = (b.coordinate("r"), b.parameter("m"), b.parameter("omega"));
    let time = b.g().symbol(Symbol::Time);
    let angle = b.mul(omega, time);
    let (s, c) = (b.sin(angle), b.cos(angle));
    let place = [b.mul(r, c), b.mul(r, s)];
    let t = b.kinetic(m, &place);
    b.energy("kinetic", EnergyRole::Kinetic, t);
    assert_eq!(names(b.model), ["energy function"]);
}

#[test]
fn time_and_inputs_in_the_energies_spoil_the_energy() {
    for symbol in [Symbol::Time, Symbol::Input(0)] {
        let (mut b, x, _) = particle();
        if symbol != Symbol::Time {
            b.model.inputs.push(Input { name: "w".into(), unit: String::new(), origin: Origin(7) });
        }
        let s = b.g().symbol(symbol);
        let sum = b.add(x, s);
        let v = b.g().unary(Unary::Cosh, sum);
        b.energy("spring", EnergyRole::Potential, v);
        assert_eq!(names(b.model), [""; 0]);
    }
}

/// Two masses on lines, and V = `then` or `otherwise` of (x, y) as `decider` of (x, y, t) is below 1 or not.
fn switched(
    decider: fn(&mut Builder, [NodeId; 3]) -> NodeId,
    branches: fn(&mut Builder, NodeId, NodeId) -> [NodeId; 2],
) -> Model {
    let (mut b, x, m) = particle();
    let y = b.coordinate("y");
    let t = b.kinetic(m, &[y]);
    b.energy("other", EnergyRole::Kinetic, t);
    let time = b.g().symbol(Symbol::Time);
    let (one, decider) = (b.g().one(), decider(&mut b, [x, y, time]));
    let [then, otherwise] = branches(&mut b, x, y);
    let v = b.g().select(Comparison::Less, decider, one, then, otherwise);
    b.energy("switched", EnergyRole::Potential, v);
    b.model
}

/// The slopes of both branches keep the energy and the momentum of y; only what decides between them tells
/// that the choice does not.
#[test]
fn what_decides_a_choice_has_to_be_invariant_too() {
    let wells = |b: &mut Builder, x, _| [b.cos(x), b.mul(x, x)];
    assert_eq!(names(switched(|_, [_, _, t]| t, wells)), ["momentum of y"], "time decides");
    // Both branches meet where x − y = 1.
    let meeting = |b: &mut Builder, x, y| {
        let (apart, one, zero) = (b.sub(x, y), b.ratio(1, 1), b.g().zero());
        let past = b.sub(apart, one);
        [b.mul(past, past), zero]
    };
    let between = |b: &mut Builder, [x, y, _]: [NodeId; 3]| b.sub(x, y);
    assert_eq!(names(switched(between, meeting)), ["energy", "momentum of x + y"], "the distance decides");
    // Where a place decides and the branches do not meet, a potential has a step.
    let step = [Finding::EnergyJumps { name: "switched".into(), origin: Origin(0), at_rest: true }];
    assert_eq!(findings(switched(|_, [_, y, _]| y, wells)), step, "y decides");
    assert_eq!(findings(switched(|_, [x, _, _]| x, wells)), step, "x decides");
}
