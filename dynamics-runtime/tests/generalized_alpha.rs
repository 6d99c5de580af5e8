//! The generalized-α method: order 2 in positions, velocities and multipliers from the first step on, damping
//! as theory says, steps of changing size, and no success where its equations are not solved.

use crate::common;

use std::convert::Infallible;

use common::{DoublePendulum, at_rest_or_not};
use dynamics_runtime::integrate::{
    Accelerations, Canonical, Dop853, Expandable, GeneralizedAlpha, Phase, Stabilized, StepError,
    StepOptions, Stepper, Switching, Tolerances,
};
use dynamics_runtime::integrate::{ProjectedEnd, StepNode};
use dynamics_runtime::methods;
use dynamics_runtime::simulate::Simulate;
use nalgebra::{Matrix3, SVector, Vector3};

type V1 = SVector<f64, 1>;
type V2 = SVector<f64, 2>;

const RHOS: [f64; 4] = [0.0, 0.5, 0.8, 1.0];

fn fixed(h: f64) -> StepOptions {
    StepOptions { tolerances: Tolerances::both(1e-11), fixed: Some(h), first: None, most: f64::INFINITY }
}

fn adaptive(tolerance: f64) -> StepOptions {
    StepOptions { tolerances: Tolerances::both(tolerance), fixed: None, first: None, most: f64::INFINITY }
}

/// A pendulum of unit mass and length in Cartesian coordinates: Φ = ½(q·q − 1).
struct Rod;

const DOWN: V2 = V2::new(0.0, -9.81);

impl Rod {
    /// λ for which Φ̈ = 0.
    fn multiplier(q: &V2, u: &V2) -> f64 {
        -(q.dot(&DOWN) + u.dot(u)) / q.dot(q)
    }
}

impl Accelerations<V2> for Rod {
    type Error = Infallible;
    fn accelerations(&mut self, _: f64, q: &V2, u: &V2) -> Result<V2, Infallible> {
        Ok(DOWN + q * Self::multiplier(q, u))
    }
}

impl Stabilized<V2> for Rod {
    fn needs_projection(&self) -> bool {
        true
    }
    fn project(
        &mut self,
        _: f64,
        y: &mut Phase<V2>,
        _: &Tolerances,
    ) -> Result<Option<ProjectedEnd>, Infallible> {
        y.q /= y.q.norm();
        y.u -= y.q * y.q.dot(&y.u);
        Ok(Some(ProjectedEnd { by: 0.0, violation: 0.0, noise: 0.0 }))
    }
    fn has_constraints(&self) -> bool {
        true
    }
    fn inadmissible_component(&mut self, _: f64, y: &Phase<V2>, v: &V2, _: bool) -> Result<V2, Infallible> {
        Ok(y.q * (y.q.dot(v) / y.q.dot(&y.q)))
    }
    fn constraint_correction(&mut self, _: f64, y: &Phase<V2>, _: f64) -> Result<V2, Infallible> {
        let square = y.q.dot(&y.q);
        Ok(y.q * (0.5 * (1.0 - square) / square))
    }
}

impl Switching<V2> for Rod {}

impl Canonical<V2> for Rod {}

impl Expandable<V2> for Rod {}

fn at(theta: f64, rate: f64) -> Phase<V2> {
    let (s, c) = theta.sin_cos();
    Phase { q: V2::new(s, -c), u: V2::new(c, s) * rate }
}

/// The same pendulum by its angle, at times to come.
struct Truth(Stepper<V1, Dop853<V1>>);

impl Truth {
    fn equation(_: f64, q: &V1, _: &V1) -> Result<V1, Infallible> {
        Ok(V1::new(-9.81 * q[0].sin()))
    }
    fn new(theta: f64, rate: f64) -> Self {
        let start = Phase { q: V1::new(theta), u: V1::new(rate) };
        Self(Stepper::new(&mut Self::equation, 0.0, start, 10.0, adaptive(1e-14)).unwrap())
    }
    fn to(&mut self, t: f64) -> Phase<V2> {
        while self.0.now().t < t {
            self.0.step(&mut Self::equation, t).unwrap();
        }
        at(self.0.now().y.q[0], self.0.now().y.u[0])
    }
}

/// Largest errors of q, u, the multipliers of the state and those of the method, over the steps that `counts`
/// says; `sizes` are gone through in turn.
fn errors(rho: f64, sizes: &[f64], end: f64, counts: impl Fn(u64) -> bool) -> [f64; 4] {
    let mut truth = Truth::new(1.0, 2.0);
    let scheme = GeneralizedAlpha::damping(rho);
    let mut stepper = Stepper::with(scheme, &mut Rod, 0.0, at(1.0, 2.0), end, fixed(1.0)).unwrap();
    let mut worst = [0.0f64; 4];
    let mut t = 0.0;
    for step in 0u64.. {
        if t > end - 1e-9 {
            break;
        }
        t += sizes[step as usize % sizes.len()];
        stepper.step(&mut Rod, t).unwrap();
        let (now, exact) = (stepper.now().y, truth.to(t));
        let lambda = Rod::multiplier(&exact.q, &exact.u);
        // λ of M q̈ = Q + Φ_qᵀλ.
        let own = (stepper.scheme().accelerations() - DOWN).dot(&now.q);
        let found = [
            (now.q - exact.q).norm(),
            (now.u - exact.u).norm(),
            (Rod::multiplier(&now.q, &now.u) - lambda).abs(),
            (own - lambda).abs(),
        ];
        if counts(step) {
            (0..4).for_each(|k| worst[k] = worst[k].max(found[k]));
        }
    }
    worst
}

fn check_orders(what: &str, sizes: &[f64], end: f64, counts: impl Fn(u64) -> bool + Copy) {
    for rho in &RHOS[..3] {
        let rho = *rho;
        let half: Vec<f64> = sizes.iter().map(|h| 0.5 * h).collect();
        let (coarse, fine) = (errors(rho, sizes, end, counts), errors(rho, &half, end, counts));
        let orders = [0, 1, 2, 3].map(|k| (coarse[k] / fine[k]).log2());
        println!("{what}, rho {rho}: errors {coarse:.2?} {fine:.2?}, orders {orders:.2?}");
        assert!(orders.iter().all(|order| (1.8..2.4).contains(order)), "{what}, rho {rho}: {orders:?}");
    }
}

/// Positions, velocities, and multipliers, those of the method too, at all steps; of index 3 that takes a
/// start that is beside Φ̇ = 0.
#[test]
fn orders_of_convergence_with_constraints() {
    check_orders("all steps", &[0.01], 2.0, |_| true);
}

/// Each of the first steps by itself: with a start as it is given, the method's own multipliers would err by
/// O(h) there.
#[test]
fn multipliers_have_their_order_from_the_first_step_on() {
    for rho in RHOS {
        let first = |h: f64| errors(rho, &[h], 4.0 * h, |_| true)[3];
        let (coarse, fine) = (first(0.005), first(0.0025));
        println!("rho {rho}: {coarse:.2e} {fine:.2e}");
        assert!(coarse / fine > 3.6, "rho {rho}: order {}", (coarse / fine).log2());
        assert!(coarse < 0.05);
    }
}

/// Steps that change keep the order, multipliers of the method included.
#[test]
fn orders_of_convergence_with_steps_that_change() {
    check_orders("0.8, 1.2, 0.4, 1.6", &[0.008, 0.012, 0.004, 0.016], 2.0, |_| true);
}

/// q̈ = −ω² q: every step is that of the matrix which the formulas give, whose radius tends to ρ∞.
#[test]
fn oscillations_are_damped_as_theory_says() {
    for rho in RHOS {
        for x in [0.01, 0.3, 3.0, 100.0, 1e4] {
            // (q, h u, h² a) at h = 1, ω = x, without q̈: that is −x² q.
            let (m, f) = ((2.0 * rho - 1.0) / (rho + 1.0), rho / (rho + 1.0));
            let (gamma, beta) = (0.5 + f - m, 0.25 * (1.0 + f - m) * (1.0 + f - m));
            // new = implicit part on the left.
            let left = Matrix3::new(1.0, 0.0, -beta, 0.0, 1.0, -gamma, (1.0 - f) * x * x, 0.0, 1.0 - m);
            let right = Matrix3::new(1.0, 1.0, 0.5 - beta, 0.0, 1.0, 1.0 - gamma, -f * x * x, 0.0, -m);
            let step = left.try_inverse().unwrap() * right;
            let radius = step.complex_eigenvalues().iter().fold(0.0f64, |most, z| most.max(z.norm()));
            let mut oscillator = |_: f64, q: &V1, _: &V1| Ok::<_, Infallible>(-x * x * q);
            let start = Phase { q: V1::new(1.0), u: V1::new(0.5 * x) };
            let scheme = GeneralizedAlpha::damping(rho);
            let mut stepper = Stepper::with(scheme, &mut oscillator, 0.0, start, 100.0, fixed(1.0)).unwrap();
            // The first step is Newmark's with γ = ½.
            let first = 0.25 * (1.0 + (m - f) * (m - f));
            let mut theory = Vector3::new(1.0, 0.5 * x, -x * x);
            let size = theory.norm();
            for count in 0..40 {
                stepper.step(&mut oscillator, 100.0).unwrap();
                if count == 0 {
                    let q = (1.0 + 0.5 * x - (0.5 - first) * x * x) / (1.0 + first * x * x);
                    let u = 0.5 * x - 0.5 * x * x * (1.0 + q);
                    theory = Vector3::new(q, u, -x * x * (q + (m - f) * (q - 1.0)));
                } else {
                    theory = step * theory;
                }
                let error =
                    (stepper.now().y.q[0] - theory[0]).abs() + (stepper.now().y.u[0] - theory[1]).abs();
                assert!(error < 1e-9 * size, "rho {rho}, h omega {x}: {error:e} of {size:e}");
            }
            println!("rho {rho}, h omega {x}: radius {radius:.6}");
            assert!(radius < 1.0 + 1e-4, "A-stable");
            if x == 0.01 {
                assert!(radius > 1.0 - 1e-6, "what is slow stays");
            }
            if x == 1e4 {
                // Of three equal eigenvalues rounding leaves a third of the digits.
                assert!((radius - rho).abs() < 0.02, "{radius}");
            }
        }
    }
}

/// A stiff oscillation that was there at the start is gone to ρ∞ⁿ n² after n steps, and the slow motion goes
/// on.
#[test]
fn what_is_fast_fades_and_what_is_slow_stays() {
    for rho in [0.0, 0.5, 0.8] {
        // q₀ slow, q₁ on a spring of ω = 1e6.
        let mut system =
            |_: f64, q: &V2, _: &V2| Ok::<_, Infallible>(V2::new(-q[0], 1e12 * (1e-3 * q[0] - q[1])));
        let start = Phase { q: V2::new(1.0, 2e-3), u: V2::zeros() };
        let scheme = GeneralizedAlpha::damping(rho);
        let mut stepper = Stepper::with(scheme, &mut system, 0.0, start, 2.0, fixed(0.01)).unwrap();
        for _ in 0..200 {
            stepper.step(&mut system, 2.0).unwrap();
        }
        let y = stepper.now().y;
        println!("rho {rho}: {y:?}");
        assert!((y.q[0] - 2f64.cos()).abs() < 1e-4 && (y.u[0] + 2f64.sin()).abs() < 1e-4);
        assert!((y.q[1] - 1e-3 * y.q[0]).abs() < 1e-9, "{:e}", y.q[1] - 1e-3 * y.q[0]);
    }
}

#[test]
fn the_error_follows_the_tolerance() {
    let mut truth = Truth::new(1.0, 2.0);
    let exact = truth.to(3.0);
    for rho in RHOS {
        for tolerance in [1e-2, 1e-4, 1e-6] {
            let scheme = GeneralizedAlpha::damping(rho);
            let mut stepper =
                Stepper::with(scheme, &mut Rod, 0.0, at(1.0, 2.0), 3.0, adaptive(tolerance)).unwrap();
            while stepper.now().t < 3.0 {
                stepper.step(&mut Rod, 3.0).unwrap();
            }
            let y = stepper.now().y;
            let error = (y.q - exact.q).norm().max((y.u - exact.u).norm());
            println!(
                "rho {rho}, {tolerance:e}: {error:.1e} in {}, {} rejected",
                stepper.accepted(),
                stepper.rejected()
            );
            assert!(error < 100.0 * tolerance && error > 1e-3 * tolerance, "{error:e} at {tolerance:e}");
        }
    }
}

/// u̇ = 1000 u² has no implicit step of 0.1 from u = 1; a pendulum no way round half the circle in one step.
#[test]
fn what_has_no_solution_is_an_error() {
    let mut blow_up = |_: f64, _: &V1, u: &V1| Ok::<_, Infallible>(V1::new(1e3 * u[0] * u[0]));
    let start = Phase { q: V1::new(0.0), u: V1::new(1.0) };
    for rho in RHOS {
        let scheme = GeneralizedAlpha::damping(rho);
        let mut stepper = Stepper::with(scheme, &mut blow_up, 0.0, start, 1.0, fixed(0.1)).unwrap();
        let error = stepper.step(&mut blow_up, 1.0).unwrap_err();
        assert!(matches!(error, StepError::NotSolved { .. } | StepError::NotFinite { .. }), "{error:?}");
        for h in [0.3, 0.4, 0.5] {
            let scheme = GeneralizedAlpha::damping(rho);
            let mut stepper = Stepper::with(scheme, &mut Rod, 0.0, at(0.0, 8.0), 5.0, fixed(h)).unwrap();
            let mut met = Ok(());
            while stepper.now().t < 5.0 && met.is_ok() {
                met = stepper.step(&mut Rod, 5.0).map(|_| ());
            }
            assert!(matches!(met, Err(StepError::NotSolved { .. })), "rho {rho}, h {h}: {met:?}");
        }
    }
}

/// Memory for the matrices is taken once, where there is an allocator.
#[test]
fn steps_do_not_allocate() {
    let scheme = GeneralizedAlpha::damping(0.8);
    let mut stepper = Stepper::with(scheme, &mut Rod, 0.0, at(1.0, 2.0), 1.0, adaptive(1e-6)).unwrap();
    let info = allocation_counter::measure(|| {
        while stepper.now().t < 1.0 {
            let step = stepper.step(&mut Rod, 1.0).unwrap();
            stepper.dense(&mut Rod, &step).unwrap();
        }
    });
    assert_eq!(info.count_total, 0);
    let StepNode { t, .. } = *stepper.now();
    assert_eq!(t, 1.0);
}

/// States between steps, events, runs that go back in time, and an estimate of the error, as with any method.
#[test]
fn simulations_have_all_that_others_have() {
    let (model, start) = (DoublePendulum::UNIT, at_rest_or_not([1.0, -0.5], [0.3, 1.0]));
    let reference =
        model.simulate(start).until(2.0).tolerance(1e-12).event("level", |s| s.q[0]).run().unwrap();
    for rho in [0.0, 0.8, 1.0] {
        let method = methods::GeneralizedAlpha { rho };
        let run = model.simulate(start).until(2.0).fixed_step(1e-3).method(method).event("level", |s| s.q[0]);
        let motion = run.estimate_error().run().unwrap();
        let error = |t: f64| {
            (motion.at(t).q - reference.at(t).q).norm() + (motion.at(t).u - reference.at(t).u).norm()
        };
        let worst = (0..400).map(|k| error(0.005 * f64::from(k) + 0.0003)).fold(0.0, f64::max);
        let found = motion.global_error().unwrap();
        let told = found.coordinates.error.max(found.velocities.error);
        println!("rho {rho}: {worst:.1e}, told {told:.1e}");
        assert!(worst < 2e-3 && told > 0.2 * worst && told < 5.0 * worst, "{worst:e}, {told:e}");
        assert_eq!(motion.events().len(), reference.events().len());
        for (event, exact) in motion.events().iter().zip(reference.events()) {
            assert!((event.before.t - exact.before.t).abs() < 1e-4);
        }
        let back = model.simulate(motion.end()).until(0.0).fixed_step(1e-3).method(method).run().unwrap();
        assert!((back.end().q - start.q).norm() + (back.end().u - start.u).norm() < 1e-3, "{:?}", back.end());
    }
}
