//! Methods that preserve something of a motion: orders, energy over many periods, momenta, reversal, and what
//! other methods lose there.

use crate::common;

use std::convert::Infallible;

use common::*;
use dynamics_runtime::integrate::{
    Accelerations, Canonical, Composition4, Composition6, Composition8, EnergyMidpoint, Expandable, Gauss4,
    Gauss6, OfPositions, Phase, Rattle, Rk4, Scheme, SemiImplicitEuler, Stabilized, StepError, StepNode,
    StepOptions, Stepper, StormerVerlet, Switching, System, Tolerances,
};
use dynamics_runtime::methods;
use dynamics_runtime::simulate::{OptionError, Simulate, SimulationErrorKind};
use nalgebra::SVector;

type V = SVector<f64, 2>;

fn fixed(h: f64) -> StepOptions {
    StepOptions { tolerances: Tolerances::both(1e-9), fixed: Some(h), first: None, most: f64::INFINITY }
}

/// Steps of size h from 0 to `end`; `seen` looks at every state.
fn go<S: Scheme<V>, Y: System<V>>(
    system: &mut Y,
    start: Phase<V>,
    h: f64,
    end: f64,
    mut seen: impl FnMut(&StepNode<V>),
) -> Phase<V>
where
    Y::Error: std::fmt::Debug,
{
    let mut stepper = Stepper::<V, S>::new(system, 0.0, start, end, fixed(h)).unwrap();
    while stepper.now().t != end {
        stepper.step(system, end).unwrap();
        seen(stepper.now());
    }
    stepper.now().y
}

/// Kepler's problem with GM = 1.
fn attraction(_: f64, q: &V) -> Result<V, Infallible> {
    // Element by element: these tests make millions of steps without optimisation.
    let (x, y) = (q[0], q[1]);
    let square = x * x + y * y;
    let pull = -1.0 / (square * square.sqrt());
    Ok(V::new(pull * x, pull * y))
}

/// At the pericentre of an orbit with half axis 1: period 2π, energy −½.
fn pericentre(e: f64) -> Phase<V> {
    Phase { q: V::new(1.0 - e, 0.0), u: V::new(0.0, ((1.0 + e) / (1.0 - e)).sqrt()) }
}

fn energy(y: &Phase<V>) -> f64 {
    let ((x, y), (of_x, of_y)) = ((y.q[0], y.q[1]), (y.u[0], y.u[1]));
    0.5 * (of_x * of_x + of_y * of_y) - 1.0 / (x * x + y * y).sqrt()
}

fn angular_momentum(y: &Phase<V>) -> f64 {
    y.q[0] * y.u[1] - y.q[1] * y.u[0]
}

/// Kepler's problem that tells its energy, in polar coordinates: M = diag(1, r²) moves, so that (q, q̇) are
/// not canonical.
struct Polar {
    /// Whether it tells its momenta.
    canonical: bool,
}

impl Polar {
    fn energy_of(y: &Phase<V>) -> f64 {
        0.5 * (y.u[0] * y.u[0] + y.q[0] * y.q[0] * y.u[1] * y.u[1]) - 1.0 / y.q[0]
    }
    fn start(e: f64) -> Phase<V> {
        Phase { q: V::new(1.0 - e, 0.0), u: V::new(0.0, ((1.0 + e) / (1.0 - e)).sqrt() / (1.0 - e)) }
    }
}

impl Accelerations<V> for Polar {
    type Error = Infallible;
    fn accelerations(&mut self, _: f64, q: &V, u: &V) -> Result<V, Infallible> {
        let r = q[0];
        Ok(V::new(r * u[1] * u[1] - 1.0 / (r * r), -2.0 * u[0] * u[1] / r))
    }
}

impl Stabilized<V> for Polar {}

impl Switching<V> for Polar {}

impl Canonical<V> for Polar {
    fn momenta(&mut self, _: f64, y: &Phase<V>, p: &mut V, rate: &mut V) -> Result<bool, Infallible> {
        let (r, omega) = (y.q[0], y.u[1]);
        (*p, *rate) = (V::new(y.u[0], r * r * omega), V::new(r * omega * omega - 1.0 / (r * r), 0.0));
        Ok(self.canonical)
    }
    fn mass_matrix(&mut self, _: f64, q: &V, mass: &mut [f64]) -> Result<(), Infallible> {
        mass.copy_from_slice(&[1.0, 0.0, 0.0, q[0] * q[0]]);
        Ok(())
    }
    fn energy(&mut self, _: f64, y: &Phase<V>) -> Option<f64> {
        Some(Self::energy_of(y))
    }
}

impl Expandable<V> for Polar {}

/// A quarter of an orbit and more, against a finer run of a method of high order.
fn error<S: Scheme<V>, Y: System<V>>(system: &mut Y, start: Phase<V>, exact: &Phase<V>, steps: u32) -> f64
where
    Y::Error: std::fmt::Debug,
{
    let end = go::<S, Y>(system, start, 2.0 / f64::from(steps), 2.0, |_| {});
    (end.q - exact.q).norm() + (end.u - exact.u).norm()
}

fn check_order<S: Scheme<V>, Y: System<V>>(system: &mut Y, start: Phase<V>, exact: &Phase<V>, steps: u32)
where
    Y::Error: std::fmt::Debug,
{
    let (coarse, fine) =
        (error::<S, Y>(system, start, exact, steps), error::<S, Y>(system, start, exact, 2 * steps));
    let order = (coarse / fine).log2();
    println!("{:40} {order:.2} from {coarse:.1e} to {fine:.1e}", S::METHOD.to_string());
    assert!((order - f64::from(S::ORDER)).abs() < 0.35, "{}: order {order}", S::METHOD);
}

/// Orders, in Cartesian and in polar coordinates, where velocities enter the forces.
#[test]
fn orders_of_convergence() {
    let (mut kepler, start) = (OfPositions(attraction), pericentre(0.3));
    let exact = go::<Composition8<V>, _>(&mut kepler, start, 0.01, 2.0, |_| {});
    check_order::<SemiImplicitEuler<V>, _>(&mut kepler, start, &exact, 400);
    check_order::<StormerVerlet<V>, _>(&mut kepler, start, &exact, 100);
    check_order::<Rattle<V>, _>(&mut kepler, start, &exact, 100);
    check_order::<Composition4<V>, _>(&mut kepler, start, &exact, 20);
    check_order::<Composition6<V>, _>(&mut kepler, start, &exact, 16);
    check_order::<Composition8<V>, _>(&mut kepler, start, &exact, 10);
    check_order::<Gauss4<V>, _>(&mut kepler, start, &exact, 20);
    check_order::<Gauss6<V>, _>(&mut kepler, start, &exact, 12);
    check_order::<EnergyMidpoint<V>, _>(&mut kepler, start, &exact, 100);

    let start = Polar::start(0.3);
    for canonical in [true, false] {
        let mut polar = Polar { canonical };
        let exact = go::<Gauss6<V>, _>(&mut polar, start, 0.005, 2.0, |_| {});
        assert!((Polar::energy_of(&exact) + 0.5).abs() < 1e-13);
        check_order::<Gauss4<V>, _>(&mut polar, start, &exact, 20);
        check_order::<Gauss6<V>, _>(&mut polar, start, &exact, 12);
        check_order::<EnergyMidpoint<V>, _>(&mut polar, start, &exact, 100);
        // Forces with velocities take their symplecticity, not their order.
        check_order::<StormerVerlet<V>, _>(&mut polar, start, &exact, 100);
    }
}

/// Largest energy errors within the first hundredth of so many periods and within all of them.
fn energy_errors<S: Scheme<V>, Y: System<V>>(
    system: &mut Y,
    start: Phase<V>,
    of: fn(&Phase<V>) -> f64,
    (periods, steps): (u32, u32),
) -> (f64, f64)
where
    Y::Error: std::fmt::Debug,
{
    // No whole number of steps a period: every phase of the orbit is seen in the early part, too.
    let (h, end) =
        (std::f64::consts::TAU / (f64::from(steps) + 0.618), std::f64::consts::TAU * f64::from(periods));
    let (mut early, mut all, before) = (0.0f64, 0.0f64, of(&start));
    go::<S, Y>(system, start, h, end, |knot| {
        let error = (of(&knot.y) - before).abs();
        all = all.max(error);
        if knot.t <= 0.01 * end {
            early = early.max(error);
        }
    });
    println!("{:40} {early:.2e} in {} periods, {all:.2e} in {periods}", S::METHOD.to_string(), periods / 100);
    (early, all)
}

/// The energy error of symplectic methods is as large after a hundred thousand periods as it was after a
/// thousand; RK4 with a smaller error in the first ones loses the orbit. [`a_million_periods`] goes on, as
/// `examples/long_motions.rs` does with more methods.
#[test]
fn energy_errors_stay_where_they_are() {
    let (mut kepler, start) = (OfPositions(attraction), pericentre(0.1));
    let stays = |(early, all): (f64, f64)| assert!(all < 1.02 * early, "{early:e} grew to {all:e}");
    stays(energy_errors::<StormerVerlet<V>, _>(&mut kepler, start, energy, (100_000, 12)));
    stays(energy_errors::<SemiImplicitEuler<V>, _>(&mut kepler, start, energy, (1_000, 100)));
    stays(energy_errors::<Composition6<V>, _>(&mut kepler, start, energy, (4_000, 10)));
    stays(energy_errors::<Composition8<V>, _>(&mut kepler, start, energy, (2_000, 14)));
    stays(energy_errors::<Gauss6<V>, _>(&mut kepler, start, energy, (1_000, 12)));
    let (early, all) = energy_errors::<Rk4<V>, _>(&mut kepler, start, energy, (2_000, 100));
    assert!(early < 1e-3 && all > 30.0 * early, "RK4 drifts: {early:e}, {all:e}");
}

/// Largest energy errors in each tenth of so many periods.
fn tenths<S: Scheme<V>>(e: f64, periods: u32, steps: u32) -> [f64; 10] {
    let (mut kepler, start) = (OfPositions(attraction), pericentre(e));
    // No whole number of steps a period, as in `energy_errors`.
    let (h, end) =
        (std::f64::consts::TAU / (f64::from(steps) + 0.618), std::f64::consts::TAU * f64::from(periods));
    let (mut worst, before) = ([0.0f64; 10], energy(&start));
    go::<S, _>(&mut kepler, start, h, end, |knot| {
        let tenth = ((10.0 * knot.t / end) as usize).min(9);
        worst[tenth] = worst[tenth].max((energy(&knot.y) - before).abs());
    });
    println!("{:40} {worst:?} in {periods} periods", S::METHOD.to_string());
    worst
}

/// Modified equations: a symplectic step is all but exactly a motion of a nearby energy, so that after a
/// million periods the energy errs by as much as in the first hundred thousand, with nine steps in each
/// period. RK4 with 22 times the evaluations errs in proportion to the time; with half of these it has lost
/// the orbit after 500 periods.
#[test]
fn a_million_periods() {
    let kept = tenths::<StormerVerlet<V>>(0.05, 1_000_000, 8);
    assert!(kept[9] <= (1.0 + 1e-6) * kept[0], "{kept:?}");
    let lost = tenths::<Rk4<V>>(0.05, 1_000, 48);
    for (k, error) in lost.iter().enumerate() {
        let grown = error / lost[0] / (k + 1) as f64;
        assert!((0.8..1.2).contains(&grown), "{lost:?}");
    }
}

/// M(q): in canonical variables the error stays, in (q, q̇) the symmetric method keeps it for this reversible
/// motion too; RK4 does not.
#[test]
fn energy_errors_stay_where_the_mass_matrix_moves() {
    let start = Polar::start(0.2);
    for canonical in [true, false] {
        let mut polar = Polar { canonical };
        for (early, all) in [
            energy_errors::<Gauss4<V>, _>(&mut polar, start, Polar::energy_of, (1_000, 20)),
            energy_errors::<Gauss6<V>, _>(&mut polar, start, Polar::energy_of, (1_000, 16)),
        ] {
            assert!(all < 1.02 * early, "{early:e} grew to {all:e}");
        }
    }
    let (early, all) =
        energy_errors::<Rk4<V>, _>(&mut Polar { canonical: false }, start, Polar::energy_of, (1_000, 60));
    assert!(all > 30.0 * early, "RK4 drifts: {early:e}, {all:e}");
    let mut polar = Polar { canonical: true };
    // What rounding leaves of one step is made good in the next.
    let (_, all) = energy_errors::<EnergyMidpoint<V>, _>(&mut polar, start, Polar::energy_of, (500, 20));
    assert!(all < 1e-14, "{all:e}");
}

/// A spring whose stiffness is changed between two steps: from then on the energy that is kept is that of the
/// new spring, also where nobody has told the stepper.
#[test]
fn energy_of_a_system_that_is_changed_is_its_own() {
    struct Spring(f64);
    impl Accelerations<V> for Spring {
        type Error = Infallible;
        fn accelerations(&mut self, _: f64, q: &V, _: &V) -> Result<V, Infallible> {
            Ok(-self.0 * q)
        }
    }

    impl Stabilized<V> for Spring {}

    impl Switching<V> for Spring {}

    impl Canonical<V> for Spring {
        fn energy(&mut self, _: f64, y: &Phase<V>) -> Option<f64> {
            Some(0.5 * (y.u.norm_squared() + self.0 * y.q.norm_squared()))
        }
    }

    impl Expandable<V> for Spring {}
    let (mut spring, start) = (Spring(1.0), Phase { q: V::new(1.0, 0.5), u: V::new(0.0, 0.3) });
    let mut stepper =
        Stepper::<V, EnergyMidpoint<V>>::new(&mut spring, 0.0, start, 9.0, fixed(0.05)).unwrap();
    for k in [1.0, 4.0, 0.5] {
        spring.0 = k;
        let before = spring.energy(0.0, &stepper.now().y).unwrap();
        for _ in 0..50 {
            stepper.step(&mut spring, 9.0).unwrap();
        }
        let after = spring.energy(0.0, &stepper.now().y).unwrap();
        assert!((after - before).abs() < 1e-14 * before, "k = {k}: {before} became {after}");
    }
}

/// Quadratic invariants: angular momentum to rounding by what keeps them, not by RK4.
#[test]
fn angular_momentum_is_kept_to_rounding() {
    fn drift<S: Scheme<V>>(h: f64) -> f64 {
        let (mut kepler, start) = (OfPositions(attraction), pericentre(0.5));
        let mut worst = 0.0f64;
        go::<S, _>(&mut kepler, start, h, 500.0, |knot| {
            worst = worst.max((angular_momentum(&knot.y) - angular_momentum(&start)).abs());
        });
        println!("{:40} {worst:.1e}", S::METHOD.to_string());
        worst
    }
    for kept in [
        drift::<SemiImplicitEuler<V>>(0.02),
        drift::<StormerVerlet<V>>(0.05),
        drift::<Composition4<V>>(0.2),
        drift::<Composition8<V>>(0.5),
        drift::<Gauss4<V>>(0.2),
        drift::<Gauss6<V>>(0.3),
    ] {
        assert!(kept < 1e-12, "{kept:e}");
    }
    assert!(drift::<Rk4<V>>(0.05) > 1e-5);
    // In polar coordinates it is a momentum itself, which only the method in canonical variables knows.
    let mut worst = [0.0f64; 2];
    for (worst, canonical) in worst.iter_mut().zip([true, false]) {
        let start = Polar::start(0.5);
        go::<Gauss4<V>, _>(&mut Polar { canonical }, start, 0.2, 500.0, |knot| {
            let momentum = |y: &Phase<V>| y.q[0] * y.q[0] * y.u[1];
            *worst = worst.max((momentum(&knot.y) - momentum(&start)).abs());
        });
    }
    assert!(worst[0] < 1e-12 && worst[1] > 1e-7, "{worst:?}");
}

/// Brouwer's law: in many small steps, here of an orbit with e = 0.9, rounding a state takes more than all
/// else, unless it is carried to the next step.
#[test]
fn what_rounding_takes_of_small_steps_is_carried() {
    fn worst<S: Scheme<V>>(h: f64, periods: f64) -> [f64; 2] {
        let (mut kepler, start) = (OfPositions(attraction), pericentre(0.9));
        let (mut worst, mut end) = (0.0f64, 0.0);
        go::<S, _>(&mut kepler, start, h, periods * std::f64::consts::TAU, |knot| {
            worst = worst.max((angular_momentum(&knot.y) - angular_momentum(&start)).abs());
            end = (energy(&knot.y) - energy(&start)).abs();
        });
        println!("{:40} angular momentum {worst:.1e}, energy {end:.1e} in the end", S::METHOD.to_string());
        [worst, end]
    }
    for [momentum, energy] in [worst::<Composition8<V>>(0.001, 4.0), worst::<Gauss6<V>>(0.0005, 2.0)] {
        assert!(momentum < 1e-15 && energy < 6e-15, "{momentum:e}, {energy:e}");
    }
}

/// Back with the same step, symmetric methods return to the start but for rounding, however large their
/// errors are on the way.
#[test]
fn symmetric_methods_return() {
    fn missed<S: Scheme<V>, Y: System<V, Error = Infallible>>(
        system: &mut Y,
        start: Phase<V>,
        h: f64,
    ) -> f64 {
        let there = go::<S, Y>(system, start, h, 100.0 * h, |_| {});
        let mut stepper = Stepper::<V, S>::new(system, 100.0 * h, there, 0.0, fixed(h)).unwrap();
        while stepper.now().t != 0.0 {
            stepper.step(system, 0.0).unwrap();
        }
        let back = stepper.now().y;
        let missed = (back.q - start.q).norm() + (back.u - start.u).norm();
        println!("{:40} {missed:.1e}", S::METHOD.to_string());
        missed
    }
    let (mut kepler, start) = (OfPositions(attraction), pericentre(0.3));
    let (mut polar, turned) = (Polar { canonical: true }, Polar::start(0.3));
    for missed in [
        missed::<StormerVerlet<V>, _>(&mut kepler, start, 0.1),
        missed::<Composition4<V>, _>(&mut kepler, start, 0.3),
        missed::<Composition6<V>, _>(&mut kepler, start, 0.4),
        missed::<Gauss4<V>, _>(&mut kepler, start, 0.3),
        missed::<EnergyMidpoint<V>, _>(&mut kepler, start, 0.1),
        missed::<Gauss4<V>, _>(&mut polar, turned, 0.3),
        missed::<Gauss6<V>, _>(&mut polar, turned, 0.3),
        missed::<EnergyMidpoint<V>, _>(&mut polar, turned, 0.1),
    ] {
        assert!(missed < 1e-10, "{missed:e}");
    }
    assert!(missed::<Rk4<V>, _>(&mut kepler, start, 0.1) > 1e-5);
    assert!(missed::<SemiImplicitEuler<V>, _>(&mut kepler, start, 0.1) > 1e-3);
}

/// Equations of a step that have no solution that the iterations find are an error, never a wrong end.
#[test]
fn steps_that_are_too_long_are_refused() {
    fn made<S: Scheme<V>>(h: f64) {
        let mut stiff = OfPositions(|_: f64, q: &V| Ok::<V, Infallible>(-100.0 * q));
        let start = Phase { q: V::new(1.0, 0.5), u: V::zeros() };
        let end = go::<S, _>(&mut stiff, start, h, 10.0 * h, |_| {});
        // Nothing is damped and nothing grows.
        let size = |y: &Phase<V>| 100.0 * y.q.norm_squared() + y.u.norm_squared();
        assert!(
            (size(&end) / size(&start) - 1.0).abs() < 1e-11,
            "{}: {}",
            S::METHOD,
            size(&end) / size(&start)
        );
    }
    made::<Gauss4<V>>(0.25);
    made::<Gauss6<V>>(0.3);
    made::<EnergyMidpoint<V>>(0.1);
    fn refused<S: Scheme<V>>(h: f64) {
        let mut stiff = OfPositions(|_: f64, q: &V| Ok::<V, Infallible>(-100.0 * q));
        let start = Phase { q: V::new(1.0, 0.5), u: V::zeros() };
        let mut stepper = Stepper::<V, S>::new(&mut stiff, 0.0, start, 10.0, fixed(h)).unwrap();
        let error = stepper.step(&mut stiff, 10.0).unwrap_err();
        assert!(matches!(error, StepError::NotSolved { .. }), "{}: {error:?}", S::METHOD);
        assert_eq!(stepper.now().t, 0.0);
    }
    refused::<Gauss4<V>>(0.4);
    refused::<Gauss6<V>>(0.5);
    refused::<EnergyMidpoint<V>>(0.21);
}

/// What would run and keep nothing is refused by simulations, with the way out.
#[test]
fn models_that_do_not_suit_are_refused() {
    let start = at_rest_or_not([1.0, 0.5], [0.0, 0.0]);
    let run = |method: methods::Any<DoublePendulum>| {
        DoublePendulum::UNIT.simulate(start).until(1.0).fixed_step(0.01).method(method).run().unwrap_err()
    };
    for method in [
        methods::Any::from(methods::StormerVerlet),
        methods::Rattle.into(),
        methods::Composition4.into(),
        methods::Composition6.into(),
        methods::Composition8.into(),
    ] {
        let error = run(method);
        assert!(matches!(error.kind, SimulationErrorKind::Option(OptionError::Unsuited { .. })), "{error}");
        let text = error.to_string();
        assert!(text.contains("contain velocities; use methods::Gauss4"), "{text}");
    }
}

/// Steps of fixed size do not allocate; those that factor matrices do once a run.
#[test]
fn steps_do_not_allocate() {
    fn run<S: Scheme<V>, Y: System<V, Error = Infallible>>(system: &mut Y, start: Phase<V>) -> u64 {
        let info = allocation_counter::measure(|| {
            go::<S, Y>(system, start, 0.05, 10.0, |knot| assert!(knot.y.is_finite()));
        });
        info.count_total
    }
    let (mut kepler, mut polar) = (OfPositions(attraction), Polar { canonical: true });
    assert_eq!(run::<SemiImplicitEuler<V>, _>(&mut kepler, pericentre(0.2)), 0);
    assert_eq!(run::<StormerVerlet<V>, _>(&mut kepler, pericentre(0.2)), 0);
    assert_eq!(run::<Rattle<V>, _>(&mut kepler, pericentre(0.2)), 0);
    assert_eq!(run::<Composition4<V>, _>(&mut kepler, pericentre(0.2)), 0);
    assert_eq!(run::<Composition6<V>, _>(&mut kepler, pericentre(0.2)), 0);
    assert_eq!(run::<Composition8<V>, _>(&mut kepler, pericentre(0.2)), 0);
    assert_eq!(run::<EnergyMidpoint<V>, _>(&mut polar, Polar::start(0.2)), 0);
    assert_eq!(run::<Gauss4<V>, _>(&mut polar, Polar::start(0.2)), 1);
    assert_eq!(run::<Gauss6<V>, _>(&mut polar, Polar::start(0.2)), 1);
}

/// Iterations start from the polynomial of the step before: what the headers say of their number.
#[test]
fn iterations_are_few() {
    fn per_step<S: Scheme<V>>(h: f64) -> f64 {
        let mut evaluations = 0_u64;
        let mut kepler = OfPositions(|t: f64, q: &V| {
            evaluations += 1;
            attraction(t, q)
        });
        let mut steps = 0_u32;
        go::<S, _>(&mut kepler, pericentre(0.3), h, 100.0, |_| steps += 1);
        evaluations as f64 / f64::from(steps)
    }
    for (h, four, six, midpoint) in [(0.05, 12.0, 16.0, 9.0), (0.3, 22.0, 28.0, 17.0)] {
        let found = (per_step::<Gauss4<V>>(h), per_step::<Gauss6<V>>(h), per_step::<EnergyMidpoint<V>>(h));
        println!("evaluations per step of {h}: {found:?}");
        assert!(found.0 < four && found.1 < six && found.2 < midpoint, "{found:?}");
    }
}

/// An angle of many turns is known to its last place alone, and iterations end there: of 5,000 steps of a
/// pendulum that has turned a thousand times and more, hundreds were refused.
#[test]
fn implicit_steps_are_made_wherever_an_angle_has_come_to() {
    fn swings<S: Scheme<V>>(turns: f64, h: f64) {
        let mut pendula =
            |_: f64, q: &V, _: &V| Ok::<V, Infallible>(V::new(-q[0].sin(), -100.0 * q[1].sin()));
        let angle = turns * std::f64::consts::TAU;
        let start = Phase { q: V::new(angle + 2.0, angle + 2.5), u: V::new(0.5, -1.0) };
        go::<S, _>(&mut pendula, start, h, 5000.0 * h, |_| {});
    }
    for turns in [0.0, 1e3, 1e5, 1e7] {
        swings::<Gauss4<V>>(turns, 0.1);
        swings::<Gauss6<V>>(turns, 0.15);
        swings::<EnergyMidpoint<V>>(turns, 0.05);
    }
}
