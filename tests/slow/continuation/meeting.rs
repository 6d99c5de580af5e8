//! Where branches meet, and where flutter begins.

use dynamics::analysis::{Branch, SpecialKind};

use super::free_hoop::FreeHoop;
use super::hencky::Hencky;
use super::ziegler::Ziegler;
use super::*;

fn kinds<S: dynamics::model::ModelState>(branch: &Branch<S>) -> Vec<SpecialKind> {
    branch.special.iter().map(|special| special.kind).collect()
}

const SUPERCRITICAL: SpecialKind = SpecialKind::Pitchfork { supercritical: true };
const SUBCRITICAL: SpecialKind = SpecialKind::Pitchfork { supercritical: false };

#[test]
fn a_hoop_has_a_pitchfork() {
    let (g, radius) = (9.81, 0.5_f64);
    let family = |speed: f64| TurnedHoop { m: 0.1, g, radius, speed, drag: 0.0 };
    let start = family(0.0).state().build().unwrap();
    let turned = continuation(family).from(&start, 0.0).until(0.0..=10.0);
    let diagram = turned.branches(9).unwrap();
    assert!(diagram.branches.len() == 3 && diagram.failures.is_empty() && diagram.left_out == 0, "{diagram}");
    let trunk = &diagram.branches[0];
    assert_eq!(kinds(trunk), [SUPERCRITICAL], "{diagram}");
    let point = &trunk.special[0];
    assert!(
        (point.parameter / 4.429_446_918_070_02 - 1.0).abs() < 1e-14 && point.uncertainty < 1e-14,
        "{point:?}"
    );
    for arm in &diagram.branches[1..] {
        assert!(arm.special.is_empty() && arm.points.len() > 5, "{arm}");
        for point in &arm.points[1..] {
            let cosine = g / (radius * point.parameter.powi(2));
            assert!(
                (point.state.theta().cos() - cosine).abs() < 1e-14
                    && point.stability_class() == StabilityClass::Stable,
                "{point:?}"
            );
        }
    }
    // Back along an arm, the branch turns round in the same point, and goes out on the other arm.
    let aside = diagram.branches[1].points.last().unwrap();
    let back = continuation(family).from(&aside.state, 10.0).until(0.0..=10.0).run().unwrap();
    assert_eq!(kinds(&back), [SUPERCRITICAL], "{back}");
    assert!((back.special[0].parameter / 4.429_446_918_070_02 - 1.0).abs() < 1e-9, "{back}");
    assert!((back.points.last().unwrap().state.theta() + aside.state.theta()).abs() < 1e-13, "{back}");
}

#[test]
fn henckys_chain_buckles_five_times() {
    let family = |p: f64| Hencky { m: 1.0, l: 1.0, k: 1.0, p };
    let start = family(0.0).state().build().unwrap();
    // Steps that pass two and more loads at once lose none.
    for longest in [0.02, 0.05, 1.0] {
        let column =
            continuation(family).from(&start, 0.0).until(0.0..=4.0).longest_step(longest).first_step(longest);
        let trunk = column.clone().run().unwrap();
        assert_eq!(kinds(&trunk), [SUPERCRITICAL; 5], "{longest}: {trunk}");
        for (j, point) in trunk.special.iter().enumerate() {
            assert!((point.parameter / hencky(j + 1) - 1.0).abs() < 1e-13, "{point:?}");
        }
        // The same loads and shapes from the eigenvalue problem.
        let buckling = column.buckling().unwrap();
        assert_eq!(buckling.loads.len(), 5, "{buckling}");
        for (load, point) in buckling.loads.iter().zip(&trunk.special) {
            assert!(
                (load.parameter / point.parameter - 1.0).abs() < 1e-12 && load.nonlinearity < 1e-12,
                "{load:?}"
            );
            assert!((load.shape - point.shape).amax() < 1e-9, "{load:?}\n{point:?}");
        }
    }
}

#[test]
fn what_passes_zero_to_opposite_sides_in_one_step_is_seen() {
    // The determinant has one sign before and after, and so have the least stiffness and the number of
    // negative ones.
    for apart in [1e-1, 1e-3, 1e-5] {
        let family = |p: f64| Apart { m: 1.0, first: p - 1.0, second: 1.0 + apart - p };
        let start = family(0.0).state().build().unwrap();
        let branch = continuation(family).from(&start, 0.0).until(0.0..=3.0).longest_step(0.2).run().unwrap();
        let loads: Vec<f64> = branch.special.iter().map(|point| point.parameter).collect();
        assert_eq!(loads.len(), 2, "{apart}: {branch}");
        assert!((loads[0] - 1.0).abs() < 1e-12 && (loads[1] - 1.0 - apart).abs() < 1e-12, "{loads:?}");
        assert!(
            branch.special.iter().all(|point| matches!(point.kind, SpecialKind::Pitchfork { .. })),
            "{branch}"
        );
    }
    // One that passes and comes back within a step, and one that only comes near.
    for apart in [1e-2, 1e-3, 1e-4] {
        for longest in [0.02, 0.05, 0.2] {
            let family = |p: f64| Apart { m: 1.0, first: (p - 1.03).powi(2) - apart * apart, second: 1.0 };
            let start = family(0.0).state().build().unwrap();
            let branch =
                continuation(family).from(&start, 0.0).until(0.0..=3.0).longest_step(longest).run().unwrap();
            let loads: Vec<f64> = branch.special.iter().map(|point| point.parameter).collect();
            assert_eq!(loads.len(), 2, "{apart}, {longest}: {branch}");
            assert!(
                (loads[0] - 1.03 + apart).abs() < 1e-11 && (loads[1] - 1.03 - apart).abs() < 1e-11,
                "{loads:?}"
            );
        }
    }
    let family = |p: f64| Apart { m: 1.0, first: (p - 1.03).powi(2) + 1e-6, second: 1.0 };
    let start = family(0.0).state().build().unwrap();
    let branch = continuation(family).from(&start, 0.0).until(0.0..=3.0).run().unwrap();
    assert!(branch.special.is_empty(), "{branch}");
    // What passes at the very same load is said to be several, and nothing is made up about them.
    let family = |p: f64| Apart { m: 1.0, first: 1.0 - p, second: 1.0 - p };
    let start = family(0.0).state().build().unwrap();
    let column = continuation(family).from(&start, 0.0).until(0.0..=3.0);
    let branch = column.clone().run().unwrap();
    assert_eq!(kinds(&branch), [SpecialKind::MultipleBifurcation { count: 2 }], "{branch}");
    let point = &branch.special[0];
    assert!((point.parameter - 1.0).abs() <= point.uncertainty.max(1e-9), "{point:?}");
    assert_eq!(
        column.switch(point).unwrap_err(),
        ContinuationError::NoBranchPoint { parameter: point.parameter }
    );
}

#[test]
fn a_bar_that_gives_way_to_one_side() {
    // P = k l (1 − 1/√(1 + sin θ))/tan θ crosses the upright branch at k l/2; Bažant & Cedolin, §4.5.
    let family = |load: f64| Inclined { m: 1.0, length: 1.0, spring: 1.0, offset: 0.0, load };
    let start = family(0.0).state().build().unwrap();
    let bar = continuation(family).from(&start, 0.0).until(0.0..=1.0);
    let trunk = bar.clone().run().unwrap();
    assert_eq!(kinds(&trunk), [SpecialKind::Transcritical], "{trunk}");
    assert!((trunk.special[0].parameter - 0.5).abs() < 1e-14, "{trunk}");
    let arms = bar.switch(&trunk.special[0]).unwrap();
    for arm in &arms {
        for point in arm.points.iter().skip(1) {
            let theta = point.state.theta();
            let load = (1.0 - 1.0 / (1.0 + theta.sin()).sqrt()) / theta.tan();
            assert!((point.parameter - load).abs() < 1e-12, "{point:?}");
            // Stability changes over.
            let stability = if load > 0.5 { StabilityClass::Stable } else { StabilityClass::Unstable };
            assert_eq!(point.stability_class(), stability, "{point:?}");
        }
    }
    let sides: Vec<bool> = arms.iter().map(|arm| arm.points[3].parameter > 0.5).collect();
    assert!(sides.contains(&true) && sides.contains(&false));
}

#[test]
fn a_bar_that_gives_way_to_both_sides() {
    let family = |load: f64| Level { m: 1.0, length: 1.0, spring: 1.0, offset: 0.0, load };
    let start = family(0.0).state().build().unwrap();
    let bar = continuation(family).from(&start, 0.0).until(0.0..=2.0);
    let trunk = bar.clone().run().unwrap();
    assert_eq!(kinds(&trunk), [SUBCRITICAL], "{trunk}");
    for arm in bar.switch(&trunk.special[0]).unwrap() {
        for point in &arm.points[1..] {
            assert!((point.parameter - point.state.theta().cos()).abs() < 1e-14, "{point:?}");
            assert!(
                point.parameter < 0.1 || point.stability_class() == StabilityClass::Unstable,
                "{point:?}"
            );
        }
    }
    // Imperfect ones have a fold instead: by the two-thirds law to both sides, by the square root where it
    // gives way to one.
    let fold_of = |branch: Branch<_>| branch.folds().next().map(|fold| fold.parameter);
    for offset in [1e-2, 1e-4, 1e-6] {
        let family = |load: f64| Level { m: 1.0, length: 1.0, spring: 1.0, offset, load };
        let first = family(0.0);
        let first = first.equilibrium(&first.state().theta(offset).build().unwrap()).unwrap();
        let branch = continuation(family).from(&first.state, 0.0).until(0.0..=1.5).run().unwrap();
        let wanted = (1.0 - offset.cbrt().powi(2)).powf(1.5);
        assert!((fold_of(branch).unwrap() / wanted - 1.0).abs() < 1e-12, "{offset}");
    }
    let mut lost = Vec::new();
    for offset in [1e-3, 1e-5, 1e-7] {
        let family = |load: f64| Inclined { m: 1.0, length: 1.0, spring: 1.0, offset, load };
        let first = family(0.0);
        let first = first.equilibrium(&first.state().build().unwrap()).unwrap();
        let branch = continuation(family).from(&first.state, 0.0).until(0.0..=1.0).run().unwrap();
        let fold = branch.folds().next();
        lost.push(1.0 - fold.map_or(f64::NAN, |fold| fold.parameter) / 0.5);
    }
    for pair in lost.windows(2) {
        let exponent = (pair[0] / pair[1]).log10() / 2.0;
        assert!((exponent - 0.5).abs() < 0.03, "{lost:?}");
    }
}

#[test]
fn zieglers_column_begins_to_flutter() {
    let family = |c: f64| move |p: f64| Ziegler { follows: 1.0, m: 1.0, l: 1.0, k: 1.0, c, p };
    let start = family(0.0)(0.0).state().build().unwrap();
    let run = |c: f64| continuation(family(c)).from(&start, 0.0).until(0.0..=6.0).run().unwrap();
    let undamped = run(0.0);
    let [begins, ends] = &undamped.special[..] else { panic!("{undamped}") };
    let SpecialKind::FrequenciesMeet { frequency } = begins.kind else { panic!("{undamped}") };
    assert!(
        (begins.parameter - (3.5 - 2.0_f64.sqrt())).abs() < 1e-11 && begins.uncertainty < 1e-10,
        "{begins:?}"
    );
    assert!((begins.parameter - (3.5 - 2.0_f64.sqrt())).abs() <= 1.1 * begins.uncertainty, "{begins:?}");
    assert!((frequency - 0.5_f64.powf(0.25)).abs() < 1e-7, "{begins:?}");
    assert!(matches!(ends.kind, SpecialKind::FlutterDivergence { .. }), "{undamped}");
    assert!((ends.parameter - (3.5 + 2.0_f64.sqrt())).abs() < 1e-11, "{ends:?}");
    // Damping takes away a third of it, however little there is (H. Ziegler); 41/28 + c²/2.
    for c in [1e-3, 0.1, 1.0] {
        let damped = run(c);
        let point = &damped.special[0];
        assert!(matches!(point.kind, SpecialKind::Hopf { .. }), "{damped}");
        assert!((point.parameter - (41.0 / 28.0 + 0.5 * c * c)).abs() < 1e-11, "{c}: {point:?}");
        let others = damped.special[1..]
            .iter()
            .all(|other| matches!(other.kind, SpecialKind::FlutterDivergence { .. }));
        assert!(others, "{damped}");
    }
    // No load makes a column that is followed by its load diverge: there is no buckling load to be found.
    let error = continuation(family(0.0)).from(&start, 0.0).until(0.0..=6.0).buckling().unwrap_err();
    assert!(matches!(error, ContinuationError::NoBuckling { .. }), "{error}");
}

#[test]
fn a_force_that_follows_in_part_buckles_the_column() {
    // (2 − P)(1 − (1 − η)P) = 1 − ηP: at η = ½ P = 1 and 2. The stiffness has no symmetry that shapes could
    // be told by.
    let family = |p: f64| Ziegler { follows: 0.5, m: 1.0, l: 1.0, k: 1.0, c: 0.05, p };
    let start = family(0.0).state().build().unwrap();
    for longest in [0.05, 1.0] {
        let column =
            continuation(family).from(&start, 0.0).until(0.0..=2.5).longest_step(longest).first_step(longest);
        let trunk = column.clone().run().unwrap();
        let points: Vec<_> = trunk.branch_points().collect();
        assert_eq!(points.len(), 2, "{longest}: {trunk}");
        for (point, wanted) in points.iter().zip([1.0, 2.0]) {
            assert!((point.parameter - wanted).abs() < 1e-12, "{point:?}");
        }
        assert!(column.switch(points[0]).unwrap().iter().all(|arm| arm.points.len() > 3));
    }
}

#[test]
fn steps_do_not_cut_the_corner_that_an_imperfection_leaves() {
    // P l sin θ = k (θ − ε): from 0 the bar goes over to its own side smoothly, however little it is out of
    // the upright; the other branches do not meet this one.
    for offset in [1e-2, 1e-4, 1e-6, 1e-8] {
        for longest in [0.05, 0.3] {
            let family = |load: f64| Hinged { m: 1.0, length: 1.0, spring: 1.0, offset, load, torque: 0.0 };
            let start = family(0.0).state().theta(offset).build().unwrap();
            let bar = continuation(family).from(&start, 0.0).until(0.0..=2.0).longest_step(longest);
            let branch = bar.clone().run().unwrap();
            assert!(branch.special.is_empty(), "{offset}, {longest}: {branch}");
            let last = branch.points.last().unwrap();
            let load = (last.state.theta() - offset) / last.state.theta().sin();
            assert!(last.state.theta() > 1.8 && (load - 2.0).abs() < 1e-13, "{offset}, {longest}: {branch}");
        }
    }
}

#[test]
fn a_steady_motion_has_a_pitchfork_too() {
    // At the same speed of the hoop, over g: R ω².
    let family = |g: f64| FreeHoop { m: 0.1, g, radius: 0.5, inertia: 0.01 };
    let start = family(12.0).state().phi_rate(4.0).build().unwrap();
    let hoop = continuation(family).from(&start, 12.0).until(1.0..=12.0);
    let diagram = hoop.branches(5).unwrap();
    assert_eq!(diagram.branches.len(), 3, "{diagram}");
    let point = &diagram.branches[0].special[0];
    assert!(matches!(point.kind, SpecialKind::Pitchfork { .. }), "{diagram}");
    assert!((point.parameter - 8.0).abs() < 1e-12, "{point:?}");
    for arm in &diagram.branches[1..] {
        for point in &arm.points {
            assert!(
                (point.state.theta().cos() - point.parameter / 8.0).abs() < 1e-7 && point.state.phi() == 0.0
            );
        }
    }
}

#[test]
fn a_tall_truss_buckles_aside_before_it_snaps() {
    let family = |load: f64| Tall { m: 1.0, stiffness: 1.0, half_span: 1.0, height: 3.0, load };
    let start = family(0.0).state().z(3.0).build().unwrap();
    let diagram = continuation(family).from(&start, 0.0).until(-4.0..=4.0).branches(12).unwrap();
    // On the symmetric branch x resists no more where ℓ³ = ℓ₀ z², and z where ℓ³ = ℓ₀ b².
    let free = 10.0_f64.sqrt();
    let trunk = &diagram.branches[0];
    assert_eq!(
        (trunk.folds().count(), trunk.branch_points().count(), trunk.special.len()),
        (2, 4, 6),
        "{trunk}"
    );
    for special in &trunk.special {
        let z = special.state.z();
        let length = (1.0 + z * z).sqrt();
        let missed = match special.kind {
            SpecialKind::Fold => length.powi(3) - free,
            _ => length.powi(3) - free * z * z,
        };
        assert!(missed.abs() < 1e-11 && special.state.x().abs() < 1e-12, "{special:?}");
        assert!((special.parameter - 2.0 * z * (free / length - 1.0)).abs() < 1e-13, "{special:?}");
    }
    // Aside: one closed curve through both of the outer ones, found once, every point of it in balance.
    let closed: Vec<_> = diagram.branches.iter().filter(|branch| branch.end == BranchEnd::Closed).collect();
    let [loop_] = closed[..] else { panic!("{diagram}") };
    for point in &loop_.points {
        let (x, z) = (point.state.x(), point.state.z());
        let bar = |from: f64| {
            let length = ((x - from).powi(2) + z * z).sqrt();
            [x - from, z].map(|along| (length - free) * along / length)
        };
        let (left, right) = (bar(-1.0), bar(1.0));
        assert!(
            (left[0] + right[0]).abs() < 1e-12 && (left[1] + right[1] + point.parameter).abs() < 1e-12,
            "{point:?}"
        );
    }
    assert!(
        loop_.points.iter().any(|point| point.state.x() > 0.5)
            && loop_.points.iter().any(|point| point.state.x() < -0.5)
    );
    // Through the inner ones branches go to where the apex meets a foot, and a bar has no length: there the
    // model ends, and each says so.
    assert_eq!((diagram.branches.len(), diagram.failures.len()), (2 + 1 + 4, 4), "{diagram}");
    for branch in &diagram.branches[3..] {
        let last = &branch.points.last().unwrap().state;
        assert!((last.x().abs() - 1.0).abs() < 1e-6 && last.z().abs() < 1e-6, "{branch}");
    }
}

#[test]
fn units_make_no_difference() {
    // In millimetres and tonnes, and in kilometres and grammes.
    for (length, mass) in [(1e3, 1e-3), (1e-3, 1e6), (1e-6, 1e-6)] {
        let force = mass * length;
        let family =
            |load: f64| Truss { m: mass, stiffness: force, half_span: length, height: 0.5 * length, load };
        let start = family(0.0).state().z(0.5 * length).build().unwrap();
        let branch =
            continuation(family).from(&start, 0.0).until(-0.06 * force..=0.06 * force).run().unwrap();
        assert_eq!((branch.folds().count(), branch.special.len()), (2, 2), "{branch}");
        for (fold, sign) in branch.folds().zip([1.0, -1.0]) {
            assert!((sign * fold.parameter / (LIMIT[0] * force) - 1.0).abs() < 1e-12, "{fold:?}");
        }
        assert!((40..200).contains(&branch.points.len()), "{branch}");
    }
}
