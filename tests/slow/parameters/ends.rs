//! Runs of which only the ends are wanted, side by side: the same motions as alone, whatever runs beside
//! them; and what ends them early or fails is reported as alone.

use dynamics::model::{Model, ModelState, Vector};
use dynamics::prelude::*;
use dynamics::simulate::{Flow, Simulation, SimulationErrorKind, ends};

use super::double_pendulum::DoublePendulum;
use super::models::{Oscillator, once};

/// A pendulum whose pivot moves, with a motor whose torque is an input.
#[derive(Clone, Debug, Dynamics)]
#[coordinates(theta: rad, x: m)]
#[inputs(torque: N * m)]
#[units(mass: kg, length: m, g: m / s^2, amplitude: m, omega: rad / s, stiffness: N / m)]
struct Driven {
    mass: f64,
    length: f64,
    g: f64,
    amplitude: f64,
    omega: f64,
    stiffness: f64,
}

#[dynamics]
impl Driven {
    fn bob(&self, q: &Coordinates<Self>) -> Vec2 {
        let pivot = self.amplitude * (self.omega * q.t).sin();
        vec2(q.x + self.length * q.theta.sin(), pivot - self.length * q.theta.cos())
    }
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * self.mass * (self.bob(q).dt().norm_squared() + 2.0 * q.x.dt().powi(2))
    }
    #[potential]
    fn potential(&self, q: &Coordinates<Self>) -> Expr {
        self.mass * self.g * self.bob(q).y + 0.5 * self.stiffness * q.x.powi(2)
    }
    #[force]
    fn motor(&self, q: &Coordinates<Self>) -> Force {
        Force::along(q.theta, q.torque)
    }
    #[dissipation]
    fn friction(&self, q: &Coordinates<Self>) -> Expr {
        0.025 * self.mass * self.bob(q).dt().norm_squared() * self.omega
    }
    #[event]
    fn upright(&self, q: &Coordinates<Self>) -> Expr {
        q.theta.cos() + 0.9
    }
}

/// A number from 0 to 1 for each index, without pattern.
fn random(index: usize) -> f64 {
    (43_758.545_3 * (12.9898 * (index as f64 + 1.0)).sin()).rem_euclid(1.0)
}

fn driven(count: usize) -> Vec<(Driven, State<Driven>)> {
    let one = |k: usize| {
        let r = |i: usize| random(10 * k + i);
        let model = Driven {
            mass: 0.5 + r(0),
            length: 0.3 + r(1),
            g: 9.81,
            amplitude: 0.2 * r(2),
            omega: 1.0 + 8.0 * r(3),
            stiffness: 5.0 + 50.0 * r(4),
        };
        let start = model.state().at_time(r(5)).theta(6.0 * r(6) - 3.0).x(r(7) - 0.5).theta_rate(2.0 * r(8));
        let start = start.torque(r(9) - 0.5).build().unwrap();
        (model, start)
    };
    (0..count).map(one).collect()
}

/// Time, q and q̇.
fn numbers<S: ModelState>(state: &S) -> Vec<f64> {
    [&[state.t()], state.q().as_slice(), state.u().as_slice()].concat()
}

fn bits<S: ModelState>(state: &S) -> Vec<u64> {
    numbers(state).into_iter().map(f64::to_bits).collect()
}

fn farthest<S: ModelState>(a: &S, b: &S) -> f64 {
    numbers(a).iter().zip(numbers(b)).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max)
}
/// Every run has its own parameters, input, start and end; a run has the same bits alone, among others, and
/// in another order; all of them agree with runs at a tighter tolerance.
#[test]
fn a_run_does_not_know_its_neighbours() {
    let points = driven(45);
    let until = |k: usize| 2.0 + 3.0 * random(7 * k);
    let run = |k: usize| {
        let (model, start) = &points[k];
        model.simulate(*start).until(until(k)).tolerance(if k.is_multiple_of(3) { 1e-11 } else { 1e-9 })
    };
    let together = ends((0..points.len()).map(run));
    let mut backwards = ends((0..points.len()).rev().map(run));
    backwards.reverse();
    for (k, end) in together.iter().enumerate() {
        let end = end.as_ref().unwrap();
        let alone = ends([run(k)]).remove(0).unwrap();
        assert_eq!(bits(end), bits(&alone), "{k}");
        assert_eq!(bits(end), bits(backwards[k].as_ref().unwrap()), "{k}");
        assert_eq!(end.t(), until(k));
        let exact = run(k).tolerance(1e-13).run_with(|_| ()).unwrap();
        assert!(farthest(end, &exact) < 3e-7, "{k}: {:e}", farthest(end, &exact));
        assert_eq!(end.torque(), points[k].1.torque());
        // Side by side runs another method, so that the last digits tell that it has.
        assert_ne!(bits(end), bits(&run(k).run_with(|_| ()).unwrap()), "{k} was made alone");
    }
}

/// The closed form, at each of several tolerances; and back to the start.
#[test]
fn errors_follow_the_tolerance() {
    let model = Oscillator::PLAIN;
    let start = |k: usize| model.state().x(0.1 + 0.05 * k as f64).x_rate(-0.2 * k as f64).build().unwrap();
    for tolerance in [1e-5, 1e-7, 1e-9, 1e-11] {
        let forth = ends((0..11).map(|k| model.simulate(start(k)).until(1.7).tolerance(tolerance)));
        let forth: Vec<_> = forth.into_iter().map(Result::unwrap).collect();
        let back = ends(forth.iter().map(|end| model.simulate(*end).until(0.0).tolerance(tolerance)));
        for (k, (end, back)) in forth.iter().zip(back).enumerate() {
            let [x, v] = [start(k).x(), start(k).x_rate()];
            let closed = Oscillator::closed([2.0, 1.2, 50.0, x, v], 1.7);
            let off = (end.x() - closed[0]).abs().max((end.x_rate() - closed[1]).abs());
            assert!(off < 100.0 * tolerance, "{tolerance:e}, {k}: {off:e}");
            assert!(farthest(&back.unwrap(), &start(k)) < 500.0 * tolerance);
        }
    }
}

/// Small motions have the digits that they have alone: the absolute tolerance follows their size.
#[test]
fn small_motions_keep_their_digits() {
    let model = Oscillator::PLAIN;
    let sizes = [1e-8, 1e-4, 1.0];
    let starts = sizes.map(|x| model.state().x(x).build().unwrap());
    let found = ends(starts.iter().map(|start| model.simulate(*start).until(3.0)));
    for (size, end) in sizes.into_iter().zip(found) {
        let [x, _] = Oscillator::closed([2.0, 1.2, 50.0, size, 0.0], 3.0);
        assert!((end.unwrap().x() - x).abs() < 1e-7 * size, "{size:e}");
    }
}

fn to_the_top<'m>(model: &'m Driven, start: &State<Driven>) -> Simulation<'m, Driven> {
    let run = model.simulate(*start).until(4.0).tolerance(1e-10);
    run.stop_at("upright", Direction::Falling)
        .event("right", |state| state.x() - 0.45)
        .stop_at("right", Direction::Rising)
}

/// The first crossing ends a run where it ends alone, whether the model or the run has the function.
#[test]
fn events_end_runs_as_alone() {
    let points = driven(60);
    let found = ends(points.iter().map(|(model, start)| to_the_top(model, start)));
    let mut early = 0;
    for (k, ((model, start), end)) in points.iter().zip(found).enumerate() {
        let (end, alone) = (end.unwrap(), to_the_top(model, start).run_with(|_| ()).unwrap());
        assert!(farthest(&end, &alone) < 1e-6, "{k}: {end:?} {alone:?}");
        early += u32::from(end.t() < 4.0);
    }
    assert!((10..50).contains(&early), "{early}");
}

/// A ball on a spring passes a height twice within one long step; the first time counts.
#[test]
fn two_crossings_within_a_step_are_not_missed() {
    let model = Oscillator { mass: 1.0, damping: 0.0, stiffness: 1.0 };
    let start = model.state().x(1.0).build().unwrap();
    let heights: Vec<f64> = (1..40).map(|k| 1.0 - 0.5f64.powi(k / 2) / f64::from(k)).collect();
    let run = |height: f64| {
        let run = model.simulate(start).until(20.0).tolerance(1e-6);
        run.event("height", move |state| state.x() + height).stop_at("height", Direction::Falling)
    };
    for (height, end) in heights.iter().zip(ends(heights.iter().map(|height| run(*height)))) {
        let time = end.unwrap().t();
        assert!((time - (-height).acos()).abs() < 1e-3, "{height}: {time}");
    }
}

/// Functions with a corner, a narrow hump or a turning point near zero are found, and so are two fast roots.
#[test]
fn narrow_events_are_found_as_alone() {
    let points = driven(80);
    type Event = fn(&State<Driven>) -> f64;
    let events: [Event; 3] = [
        |state| (state.t() - 1.5).abs() - 0.01,
        |state| 0.5 - (-((state.t() - 1.5) / 0.03).powi(2)).exp(),
        |state| state.theta_rate().powi(2) - 1e-2,
    ];
    for (kind, event) in events.into_iter().enumerate() {
        let run = |(model, start): &'_ (Driven, State<Driven>)| -> f64 {
            let run = model.simulate(*start).until(2.0).event("n", event).stop_at("n", Direction::Any);
            run.run_with(|_| ()).unwrap().t()
        };
        let together = ends(points.iter().map(|(model, start)| {
            model.simulate(*start).until(2.0).event("n", event).stop_at("n", Direction::Any)
        }));
        for (k, (point, end)) in points.iter().zip(together).enumerate() {
            let (time, alone) = (end.unwrap().t(), run(point));
            assert!((time - alone).abs() < 1e-5, "{kind}, {k}: {time} {alone}");
        }
    }
}

/// Actions change states, and may be called in every run.
#[test]
fn actions_act_as_alone() {
    let model = Oscillator { mass: 1.0, damping: 0.1, stiffness: 4.0 };
    let run = |k: usize| {
        let start = model.state().x(0.2 + 0.1 * k as f64).build().unwrap();
        let bounce = move |state: &mut State<Oscillator>| state.set_x_rate(-0.5 * state.x_rate());
        let run = model.simulate(start).until(5.0).tolerance(1e-9);
        run.event("wall", |state| state.x() + 0.1).on_event("wall", Direction::Falling, bounce)
    };
    for (k, end) in ends((0..20).map(run)).into_iter().enumerate() {
        let alone = run(k).run_with(|_| ()).unwrap();
        assert!(farthest(&end.unwrap(), &alone) < 1e-6, "{k}");
    }
    // An action that ends the run.
    let start = model.state().x(1.0).build().unwrap();
    let stopped = model.simulate(start).until(5.0).event("middle", |state| state.x());
    let end = ends([stopped.on_event("middle", Direction::Any, |_| Flow::Stop)]).remove(0).unwrap();
    assert!(end.x().abs() < 1e-9 && end.t() < 1.0);
}

/// Every error is that of the run alone, in its place, and the others do not feel it.
#[test]
fn what_fails_stands_in_its_place() {
    let good = Oscillator::PLAIN;
    let massless = Oscillator { mass: 0.0, ..Oscillator::PLAIN };
    let start = good.state().x(0.3).build().unwrap();
    let runs = || {
        [
            good.simulate(start).until(1.0),
            massless.simulate(start).until(1.0),
            good.simulate(start),
            good.simulate(start).until(1.0).tolerance(-1.0),
            good.simulate(start).until(1.0).stop_at("nothing", Direction::Any),
            good.simulate(start).until(1e3).max_steps(20),
            good.simulate(start).until(1.0).event("none", |_| f64::NAN).stop_at("none", Direction::Any),
            good.simulate(start).until(1.0).max_step(0.01),
            good.simulate(start).until(0.0),
            good.simulate(start).until(1.0).drift_limit(-1.0),
            good.simulate(start).until(1.0).event("e", |s| s.x()).event("e", |s| s.x()),
            good.simulate(start).until(1.0).first_step(1e-3).tolerances(1e-10, 0.0),
        ]
    };
    let found = ends(runs());
    for (k, (end, run)) in found.iter().zip(runs()).enumerate() {
        match (end, run.run_with(|_| ())) {
            (Ok(end), Ok(alone)) => assert!(farthest(end, &alone) < 1e-8, "{k}"),
            (Err(error), Err(alone)) => assert_eq!(error.to_string(), alone.to_string(), "{k}"),
            (end, alone) => panic!("{k}: {end:?} {alone:?}"),
        }
    }
    let failed: Vec<usize> = (0..found.len()).filter(|k| found[*k].is_err()).collect();
    assert_eq!(failed, [1, 2, 3, 4, 5, 6, 9, 10]);
    let kind = &found[5].as_ref().unwrap_err().kind;
    assert!(matches!(kind, SimulationErrorKind::TooManySteps { .. }), "{kind}");
}

/// ẍ = x² leaves every bound in finite time for some starts.
#[derive(Clone, Debug, Dynamics)]
#[coordinates(x)]
struct Runaway {
    force: f64,
}

#[dynamics]
impl Runaway {
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * q.x.dt().powi(2)
    }
    #[potential]
    fn potential(&self, q: &Coordinates<Self>) -> Expr {
        -self.force * q.x.powi(3) / 3.0
    }
}

#[test]
fn a_run_that_ends_at_a_pole_leaves_the_others_alone() {
    let model = Runaway { force: 1.0 };
    let start = |k: usize| model.state().x(if k % 4 == 1 { 1.0 } else { -1.0 }).build().unwrap();
    let run = |k: usize| model.simulate(start(k)).until(3.0);
    let found = ends((0..23).map(run));
    let lone = bits(ends([run(0)])[0].as_ref().unwrap());
    for (k, end) in found.iter().enumerate() {
        match end {
            Ok(end) => assert!(k % 4 != 1 && bits(end) == lone, "{k}"),
            Err(error) => assert!(k % 4 == 1 && (2.5..3.0).contains(&error.time), "{k}: {error}"),
        }
    }
}

/// A stiff spring beside a slow one: such runs go on with an implicit method, as alone.
#[test]
fn stiff_runs_come_to_their_end() {
    let model = Oscillator { mass: 1.0, damping: 1e6, stiffness: 1e6 };
    let start = model.state().x(1.0).build().unwrap();
    for tolerance in [1e-6, 1e-9] {
        // Explicit steps alone would be some hundred thousand.
        let run = || model.simulate(start).until(2.0).tolerance(tolerance).max_steps(40_000);
        for end in ends((0..3).map(|_| run())) {
            assert!((end.unwrap().x() - (-2.0f64).exp()).abs() < 1e-5);
        }
    }
}

/// A rod on a slider whose mass may be negative: the inertia is singular at an angle. And a fast rotor.
#[derive(Clone, Debug, Dynamics)]
#[coordinates(x: m, theta: rad)]
#[units(slider: kg, bob: kg, length: m, g: m / s^2)]
struct Slider {
    slider: f64,
    bob: f64,
    length: f64,
    g: f64,
}

#[dynamics]
impl Slider {
    fn place(&self, q: &Coordinates<Self>) -> Vec2 {
        vec2(q.x + self.length * q.theta.sin(), -self.length * q.theta.cos())
    }
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * self.slider * q.x.dt().powi(2) + 0.5 * self.bob * self.place(q).dt().norm_squared()
    }
    #[potential]
    fn gravity(&self, q: &Coordinates<Self>) -> Expr {
        self.bob * self.g * self.place(q).y
    }
}

/// A run whose inertia becomes singular and one whose angle is too far for the sines' reduction change no bit
/// of their neighbours.
#[test]
fn what_is_special_in_a_lane_stays_in_it() {
    let with = |slider: f64| Slider { slider, bob: 1.0, length: 0.7, g: 9.81 };
    let (good, breaking) = (with(0.8), with(-0.3));
    let start = |model: &Slider, theta: f64, rate: f64| {
        model.state().theta(theta).theta_rate(rate).x_rate(0.2).build().unwrap()
    };
    let plain = || (0..9).map(|k| good.simulate(start(&good, 0.3 * f64::from(k), 0.5)).until(2.0));
    let special = || {
        [
            breaking.simulate(start(&breaking, 1.0, -3.0)).until(2.0),
            good.simulate(start(&good, 3e6, 1.0)).until(2.0),
            good.simulate(start(&good, 1_048_575.0, 4.0)).until(2.0),
        ]
    };
    let alone: Vec<_> = plain().map(|run| bits(ends([run])[0].as_ref().unwrap())).collect();
    let together = ends(special().into_iter().chain(plain()));
    for (k, end) in together[3..].iter().enumerate() {
        assert_eq!(bits(end.as_ref().unwrap()), alone[k], "{k}");
    }
    for (k, (run, end)) in special().into_iter().zip(&together).enumerate() {
        match (end, run.run_with(|_| ())) {
            (Ok(end), Ok(alone)) => assert!(farthest(end, &alone) < 1e-5, "{k}"),
            (Err(error), Err(alone)) => assert_eq!(error.to_string(), alone.to_string(), "{k}"),
            (end, alone) => panic!("{k}: {end:?} {alone:?}"),
        }
    }
    assert!(together[0].is_err());
}

/// Long runs pause now and then, and go on in their lanes.
#[test]
fn thousands_of_steps_are_made_in_lanes() {
    let model = Oscillator { mass: 1.0, damping: 0.0, stiffness: 100.0 };
    let start = model.state().x(1.0).build().unwrap();
    let run = |tolerance: f64| model.simulate(start).until(400.0).tolerance(tolerance);
    for end in ends([1e-8, 1e-11].map(run)) {
        assert!((end.unwrap().x() - 4000f64.cos()).abs() < 1e-3);
    }
    let error = ends([run(1e-11).max_steps(1_500)]).remove(0).unwrap_err();
    assert!(matches!(error.kind, SimulationErrorKind::TooManySteps { .. }), "{error}");
}

/// Models with constraints or choices run one by one, to the same ends.
#[test]
fn constraints_run_alone() {
    let bob = once::Bob { mass: 1.0, length: 1.0, g: 9.81, push: 0.3 };
    let start = |k: usize| bob.state().x(0.1 * k as f64).y_guess(-1.0).assemble().unwrap();
    let found = ends((1..6).map(|k| bob.simulate(start(k)).until(2.0)));
    for (k, end) in (1..6).zip(found) {
        assert_eq!(bits(&end.unwrap()), bits(&bob.simulate(start(k)).until(2.0).run_with(|_| ()).unwrap()));
    }
}

#[test]
fn no_runs_have_no_ends() {
    let none: [Simulation<'_, Oscillator>; 0] = [];
    assert!(ends(none).is_empty());
}

fn pendulum() -> (DoublePendulum, <DoublePendulum as Model>::State) {
    let model = DoublePendulum { m1: 1.0, m2: 1.0, l1: 1.0, l2: 1.0, g: 9.81 };
    let start = model.state().build().unwrap();
    (model, start)
}

/// A sweep over starts and parameters has the numbers of its runs, in the order of the grid, by whatever
/// number of cores.
#[test]
fn a_sweep_of_ends_is_that_of_its_runs() {
    let (model, start) = pendulum();
    let sweep = || {
        let angles = (0..40).map(|k| 0.05 * f64::from(k));
        model.sweep(start).over("theta1", angles).over("m2", (1..30).map(|k| 0.1 * f64::from(k)))
    };
    let angle = ["theta2"];
    let ends = sweep().ends(angle, |_, run| run.until(0.8), |model, end| [end.theta2() * model.m1]).unwrap();
    let run = |model: &DoublePendulum, start| Ok([model.simulate(start).until(0.8).run()?.end().theta2()]);
    let runs = sweep().run(angle, run).unwrap();
    assert_eq!(ends.axes, runs.axes);
    assert_eq!(ends.results.len(), 40 * 29);
    for (k, (a, b)) in ends.results.iter().zip(&runs.results).enumerate() {
        let ([a], [b]) = (a.as_ref().unwrap(), b.as_ref().unwrap());
        assert!((a - b).abs() < 1e-7, "{k}: {a} {b}");
    }
    #[cfg(feature = "parallel")]
    for threads in [1, 2, 5] {
        let sweep = sweep().threads(threads);
        let again = sweep.ends(angle, |_, run| run.until(0.8), |model, end| [end.theta2() * model.m1]);
        assert_eq!(ends, again.unwrap());
    }
}

#[test]
fn a_sweep_of_ends_reports_what_is_wrong_with_it() {
    let (model, start) = pendulum();
    let without_end = model.sweep(start).over("theta1", [0.1]).ends(["t"], |_, run| run, |_, end| [end.t()]);
    let without_end = without_end.unwrap();
    let failure = without_end.results[0].as_ref().unwrap_err();
    assert!(failure.message.contains(".until("), "{failure}");
    let failed = model.sweep(start).over("m1", [1.0, 0.0, 2.0]);
    let failed = failed.ends(["t"], |model, run| run.until(0.1 * model.l1), |_, end| [end.t()]).unwrap();
    assert_eq!(failed.failures().map(|(k, _)| k).collect::<Vec<_>>(), [1]);
}
