//! Where a branch ends, and what is said there.

use dynamics::analysis::{EquilibriumError, LinearizeError, SpecialKind};

use super::*;

#[test]
fn load_control_fails_at_the_limit_load() {
    let family = |load: f64| Truss { load, ..TRUSS };
    let start = TRUSS.state().z(0.5).build().unwrap();
    let controlled = continuation(family).from(&start, 0.0).until(0.0..=0.06).named("load").load_controlled();
    let error = controlled.run().unwrap_err();
    let ContinuationError::LimitLoad { limit, ref at, ref branch, .. } = error else { panic!("{error}") };
    assert!((limit / LIMIT[0] - 1.0).abs() < 1e-13 && (at.z() - LIMIT[1]).abs() < 1e-12, "{error}");
    // It has all up to there, and has not jumped to the other side.
    let last = branch.points.last().unwrap();
    assert!(
        branch.points.len() > 5 && last.parameter <= limit && limit - last.parameter < 1e-9 * limit,
        "{branch}"
    );
    assert!(branch.points.iter().all(|point| point.state.z() > LIMIT[1]), "{branch}");
    assert!(error.to_string().starts_with("the load cannot be carried beyond 0.03838373981"), "{error}");
    assert_eq!(error.branch(), Some(&**branch));
    // Below it there is nothing to be said.
    let within = continuation(family).from(&start, 0.0).until(0.0..=0.038).load_controlled().run().unwrap();
    assert_eq!(within.end, BranchEnd::Range, "{within}");
}

#[test]
fn a_model_that_stops_being_one() {
    // A mass that becomes negative on the way, and a half span that does.
    let family = |m: f64| Truss { m, load: 0.01, ..TRUSS };
    let model = family(1.0);
    let start = model.equilibrium(&model.state().z(0.5).build().unwrap()).unwrap().state;
    let error = continuation(family).from(&start, 1.0).until(-1.0..=1.0).run().unwrap_err();
    let ContinuationError::Model { parameter, ref reason, ref branch } = error else { panic!("{error}") };
    assert!((0.0..1e-6).contains(&parameter) && branch.points.len() > 5, "{error}\n{branch}");
    assert_eq!(*reason, EquilibriumError::Derivatives(LinearizeError::Inertia), "{error}");
    assert!(branch.points.iter().all(|point| point.parameter > 0.0), "{branch}");
    // A parameter that is not a number.
    let family = |p: f64| Truss { load: (0.02 - p).sqrt() * 0.1, ..TRUSS };
    let model = family(0.0);
    let start = model.equilibrium(&model.state().z(0.5).build().unwrap()).unwrap().state;
    let error = continuation(family).from(&start, 0.0).until(0.0..=0.06).run();
    if let Ok(b) = &error {
        println!("{b}");
        b.points.iter().for_each(|p| println!("{:?} {:?}", p.parameter, p.state.q()));
    }
    let error = error.unwrap_err();
    let ContinuationError::Model { parameter, ref reason, ref branch } = error else { panic!("{error}") };
    assert!((0.019..=0.02).contains(&parameter) && branch.points.len() > 3, "{error}\n{branch}");
    assert!(matches!(reason, EquilibriumError::State(_)) && error.to_string().contains("`load`"), "{error}");
}

#[test]
fn starts_that_are_none() {
    let family = |load: f64| Truss { load, ..TRUSS };
    let from = |z: f64, load: f64| {
        let start = TRUSS.state().z(z).build().unwrap();
        continuation(family).from(&start, load).until(0.0..=0.06).run().unwrap_err()
    };
    let ContinuationError::NotInBalance { coordinate: "z", off, nearest } = from(0.45, 0.0) else { panic!() };
    assert!((off - 0.05).abs() < 1e-12 && (nearest.z() - 0.5).abs() < 1e-12);
    assert!(matches!(from(0.3, 0.05), ContinuationError::Start(_) | ContinuationError::NotInBalance { .. }));
    assert_eq!(from(0.5, 0.07), ContinuationError::Range { range: [0.0, 0.06], start: 0.07 });
    let start = TRUSS.state().z(0.5).build().unwrap();
    let error = continuation(family).from(&start, 0.0).run().unwrap_err();
    assert!(matches!(error, ContinuationError::Range { start: 0.0, .. }), "{error}");
    let error = continuation(family).from(&start, 0.0).until(0.0..=1.0).longest_step(-1.0).run().unwrap_err();
    assert_eq!(error, ContinuationError::Option { name: "longest_step", value: -1.0 });
    // What nothing holds rests anywhere.
    let free = |p: f64| Apart { m: 1.0, first: p, second: 0.0 };
    let start = free(1.0).state().build().unwrap();
    let error = continuation(free).from(&start, 1.0).until(0.5..=2.0).run().unwrap_err();
    assert!(matches!(error, ContinuationError::NotIsolated { .. }), "{error}");
}

#[test]
fn a_branch_that_comes_back() {
    let family = |p: f64| Circle { m: 1.0, p };
    let start = family(0.0).state().x(1.0).build().unwrap();
    for longest in [0.02, 0.05, 0.1] {
        let branch =
            continuation(family).from(&start, 0.0).until(-2.0..=2.0).longest_step(longest).run().unwrap();
        assert_eq!(
            (branch.end, branch.folds().count(), branch.special.len()),
            (BranchEnd::Closed, 2, 2),
            "{branch}"
        );
        for (fold, wanted) in branch.folds().zip([1.0, -1.0]) {
            assert!((fold.parameter - wanted).abs() < 1e-14 && fold.state.x().abs() < 1e-14, "{fold:?}");
        }
        // Once round, and not once more.
        let turned = |a: &BranchPoint, b: &BranchPoint| {
            let angle = |point: &BranchPoint| point.parameter.atan2(point.state.x());
            (angle(b) - angle(a)).rem_euclid(std::f64::consts::TAU)
        };
        let whole: f64 = branch.points.windows(2).map(|pair| turned(&pair[0], &pair[1])).sum();
        assert!((whole - std::f64::consts::TAU).abs() < 1e-9, "{whole}");
    }
    let few = continuation(family).from(&start, 0.0).until(-2.0..=2.0).points(5).run().unwrap();
    assert_eq!((few.end, few.points.len()), (BranchEnd::Points, 5));
}

#[test]
fn a_branch_that_comes_back_a_turn_further_on() {
    // τ = m g l sin θ, turned round and round: closed, where angles count by what is left of turns.
    let family = |torque: f64| Hinged { m: 1.0, length: 1.0, spring: 0.0, offset: 0.0, load: -1.0, torque };
    let start = family(0.0).state().theta(0.0).build().unwrap();
    let branch = continuation(family).from(&start, 0.0).until(-2.0..=2.0).run().unwrap();
    assert_eq!(
        (branch.end, branch.folds().count(), branch.special.len()),
        (BranchEnd::Closed, 2, 2),
        "{branch}"
    );
    for (fold, wanted) in branch.folds().zip([1.0, -1.0]) {
        assert!((fold.parameter - wanted).abs() < 1e-14, "{fold:?}");
    }
}

#[test]
fn coordinates_take_turns_in_being_independent() {
    // The bead follows gravity twice all round the hoop: each of its coordinates is useless twice on the way.
    let family = |side: f64| Bead { m: 1.0, radius: 0.5, g: 9.81, side };
    let start = family(0.0).state().z(-0.5).build().unwrap();
    let turns = 4.0 * std::f64::consts::PI;
    let branch = continuation(family).from(&start, 0.0).until(0.0..=turns).run().unwrap();
    assert!(branch.special.is_empty() && branch.end == BranchEnd::Range, "{branch}");
    for point in &branch.points {
        let (x, z) = (point.state.x(), point.state.z());
        let wanted = [0.5 * point.parameter.sin(), -0.5 * point.parameter.cos()];
        assert!((x - wanted[0]).abs() < 1e-13 && (z - wanted[1]).abs() < 1e-13, "{point:?}");
        assert_eq!(point.stability_class(), StabilityClass::Stable, "{point:?}");
    }
    // The end where one of them says next to nothing.
    for beside in [1e-5, 1e-7, -1e-8] {
        let end = 0.5 * std::f64::consts::PI + beside;
        let branch = continuation(family).from(&start, 0.0).until(0.0..=end).run().unwrap();
        let last = branch.points.last().unwrap();
        assert!(
            (last.state.x() - 0.5 * end.sin()).abs() < 1e-15
                && (last.state.z() + 0.5 * end.cos()).abs() < 1e-15
        );
        assert_eq!(last.stability_class(), StabilityClass::Stable, "{last:?}");
    }
}

#[test]
fn forces_with_a_corner() {
    // The spring carries 1 at most, and its stiffness jumps from 1 to −1 there.
    let family = |load: f64| Yields { m: 1.0, load };
    let start = family(0.0).state().build().unwrap();
    let spring = continuation(family).from(&start, 0.0).until(0.0..=1.5);
    let branch = spring.clone().run().unwrap();
    let fold = branch.folds().next().unwrap();
    assert!((fold.parameter - 1.0).abs() <= fold.uncertainty && fold.uncertainty < 1e-6, "{fold:?}");
    for point in &branch.points {
        let x = point.state.x();
        assert!((x.min(2.0 - x) - point.parameter).abs() < 1e-13, "{point:?}");
    }
    // Weights end there, too, and no fold that is none is made of it.
    let error = spring.load_controlled().run().unwrap_err();
    let ContinuationError::Stuck { parameter, ref branch, .. } = error else { panic!("{error}") };
    assert!((parameter - 1.0).abs() < 1e-8 && branch.points.len() > 5, "{error}");
}

#[test]
fn a_branch_beside_others_is_not_left() {
    for apart in [0.3, 0.05, 0.01] {
        for longest in [0.05, 0.3, 1.0] {
            let family = |p: f64| Grooves { m: 1.0, apart, p };
            let start = family(0.0).state().build().unwrap();
            let grooves = continuation(family)
                .from(&start, 0.0)
                .until(0.0..=3.0)
                .longest_step(longest)
                .first_step(longest);
            let branch = grooves.run().unwrap();
            assert!(branch.special.is_empty(), "{apart}, {longest}: {branch}");
            for point in &branch.points {
                assert!(
                    (point.state.x() - (4.0 * point.parameter).sin()).abs() < 1e-12,
                    "{apart}, {longest}: {point:?}"
                );
            }
        }
    }
}

#[test]
fn what_rolls_is_refused() {
    let family = |stiffness: f64| Sleigh { gyration: 0.1, m: 1.0, stiffness };
    let start = family(1.0).state().build().unwrap();
    let error = continuation(family).from(&start, 1.0).until(0.5..=2.0).run().unwrap_err();
    assert_eq!(error, ContinuationError::Nonholonomic);
}

type BranchPoint = dynamics::analysis::PointOnBranch<<Circle as dynamics::model::Model>::State>;

#[test]
fn from_the_very_fold_a_branch_goes_to_both_sides() {
    let family = |load: f64| Truss { load, ..TRUSS };
    let model = family(LIMIT[0]);
    let start = model.equilibrium(&model.state().z(LIMIT[1]).build().unwrap()).unwrap().state;
    let fold = continuation(family).from(&start, LIMIT[0]).until(0.0..=0.06);
    let ends = [fold.clone().run().unwrap(), fold.backward().run().unwrap()].map(|branch| {
        assert_eq!(branch.end, BranchEnd::Range, "{branch}");
        let last = branch.points.last().unwrap().clone();
        assert!(
            (load_at(last.state.z()) - last.parameter).abs() < 1e-12 && last.parameter == 0.0,
            "{branch}"
        );
        // It begins in a fold, and in no branch point.
        assert!(branch.special.first().is_some_and(|one| one.kind == SpecialKind::Fold), "{branch}");
        assert!(branch.branch_points().next().is_none(), "{branch}");
        last.state.z()
    });
    // Up to the unloaded arch on one side, down to the flat one on the other.
    let (low, high) = (ends[0].min(ends[1]), ends[0].max(ends[1]));
    assert!((high - 0.5).abs() < 1e-9 && low.abs() < 1e-9, "{ends:?}");
}

/// F = f (1 − (x/s)²) − p: the fold is where x counts from.
#[derive(Clone, Debug, Dynamics)]
#[coordinates(x)]
struct Parabola {
    p: f64,
    size: f64,
    force: f64,
}
#[dynamics]
impl Parabola {
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * q.x.dt().powi(2)
    }
    #[potential]
    fn spring(&self, q: &Coordinates<Self>) -> Expr {
        self.force * (q.x - q.x.powi(3) / (3.0 * self.size.powi(2))) - self.p * q.x
    }
}

#[test]
fn a_fold_is_left_at_its_own_size() {
    for (size, force) in [(1.0, 1.0), (1e-6, 1.0), (1e6, 1.0), (1.0, 1e-6), (1e-6, 1e6)] {
        for off in [0.0, 1e-5, 1e-3] {
            let family = |p: f64| Parabola { p, size, force };
            let p = force * (1.0 - off * off);
            let start = family(p).state().x(off * size).build().unwrap();
            let parabola = || continuation(family).from(&start, p).until(-3.0 * force..=1.2 * force);
            for backward in [false, true] {
                let run = if backward { parabola().backward() } else { parabola() };
                let branch =
                    run.run().unwrap_or_else(|error| panic!("{size:e}, {force:e}, {off:e}: {error}"));
                assert!(
                    branch.end == BranchEnd::Range && branch.points.len() < 200,
                    "{size:e}, {off:e}: {branch}"
                );
                let last = branch.points.last().unwrap();
                assert!((last.state.x().abs() / size - 2.0).abs() < 1e-9, "{size:e}, {off:e}: {branch}");
                assert!(branch.branch_points().next().is_none(), "{size:e}, {off:e}: {branch}");
                for fold in branch.folds() {
                    assert!(
                        (fold.parameter / force - 1.0).abs() < 1e-12 && fold.state.x().abs() < 1e-7 * size
                    );
                }
            }
        }
    }
}
