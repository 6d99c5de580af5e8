//! How branches meet where that is hard to tell, and lengths of which the start says nothing.

use dynamics::analysis::{BranchEnd, SpecialKind};

use super::*;

fn series(c: [f64; 5], from: f64, size: f64) -> Polynomial {
    Polynomial { m: 1.0, c, from, size }
}

/// The special points of the trivial branch over 0..=1.
fn of_trunk(family: impl Fn(f64) -> Polynomial, step: f64) -> Vec<(SpecialKind, f64)> {
    let start = family(0.0).state().build().unwrap();
    let branch =
        continuation(family).from(&start, 0.0).until(0.0..=1.0).first_step(step).longest_step(step).run();
    branch.unwrap().special.iter().map(|one| (one.kind, one.parameter)).collect()
}

const SUPERCRITICAL: SpecialKind = SpecialKind::Pitchfork { supercritical: true };

#[test]
fn small_slopes_and_large_third_powers() {
    // (p − 0.3) x = a x² + x³: transcritical however small a is beside the x³ that a distance of 0.01 shows.
    for a in [1e-1, 1e-3, 1e-5, 1e-7] {
        let found = of_trunk(|p| series([0.0, p - 0.3, -a, -1.0, 0.0], 0.0, 1.0), 0.05);
        assert!(found.len() == 1 && found[0].0 == SpecialKind::Transcritical, "{a}: {found:?}");
    }
    // (p − 0.3) x = x³ + c x⁴: a pitchfork, however lopsided at that distance.
    for c in [0.0, 30.0, 300.0] {
        let found = of_trunk(|p| series([0.0, p - 0.3, 0.0, -1.0, -c], 0.0, 1.0), 0.05);
        assert!(found.len() == 1 && found[0].0 == SUPERCRITICAL, "{c}: {found:?}");
    }
}

#[test]
fn points_of_a_step_in_the_branch_point_itself() {
    // Steps of 1/16 meet 1/4 exactly.
    let found = of_trunk(|p| series([0.0, p - 0.25, 0.0, -1.0, 0.0], 0.0, 1.0), 0.0625);
    assert_eq!(found, [(SUPERCRITICAL, 0.25)]);
}

#[test]
fn pitchforks_side_by_side() {
    // Unstable only between two loads that are 10⁻⁵ apart, by arms of less than 10⁻⁵: no place farther away
    // says what they are.
    let found = of_trunk(|p| series([0.0, -(p - 0.3) * (p - 0.30001), 0.0, -1.0, 0.0], 0.0, 1.0), 0.05);
    assert_eq!(found.iter().map(|one| one.0).collect::<Vec<_>>(), [SUPERCRITICAL; 2], "{found:?}");
}

#[test]
fn columns_of_micrometres_and_of_megametres() {
    for size in [1e-6, 1e-3, 1.0, 1e6] {
        // (p − 0.3) x̂ = ± x̂³
        for (cube, supercritical) in [(-1.0, true), (1.0, false)] {
            let family = |p: f64| series([0.0, p - 0.3, 0.0, cube, 0.0], 0.0, size);
            let start = family(0.0).state().build().unwrap();
            let diagram = continuation(family).from(&start, 0.0).until(0.0..=1.0).branches(9).unwrap();
            assert!(diagram.branches.len() == 3 && diagram.failures.is_empty(), "{size}: {diagram}");
            assert_eq!(
                diagram.branches[0].special[0].kind,
                SpecialKind::Pitchfork { supercritical },
                "{diagram}"
            );
            for arm in &diagram.branches[1..] {
                assert!(arm.end == BranchEnd::Range && arm.special.is_empty(), "{size}: {arm}");
                for point in &arm.points[1..] {
                    let x = point.state.x() / size;
                    assert!((point.parameter - 0.3 + cube * x * x).abs() < 1e-13, "{size}: {point:?}");
                    assert!(
                        (x * x - (point.parameter - 0.3).abs()).abs() < 1e-12 && x != 0.0,
                        "{size}: {point:?}"
                    );
                }
            }
        }
        // (p − 0.3) x̂ = x̂²
        let found = of_trunk(|p| series([0.0, p - 0.3, -1.0, 0.0, 0.0], 0.0, size), 0.05);
        assert_eq!(found[0].0, SpecialKind::Transcritical, "{size}: {found:?}");
    }
}

#[test]
fn small_imperfections_do_not_make_small_steps() {
    // ε + (p − 0.3) x = x³, to the end of its range, and −ε + (p − 0.3) x = x² through its fold at p = 0.3 −
    // 2√ε.
    for small in [1e-3, 1e-6, 1e-9, 1e-12] {
        let bends = |p: f64| series([small, p - 0.3, 0.0, -1.0, 0.0], 0.0, 1.0);
        let rest =
            |model: Polynomial| model.equilibrium(&model.state().x(small).build().unwrap()).unwrap().state;
        let branch = continuation(bends).from(&rest(bends(0.0)), 0.0).until(0.0..=1.0).run().unwrap();
        assert!(branch.end == BranchEnd::Range && branch.special.is_empty(), "{small}: {branch}");
        let x = branch.points.last().unwrap().state.x();
        assert!((small + 0.7 * x - x.powi(3)).abs() < 1e-14 && x > 0.8, "{small}: {x}");
        let gap = |p: f64| series([-small, p - 0.3, -1.0, 0.0, 0.0], 0.0, 1.0);
        let start = gap(0.0);
        let start = start.equilibrium(&start.state().x(-small / 0.3).build().unwrap()).unwrap().state;
        let branch = continuation(gap).from(&start, 0.0).until(0.0..=1.0).run().unwrap();
        let fold = branch.folds().next().unwrap();
        assert!(branch.special.len() == 1 && branch.end == BranchEnd::Range, "{small}: {branch}");
        assert!((fold.parameter - 0.3 + 2.0 * small.sqrt()).abs() < 1e-15, "{small}: {fold:?}");
    }
}

#[test]
fn lengths_counted_from_far_away() {
    // p + x̂ = x̂³ has folds at p = ±2/√27.
    for from in [1e2, 1e4, 1e6] {
        let family = |p: f64| series([p, 1.0, 0.0, -1.0, 0.0], from, 1.0);
        let start = family(-1.0).state().x(from - 1.324_717_957_244_746).build().unwrap();
        let branch = continuation(family).from(&start, -1.0).until(-1.0..=1.0).run().unwrap();
        assert!(branch.special.len() == 2 && branch.folds().count() == 2, "{from}: {branch}");
        for (fold, sign) in branch.folds().zip([1.0, -1.0]) {
            assert!((fold.parameter - sign * 2.0 / 27.0_f64.sqrt()).abs() < 1e-14, "{from}: {fold:?}");
        }
    }
}

#[test]
fn roots_of_higher_order_say_how_far_they_may_be_off() {
    // (p − 0.3)³ x = x³: rounding hides the stiffness long before the point.
    let family = |p: f64| series([0.0, (p - 0.3).powi(3), 0.0, -1.0, 0.0], 0.0, 1.0);
    let start = family(0.0).state().build().unwrap();
    let branch = continuation(family).from(&start, 0.0).until(0.0..=1.0).run().unwrap();
    assert_eq!(branch.special.len(), 1, "{branch}");
    let point = &branch.special[0];
    assert!((point.parameter - 0.3).abs() <= point.uncertainty && point.uncertainty < 1e-5, "{point:?}");
}

#[test]
fn branches_of_less_than_two_points() {
    let family = |p: f64| series([p, -1.0, 0.0, 0.0, 0.0], 0.0, 1.0);
    let start = family(0.0).state().build().unwrap();
    for count in [0, 1] {
        let error = continuation(family).from(&start, 0.0).until(0.0..=1.0).points(count).run().unwrap_err();
        assert_eq!(error, ContinuationError::Points { count });
    }
}

#[test]
fn flutter_however_light_the_damping() {
    // λ² + d λ + k = ± i n passes the axis at n = d √k.
    for (spring, damping) in [(1.0, 0.1), (1e6, 1.0), (1e-6, 1e-5), (4.0, 1e-5), (1.0, 1e-9)] {
        let family = |across: f64| Whirl { m: 1.0, springs: [spring; 2], damping, across };
        let start = family(0.0).state().build().unwrap();
        let limit = damping * spring.sqrt();
        for width in [3.0, 30.0] {
            let branch = continuation(family).from(&start, 0.0).until(0.0..=width * limit).run().unwrap();
            let [point] = &branch.special[..] else { panic!("{spring}, {damping}: {branch}") };
            let SpecialKind::Hopf { frequency } = point.kind else { panic!("{branch}") };
            assert!((frequency / spring.sqrt() - 1.0).abs() < 1e-12, "{point:?}");
            // Rounding of eigenvalues, 10⁻¹⁶ of the frequency, is part of what the load may be off by.
            assert!((point.parameter - limit).abs() <= point.uncertainty, "{limit}: {point:?}");
            assert!(point.uncertainty < 1e-12 * limit.max(spring), "{limit}: {point:?}");
        }
    }
    // Two frequencies that are nearly one meet at n = |k₁ − k₂|/2, with growth of less than 10⁻⁶ of them.
    let family = |across: f64| Whirl { m: 1.0, springs: [1.0, 1.000_001], damping: 0.0, across };
    let start = family(0.0).state().build().unwrap();
    let branch = continuation(family).from(&start, 0.0).until(0.0..=1.5e-6).run().unwrap();
    let [point] = &branch.special[..] else { panic!("{branch}") };
    assert!(matches!(point.kind, SpecialKind::FrequenciesMeet { .. }), "{point:?}");
    assert!(
        (point.parameter - 5e-7).abs() <= 1.01 * point.uncertainty && point.uncertainty < 1e-9,
        "{point:?}"
    );
}

#[test]
fn ranges_in_which_rounding_hides_the_parameter() {
    let family = |p: f64| series([p, 1.0, 0.0, -1.0, 0.0], 0.0, 1.0);
    let start = family(-1.0).state().x(-1.324_717_957_244_746).build().unwrap();
    let end = -1.0 + 1e-12;
    let error = continuation(family).from(&start, -1.0).until(-1.0..=end).run().unwrap_err();
    assert_eq!(error, ContinuationError::Range { range: [-1.0, end], start: -1.0 });
    let far = |p: f64| series([p - 1e9, 1.0, 0.0, -1.0, 0.0], 0.0, 1.0);
    let error = continuation(far).from(&start, 1e9 - 1.0).until(1e9 - 1.0..=1e9 + 1.0).run().unwrap_err();
    assert!(matches!(error, ContinuationError::Range { .. }), "{error}");
}

#[test]
fn switching_where_no_branch_of_this_family_meets_another() {
    let (family, other) = (
        |p: f64| series([0.0, p - 0.3, 0.0, -1.0, 0.0], 0.0, 1.0),
        |p: f64| series([0.0, p - 0.6, 0.0, -1.0, 0.0], 0.0, 1.0),
    );
    let start = family(0.0).state().build().unwrap();
    let branch = continuation(family).from(&start, 0.0).until(0.0..=1.0).run().unwrap();
    let point = &branch.special[0];
    let error = continuation(other).from(&start, 0.0).until(0.0..=1.0).switch(point).unwrap_err();
    assert_eq!(error, ContinuationError::NoOtherBranch { parameter: point.parameter });
    let error = continuation(family).from(&start, 0.5).until(0.4..=1.0).switch(point).unwrap_err();
    assert_eq!(error, ContinuationError::Range { range: [0.4, 1.0], start: point.parameter });
}

#[test]
fn stiffnesses_that_follow_forces_come_and_go_in_one_step() {
    // det K = (p − 1.03)(1.03 + apart − p) + n²: zero twice, with all real, or complex in between.
    for apart in [0.3, 0.05, 0.02, 0.005] {
        for across in [0.0, 1e-3] {
            let springs = |p: f64| [p - 1.03, 1.03 + apart - p];
            let family = |p: f64| Whirl { m: 1.0, springs: springs(p), damping: 0.1, across };
            let start = family(0.0).state().build().unwrap();
            let branch = continuation(family).from(&start, 0.0).until(0.0..=3.0).run().unwrap();
            let found: Vec<f64> = branch.special.iter().map(|one| one.parameter).collect();
            let width = (apart * apart + 4.0 * across * across).sqrt();
            assert_eq!(found.len(), 2, "{apart}, {across}: {branch}");
            for (found, sign) in found.iter().zip([-1.0, 1.0]) {
                let wanted = 1.03 + 0.5 * (apart + sign * width);
                assert!((found - wanted).abs() < 1e-14, "{apart}, {across}: {found} for {wanted}");
            }
        }
    }
}
