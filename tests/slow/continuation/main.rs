//! Branches of equilibria of derived models against closed forms and other coordinates: folds, branch points,
//! flutter, and what is said where a branch ends.

mod backbone;
mod beck;
#[path = "../../models/double_pendulum.rs"]
mod double_pendulum;
mod ends;
#[path = "../../models/free_hoop.rs"]
mod free_hoop;
#[path = "../../models/hencky.rs"]
mod hencky;
mod meeting;
mod models;
mod scales;
mod several;
#[path = "../../models/shaken.rs"]
mod shaken;
mod shaken_by_time;
#[path = "../../models/truss.rs"]
mod truss;
#[path = "../../models/turned_hoop.rs"]
mod turned_hoop;
#[path = "../../models/ziegler.rs"]
mod ziegler;

use dynamics::analysis::{BranchEnd, ContinuationError, StabilityClass, continuation, fold_curve};
use dynamics::output::Chart;
use dynamics::prelude::*;
use models::*;
use turned_hoop::TurnedHoop;

/// At which load the truss has its apex at z.
fn load_at(z: f64) -> f64 {
    let (free, length) = (1.25_f64.sqrt(), (1.0 + z * z).sqrt());
    2.0 * z / free * (free / length - 1.0)
}

#[test]
fn a_truss_through_both_limit_points() {
    let family = |load: f64| Truss { load, ..TRUSS };
    let start = TRUSS.state().z(0.5).build().unwrap();
    for longest in [0.02, 0.05, 0.3] {
        let arch = continuation(family).from(&start, 0.0).until(-0.06..=0.06).longest_step(longest);
        let branch = arch.run().unwrap();
        assert_eq!(branch.end, BranchEnd::Range, "{branch}");
        // Every point is an equilibrium, to rounding, and the last one lies on the edge.
        for point in &branch.points {
            assert!((load_at(point.state.z()) - point.parameter).abs() < 1e-15, "{point:?}");
        }
        assert_eq!(branch.points.last().unwrap().parameter, 0.06);
        // Both folds, and nothing else.
        assert!(branch.special.len() == 2 && branch.folds().count() == 2, "{branch}");
        for (fold, sign) in branch.folds().zip([1.0, -1.0]) {
            let [limit, z] = LIMIT.map(|x| sign * x);
            assert!((fold.parameter / limit - 1.0).abs() < 1e-13 && fold.uncertainty < 1e-14, "{fold:?}");
            assert!((fold.state.z() / z - 1.0).abs() < 1e-13 && fold.shape[0] == 1.0, "{fold:?}");
        }
        // Between the folds it does not stay.
        for point in &branch.points {
            let wanted = if point.state.z().abs() < LIMIT[1] {
                StabilityClass::Unstable
            } else {
                StabilityClass::Stable
            };
            assert_eq!(point.stability_class(), wanted, "{point:?}");
        }
        assert!(branch.derivative_error < 1e-9, "{}", branch.derivative_error);
    }
}

#[test]
fn the_same_by_coordinates_with_constraints_that_repeat() {
    let free = 1.25_f64.sqrt();
    let family = |load: f64| Bars { m: 1.0, stiffness: 1.0, half_span: 1.0, free, load };
    let start = family(0.0).state().z(0.5).length(free).build().unwrap();
    let branch = continuation(family).from(&start, 0.0).until(-0.06..=0.06).run().unwrap();
    assert_eq!((branch.folds().count(), branch.special.len()), (2, 2), "{branch}");
    for (fold, sign) in branch.folds().zip([1.0, -1.0]) {
        let [limit, z] = LIMIT.map(|x| sign * x);
        assert!(
            (fold.parameter / limit - 1.0).abs() < 1e-12 && (fold.state.z() / z - 1.0).abs() < 1e-12,
            "{fold:?}"
        );
    }
    for point in &branch.points {
        let (z, length) = (point.state.z(), point.state.length());
        assert!((load_at(z) - point.parameter).abs() < 1e-14, "{point:?}");
        assert!((length - (1.0 + z * z).sqrt()).abs() < 1e-14 && point.state.x().abs() < 1e-15, "{point:?}");
    }
}

#[test]
fn a_length_is_as_good_a_parameter() {
    // The half span moves the constraints themselves: balance at a given load where load_at, scaled, is that
    // load.
    let load = 0.02;
    let family = |half_span: f64| Bars { m: 1.0, stiffness: 1.0, half_span, free: 1.25_f64.sqrt(), load };
    let first = family(1.0);
    let first = first.equilibrium(&first.state().z(0.4).length(1.16_f64.sqrt()).build().unwrap()).unwrap();
    let branch = continuation(family).from(&first.state, 1.0).until(0.5..=1.2).run().unwrap();
    for point in &branch.points {
        let (z, b) = (point.state.z(), point.parameter);
        let length = (b * b + z * z).sqrt();
        let force = 2.0 * z / 1.25_f64.sqrt() * (1.25_f64.sqrt() / length - 1.0);
        assert!((force - load).abs() < 1e-14 && (point.state.length() - length).abs() < 1e-14, "{point:?}");
    }
    // Flatter and flatter it snaps: a fold where the limit load is the load, dP/dz = 0 at ℓ³ = ℓ₀ b².
    let fold = branch.folds().next().unwrap();
    let (z, b) = (fold.state.z(), fold.parameter);
    let length = (b * b + z * z).sqrt();
    assert!((length.powi(3) - 1.25_f64.sqrt() * b * b).abs() < 1e-12, "{fold:?}");
}

#[test]
fn a_soft_spring_in_series_snaps_back() {
    let series = |spring: f64| {
        move |down: f64| SnapBack { m: 1.0, stiffness: 1.0, half_span: 1.0, height: 0.5, spring, down }
    };
    let start = series(1.0)(0.0).state().z(0.5).build().unwrap();
    let free = 1.25_f64.sqrt();
    // d = h − z + P(z)/k turns round where P′ = k: ℓ³ = ℓ₀/(1 + k ℓ₀/2), if the spring is softer than the
    // truss at its softest, P′(0) = 2(1 − 1/ℓ₀).
    for (spring, folds) in [(0.05, 2), (0.1, 2), (0.3, 0)] {
        let branch = continuation(series(spring)).from(&start, 0.0).until(-2.0..=3.0).run().unwrap();
        assert_eq!((branch.folds().count(), branch.special.len()), (folds, folds), "{spring}: {branch}");
        let length = (free / (1.0 + 0.5 * spring * free)).cbrt();
        for (fold, sign) in branch.folds().zip([1.0, -1.0]) {
            let z = sign * (length * length - 1.0).sqrt();
            let down = 0.5 - z + load_at(z) / spring;
            assert!((fold.parameter - down).abs() < 1e-13 && (fold.state.z() - z).abs() < 1e-12, "{fold:?}");
        }
        // Controlled by the displacement it snaps all the same: the load falls while the displacement goes
        // back.
        let [lo, hi] = branch.range();
        assert!(lo <= 0.0 && hi == 3.0, "{branch}");
        for point in &branch.points {
            let z = point.state.z();
            assert!((0.5 - z + load_at(z) / spring - point.parameter).abs() < 1e-13, "{point:?}");
        }
    }
}

#[test]
fn limit_loads_over_a_second_parameter() {
    // Sensitivity to imperfections of a bar held by a level spring: P = k l (1 − ε^(2/3))^(3/2), sin³θ = ε
    // (W. T. Koiter, 1945).
    let bar = |load: f64, offset: f64| Level { m: 1.0, length: 1.0, spring: 1.0, offset, load };
    let first = bar(0.0, 0.01);
    let start = first.equilibrium(&first.state().theta(0.01).build().unwrap()).unwrap();
    let branch = continuation(|load| bar(load, 0.01)).from(&start.state, 0.0).until(0.0..=1.5).run().unwrap();
    let fold = branch.folds().next().unwrap();
    let curve = fold_curve(bar, fold, 0.01).until(0.0..=1.5, 1e-4..=0.2).run().unwrap();
    assert_eq!(curve.end, BranchEnd::Range);
    assert!(curve.points.len() > 10 && curve.points.last().unwrap().0[1] == 0.2);
    for ([load, offset], state) in &curve.points {
        let part = offset.cbrt().powi(2);
        assert!((load - (1.0 - part).powf(1.5)).abs() < 1e-12, "{load} at {offset}");
        assert!((state.theta().sin() - offset.cbrt()).abs() < 1e-10, "{state:?}");
    }
    // Toward the perfect one, as far as it goes: 1 − P/P₀ ~ 3/2 ε^(2/3).
    let back = fold_curve(bar, fold, 0.01).until(0.0..=1.5, 1e-6..=0.2).backward().run().unwrap();
    let ([load, offset], _) = back.points.last().unwrap();
    assert!(*offset == 1e-6 && ((1.0 - load) / (1.5 * 1e-4) - 1.0).abs() < 1e-3, "{load} at {offset}");
    // From where there is no fold there is none to follow.
    let mut none = fold.clone();
    (none.parameter, none.state) = (0.1, start.state);
    let error = fold_curve(bar, &none, 0.01).until(0.0..=1.5, 1e-4..=0.2).run().unwrap_err();
    assert_eq!(error, ContinuationError::NoFold);
}

#[test]
fn tables_and_words() {
    let family = |load: f64| Truss { load, ..TRUSS };
    let start = TRUSS.state().z(0.5).build().unwrap();
    let arch = continuation(family).from(&start, 0.0).until(-0.06..=0.06).named("load, pressed");
    let branch = arch.run().unwrap();
    let csv = branch.to_csv();
    let lines: Vec<&str> = csv.lines().collect();
    assert_eq!(lines[0], "branch,\"load, pressed\",z,arclength,stability,growth,special");
    assert_eq!(lines.len(), 1 + branch.points.len() + 2);
    assert!(lines[1].starts_with("1,0,0.5,0,stable,") && lines.last().unwrap().ends_with(",fold"), "{csv}");
    // A comma within quotes is none.
    assert!(lines[1..].iter().all(|line| line.split(',').count() == 7), "{csv}");
    let words = branch.to_string();
    assert!(
        words.contains("fold") && words.contains("from, stable") && words.contains("an end of the range"),
        "{words}"
    );
    // Solid, dashed, and a sign for the folds.
    let svg = Chart::from(branch.panel("height in m", |state| state.z())).to_svg();
    for name in ["stable", "unstable", "fold", "load, pressed", "stroke-dasharray"] {
        assert!(svg.contains(name), "{name}");
    }
    // Branches of one stability are one series, with gaps between: nothing joins the end of one to the
    // beginning of the next.
    let family = |speed: f64| TurnedHoop { m: 0.1, g: 9.81, radius: 0.5, speed, drag: 0.0 };
    let start = family(0.0).state().build().unwrap();
    let diagram = continuation(family).from(&start, 0.0).until(0.0..=10.0).branches(3).unwrap();
    let svg = Chart::from(diagram.panel("θ in rad", |state| state.theta())).to_svg();
    let drawn = |color: &str| svg.matches(&format!("stroke=\"{color}\"")).count();
    println!("{svg}");
    assert_eq!((drawn("#1f6fb4"), drawn("#cf3f4f")), (1 + 3, 1 + 1), "{svg}");
    assert!(!svg.contains("not finite"), "{svg}");
    assert_eq!(
        diagram.to_csv().lines().filter(|line| line.starts_with("3,")).count(),
        diagram.branches[2].points.len()
    );
}
