//! The general solver of constrained systems, on models by hand.

mod common;

use common::at_rest_or_not;
use common::constrained::{Rod, TripleRod};
use dynamics_runtime::constrain::solve_once;

const ROD: Rod = Rod { m: 2.0, l: 1.5, g: 9.81 };

#[test]
fn a_hanging_bob_is_held_by_its_weight() {
    let outcome = solve_once(&ROD, &(), &at_rest_or_not([0.0, -1.5], [0.0, 0.0])).unwrap();
    assert!(outcome.accelerations.norm() < 1e-15);
    // Φ_qᵀλ = (x, y) λ = m g upward.
    assert!((outcome.multipliers[0] * -1.5 - 2.0 * 9.81).abs() < 1e-14);
    assert!(outcome.unique());
}

#[test]
fn a_swinging_bob_has_the_tension_of_the_textbook() {
    let (theta, rate) = (0.7_f64, 1.3);
    let (s, c) = theta.sin_cos();
    let state = at_rest_or_not([1.5 * s, -1.5 * c], [1.5 * rate * c, 1.5 * rate * s]);
    let outcome = solve_once(&ROD, &(), &state).unwrap();
    let tension = ROD.m * (ROD.l * rate * rate + ROD.g * c);
    assert!((-outcome.multipliers[0] * ROD.l - tension).abs() < 1e-13 * tension);
}

#[test]
fn a_constraint_said_three_times_shares_its_force() {
    let state = at_rest_or_not([0.0, -1.5], [0.4, 0.0]);
    let once = solve_once(&ROD, &(), &state).unwrap();
    let thrice = solve_once(&TripleRod(ROD), &(), &state).unwrap();
    assert!((once.accelerations - thrice.accelerations).norm() < 1e-14);
    let diagnosis = thrice.diagnosis.unwrap();
    assert_eq!((diagnosis.rank, diagnosis.active, thrice.unique()), (1, 3, false));
    for (lambda, factor) in thrice.multipliers.iter().zip([1.0, 2.0, -1e3]) {
        assert!((lambda * factor - once.multipliers[0] / 3.0).abs() < 1e-13, "{:?}", thrice.multipliers);
    }
}
