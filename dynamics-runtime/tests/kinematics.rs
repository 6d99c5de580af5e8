//! Driven mechanisms against closed forms; singular positions located, named and classified.

use crate::common;

use std::f64::consts::{FRAC_PI_2, PI, TAU};

use common::at_rest_or_not;
use common::by_jets::{JetState, Jets, Mechanism, holonomic};
use dynamics_runtime::Expr;
use dynamics_runtime::error::StateError;
use dynamics_runtime::kinematics::{KinematicsError, KinematicsErrorKind as Kind};
use dynamics_runtime::mechanism::Mechanism as _;
use dynamics_runtime::model::{Constraint, Constraints, Model};
use dynamics_runtime::simulate::OptionError;
use proptest::prelude::*;

fn state<const N: usize>(q: [f64; N]) -> JetState<N> {
    at_rest_or_not(q, [0.0; N])
}

fn failed<T, M: Model>(result: Result<T, KinematicsError<M>>) -> KinematicsError<M> {
    match result {
        Ok(_) => panic!("went through"),
        Err(error) => error,
    }
}

/// A slider-crank in coordinates of all bodies: crank angle, rod's centre and angle, slider. The crank turns
/// with ω; a force pushes the slider.
struct SliderCrank {
    crank: f64,
    rod: f64,
    omega: f64,
    push: f64,
}

impl Mechanism<5, 5> for SliderCrank {
    const COORDINATES: [&'static str; 5] = ["crank", "x", "y", "rod", "slider"];
    const CONSTRAINTS: &'static [Constraint] =
        &[holonomic("pin", 0, 2), holonomic("guide", 2, 2), holonomic("drive", 4, 1)];
    const ROWS: [&'static str; 5] = ["pin.x", "pin.y", "guide.x", "guide.y", "drive"];
    fn rows(&self, q: &[Expr; 5], t: Expr) -> [Expr; 5] {
        let half = 0.5 * self.rod;
        [
            q[1] - half * q[3].cos() - self.crank * q[0].cos(),
            q[2] - half * q[3].sin() - self.crank * q[0].sin(),
            q[1] + half * q[3].cos() - q[4],
            q[2] + half * q[3].sin(),
            q[0] - self.omega * t,
        ]
    }
    fn inertia(&self) -> [f64; 5] {
        [0.02, 0.5, 0.5, 0.01, 0.8]
    }
    fn potential(&self, q: &[f64; 5]) -> (f64, [f64; 5]) {
        (-self.push * q[4], [0.0, 0.0, 0.0, 0.0, self.push])
    }
}

/// x, ẋ, ẍ of the slider in closed form.
fn slider(model: &SliderCrank, t: f64) -> [f64; 3] {
    let SliderCrank { crank: r, rod: l, omega: w, .. } = *model;
    let (s, c) = (w * t).sin_cos();
    let root = (l * l - r * r * s * s).sqrt();
    let x = r * c + root;
    let v = -r * w * s - r * r * w * s * c / root;
    let a = -r * w * w * c - r * r * w * w * ((c * c - s * s) / root + r * r * s * s * c * c / root.powi(3));
    [x, v, a]
}

#[test]
fn a_slider_crank_moves_as_in_closed_form_and_its_torque_does_the_work() {
    let model = Jets(SliderCrank { crank: 0.3, rod: 1.0, omega: 2.0, push: -7.0 });
    let motion =
        model.kinematics(state([0.1, 0.7, 0.2, -0.2, 1.2])).until(3.0 * PI).every(0.01).run().unwrap();
    assert!((motion.end_time() - 3.0 * PI).abs() < 1e-15);
    let mut last = None;
    let mut work = 0.0;
    for now in motion.states() {
        let [x, v, a] = slider(&model.0, now.t);
        let accelerations = motion.accelerations_of(&now);
        assert!((now.q[4] - x).abs() < 1e-14, "{} {x}", now.q[4]);
        assert!((now.u[4] - v).abs() < 1e-14 && (accelerations[4] - a).abs() < 1e-13);
        assert!(model.residual(&now).amax() < 1e-15 && model.velocity_residual(&now).amax() < 1e-14);
        // Virtual work: torque·ω = dT/dt − push·v.
        let power: f64 = (0..5).map(|i| model.0.inertia()[i] * now.u[i] * accelerations[i]).sum();
        let torque = motion.reaction_of("drive", &now).unwrap()[0];
        assert!((torque * 2.0 - (power + 7.0 * v)).abs() < 1e-13, "{torque}");
        if let Some((t, p)) = last {
            work += 0.5 * (now.t - t) * (torque * 2.0 + p);
        }
        last = Some((now.t, torque * 2.0));
    }
    // By the account of works, an independent quadrature: it closes, and agrees with the trapezoidal sum to
    // its accuracy.
    let account = motion.work();
    assert!(account.closure_error.abs() < 1e-12 * account.scale, "{account}");
    assert!((account.forces[0].work - work).abs() < 1e-3);
    let summary = motion.summary();
    assert!(summary.corrections < 4 * (summary.steps + summary.rejected), "{summary}");
    assert!(summary.steps < 400 && summary.passages.is_empty(), "{summary}");
    assert!(motion.energy_errors().iter().all(|(_, error)| error.abs() < 1e-12));
}

/// A four-bar with its angles; the crank turns with rate 1 from an angle.
#[derive(Clone, Copy, Debug)]
struct FourBar {
    ground: f64,
    crank: f64,
    coupler: f64,
    rocker: f64,
}

impl Mechanism<3, 3> for FourBar {
    const COORDINATES: [&'static str; 3] = ["crank", "coupler", "rocker"];
    const CONSTRAINTS: &'static [Constraint] = &[holonomic("loop", 0, 2), holonomic("drive", 2, 1)];
    const ROWS: [&'static str; 3] = ["loop.x", "loop.y", "drive"];
    fn rows(&self, q: &[Expr; 3], t: Expr) -> [Expr; 3] {
        [
            self.crank * q[0].cos() + self.coupler * q[1].cos() - self.rocker * q[2].cos() - self.ground,
            self.crank * q[0].sin() + self.coupler * q[1].sin() - self.rocker * q[2].sin(),
            q[0] - t,
        ]
    }
    fn inertia(&self) -> [f64; 3] {
        [0.1, 0.3, 0.2]
    }
}

/// Angle of the rocker by Freudenstein's equation.
fn freudenstein(bar: &FourBar, crank: f64, branch: f64) -> f64 {
    let FourBar { ground: g, crank: a, coupler: b, rocker: c } = *bar;
    let (x, y) = (a * crank.cos() - g, a * crank.sin());
    let k = (x * x + y * y + c * c - b * b) / (2.0 * c);
    y.atan2(x) + branch * (k / x.hypot(y)).acos()
}

fn wrapped(angle: f64) -> f64 {
    angle.sin().atan2(angle.cos())
}

#[test]
fn a_four_bar_keeps_its_branch_over_many_turns() {
    let bar = FourBar { ground: 4.0, crank: 1.0, coupler: 3.5, rocker: 3.0 };
    let model = Jets(bar);
    for branch in [1.0, -1.0] {
        let rocker = freudenstein(&bar, 0.0, branch);
        let motion =
            model.kinematics(state([0.0, 0.0, rocker + 0.2])).until(10.0 * TAU).every(0.1).run().unwrap();
        for now in motion.states() {
            assert!(wrapped(now.q[2] - freudenstein(&bar, now.t, branch)).abs() < 1e-13);
            // Velocity ratio by the instant centres: φ̇/θ̇ = a sin(θ − ψ) / (c sin(φ − ψ)).
            let ratio = (now.t - now.q[1]).sin() / (3.0 * (now.q[2] - now.q[1]).sin());
            assert!((now.u[2] - ratio).abs() < 1e-13);
        }
        let [start, end] = [motion.start(), motion.end()];
        assert!((start.q[2] - end.q[2]).abs() < 1e-12, "the rocker rocks");
    }
    // Backwards is the same way.
    let there = model.kinematics(state([0.0, 0.5, 2.0])).until(5.0).run().unwrap();
    let back = model.kinematics(there.end()).until(0.0).run().unwrap();
    assert!((back.end().q - there.start().q).amax() < 1e-13);
}

/// Whitworth's quick return: the crank's pin slides in a slotted lever about another pivot, at a distance
/// below.
struct QuickReturn {
    crank: f64,
    distance: f64,
}

impl Mechanism<3, 3> for QuickReturn {
    const COORDINATES: [&'static str; 3] = ["crank", "lever", "slide"];
    const CONSTRAINTS: &'static [Constraint] = &[holonomic("pin", 0, 2), holonomic("drive", 2, 1)];
    const ROWS: [&'static str; 3] = ["pin.x", "pin.y", "drive"];
    fn rows(&self, q: &[Expr; 3], t: Expr) -> [Expr; 3] {
        [
            self.crank * q[0].cos() - q[2] * q[1].cos(),
            self.distance + self.crank * q[0].sin() - q[2] * q[1].sin(),
            q[0] - t,
        ]
    }
}

#[test]
fn a_quick_return_returns_quickly() {
    let quick = QuickReturn { crank: 1.0, distance: 2.0 };
    let model = Jets(quick);
    let motion = model.kinematics(state([0.0, 1.0, 2.0])).until(TAU).every(TAU / 360.0).run().unwrap();
    for now in motion.states() {
        let (s, c) = now.t.sin_cos();
        assert!((now.q[1] - (2.0 + s).atan2(c)).abs() < 1e-14);
        assert!((now.q[2] - (5.0 + 4.0 * s).sqrt()).abs() < 1e-14);
        assert!((now.u[1] - (1.0 + 2.0 * s) / (5.0 + 4.0 * s)).abs() < 1e-14);
    }
    // The lever turns round where sin θ = −½: 240° there, 120° back.
    let forth = motion.states().filter(|now| now.u[1] > 1e-9).count() as f64;
    assert!((forth / 360.0 - 240.0 / 360.0).abs() < 0.01);
}

#[test]
fn lock_up_of_a_four_bar_is_located() {
    // Ground 3, crank 2, coupler 1.5, rocker 1.5: the crank reaches no further than coupler and rocker in
    // line.
    let bar = FourBar { ground: 3.0, crank: 2.0, coupler: 1.5, rocker: 1.5 };
    let exact = ((4.0 + 9.0 - 9.0) / 12.0f64).acos();
    let model = Jets(bar);
    for branch in [1.0, -1.0] {
        let start = state([0.0, -branch * 0.9, freudenstein(&bar, 0.0, branch)]);
        for (end, at) in [(3.0, exact), (-3.0, -exact)] {
            let error = failed(model.kinematics(start).until(end).run());
            assert!((error.time - at).abs() < 1e-12, "{:e}", error.time - at);
            let Kind::LockUp { rows, coordinates } = &error.kind else { panic!("{error}") };
            assert!(rows.contains("loop.x") || rows.contains("loop.y"), "{rows}");
            let mut names: Vec<_> = coordinates.names().collect();
            names.sort_unstable();
            assert_eq!(names, ["coupler", "rocker"]);
            // Coupler and rocker are in line there, and what was computed is kept.
            assert!((error.state.q[1] - error.state.q[2]).sin().abs() < 1e-11);
            let motion = error.motion(&model).unwrap();
            assert!((motion.end_time() - at).abs() < 0.1 && motion.end_time().abs() < at.abs());
            assert!(wrapped(motion.end().q[2] - freudenstein(&bar, motion.end_time(), branch)).abs() < 1e-9);
            assert!(error.to_string().contains("locks up"), "{error}");
        }
    }
}

const PARALLELOGRAM: FourBar = FourBar { ground: 3.0, crank: 1.0, coupler: 3.0, rocker: 1.0 };

#[test]
fn the_change_point_of_a_parallelogram_is_a_bifurcation() {
    let model = Jets(PARALLELOGRAM);
    // As a parallelogram and as an antiparallelogram.
    let crossed = freudenstein(&PARALLELOGRAM, 1.0, 1.0);
    let crossed =
        if wrapped(crossed - 1.0).abs() < 1e-6 { freudenstein(&PARALLELOGRAM, 1.0, -1.0) } else { crossed };
    let guesses = [
        [1.0, 0.0, 1.0],
        [1.0, (crossed.sin() - 1f64.sin()).atan2(3.0 + crossed.cos() - 1f64.cos()), crossed],
    ];
    for guess in guesses {
        let mut start = state(guess);
        start.t = 1.0;
        let error = failed(model.kinematics(start).until(10.0).run());
        let Kind::Bifurcation { loss: 1, coordinates, .. } = &error.kind else { panic!("{error}") };
        assert!((error.time - PI).abs() < 1e-10, "{:e}", error.time - PI);
        assert!(coordinates.contains("rocker"), "{coordinates}");
        assert!(error.state.q[2].sin().abs() < 1e-9);
    }
}

#[test]
fn a_change_point_is_passed_smoothly_where_that_is_asked_for() {
    let model = Jets(PARALLELOGRAM);
    let mut start = state([1.0, 0.0, 1.0]);
    start.t = 1.0;
    let motion =
        model.kinematics(start).until(1.0 + 2.0 * TAU).every(0.05).through_bifurcations().run().unwrap();
    let passages = &motion.summary().passages;
    assert_eq!(passages.len(), 4);
    for (k, passage) in passages.iter().enumerate() {
        assert!(
            (passage.time - PI * (k + 1) as f64).abs() < 1e-10,
            "{:e}",
            passage.time - PI * (k + 1) as f64
        );
    }
    for now in motion.states() {
        assert!((now.q[2] - now.t).abs() < 1e-9 && now.q[1].abs() < 1e-9, "{now:?}");
    }
    assert!(motion.summary().to_string().contains("could go either way"));
    // Slider-crank with equal lengths: at 90° the rod may stay behind with the slider.
    let model = Jets(SliderCrank { crank: 1.0, rod: 1.0, omega: 1.0, push: 0.0 });
    let guess = state([0.0, 1.5, 0.0, 0.0, 2.0]);
    let error = failed(model.kinematics(guess).until(2.0).run());
    let Kind::Bifurcation { .. } = &error.kind else { panic!("{error}") };
    assert!((error.time - FRAC_PI_2).abs() < 1e-10);
    let motion = model.kinematics(guess).until(2.0).through_bifurcations().run().unwrap();
    assert!((motion.end().q[4] - 2.0 * 2f64.cos()).abs() < 1e-10);
}

#[test]
fn freedom_is_an_error_that_counts_it() {
    struct Free;
    impl Mechanism<3, 2> for Free {
        const COORDINATES: [&'static str; 3] = ["crank", "coupler", "rocker"];
        const CONSTRAINTS: &'static [Constraint] = &[holonomic("loop", 0, 2)];
        const ROWS: [&'static str; 2] = ["loop.x", "loop.y"];
        fn rows(&self, q: &[Expr; 3], t: Expr) -> [Expr; 2] {
            let [x, y, _] = FourBar { ground: 4.0, crank: 1.0, coupler: 3.5, rocker: 3.0 }.rows(q, t);
            [x, y]
        }
    }
    let error = failed(Jets(Free).kinematics(state([1.0, 0.5, 1.5])).until(1.0).run());
    let Kind::Freedom { degrees: 1, coordinates, .. } = &error.kind else { panic!("{error}") };
    assert!(coordinates.count() == 3 && error.to_string().contains("leave 1 degree of freedom"), "{error}");
    assert!(error.motion(&Jets(Free)).is_none());
    let pendulum = common::Pendulum { m: 1.0, l: 1.0, g: 9.81 };
    let error = failed(pendulum.kinematics(state([0.1])).until(1.0).run());
    assert!(matches!(error.kind, Kind::Freedom { degrees: 1, .. }), "{error}");
}

#[test]
fn starts_that_are_none_say_so() {
    // Out of reach.
    let far = Jets(FourBar { ground: 9.0, crank: 1.0, coupler: 3.0, rocker: 3.0 });
    let error = failed(far.kinematics(state([0.0, 0.2, 2.9])).until(1.0).run());
    assert!(matches!(error.kind, Kind::Start(StateError::NotAssembled { .. })), "{error}");
    // At a change point.
    let error = failed(Jets(PARALLELOGRAM).kinematics(state([0.0; 3])).until(1.0).run());
    assert!(matches!(&error.kind, Kind::SingularStart { .. }), "{error}");
    // Not a number; no end.
    let model = Jets(PARALLELOGRAM);
    let error = failed(model.kinematics(state([f64::NAN, 0.0, 0.0])).until(1.0).run());
    assert!(matches!(error.kind, Kind::Start(StateError::NotFinite { .. })), "{error}");
    assert!(matches!(failed(model.kinematics(state([0.0; 3])).run()).kind, Kind::Option(_)));
}

#[test]
fn a_drive_that_jumps_is_an_error_there() {
    struct Jump;
    impl Mechanism<1, 1> for Jump {
        const COORDINATES: [&'static str; 1] = ["x"];
        const CONSTRAINTS: &'static [Constraint] = &[holonomic("drive", 0, 1)];
        const ROWS: [&'static str; 1] = ["drive"];
        fn rows(&self, q: &[Expr; 1], t: Expr) -> [Expr; 1] {
            [q[0] - (t - 0.7).signum()]
        }
    }
    let error = failed(Jets(Jump).kinematics(state([0.0])).until(2.0).run());
    assert!(matches!(error.kind, Kind::NoContinuation { row: "drive", .. }), "{error}");
    assert!((error.time - 0.7).abs() < 1e-12);
}

/// Two parallelograms side by side on one crank: at the change point the rank falls by two; redundant rows
/// beside it.
struct Double;

impl Mechanism<5, 6> for Double {
    const COORDINATES: [&'static str; 5] = ["crank", "coupler1", "rocker1", "coupler2", "rocker2"];
    const CONSTRAINTS: &'static [Constraint] = &[
        holonomic("first", 0, 2),
        holonomic("second", 2, 2),
        holonomic("drive", 4, 1),
        holonomic("again", 5, 1),
    ];
    const ROWS: [&'static str; 6] = ["first.x", "first.y", "second.x", "second.y", "drive", "again"];
    fn rows(&self, q: &[Expr; 5], t: Expr) -> [Expr; 6] {
        [
            q[0].cos() + 3.0 * q[1].cos() - q[2].cos() - 3.0,
            q[0].sin() + 3.0 * q[1].sin() - q[2].sin(),
            q[2].cos() + 2.0 * q[3].cos() - q[4].cos() - 2.0,
            q[2].sin() + 2.0 * q[3].sin() - q[4].sin(),
            q[0] - t,
            2.0 * q[0] - 2.0 * t,
        ]
    }
}

#[test]
fn intervals_may_come_before_the_end_and_what_gives_no_states_is_refused() {
    let model = Jets(QuickReturn { crank: 1.0, distance: 2.0 });
    let open = || model.kinematics(state([0.0, 1.0, 2.0]));
    let motion = open().intervals(4).until(2.0).run().unwrap();
    assert!(motion.states().map(|state| state.t).eq([0.0, 0.5, 1.0, 1.5, 2.0]));
    let refused = [
        ("intervals", open().until(2.0).intervals(0)),
        ("every", open().until(2.0).every(f64::INFINITY)),
        ("every", open().until(2.0).every(f64::NAN)),
        ("every", open().until(2.0).every(1e-9)),
    ];
    for (wanted, analysis) in refused {
        let error = failed(analysis.run());
        assert!(
            matches!(error.kind, Kind::Option(OptionError::Number { option, .. }) if option == wanted),
            "{error}"
        );
    }
}

#[test]
fn repeated_rows_do_no_harm_and_a_loss_of_two_ranks_is_seen() {
    let mut start = state([1.0, 0.0, 1.0, 0.0, 1.0]);
    start.t = 1.0;
    let model = Jets(Double);
    let motion = model.kinematics(start).until(3.0).run().unwrap();
    assert!((motion.end().q[4] - 3.0).abs() < 1e-13);
    let error = failed(model.kinematics(start).until(10.0).run());
    let Kind::Bifurcation { loss: 2, tried: false, .. } = &error.kind else { panic!("{error}") };
    assert!((error.time - PI).abs() < 1e-8, "{:e}", error.time - PI);
    // Four branches meet, and on one of them velocities are continuous.
    let motion = model.kinematics(start).until(10.0).through_bifurcations().run().unwrap();
    assert_eq!(motion.summary().passages.len(), 3, "{}", motion.summary());
    for now in motion.states() {
        assert!((now.q[2] - now.t).abs() < 1e-9 && (now.q[4] - now.t).abs() < 1e-9, "{now:?}");
    }
}

/// A pantograph: the tracer, driven round a circle, stands at the ends of the first and third of four equal
/// arms. Where the circle goes through the pivot all arms come into one line.
struct Pantograph {
    center: f64,
}

impl Mechanism<4, 4> for Pantograph {
    const COORDINATES: [&'static str; 4] = ["a", "b", "c", "d"];
    const CONSTRAINTS: &'static [Constraint] = &[holonomic("close", 0, 2), holonomic("drive", 2, 2)];
    const ROWS: [&'static str; 4] = ["close.x", "close.y", "drive.x", "drive.y"];
    fn rows(&self, q: &[Expr; 4], t: Expr) -> [Expr; 4] {
        let [a, b, c, d] = q.map(|q| [0.5 * q.cos(), 0.5 * q.sin()]);
        let circle = [self.center + 0.2 * (3.0 * t).cos(), 0.2 * (3.0 * t).sin()];
        let close = |i: usize| c[i] - a[i] - b[i] - d[i];
        let drive = |i: usize| a[i] + c[i] - circle[i];
        [close(0), close(1), drive(0), drive(1)]
    }
}

impl Pantograph {
    /// a and c from the place of the tracer: its direction, and by how much the arms are apart. The direction
    /// is followed without jumps.
    fn arms(&self, t: f64) -> [f64; 2] {
        let (x, y) = (self.center + 0.2 * (3.0 * t).cos(), 0.2 * (3.0 * t).sin());
        // Turning in time with the circle where that goes round the pivot; half as fast on average where it
        // passes beside it.
        let turns = if self.center < 0.2 { ((3.0 * t + PI) / TAU).floor() } else { 0.0 };
        let direction = y.atan2(x) + turns * TAU;
        let apart = x.hypot(y).acos();
        [direction + apart, direction - apart]
    }
}

#[test]
fn a_pantograph_goes_through_its_pivot_and_past_it() {
    let start = state([1.3, -1.3, -1.3, 1.3 + PI]);
    let through = Jets(Pantograph { center: 0.2 });
    let error = failed(through.kinematics(start).until(5.0).run());
    let Kind::Bifurcation { loss: 2, .. } = &error.kind else { panic!("{error}") };
    assert!((error.time - PI / 3.0).abs() < 1e-8, "{error}");
    let motion = through.kinematics(start).until(5.0).every(0.01).through_bifurcations().run().unwrap();
    assert_eq!(motion.summary().passages.len(), 2, "{}", motion.summary());
    for now in motion.states() {
        // At the pivot the direction turns round, and the arms swing through each other: the mean of a and c
        // goes on with 3/2.
        let half = 1.5 * now.t;
        let apart = (0.4 * half.cos()).acos();
        assert!((now.q[0] - half - apart).abs() < 1e-7 && (now.q[2] - half + apart).abs() < 1e-7, "{now:?}");
    }
    // The arms are in line but for the square of the distance, and that is to be seen: nearer than about 1e-8
    // rounding hides it.
    for beside in [1e-9, 1e-5, 1e-3, -1e-9, -1e-4] {
        let model = Jets(Pantograph { center: 0.2 + beside });
        let motion = match model.kinematics(start).until(5.0).every(0.01).through_bifurcations().run() {
            Ok(motion) => motion,
            Err(error) if beside.abs() < 1e-8 => {
                assert!((error.time - PI / 3.0).abs() < 1e-6, "{beside:e}: {error}");
                continue;
            }
            Err(error) => panic!("{beside:e}: {error}"),
        };
        assert!(motion.summary().passages.is_empty(), "{beside:e}: {}", motion.summary());
        for now in motion.states() {
            let [a, c] = model.0.arms(now.t);
            let error = (now.q[0] - a).abs().max((now.q[2] - c).abs());
            assert!(error < 1e-13 / beside.abs() + 1e-13, "{beside:e} at {}: {error:e}", now.t);
        }
    }
}

proptest! {
    #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::default() })]
    /// Any four-bar over a turn: it goes round where Grashof says so, and else locks up where the triangle of
    /// its links closes.
    #[test]
    fn four_bars_go_round_or_lock_up_where_they_must(links in proptest::array::uniform4(0.5f64..3.0)) {
        let [ground, crank, coupler, rocker] = links;
        let bar = FourBar { ground, crank, coupler, rocker };
        // Reach: |b − c| ≤ distance from the crank's pin to the rocker's pivot ≤ b + c.
        let distance = |t: f64| (crank * crank + ground * ground - 2.0 * crank * ground * t.cos()).sqrt();
        let limit = |reach: f64| {
            let cos = (crank * crank + ground * ground - reach * reach) / (2.0 * crank * ground);
            (cos.abs() < 1.0).then(|| cos.acos())
        };
        let (near, far) = ((coupler - rocker).abs(), coupler + rocker);
        // Some angle well inside the range, if there is one.
        let inside = (1..=180).map(|k| f64::from(k) * PI / 180.0).find(|t| {
            let d = distance(*t);
            d > near + 0.05 && d < far - 0.05
        });
        prop_assume!(inside.is_some());
        // Change points within rounding are another test's.
        let margin = |d: f64, reach: f64| (d - reach).abs() > 1e-3;
        for d in [distance(0.0), distance(PI)] {
            prop_assume!(margin(d, near) && margin(d, far));
        }
        let t0 = inside.unwrap();
        let mut start = state([t0, 0.0, freudenstein(&bar, t0, 1.0)]);
        let rocker_end = [ground + rocker * start.q[2].cos(), rocker * start.q[2].sin()];
        start.q[1] = (rocker_end[1] - crank * t0.sin()).atan2(rocker_end[0] - crank * t0.cos());
        start.t = t0;
        // The first limit after t0, in 0..2π: at ±acos.
        let limits =
            [limit(near), limit(far)].into_iter().flatten()
            .flat_map(|a| [a, TAU - a, TAU + a, 2.0 * TAU - a]);
        let first = limits.filter(|a| *a > t0).fold(f64::INFINITY, f64::min);
        let model = Jets(bar);
        match model.kinematics(start).until(t0 + TAU).run() {
            Ok(motion) => {
                prop_assert!(first > t0 + TAU, "passed {first}");
                let end = motion.end();
                prop_assert!(wrapped(end.q[2] - freudenstein(&bar, end.t, 1.0)).abs() < 1e-10);
            }
            Err(error) => {
                prop_assert!(matches!(error.kind, Kind::LockUp { .. }), "{error}");
                prop_assert!((error.time - first).abs() < 1e-10, "{:e} {error}", error.time - first);
            }
        }
    }
}

/// So many links, each belted to the one before, the first of them driven: large enough that its matrices do
/// not belong on a stack.
const LINKS: usize = 40;

struct Belts;

impl Mechanism<LINKS, LINKS> for Belts {
    const COORDINATES: [&'static str; LINKS] = ["link"; LINKS];
    const CONSTRAINTS: &'static [Constraint] =
        &[holonomic("belts", 0, LINKS - 1), holonomic("drive", LINKS - 1, 1)];
    const ROWS: [&'static str; LINKS] = ["row"; LINKS];
    fn rows(&self, q: &[Expr; LINKS], t: Expr) -> [Expr; LINKS] {
        core::array::from_fn(|i| if i + 1 < LINKS { q[i + 1].sin() - 0.98 * q[i].sin() } else { q[0] - t })
    }
    fn by_value(&self) {
        panic!("matrices of large models are not taken by value");
    }
}

#[test]
fn matrices_of_large_mechanisms_stay_off_the_stack() {
    let model = Jets(Belts);
    let motion = model.kinematics(state([0.0; LINKS])).until(1.2).run().unwrap();
    let end = motion.end();
    let exact = |k: i32| (0.98_f64.powi(k) * 1.2_f64.sin()).asin();
    for (k, q) in (0..).zip(end.q.iter()) {
        assert!((q - exact(k)).abs() < 1e-14, "{k}: {q} {}", exact(k));
    }
}
