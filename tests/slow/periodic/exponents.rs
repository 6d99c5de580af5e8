//! Lyapunov exponents.

use dynamics::analysis::{ExponentSign, PeriodicError};
use dynamics::prelude::*;

use crate::double_pendulum::DoublePendulum;
use crate::models::{Duffing, Pendulum, TwiceHeld, VanDerPol};

#[test]
fn a_driven_oscillator_has_its_published_exponents() {
    // Ueda's: J. C. Sprott, Chaos and Time-Series Analysis (2003), appendix A.5: 0.1034, −0.1534 (and the 0
    // of time).
    let model = Duffing { alpha: 0.0, beta: 1.0, delta: 0.05, gamma: 7.5, omega: 1.0 };
    let start = model.state().x(2.5).build().unwrap();
    let found = model.lyapunov(start).settle(200.0).during(10_000.0).tolerance(1e-7).run().unwrap();
    for (one, wanted) in found.exponents.iter().zip([0.1034, -0.1534]) {
        assert!((one.value - wanted).abs() < one.uncertainty && one.uncertainty < 0.012, "{wanted}: {found}");
    }
    assert_eq!(found.is_chaotic(), Some(true), "{found}");
    assert!((found.divergence + model.delta).abs() < 1e-12, "{found}");
    assert!(found.sum_defect().unwrap().abs() < 1e-7, "{found}");
    // With time as a coordinate, 2.6741.
    assert!((found.kaplan_yorke().unwrap() - 1.6741).abs() < 0.05 && found.running.len() == 100, "{found}");
}

#[test]
fn a_limit_cycle_has_zero_and_the_rate_of_its_multiplier() {
    let model = VanDerPol { mu: 1.0 };
    let start = model.state().x(2.0).build().unwrap();
    let orbit = model.periodic(start, 6.6).run().unwrap();
    let found =
        model.lyapunov(start).settle(20.0).during(100.0 * orbit.period).tolerance(1e-10).run().unwrap();
    let rate = orbit.floquet.multipliers[0].value.norm().ln() / orbit.period;
    assert!((found.exponents[1].value - rate).abs() < 1e-4, "{rate}: {found}");
    assert!(found.exponents[0].value.abs() < 1e-3 && found.known_zeros == 1, "{found}");
    assert_eq!(found.exponents[1].sign, ExponentSign::Negative);
    assert_eq!(found.is_chaotic(), Some(false), "{found}");
    // Of a line, however the estimate of its 0 has come out.
    assert_eq!(found.kaplan_yorke(), Some(1.0), "{found}");
}

#[test]
fn a_run_that_sees_a_saddle_alone_does_not_call_a_pendulum_chaotic() {
    // It lingers upright for the whole run; with one degree of freedom, and energy, both exponents are 0.
    let model = Pendulum { m: 1.0, l: 1.0, g: 1.0 };
    for aside in [1.6e-3, 1e-4, 3e-6] {
        let start = model.state().theta(std::f64::consts::PI - aside).build().unwrap();
        for count in [1, 2] {
            let found = model.lyapunov(start).settle(5.0).during(3.0).exponents(count).run().unwrap();
            assert!(found.largest().value > 0.5 && found.known_zeros == 2, "{found}");
            assert_eq!(found.is_chaotic(), None, "{found}");
        }
    }
}

#[test]
fn long_runs_do_not_leave_the_range_of_numbers() {
    // ẍ + x + δẋ: both −δ/2. A hundredth of the run makes e^{−1000} of every vector, or e^{+1000}.
    for delta in [1.0, -1.0] {
        let model = Duffing { alpha: 1.0, beta: 0.0, delta, gamma: 0.0, omega: 1.0 };
        let rest = model.state().build().unwrap();
        for count in [1, 2] {
            let found = model.lyapunov(rest).during(2e5).exponents(count).tolerance(1e-6).run().unwrap();
            assert!(found.exponents.iter().all(|one| (one.value + 0.5 * delta).abs() < 1e-4), "{found}");
        }
    }
}

#[test]
fn a_double_pendulum_is_regular_when_it_swings_little_and_chaotic_when_it_swings_far() {
    let model = DoublePendulum { m1: 1.0, m2: 1.0, l1: 1.0, l2: 1.0, g: 9.81 };
    let little =
        model.lyapunov(model.state().theta1(0.1).theta2(0.05).build().unwrap()).during(1000.0).run().unwrap();
    // All four are 0; two for a reason that is known, but not which two.
    assert_eq!(little.is_chaotic(), None, "{little}");
    assert_eq!(little.kaplan_yorke(), None, "{little}");
    assert!(
        little.exponents.iter().all(|one| one.value.abs() < 0.02 && one.sign == ExponentSign::Undecided),
        "{little}"
    );
    assert_eq!(little.known_zeros, 2, "{little}");
    let far =
        model.lyapunov(model.state().theta1(2.0).theta2(2.5).build().unwrap()).during(1000.0).run().unwrap();
    assert_eq!(far.is_chaotic(), Some(true), "{far}");
    assert!(far.largest().value > 0.5 && far.pairing_defect().unwrap() < 0.05, "{far}");
    assert!(far.sum_defect().unwrap().abs() < 1e-6 && far.divergence.abs() < 0.05, "{far}");
    let zeros = far.exponents.iter().filter(|one| one.sign == ExponentSign::Zero).count();
    assert!(
        zeros >= 1 && far.exponents[1].value.abs() < 0.02 && far.exponents[2].value.abs() < 0.02,
        "{far}"
    );
}

#[test]
fn constraints_leave_as_many_exponents_as_there_is_freedom() {
    let (angle, twice) = (
        Pendulum { m: 1.0, l: 1.0, g: 9.81 },
        TwiceHeld { m: 1.0, l: 1.0, amplitude: 0.0, frequency: 1.0, g: 9.81 },
    );
    let one = angle.lyapunov(angle.state().theta(1.0).build().unwrap()).during(50.0).run().unwrap();
    let start = twice.state().x(1f64.sin()).y(-1f64.cos()).build().unwrap();
    let other = twice.lyapunov(start).during(50.0).run().unwrap();
    assert_eq!((one.dimension, other.dimension), (2, 2));
    assert!(one.exponents.iter().chain(&other.exponents).all(|x| x.value.abs() < 0.15), "{one} {other}");
    assert_ne!(one.is_chaotic(), Some(true), "{one}");
    // Upright it falls: ±√(g/l), both known.
    let up = angle
        .lyapunov(angle.state().theta(std::f64::consts::PI).build().unwrap())
        .settle(5.0)
        .during(2.0)
        .run();
    let up = up.unwrap();
    assert!((up.exponents[0].value - 9.81_f64.sqrt()).abs() < 1e-3, "{up}");
}

#[test]
fn what_makes_no_sense_is_refused() {
    let model = VanDerPol { mu: 1.0 };
    let start = model.state().x(2.0).build().unwrap();
    for said in [
        model.lyapunov(start).run().unwrap_err(),
        model.lyapunov(start).during(-1.0).run().unwrap_err(),
        model.lyapunov(start).during(1.0).exponents(3).run().unwrap_err(),
        model.lyapunov(start).during(1.0).exponents(0).run().unwrap_err(),
        model.lyapunov(start).during(1.0).settle(f64::NAN).run().unwrap_err(),
    ] {
        assert!(matches!(said, PeriodicError::Option { .. }), "{said}");
    }
    let away = Duffing { alpha: 1.0, beta: -1.0, delta: 0.0, gamma: 0.0, omega: 1.0 };
    let said = away.lyapunov(away.state().x(3.0).build().unwrap()).during(100.0).run().unwrap_err();
    assert!(
        matches!(
            said,
            PeriodicError::RunsAway { .. } | PeriodicError::Ends { .. } | PeriodicError::Stalls { .. }
        ),
        "{said}"
    );
}
