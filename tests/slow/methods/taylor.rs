//! Taylor series on derived models.

use crate::double;
use crate::double_pendulum;
use crate::kepler;

use double::Double;
use double_pendulum::DoublePendulum;
use dynamics::model::{Model, ModelState, Vector};
use dynamics::prelude::*;
use kepler::Kepler;

/// M₁₁ = 2.3, M₂₂ = 0.832, coupling 1.04 cos(θ₁ − θ₂).
const DP: DoublePendulum = DoublePendulum { m1: 1.0, m2: 1.3, l1: 1.0, l2: 0.8, g: 9.81 };

/// A block on a table, pulled by a spring: dry friction changes its sign with the velocity.
#[derive(Clone, Debug, Dynamics)]
#[coordinates(s)]
struct Block {
    mass: f64,
    stiffness: f64,
    friction: f64,
}

#[dynamics]
impl Block {
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * self.mass * q.s.dt().powi(2)
    }
    #[potential]
    fn spring(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * self.stiffness * q.s.powi(2)
    }
    #[force]
    fn dry(&self, q: &Coordinates<Self>) -> Force {
        Force::along(q.s, -self.friction * q.s.dt().signum())
    }
}

/// A mass driven through a spring whose other end follows time.
#[derive(Clone, Debug, Dynamics)]
#[coordinates(s)]
#[inputs(push)]
struct Driven {
    mass: f64,
    stiffness: f64,
    omega: f64,
}

#[dynamics]
impl Driven {
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * self.mass * q.s.dt().powi(2)
    }
    #[potential]
    fn spring(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * self.stiffness * (q.s - (self.omega * q.t).sin()).powi(2)
    }
    #[force]
    fn pushed(&self, q: &Coordinates<Self>) -> Force {
        Force::along(q.s, q.push)
    }
}

/// The same, pushed by what is written into it.
#[derive(Clone, Debug, Dynamics)]
#[coordinates(s)]
struct Written {
    mass: f64,
    stiffness: f64,
    omega: f64,
    push: f64,
    pace: f64,
}

#[dynamics]
impl Written {
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * self.mass * q.s.dt().powi(2)
    }
    #[potential]
    fn spring(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * self.stiffness * (q.s - (self.omega * q.t).sin()).powi(2)
    }
    #[force]
    fn pushed(&self, q: &Coordinates<Self>) -> Force {
        Force::along(q.s, self.push * (self.pace * q.t).sin())
    }
}

/// A bead on a wire of which only a spline is known.
#[derive(Clone, Debug, Dynamics)]
#[coordinates(s)]
struct Bead {
    height: CubicSpline,
}

#[dynamics]
impl Bead {
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * q.s.dt().powi(2)
    }
    #[potential]
    fn gravity(&self, q: &Coordinates<Self>) -> Expr {
        9.81 * self.height.at(q.s)
    }
}

/// Largest difference of coordinates and velocities.
fn distance<S: ModelState>(x: S, y: S) -> f64 {
    let pairs =
        x.q().as_slice().iter().zip(y.q().as_slice()).chain(x.u().as_slice().iter().zip(y.u().as_slice()));
    pairs.fold(0.0, |most, (a, b)| most.max((a - b).abs()))
}

const TAYLOR: methods::Taylor = methods::Taylor { order: None };

#[test]
fn the_error_follows_the_tolerance_down_to_rounding() {
    let start = DP.state().theta1(1.5).theta2(1.0).build().unwrap();
    let truth = DP.simulate(start).until(10.0).tolerance(1e-15).run().unwrap().end();
    for tolerance in [1e-4, 1e-6, 1e-8, 1e-10, 1e-12, 1e-15] {
        let motion = DP.simulate(start).until(10.0).tolerance(tolerance).method(TAYLOR).run().unwrap();
        let error = distance(motion.end(), truth);
        // At 1e-15 rounding decides, of the reference as well: the motion makes errors 100 times larger.
        assert!(error < 100.0 * tolerance + 3e-13, "{tolerance:e}: {error:e}");
        assert!(
            tolerance < 1e-11 || error > 1e-3 * tolerance,
            "{tolerance:e}: {error:e}, no tolerance was used"
        );
        assert!(!motion.verify().to_string().contains("stiff"), "{}", motion.verify());
    }
}

/// End values at 60 digits (Taylor series of order 46 with steps of 1/40, by programs that share nothing with
/// these; 24 digits do not change with the order), and how they change with the start: what a start that is
/// rounded leaves is all that there is to be had.
#[test]
fn twenty_seconds_keep_the_digits_that_their_condition_leaves() {
    let start = DP.state().theta1(1.5).theta2(1.0).build().unwrap();
    let truth = [0.36276707186663065, 0.9679952787997108, -2.9420051248217174, -2.697969053667355];
    // By θ₁, θ₂ and their rates; the rates are 0, so that theirs are absolute.
    let condition =
        [[7.9, 2.7, 0.24, 0.059], [7.1, 3.3, 0.25, 0.10], [21.8, 4.8, 0.67, 0.85], [63.4, 17.0, 2.1, 1.9]];
    let motion = DP.simulate(start).until(20.0).tolerance(1e-15).method(TAYLOR).run().unwrap();
    let end = motion.end();
    let found = [end.theta1(), end.theta2(), end.theta1_rate(), end.theta2_rate()];
    for (i, (found, truth)) in found.iter().zip(truth).enumerate() {
        let of_start: f64 =
            condition[i].iter().zip([1.5, 1.0, 1.0, 1.0]).map(|(c, x)| c * x * f64::EPSILON).sum();
        let error = (found - truth).abs();
        assert!(error < 4.0 * of_start, "{i}: {error:e}, where a rounded start makes {of_start:e}");
    }
}

#[test]
fn any_order_can_be_asked_for() {
    let start = DP.state().theta1(1.5).theta2(1.0).build().unwrap();
    let truth = DP.simulate(start).until(1.0).tolerance(1e-14).run().unwrap().end();
    for order in [4, 7, 12, 20, 30] {
        let method = methods::Taylor { order: Some(order) };
        let motion = DP.simulate(start).until(1.0).tolerance(1e-9).method(method).run().unwrap();
        let error = distance(motion.end(), truth);
        assert!(error < 1e-7, "order {order}: {error:e}");
    }
    // With fixed steps the error falls with the power of the order.
    for order in [4, 6, 8] {
        let method = methods::Taylor { order: Some(order) };
        let run = |h| DP.simulate(start).until(1.0).fixed_step(h).method(method).run().unwrap().end();
        let (coarse, fine) = (distance(run(0.01), truth), distance(run(0.005), truth));
        let found = (coarse / fine).log2();
        assert!((found - order as f64).abs() < 0.7, "order {order}: {coarse:e} → {fine:e}, {found}");
    }
}

#[test]
fn dense_output_is_as_accurate_as_steps() {
    let start = DP.state().theta1(1.5).theta2(1.0).build().unwrap();
    let reference = DP.simulate(start).until(3.0).tolerance(1e-14).run().unwrap();
    let motion = DP.simulate(start).until(3.0).tolerance(1e-11).method(TAYLOR).run().unwrap();
    for i in 0..300 {
        let t = 0.01 * f64::from(i);
        let exact = DP.simulate(start).until(t.max(1e-3)).tolerance(1e-14).run().unwrap();
        let error = distance(motion.at(exact.end().t()), exact.end());
        assert!(error < 1e-9, "t = {t}: {error:e}");
    }
    assert!(distance(motion.end(), reference.end()) < 1e-9);
}

/// In units of what is permitted, at random places of random motions, beside the ends of their own steps and
/// the method's own run ended there.
#[test]
fn states_between_steps_are_as_good_as_ends_of_steps() {
    let mut seed = 1_u64;
    let mut random = move || {
        seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (seed >> 33) as f64 / 2f64.powi(31)
    };
    let mut worst = [0.0_f64; 2];
    for tolerance in [1e-5, 1e-8, 1e-11] {
        for _ in 0..6 {
            let start = DP.state().theta1(3.0 * random()).theta2_rate(2.0 * random()).build().unwrap();
            let exact = DP.simulate(start).until(4.0).tolerance(1e-14).run().unwrap();
            let run = |end| DP.simulate(start).until(end).tolerance(tolerance).method(TAYLOR).run().unwrap();
            let motion = run(4.0);
            let off =
                |state: <DoublePendulum as Model>::State| distance(state, exact.at(state.t())) / tolerance;
            let steps: Vec<_> = motion.steps().collect();
            for two in steps.windows(2) {
                let t = two[0].t() + random() * (two[1].t() - two[0].t());
                let beside = distance(motion.at(t), run(t).end()) / tolerance;
                worst[0] = worst[0].max(off(motion.at(t)) / off(two[0]).max(off(two[1])).max(1.0));
                worst[1] = worst[1].max(beside);
            }
        }
    }
    assert!(worst[0] < 1.5 && worst[1] < 1.0, "{worst:?}");
}

#[test]
fn runs_backwards_to_where_it_came_from() {
    let start = DP.state().theta1(1.5).theta2(1.0).build().unwrap();
    let there = DP.simulate(start).until(5.0).tolerance(1e-14).method(TAYLOR).run().unwrap();
    let back = DP.simulate(there.end()).until(0.0).tolerance(1e-14).method(TAYLOR).run().unwrap();
    let error = distance(back.end(), start);
    assert!(error < 1e-11, "{error:e}");
}

/// An ellipse of eccentricity 0.9 and semi-major axis 1, turned by an angle, from its pericentre; the largest
/// error of its energy −½ within each of so many periods' ends.
///
/// Errors are those of the states, to 31 digits: evaluating T and V, which are up to 10, would add 10⁻¹⁵ of
/// its own.
fn energy_errors<const K: usize>(method: methods::Taylor, angle: f64, periods: [f64; K]) -> [f64; K] {
    let kepler = Kepler { mu: 1.0 };
    let (sin, cos) = angle.sin_cos();
    let u = 19f64.sqrt();
    let start = kepler.state().x(0.1 * cos).y(0.1 * sin).x_rate(-u * sin).y_rate(u * cos).build().unwrap();
    let exact = |state: &State<Kepler>| {
        let square = |v: [f64; 2]| Double::product(v[0], v[0]).plus(Double::product(v[1], v[1]));
        let (u, q) = (square([state.x_rate(), state.y_rate()]), square([state.x(), state.y()]));
        u.times(Double(0.5, 0.0)).minus(q.root().reciprocal())
    };
    let (before, evaluated) = (exact(&start), kepler.energy_function(&start));
    assert!((before.0 + 0.5).abs() < 1e-14, "{before:?}");
    let mut worst = [0.0f64; K];
    let period = core::f64::consts::TAU;
    let watch = |state: &State<Kepler>| {
        let error = exact(state).minus(before).0.abs();
        worst
            .iter_mut()
            .zip(periods)
            .filter(|(_, n)| state.t() <= n * period)
            .for_each(|(worst, _)| *worst = worst.max(error));
        // And as users see it.
        assert!((kepler.energy_function(state) - evaluated).abs() < error + 1e-14);
    };
    kepler
        .simulate(start)
        .until(periods[K - 1] * period)
        .tolerance(1e-15)
        .method(method)
        .run_with(watch)
        .unwrap();
    worst
}

/// |E − E₀| below 10⁻¹³ by the smallest tolerance, and below 10⁻¹³ of the energy itself, which is
/// a twentieth of what T and V go through, in the shorter steps of order 16.
///
/// What is left is the rounding of accelerations, once in each step: of twelve ellipses in other directions,
/// orders by themselves leave 1.0e-13 at most, order 16 leaves 5.6e-14.
#[test]
fn kepler_keeps_its_energy_over_a_thousand_periods() {
    let [error] = energy_errors(TAYLOR, 0.0, [1000.0]);
    assert!(error < 1e-13, "{error:e}");
    let [error] = energy_errors(methods::Taylor { order: Some(16) }, 0.0, [1000.0]);
    assert!(error < 0.5e-13, "{error:e}");
}

/// Brouwer's law: rounding errors of an integrator that loses nothing are a random walk, so that the energy
/// errs by the root of the time (Hairer, McLachlan, Razakarivony, BIT 48 (2008) 231). Without what a step's
/// sum carries to the next one they are five times as large.
#[test]
fn energy_errors_of_rounding_grow_with_the_root_of_time() {
    let method = methods::Taylor { order: Some(16) };
    let found: Vec<[f64; 2]> =
        (0..8).map(|j| energy_errors(method, 0.5 * f64::from(j), [5.0, 80.0])).collect();
    let [early, late] =
        [0, 1].map(|i| (found.iter().map(|errors| errors[i].powi(2)).sum::<f64>() / 8.0).sqrt());
    println!("5 periods {early:.2e}, 80 periods {late:.2e}");
    assert!(late < 2.5e-14, "{late:e}");
    // 4 by the root, 16 by the time.
    assert!((2.0..7.0).contains(&(late / early)), "{early:e}, {late:e}");
}

/// θ₁, θ₂ and their rates from 2π/3, −π/18 at rest as `f64` has them: extrapolation in 60 digits, in steps of
/// 1/48 and 1/64 with 24 and 20 columns, which agree to 29 digits. From the start without its rounding the
/// same computation gives the values of `references.rs`.
const PENDULUM: [(f64, [f64; 4]); 5] = [
    (
        1.0,
        [-1.517_290_485_027_184, 0.252_791_579_716_813_5, -1.984_467_696_932_936_5, -4.087_371_261_679_003],
    ),
    (
        2.0,
        [
            1.152_846_096_178_819_6,
            -0.473_076_380_641_641_65,
            -0.030_451_144_544_658_047,
            5.799_535_263_631_569,
        ],
    ),
    (
        5.0,
        [-0.440_219_745_366_661_4, 7.049_578_950_150_237, -3.521_138_978_320_225, -3.908_828_177_773_795_4],
    ),
    (
        10.0,
        [
            -0.792_596_116_598_066_7,
            -2.469_494_509_759_358_4,
            -1.975_809_881_342_966_3,
            -2.380_631_193_148_559,
        ],
    ),
    (
        20.0,
        [-0.531_738_579_409_749_2, -5.014_305_295_149_453, 4.524_457_282_235_177, 1.215_802_800_705_804_6],
    ),
];

/// A start that is off by one unit in the last place has lost 9 of 16 digits of a chaotic pendulum after 20
/// s; the series lose no more than that, at any time. The condition number is |∂y(t)/∂y(0)|, by differences
/// of motions beside it: 10, 15, 530, 7·10⁴ and 8·10⁸.
#[test]
fn pendulum_has_all_digits_that_its_condition_number_leaves() {
    let model = DoublePendulum { m1: 1.0, m2: 1.0, l1: 1.0, l2: 1.0, g: 9.8 };
    let pi = core::f64::consts::PI;
    let start = |off: [f64; 4]| {
        let state = model.state().theta1(2.0 * pi / 3.0 + off[0]).theta2(-pi / 18.0 + off[1]);
        state.theta1_rate(off[2]).theta2_rate(off[3]).build().unwrap()
    };
    let run = |off, until: f64, method| {
        model.simulate(start(off)).until(until).tolerance(1e-15).method(method).run().unwrap()
    };
    let values = |state: State<DoublePendulum>| {
        [state.theta1(), state.theta2(), state.theta1_rate(), state.theta2_rate()]
    };
    let apart = |a: [f64; 4], b: [f64; 4]| a.iter().zip(b).map(|(a, b)| (a - b).powi(2)).sum::<f64>().sqrt();
    let off = 1e-12;
    let beside: [_; 4] = core::array::from_fn(|i| {
        [off, -off].map(|off| run(core::array::from_fn(|j| if i == j { off } else { 0.0 }), 20.0, TAYLOR))
    });
    for (t, exact) in PENDULUM {
        let column = |[more, less]: &[Motion<DoublePendulum>; 2]| {
            apart(values(more.at(t)), values(less.at(t))) / (2.0 * off)
        };
        let condition = beside.iter().map(|pair| column(pair).powi(2)).sum::<f64>().sqrt();
        for (method, units) in [(TAYLOR, 1.5), (methods::Taylor { order: Some(16) }, 1.0)] {
            let error = apart(values(run([0.0; 4], t, method).end()), exact);
            println!("t = {t}: condition number {condition:.1e}, error {error:.1e}");
            assert!(
                error < units * condition * f64::EPSILON,
                "{method:?}, t = {t}: {error:e}, condition {condition:e}"
            );
        }
    }
}

#[test]
fn free_fall_is_exact_in_few_steps() {
    let block = Block { mass: 2.0, stiffness: 0.0, friction: 0.0 };
    let start = block.state().s(1.0).s_rate(3.0).build().unwrap();
    let motion = block.simulate(start).until(10.0).tolerance(1e-12).method(TAYLOR).run().unwrap();
    assert!((motion.end().s() - 31.0).abs() < 1e-13);
    assert!(motion.counts().steps < 30, "{}", motion.verify());
}

#[test]
fn a_branch_that_changes_within_a_step_is_not_passed() {
    // With friction F = μ and spring k every half period moves the centre by μ/k to the other side: s → −s +
    // 2μ/k.
    let block = Block { mass: 1.0, stiffness: 4.0, friction: 0.3 };
    let start = block.state().s(1.0).build().unwrap();
    // Three half periods of π/2, ended before the next turn: 1 → −0.85 → 0.7 → −0.55 at the turns.
    let end = 2.5 * core::f64::consts::FRAC_PI_2;
    for tolerance in [1e-6, 1e-9] {
        let motion = block.simulate(start).until(end).tolerance(tolerance).method(TAYLOR).run().unwrap();
        // From 0.7 about the centre 0.075, a quarter of a period later: there.
        let error = (motion.end().s() - 0.075).abs();
        assert!(error < 1e3 * tolerance, "{tolerance:e}: {error:e}\n{}", motion.verify());
    }
}

/// A ball above an elastic floor, Hertz's law.
#[derive(Clone, Debug, Dynamics)]
#[coordinates(x)]
struct Hertz {
    stiffness: f64,
}

#[dynamics]
impl Hertz {
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * q.x.dt().powi(2)
    }
    #[potential]
    fn gravity(&self, q: &Coordinates<Self>) -> Expr {
        9.81 * q.x
    }
    #[force]
    fn floor(&self, q: &Coordinates<Self>) -> Force {
        Force::along(q.x, self.stiffness * (-q.x).max(0.0).powf(1.5))
    }
}

/// A power of what stays zero is zero: out of contact the series is that of the fall.
#[test]
fn what_stays_zero_has_powers() {
    let model = Hertz { stiffness: 1e4 };
    let start = model.state().x(0.5).build().unwrap();
    let motion = model.simulate(start).until(0.3).tolerance(1e-12).method(TAYLOR).run().unwrap();
    let error = (motion.end().x() - (0.5 - 0.5 * 9.81 * 0.09)).abs();
    assert!(error < 1e-13, "{error:e}");
}

#[test]
fn time_and_held_inputs_are_expanded_laws_are_refused() {
    let model = Driven { mass: 1.0, stiffness: 4.0, omega: 1.3 };
    let start = model.state().s(0.2).push(0.7).build().unwrap();
    let run = |tolerance| model.simulate(start).until(20.0).tolerance(tolerance);
    let truth = run(1e-14).run().unwrap();
    let motion = run(1e-12).method(TAYLOR).run().unwrap();
    let error = distance(motion.end(), truth.end());
    assert!(error < 1e-10, "{error:e}");
    assert!(motion.work().closure_error.abs() < 1e-9, "{}", motion.work());
    let refused = run(1e-9).inputs(|t, _| [t.sin()]).method(TAYLOR).run().unwrap_err();
    let words = refused.to_string();
    assert!(
        words.contains("its inputs follow a closure") && words.contains("change them at events"),
        "{words}"
    );
    assert!(words.contains("into the model by `q.t`"), "{words}");
}

/// What the error says to do with an inputs law: the same push as an expression of time, or in steps that
/// events make, each beside the closure.
#[test]
fn what_a_refused_law_is_told_works() {
    let law = |t: f64| 0.7 * (0.9 * t).sin();
    let model = Driven { mass: 1.0, stiffness: 4.0, omega: 1.3 };
    let truth = model.simulate(model.state().s(0.2).build().unwrap()).until(20.0).tolerance(1e-13);
    let truth = truth.inputs(move |t, _| [law(t)]).run().unwrap();
    let written = Written { mass: 1.0, stiffness: 4.0, omega: 1.3, push: 0.7, pace: 0.9 };
    let motion = written.simulate(written.state().s(0.2).build().unwrap()).until(20.0).tolerance(1e-12);
    let motion = motion.method(TAYLOR).run().unwrap();
    let error = (motion.end().s() - truth.end().s()).abs();
    assert!(error < 1e-10, "{error:e}");

    let steps = |t: f64| if t < 1.0 { 0.7 } else { -0.4 };
    let stepwise =
        model.simulate(model.state().s(0.2).push(0.7).build().unwrap()).until(3.0).tolerance(1e-12);
    let switch = move |state: &mut State<Driven>| state.inputs_mut()[0] = steps(1.5);
    let stepwise =
        stepwise.event("late", |state| state.t() - 1.0).on_event("late", Direction::Rising, switch);
    let stepwise = stepwise.method(TAYLOR).run().unwrap();
    let held = |start, from: f64, to: f64| {
        let motion =
            model.simulate(start).until(to).tolerance(1e-13).inputs(move |_, _| [steps(from)]).run().unwrap();
        motion.end()
    };
    let truth = held(held(model.state().s(0.2).push(0.7).build().unwrap(), 0.5, 1.0), 1.5, 3.0);
    let error = (stepwise.end().s() - truth.s()).abs();
    assert!(error < 1e-10, "{error:e}");
}

#[test]
fn inputs_that_an_event_changes_are_those_of_the_next_series() {
    let model = Driven { mass: 1.0, stiffness: 4.0, omega: 1.3 };
    let start = model.state().s(0.2).push(0.7).build().unwrap();
    let run = |tolerance| {
        let switch = |state: &mut State<Driven>| state.inputs_mut()[0] = -0.7;
        let simulation = model.simulate(start).until(6.0).tolerance(tolerance);
        simulation.event("late", |state| state.t() - 2.0).on_event("late", Direction::Rising, switch)
    };
    let truth = run(1e-13).run().unwrap();
    for fixed in [false, true] {
        let simulation = run(1e-12).method(TAYLOR);
        let motion = if fixed {
            let switch = |state: &mut State<Driven>| state.inputs_mut()[0] = -0.7;
            let simulation = model.simulate(start).until(6.0).fixed_step(0.05);
            let simulation = simulation.event("late", |state| state.t() - 2.0);
            simulation
                .on_event("late", Direction::Rising, switch)
                .method(methods::Taylor { order: Some(20) })
                .run()
        } else {
            simulation.run()
        };
        let error = distance(motion.unwrap().end(), truth.end());
        assert!(error < 1e-10, "{error:e}");
    }
}

#[test]
fn models_without_series_say_why() {
    let height = CubicSpline::natural(&[0.0, 1.0, 2.0, 3.0], &[1.0, 0.0, 0.5, 1.0]).unwrap();
    let bead = Bead { height };
    let start = bead.state().s(0.5).build().unwrap();
    let refused = bead.simulate(start).until(1.0).method(TAYLOR).run().unwrap_err();
    assert!(
        refused.to_string().contains("`height` is known by its value and three derivatives only"),
        "{refused}"
    );
}

#[test]
fn stiffness_is_reported() {
    // A pendulum on a very stiff, damped spring: after the fast motion has died stability bounds the step.
    let model = Stiff { stiffness: 1e6, damping: 2e3 };
    let start = model.state().x(1.0).build().unwrap();
    let motion = model.simulate(start).until(1.0).tolerance(1e-6).method(TAYLOR).run().unwrap();
    assert!(motion.verify().to_string().contains("stiff"), "{}", motion.verify());
}

/// A bob on a spring.
#[derive(Clone, Debug, Dynamics)]
#[coordinates(x, y)]
struct Stiff {
    stiffness: f64,
    damping: f64,
}

#[dynamics]
impl Stiff {
    fn length(&self, q: &Coordinates<Self>) -> Expr {
        vec2(q.x, q.y).norm()
    }
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * vec2(q.x, q.y).dt().norm_squared()
    }
    #[potential]
    fn energy(&self, q: &Coordinates<Self>) -> Expr {
        9.81 * q.y + 0.5 * self.stiffness * (self.length(q) - 1.0).powi(2)
    }
    #[dissipation]
    fn damper(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * self.damping * self.length(q).dt().powi(2)
    }
}

#[test]
fn series_begin_at_their_own_state_whatever_their_memory_holds() {
    type Place = <DoublePendulum as Model>::Vector;
    let constants = DP.constants().expect("masses are positive");
    let state = |theta1: f64, rate: f64| {
        DP.state().theta1(theta1).theta2(1.0).theta1_rate(rate).build().expect("complete")
    };
    let series = |at: &State<DoublePendulum>, memory: &mut <DoublePendulum as Dynamics>::Series| {
        let a = DP.accelerations_with(&constants, at).expect("regular");
        let (mut q, mut u) = ([Place::zeros(); 21], [Place::zeros(); 21]);
        (q[0], u[0]) = (*at.q(), *at.u());
        assert!(DP.series(&constants, at, &a, 0.05, [&mut q, &mut u], memory));
        (q, u)
    };
    let [here, there] = [state(1.5, 0.3), state(-0.4, 2.0)];
    let fresh = series(&here, &mut Default::default());
    assert_ne!(fresh, series(&there, &mut Default::default()));
    // Begun here, there, and here again with what longer series left behind.
    let mut memory = Default::default();
    let begun = DP.begin_series(&constants, &here, &mut memory).expect("regular");
    let a = DP.accelerations_with(&constants, &here).expect("regular");
    assert!((begun - a).norm() <= 4.0 * f64::EPSILON * a.norm(), "{begun} and {a}");
    assert_eq!(series(&here, &mut memory), fresh);
    series(&there, &mut memory);
    assert_eq!(series(&here, &mut memory), fresh);
    DP.begin_series(&constants, &there, &mut memory).expect("regular");
    assert_eq!(series(&here, &mut memory), fresh);
}
