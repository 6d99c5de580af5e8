//! Equilibria, their branches and their modes.

use dynamics::analysis::{
    ContinuationError, EquilibriumError, SpecialKind, StabilityVerdict, Undecided, continuation,
};
use dynamics::prelude::*;

use super::models::hencky::Hencky;
use super::models::top::Top;
use super::models::truss::{LIMIT, TRUSS, Truss};
use super::models::ziegler::Ziegler;
use super::statics::{Masses, Shape};

#[test]
fn newton_finds_nothing_beyond_a_fold_and_half_the_digits_in_it() {
    let at = |load: f64| {
        let model = Truss { load, ..TRUSS };
        model.equilibrium(&model.state().z(0.5).build().unwrap())
    };
    let inside = at(LIMIT[0]).unwrap();
    assert!(inside.conditioning > 1e6 && inside.uncertainty[0] > 1e-9, "{inside}");
    let error = at(LIMIT[0] * (1.0 + 1e-9)).unwrap_err();
    assert!(matches!(error, EquilibriumError::NoEquilibrium { soft: "z", .. }), "{error}");
    assert!(error.to_string().contains("a fold, beyond the limit load"), "{error}");
}

#[test]
fn weights_are_not_carried_beyond_the_limit_load() {
    let start = TRUSS.state().z(0.5).build().unwrap();
    let arch = continuation(|load| Truss { load, ..TRUSS }).from(&start, 0.0).until(0.0..=0.06);
    let error = arch.load_controlled().run().unwrap_err();
    let ContinuationError::LimitLoad { limit, ref branch, .. } = error else { panic!("{error}") };
    assert!((limit / LIMIT[0] - 1.0).abs() < 1e-12 && branch.points.len() > 5, "{error}");
}

#[test]
fn steps_from_end_to_end_see_all_branch_points() {
    let chain = |p: f64| Hencky { m: 1.0, l: 1.0, k: 1.0, p };
    let start = chain(0.0).state().build().unwrap();
    let long = continuation(chain)
        .from(&start, 0.0)
        .until(0.0..=4.0)
        .first_step(2.0)
        .longest_step(2.0)
        .run()
        .unwrap();
    let loads: Vec<f64> = long.branch_points().map(|point| point.parameter).collect();
    assert_eq!(loads.len(), 5, "{long}");
    for (j, load) in loads.iter().enumerate() {
        let wanted = 4.0 * ((2 * j + 1) as f64 * std::f64::consts::PI / 22.0).sin().powi(2);
        assert!((load - wanted).abs() < 1e-11, "{load} {wanted}");
    }
}

#[test]
fn in_a_branch_point_there_is_no_one_way_to_go() {
    let critical = 4.0 * (std::f64::consts::PI / 22.0).sin().powi(2);
    let chain = |p: f64| Hencky { m: 1.0, l: 1.0, k: 1.0, p };
    let start = chain(0.0).state().build().unwrap();
    let error = continuation(chain).from(&start, critical).until(0.0..=0.5).run().unwrap_err();
    assert!(matches!(error, ContinuationError::NotIsolated { .. }), "{error}");
    assert!(error.to_string().contains("start at another value of the parameter"), "{error}");
}

#[test]
fn at_the_critical_load_linear_theory_decides_nothing() {
    let critical = 4.0 * (std::f64::consts::PI / 22.0).sin().powi(2);
    let chain = Hencky { m: 1.0, l: 1.0, k: 1.0, p: critical };
    let found = chain.equilibria(chain.state().build().unwrap()).random(30).spread(1e-4).run().unwrap();
    assert_eq!(found.equilibria.len(), 1, "{found}");
    let judged = chain.stability(&found.equilibria[0].state).unwrap();
    assert!(
        matches!(judged.verdict, StabilityVerdict::Marginal(Undecided::NothingResists { .. })),
        "{judged}"
    );
}

#[test]
fn rounding_alone_does_not_make_a_top_stable_or_not() {
    let top = Top { across: 0.05, along: 0.01, weight: 0.5 * 9.81 * 0.1 };
    let spinning = top.state().spin_rate(31.320_919_526_731_65).build().unwrap();
    let judged = top.stability(&spinning).unwrap();
    let StabilityVerdict::Marginal(Undecided::FrequenciesMeet { conditioning, .. }) = judged.verdict else {
        panic!("{judged}")
    };
    assert!(conditioning > 1e6 && judged.uncertainty > 1e-9, "{judged}");
}

#[test]
fn a_little_damping_takes_stability_away() {
    // Between 41/28 and 7/2 − √2; at 2 the symmetric part of K vanishes, and K does not.
    for p in [1.8, 2.0] {
        let at = |c: f64| {
            let model = Ziegler { follows: 1.0, m: 1.0, l: 1.0, k: 1.0, c, p };
            model.stability(&model.state().build().unwrap()).unwrap()
        };
        assert!(
            matches!(at(0.0).verdict, StabilityVerdict::Marginal(Undecided::Swings { .. })),
            "{}",
            at(0.0)
        );
        for c in [1e-6, 1e-3, 0.1] {
            assert!(matches!(at(c).verdict, StabilityVerdict::Flutter { .. }), "{c}: {}", at(c));
        }
    }
    let top = Top { across: 0.05, along: 0.01, weight: 0.5 * 9.81 * 0.1 };
    let held = top.stability(&top.state().spin_rate(50.0).build().unwrap()).unwrap();
    assert!(held.to_string().contains("damping will in the end destroy this"), "{held}");
}

#[test]
fn flutter_is_no_buckling() {
    let family = |p: f64| Ziegler { follows: 1.0, m: 1.0, l: 1.0, k: 1.0, c: 0.0, p };
    let start = family(0.0).state().build().unwrap();
    let column = continuation(family).from(&start, 0.0).until(0.0..=4.0);
    let error = column.buckling().unwrap_err();
    assert!(matches!(error, ContinuationError::NoBuckling { .. }), "{error}");
    assert!(error.to_string().contains("flutter may come first"), "{error}");
    let branch = column.run().unwrap();
    assert!(matches!(branch.special[0].kind, SpecialKind::FrequenciesMeet { .. }), "{branch}");
}

#[test]
fn what_nothing_holds_is_named() {
    // Three masses in a row, held to nothing: K is singular whatever the springs.
    let row = Masses { m: 1.0, ground: [0.0; 3], between: [3.0, 5.0], damper: 0.0 };
    let start = row.state().x([0.3, 0.1, 0.7]).build().unwrap();
    let one = row.equilibrium(&start).unwrap();
    assert!(
        (one.state.x(0) - one.state.x(1)).abs() < 1e-15 && one.uncertainty.iter().all(|off| *off < 1e-14),
        "{one}"
    );
    let judged = row.stability(&one.state).unwrap();
    assert!(
        matches!(judged.verdict, StabilityVerdict::Marginal(Undecided::NothingResists { .. })),
        "{judged}"
    );
    let modes = row.linearize(&one.state).unwrap().normal_modes().unwrap();
    assert_eq!((modes.rigid(), modes.frequencies[0]), (1, 0.0));
    let family = |k: f64| Masses { between: [k, 5.0], ..row.clone() };
    let error = continuation(family).from(&one.state, 3.0).until(1.0..=4.0).run().unwrap_err();
    assert!(matches!(error, ContinuationError::NotIsolated { .. }), "{error}");
}

#[test]
fn defective_matrices_are_told_by_their_conditioning() {
    let of = |ratio: f64| {
        let one = Masses { m: 1.0, ground: [1.0, 4.0, 9.0], between: [0.0; 2], damper: 2.0 * ratio };
        let modes = one.linearize(&one.state().build().unwrap()).unwrap().modes().unwrap();
        modes.iter().map(|mode| mode.conditioning).fold(0.0, f64::max)
    };
    assert!(
        of(0.5) < 10.0 && of(1.0 - 1e-6) > 100.0 && of(1.0) > 1e6,
        "{} {} {}",
        of(0.5),
        of(1.0 - 1e-6),
        of(1.0)
    );
}

#[test]
fn shapes_of_nearly_repeated_modes_are_decided_by_next_to_nothing() {
    let modes = |stiffer: f64, between: f64, damper: f64| {
        let row = Masses { m: 1.0, ground: [4.0, 4.0 + stiffer, 9.0], between: [between, 0.0], damper };
        row.linearize(&row.state().build().unwrap()).unwrap().normal_modes().unwrap()
    };
    // A spring of 10⁻⁹ between two equal ones: together, and against each other. A millionth of stiffness:
    // each by itself. Frequencies hardly know of it.
    let (together, apart) = (modes(0.0, 1e-9, 0.0), modes(4e-6, 1e-9, 0.0));
    assert!((together.shapes[(0, 0)].abs() - 0.5f64.sqrt()).abs() < 1e-6, "{}", together.shapes);
    assert!(apart.shapes.column(0).amax() > 1.0 - 1e-6, "{}", apart.shapes);
    assert!((0..2).all(|k| (together.frequencies[k] / apart.frequencies[k] - 1.0).abs() < 1e-6));
    // A damper on one of them then belongs to neither mode, which is said.
    let damped = modes(0.0, 1e-3, 0.1);
    assert!(damped.coupling() > 0.9 && damped.damping_ratios().is_err());
}

#[test]
fn forces_that_fade_away_balance_nothing() {
    let shape = Shape { fading: 1.0, slope: 0.0 };
    let error = shape.equilibrium(&shape.state().x(0.5).build().unwrap()).unwrap_err();
    assert!(matches!(error, EquilibriumError::Faded { coordinate: "x", .. }), "{error}");
    let error = shape.equilibrium(&shape.state().x(1e4).build().unwrap()).unwrap_err();
    assert!(matches!(error, EquilibriumError::Faded { coordinate: "x", .. }), "{error}");
}

#[test]
fn rest_in_a_corner_is_no_balance() {
    let shape = Shape { fading: 0.0, slope: 1.0 };
    let error = shape.equilibrium(&shape.state().x(0.5).build().unwrap()).unwrap_err();
    assert!(matches!(error, EquilibriumError::Corner { coordinate: "x", .. }), "{error}");
}
