//! Implicit methods on stiff motions: right where explicit ones crawl, few steps, and no success where their
//! equations are not solved.

use std::convert::Infallible;

use dynamics_runtime::integrate::{
    Accelerations, Canonical, Dense, Dop853, Esdirk4, Expandable, GeneralizedAlpha, Phase, Radau5, Scheme,
    Stabilized, Step, StepError, StepFlags, StepNode, StepOptions, Stepper, Switching, Tolerances,
};
use nalgebra::SVector;

type V1 = SVector<f64, 1>;
type V2 = SVector<f64, 2>;

fn adaptive(tolerance: f64) -> StepOptions {
    StepOptions { tolerances: Tolerances::both(tolerance), fixed: None, first: None, most: f64::INFINITY }
}

/// Counts evaluations of a system of N coordinates.
fn run<S: Scheme<SVector<f64, N>>, const N: usize>(
    a: impl Fn(f64, &SVector<f64, N>, &SVector<f64, N>) -> SVector<f64, N>,
    (q, u): ([f64; N], [f64; N]),
    end: f64,
    tolerance: f64,
) -> (Phase<SVector<f64, N>>, u64, u64) {
    let mut evaluations = 0;
    let mut system = |t: f64, q: &SVector<f64, N>, u: &SVector<f64, N>| {
        evaluations += 1;
        Ok::<_, Infallible>(a(t, q, u))
    };
    let start = Phase { q: SVector::from(q), u: SVector::from(u) };
    let mut stepper = Stepper::<_, S>::new(&mut system, 0.0, start, end, adaptive(tolerance)).unwrap();
    while stepper.now().t < end {
        stepper.step(&mut system, end).unwrap();
    }
    let (y, steps) = (stepper.now().y, stepper.accepted());
    println!(
        "{}, {tolerance:e}: {steps} steps, {} rejected, {evaluations} evaluations",
        S::METHOD,
        stepper.rejected()
    );
    (y, steps, evaluations)
}

/// Van der Pol's equation with ε = 1e-6 as a mechanical system, to t = 2: published end values of the test
/// set of Hairer and Wanner, code `radau5`, in the scaled time of the book.
#[test]
fn van_der_pol_meets_its_published_end() {
    fn check<S: Scheme<V1>>(tolerances: &[f64], most_steps: u64) {
        let exact = [0.1706167732170483e1, -0.8928097010247975];
        for tolerance in tolerances {
            let a = |_: f64, q: &V1, u: &V1| V1::new(((1.0 - q[0] * q[0]) * u[0] - q[0]) / 1e-6);
            let (y, steps, _) = run::<S, 1>(a, ([2.0], [0.0]), 2.0, *tolerance);
            let error = (y.q[0] - exact[0]).abs().max((y.u[0] - exact[1]).abs());
            println!("error {error:.1e}");
            assert!(error < 30.0 * tolerance, "{error:e} at {tolerance:e}");
            assert!(steps < most_steps);
        }
    }
    check::<Radau5<V1>>(&[1e-4, 1e-6, 1e-8, 1e-10], 3000);
    check::<Esdirk4<V1>>(&[1e-3, 1e-4, 1e-5, 1e-6, 1e-8], 10_000);
}

/// The pendulum on a stiff, strongly damped spring, ω = 10⁴ and damping ratio 1: what the spring does decays
/// at once, and then it swings like a rigid one. With its derivatives.
struct Spring {
    stiffness: f64,
    damping: f64,
    evaluations: u32,
}

impl Accelerations<V2> for Spring {
    type Error = Infallible;

    fn accelerations(&mut self, _: f64, q: &V2, u: &V2) -> Result<V2, Infallible> {
        self.evaluations += 1;
        let r = q.norm();
        let force = -(self.stiffness * (r - 1.0) + self.damping * q.dot(u) / r) / r;
        Ok(V2::new(force * q[0], force * q[1] - 9.81))
    }

    fn jacobian(&mut self, at: &StepNode<V2>, by_q: &mut [f64], by_u: &mut [f64]) -> Result<(), Infallible> {
        let Phase { q, u } = at.y;
        let r = q.norm();
        let (n, rate) = (q / r, q.dot(&u) / r);
        let tension = self.stiffness * (r - 1.0) + self.damping * rate;
        for i in 0..2 {
            for j in 0..2 {
                let across = f64::from(i == j) - n[i] * n[j];
                let by_length = self.stiffness * n[j] + self.damping * (u[j] - rate * n[j]) / r;
                by_q[2 * i + j] = -by_length * n[i] - tension * across / r;
                by_u[2 * i + j] = -self.damping * n[i] * n[j];
            }
        }
        Ok(())
    }
}

impl Stabilized<V2> for Spring {}

impl Switching<V2> for Spring {}

impl Canonical<V2> for Spring {}

impl Expandable<V2> for Spring {}

/// From rest to a time: the end and the steps.
fn swing<S: Scheme<V2>>(system: Spring, q: V2, end: f64, options: StepOptions) -> (Phase<V2>, u64) {
    swing_by(S::new(), system, q, end, options)
}

fn swing_by<S: Scheme<V2>>(
    scheme: S,
    mut system: Spring,
    q: V2,
    end: f64,
    options: StepOptions,
) -> (Phase<V2>, u64) {
    let start = Phase { q, u: V2::zeros() };
    let mut stepper = Stepper::with(scheme, &mut system, 0.0, start, end, options).unwrap();
    while stepper.now().t < end {
        stepper.step(&mut system, end).unwrap();
    }
    let (steps, rejected) = (stepper.accepted(), stepper.rejected());
    println!(
        "{}, {options:?}: {steps} steps, {rejected} rejected, {} evaluations",
        S::METHOD,
        system.evaluations
    );
    (stepper.now().y, steps)
}

/// By a Taylor method of order 20 at tolerance 1e-15: the swing on the damped spring from (1, 0), at t = 10.
const SWUNG: Phase<V2> = Phase {
    q: V2::new(0.2750944764827108, -0.9614174924338752),
    u: V2::new(-4.175584765727972, -1.1947781965930147),
};

fn missed(y: &Phase<V2>) -> f64 {
    (y.q - SWUNG.q).norm().max((y.u - SWUNG.u).norm())
}

/// Order 2 with steps of a hundred times what the spring needs, where Rosenbrock and diagonally implicit
/// methods of order 4 return what is wrong; with step control right, at the price of short steps.
#[test]
fn generalized_alpha_follows_a_stiff_direction_that_turns() {
    let spring = || Spring { stiffness: 1e8, damping: 2e4, evaluations: 0 };
    let run = |rho: f64, options| {
        let (y, _) = swing_by(GeneralizedAlpha::damping(rho), spring(), V2::new(1.0, 0.0), 10.0, options);
        println!("rho {rho}: error {:.1e}", missed(&y));
        missed(&y)
    };
    for rho in [0.0, 0.5, 0.8] {
        let [coarse, fine] =
            [0.005, 0.0025].map(|h| run(rho, StepOptions { fixed: Some(h), ..adaptive(1e-9) }));
        assert!(fine < 2e-2 && fine < 0.35 * coarse, "rho {rho}: {coarse:e}, {fine:e}");
        for tolerance in [1e-2, 1e-3, 1e-4] {
            let error = run(rho, adaptive(tolerance));
            assert!(error < 30.0 * tolerance, "rho {rho}: {error:e} at {tolerance:e}");
        }
    }
}

#[test]
fn a_stiff_damped_spring_costs_no_more_than_a_rod() {
    fn check<S: Scheme<V2>>(tolerances: &[f64], times: f64) {
        for tolerance in tolerances {
            let spring = Spring { stiffness: 1e8, damping: 2e4, evaluations: 0 };
            let (y, steps) = swing::<S>(spring, V2::new(1.0, 0.0), 10.0, adaptive(*tolerance));
            let error = missed(&y);
            println!("error {error:.1e}");
            // Below that, rounding errors of positions are forces of 1e-8.
            assert!(error < times * tolerance + 2e-8, "{error:e} at {tolerance:e}");
            assert!(steps < 10_000, "DOP853 needs more than 5e4");
        }
    }
    check::<Radau5<V2>>(&[1e-3, 1e-4, 1e-5, 1e-6, 1e-7, 1e-8, 1e-9, 1e-10, 1e-11], 30.0);
    // Its stages do not follow the spring as it turns: summaries tell that.
    check::<Esdirk4<V2>>(&[1e-2, 1e-3, 1e-4, 1e-5, 1e-6], 600.0);
}

/// Without a damper the spring oscillates, and what an L-stable method damps of it is an error as any other:
/// it is seen, and paid for with steps.
#[test]
fn an_oscillation_that_matters_is_not_damped_away() {
    fn check<S: Scheme<V2>>(of_slow_q: f64, of_fast_u: f64) {
        let spring = |stiffness| Spring { stiffness, damping: 0.0, evaluations: 0 };
        // Gravity excites a little: 30 digits are known.
        let exact = V2::new(-0.986_290_742_802_133_8, -0.165_046_311_566_997_5);
        // Sixteen oscillations that are started by hand, of 0.1 in the velocity.
        let start = Phase { q: V2::new(1.001, 0.0), u: V2::zeros() };
        let mut stepper =
            Stepper::<_, Dop853<V2>>::new(&mut spring(1e4), 0.0, start, 1.0, adaptive(1e-13)).unwrap();
        while stepper.now().t < 1.0 {
            stepper.step(&mut spring(1e4), 1.0).unwrap();
        }
        let truth = stepper.now().y;
        for tolerance in [1e-4, 1e-6, 1e-8] {
            let (y, _) = swing::<S>(spring(1e6), V2::new(1.0, 0.0), 1.0, adaptive(tolerance));
            println!("error {:.1e}", (y.q - exact).norm());
            assert!((y.q - exact).norm() < of_slow_q * tolerance, "{y:?}");
            let (y, _) = swing::<S>(spring(1e4), V2::new(1.001, 0.0), 1.0, adaptive(tolerance));
            let (of_q, of_u) = ((y.q - truth.q).norm(), (y.u - truth.u).norm());
            println!("errors {of_q:.1e}, {of_u:.1e}");
            // ω = 100: velocities err by a hundred times what positions do.
            assert!(
                of_q < 0.03 * of_fast_u * tolerance && of_u < of_fast_u * tolerance,
                "{of_q:e}, {of_u:e} at {tolerance:e}"
            );
        }
    }
    check::<Radau5<V2>>(1.0, 100.0);
    // Of lower order, with the same sign in every step.
    check::<Esdirk4<V2>>(4.0, 500.0);
}

/// u̇ = 1000 u² has no implicit step of 0.1 from u = 1: that is an error and no state, with a fixed step; one
/// that may be shorter gets to where the motion itself ends, at t = 0.001.
#[test]
fn equations_without_a_solution_are_an_error() {
    fn check<S: Scheme<V1>>() {
        let mut blow_up = |_: f64, _: &V1, u: &V1| Ok::<_, Infallible>(V1::new(1e3 * u[0] * u[0]));
        let start = Phase { q: V1::new(0.0), u: V1::new(1.0) };
        let fixed = StepOptions { fixed: Some(0.1), ..adaptive(1e-6) };
        let mut stepper = Stepper::<_, S>::new(&mut blow_up, 0.0, start, 1.0, fixed).unwrap();
        let failure = stepper.step(&mut blow_up, 1.0).unwrap_err();
        assert!(matches!(failure, StepError::NotSolved { coordinate: 0, .. }), "{failure:?}");
        assert_eq!(stepper.now().y, start);

        let mut stepper = Stepper::<_, S>::new(&mut blow_up, 0.0, start, 1.0, adaptive(1e-6)).unwrap();
        let failure = loop {
            if let Err(failure) = stepper.step(&mut blow_up, 1.0) {
                break failure;
            }
        };
        assert!((stepper.now().t - 1e-3).abs() < 1e-8, "{failure:?} at {}", stepper.now().t);
    }
    check::<Radau5<V1>>();
    check::<Esdirk4<V1>>();
}

/// A step that leads to where there are no accelerations, or whose equations have no solution, has no end:
/// its start is none.
#[test]
fn steps_without_a_solution_have_no_end() {
    fn end<S: Scheme<V1>>(a: impl Fn(f64, &V1) -> f64, h: f64) -> Option<(Phase<V1>, f64)> {
        let mut system = |t: f64, _: &V1, u: &V1| Ok::<_, Infallible>(V1::new(a(t, u)));
        let y = Phase { q: V1::new(0.0), u: V1::new(1.0) };
        let start = StepNode { t: 0.0, y, a: system(0.0, &y.q, &y.u).unwrap() };
        let step = Step { start, end: start, h, flags: StepFlags::default() };
        Stepper::replay_end(&mut S::new(), &mut system, &step, &Tolerances::both(1e-6)).unwrap()
    }
    fn check<S: Scheme<V1>>() {
        let ends = |t: f64, _: &V1| if t > 0.05 { f64::NAN } else { 1.0 };
        assert_eq!(end::<S>(ends, 0.1), None, "{}", S::METHOD);
        assert_eq!(end::<S>(|_, u| 1e3 * u[0] * u[0], 0.1), None, "{}", S::METHOD);
        let (end, error) = end::<S>(ends, 0.04).unwrap();
        assert!((end.u[0] - 1.04).abs() < 1e-12 && error < 1.0, "{}", S::METHOD);
    }
    check::<Radau5<V1>>();
    check::<Esdirk4<V1>>();
    check::<GeneralizedAlpha<V1>>();
}

/// A step made again for its interpolant begins at what is known of it, also where the stiff direction turns
/// so fast that each stage needs a Jacobian of its own: it had begun at nothing there, and ended elsewhere or
/// nowhere.
#[test]
fn steps_made_again_begin_where_they_ended() {
    let evaluations = std::cell::Cell::new(0u64);
    let mut spring = |_: f64, q: &V2, u: &V2| {
        evaluations.set(evaluations.get() + 1);
        let (r, along) = (q.norm(), q / q.norm());
        let pull = 1e8 * (r - 1.0) + 2e4 * along.dot(u);
        Ok::<V2, Infallible>(V2::new(0.0, -9.81) - along * pull)
    };
    let tolerances = Tolerances::both(1e-6);
    let start = Phase { q: V2::new(1.0, 0.0), u: V2::zeros() };
    let mut stepper = Stepper::<V2, Radau5<V2>>::new(&mut spring, 0.0, start, 2.0, adaptive(1e-6)).unwrap();
    let mut steps = Vec::new();
    while stepper.now().t < 2.0 {
        steps.push(stepper.step(&mut spring, 2.0).unwrap());
    }
    let made = evaluations.replace(0);
    for step in &steps {
        let dense = Stepper::replay(&mut Radau5::new(), &mut spring, step, &tolerances).unwrap().unwrap();
        let end = dense.at(1.0);
        assert!((end.q - step.end.y.q).norm() < 1e-9, "{}", step.end.t);
    }
    let again = evaluations.get();
    println!("{made} evaluations in {} steps, {again} to make them again", steps.len());
    // Each with a Jacobian of its own, here by differences.
    assert!(again < made + made / 5, "{made} {again}");
}
