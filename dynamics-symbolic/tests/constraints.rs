//! Equations with constraints against hand results, numeric derivatives and numeric linear algebra.

use crate::common::mechanisms::{Mechanism, andrews, cartesian_chain, four_bar, slider_crank};
use crate::common::{Builder, Values};
use dynamics_symbolic::compile::{Programs, compile};
use dynamics_symbolic::graph::{NodeId, Number, Origin, Symbol};
use dynamics_symbolic::mechanics::{
    ConstraintEquations, EnergyRole, Equations, Force, ForceTerm, General, Model, Solution, derive,
};
use proptest::prelude::*;

/// A bob at (x, y) on a rod: Φ = x² + y² − l²; parameters m, l, g.
fn cartesian_pendulum() -> Builder {
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
    b
}

/// A model with its equations; the checks and texts of a whole compilation are not at issue here.
struct Derived {
    model: Model,
    equations: Equations,
}

impl Derived {
    fn of(mut model: Model) -> Self {
        let equations = derive(&mut model).expect("a good model");
        Self { model, equations }
    }
}

/// The same as it comes out of a whole compilation, with the programs.
fn compiled(model: Model) -> (Derived, Programs) {
    let c = compile(model).expect("a good model");
    (Derived { model: c.model, equations: c.equations }, c.programs)
}

fn constraints(c: &Derived) -> &ConstraintEquations {
    c.equations.constraints.as_ref().expect("it has constraints")
}

fn at(c: &Derived, nodes: &[NodeId], v: &Values) -> Vec<f64> {
    let found = c.model.graph.evaluate(nodes, v);
    nodes.iter().map(|x| found[x.index()]).collect()
}

fn matrix(c: &Derived, rows: &[Vec<NodeId>], v: &Values) -> Vec<Vec<f64>> {
    rows.iter().map(|row| at(c, row, v)).collect()
}

fn near(a: &[f64], b: &[f64], tolerance: f64) -> bool {
    let size = a.iter().chain(b).fold(1.0f64, |m, x| m.max(x.abs()));
    a.len() == b.len() && a.iter().zip(b).all(|(x, y)| (x - y).abs() <= tolerance * size)
}

/// q̈ and λ of an unrolled solution.
fn solved(c: &Derived, v: &Values) -> (Vec<f64>, Vec<f64>) {
    let Solution::Unrolled(u) = &constraints(c).solution else { panic!("not unrolled") };
    for guard in &u.guards {
        let [pivot, scale] = [guard.pivot, guard.scale].map(|x| at(c, &[x], v)[0]);
        assert!(
            pivot.abs() > guard.tolerance * scale.abs(),
            "{}: {guard:?}: {pivot:e} against {scale:e}",
            c.model.name
        );
    }
    (at(c, &u.accelerations, v), at(c, &u.multipliers, v))
}

/// λ = (m g y − m v²) / (2 l²) where the bob is on its circle: the tension −2 λ l carries weight and
/// centripetal force.
#[test]
fn the_cartesian_pendulum_has_its_hand_derived_equations() {
    let c = Derived::of(cartesian_pendulum().model);
    let e = constraints(&c);
    let [m, l, g] = [1.5, 0.9, 9.81];
    let (sin, cos) = 0.4f64.sin_cos();
    let (rate, x, y) = (1.7, l * sin, -l * cos);
    let (vx, vy) = (rate * l * cos, rate * l * sin);
    let v = Values { q: vec![x, y], u: vec![vx, vy], p: vec![m, l, g], ..Values::default() };
    let roots =
        [e.residual[0], e.velocity_residual[0], e.jacobian[0][0], e.jacobian[0][1], e.velocity_offset[0]];
    assert!(near(&at(&c, &roots, &v), &[0.0, 0.0, 2.0 * x, 2.0 * y, 0.0], 1e-15));
    assert!(near(&at(&c, &e.gamma, &v), &[-2.0 * (vx * vx + vy * vy)], 1e-15));
    let (accelerations, multipliers) = solved(&c, &v);
    let turn = -g / l * sin;
    let expected = [turn * l * cos - rate * rate * l * sin, turn * l * sin + rate * rate * l * cos];
    assert!(near(&accelerations, &expected, 1e-14), "{accelerations:?} {expected:?}");
    let tension = m * g * cos + m * l * rate * rate;
    assert!(near(&multipliers, &[-tension / (2.0 * l)], 1e-14), "{multipliers:?}");
    assert_eq!(e.rows[0].name, "rod");
    assert!(e.derivatives.is_ok() && c.equations.jacobians.is_ok());
}

/// A knife edge sliding on a plane, steered by φ: ẋ sin φ − ẏ cos φ = 0. At unit mass λ is φ̇ times the
/// speed, up to sign.
#[test]
fn the_knife_edge_has_its_hand_derived_reaction() {
    let mut b = Builder::new("KnifeEdge");
    let [x, y, phi] = ["x", "y", "phi"].map(|n| b.coordinate(n));
    let m = b.parameter("m");
    let (slide, spin) = (b.kinetic(m, &[x, y]), b.kinetic(m, &[phi]));
    b.energy("slide", EnergyRole::Kinetic, slide);
    b.energy("spin", EnergyRole::Kinetic, spin);
    let (s, co, dx, dy) = (b.sin(phi), b.cos(phi), b.dt(x), b.dt(y));
    let (across, along) = (b.mul(s, dx), b.mul(co, dy));
    let edge = b.sub(across, along);
    b.nonholonomic("edge", &[edge]);
    let c = Derived::of(b.model);
    let (sin, cos) = 0.3f64.sin_cos();
    let (speed, turn) = (2.0, 0.7);
    let v = Values {
        q: vec![5.0, 1.0, 0.3],
        u: vec![speed * cos, speed * sin, turn],
        p: vec![3.0],
        ..Values::default()
    };
    let (accelerations, multipliers) = solved(&c, &v);
    assert!(
        near(&accelerations, &[-speed * turn * sin, speed * turn * cos, 0.0], 1e-15),
        "{accelerations:?}"
    );
    assert!(near(&multipliers, &[-3.0 * speed * turn], 1e-15), "{multipliers:?}");
    let e = constraints(&c);
    assert_eq!((e.holonomic, e.residual.len(), e.rows.len()), (0, 0, 1));
    assert!(near(&at(&c, &e.jacobian[0], &v), &[sin, -cos, 0.0], 1e-15));
}

/// A bob whose place is that of a rod's end at an angle without inertia: x = l sin θ, y = −l cos θ. The angle
/// moves as that of a pendulum.
#[test]
fn a_coordinate_without_inertia_is_carried_by_its_constraints() {
    let mut b = Builder::new("Carried");
    let [x, y, theta] = ["x", "y", "theta"].map(|n| b.coordinate(n));
    let [m, l, g] = ["m", "l", "g"].map(|n| b.parameter(n));
    let kinetic = b.kinetic(m, &[x, y]);
    b.energy("kinetic", EnergyRole::Kinetic, kinetic);
    let h = b.mul(m, y);
    let gravity = b.mul(g, h);
    b.energy("gravity", EnergyRole::Potential, gravity);
    let (s, co) = (b.sin(theta), b.cos(theta));
    let (out, down) = (b.mul(l, s), b.mul(l, co));
    let gap = [b.sub(x, out), b.add(y, down)];
    b.holonomic("end", &gap);
    let (c, _) = compiled(b.model);
    let (sin, cos) = 0.6f64.sin_cos();
    let (l, rate) = (0.9, 1.3);
    let v = Values {
        q: vec![l * sin, -l * cos, 0.6],
        u: vec![l * cos * rate, l * sin * rate, rate],
        p: vec![1.5, l, 9.81],
        ..Values::default()
    };
    let (a, lambda) = solved(&c, &v);
    let turn = -9.81 / l * sin;
    let expected = [l * (cos * turn - sin * rate * rate), l * (sin * turn + cos * rate * rate), turn];
    assert!(near(&a, &expected, 1e-14), "{a:?} {expected:?}");
    assert!(near(&lambda, &[1.5 * expected[0], 1.5 * (expected[1] + 9.81)], 1e-14), "{lambda:?}");
}

/// The pendulum turned at a given rate, and so without freedom: q̈ follows from the constraints alone, λ of
/// the drive is the torque that it takes, and its power is what the energy changes by.
#[test]
fn a_driven_mechanism_has_the_forces_that_drive_it() {
    let mut b = Builder::new("Driven");
    let theta = b.coordinate("theta");
    let [m, l, g, omega] = ["m", "l", "g", "omega"].map(|n| b.parameter(n));
    let (s, co) = (b.sin(theta), b.cos(theta));
    let (out, down) = (b.mul(l, s), b.mul(l, co));
    let place = [out, b.neg(down)];
    let kinetic = b.kinetic(m, &place);
    b.energy("kinetic", EnergyRole::Kinetic, kinetic);
    let h = b.mul(m, place[1]);
    let gravity = b.mul(g, h);
    b.energy("gravity", EnergyRole::Potential, gravity);
    let t = b.g().symbol(Symbol::Time);
    let angle = b.mul(omega, t);
    let swing = b.sin(angle);
    let drive = b.sub(theta, swing);
    b.holonomic("drive", &[drive]);
    let (c, _) = compiled(b.model);
    let (t, omega, m, l) = (0.7f64, 2.0f64, 1.5, 0.9);
    let (angle, rate, turn) =
        ((omega * t).sin(), omega * (omega * t).cos(), -omega * omega * (omega * t).sin());
    let mut v = Values { t, q: vec![angle], u: vec![rate], p: vec![m, l, 9.81, omega], ..Values::default() };
    let (a, lambda) = solved(&c, &v);
    let torque = m * l * l * turn + m * 9.81 * l * angle.sin();
    assert!(near(&a, &[turn], 1e-14) && near(&lambda, &[torque], 1e-14), "{a:?} {lambda:?}");
    v.lambda = lambda;
    let power = c.equations.powers.iter().find(|p| p.name == "drive").expect("it moves");
    assert!(near(&at(&c, &[power.node], &v), &[torque * rate], 1e-14));
}

/// While a mode does not change, it is a number like any other: it has no rate.
#[test]
fn modes_are_constants_of_the_motion() {
    let mut b = cartesian_pendulum();
    b.model.constraints[0].switched = true;
    let [x, mode] = [Symbol::Coordinate(0), Symbol::Mode(0)].map(|s| b.g().symbol(s));
    let (rate, slip) = (b.dt(x), b.mul(mode, x));
    assert_eq!(b.dt(slip), b.mul(mode, rate));
    let terms = vec![ForceTerm::Along { expression: x, magnitude: mode }];
    b.model.forces.push(Force { name: "rub".into(), terms, origin: Origin(9) });
    let (c, programs) = compiled(b.model);
    let v = Values { q: vec![0.3, -0.8], u: vec![0.0; 2], p: vec![1.5, 0.9, 9.81], ..Values::default() };
    assert!(near(&at(&c, &c.equations.generalized_force, &v), &[0.0, -1.5 * 9.81], 1e-15), "all hold");
    assert!(programs.constraints.is_some_and(|p| p.correction.is_some()));
}

/// What repeats itself, what depends on its own reactions, and what has inertia only where it may move.
#[test]
fn what_cannot_be_unrolled_says_why() {
    let mut b = cartesian_pendulum();
    let rod = b.model.constraints[0].components[0].1;
    let three = b.g().integer(3);
    let again = b.mul(three, rod);
    b.holonomic("again", &[again]);
    b.model.constraints.iter_mut().for_each(|c| c.redundant = true);
    let reason = |model: Model| match &constraints(&compiled(model).0).solution {
        Solution::General(reason) => *reason,
        Solution::Unrolled(_) => panic!("unrolled"),
    };
    assert_eq!(reason(b.model), General::Redundant);
    assert_eq!(reason(rubbed()), General::Friction);
}

/// The pendulum with a brake at its bob that is proportional to the reaction: F = −k λ ẋ along x.
fn rubbed() -> Model {
    let mut b = cartesian_pendulum();
    let k = b.parameter("k");
    let (lambda, x) = (b.g().symbol(Symbol::Multiplier(0)), b.g().symbol(Symbol::Coordinate(0)));
    let (rate, size) = (b.dt(x), b.mul(k, lambda));
    let brake = b.mul(size, rate);
    let magnitude = b.neg(brake);
    let terms = vec![ForceTerm::Along { expression: x, magnitude }];
    b.model.forces.push(Force { name: "brake".into(), terms, origin: Origin(9) });
    b.model
}

#[test]
fn forces_that_depend_on_reactions_are_kept_apart() {
    let (c, all) = compiled(rubbed());
    let e = constraints(&c);
    let v = Values {
        q: vec![0.3, -0.8],
        u: vec![0.7, 0.2],
        p: vec![1.5, 0.9, 9.81, 0.4],
        lambda: vec![-2.5],
        ..Values::default()
    };
    assert!(near(&at(&c, &e.free_force, &v), &[0.0, -1.5 * 9.81], 1e-15));
    assert!(near(&at(&c, &c.equations.generalized_force, &v), &[0.4 * 2.5 * 0.7, -1.5 * 9.81], 1e-15));
    let by = e.force_by_multipliers.as_ref().expect("the brake contains λ");
    assert!(near(&matrix(&c, by, &v).concat(), &[-0.4 * 0.7, 0.0], 1e-15));
    let programs = all.constraints.as_ref().expect("it has constraints");
    assert_eq!(programs.friction.as_ref().map(|p| p.results.len()), Some(4));
    assert!(programs.correction.is_none() && all.accelerations.results.is_empty());
    let power = c.equations.powers.iter().find(|p| p.name == "brake").expect("it has a power");
    assert!(near(&at(&c, &[power.node], &v), &[0.4 * 2.5 * 0.49], 1e-15));
}

/// A random model of n coordinates with h holonomic and k nonholonomic rows, all of which may contain time.
#[derive(Clone, Debug)]
struct Recipe {
    coordinates: usize,
    holonomic: usize,
    nonholonomic: usize,
    timed: bool,
    numbers: Vec<f64>,
}

fn recipes() -> impl Strategy<Value = Recipe> {
    // Where fewer than three directions are left, every row that is linear in the velocities can be
    // integrated.
    let sound = |(n, h, k): &(usize, usize, usize)| h + k > 0 && (*k == 0 || n - h >= 3);
    let sizes = (3usize..=4, 0usize..=2, 0usize..=1).prop_filter("constrained, and not integrable", sound);
    (sizes, any::<bool>(), prop::collection::vec(0.2..1.5f64, 60)).prop_map(
        |((coordinates, holonomic, nonholonomic), timed, numbers)| Recipe {
            coordinates,
            holonomic,
            nonholonomic,
            timed,
            numbers,
        },
    )
}

struct Draw<'a>(core::iter::Cycle<core::slice::Iter<'a, f64>>);

impl Draw<'_> {
    fn number(&mut self, b: &mut Builder) -> NodeId {
        let number = Number::finite(*self.0.next().expect("a cycle does not end")).expect("finite");
        b.g().number(number)
    }
}

fn combination(b: &mut Builder, d: &mut Draw, of: &[NodeId]) -> NodeId {
    of.iter().fold(b.g().zero(), |sum, x| {
        let a = d.number(b);
        let term = b.mul(a, *x);
        b.add(sum, term)
    })
}

/// a sin(q₀ + … + t) + q·q.
fn place(b: &mut Builder, d: &mut Draw, q: &[NodeId], timed: bool) -> NodeId {
    let mut angle = combination(b, d, q);
    if timed {
        let (w, t) = (d.number(b), b.g().symbol(Symbol::Time));
        let turn = b.mul(w, t);
        angle = b.add(angle, turn);
    }
    let (wave, size) = (b.sin(angle), d.number(b));
    let (wave, x, y) = (b.mul(size, wave), combination(b, d, q), combination(b, d, &q[1..]));
    let bowl = b.mul(x, y);
    b.add(wave, bowl)
}

fn model(recipe: &Recipe) -> Model {
    let mut b = Builder::new("Random");
    let q = b.coordinates("q", recipe.coordinates);
    let m = b.parameter("m");
    let mut d = Draw(recipe.numbers.iter().cycle());
    let mut kinetic = b.kinetic(m, &q);
    for _ in 0..2 {
        let point = [place(&mut b, &mut d, &q, false), combination(&mut b, &mut d, &q)];
        let term = b.kinetic(m, &point);
        kinetic = b.add(kinetic, term);
    }
    b.energy("kinetic", EnergyRole::Kinetic, kinetic);
    let potential = place(&mut b, &mut d, &q, false);
    b.energy("potential", EnergyRole::Potential, potential);
    let rows: Vec<NodeId> = (0..recipe.holonomic).map(|_| place(&mut b, &mut d, &q, recipe.timed)).collect();
    if !rows.is_empty() {
        b.holonomic("place", &rows);
    }
    for _ in 0..recipe.nonholonomic {
        let mut row = b.g().zero();
        for x in &q {
            let (weight, rate) = (place(&mut b, &mut d, &q, recipe.timed), b.dt(*x));
            let term = b.mul(weight, rate);
            row = b.add(row, term);
        }
        if recipe.timed {
            let drift = place(&mut b, &mut d, &q, true);
            row = b.add(row, drift);
        }
        b.nonholonomic("roll", &[row]);
    }
    b.model
}

fn values(n: usize, rows: usize, x: &[f64]) -> Values {
    Values {
        t: x[0],
        q: x[1..=n].to_vec(),
        u: x[6..6 + n].to_vec(),
        p: vec![x[11].abs() + 0.5],
        lambda: x[12..12 + rows].to_vec(),
        ..Values::default()
    }
}

fn state() -> impl Strategy<Value = Vec<f64>> {
    prop::collection::vec(-1.2..1.2f64, 16)
}

/// Central difference quotient of some nodes along a path of values.
fn quotient(c: &Derived, nodes: &[NodeId], path: impl Fn(f64) -> Values) -> Vec<f64> {
    // Four points, so that the truncation is far below what is tested.
    let h = 1e-3;
    let [a, b, d, e] = [-2.0 * h, -h, h, 2.0 * h].map(|s| at(c, nodes, &path(s)));
    (0..nodes.len()).map(|i| (a[i] - 8.0 * b[i] + 8.0 * d[i] - e[i]) / (12.0 * h)).collect()
}

/// Along the motion without accelerations.
fn drift(v: &Values, s: f64) -> Values {
    let q = v.q.iter().zip(&v.u).map(|(q, u)| q + s * u).collect();
    Values { t: v.t + s, q, ..v.clone() }
}

/// M q̈ − Q − Φ_qᵀλ and Φ_q q̈ − γ.
fn defect(
    c: &Derived,
    v: &Values,
    accelerations: &[f64],
    multipliers: &[f64],
    gamma: &[f64],
    force: &[f64],
) -> f64 {
    let e = constraints(c);
    let (m, j) = (matrix(c, &c.equations.mass_matrix, v), matrix(c, &e.jacobian, v));
    let motion = m.iter().enumerate().map(|(i, row)| {
        let reaction: f64 = j.iter().zip(multipliers).map(|(row, l)| row[i] * l).sum();
        dot(row, accelerations) - force[i] - reaction
    });
    let rows = j.iter().zip(gamma).map(|(row, gamma)| dot(row, accelerations) - gamma);
    motion.chain(rows).fold(0.0, |worst, x| worst.max(x.abs()))
}

fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(x, y)| x * y).sum()
}

/// The largest component of what is left of x when everything along these rows is taken off.
fn beside(rows: &[Vec<f64>], mut x: Vec<f64>) -> f64 {
    let mut basis: Vec<Vec<f64>> = Vec::new();
    let off = |x: &mut [f64], unit: &[f64]| {
        let along = dot(x, unit);
        x.iter_mut().zip(unit).for_each(|(x, e)| *x -= along * e);
    };
    for row in rows {
        let mut unit = row.clone();
        // Twice is enough (Kahan).
        (0..2).for_each(|_| basis.iter().for_each(|other| off(&mut unit, other)));
        let length = dot(&unit, &unit).sqrt();
        unit.iter_mut().for_each(|e| *e /= length);
        basis.push(unit);
    }
    (0..2).for_each(|_| basis.iter().for_each(|unit| off(&mut x, unit)));
    x.iter().fold(0.0, |largest, x| largest.max(x.abs()))
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 8, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn rows_are_differentiated_along_the_motion(recipe in recipes(), x in state()) {
        let c = Derived::of(model(&recipe));
        let e = constraints(&c);
        let v = values(recipe.coordinates, e.rows.len(), &x);
        prop_assert_eq!(e.holonomic, recipe.holonomic);
        let rates = at(&c, &e.velocity_residual, &v);
        let numeric = quotient(&c, &e.residual, |s| drift(&v, s));
        prop_assert!(near(&rates[..e.holonomic], &numeric, 1e-9), "{rates:?} {numeric:?}");
        let gamma: Vec<f64> = at(&c, &e.gamma, &v).iter().map(|x| -x).collect();
        let numeric = quotient(&c, &e.velocity_residual, |s| drift(&v, s));
        prop_assert!(near(&gamma, &numeric, 1e-9), "{gamma:?} {numeric:?}");
        // Rows are linear in the velocities: A u + b.
        let (j, offset) = (matrix(&c, &e.jacobian, &v), at(&c, &e.velocity_offset, &v));
        let linear: Vec<f64> = j.iter().zip(&offset).map(|(row, b)| dot(row, &v.u) + b).collect();
        prop_assert!(near(&linear, &rates, 1e-12), "{linear:?} {rates:?}");
        for i in 0..recipe.coordinates {
            let moved = |s: f64| { let mut v = v.clone(); v.u[i] += s; v };
            let column: Vec<f64> = j.iter().map(|row| row[i]).collect();
            prop_assert!(near(&column, &quotient(&c, &e.velocity_residual, moved), 1e-9));
        }
    }

    #[test]
    fn derivatives_of_reactions_and_gamma_are_difference_quotients(recipe in recipes(), x in state()) {
        let c = Derived::of(model(&recipe));
        let e = constraints(&c);
        let (n, v) = (recipe.coordinates, values(recipe.coordinates, e.rows.len(), &x));
        let d = e.derivatives.as_ref().expect("small");
        let column = |m: &[Vec<_>], j: usize| -> Vec<f64> {
            m.iter().map(|row| at(&c, &[row[j]], &v)[0]).collect()
        };
        for j in 0..n {
            let by_q = |s: f64| { let mut v = v.clone(); v.q[j] += s; v };
            let by_u = |s: f64| { let mut v = v.clone(); v.u[j] += s; v };
            let slopes = quotient(&c, &e.jacobian.concat(), by_q);
            let reaction: Vec<f64> =
                (0..n).map(|i| (0..e.rows.len()).map(|r| slopes[r * n + i] * v.lambda[r]).sum()).collect();
            prop_assert!(near(&column(&d.reaction_by_q, j), &reaction, 1e-8));
            prop_assert!(near(&column(&d.gamma_by_q, j), &quotient(&c, &e.gamma, by_q), 1e-8));
            prop_assert!(near(&column(&d.gamma_by_u, j), &quotient(&c, &e.gamma, by_u), 1e-8));
        }
    }

    #[test]
    fn unrolled_solutions_solve_the_equations(recipe in recipes(), x in state()) {
        let c = Derived::of(model(&recipe));
        let e = constraints(&c);
        let Solution::Unrolled(u) = &e.solution else { panic!("regular: {:?}", e.solution) };
        let v = values(recipe.coordinates, e.rows.len(), &x);
        let guarded = u.guards.iter().all(|guard| {
            let [pivot, scale] = [guard.pivot, guard.scale].map(|x| at(&c, &[x], &v)[0]);
            // Far from where rounding would have to be allowed for.
            pivot.abs() > guard.tolerance.max(1e-3) * scale.abs()
        });
        prop_assume!(guarded);
        let (a, l) = (at(&c, &u.accelerations, &v), at(&c, &u.multipliers, &v));
        let size = a.iter().chain(&l).fold(1.0f64, |m, x| m.max(x.abs()));
        let (gamma, force) = (at(&c, &e.gamma, &v), at(&c, &c.equations.generalized_force, &v));
        let left = defect(&c, &v, &a, &l, &gamma, &force);
        prop_assert!(left < 1e-11 * size, "{left:e} of {size:e}");
        let delta = at(&c, &u.correction, &v);
        let size = delta.iter().fold(1.0f64, |m, x| m.max(x.abs()));
        let (m, j) = (matrix(&c, &c.equations.mass_matrix, &v), matrix(&c, &e.jacobian, &v));
        let times = |a: &[Vec<f64>]| a.iter().map(|row| dot(row, &delta)).collect::<Vec<_>>();
        let left = beside(&j, times(&m));
        prop_assert!(left < 1e-11 * size, "M δ is no reaction: {left:e} of {size:e}");
        prop_assert!(near(&times(&j), &v.lambda, 1e-11 * size), "Φ_q δ = r");
    }

    #[test]
    fn jacobians_are_difference_quotients_of_the_accelerations(recipe in recipes(), x in state()) {
        let c = Derived::of(model(&recipe));
        let e = constraints(&c);
        let Solution::Unrolled(u) = &e.solution else { panic!("regular: {:?}", e.solution) };
        let v = values(recipe.coordinates, e.rows.len(), &x);
        let guarded = u.guards.iter().all(|guard| {
            let [pivot, scale] = [guard.pivot, guard.scale].map(|x| at(&c, &[x], &v)[0]);
            pivot.abs() > 0.1 * scale.abs()
        });
        prop_assume!(guarded);
        let jacobians = c.equations.jacobians.as_ref().expect("small");
        let column = |m: &[Vec<_>], j: usize| -> Vec<f64> {
            m.iter().map(|row| at(&c, &[row[j]], &v)[0]).collect()
        };
        for j in 0..recipe.coordinates {
            let by_q = |s: f64| { let mut v = v.clone(); v.q[j] += 0.1 * s; v };
            let by_u = |s: f64| { let mut v = v.clone(); v.u[j] += s; v };
            let (exact, numeric) = (column(&jacobians.by_q, j), quotient(&c, &u.accelerations, by_q));
            let numeric: Vec<f64> = numeric.iter().map(|x| 10.0 * x).collect();
            prop_assert!(near(&exact, &numeric, 1e-6), "by q{j}: {exact:?} {numeric:?}");
            let (exact, numeric) = (column(&jacobians.by_u, j), quotient(&c, &u.accelerations, by_u));
            prop_assert!(near(&exact, &numeric, 1e-6), "by u{j}: {exact:?} {numeric:?}");
        }
        let by_m = |s: f64| { let mut v = v.clone(); v.p[0] += s; v };
        let (exact, numeric) = (column(&jacobians.by_parameters, 0), quotient(&c, &u.accelerations, by_m));
        prop_assert!(near(&exact, &numeric, 1e-6), "by m: {exact:?} {numeric:?}");
    }

    /// dE/dt is the sum of the powers, moving constraints included, where the velocities are admissible.
    #[test]
    fn energy_changes_by_the_powers(recipe in recipes(), x in state()) {
        let c = Derived::of(model(&recipe));
        let e = constraints(&c);
        let mut v = values(recipe.coordinates, e.rows.len(), &x);
        let Solution::Unrolled(u) = &e.solution else { panic!("regular: {:?}", e.solution) };
        // δ with M δ = Φ_qᵀμ, Φ_q δ = −Φ̇ makes the velocities admissible.
        v.lambda = at(&c, &e.velocity_residual, &v).iter().map(|x| -x).collect();
        let delta = at(&c, &u.correction, &v);
        prop_assume!(delta.iter().all(|d| d.abs() < 1e2));
        v.u.iter_mut().zip(delta).for_each(|(u, d)| *u += d);
        prop_assert!(at(&c, &e.velocity_residual, &v).iter().all(|x| x.abs() < 1e-9));
        v.a = at(&c, &u.accelerations, &v);
        v.lambda = at(&c, &u.multipliers, &v);
        let powers: Vec<NodeId> = c.equations.powers.iter().map(|p| p.node).collect();
        let expected: f64 = at(&c, &powers, &v).iter().sum();
        let path = |s: f64| {
            let step = |x: &[f64], y: &[f64], z: &[f64]| -> Vec<f64> {
                let curved = |i: usize| s * s / 2.0 * z.get(i).copied().unwrap_or(0.0);
                (0..x.len()).map(|i| x[i] + s * y[i] + curved(i)).collect()
            };
            Values { t: v.t + s, q: step(&v.q, &v.u, &v.a), u: step(&v.u, &v.a, &[]), ..v.clone() }
        };
        let size = v.a.iter().chain(&v.u).chain(&v.lambda).fold(1.0f64, |m, x| m.max(x.abs()));
        // Small enough steps for large accelerations.
        let scaled = |s: f64| path(s / size);
        let rate = quotient(&c, &[c.equations.energy_function], scaled)[0] * size;
        prop_assert!((rate - expected).abs() < 1e-6 * size * size * size, "{rate} {expected}");
        let moving = c.equations.powers.iter().any(|p| p.name == "place" || p.name == "roll");
        prop_assert_eq!(moving, recipe.timed);
    }
}

fn declared(mechanism: Mechanism) -> (Model, Values) {
    let Mechanism { mut builder, residual, parameters, place } = mechanism;
    builder.holonomic("closure", &residual);
    let n = place.len();
    let v = Values {
        q: place,
        u: (0..n).map(|i| (1.3 * i as f64).sin()).collect(),
        p: parameters,
        lambda: vec![0.0; residual.len()],
        ..Values::default()
    };
    (builder.model, v)
}

/// Known mechanisms are unrolled, solve their equations and keep the number of operations that they have been
/// brought to.
#[test]
fn mechanisms_are_unrolled_with_known_numbers_of_operations() {
    let sizes = [(andrews(), 600), (slider_crank(), 120), (four_bar(), 200), (cartesian_chain(5), 300)];
    for (mechanism, most) in sizes {
        let (model, v) = declared(mechanism);
        let (c, programs) = compiled(model);
        let e = constraints(&c);
        let (a, l) = solved(&c, &v);
        let (gamma, force) = (at(&c, &e.gamma, &v), at(&c, &c.equations.generalized_force, &v));
        let size = a.iter().chain(&l).fold(1.0f64, |m, x| m.max(x.abs()));
        let left = defect(&c, &v, &a, &l, &gamma, &force);
        assert!(left < 1e-12 * size, "{}: {left:e} of {size:e}", c.model.name);
        let operations = programs.accelerations.cost.total();
        assert!(operations <= most, "{}: {operations}", c.model.name);
    }
}
