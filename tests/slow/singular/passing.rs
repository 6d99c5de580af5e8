//! Motions that pass change points.

use dynamics::error::{SolveError, StateError};

use super::change_points::EqualSliderCrank;
use super::three_cranks::ThreeCranks;
use super::*;

/// Where constraints may drift, what they have drifted decides at a change point: the run says so, or it has
/// passed and is right. The motion used to go on along the antiparallelogram, or back, at every tolerance,
/// with a drift of 1e-9 and without a word.
#[test]
fn drift_does_not_choose_a_branch() {
    let gains = Formulation::Baumgarte { alpha: 5.0, beta: 5.0 };
    let (mut passed, mut said) = (0, 0);
    for (weight, incline) in [(2.0, 0.0), (2.0, 0.4), (0.0, 0.4)] {
        let model = Parallelogram::new(weight, incline);
        for (crank, end) in [(1.0, 20.0), (0.7, 7.3), (1.3, 12.0)] {
            let (start, truth) = (model.start(crank, -1.0), model.truth(crank, -1.0, end));
            for formulation in [Formulation::Augmented, gains, Formulation::BaumgarteTied] {
                for tolerance in [1e-4, 1e-5, 1e-6, 1e-7, 1e-8, 1e-9, 1e-10, 1e-11] {
                    let case = format!("{weight} {incline} {crank} {formulation:?} {tolerance:e}");
                    match model.simulate(start).until(end).tolerance(tolerance).formulation(formulation).run()
                    {
                        Ok(motion) => {
                            passed += 1;
                            let [q, bound] = [motion.end().crank(), 100.0 * tolerance.powf(0.8) + 1e-8];
                            assert!((q - truth).abs() < bound, "{case}: {q} instead of {truth}");
                            assert!((q - motion.end().rocker()).abs() < bound, "{case}");
                        }
                        Err(error) => {
                            let away = (error.state.crank() - incline).sin().abs();
                            match error.kind {
                                SimulationErrorKind::BranchUndetermined { rows, coordinates, condition } => {
                                    said += 1;
                                    assert!(
                                        rows.contains("closure.x") && coordinates.contains("coupler"),
                                        "{case}"
                                    );
                                    assert!(condition > 5.0 && away < 0.1, "{case}: {condition} {away}");
                                }
                                SimulationErrorKind::Drift { .. } => {}
                                SimulationErrorKind::SingularPosition { ref rows, .. } => {
                                    assert!(rows.contains("closure.x") && away < 0.1, "{case}: {error}");
                                }
                                _ => panic!("{case}: {error}"),
                            }
                        }
                    }
                }
            }
        }
    }
    assert!(passed > 10 && said > 60, "{passed} passed, {said} said so");
}

/// Momentum decides where states are put back onto the constraints: every tolerance stays on the branch,
/// through a dozen change points.
#[test]
fn projected_and_embedded_motions_stay_on_their_branch() {
    for (weight, incline) in [(2.0, 0.0), (2.0, 0.4), (0.0, 0.0)] {
        let model = Parallelogram::new(weight, incline);
        for (crank, end) in [(1.0, 20.0), (0.7, 7.3)] {
            let (start, truth) = (model.start(crank, -1.0), model.truth(crank, -1.0, end));
            for formulation in [Formulation::Projected, Formulation::Embedded] {
                for tolerance in [1e-6, 1e-7, 1e-8, 1e-9, 1e-10] {
                    let run =
                        model.simulate(start).until(end).tolerance(tolerance).formulation(formulation).run();
                    let motion = run.unwrap_or_else(|error| {
                        panic!("{weight} {incline} {formulation:?} {tolerance:e}: {error}")
                    });
                    let [q, bound] = [motion.end().crank(), 1e3 * tolerance];
                    assert!(
                        (q - truth).abs() < bound,
                        "{weight} {incline} {crank} {formulation:?} {tolerance:e}: {q} instead of {truth}"
                    );
                    assert!((q - motion.end().rocker()).abs() < bound);
                }
            }
        }
    }
}

/// The change point: crank, coupler and rocker of a parallelogram lie in one line, and Φ_q loses a rank. The
/// motion passes on the branch on which it came; it does not become an antiparallelogram.
#[test]
fn a_parallelogram_stays_one() {
    let model = Parallelogram { inertia: 1.0, a: 1.0, b: 2.0, weight: 0.0, incline: 0.0 };
    let start =
        model.state().crank(0.7).coupler(0.0).rocker(0.7).crank_rate(-1.0).rocker_rate(-1.0).build().unwrap();
    for tolerance in [1e-4, 1e-6, 1e-8, 1e-10, 1e-12] {
        let end = model.simulate(start).until(6.0).tolerance(tolerance).run().unwrap().end();
        let bound = tolerance + 1e-12;
        assert!((end.crank() - end.rocker()).abs() < bound, "{tolerance:e}: {end:?}");
        assert!(end.coupler().abs() < bound, "{tolerance:e}: {end:?}");
        assert!((end.crank() + 5.3).abs() < bound, "{tolerance:e}: {end:?}");
    }
}

/// With one rate given the velocities of least energy are on neither branch; with what decides, they are
/// those of its branch.
#[test]
fn velocities_are_not_assembled_where_branches_meet_unless_what_is_given_decides() {
    for incline in [0.0, 0.5] {
        let model = Parallelogram { inertia: 1.0, a: 1.0, b: 2.0, weight: 0.0, incline };
        let at = |angle: f64| model.state().crank(angle).coupler_guess(incline).rocker_guess(angle);
        let flat = || model.state().crank(incline).coupler(incline).rocker(incline);
        for start in [flat().crank_rate(1.0), flat().coupler_rate(1.0), flat().rocker_rate(-2.0)] {
            let error = start.assemble().unwrap_err();
            let StateError::VelocityUndetermined { rows, coordinates } = error else { panic!("{error}") };
            assert!(rows.names().all(|row| row.starts_with("closure.")) && !rows.is_empty(), "{error}");
            assert_eq!(coordinates.count(), 2, "{error}");
        }
        let error = flat().crank_rate(1.0).assemble().unwrap_err();
        let message = error.to_string();
        assert!(
            message.contains("singular") && message.contains("give the rates of `rocker`, `coupler`"),
            "{message}"
        );
        // The parallelogram by what it moves on, the antiparallelogram by the ratio of its bars: a θ̇₁² + b
        // θ̇₂² = a θ̇₃².
        for [crank, coupler, rocker] in [[1.0, 0.0, 1.0], [1.0, -2.0, -3.0]] {
            let start = flat().crank_rate(crank).rocker_rate(rocker).assemble().unwrap();
            assert!((start.coupler_rate() - coupler).abs() < 1e-14, "{start:?}");
            solve_once(&model, &model.constants().unwrap(), &start).unwrap();
        }
        // What rests is on all branches, and beside the change point there is one.
        assert_eq!(flat().assemble().unwrap().u.norm(), 0.0);
        for beside in [1e-5, 1e-3, 0.1] {
            let start = at(incline + beside).crank_rate(1.0).assemble().unwrap();
            assert!(
                start.coupler_rate().abs() < 1e-9 && (start.rocker_rate() - 1.0).abs() < 1e-9,
                "{start:?}"
            );
        }
    }
}

/// In the change point reactions are not unique, and velocities that belong to no branch have no
/// accelerations.
#[test]
fn in_the_change_point_reactions_are_not_unique() {
    let incline = 0.5;
    let model = Parallelogram { inertia: 1.0, a: 1.0, b: 2.0, weight: 0.0, incline };
    let at = |rates: [f64; 3]| {
        let builder = model.state().crank(incline).coupler(incline).rocker(incline);
        builder.crank_rate(rates[0]).coupler_rate(rates[1]).rocker_rate(rates[2]).build().unwrap()
    };
    let constants = model.constants().unwrap();
    let solved = solve_once(&model, &constants, &at([-1.0, 0.0, -1.0])).unwrap();
    assert!(!solved.unique());
    assert_eq!(solved.diagnosis.unwrap().rank, 1);
    let error = solve_once(&model, &constants, &at([-1.0, 1.0, 1.0])).unwrap_err();
    assert!(matches!(error, SolveError::Contradiction { rank: 1, .. }), "{error}");
}

/// Where the line is an axis, the gradient of one row vanishes there altogether, and it is a change point all
/// the same.
#[test]
fn in_a_change_point_along_an_axis_a_row_has_no_gradient() {
    let model = Parallelogram { inertia: 1.0, a: 1.0, b: 2.0, weight: 0.0, incline: 0.0 };
    let mut flat = model.state().crank(1.0).coupler(0.0).rocker(1.0).build().unwrap();
    flat.q.fill(0.0);
    flat.u.copy_from_slice(&[-1.0, 0.0, -1.0]);
    let solved = solve_once(&model, &model.constants().unwrap(), &flat).unwrap();
    assert!(!solved.unique());
}

/// Where both stand upright, the slider may go on or stay on the crank's axis.
#[test]
fn a_slider_crank_of_equal_lengths_stays_on_its_branch() {
    let model = EqualSliderCrank { inertia: 0.1, mass: 1.0, length: 0.5, force: 0.0 };
    let start = model.state().crank(1.0).rod_guess(1.0).slide_guess(0.5).crank_rate(2.0).assemble().unwrap();
    assert!((start.rod() - 1.0).abs() < 1e-14 && (start.rod_rate() - 2.0).abs() < 1e-14, "{start:?}");
    for tolerance in [1e-4, 1e-6, 1e-8, 1e-10, 1e-12] {
        let motion = model.simulate(start).until(6.0).tolerance(tolerance).run().unwrap();
        let bound = 10.0 * tolerance + 1e-11;
        for state in motion.steps() {
            assert!((state.crank() - state.rod()).abs() < bound, "{tolerance:e}: {state:?}");
            assert!((state.slide() - state.crank().cos()).abs() < bound, "{tolerance:e}: {state:?}");
        }
        assert!(motion.verify().energy_drift < 100.0 * bound, "{}", motion.verify());
    }
}

/// What the third crank repeats has no rank of its own, here less than elsewhere: that is no contradiction.
/// Runs used to end with one 6e-6 rad before.
#[test]
fn three_cranks_pass_their_change_points() {
    for weight in [0.0, 2.0] {
        let model = ThreeCranks { inertia: 1.0, a: 0.5, b: 0.8, weight };
        let start = model.state().first(1.0).second(1.0).third(1.0);
        let start = start.first_rate(-1.0).second_rate(-1.0).third_rate(-1.0).build().unwrap();
        // Three cranks with a weight each move as two do.
        let truth = Parallelogram::new(weight, 0.0).truth(1.0, -1.0, 12.0);
        let run = |formulation, tolerance: f64| {
            model.simulate(start).until(12.0).tolerance(tolerance).formulation(formulation).run()
        };
        for tolerance in [1e-6, 1e-8, 1e-10, 1e-12] {
            for formulation in [Formulation::Projected, Formulation::Embedded] {
                let motion =
                    run(formulation, tolerance).unwrap_or_else(|error| panic!("{tolerance:e}: {error}"));
                let error = (motion.end().first() - truth).abs();
                assert!(error < 100.0 * tolerance + 1e-10, "{weight} {formulation} {tolerance:e}: {error:e}");
            }
            match run(Formulation::Augmented, tolerance) {
                Ok(motion) => {
                    assert!((motion.end().first() - truth).abs() < 1e3 * tolerance, "{tolerance:e}")
                }
                Err(error) => {
                    let undetermined = matches!(
                        error.kind,
                        SimulationErrorKind::BranchUndetermined { .. }
                            | SimulationErrorKind::SingularPosition { .. }
                    );
                    assert!(undetermined && error.state.first().sin().abs() < 0.01, "{tolerance:e}: {error}");
                }
            }
        }
    }
}

/// A parallelogram by the coordinates of its pins: beside its flat positions either of them moves as freely
/// as the other, none can lead.
#[derive(Clone, Debug, Dynamics)]
#[coordinates(x1: m, y1: m, x2: m, y2: m)]
#[units(m1: kg, m2: kg, a: m, b: m)]
struct Pins {
    m1: f64,
    m2: f64,
    a: f64,
    b: f64,
}

#[dynamics]
impl Pins {
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * self.m1 * vec2(q.x1, q.y1).dt().norm_squared()
            + 0.5 * self.m2 * vec2(q.x2, q.y2).dt().norm_squared()
    }
    #[holonomic]
    fn crank(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * (vec2(q.x1, q.y1).norm_squared() - self.a * self.a)
    }
    #[holonomic]
    fn coupler(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * (vec2(q.x2 - q.x1, q.y2 - q.y1).norm_squared() - self.b * self.b)
    }
    #[holonomic]
    fn rocker(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * (vec2(q.x2 - self.b, q.y2).norm_squared() - self.a * self.a)
    }
}

/// The pins turn at a constant rate through two flat positions, in both exact formulations.
#[test]
fn pins_pass_flat_positions() {
    for m2 in [1.0, 2.0] {
        let model = Pins { m1: 1.0, m2, a: 0.5, b: 0.8 };
        let (angle, rate, end) = (1.0f64, -1.5, 6.0);
        let (s, c) = angle.sin_cos();
        let start = model.state().x1(0.5 * c).y1(0.5 * s).x2(0.8 + 0.5 * c).y2(0.5 * s);
        let [x_rate, y_rate] = [-0.5 * rate * s, 0.5 * rate * c];
        let start = start.x1_rate(x_rate).y1_rate(y_rate).x2_rate(x_rate).y2_rate(y_rate).build().unwrap();
        let (s, c) = (angle + rate * end).sin_cos();
        let wanted = [0.5 * c, 0.5 * s, 0.8 + 0.5 * c, 0.5 * s];
        for formulation in [Formulation::Projected, Formulation::Embedded] {
            for tolerance in [1e-4, 1e-6, 1e-8, 1e-10] {
                let run = model.simulate(start).until(end).tolerance(tolerance).formulation(formulation);
                let motion = run.run().unwrap();
                let missed = (0..4).map(|i| (motion.end().q[i] - wanted[i]).abs()).fold(0.0, f64::max);
                println!("{formulation} {tolerance:e}: {missed:.1e} in {} steps", motion.counts().steps);
                assert!(missed < 300.0 * tolerance, "{formulation} at {tolerance:e} is {missed:e} off");
                assert!(motion.counts().steps < 1000, "{}", motion.verify());
            }
        }
    }
}

/// Constraints as they are (index 3) at change points: with fixed steps and step control the generalized-α
/// method stays on the branch, with its order, or says that it cannot.
#[test]
fn generalized_alpha_stays_on_its_branch_or_says_so() {
    let (mut passed, mut said) = (0, 0);
    for (weight, incline) in [(2.0, 0.0), (2.0, 0.4), (0.0, 0.0)] {
        let model = Parallelogram::new(weight, incline);
        let (start, end) = (model.start(1.0, -1.0), 7.3);
        let truth = model.truth(1.0, -1.0, end);
        for rho in [0.0, 0.5, 0.8, 0.95] {
            let method = methods::GeneralizedAlpha { rho };
            let run = || model.simulate(start).until(end).method(method);
            let fixed = [0.05, 0.037, 0.02, 0.013, 0.01, 0.0073, 0.005]
                .map(|h| (run().fixed_step(h).run(), 8.0 * h * h));
            let adaptive = [1e-2, 1e-3, 1e-4].map(|e| (run().tolerance(e).run(), 30.0 * e));
            for (k, (run, bound)) in fixed.into_iter().chain(adaptive).enumerate() {
                let case = format!("{weight} {incline} rho {rho}, run {k}");
                match run {
                    Ok(motion) => {
                        passed += 1;
                        let error = (motion.end().crank() - truth).abs();
                        println!("{case}: {error:.1e} of {bound:.1e}");
                        assert!(error < bound, "{case}: {error:e}");
                        assert!((motion.end().crank() - motion.end().rocker()).abs() < 1e-6, "{case}");
                    }
                    Err(error) => {
                        said += 1;
                        println!("{case}: {error}");
                    }
                }
            }
        }
    }
    println!("{passed} passed, {said} said so");
    assert!(passed > 115, "{passed} passed, {said} said so");
}
