//! Forces that change with time, by a factor that is 0 at the start: there are no equilibria but that one.

use dynamics::analysis::{Branch, EquilibriumError, SpecialKind, hopf_curve};
use dynamics::model::ModelState;

use super::shaken::{STILL, Shaken};
use super::*;

/// The last parameter at which all was well, the branch up to there, and what is said.
fn ended<S: ModelState>(error: ContinuationError<S>) -> (f64, Branch<S>) {
    let said = error.to_string();
    let ContinuationError::Model { parameter, reason, branch } = error else { panic!("{said}") };
    assert!(matches!(reason, EquilibriumError::DependsOnTime { coordinate: "x", .. }), "{said}");
    assert!(
        said.contains(&format!("beyond {parameter} of its parameter: forces change with time")),
        "{said}"
    );
    assert_eq!(branch.points.last().unwrap().parameter, parameter, "{branch}");
    (parameter, *branch)
}

#[test]
fn a_force_that_swings_leaves_no_branch() {
    // x = p balances p cos 2t at t = 0, and never after.
    let start = STILL.state().x(0.0).build().unwrap();
    let family = |even: f64| Shaken { even, ..STILL };
    let open = || continuation(family).from(&start, 0.0).until(0.0..=1.0);
    for error in [
        open().run(),
        open().load_controlled().run(),
        open().branches(5).map(|mut all| all.branches.remove(0)),
    ] {
        let (parameter, branch) = ended(error.unwrap_err());
        assert!((0.0..1e-6).contains(&parameter), "{branch}");
        assert!(
            branch.points.iter().all(|point| point.state.x() < 1e-6) && branch.special.is_empty(),
            "{branch}"
        );
    }
}

#[test]
fn a_force_that_is_zero_now_leaves_no_pitchfork_and_no_buckling_load() {
    // sin 3t is 0 now, so that x = 0 balances at t = 0 whatever p is, with stiffness 1 - p.
    let start = STILL.state().x(0.0).build().unwrap();
    let family = |p: f64| Shaken { load: p, odd: p, cubic: 1.0, ..STILL };
    let open = || continuation(family).from(&start, 0.0).until(0.0..=2.0);
    for error in [
        open().run(),
        open().load_controlled().run(),
        open().branches(5).map(|mut all| all.branches.remove(0)),
    ] {
        let (parameter, branch) = ended(error.unwrap_err());
        assert!((0.0..1e-6).contains(&parameter) && branch.special.is_empty(), "{branch}");
    }
    let (parameter, branch) = ended(open().buckling().unwrap_err());
    assert!(parameter == 0.0 && branch.points.len() == 1, "{branch}");
    // Time stands in the model, but nothing is shaken: all is as it was.
    let quiet = |p: f64| Shaken { load: p, cubic: 1.0, ..STILL };
    let open = || continuation(quiet).from(&start, 0.0).until(0.0..=2.0);
    let loads = open().buckling().unwrap().loads;
    assert!((loads[0].parameter - 1.0).abs() < 1e-11, "{loads:?}");
    let all = open().branches(5).unwrap();
    assert!(
        all.branches.len() == 3 && all.branches[0].branch_points().count() == 1 && all.failures.is_empty(),
        "{all}"
    );
}

#[test]
fn shaking_that_begins_on_the_way_ends_the_branch_there() {
    // From 0.5 on, by the third power: what is beyond rounding is so 5e-5 later.
    let start = STILL.state().x(0.0).build().unwrap();
    let family = |p: f64| Shaken { pull: p, even: (p - 0.5).max(0.0).powi(3), ..STILL };
    let (parameter, branch) =
        ended(continuation(family).from(&start, 0.0).until(0.0..=1.0).run().unwrap_err());
    assert!((0.5..0.5 + 1e-3).contains(&parameter) && branch.points.len() > 5, "{branch}");
    assert!(branch.points.iter().all(|point| (point.state.x() - point.parameter).abs() < 1e-9), "{branch}");
    // Up to there all is well.
    let before = continuation(family).from(&start, 0.0).until(0.0..=0.49).run().unwrap();
    assert_eq!(before.end, BranchEnd::Range, "{before}");
}

#[test]
fn what_only_many_times_show_is_seen_at_ends_and_special_points() {
    // A push at 20 s for a tenth of one, from p = 1.2 on, and one that is there around the pitchfork alone.
    let start = STILL.state().x(0.0).build().unwrap();
    let beyond = |p: f64| Shaken { load: p, cubic: 1.0, late: (p - 1.2).max(0.0), ..STILL };
    let (parameter, branch) =
        ended(continuation(beyond).from(&start, 0.0).until(0.0..=2.0).run().unwrap_err());
    assert!((1.1..=1.2).contains(&parameter) && branch.branch_points().count() == 1, "{branch}");
    let around = |p: f64| Shaken { load: p, cubic: 1.0, late: (0.1 - (p - 1.0).abs()).max(0.0), ..STILL };
    let (parameter, branch) =
        ended(continuation(around).from(&start, 0.0).until(0.0..=2.0).run().unwrap_err());
    assert!((0.7..=0.9).contains(&parameter) && branch.special.is_empty(), "{branch}");
}

#[test]
fn curves_of_folds_and_of_hopf_points_end_where_time_shakes() {
    // Folds of pull = -x + x³, and growth that begins at 0: both at any strength of what swings, if it stood
    // still.
    for odd in [false, true] {
        let shaken = |by: f64| if odd { Shaken { odd: by, ..STILL } } else { Shaken { even: by, ..STILL } };
        let two = |pull: f64, by: f64| Shaken { load: 2.0, cubic: 1.0, pull, ..shaken(by) };
        let start = STILL.state().x(-1.0).build().unwrap();
        let branch = continuation(|p| two(p, 0.0)).from(&start, 0.0).until(0.0..=0.6).run().unwrap();
        let fold = branch.folds().next().unwrap();
        let error = fold_curve(two, fold, 0.0).until(-1.0..=1.0, 0.0..=0.3).run().unwrap_err();
        let ContinuationError::FoldCurve { at, ref reason, ref curve } = error else { panic!("{error}") };
        assert!(matches!(reason, Some(EquilibriumError::DependsOnTime { .. })), "{error}");
        assert!((0.0..1e-6).contains(&at[1]) && curve.points.last().unwrap().0 == at, "{error}");
        assert!((at[0] - 2.0 / 27.0_f64.sqrt()).abs() < 1e-5, "{error}");

        let two = |growth: f64, by: f64| Shaken { growth, ..shaken(by) };
        let start = STILL.state().x(0.0).build().unwrap();
        let branch = continuation(|p| two(p, 0.0)).from(&start, -0.5).until(-0.5..=0.5).run().unwrap();
        let hopf = branch.special_where(|kind| matches!(kind, SpecialKind::Hopf { .. })).next().unwrap();
        let error = hopf_curve(two, hopf, 0.0).until(-1.0..=1.0, 0.0..=0.3).run().unwrap_err();
        let ContinuationError::HopfCurve { at, ref reason, ref curve } = error else { panic!("{error}") };
        assert!(matches!(reason, Some(EquilibriumError::DependsOnTime { .. })), "{error}");
        assert!((0.0..1e-6).contains(&at[1]) && curve.points.last().unwrap().0 == at, "{error}");
    }
}
