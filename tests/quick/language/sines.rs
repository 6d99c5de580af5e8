//! Sines and cosines of derived models: the inlined ones side by side, and the platform's where a model asks
//! for them; whole accelerations of four states side by side, and motions by the method that needs them.

use crate::double_pendulum;
use crate::kepler;
use crate::lanes;

use double_pendulum::DoublePendulum;
use dynamics::model::{ModelState, Vector};
use dynamics::prelude::*;
use dynamics::sin_cos;
use kepler::Kepler;
use lanes::{have_the_same_bits, side_by_side};

macro_rules! turning {
    ($name:ident, $($sines:ident)?) => {
        /// Unit inertias; the forces are −a cos θ + b sin θ.
        #[derive(Clone, Debug, Dynamics)]
        #[coordinates(theta: [_; 7], alone)]
        $(#[model(sin_cos = $sines)])?
        struct $name {
            a: f64,
            b: f64,
        }

        #[dynamics]
        impl $name {
            fn height(&self, angle: Expr) -> Expr {
                self.a * angle.sin() + self.b * angle.cos()
            }
            #[kinetic]
            fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
                let mut sum = 0.5 * q.alone.dt().powi(2);
                for i in 0..7 {
                    sum += 0.5 * q.theta[i].dt().powi(2);
                }
                sum
            }
            #[potential]
            fn potential(&self, q: &Coordinates<Self>) -> Expr {
                // One sine that needs another: it cannot stand beside it.
                let mut sum = 0.5 * (q.alone - q.alone.sin()).sin().powi(2);
                for i in 0..7 {
                    sum += self.height(q.theta[i]);
                }
                sum
            }
        }
    };
}

turning!(Inlined,);
turning!(Fast, fast);
turning!(Accurate, accurate);

/// The cosines and sines that a model evaluates.
macro_rules! evaluated {
    ($model:ident, $angles:expr) => {{
        let (mut cosines, mut sines) = ([0.0; 7], [0.0; 7]);
        for (a, b) in [(1.0, 0.0), (0.0, 1.0)] {
            let model = $model { a, b };
            let mut state = model.state().theta($angles).build().expect("finite values");
            state.set_alone(0.3);
            let accelerations = model.accelerations(&state).expect("unit inertias");
            for i in 0..7 {
                if b == 0.0 { cosines[i] = -accelerations[i] } else { sines[i] = accelerations[i] }
            }
        }
        (cosines, sines)
    }};
}

/// Seven angles, one of them large in some of the rounds.
fn angles(round: u32) -> [f64; 7] {
    let mut angles = std::array::from_fn(|i| 0.377 * f64::from(round) - 20.0 + 1.7 * i as f64);
    if round.is_multiple_of(5) {
        angles[round as usize % 7] = 1.3 * 10f64.powi(4 + (round / 5) as i32);
    }
    angles
}

#[test]
fn side_by_side_they_are_the_inlined_ones() {
    for round in 0..100 {
        let angles = angles(round);
        let expected = (angles.map(sin_cos::cos), angles.map(sin_cos::sin));
        assert_eq!(evaluated!(Inlined, angles), expected, "{angles:?}");
        assert_eq!(evaluated!(Fast, angles), expected, "{angles:?}");
    }
}

#[test]
fn on_request_they_are_the_platform_s() {
    let mut differ = 0;
    for round in 0..100 {
        let angles = angles(round);
        let platform = (angles.map(f64::cos), angles.map(f64::sin));
        assert_eq!(evaluated!(Accurate, angles), platform, "{angles:?}");
        differ += usize::from(evaluated!(Inlined, angles) != platform);
    }
    // Otherwise the option would not be seen to do anything.
    assert!(differ > 0);
}

/// A sine of a sine, by hand: a = −s cos(θ − sin θ) (1 − cos θ) with s = sin(θ − sin θ).
#[test]
fn one_within_another() {
    let model = Inlined { a: 0.0, b: 0.0 };
    for k in 0..50 {
        let theta = 0.13 * f64::from(k) - 3.0;
        let state = model.state().alone(theta).build().expect("finite values");
        let inner = theta - theta.sin();
        let expected = -inner.sin() * inner.cos() * (1.0 - theta.cos());
        let acceleration = model.accelerations(&state).expect("unit inertias")[7];
        assert!((acceleration - expected).abs() < 4e-16, "{theta}: {acceleration} {expected}");
    }
}

/// Every kind of operation but choices; time and an input.
#[derive(Clone, Debug, Dynamics)]
#[coordinates(x, y)]
#[inputs(push)]
struct Words {
    a: f64,
    b: f64,
}

#[dynamics]
impl Words {
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        let m = self.a + q.x.exp() + q.y.tanh().powi(2);
        0.5 * m * q.x.dt().powi(2)
            + 0.25 * q.x.dt() * q.y.dt()
            + (1.0 + q.x.powi(2)).sqrt() * q.y.dt().powi(2)
    }
    #[potential]
    fn potential(&self, q: &Coordinates<Self>) -> Expr {
        let r = q.x.powi(2) + q.y.powi(2) + 1.0;
        self.b * (r.ln() + r.powf(self.a) + (q.x - q.y).atan() - (q.x + self.b * q.t).cos())
    }
    #[force]
    fn pushed(&self, q: &Coordinates<Self>) -> Force {
        Force::along(q.y, q.push - 0.1 * q.y.dt())
    }
}

const DP: DoublePendulum = DoublePendulum { m1: 1.0, m2: 1.3, l1: 0.8, l2: 1.1, g: 9.81 };
const WORDS: Words = Words { a: 0.7, b: 1.9 };

fn pendulum(theta1: f64, theta2: f64, rate: f64) -> State<DoublePendulum> {
    DP.state().theta1(theta1).theta2(theta2).theta1_rate(rate).theta2_rate(1.0 - rate).build().unwrap()
}

#[test]
fn four_states_side_by_side_have_the_bits_of_each() {
    let number = |k: i32| (f64::from(k) * 0.377).sin() * 2.0;
    have_the_same_bits(&DP, (0..400).map(|k| pendulum(3.0 * number(k), number(3 * k), number(5 * k))));
    let kepler = Kepler { mu: 1.3 };
    let orbit =
        |k: i32| kepler.state().x(number(k)).y(number(3 * k) + 3.0).x_rate(number(7 * k)).build().unwrap();
    have_the_same_bits(&kepler, (0..400).map(orbit));
    let words = |k: i32| {
        let state =
            WORDS.state().x(number(k)).y(number(3 * k)).x_rate(number(7 * k)).y_rate(number(5 * k)).push(0.3);
        state.at_time(number(11 * k)).build().unwrap()
    };
    have_the_same_bits(&WORDS, (0..400).map(words));
    // Some of these angles are far, and one model asks for the platform's sines.
    let (inlined, accurate) = (Inlined { a: 0.7, b: 1.1 }, Accurate { a: 0.7, b: 1.1 });
    have_the_same_bits(
        &inlined,
        (0..100).map(|k| inlined.state().theta(angles(k)).alone(0.3).build().unwrap()),
    );
    have_the_same_bits(
        &accurate,
        (0..100).map(|k| accurate.state().theta(angles(k)).alone(0.3).build().unwrap()),
    );
}

/// One of the four is enough: what is to be said of it the scalar code says.
#[test]
fn where_one_state_has_no_accelerations_there_are_none_side_by_side() {
    let good = pendulum(0.3, 1.0, 0.2);
    assert!(side_by_side(&DP, [good; 4]).is_some());
    for lane in 0..4 {
        let mut four = [good; 4];
        four[lane].set_theta1(f64::NAN);
        assert_eq!(side_by_side(&DP, four), None, "{lane}");
    }
    // Inertia vanishes: 0.25² = 2 (a + 1 + tanh²y) at x = 0 for no y, but with a near −1.
    let model = Words { a: -1.0 + 1.0 / 32.0, b: 1.0 };
    let (regular, singular) = (model.state().x(0.0).y(1.0), model.state().x(0.0).y(0.0));
    let [regular, singular] = [regular, singular].map(|state| state.push(0.0).build().unwrap());
    assert!(model.accelerations(&regular).is_ok() && model.accelerations(&singular).is_err());
    assert!(side_by_side(&model, [regular; 4]).is_some());
    assert_eq!(side_by_side(&model, [regular, regular, singular, regular]), None);
}

/// A spring that only pushes.
#[derive(Clone, Debug, Dynamics)]
#[coordinates(x)]
struct Pushing {
    k: f64,
}

#[dynamics]
impl Pushing {
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * q.x.dt().powi(2)
    }
    #[force]
    fn spring(&self, q: &Coordinates<Self>) -> Force {
        Force::along(q.x, self.k * (-q.x).max(0.0).powi(2) - 1.0)
    }
}

#[test]
fn choices_are_evaluated_one_by_one_and_motions_are_right_nevertheless() {
    const { assert!(!Pushing::HAS_LANES) };
    let model = Pushing { k: 40.0 };
    let start = model.state().x(0.7).build().unwrap();
    let run = || model.simulate(start).until(6.0).tolerance(1e-11);
    let (found, exact) = (run().method(methods::GraggBulirschStoer).run().unwrap(), run().run().unwrap());
    assert!((found.end().x() - exact.end().x()).abs() < 1e-8, "{}", found.verify());
}

fn apart<S: ModelState>(a: &S, b: &S) -> f64 {
    let pairs =
        a.q().as_slice().iter().zip(b.q().as_slice()).chain(a.u().as_slice().iter().zip(b.u().as_slice()));
    pairs.fold(0.0, |most, (a, b)| most.max((a - b).abs()))
}

/// Beside Verner's method and Taylor series, at the end and between steps.
#[test]
fn motions_by_extrapolation_are_those_by_other_methods() {
    fn compare<M: Simulate>(model: &M, start: M::State, end: f64, most: f64) {
        let run = |tolerance| model.simulate(start).until(end).tolerance(tolerance);
        let exact = run(1e-14).method(methods::Taylor { order: None }).run().unwrap();
        for (tolerance, factor) in [(1e-6, 1.0), (1e-9, 1.0), (1e-12, 10.0)] {
            let found = run(tolerance).method(methods::GraggBulirschStoer).run().unwrap();
            let error = apart(&found.end(), &exact.end());
            assert!(error < most * factor * tolerance, "{}, {tolerance:e}: {error:e}", M::NAME);
            let between = (0..200).map(|k| {
                let t = end * f64::from(k) / 200.0;
                apart(&found.at(t), &exact.at(t))
            });
            let between = between.fold(0.0, f64::max);
            assert!(
                between < 20.0 * most * factor * tolerance,
                "{}, {tolerance:e}: {between:e} between",
                M::NAME
            );
            let verner = run(tolerance).method(methods::Verner9).run().unwrap();
            assert!(found.counts().steps < verner.counts().steps, "{}", M::NAME);
        }
    }
    compare(&DP, pendulum(1.5, 1.0, 0.0), 5.0, 100.0);
    compare(
        &Kepler { mu: 1.0 },
        Kepler { mu: 1.0 }.state().x(0.1).y_rate(19f64.sqrt()).build().unwrap(),
        7.0,
        1e3,
    );
    compare(&WORDS, WORDS.state().x(0.3).x_rate(0.2).push(0.4).build().unwrap(), 5.0, 100.0);
}

/// A law makes each evaluation one by itself: the same motion to the last bit, by as many evaluations.
#[test]
fn with_lanes_and_without_motions_are_the_same_bit_by_bit() {
    let start = WORDS.state().x(0.3).x_rate(0.2).push(0.4).build().unwrap();
    let run = || WORDS.simulate(start).until(5.0).tolerance(1e-10).method(methods::GraggBulirschStoer);
    let (held, law) = (run().run().unwrap(), run().inputs(|_, _| [0.4]).run().unwrap());
    assert_eq!((held.end().q, held.end().u), (law.end().q, law.end().u));
    assert_eq!(held.at(1.234).q, law.at(1.234).q);
    assert_eq!(held.counts().evaluations, law.counts().evaluations);
}

/// A ball that an event throws back from the ground, without loss; another event counts its highest places.
#[derive(Clone, Debug, Dynamics)]
#[coordinates(height)]
struct Ball {
    g: f64,
}

#[dynamics]
impl Ball {
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * q.height.dt().powi(2)
    }
    #[potential]
    fn gravity(&self, q: &Coordinates<Self>) -> Expr {
        self.g * q.height
    }
    #[event]
    fn ground(&self, q: &Coordinates<Self>) -> Expr {
        q.height
    }
    #[event]
    fn top(&self, q: &Coordinates<Self>) -> Expr {
        q.height.dt()
    }
}

/// Steps are long, here without any error to bound them: events are found within them, and motions go on from
/// them.
#[test]
fn events_are_met_within_long_steps() {
    const { assert!(Ball::HAS_LANES) };
    let model = Ball { g: 2.0 };
    let start = model.state().height(1.0).build().unwrap();
    let run = model.simulate(start).until(9.5).tolerance(1e-10).method(methods::GraggBulirschStoer);
    let motion = run.on_event("ground", Direction::Falling, |s| s.u[0] = -s.u[0]).run().unwrap();
    // From height 1 at rest: on the ground at 1, 3, 5, …, at the top at 2, 4, ….
    let times =
        |name: &str| motion.events().iter().filter(|e| e.name == name).map(|e| e.time()).collect::<Vec<_>>();
    let near = |found: &[f64], wanted: &[f64]| {
        assert_eq!(found.len(), wanted.len(), "{found:?}");
        found
            .iter()
            .zip(wanted)
            .for_each(|(found, wanted)| assert!((found - wanted).abs() < 1e-8, "{found}"));
    };
    near(&times("ground"), &[1.0, 3.0, 5.0, 7.0, 9.0]);
    near(&times("top"), &[2.0, 4.0, 6.0, 8.0]);
    assert!((motion.end().height() - 0.75).abs() < 1e-8);
}
