//! Floquet multipliers: published thresholds, volumes, differences of the motion, constraints, forces that
//! jump.

use std::f64::consts::{PI, TAU};

use dynamics::analysis::{Floquet, FloquetVerdict, PeriodicError, Threshold};
use dynamics::prelude::*;
use nalgebra::{DMatrix, Matrix2};

use crate::models::{
    Beside, Chosen, Duffing, Hilltop, Meissner, Pendulum, Relay, Shaken, ShakenInPlane, Skate, TwiceHeld,
    VanDerPol,
};

/// The upright pendulum with Mathieu's a = −4g/(lΩ²) and q = 2A/l.
fn mathieu(a: f64, q: f64) -> Shaken {
    let (l, frequency) = (0.3, 40.0);
    Shaken {
        m: 0.2,
        l,
        amplitude: 0.5 * q * l,
        frequency,
        damping: 0.0,
        g: -0.25 * a * l * frequency * frequency,
    }
}

fn judge(model: &Shaken) -> Floquet {
    model.floquet(&model.state().build().unwrap(), TAU / model.frequency).unwrap()
}

/// a₀(q), or b₁(q), from the Fourier coefficients of the solution (Abramowitz & Stegun 20.2): eigenvalues of
/// a tridiagonal matrix.
fn characteristic(q: f64, even: bool) -> f64 {
    let n = 30;
    let m = DMatrix::from_fn(n, n, |i, j| match (i.abs_diff(j), even) {
        (0, true) => (2.0 * i as f64).powi(2),
        (0, false) => (2.0 * i as f64 + 1.0).powi(2) - if i == 0 { q } else { 0.0 },
        (1, true) if i.min(j) == 0 => 2f64.sqrt() * q,
        (1, _) => q,
        _ => 0.0,
    });
    m.symmetric_eigenvalues().min()
}

#[test]
fn the_upright_pendulum_stands_between_the_characteristic_values_of_mathieu() {
    // Abramowitz & Stegun, table 20.1; NIST DLMF §28.
    for (q, a0, b1) in [(1.0, -0.455_138_604_1, -0.110_248_816_99), (5.0, -5.800_046_020_9, -5.790_080_598_6)]
    {
        assert!(
            (characteristic(q, true) - a0).abs() < 2e-10 && (characteristic(q, false) - b1).abs() < 2e-10
        );
    }
    for q in [0.2, 0.5, 1.0] {
        let (a0, b1) = (characteristic(q, true), characteristic(q, false));
        // From below it falls over; above it swings more in every second period.
        let of = |a: f64| judge(&mathieu(a, q)).verdict;
        let is = |verdict: FloquetVerdict, wanted: Threshold| {
            matches!(verdict,
            FloquetVerdict::Unstable { threshold, .. } if threshold == wanted)
        };
        assert!(is(of(a0 - 1e-7), Threshold::Fold), "{q}: {}", of(a0 - 1e-7));
        assert_eq!(of(a0 + 1e-7), FloquetVerdict::StableToFirstOrder, "{q}");
        if b1 < 0.0 {
            assert_eq!(of(b1 - 1e-7), FloquetVerdict::StableToFirstOrder, "{q}");
            assert!(is(of(b1 + 1e-7), Threshold::Flip), "{q}: {}", of(b1 + 1e-7));
        }
        // The trace passes 2 where it should, to 1e-9.
        let excess = |a: f64| judge(&mathieu(a, q)).monodromy.trace() - 2.0;
        let (low, high) = (a0 - 1e-4, a0 + 1e-4);
        let (mut x, mut y) = ((low, excess(low)), (high, excess(high)));
        for _ in 0..6 {
            let next = y.0 - y.1 * (y.0 - x.0) / (y.1 - x.1);
            (x, y) = (y, (next, excess(next)));
            if y.1.abs() < 1e-13 {
                break;
            }
        }
        assert!((y.0 - a0).abs() < 1e-10, "{q}: {:e}", y.0 - a0);
    }
    // Right at a threshold nothing is said.
    let edge = judge(&mathieu(characteristic(1.0, true), 1.0));
    assert!(matches!(edge.verdict, FloquetVerdict::Undecided { threshold: Threshold::Fold, .. }), "{edge}");
    assert!(edge.to_string().contains("not decided"));
}

#[test]
fn damping_makes_volumes_smaller_by_as_much_as_it_says() {
    let model = Shaken { damping: 0.02, ..mathieu(-0.3, 1.0) };
    let judged = judge(&model);
    let rate = model.damping / (model.m * model.l * model.l);
    let period = TAU / model.frequency;
    assert!((judged.divergence + rate * period).abs() < 1e-12, "{}", judged.divergence);
    assert!((judged.monodromy.determinant().ln() + rate * period).abs() < 1e-10);
    assert_eq!(judged.verdict, FloquetVerdict::AsymptoticallyStable);
    assert!(judged.symplectic_defect > 1e-2);
    let product: f64 = judged.multipliers.iter().map(|one| one.value.norm()).product();
    assert!((product.ln() + rate * period).abs() < 1e-10);
    // Damping that is too little to tell on which side of the circle a multiplier lies shows in the volumes.
    for damping in [1e-13, -1e-13] {
        let judged = judge(&Shaken { damping, ..model.clone() });
        assert!(judged.divergence * damping < 0.0 && !judged.is_unstable(), "{judged}");
        assert!(matches!(judged.verdict, FloquetVerdict::Undecided { .. }), "{judged}");
    }
    // Without damping the form stays.
    let free = judge(&mathieu(-0.3, 1.0));
    assert!(free.symplectic_defect < 1e-9, "{:e}", free.symplectic_defect);
    assert!(free.exponents().iter().all(|x| x.re.abs() < 1e-9));
}

/// The derivatives of the state at the end of a motion by that at its start, by differences of order four.
fn by_differences<M: dynamics::simulate::Simulate>(
    model: &M,
    start: M::State,
    period: f64,
    h: f64,
) -> Matrix2<f64> {
    use dynamics::model::ModelState;
    let end = |by: [f64; 2]| {
        let mut moved = start;
        moved.q_mut()[0] += by[0];
        moved.u_mut()[0] += by[1];
        let end = model.simulate(moved).until(start.t() + period).tolerance(1e-13).run().unwrap().end();
        [end.q()[0], end.u()[0]]
    };
    let column = |k: usize| {
        let at = |part: f64| end(if k == 0 { [part * h, 0.0] } else { [0.0, part * h] });
        let [a, b, c, d] = [at(-2.0), at(-1.0), at(1.0), at(2.0)];
        [0, 1].map(|i| (a[i] - 8.0 * b[i] + 8.0 * c[i] - d[i]) / (12.0 * h))
    };
    let (x, y) = (column(0), column(1));
    Matrix2::new(x[0], y[0], x[1], y[1])
}

#[test]
fn a_closed_motion_has_the_derivatives_of_the_motion() {
    let model = Duffing { alpha: 1.0, beta: 1.0, delta: 0.1, gamma: 0.5, omega: 1.2 };
    let guess = model.state().x(0.5).build().unwrap();
    let orbit = model.periodic(guess, TAU / 1.2).run().unwrap();
    let differences = by_differences(&model, orbit.start, orbit.period, 1e-3);
    let m = &orbit.floquet.monodromy;
    assert!(
        (0..4).all(|k| (m[(k / 2, k % 2)] - differences[(k / 2, k % 2)]).abs() < 1e-9),
        "{m} {differences}"
    );
    assert!((orbit.floquet.divergence + 0.1 * TAU / 1.2).abs() < 1e-11);
    assert_eq!(orbit.floquet.verdict, FloquetVerdict::AsymptoticallyStable);
}

#[test]
fn forces_that_jump_turn_what_lies_beside_the_motion() {
    // Two crossings of 0 in a period, where the force jumps.
    let model = Relay { k: 0.0, jump: 1.0, dry: 0.0, gamma: 0.4, omega: 2.0 };
    let guess = model.state().x(0.6).build().unwrap();
    let orbit = model.periodic(guess, TAU / 2.0).run().unwrap();
    assert!(orbit.start.x().abs() > 0.1, "{orbit}");
    let differences = by_differences(&model, orbit.start, orbit.period, 1e-3);
    let m = &orbit.floquet.monodromy;
    assert!(
        (0..4).all(|k| (m[(k / 2, k % 2)] - differences[(k / 2, k % 2)]).abs() < 1e-7),
        "{m} {differences}"
    );
    assert!((m.determinant() - 1.0).abs() < 1e-9 && orbit.floquet.symplectic_defect < 1e-8, "{orbit}");
    // Dry friction, on an oscillator that never sticks: the force jumps where it turns, and volumes become
    // smaller there alone.
    let rubs = Relay { k: 1.0, jump: 0.0, dry: 0.1, gamma: 0.5, omega: 0.7 };
    let orbit = rubs.periodic(rubs.state().x(0.9).build().unwrap(), TAU / 0.7).run().unwrap();
    let differences = by_differences(&rubs, orbit.start, orbit.period, 1e-3);
    let m = &orbit.floquet.monodromy;
    assert!(
        (0..4).all(|k| (m[(k / 2, k % 2)] - differences[(k / 2, k % 2)]).abs() < 1e-7),
        "{m} {differences}"
    );
    assert!(
        orbit.floquet.divergence < -0.1 && (m.determinant().ln() - orbit.floquet.divergence).abs() < 1e-9,
        "{orbit}"
    );
    assert_eq!(orbit.floquet.verdict, FloquetVerdict::AsymptoticallyStable);
    // Left alone it comes to stick, which has no linear equations.
    let sticks = Relay { gamma: 0.0, ..rubs };
    let said = sticks.floquet(&sticks.state().x(0.25).x_rate(0.01).build().unwrap(), TAU).unwrap_err();
    assert!(matches!(said, PeriodicError::Grazes { .. }), "{said}");
    // Undriven: amplitude A takes 4√(2A), and T changes by 2√2/√A per A: δx = −f dT.
    let free = Relay { gamma: 0.0, omega: 1.0, ..model };
    let (amplitude, period) = (0.7_f64, 4.0 * 1.4_f64.sqrt());
    let start = free.state().x(amplitude).build().unwrap();
    let judged = free.floquet(&start, period).unwrap();
    let later = 2.0 * 2f64.sqrt() / amplitude.sqrt();
    let wanted = DMatrix::from_row_slice(2, 2, &[1.0, 0.0, later, 1.0]);
    assert!((&judged.monodromy - wanted).amax() < 1e-9, "{}", judged.monodromy);
}

#[test]
fn constraints_leave_the_multipliers_that_angles_have() {
    let angle = mathieu(-0.3, 1.0);
    let plane = ShakenInPlane {
        m: angle.m,
        l: angle.l,
        amplitude: angle.amplitude,
        frequency: angle.frequency,
        g: angle.g,
    };
    let up = plane.state().y(angle.amplitude + angle.l).build().unwrap();
    let (one, other) = (judge(&angle), plane.floquet(&up, TAU / angle.frequency).unwrap());
    assert_eq!((other.multipliers.len(), other.verdict), (2, one.verdict), "{other}");
    for (a, b) in one.multipliers.iter().zip(&other.multipliers) {
        assert!((a.value - b.value).norm() < 1e-9, "{one} {other}");
    }
    assert!((one.divergence - other.divergence).abs() < 1e-10 && other.symplectic_defect < 1e-8);
    let twice = TwiceHeld {
        m: plane.m,
        l: plane.l,
        amplitude: plane.amplitude,
        frequency: plane.frequency,
        g: plane.g,
    };
    let up = twice.state().y(angle.amplitude + angle.l).build().unwrap();
    let again = twice.floquet(&up, TAU / angle.frequency).unwrap();
    for (a, b) in one.multipliers.iter().zip(&again.multipliers) {
        assert!((a.value - b.value).norm() < 1e-9, "{one} {again}");
    }
    assert_eq!((again.multipliers.len(), again.verdict), (2, one.verdict), "{again}");

    // A swing, in an angle and with the rod that is there twice.
    let (angle, twice) = (
        Pendulum { m: 1.0, l: 1.3, g: 9.81 },
        TwiceHeld { m: 1.0, l: 1.3, amplitude: 0.0, frequency: 1.0, g: 9.81 },
    );
    let theta = 2.0_f64;
    let start = angle.state().theta(theta).build().unwrap();
    let held = twice.state().x(1.3 * theta.sin()).y(-1.3 * theta.cos()).build().unwrap();
    let one = angle.periodic(start, 3.0).hold("theta", theta).run().unwrap();
    let other = twice.periodic(held, 3.0).hold("y", -1.3 * theta.cos()).run().unwrap();
    assert!((one.period - other.period).abs() < 1e-9 * one.period, "{one} {other}");
    assert!(
        one.floquet.nontrivial().count() == 0 && other.floquet.nontrivial().count() == 0,
        "{one} {other}"
    );
}

#[test]
fn what_does_not_close_or_repeat_is_refused() {
    let model = mathieu(-0.3, 1.0);
    let period = TAU / model.frequency;
    let up = model.state().build().unwrap();
    let said = model.floquet(&up, 0.9 * period).unwrap_err();
    assert!(matches!(said, PeriodicError::NotPeriodic { coordinate: "theta", .. }), "{said}");
    let aside = model.state().theta(0.1).build().unwrap();
    let said = model.floquet(&aside, period).unwrap_err();
    assert!(matches!(said, PeriodicError::NotClosed { coordinate: "theta", .. }), "{said}");
    for period in [0.0, -1.0, f64::NAN, f64::INFINITY] {
        let said = model.floquet(&up, period).unwrap_err();
        assert!(matches!(said, PeriodicError::Option { .. }), "{said}");
    }
    // A multiple of the period is one, too: the multipliers are powers.
    let (once, thrice) = (model.floquet(&up, period).unwrap(), model.floquet(&up, 3.0 * period).unwrap());
    let cube = &once.monodromy * &once.monodromy * &once.monodromy;
    assert!((cube - thrice.monodromy).amax() < 1e-9);
}

#[test]
fn rest_has_the_multipliers_of_its_eigenvalues() {
    // Nothing depends on time: e^{σT}, with any T.
    let model = VanDerPol { mu: 0.5 };
    let rest = model.state().build().unwrap();
    let judged = model.floquet(&rest, 1.7).unwrap();
    let root = (1.0_f64 - 0.0625).sqrt();
    for one in &judged.multipliers {
        let wanted =
            nalgebra::Complex::from_polar((0.25_f64 * 1.7).exp(), root * 1.7 * one.value.im.signum());
        // Off by no more than it says, and that is little.
        assert!((one.value - wanted).norm() <= one.uncertainty && one.uncertainty < 1e-10, "{judged}");
    }
    assert!(
        matches!(judged.verdict, FloquetVerdict::Unstable { threshold: Threshold::NeimarkSacker, .. }),
        "{judged}"
    );
    let hanging = Pendulum { m: 1.0, l: 1.0, g: 4.0 };
    let judged = hanging.floquet(&hanging.state().build().unwrap(), 1.0).unwrap();
    assert_eq!(judged.verdict, FloquetVerdict::StableToFirstOrder, "{judged}");
    assert!(judged.multipliers.iter().all(|one| (one.value.arg().abs() - 2.0).abs() < 1e-10), "{judged}");
}

#[test]
fn what_rolls_has_the_multipliers_of_its_eigenvalues_at_rest() {
    // Three coordinates, two velocities: five multipliers; aside it stays where it is put.
    let model = Skate { m: 2.0, i: 0.3, a: 0.4, k: 30.0, turning: 4.0, c: 1.5 };
    let rest = model.equilibrium(&model.state().x(-0.4).build().unwrap()).unwrap().state;
    let (judged, period) = (model.floquet(&rest, 0.8).unwrap(), 0.8);
    let mut wanted: Vec<_> =
        model.linearize(&rest).unwrap().eigenvalues().unwrap().iter().map(|s| (s * period).exp()).collect();
    assert_eq!((judged.multipliers.len(), wanted.len()), (5, 5), "{judged}");
    for one in &judged.multipliers {
        let nearest = (0..wanted.len())
            .min_by(|a, b| (wanted[*a] - one.value).norm().total_cmp(&(wanted[*b] - one.value).norm()));
        let wanted = wanted.remove(nearest.unwrap());
        assert!((wanted - one.value).norm() < 1e-9, "{wanted} {judged}");
    }
    assert!(
        matches!(judged.verdict, FloquetVerdict::Undecided { threshold: Threshold::Fold, .. }),
        "{judged}"
    );
}

#[test]
fn a_start_where_a_force_jumps_is_refused() {
    // Rounding would decide whether the jump is at the start, at the end, or at both: −5.83 instead of 1 was
    // told of this one.
    let model = Relay { k: 0.0, jump: 1.0, dry: 0.0, gamma: 0.0, omega: 1.0 };
    for speed in [1.0, -1.0, 0.7] {
        let start = model.state().x_rate(speed).build().unwrap();
        let said = model.floquet(&start, 4.0 * f64::abs(speed)).unwrap_err();
        assert!(matches!(said, PeriodicError::StartsOnCorner { time: 0.0 }), "{said}");
        assert!(said.to_string().contains("start elsewhere"), "{said}");
    }
    // A little beside it, from where it was −5.83 after 1e-16, it is told.
    let start = model.state().x(0.5 - 0.5 * 0.9_f64.powi(2)).x_rate(0.9).build().unwrap();
    let judged = model.floquet(&start, 4.0).unwrap();
    assert!(judged.multipliers.iter().all(|one| (one.value.re - 1.0).abs() < 1e-9), "{judged}");
}

#[test]
fn pairs_that_meet_on_the_circle_are_not_called_stable() {
    // At field² = 4 pairs meet; a little below they have left the circle, by less than is known of them.
    for period in [0.37, 1.0, 5.0] {
        let of = |by: f64| {
            let model = Hilltop { field: 2.0 * (1.0 + by), slope: 1.0 };
            model.floquet(&model.state().build().unwrap(), period).unwrap()
        };
        for by in [0.0, -1e-13, 1e-13, -1e-11, 1e-11] {
            let judged = of(by);
            assert!(matches!(judged.verdict, FloquetVerdict::Undecided { .. }), "{period} {by:e} {judged}");
        }
        assert!(of(-1e-7).is_unstable() && of(1e-7).is_stable(), "{period}");
    }
    // Equal ones with directions of their own have not met.
    let two = Hilltop { field: 0.0, slope: -1.0 };
    let judged = two.floquet(&two.state().build().unwrap(), 1.0).unwrap();
    assert_eq!(judged.verdict, FloquetVerdict::StableToFirstOrder, "{judged}");
}

#[test]
fn a_slow_coordinate_that_does_not_repeat_is_seen_beside_a_fast_one() {
    let model = Beside { stiff: 1e8, soft: 1e-4, frequency: 1.3 };
    let said = model.floquet(&model.state().build().unwrap(), 1.0).unwrap_err();
    assert!(matches!(said, PeriodicError::NotPeriodic { coordinate: "y", .. }), "{said}");
}

/// Meissner's equation: half a period with each stiffness, so that the trace is known (E. Meissner,
/// Schweizerische Bauzeitung 72 (1918) 95; Magnus & Winkler, *Hill's Equation*, §8.1).
#[test]
fn a_stiffness_that_jumps_is_judged_from_every_start() {
    let (a, b) = (1.3f64.sqrt(), 0.7f64.sqrt());
    let (pa, pb) = (a * PI, b * PI);
    let trace = 2.0 * pa.cos() * pb.cos() - (a / b + b / a) * pa.sin() * pb.sin();
    for t0 in [0.3, 0.5, 1.0, 1.5, 2.0, 2.5, 3.0, 4.0, 5.0, 6.0] {
        let model = Meissner { m: 1.0, k: 1.0, depth: 0.3, omega: 1.0 };
        let judged = model.floquet(&model.state().at_time(t0).build().unwrap(), TAU).unwrap();
        assert!((judged.monodromy.trace() - trace).abs() < 1e-9, "{t0}: {judged}");
        let model = Chosen { m: 1.0, k: 1.0, depth: 0.3, omega: 1.0 };
        let start = model.state().at_time(t0).build().unwrap();
        let judged = model.floquet(&start, TAU).unwrap();
        assert!((judged.monodromy.trace() - trace).abs() < 1e-9, "{t0}: {judged}");
        // What is no period is refused as before, also where jumps fall on jumps.
        for wrong in [PI, 4.0, 3.0 * PI] {
            let said = model.floquet(&start, wrong).unwrap_err();
            assert!(
                matches!(said, PeriodicError::NotPeriodic { coordinate: "x", .. }),
                "{t0} {wrong}: {said}"
            );
        }
    }
}

/// In a long period disturbances leave the range of numbers: they have died away.
#[test]
fn what_has_died_away_beyond_numbers_is_zero() {
    let model = Duffing { alpha: 1.0, beta: 0.0, delta: 2.2, gamma: 0.0, omega: 1.0 };
    let found = model.floquet(&model.state().build().unwrap(), 3000.0).unwrap();
    assert_eq!(found.verdict, FloquetVerdict::AsymptoticallyStable, "{found}");
    assert!(found.multipliers.iter().all(|one| one.value.norm() < 1e-190), "{found}");
    assert!((found.divergence / (-2.2 * 3000.0) - 1.0).abs() < 1e-9, "{found}");
}
