//! States between the steps of every method and formulation, beside change points: a balance whose
//! constraints repeat each other, and four bars.
//!
//! Steps are recorded, and made again where states within them are asked for. Radau5's iterations, begun anew
//! from less than what they knew in the run, ended beside a change point at no solution or at another one:
//! ends of steps were right to 1e-9, angles between them off by 12 rad, as a success.

use dynamics::methods::Any;
use dynamics::prelude::*;
use dynamics::simulate::Motion;

use super::*;

/// Roberval's balance: two pans on three parallel beams, of which two would do. Its change points are the
/// upright beams.
#[derive(Clone, Debug, Dynamics)]
#[coordinates(beam: [rad; 3], left: [m; 2], left_tilt: rad, right: [m; 2], right_tilt: rad)]
#[units(masses: kg, pan: kg * m^2, inertia: kg * m^2, arm: m, apart: m, gravity: m / s^2)]
#[nominal(arm = 0.4, apart = 0.15)]
struct Balance {
    masses: [f64; 2],
    pan: f64,
    inertia: f64,
    arm: f64,
    apart: f64,
    gravity: f64,
}

#[dynamics]
impl Balance {
    fn pans(&self, q: &Coordinates<Self>) -> [Vec2; 2] {
        [vec2(q.left[0], q.left[1]), vec2(q.right[0], q.right[1])]
    }
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        let [left, right] = self.pans(q);
        let mut sum = 0.5 * self.masses[0] * left.dt().norm_squared()
            + 0.5 * self.masses[1] * right.dt().norm_squared()
            + 0.5 * self.pan * (q.left_tilt.dt().powi(2) + q.right_tilt.dt().powi(2));
        for i in 0..3 {
            sum += 0.5 * self.inertia * q.beam[i].dt().powi(2);
        }
        sum
    }
    #[potential]
    fn gravity(&self, q: &Coordinates<Self>) -> Expr {
        let [left, right] = self.pans(q);
        self.gravity * (self.masses[0] * left.y + self.masses[1] * right.y)
    }
    /// What the joint of a beam misses its pan by.
    fn joint(&self, q: &Coordinates<Self>, beam: usize, side: f64) -> Vec2 {
        let up = (beam as f64 - 1.0) * self.apart;
        let end = vec2(0.0, up) + side * self.arm * vec2(q.beam[beam].cos(), q.beam[beam].sin());
        let [left, right] = self.pans(q);
        if side < 0.0 {
            left + up * vec2(-q.left_tilt.sin(), q.left_tilt.cos()) - end
        } else {
            right + up * vec2(-q.right_tilt.sin(), q.right_tilt.cos()) - end
        }
    }
    #[holonomic]
    fn upper(&self, q: &Coordinates<Self>) -> [Vec2; 2] {
        [self.joint(q, 2, -1.0), self.joint(q, 2, 1.0)]
    }
    #[holonomic]
    #[redundant]
    fn middle(&self, q: &Coordinates<Self>) -> [Vec2; 2] {
        [self.joint(q, 1, -1.0), self.joint(q, 1, 1.0)]
    }
    #[holonomic]
    #[redundant]
    fn lower(&self, q: &Coordinates<Self>) -> [Vec2; 2] {
        [self.joint(q, 0, -1.0), self.joint(q, 0, 1.0)]
    }
}

impl Balance {
    fn new() -> Self {
        Self { masses: [1.0, 1.2], pan: 0.02, inertia: 0.03, arm: 0.4, apart: 0.15, gravity: 9.81 }
    }
    /// By its beams alone: they turn as a pendulum.
    fn alone(&self) -> Branch {
        let [left, right] = self.masses;
        // `Branch` has twice this inertia, and twice this weight, of its two cranks.
        let inertia = 0.5 * (3.0 * self.inertia + (left + right) * self.arm * self.arm);
        Branch { inertia, a: self.arm, weight: 0.5 * (right - left) * self.gravity }
    }
    fn at(&self, angle: f64, rate: f64) -> State<Self> {
        let (s, c) = angle.sin_cos();
        let (place, speed) = ([self.arm * c, self.arm * s], [-self.arm * s * rate, self.arm * c * rate]);
        let start = self.state().beam([angle; 3]).beam_rate([rate; 3]).right(place).right_rate(speed);
        start.left(place.map(|x| -x)).left_rate(speed.map(|x| -x)).build().unwrap()
    }
}

fn methods<M: Simulate>() -> [Any<M>; 7] {
    [
        methods::Radau5.into(),
        methods::GeneralizedAlpha::default().into(),
        methods::DormandPrince5.into(),
        methods::Tsit5.into(),
        methods::Dop853.into(),
        methods::Verner9.into(),
        methods::Taylor::default().into(),
    ]
}

const FORMULATIONS: [Formulation; 4] =
    [Formulation::Projected, Formulation::Embedded, Formulation::Augmented, Formulation::BaumgarteTied];

/// The largest errors at ends of steps and between them, each in parts of 1 + |value|.
fn worst<M: Simulate>(motion: &Motion<'_, M>, off: impl Fn(&M::State) -> f64) -> (f64, f64) {
    let ends: Vec<M::State> = motion.steps().collect();
    let within = |pair: &[M::State]| {
        let (from, to) = (pair[0].t(), pair[1].t());
        (1..12).map(move |k| from + (to - from) * f64::from(k) / 12.0).collect::<Vec<_>>()
    };
    let largest =
        |states: &mut dyn Iterator<Item = M::State>| states.map(|state| off(&state)).fold(0.0, f64::max);
    let between = largest(&mut motion.sample(ends.windows(2).flat_map(within)));
    (largest(&mut ends.into_iter()), between)
}

/// All of them, from several starts; `permitted` times the tolerance is what a state may be off, at the end
/// of a step or between.
fn check<M: Simulate + Clone>(
    name: &str,
    (model, start): (&M, M::State),
    end: f64,
    permitted: f64,
    off: impl Fn(&M::State) -> f64,
) -> usize {
    let mut made = 0;
    for formulation in FORMULATIONS {
        for method in methods() {
            // Generalized-α has order 2.
            let tightest = if method.method() == Method::GeneralizedAlpha { 1e-5 } else { 1e-8 };
            for tolerance in [1e-5, tightest] {
                let run = model.simulate(start).until(end).formulation(formulation).method(&method);
                let Ok(motion) = run.tolerance(tolerance).max_steps(20_000).run() else { continue };
                let (ends, between) = worst(&motion, &off);
                let case =
                    format!("{name}: {method}, {formulation}, {tolerance:e}: {ends:.1e} {between:.1e}");
                println!("{case}");
                assert!(ends < permitted * tolerance && between < permitted * tolerance, "{case}");
                made += 1;
            }
        }
    }
    made
}

#[test]
fn states_between_steps_of_every_method_are_on_a_balance_that_turns_over() {
    let model = Balance::new();
    let branch = model.alone();
    for (angle, rate, end) in [(0.1, 5.0, 0.5), (-2.0, -6.0, 1.2)] {
        let alone = branch.state().crank(angle).crank_rate(rate).build().unwrap();
        let truth = branch.simulate(alone).until(end).tolerance(1e-13).run().unwrap();
        let off = |state: &State<Balance>| {
            let truth = truth.at(state.t());
            let known = model.at(truth.crank(), truth.crank_rate());
            let apart = |a: f64, b: f64| (a - b).abs() / (1.0 + b.abs());
            let pairs = state.q().iter().zip(known.q().iter()).chain(state.u().iter().zip(known.u().iter()));
            pairs.fold(0.0, |most: f64, (a, b)| most.max(apart(*a, *b)))
        };
        let made = check(&format!("from {angle}"), (&model, model.at(angle, rate)), end, 500.0, off);
        // The others end with an error beside 90°.
        assert!(made >= 30, "{made}");
    }
}
