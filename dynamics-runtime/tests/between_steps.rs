//! States between steps: every method's dense output against its own step ended there and against a run at
//! the tolerance 1e-13, over random systems that are smooth, stiff and kinked. Errors are in units of what is
//! permitted, by the norm of the step control.
//!
//! More systems by hand: `BETWEEN_STEPS=300 cargo test -p dynamics-runtime --release between_steps --
//! --nocapture`. With `BETWEEN_STEPS_LIST=5` states that are off by more than five times that are listed with
//! their systems.

use crate::common;

use common::*;
use dynamics_runtime::error::{SingularMassMatrix, SolveError};
use dynamics_runtime::integrate::Method;
use dynamics_runtime::methods::{self, Any};
use dynamics_runtime::model::{Dynamics, Events, Model, Outputs, Powers, Quantity};
use dynamics_runtime::simulate::{Motion, Simulate};
use nalgebra::{SMatrix, SVector};

type State = PlainState<2, 0>;
type V = SVector<f64, 2>;

/// xorshift64*.
struct Random(u64);

impl Random {
    fn next(&mut self) -> f64 {
        self.0 ^= self.0 >> 12;
        self.0 ^= self.0 << 25;
        self.0 ^= self.0 >> 27;
        (self.0.wrapping_mul(0x2545_F491_4F6C_DD1D) >> 11) as f64 / (1u64 << 53) as f64
    }
    fn within(&mut self, from: f64, to: f64) -> f64 {
        from + (to - from) * self.next()
    }
    /// Evenly over the logarithm.
    fn power(&mut self, from: f64, to: f64) -> f64 {
        self.within(from.ln(), to.ln()).exp()
    }
}

#[derive(Clone, Copy, Debug, PartialEq)]
enum Kind {
    /// Two followers, of cos t and of sin t, damped critically or more: ẍ = −r² (x − cos t) − 2 ζ r ẋ.
    Follower,
    /// The same so stiff that explicit methods are bound by stability.
    Stiff,
    /// Two pendulums on a spring, pushed.
    Pendulums,
    /// An orbit.
    Orbit,
    /// Stops on both sides, max(|x| − a, 0), and dry friction rounded off by tanh.
    Kinked,
    /// Van der Pol's oscillator, and one that it pushes.
    VanDerPol,
}

const KINDS: [Kind; 6] =
    [Kind::Follower, Kind::Stiff, Kind::Pendulums, Kind::Orbit, Kind::Kinked, Kind::VanDerPol];

/// A random system of two coordinates.
#[derive(Clone, Copy, Debug)]
struct System {
    kind: Kind,
    p: [f64; 5],
    start: State,
    end: f64,
}

impl System {
    fn random(kind: Kind, random: &mut Random) -> Self {
        let (mut p, mut end) = ([0.0; 5], 5.0);
        let mut start = at_rest_or_not(
            [random.within(-1.0, 1.0), random.within(-1.0, 1.0)],
            [random.within(-1.0, 1.0), random.within(-1.0, 1.0)],
        );
        match kind {
            Kind::Follower | Kind::Stiff => {
                let most = if kind == Kind::Follower { (3.0, 60.0) } else { (100.0, 3000.0) };
                p = [
                    random.power(most.0, most.1),
                    random.power(most.0, most.1),
                    random.power(0.7, 2.0),
                    random.power(0.7, 2.0),
                    0.0,
                ];
                start = at_rest_or_not([1.0, 0.0], [0.0, 0.0]);
                if kind == Kind::Stiff {
                    end = 1.0;
                }
            }
            Kind::Pendulums => {
                p = [
                    random.power(0.5, 20.0),
                    random.power(0.5, 20.0),
                    random.power(0.1, 10.0),
                    random.within(0.0, 2.0),
                    random.power(0.3, 5.0),
                ]
            }
            Kind::Orbit => {
                let e = random.within(0.0, 0.9);
                start = at_rest_or_not([1.0 - e, 0.0], [0.0, ((1.0 + e) / (1.0 - e)).sqrt()]);
                end = 8.0;
            }
            Kind::Kinked => {
                p = [
                    random.power(10.0, 1e4),
                    random.within(0.1, 1.0),
                    random.power(0.05, 1.0),
                    random.power(0.01, 0.3),
                    random.power(0.5, 5.0),
                ]
            }
            Kind::VanDerPol => p = [random.power(1.0, 30.0), random.power(0.5, 3.0), 0.0, 0.0, 0.0],
        }
        Self { kind, p, start, end }
    }
}

impl ByHand<2, 0> for System {
    fn q_ddot(&self, s: &State) -> Result<V, SolveError> {
        let ([x, y], [u, v], [a, b, c, d, e]) = ([s.q[0], s.q[1]], [s.u[0], s.u[1]], self.p);
        Ok(match self.kind {
            Kind::Follower | Kind::Stiff => V::new(
                -a * a * (x - s.t.cos()) - 2.0 * c * a * u,
                -b * b * (y - s.t.sin()) - 2.0 * d * b * v + x,
            ),
            Kind::Pendulums => {
                V::new(-a * x.sin() - c * (x - y) + d * (e * s.t).sin(), -b * y.sin() + c * (x - y))
            }
            Kind::Orbit => -s.q / s.q.norm().powi(3),
            Kind::Kinked => {
                let stop = |x: f64| a * (x.abs() - b).max(0.0) * x.signum();
                V::new(-x - stop(x) + (e * s.t).sin(), x - 2.0 * y - c * (v / d).tanh())
            }
            Kind::VanDerPol => V::new(a * (1.0 - x * x) * u - x, -b * b * y - 0.1 * v + x),
        })
    }
    fn mass(&self, _: &State) -> SMatrix<f64, 2, 2> {
        SMatrix::identity()
    }
    fn energy(&self, _: &State) -> f64 {
        0.0
    }
}
by_hand!(System, 2, 0, coordinates ["x", "y"], inputs [], conserved [], powers [], outputs [], events []);

/// The difference of two states, 1: what is permitted.
fn apart(one: &State, other: &State, tolerance: f64) -> f64 {
    let part = |x: &V, y: &V| {
        x.iter()
            .zip(y)
            .map(|(x, y)| ((x - y) / (tolerance * (1.0 + x.abs().max(y.abs())))).powi(2))
            .sum::<f64>()
    };
    ((part(&one.q, &other.q) + part(&one.u, &other.u)) / 4.0).sqrt()
}

/// What 300 random systems of every kind have shown at most, rounded up: the table of docs/guide/accuracy.md.
///
/// First the error over the larger one at the two ends of the step, or over what is permitted where that is
/// more: of smooth and stiff systems, and of kinked ones. Then the difference from the method's own step
/// ended there, of smooth and stiff systems: with a kink inside, a single step does not know what it is off.
const WORST: [(Method, [f64; 3]); 8] = [
    (Method::DormandPrince5, [2.7, 6.7, 7.3]),
    (Method::Tsit5, [2.8, 3.1, 5.9]),
    (Method::Dop853, [3.2, 13.4, 22.8]),
    (Method::Verner9, [2.7, 15.9, 2.6]),
    (Method::GraggBulirschStoer, [2.9, 17.9, 1.0]),
    (Method::Radau5, [11.6, 4.5, 45.4]),
    (Method::Esdirk4, [4.7, 5.6, 16.7]),
    (Method::GeneralizedAlpha, [1.2, 1.2, 0.5]),
];

fn methods() -> Vec<Any<System>> {
    vec![
        methods::DormandPrince5.into(),
        methods::Tsit5.into(),
        methods::Dop853.into(),
        methods::Verner9.into(),
        methods::GraggBulirschStoer.into(),
        methods::Radau5.into(),
        methods::Esdirk4.into(),
        methods::GeneralizedAlpha { rho: 0.8 }.into(),
    ]
}

fn reference(system: &System) -> Motion<'_, System> {
    let simulation = system.simulate(system.start).until(system.end).tolerance(1e-13).max_step(0.01);
    simulation.method(methods::Verner9).run().expect("nothing ends it")
}

/// The worst of a method, as in [`WORST`] on one kind of systems.
#[derive(Clone, Copy, Debug, Default)]
struct Worst {
    beyond_ends: f64,
    beside_own_step: f64,
    states: u64,
}

/// Looks at states within random steps.
fn examine(
    (system, exact): (&System, &Motion<'_, System>),
    (method, tolerance): (&Any<System>, f64),
    random: &mut Random,
    worst: &mut Worst,
) {
    let listed = std::env::var("BETWEEN_STEPS_LIST")
        .ok()
        .and_then(|least| least.parse().ok())
        .unwrap_or(f64::INFINITY);
    let from = |state: State| system.simulate(state).tolerance(tolerance).method(method);
    let motion = from(system.start).until(system.end).run().expect("nothing ends it");
    let steps: Vec<State> = motion.steps().collect();
    let off = |state: &State| apart(state, &exact.at(state.t), tolerance);
    for _ in 0..16 {
        let i = ((steps.len() - 1) as f64 * random.next()) as usize;
        let (start, end) = (&steps[i], &steps[i + 1]);
        let t = start.t + random.within(0.02, 0.98) * (end.t - start.t);
        let state = motion.at(t);
        let beyond = off(&state) / off(start).max(off(end)).max(1.0);
        // The method's own step ended there, where it is one step.
        let own = from(*start).until(t).first_step(t - start.t).run().expect("the whole step was made");
        let single = own.counts().steps == 1 && own.counts().rejected == 0;
        let beside = if single { apart(&state, &own.end(), tolerance) } else { 0.0 };
        worst.beyond_ends = worst.beyond_ends.max(beyond);
        worst.beside_own_step = worst.beside_own_step.max(beside);
        worst.states += 1;
        if beyond.max(beside) > listed {
            let (from, to) = (start.t, end.t);
            println!(
                "{method} {tolerance:e} t = {t} of {from} to {to}: {beyond:.1}, {beside:.1} of {system:?}"
            );
        }
    }
}

/// The worst of so many random systems of a kind, by methods.
fn survey(kind: Kind, count: u64) -> Vec<Worst> {
    let (mut random, methods) = (Random(0x9E37_79B9_7F4A_7C15), methods());
    let mut worst = vec![Worst::default(); methods.len()];
    for _ in 0..count {
        let system = System::random(kind, &mut random);
        let exact = reference(&system);
        for (method, worst) in methods.iter().zip(&mut worst) {
            // Steps of order 2 are too many for more digits.
            let tolerances = if method.method().order() == 2 { &[1e-4][..] } else { &[1e-4, 1e-6, 1e-8] };
            for tolerance in tolerances {
                examine((&system, &exact), (method, *tolerance), &mut random, worst);
            }
        }
    }
    worst
}

#[test]
fn states_between_steps_are_as_good_as_ends_of_steps() {
    let count = std::env::var("BETWEEN_STEPS").ok().and_then(|count| count.parse().ok()).unwrap_or(3);
    let mut missed = Vec::new();
    for kind in KINDS {
        for (worst, (method, [smooth, kinked, own])) in survey(kind, count).into_iter().zip(WORST) {
            let Worst { beyond_ends, beside_own_step, states } = worst;
            let row = format!(
                "{kind:?}, {method}: {beyond_ends:.1} beyond the ends, {beside_own_step:.1} beside its own \
                 step"
            );
            println!("{row}, {states} states");
            let permitted = if kind == Kind::Kinked { [kinked, f64::INFINITY] } else { [smooth, own] };
            if beyond_ends > permitted[0] || beside_own_step > permitted[1] {
                missed.push(row);
            }
        }
    }
    assert!(missed.is_empty(), "{missed:#?}");
}

/// Stability bounds the steps of DOP853 on what is critically damped: its interpolant of the whole step is
/// off by a thousand times what is permitted.
#[test]
fn what_is_damped_hard_is_followed_between_steps() {
    let follower = System {
        kind: Kind::Follower,
        p: [14.22, 14.22, 1.0, 1.0, 0.0],
        start: at_rest_or_not([1.0, 0.0], [0.0, 0.0]),
        end: 10.0,
    };
    let exact = reference(&follower);
    for tolerance in [1e-4, 1e-6, 1e-9] {
        let simulation =
            follower.simulate(follower.start).until(10.0).tolerance(tolerance).method(methods::Dop853);
        let motion = simulation.estimate_error().run().expect("nothing ends it");
        let off = |t: f64| apart(&motion.at(t), &exact.at(t), tolerance);
        let at_ends = motion.steps().map(|state| off(state.t)).fold(1.0, f64::max);
        let between = (0..1000).map(|k| off(0.01 * f64::from(k))).fold(0.0, f64::max);
        println!("{tolerance:e}: {at_ends} at the ends of the steps, {between} at any time");
        let estimate = motion.global_error().expect("it was asked for");
        let told = estimate.between.expect("steps have no fixed size").max(1.0);
        println!("{estimate}");
        // The norm above is the mean of the four numbers of a state, this one the largest.
        assert!(told < 2.5 * between.max(1.0) && told > 0.2 * between, "{told} told, {between} measured");
        assert!(
            between < 3.0 * at_ends,
            "{tolerance:e}: {at_ends} at the ends of the steps, {between} at any time"
        );
    }
}

/// Methods of fixed steps have no tolerance. Between two steps they are off by what the ends of steps are
/// off, and by what the quintic through both ends leaves of the motion, which is of the order of h⁵. Order 1
/// is off by more: its positions do not follow the velocities at both ends.
#[test]
fn fixed_steps_are_followed_between_their_ends() {
    let methods: [Any<System>; 7] = [
        methods::Rk4.into(),
        methods::SemiImplicitEuler.into(),
        methods::Gauss4.into(),
        methods::Gauss6.into(),
        methods::ExplicitEuler.into(),
        methods::Heun.into(),
        methods::AdamsBashforth4.into(),
    ];
    let mut random = Random(0x9E37_79B9_7F4A_7C15);
    let count = std::env::var("BETWEEN_STEPS").ok().and_then(|count| count.parse().ok()).unwrap_or(3);
    for _ in 0..count {
        for kind in [Kind::Pendulums, Kind::Orbit] {
            let system = System::random(kind, &mut random);
            let exact = reference(&system);
            for (method, h) in methods.iter().flat_map(|method| [(method, 0.05), (method, 0.01)]) {
                let simulation = system.simulate(system.start).until(system.end).fixed_step(h);
                let motion = simulation.method(method).run().expect("nothing ends it");
                let off = |state: &State| apart(state, &exact.at(state.t), 1.0);
                let at_ends = motion.steps().map(|state| off(&state)).fold(0.0, f64::max);
                let times = (0..200).map(|_| random.within(0.0, system.end));
                let between = times.map(|t| off(&motion.at(t))).fold(0.0, f64::max);
                let times = if method.method().order() == 1 { 10.0 } else { 4.0 };
                let permitted = times * at_ends + h.powi(5);
                assert!(
                    between < permitted,
                    "{method} {h} of {system:?}: {between:e}, {at_ends:e} at the ends"
                );
            }
        }
    }
}
