//! One and two windows through their singular positions; IFToMM problem A02, González et al. 2006; Bayo & Avello, Nonlinear Dynamics 5 (1994)
//! 209. Forty windows have their own test, `four_bar_40.rs`: they take long to compile.

use core::f64::consts::FRAC_PI_2;

use dynamics::model::Vector;
use dynamics::prelude::*;

use crate::support::*;
use crate::windows::{Windows, angular_acceleration, by_hand, parallel, windows};

windows!(One, windows: 1, standing: 2, rods: 3, between: 2);
windows!(Two, windows: 2, standing: 3, rods: 5, between: 4);

fn agrees<M: Windows>() {
    let model = M::published();
    let mut random = Random(7);
    let mut count = 0;
    for k in 0..40 {
        // Away from the level positions, where Φ_q loses rank.
        let theta = 0.4 + 0.06 * f64::from(k);
        let Some(state) = near(&model, &parallel(&model, theta, 1.0), &mut random, (0.3, 3.0)) else { continue };
        Kkt::of(&model, &state).assert_equals(&by_hand::<M>(&state), 1e-14);
        assert_agreement(&model, &state, &by_hand::<M>(&state));
        count += 1;
    }
    assert!(count > 30, "{count} states on the manifold");
}

#[test]
fn formulations_agree_at_random_states() {
    agrees::<One>();
    agrees::<Two>();
}

/// On the branch of the reference the constraints leave θ̈ of one degree of freedom.
#[test]
fn accelerations_on_the_branch_are_those_of_one_coordinate() {
    let model = Two::published();
    for theta in [0.1, 0.8, 1.5, 2.5, 4.0, 5.5] {
        let state = parallel(&model, theta, -2.0);
        let accelerations = model.accelerations(&state).unwrap();
        let angles = &accelerations.as_slice()[10..];
        for (rod, a) in angles.iter().enumerate() {
            let expected = if rod < 3 { angular_acceleration(2, theta) } else { 0.0 };
            assert!((a - expected).abs() < 1e-11, "θ = {theta}, rod {rod}: {a} instead of {expected}");
        }
    }
}

/// In the level position itself Φ_q has lost a rank per window: the solver goes on, and says that multipliers are not unique.
#[test]
fn the_level_position_loses_a_rank_per_window() {
    let model = Two::published();
    let level = parallel(&model, 0.0, -3.0);
    let solved = dynamics::constrain::solve_once(&model, &model.constants().unwrap(), &level).unwrap();
    assert_eq!(solved.diagnosis.expect("the general solver").rank, 12);
    assert!(!solved.unique());
}
