//! One and two windows through their singular positions; IFToMM problem A02, González et al. 2006; Bayo &
//! Avello, Nonlinear Dynamics 5 (1994)
//! 209. Forty windows have their own test, `four_bar_40.rs`: they take long to compile.

use core::f64::consts::{FRAC_PI_2, PI};

use dynamics::model::Vector;
use dynamics::prelude::*;

use crate::support::*;
use crate::windows::{Windows, angular_acceleration, by_hand, parallel, windows};

windows!(One, windows: 1, standing: 2, rods: 3, between: 2);
windows!(Two, windows: 2, standing: 3, rods: 5, between: 4);

/// t and x, y, ẋ, ẏ of the first corner; closed form in Jacobi's elliptic functions.
const ONE: &[(f64, [f64; 4])] = &[
    (1.0, [-0.260712675183650356, -0.965416439159073168, -6.637809496121751437, 1.792553970388930558]),
    (2.0, [0.077085471792867077, 0.997024488183951826, 1.031356872689423192, -0.079739898127167998]),
    (5.0, [-0.944908186042953891, -0.327335485318983461, -1.858930891267245615, 5.366112429669780018]),
    (10.0, [0.478385057760970559, 0.878150178791209301, 1.727264075547153636, -0.940952179371514396]),
];
const TWO: &[(f64, [f64; 4])] = &[
    (1.0, [-0.195020301949435094, -0.980799205662173833, -6.676678036881156062, 1.327578325160487214]),
    (2.0, [0.057815795768011432, 0.998327267863455481, 1.017260136620436510, -0.058912248713445648]),
    (5.0, [-0.811310461005107412, -0.584615545348975548, -3.569117407193209186, 4.953105131173321267]),
    (10.0, [0.328458111540815379, 0.944518538178600962, 1.423051470206944123, -0.494868845487042959]),
];

/// Every row of the table as a state of all rods, with the multipliers of the hand-written equations there.
fn known<M: Windows>(model: &M, table: &[(f64, [f64; 4])]) -> Vec<(f64, M::State, Vec<f64>)> {
    let row = |(t, [x, y, dx, dy]): &(f64, [f64; 4])| {
        let state = parallel(model, y.atan2(*x), x * dy - y * dx);
        (*t, state, by_hand::<M>(&state).solve().1.as_slice().to_vec())
    };
    table.iter().map(row).collect()
}

/// The angles of the reference are those of one turn, the motion counts turns: they are judged by their sines
/// and cosines.
fn judge<M: Windows + Simulate>(table: &[(f64, [f64; 4])], promises: &[Promise]) {
    let model = M::published();
    let start = parallel(&model, FRAC_PI_2, -1.0);
    let known = known(&model, table);
    let unwound = known.iter().map(|(t, state, multipliers)| {
        let run = model.simulate(start).until(*t).tolerance(1e-9).run().unwrap();
        let mut state = *state;
        for (q, turned) in state.q_mut().as_mut_slice().iter_mut().zip(run.end().q().as_slice()) {
            *q += 2.0 * PI * ((turned - *q) / (2.0 * PI)).round();
        }
        (*t, state, multipliers)
    });
    let unwound: Vec<_> = unwound.collect();
    let references: Vec<Reference<'_>> = unwound
        .iter()
        .map(|(t, s, multipliers)| Reference { t: *t, q: s.q().as_slice(), u: s.u().as_slice(), multipliers })
        .collect();
    keeps(&model, start, &references, promises);
    // Through ten level positions, near which every choice of independent coordinates is bad.
    embeds_as_it_projects(&model, start, &references, 4.0);
}

#[test]
fn one_window_in_every_formulation() {
    use Formulation::*;
    judge::<One>(
        ONE,
        &[
            promise(Projected, 1e-9, [1e-7; 3], [1e-12; 2]),
            promise(Embedded, 1e-9, [3e-7, 3e-6, 3e-6], [1e-12; 2]),
        ],
    );
}

#[test]
fn two_windows_in_every_formulation() {
    use Formulation::*;
    judge::<Two>(
        TWO,
        &[
            promise(Projected, 1e-9, [1e-7; 3], [1e-12; 2]),
            promise(Embedded, 1e-9, [3e-7, 3e-6, 3e-6], [1e-12; 2]),
        ],
    );
}

fn agrees<M: Windows>() {
    let model = M::published();
    let mut random = Random(7);
    let mut count = 0;
    for k in 0..40 {
        // Away from the level positions, where Φ_q loses rank.
        let theta = 0.4 + 0.06 * f64::from(k);
        let Some(state) = near(&model, &parallel(&model, theta, 1.0), &mut random, (0.3, 3.0)) else {
            continue;
        };
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

/// In the level position itself Φ_q has lost a rank per window: the solver goes on, and says that multipliers
/// are not unique.
#[test]
fn the_level_position_loses_a_rank_per_window() {
    let model = Two::published();
    let level = parallel(&model, 0.0, -3.0);
    let solved = dynamics::constrain::solve_once(&model, &model.constants().unwrap(), &level).unwrap();
    assert_eq!(solved.diagnosis.expect("the general solver").rank, 12);
    assert!(!solved.unique());
}

/// A known limit: at tight tolerances the step collapses where the rods come level, for rounding of Φ divided
/// by the vanishing pivot exceeds the tolerance there. That is an error at that place; what is returned as a
/// success is right.
#[test]
fn where_the_level_position_is_not_passed_the_error_is_there() {
    use Formulation::*;
    let model = Two::published();
    let start = parallel(&model, FRAC_PI_2, -1.0);
    let (t, [x, y, ..]) = TWO[0];
    for (formulation, tolerance) in
        [(Embedded, 1e-11), (Embedded, 1e-12), (Projected, 1e-11), (Projected, 1e-12)]
    {
        match model.simulate(start).until(t).tolerance(tolerance).formulation(formulation).run() {
            Ok(motion) => {
                let theta = motion.end().angle(0);
                let error = distance(&[theta.cos(), theta.sin()], &[x, y]);
                assert!(error < 1e3 * tolerance + 1e-9, "{formulation} at {tolerance:e}: {error:e}");
            }
            Err(error) => {
                assert!(error.state.angle(0).sin().abs() < 0.01, "{formulation} at {tolerance:e}: {error}");
                // Up to there the motion is the one of the reference branch.
                let level = (1..5)
                    .map(|k| (error.state.angle(k) - if k < 3 { error.state.angle(0) } else { 0.0 }).abs());
                assert!(level.fold(0.0, f64::max) < 1e-8, "{error}");
            }
        }
    }
}

/// At every tolerance either the error is what the tolerance lets expect, or there is no success.
#[test]
fn embedded_windows_are_as_right_as_the_tolerance_or_not_at_all() {
    fn angle<M: Windows>(state: &M::State, like: &M::State) -> [f64; 2] {
        // The angles come last, and the standing rods first among them; all of these are parallel.
        let first = (0..M::Vector::LEN).rev().find(|i| like.u()[*i] != 0.0).expect("a rod that turns");
        let theta = state.q()[first];
        [theta.cos(), theta.sin()]
    }
    fn sweep<M: Windows + Simulate>(table: &[(f64, [f64; 4])]) {
        let model = M::published();
        let start = parallel(&model, FRAC_PI_2, -1.0);
        let mut passed = 0;
        for k in 10..=24 {
            let tolerance = 10f64.powf(-0.5 * f64::from(k));
            match model
                .simulate(start)
                .until(10.0)
                .tolerance(tolerance)
                .formulation(Formulation::Embedded)
                .run()
            {
                Ok(motion) => {
                    let error = |(t, [x, y, ..]): &(f64, [f64; 4])| {
                        distance(&angle::<M>(&motion.at(*t), &start), &[*x, *y])
                    };
                    let error = table.iter().map(error).fold(0.0, f64::max);
                    // Rounding of Φ, amplified at the level positions, sets a floor.
                    assert!(error < 5e3 * tolerance + 1e-8, "{tolerance:e}: {error:e}");
                    passed += 1;
                }
                Err(error) => {
                    let [_, height] = angle::<M>(&error.state, &start);
                    assert!(height.abs() < 0.01, "{tolerance:e}: {error}");
                }
            }
        }
        assert!(passed >= 10, "{passed} of 15");
    }
    sweep::<One>(ONE);
    sweep::<Two>(TWO);
}
