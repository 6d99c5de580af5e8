//! Forty windows in absolute coordinates through their singular positions: 243 coordinates, 242 constraint
//! rows; IFToMM problem A02, González et al. 2006. In its own file, because a model of this size takes
//! seconds to compile.
#![allow(clippy::excessive_precision, reason = "reference values as published")]

use core::f64::consts::FRAC_PI_2;

use dynamics::prelude::*;
use dynamics::simulate::SimulationErrorKind;

use super::support;
use super::windows;

use support::distance;
use windows::{Windows, parallel};

windows::windows!(Forty, windows: 40, standing: 41, rods: 81, between: 80);

/// t and x, y, ẋ, ẏ of the first corner; closed form in Jacobi's elliptic functions.
const REFERENCE: &[(f64, [f64; 4])] = &[
    (1.0, [-0.115356880632109898, -0.993324111300450186, -6.669987523941771591, 0.774600098662343315]),
    (2.0, [0.034466307300407356, 0.999405860329562546, 1.005951172810914049, -0.034692034165161765]),
    (5.0, [-0.540190050675526274, -0.841543052464443055, -5.436369112574548747, 3.489628365197339825]),
    (10.0, [0.180512226686728390, 0.983572740582311574, 1.148441277469414133, -0.210770066779421779]),
];

/// Ten seconds through ten level positions, at each of which forty rows lose their rank, at two tolerances:
/// (tolerance, largest error of the table, energy drift). These positions amplify rounding by chance: errors
/// of neighbouring tolerances lie within a factor of twenty of each other, so their median counts.
#[test]
fn forty_windows_pass_their_singular_positions() {
    let model = Forty::published();
    let start = parallel(&model, FRAC_PI_2, -1.0);
    for (tolerance, permitted, energy) in [(1e-7, 1e-4, 1e-6), (1e-10, 1e-8, 2e-10)] {
        let mut errors = Vec::new();
        for tolerance in [0.8, 0.9, 1.0, 1.1, 1.3].map(|factor| factor * tolerance) {
            let motion = model
                .simulate(start)
                .until(10.0)
                .tolerance(tolerance)
                .run()
                .unwrap_or_else(|error| panic!("{error}"));
            let error_at = |(t, reference): &(f64, [f64; 4])| {
                let s = motion.at(*t);
                // The first beam begins at the corner; its centre is half a length further.
                distance(&[s.x(41) - 0.5, s.y(41), s.x_rate(41), s.y_rate(41)], reference)
            };
            errors.push(REFERENCE.iter().map(error_at).fold(0.0, f64::max));
            let start = model.energy_function(&motion.start());
            let drift = motion.steps().map(|s| (model.energy_function(&s) - start).abs()).fold(0.0, f64::max);
            // T and V reach 1.2 kJ.
            assert!(drift < energy * 1.2e3, "{tolerance:e}: energy drifts by {drift:e}");
            for row in motion.constraint_drift() {
                assert!(row.residual < 1e-12 && row.velocity_residual < 1e-12, "{tolerance:e}: {row:?}");
            }
        }
        errors.sort_by(f64::total_cmp);
        assert!(errors[2] < permitted && errors[4] < 3.0 * permitted, "{tolerance:e}: {errors:?}");
    }
}

/// Matrices of 243 × 243 numbers, half a megabyte each, do not pass through the stack where the general
/// solver is asked: the 2 MB of a thread suffice without optimisation.
#[test]
fn a_thread_of_two_megabytes_is_enough() {
    let run = || {
        let model = Forty::published();
        let mut level = parallel(&model, 0.0, -1.0);
        let constants = model.constants().unwrap();
        let solved = dynamics::constrain::solve_once(&model, &constants, &level).unwrap();
        assert!(solved.diagnosis.is_some_and(|found| found.rank < found.active), "{:?}", solved.diagnosis);
        dynamics::constrain::with_workspace::<Forty, _>(|memory| {
            dynamics::constrain::check_start(&model, &level).unwrap();
            dynamics::constrain::project_positions(&model, &constants, &mut level, memory).unwrap();
            dynamics::constrain::project_velocities(&model, &constants, &mut level, memory).unwrap();
            let mut embedding = dynamics::constrain::Embedding::new(&model, &level, memory).unwrap();
            embedding.restore(&model, &mut level, memory).unwrap();
        });
        // A start that nothing decides: its rows and coordinates are asked for.
        level.u.fill(0.0);
        let error = model.simulate(level).until(1e-4).run().unwrap_err();
        let SimulationErrorKind::SingularStart { rows, .. } = error.kind else { panic!("{error}") };
        assert!(rows.count() >= 40, "{rows}");
    };
    std::thread::Builder::new().stack_size(2 << 20).spawn(run).expect("a thread").join().expect("no panic");
}
