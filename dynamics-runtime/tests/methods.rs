//! Order of convergence of every method and of its dense output, step control, and steps without allocation.

use crate::common;

use std::convert::Infallible;

use common::constrained::Rod;
use common::*;
use dynamics_runtime::integrate::{
    AdamsBashforth2, AdamsBashforth3, AdamsBashforth4, Composition4, Composition6, Composition8, Dense,
    Dop853, DormandPrince5, Esdirk4, ExplicitEuler, Gauss4, Gauss6, GeneralizedAlpha, GraggBulirschStoer,
    Heun, Phase, Radau5, Rk4, Scheme, SemiImplicitEuler, StepError, StepNode, StepOptions, Stepper,
    StormerVerlet, Tolerances, Tsit5, Verner9,
};
use dynamics_runtime::methods;
use dynamics_runtime::simulate::Simulate;
use nalgebra::SVector;

type V = SVector<f64, 1>;

/// q = exp(sin t) solves q̈ = q̇²/q − q sin t: nonlinear, and it depends on t, q and q̇.
fn problem(t: f64, q: &V, u: &V) -> Result<V, Infallible> {
    Ok(V::new(u[0] * u[0] / q[0] - q[0] * t.sin()))
}

fn exact(t: f64) -> Phase<V> {
    let q = t.sin().exp();
    Phase { q: V::new(q), u: V::new(t.cos() * q) }
}

fn distance(x: &Phase<V>, y: &Phase<V>) -> f64 {
    (x.q - y.q).norm().max((x.u - y.u).norm())
}

fn fixed(h: f64) -> StepOptions {
    // Implicit methods solve their equations as exactly as this asks for.
    StepOptions { tolerances: Tolerances::both(1e-13), fixed: Some(h), first: None, most: f64::INFINITY }
}

/// Largest error at the ends of n equal steps from t = 0.3 to 3.3.
fn global_error<S: Scheme<V>>(n: u32) -> f64 {
    let (start, end) = (0.3, 3.3);
    let options = fixed(3.0 / f64::from(n));
    let mut system = problem;
    let mut stepper = Stepper::<V, S>::new(&mut system, start, exact(start), end, options).unwrap();
    let mut worst = 0.0f64;
    while stepper.now().t < end {
        stepper.step(&mut system, end).unwrap();
        worst = worst.max(distance(&stepper.now().y, &exact(stepper.now().t)));
    }
    assert_eq!(stepper.accepted(), u64::from(n), "the last step is a whole one");
    worst
}

/// Largest error within one step from exact values: (of q, of u).
fn dense_error<S: Scheme<V>>(h: f64) -> (f64, f64) {
    let start = 0.3;
    let mut system = problem;
    let mut stepper = Stepper::<V, S>::new(&mut system, start, exact(start), 9.0, fixed(h)).unwrap();
    let step = stepper.step(&mut system, 9.0).unwrap();
    let dense = stepper.dense(&mut system, &step).unwrap();
    assert_eq!(dense.at(0.0), step.start.y);
    assert!(distance(&dense.at(1.0), &step.end.y) < 1e-15 * 10.0);
    (1..20).map(|k| f64::from(k) / 20.0).fold((0.0, 0.0), |(worst_q, worst_u), theta| {
        let (found, true_) = (dense.at(theta), exact(start + theta * h));
        (worst_q.max((found.q - true_.q).norm()), worst_u.max((found.u - true_.u).norm()))
    })
}

/// Observed order between two errors at steps in ratio 2.
fn order(coarse: f64, fine: f64) -> f64 {
    (coarse / fine).log2()
}

fn check<S: Scheme<V>>(steps: u32, local_q: f64, local_u: f64, h: f64) {
    let global = order(global_error::<S>(steps), global_error::<S>(2 * steps));
    let (coarse, fine) = (dense_error::<S>(h), dense_error::<S>(0.5 * h));
    let (of_q, of_u) = (order(coarse.0, fine.0), order(coarse.1, fine.1));
    println!("{:22} step {global:.2}, dense output, local: q {of_q:.2}, u {of_u:.2}", S::METHOD.to_string());
    // A lower order is a fault. A higher one is seen where the coefficients were chosen to make the leading
    // error term small, as in Dormand–Prince 5(4): its fifth order shows only below errors of 1e-12.
    let excess = global - f64::from(S::ORDER);
    assert!(excess > -0.35 && excess < 0.95, "{}: order {global}", S::METHOD);
    assert!(of_q > local_q - 0.3, "{}: dense output of q has local order {of_q}", S::METHOD);
    assert!(of_u > local_u - 0.3, "{}: dense output of u has local order {of_u}", S::METHOD);
}

/// A method of order p has the local error O(hᵖ⁺¹) within the step too, where its dense output has order p.
#[test]
fn orders_of_convergence() {
    // The quintic's slope divides the error of the end by h; the error that has accumulated is O(h⁴) as well.
    check::<Rk4<V>>(40, 5.0, 4.0, 0.1);
    check::<DormandPrince5<V>>(80, 5.0, 5.0, 0.05);
    check::<Dop853<V>>(12, 8.0, 8.0, 0.15);
    check::<Tsit5<V>>(80, 5.0, 5.0, 0.05);
    check::<Verner9<V>>(10, 9.0, 9.0, 0.4);
    check::<GraggBulirschStoer<V>>(4, 12.0, 11.0, 0.8);
    check::<Radau5<V>>(20, 5.0, 4.0, 0.1);
    check::<Esdirk4<V>>(40, 5.0, 4.0, 0.1);
    check::<ExplicitEuler<V>>(4000, 2.0, 1.0, 0.01);
    check::<Heun<V>>(200, 3.0, 2.0, 0.05);
    check::<AdamsBashforth2<V>>(400, 3.0, 2.0, 0.05);
    check::<AdamsBashforth3<V>>(400, 4.0, 3.0, 0.05);
    check::<AdamsBashforth4<V>>(200, 5.0, 4.0, 0.05);
}

/// The growth of an oscillator q̈ = −q per step, or what stays of a fast decay, agree with the polynomials
/// of stability; multistep methods are stable inside their borders and not outside.
#[test]
fn teaching_methods_are_stable_as_far_as_they_say() {
    /// √(q² + u²) of q̈ = −ω² q − 2d u from (1, 0) after n steps of 1, by its first value.
    fn amplitude<S: Scheme<V>>(square: f64, damping: f64, n: u32) -> f64 {
        let mut system = |_: f64, q: &V, u: &V| Ok::<V, Infallible>(-q * square - u * damping);
        let start = Phase { q: V::new(1.0), u: V::new(0.0) };
        let end = f64::from(n);
        let mut stepper = Stepper::<V, S>::new(&mut system, 0.0, start, end, fixed(1.0)).unwrap();
        for _ in 0..n {
            stepper.step(&mut system, end).unwrap();
        }
        stepper.now().y.q[0].hypot(stepper.now().y.u[0] / square.sqrt())
    }
    let close = |found: f64, expected: f64| assert!((found / expected - 1.0).abs() < 1e-12, "{found}");
    let omega = 0.3f64;
    close(amplitude::<ExplicitEuler<V>>(omega * omega, 0.0, 7), (1.0 + omega * omega).powf(3.5));
    close(amplitude::<Heun<V>>(omega * omega, 0.0, 7), (1.0 + omega.powi(4) / 4.0).powf(3.5));
    // Critically damped, λ = −x twice: bounded inside, unbounded outside.
    fn borders<S: Scheme<V>>() {
        let [inside, outside] = [0.97, 1.03].map(|part| {
            let x = part * S::STABILITY_BORDER;
            amplitude::<S>(x * x, 2.0 * x, 2000)
        });
        assert!(inside < 1e-3 && outside > 1e3, "{}: {inside:e}, {outside:e}", S::METHOD);
    }
    borders::<ExplicitEuler<V>>();
    borders::<Heun<V>>();
    borders::<AdamsBashforth2<V>>();
    borders::<AdamsBashforth3<V>>();
    borders::<AdamsBashforth4<V>>();
    // On the imaginary axis: order 2 grows slowly everywhere, orders 3 and 4 have an interval.
    let ten_thousand =
        |amplitude: fn(f64, f64, u32) -> f64, omega: f64| amplitude(omega * omega, 0.0, 10_000);
    assert!(ten_thousand(amplitude::<AdamsBashforth2<V>>, 0.3) > 1e3);
    for (amplitude, border) in [
        (amplitude::<AdamsBashforth3<V>> as fn(f64, f64, u32) -> f64, 0.72),
        (amplitude::<AdamsBashforth4<V>>, 0.43),
    ] {
        assert!(ten_thousand(amplitude, 0.98 * border) < 2.0);
        assert!(ten_thousand(amplitude, 1.02 * border) > 1e3);
    }
}

/// Constraints are kept by projection, and what is left converges with the order of the method; a run without
/// a fixed step is refused.
#[test]
fn teaching_methods_keep_constraints() {
    let rod = Rod { m: 2.0, l: 1.5, g: 9.81 };
    let start = at_rest_or_not([1.5, 0.0], [0.0, -1.0]);
    let exact = rod.simulate(start).until(2.0).tolerance(1e-13).run().unwrap().end();
    for (method, h) in [
        (methods::Any::<Rod>::from(methods::ExplicitEuler), 1e-4),
        (methods::Heun.into(), 2e-3),
        (methods::AdamsBashforth2.into(), 2e-3),
        (methods::AdamsBashforth3.into(), 5e-3),
        (methods::AdamsBashforth4.into(), 5e-3),
    ] {
        let error = |h: f64| {
            let motion = rod.simulate(start).until(2.0).fixed_step(h).method(&method).run().unwrap();
            let off = motion.steps().map(|state| (state.q.norm() - rod.l).abs()).fold(0.0, f64::max);
            assert!(off < 1e-12, "{method}: {off:e}");
            (motion.end().q - exact.q).norm()
        };
        let found = order(error(h), error(0.5 * h));
        assert!((found - f64::from(method.method().order())).abs() < 0.3, "{method}: order {found}");
        let refused = rod.simulate(start).until(2.0).method(&method).run().unwrap_err();
        assert!(refused.to_string().contains("give `.fixed_step(h)`"), "{refused}");
    }
}

/// The step that ends a run early continues from the steps before it; an event, a repeated step and another
/// state start the method anew, at no loss of order.
#[test]
fn multistep_methods_start_anew_where_steps_are_not_equal() {
    fn error_of_last<S: Scheme<V>>(h: f64) -> f64 {
        // The last step is a third of the others.
        let end = 0.3 + (20.0 + 1.0 / 3.0) * h;
        let mut system = problem;
        let mut stepper = Stepper::<V, S>::new(&mut system, 0.3, exact(0.3), end, fixed(h)).unwrap();
        while stepper.now().t < end {
            stepper.step(&mut system, end).unwrap();
        }
        distance(&stepper.now().y, &exact(end))
    }
    fn check<S: Scheme<V>>() {
        // 20 steps each: the global error is of order p + 1 in h.
        let local = order(error_of_last::<S>(0.02), error_of_last::<S>(0.01));
        assert!((local - f64::from(S::ORDER) - 1.0).abs() < 0.5, "{}: {local}", S::METHOD);
    }
    check::<AdamsBashforth2<V>>();
    check::<AdamsBashforth3<V>>();
    check::<AdamsBashforth4<V>>();

    let mut system = problem;
    let mut stepper =
        Stepper::<V, AdamsBashforth4<V>>::new(&mut system, 0.3, exact(0.3), 9.0, fixed(0.05)).unwrap();
    let mut last = stepper.step(&mut system, 9.0).unwrap();
    for _ in 0..9 {
        last = stepper.step(&mut system, 9.0).unwrap();
    }
    // A step that is repeated whole has the same bits, cut short it is the method's own.
    let again = stepper.shorten(&mut system, &last, last.end.t).unwrap();
    assert_eq!(again.end, last.end);
    let cut = stepper.shorten(&mut system, &last, last.start.t + 0.02).unwrap();
    let [before, error] = [cut.start, cut.end].map(|node| distance(&node.y, &exact(node.t)));
    assert!(error < 1.2 * before + 1e-6, "{before:e}, {error:e}");
    for _ in 0..10 {
        stepper.step(&mut system, 9.0).unwrap();
    }
    assert!(distance(&stepper.now().y, &exact(stepper.now().t)) < 1e-4);
    let state = exact(2.0);
    stepper.restart(&mut system, 2.0, state, 9.0).unwrap();
    for _ in 0..10 {
        stepper.step(&mut system, 9.0).unwrap();
    }
    assert!(distance(&stepper.now().y, &exact(stepper.now().t)) < 1e-4);
}

/// Largest error of u within a step of 10⁻³ of q̈ = −sin t, from exact values: of q = sin t + `origin` only
/// the origin's rounding is seen there.
fn velocity_error<S: Scheme<V>>(origin: f64) -> f64 {
    let (start, h) = (0.7f64, 1e-3);
    let mut pushed = |t: f64, _: &V, _: &V| Ok::<V, Infallible>(V::new(-t.sin()));
    let y = Phase { q: V::new(origin + start.sin()), u: V::new(start.cos()) };
    let mut stepper = Stepper::<V, S>::new(&mut pushed, start, y, 9.0, fixed(h)).unwrap();
    let step = stepper.step(&mut pushed, 9.0).unwrap();
    let errors = |dense: &dyn Dense<V>| {
        let at = |k: u32| dense.at(f64::from(k) / 20.0).u[0] - (start + f64::from(k) / 20.0 * step.h).cos();
        (0..=20).map(|k| at(k).abs()).fold(0.0, f64::max)
    };
    // As a run has it, and as it is made again for a motion that is recorded.
    let of_run = errors(&stepper.dense(&mut pushed, &step).unwrap());
    let again = S::new()
        .dense_from_ends(&mut pushed, &step.start, &step.end, step.h, &Tolerances::both(1e-13))
        .unwrap();
    again.map_or(of_run, |dense| of_run.max(errors(&dense)))
}

/// Far from the origin q has few digits of a short step, and between its ends u must not be read from them:
/// at 10⁸ they are 10⁻⁵ of it.
#[test]
fn velocities_between_steps_keep_their_digits_far_from_the_origin() {
    fn check<S: Scheme<V>>() {
        let [near, far, beyond] = [0.0, 1e8, -1e12].map(velocity_error::<S>);
        println!("{:40} {near:.1e}, at 1e8 {far:.1e}, at -1e12 {beyond:.1e}", S::METHOD.to_string());
        assert!(far.max(beyond) < 2.0 * near + 1e-13, "{}: {near:e}, {far:e}, {beyond:e}", S::METHOD);
    }
    check::<Rk4<V>>();
    check::<DormandPrince5<V>>();
    check::<Tsit5<V>>();
    check::<Dop853<V>>();
    check::<Verner9<V>>();
    check::<GraggBulirschStoer<V>>();
    check::<Radau5<V>>();
    check::<Esdirk4<V>>();
    check::<GeneralizedAlpha<V>>();
    check::<Gauss4<V>>();
    check::<Gauss6<V>>();
    check::<SemiImplicitEuler<V>>();
    check::<StormerVerlet<V>>();
    check::<Composition4<V>>();
    check::<Composition6<V>>();
    check::<Composition8<V>>();
    check::<ExplicitEuler<V>>();
    check::<Heun<V>>();
    check::<AdamsBashforth4<V>>();
}

/// What a step leaves that is tried: its end, its error, its stages and the interpolant.
fn tried<S: Scheme<V>>(again: bool) -> Vec<u64> {
    let (mut scheme, mut system, h) = (S::new(), problem, 0.2);
    let (y, tolerances) = (exact(0.3), Tolerances::both(1e-6));
    let start = StepNode { t: 0.3, y, a: problem(0.3, &y.q, &y.u).unwrap() };
    let attempt = match again {
        true => scheme.replay_attempt(&mut system, &start, h, &tolerances),
        false => scheme.attempt(&mut system, &start, h, &tolerances),
    };
    let (y, error) = attempt.unwrap();
    let end = StepNode { t: 0.5, y, a: scheme.finish(&mut system, 0.5, &y).unwrap() };
    let stiffness = scheme.stiffness(h, &end);
    let dense = scheme.dense(&mut system, &start, &end, h).unwrap();
    let mut phases = vec![y, scheme.error_vector(), dense.at(0.3), dense.at(0.7)];
    phases.extend(scheme.stages());
    let values =
        phases.iter().flat_map(|phase| [phase.q[0], phase.u[0]]).chain([error, end.a[0]]).chain(stiffness);
    values.map(f64::to_bits).collect()
}

/// Steps are made once more by other code than they were made by: interpolants, and ends at events, would be
/// of other steps.
#[test]
fn a_step_that_is_made_once_more_is_the_same_to_the_last_bit() {
    fn same<S: Scheme<V>>() {
        assert_eq!(tried::<S>(false), tried::<S>(true), "{}", S::METHOD);
    }
    same::<Rk4<V>>();
    same::<DormandPrince5<V>>();
    same::<Tsit5<V>>();
    same::<Dop853<V>>();
    same::<Verner9<V>>();
    same::<GraggBulirschStoer<V>>();
    same::<Radau5<V>>();
    same::<Esdirk4<V>>();
    same::<ExplicitEuler<V>>();
    same::<Heun<V>>();
    same::<AdamsBashforth2<V>>();
}

/// The error at the end follows the tolerance, on a problem with slow and fast parts.
#[test]
fn the_error_follows_the_tolerance() {
    let start = at_rest_or_not([0.1, 0.0], [0.0, 19f64.sqrt()]);
    let end_at = |method: &methods::Any<Kepler>, tolerance| {
        let motion = Kepler.simulate(start).until(6.0).method(method).tolerance(tolerance).run().unwrap();
        motion.end()
    };
    let reference = end_at(&methods::Dop853.into(), 3e-15);
    let listed = [methods::Any::from(methods::DormandPrince5), methods::Tsit5.into(), methods::Dop853.into()];
    for method in listed.iter().chain(&[
        methods::Verner9.into(),
        methods::GraggBulirschStoer.into(),
        methods::Radau5.into(),
        methods::Esdirk4.into(),
    ]) {
        for tolerance in [1e-5, 1e-7, 1e-9, 1e-11] {
            let error = (end_at(method, tolerance).q - reference.q).norm();
            println!("{method} {tolerance:e}: {error:.1e}");
            assert!(error < 500.0 * tolerance, "{method} errs by {error:e} at tolerance {tolerance:e}");
            assert!(
                error > 1e-3 * tolerance,
                "{method} works too hard at tolerance {tolerance:e}: {error:e}"
            );
        }
    }
}

#[test]
fn backwards_in_time_returns_to_the_start() {
    let start = at_rest_or_not([2.0, -0.5], [0.3, 1.0]);
    let fifth = [(methods::Any::from(methods::DormandPrince5), 1e-11), (methods::Tsit5.into(), 1e-11)];
    for (method, tolerance) in fifth.into_iter().chain([
        (methods::Dop853.into(), 1e-13),
        (methods::Verner9.into(), 1e-13),
        (methods::GraggBulirschStoer.into(), 1e-13),
    ]) {
        let there = DoublePendulum::UNIT
            .simulate(start)
            .until(3.0)
            .tolerance(tolerance)
            .method(&method)
            .run()
            .unwrap();
        let back = DoublePendulum::UNIT
            .simulate(there.end())
            .until(0.0)
            .tolerance(tolerance)
            .method(&method)
            .run()
            .unwrap();
        let error = (back.end().q - start.q).norm() + (back.end().u - start.u).norm();
        println!("{method}: {error:.1e}");
        assert!(error < 1e3 * tolerance);
        assert_eq!((back.start_time(), back.end_time()), (3.0, 0.0));
        let (a, b) = (there.at(1.3), back.at(1.3));
        assert!((a.q - b.q).norm() < 1e3 * tolerance, "dense output both ways");
    }
}

/// Chosen first steps are small enough to be accepted and not absurdly so.
#[test]
fn first_steps_suit_the_problem() {
    for scale in [1e-3, 1.0, 1e3] {
        let model = Oscillator { omega: 1.0 / scale };
        let motion =
            model.simulate(at_rest_or_not([1.0], [0.0])).until(scale).tolerance(1e-10).run().unwrap();
        let mut times = motion.steps().map(|s| s.t);
        let first = (times.next().unwrap() - times.next().unwrap()).abs();
        assert!(first < scale && first > 1e-4 * scale, "first step {first} for the time scale {scale}");
        assert!(motion.counts().rejected <= 1, "{:?}", motion.counts());
    }
}

/// An infinite acceleration that only long steps meet shortens the step and does no harm.
#[test]
fn a_trial_step_into_a_forbidden_region_is_repeated() {
    // q̈ is not a number beyond q = 1, which the motion q = sin t approaches and does not pass.
    let model = Closure(|_, q, _| if q > 1.0 + 1e-6 { f64::NAN } else { -q });
    let motion = model.simulate(at_rest_or_not([0.0], [1.0])).until(4.0).first_step(3.0).run().unwrap();
    assert!((motion.end().q[0] - 4f64.sin()).abs() < 1e-7);
    assert!(motion.counts().rejected > 0);
}

#[test]
fn stiffness_is_noticed_and_smooth_problems_are_not_called_stiff() {
    notices_stiffness(methods::DormandPrince5);
    notices_stiffness(methods::Tsit5);
    notices_stiffness(methods::Dop853);
    notices_stiffness(methods::Verner9);
    notices_stiffness(methods::GraggBulirschStoer);
}

fn notices_stiffness(method: impl methods::Choice + std::fmt::Debug) {
    let oscillator = Oscillator { omega: 1e4 };
    let stiff = Closure(|t, _, u| -1e3 * (u + t.sin()));
    let motion =
        stiff.simulate(at_rest_or_not([1.0], [0.0])).until(2.0).tolerance(1e-5).method(method).run().unwrap();
    let summary = motion.verify();
    let stiff_at = summary.stiff_at.unwrap_or_else(|| panic!("{method:?} sees no stiffness in\n{summary}"));
    assert!(stiff_at < 0.5 && summary.to_string().contains("stiff from t = "));
    let fast = oscillator.simulate(at_rest_or_not([1.0], [0.0])).until(0.5).method(method);
    assert_eq!(fast.run().unwrap().counts().stiff_at, None, "{method:?} takes a fast oscillator for stiff");
    let easy = Kepler.simulate(at_rest_or_not([0.1, 0.0], [0.0, 19f64.sqrt()])).until(50.0).method(method);
    assert_eq!(easy.run().unwrap().counts().stiff_at, None, "{method:?}");
}

/// A slow pendulum tied to what fades fast: what is left of that is small beside the changes of the slow
/// motion, and must be told from them.
#[test]
fn stiffness_is_noticed_at_tight_tolerances() {
    type V2 = SVector<f64, 2>;
    fn stiff_at<S: Scheme<V2>>(tolerance: f64) -> Option<f64> {
        let mut system = |_: f64, q: &V2, u: &V2| {
            Ok::<V2, Infallible>(V2::new(-q[0].sin() - 0.01 * q[1], -9e4 * q[1] - 0.01 * q[0] - 900.0 * u[1]))
        };
        let start = Phase { q: V2::new(1.0, 1e-3), u: V2::zeros() };
        let tolerances = Tolerances::both(tolerance);
        let options = StepOptions { tolerances, fixed: None, first: None, most: f64::INFINITY };
        let mut stepper = Stepper::<V2, S>::new(&mut system, 0.0, start, 5.0, options).unwrap();
        while stepper.now().t < 5.0 {
            stepper.step(&mut system, 5.0).unwrap();
        }
        stepper.stiff_at()
    }
    for tolerance in [1e-6, 1e-9] {
        let [dop853, extrapolation] =
            [stiff_at::<Dop853<V2>>(tolerance), stiff_at::<GraggBulirschStoer<V2>>(tolerance)];
        assert!(dop853.is_some_and(|t| t < 2.0), "{tolerance:e}: {dop853:?}");
        assert!(extrapolation.is_some_and(|t| t < 2.0), "{tolerance:e}: {extrapolation:?}");
    }
}

/// The stepper in a program of its own: the last step ends exactly at the limit, and errors leave it at the
/// last good state.
#[test]
fn the_stepper_meets_its_limit_and_stands_where_it_failed() {
    let mut blow_up = |_: f64, q: &V, _: &V| Ok::<V, Infallible>(V::new(2.0 * q[0].powi(3)));
    // q = 1/(1 − t) blows up at t = 1.
    let start = Phase { q: V::new(1.0), u: V::new(1.0) };
    let options =
        StepOptions { tolerances: Tolerances::both(1e-10), fixed: None, first: None, most: f64::INFINITY };
    let mut stepper = Stepper::<V, Dop853<V>>::new(&mut blow_up, 0.0, start, 2.0, options).unwrap();
    let failure = loop {
        if let Err(error) = stepper.step(&mut blow_up, 2.0) {
            break error;
        }
    };
    assert!(matches!(failure, StepError::StepTooSmall { .. } | StepError::NotFinite { .. }), "{failure:?}");
    let now = stepper.now();
    assert!((now.t - 1.0).abs() < 1e-5 && now.y.q[0] > 1e4, "{now:?}");
}

/// Four lanes at once: the first acceleration that is none is named, not what it makes of the others.
#[test]
fn extrapolation_names_what_is_not_finite() {
    type V2 = SVector<f64, 2>;
    let mut broken = |t: f64, q: &V2, _: &V2| {
        let second = if t > 1.0 { f64::NAN } else { -q[1] };
        Ok::<V2, Infallible>(V2::new(-q[0] - 0.1 * q[1], second))
    };
    let start = Phase { q: V2::new(1.0, 0.5), u: V2::zeros() };
    let options =
        StepOptions { tolerances: Tolerances::both(1e-9), fixed: None, first: None, most: f64::INFINITY };
    let mut stepper =
        Stepper::<V2, GraggBulirschStoer<V2>>::new(&mut broken, 0.0, start, 2.0, options).unwrap();
    let failure = loop {
        if let Err(error) = stepper.step(&mut broken, 2.0) {
            break error;
        }
    };
    assert!(matches!(failure, StepError::NotFinite { coordinate: 1, .. }), "{failure:?}");
    assert!((stepper.now().t - 1.0).abs() < 1e-9, "{}", stepper.now().t);
}

/// Without an error, as in free flight, the proposed step grows with every step, however short those are that
/// the limits leave. What comes then is met with a step that was tried.
#[test]
fn a_step_that_grew_in_free_flight_is_taken_back_at_once() {
    let mut push = |t: f64, q: &V, _: &V| {
        Ok::<V, core::convert::Infallible>(if t < 100.0 { V::zeros() } else { -100.0 * q })
    };
    let start = Phase { q: V::new(1.0), u: V::new(0.0) };
    let options =
        StepOptions { tolerances: Tolerances::both(1e-9), fixed: None, first: None, most: f64::INFINITY };
    let mut stepper = Stepper::<V, Dop853<V>>::new(&mut push, 0.0, start, 200.0, options).unwrap();
    for limit in (1..=100).map(f64::from).chain([101.0]) {
        while stepper.now().t < limit {
            stepper.step(&mut push, limit).unwrap();
        }
    }
    assert!(stepper.rejected() > 0 && stepper.rejected() < 20, "{}", stepper.rejected());
    assert!((stepper.now().y.q[0] - 10.0f64.cos()).abs() < 1e-7, "{}", stepper.now().y.q[0]);
}

/// No step allocates: the whole run of a stepper, and a run without a record, however long, allocate a fixed
/// number of times.
#[test]
fn steps_do_not_allocate() {
    fn run<S: Scheme<SVector<f64, 2>>>(h: Option<f64>) -> u64 {
        let model = DoublePendulum::UNIT;
        let mut steps = 0;
        let info = allocation_counter::measure(|| {
            let mut system = |t: f64, q: &SVector<f64, 2>, u: &SVector<f64, 2>| {
                model.q_ddot(&PlainState {
                    t,
                    q: *q,
                    u: *u,
                    inputs: SVector::zeros(),
                    active_set: Default::default(),
                })
            };
            let start = Phase { q: SVector::from([2.0, -0.5]), u: SVector::zeros() };
            let tolerances = Tolerances::both(1e-9);
            let options = StepOptions { tolerances, fixed: h, first: None, most: f64::INFINITY };
            let mut stepper = Stepper::<_, S>::new(&mut system, 0.0, start, 10.0, options).unwrap();
            while stepper.now().t < 10.0 {
                let step = stepper.step(&mut system, 10.0).unwrap();
                let dense = stepper.dense(&mut system, &step).unwrap();
                assert!(dense.at(0.5).is_finite());
            }
            steps = stepper.accepted();
        });
        assert!(steps > 100);
        info.count_total
    }
    assert_eq!(run::<Rk4<SVector<f64, 2>>>(Some(0.01)), 0);
    // Its matrices stand on the heap: once a run.
    assert_eq!(run::<Radau5<SVector<f64, 2>>>(None), 1);
    assert_eq!(run::<Esdirk4<SVector<f64, 2>>>(None), 1);
    assert_eq!(run::<DormandPrince5<SVector<f64, 2>>>(None), 0);
    assert_eq!(run::<Tsit5<SVector<f64, 2>>>(None), 0);
    assert_eq!(run::<Dop853<SVector<f64, 2>>>(None), 0);
    assert_eq!(run::<Verner9<SVector<f64, 2>>>(None), 0);
    assert_eq!(run::<GraggBulirschStoer<SVector<f64, 2>>>(Some(0.05)), 0);

    let start = at_rest_or_not([2.0, -0.5], [0.0, 0.0]);
    let observed = |end: f64| {
        let mut states = 0u64;
        let simulation = DoublePendulum::UNIT.simulate(start).until(end);
        let info = allocation_counter::measure(|| {
            simulation.run_with(|_| states += 1).unwrap();
        });
        (states, info.count_total)
    };
    // Every 500 steps an implicit one is tried, whose matrices stand on the heap: once a run.
    let ((few, short), (many, long)) = (observed(300.0), observed(900.0));
    assert!(few > 2 * 500 && many > few + 4 * 500, "{few} {many}");
    assert_eq!(short, long, "allocations of a run without a record must not grow with its steps");
}

/// 1,000 s of a chaotic double pendulum.
#[test]
fn the_energy_of_the_double_pendulum_holds_for_a_thousand_seconds() {
    let start = at_rest_or_not([2.0 * std::f64::consts::PI / 3.0, -std::f64::consts::PI / 18.0], [0.0, 0.0]);
    let motion = DoublePendulum::UNIT.simulate(start).until(1000.0).tolerance(1e-12).run().unwrap();
    let summary = motion.verify();
    println!("{summary}");
    assert!(summary.energy_drift < 1e-9, "{summary}");
    assert!(summary.energy_drift > 0.0);
}
