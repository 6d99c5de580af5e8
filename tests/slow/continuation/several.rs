//! Branches that meet where several stiffnesses vanish at once: a bar that may lean over two axes.

use dynamics::analysis::{ContinuationError, SpecialKind, continuation};
use dynamics::prelude::*;

/// An upright bar on two hinges one over the other, with springs, under a dead load.
#[derive(Clone, Debug, Dynamics)]
#[coordinates(a: rad, b: rad)]
#[units(inertia: kg * m^2, k: N * m, length: m, load: N)]
struct Mast {
    inertia: f64,
    k: [f64; 2],
    length: f64,
    load: f64,
}
#[dynamics]
impl Mast {
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * self.inertia * (q.a.dt().powi(2) + q.b.dt().powi(2))
    }
    #[potential]
    fn springs(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * (self.k[0] * q.a.powi(2) + self.k[1] * q.b.powi(2))
            + self.load * self.length * q.a.cos() * q.b.cos()
    }
}

/// The same by its inclination alone, whichever way.
#[derive(Clone, Debug, Dynamics)]
#[coordinates(x, y)]
struct Round {
    p: f64,
}
#[dynamics]
impl Round {
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * vec2(q.x, q.y).dt().norm_squared()
    }
    #[potential]
    fn shape(&self, q: &Coordinates<Self>) -> Expr {
        let square = vec2(q.x, q.y).norm_squared();
        0.5 * (1.0 - self.p) * square + 0.25 * square.powi(2)
    }
}

#[test]
fn two_equal_axes_have_eight_ways_to_lean() {
    let family = |load: f64| Mast { inertia: 1.0, k: [1.0, 1.0], length: 1.0, load };
    let start = family(0.0).state().build().unwrap();
    let mast = continuation(family).from(&start, 0.0).until(0.0..=1.5);
    let trunk = mast.clone().run().unwrap();
    let [point] = &trunk.special[..] else { panic!("{trunk}") };
    assert!(
        point.kind == SpecialKind::MultipleBifurcation { count: 2 } && (point.parameter - 1.0).abs() < 1e-8,
        "{trunk}"
    );
    assert!(matches!(mast.switch(point), Err(ContinuationError::NoBranchPoint { .. })));
    let halves = mast.switch_all(point).unwrap();
    // Straight on and back; over each axis P = a/sin a; over both alike P = a/(sin a cos a).
    let (mut straight, mut one, mut both) = (0, 0, 0);
    for half in &halves {
        let last = half.points.last().unwrap();
        let (a, b, load) = (last.state.a(), last.state.b(), last.parameter);
        if a.abs().max(b.abs()) < 1e-9 {
            straight += 1;
        } else if (a.abs() - b.abs()).abs() < 1e-9 {
            both += 1;
            assert!((load - a / (a.sin() * a.cos())).abs() < 1e-9, "{half}");
        } else {
            one += 1;
            let most = if a.abs() > b.abs() { a } else { b };
            assert!(a.abs().min(b.abs()) < 1e-9 && (load - most / most.sin()).abs() < 1e-9, "{half}");
        }
    }
    assert_eq!((straight, one, both), (2, 4, 4), "{}", halves.len());
    // And the diagram has them all: the trunk, and each once.
    let diagram = mast.branches(20).unwrap();
    assert!(diagram.failures.is_empty() && diagram.branches.len() == 9, "{}", diagram.branches.len());
}

#[test]
fn nearly_equal_axes_have_two_points() {
    let family = |load: f64| Mast { inertia: 1.0, k: [1.0, 1.001], length: 1.0, load };
    let start = family(0.0).state().build().unwrap();
    let trunk = continuation(family).from(&start, 0.0).until(0.0..=1.5).run().unwrap();
    let loads: Vec<f64> = trunk.branch_points().map(|point| point.parameter).collect();
    assert!(
        loads.len() == 2 && (loads[0] - 1.0).abs() < 1e-11 && (loads[1] - 1.001).abs() < 1e-11,
        "{trunk}"
    );
}

#[test]
fn what_leans_every_way_is_told() {
    let family = |p: f64| Round { p };
    let start = family(0.0).state().build().unwrap();
    let round = continuation(family).from(&start, 0.0).until(0.0..=2.0);
    let trunk = round.clone().run().unwrap();
    let error = round.switch_all(&trunk.special[0]).unwrap_err();
    assert!(matches!(error, ContinuationError::ContinuumOfBranches { .. }), "{error}");
    let diagram = round.branches(10).unwrap();
    assert!(diagram.failures[0].1.contains("every direction"), "{:?}", diagram.failures);
}

/// Three equal stiffnesses that soften each other: x, y, z are 0 or of one size each, so that 26 halves leave
/// the straight one.
#[derive(Clone, Debug, Dynamics)]
#[coordinates(x: [_; 3])]
struct Cube {
    p: f64,
    mix: f64,
}
#[dynamics]
impl Cube {
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * vec3(q.x[0], q.x[1], q.x[2]).dt().norm_squared()
    }
    #[potential]
    fn springs(&self, q: &Coordinates<Self>) -> Expr {
        let [x, y, z] = [q.x[0].powi(2), q.x[1].powi(2), q.x[2].powi(2)];
        0.5 * (1.0 - self.p) * (x + y + z)
            + 0.25 * (x * x + y * y + z * z)
            + 0.5 * self.mix * (x * y + y * z + z * x)
    }
}

#[test]
fn none_of_many_halves_is_left_out() {
    for mix in [0.3, 2.0] {
        let family = |p: f64| Cube { p, mix };
        let start = family(0.0).state().build().unwrap();
        let cube = continuation(family).from(&start, 0.0).until(0.0..=1.5);
        let trunk = cube.clone().run().unwrap();
        assert_eq!(trunk.special[0].kind, SpecialKind::MultipleBifurcation { count: 3 });
        let halves = cube.switch_all(&trunk.special[0]).unwrap();
        let mut signs: Vec<[i32; 4]> = halves
            .iter()
            .map(|half| {
                let last = half.points.last().unwrap();
                let sign = |x: f64| if x.abs() < 1e-9 { 0 } else { x.signum() as i32 };
                let straight =
                    if (0..3).all(|i| last.state.x(i).abs() < 1e-9) { sign(last.parameter - 1.0) } else { 0 };
                [0, 1, 2, 3].map(|i| if i < 3 { sign(last.state.x(i)) } else { straight })
            })
            .collect();
        signs.sort_unstable();
        signs.dedup();
        assert_eq!((halves.len(), signs.len()), (28, 28), "{mix}: {signs:?}");
    }
}
