//! Every formulation against every other, on models by hand and on random systems; the limits of each.

use crate::common;

use common::at_rest_or_not;
use common::constrained::{FourBar, PainleveRod, Rod, Sleigh, SliderCrank, TripleRod};
use dynamics_runtime::constrain::solve_once;
use dynamics_runtime::error::SolveError;
use dynamics_runtime::mechanism::Mechanism;
use dynamics_runtime::model::Constraints;
use proptest::prelude::*;

/// Two joints and two links of a parallelogram, and its state at a crank angle and rate.
fn parallelogram(theta: f64, rate: f64) -> common::PlainState<3, 0> {
    at_rest_or_not([theta, 0.0, theta], [rate, 0.0, rate])
}

proptest! {
    #![proptest_config(ProptestConfig {
        rng_seed: proptest::test_runner::RngSeed::Fixed(3),
        ..ProptestConfig::default()
    })]

    #[test]
    fn formulations_agree_at_random_states(
        q in proptest::array::uniform3(-3.0..3.0_f64),
        u in proptest::array::uniform3(-5.0..5.0_f64)
    ) {
        // Off the manifold, too: the equations at acceleration level do not ask.
        let bar = FourBar { m: [1.0, 0.5, 2.0], l: [1.0, 2.5, -2.0], d: 2.0, g: 9.81 };
        let state = at_rest_or_not(q, u);
        let comparison = bar.compare_formulations(&state).unwrap();
        // Where the two rows come near to each other every formulation loses what their nearness costs.
        let jacobian = bar.jacobian(&state);
        let (a, b) = (jacobian.row(0).normalize(), jacobian.row(1).normalize());
        let apart = 1.0 - a.dot(&b).abs();
        prop_assume!(apart > 1e-3);
        prop_assert!(comparison.applicable() == 4 && comparison.disagreement() < 1e-10, "{comparison}");
        let rod = Rod { m: 2.0, l: 1.5, g: 9.81 };
        prop_assume!(q[0].hypot(q[1]) > 1e-2);
        let comparison = rod.compare_formulations(&at_rest_or_not([q[0], q[1]], [u[0], u[1]])).unwrap();
        prop_assert!(comparison.applicable() == 4 && comparison.disagreement() < 1e-12, "{comparison}");
        let sleigh = Sleigh { m: 2.0, j: 0.7, a: 0.3 };
        let comparison = sleigh.compare_formulations(&state).unwrap();
        prop_assert!(comparison.applicable() == 4 && comparison.disagreement() < 1e-12, "{comparison}");
    }
}

#[test]
fn without_inertia_or_with_repeated_rows_the_formulations_that_apply_agree_and_the_others_say_why() {
    let crank = SliderCrank { a: 0.1, b: 0.3, j: 0.02, rod: 0.0, slider: 0.5, load: -40.0 };
    let massless =
        crank.compare_formulations(&at_rest_or_not([0.8, -0.2, 0.35], [20.0, -4.0, -2.0])).unwrap();
    assert!(massless.applicable() == 3 && massless.disagreement() < 1e-12 && massless.unique, "{massless}");
    assert!(
        massless.to_string().contains("range space by Cholesky  ")
            && massless.to_string().contains("  does not apply: the mass matrix is singular here"),
        "{massless}"
    );
    let thrice = TripleRod(Rod { m: 2.0, l: 1.5, g: 9.81 });
    let repeated = thrice.compare_formulations(&at_rest_or_not([0.9, -1.2], [0.8, 0.6])).unwrap();
    assert!(repeated.applicable() == 2 && repeated.disagreement() < 1e-14 && !repeated.unique, "{repeated}");
    assert!(repeated.to_string().contains("rank 1 of 3 rows: the multipliers are not unique"), "{repeated}");
}

#[test]
fn friction_takes_part_in_every_formulation() {
    let rod = PainleveRod { m: 2.0, l: 0.5, g: 9.81, mu: 0.8, linear: false };
    let comparison = rod.compare_formulations(&rod.slipping(1.0, 0.5, -1.0)).unwrap();
    assert!(comparison.applicable() == 4 && comparison.disagreement() < 1e-13, "{comparison}");
}

#[test]
fn at_its_change_point_a_parallelogram_has_a_freedom_more() {
    let model = FourBar::PARALLELOGRAM;
    assert_eq!(model.degrees_of_freedom(&parallelogram(0.7, 1.0)).unwrap(), 1);
    assert_eq!(model.degrees_of_freedom(&parallelogram(0.0, 1.0)).unwrap(), 2);
    // Flat, the bars lie along x, and the row for x is zero: the cranks may go on together or against each
    // other, as they came, but not otherwise.
    let flat = solve_once(&model, &(), &parallelogram(0.0, 1.0)).unwrap();
    assert_eq!(flat.diagnosis.map(|d| (d.rank, d.active)), Some((1, 2)));
    let shared = &model.reactions(&parallelogram(0.0, 1.0)).unwrap()[0];
    assert!(!shared.unique && shared.to_string().ends_with("not unique"));
    let comparison = model.compare_formulations(&parallelogram(0.0, 1.0)).unwrap();
    // The null space, which is the reference, and the partition, which leaves the zero row out.
    assert!(comparison.applicable() == 2 && comparison.disagreement() < 1e-12, "{comparison}");
    let torn = solve_once(&model, &(), &at_rest_or_not([0.0; 3], [1.0, 0.5, 2.0]));
    assert!(matches!(torn, Err(SolveError::Contradiction { row: "closure.x", rank: 1, .. })), "{torn:?}");
}

#[test]
fn reactions_balance_the_equations_of_motion() {
    let rod = Rod { m: 2.0, l: 1.5, g: 9.81 };
    let state = at_rest_or_not([0.9, -1.2], [0.8, 0.6]);
    let reactions = rod.reactions(&state).unwrap();
    let a = dynamics_runtime::model::Dynamics::accelerations(&rod, &state).unwrap();
    let pull = reactions[0].generalized_force;
    assert!(reactions[0].name == "rod" && reactions[0].unique);
    let (line, multiplier) = (reactions[0].to_string(), format!("{:.6e}", reactions[0].multipliers[0]));
    assert!(line.starts_with("rod ") && line.contains(&multiplier) && !line.contains("not unique"), "{line}");
    assert!((pull[0] - 2.0 * a[0]).abs() < 1e-14 && (pull[1] - 2.0 * (a[1] + 9.81)).abs() < 1e-13);
}

#[test]
fn a_model_without_constraints_has_formulations_too() {
    let model = common::DoublePendulum::UNIT;
    let state = at_rest_or_not([0.7, -1.2], [2.0, 1.0]);
    let comparison = model.compare_formulations(&state).unwrap();
    assert!(comparison.applicable() == 5 && comparison.disagreement() < 1e-13, "{comparison}");
    assert!(model.reactions(&state).unwrap().is_empty());
    assert_eq!(model.degrees_of_freedom(&state).unwrap(), 2);
}
