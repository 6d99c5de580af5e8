//! Consistent starts: completed states against closed forms, branches chosen by guesses, and what cannot be
//! completed.

use crate::common;

use std::f64::consts::{PI, TAU};

use common::by_jets::{JetState, Jets, Mechanism, holonomic};
use dynamics_runtime::Expr;
use dynamics_runtime::constrain::{assemble, check_start};
use dynamics_runtime::error::StateError;
use dynamics_runtime::model::{Constraint, ConstraintKind, Constraints, ModelState};
use nalgebra::SVector;
use proptest::prelude::*;

/// A four-bar loop in the angles of crank, coupler and rocker; ground from (0, 0) to (ground, 0).
struct FourBar {
    ground: f64,
    crank: f64,
    coupler: f64,
    rocker: f64,
}

impl Mechanism<3, 2> for FourBar {
    const COORDINATES: [&'static str; 3] = ["crank", "coupler", "rocker"];
    const CONSTRAINTS: &'static [Constraint] = &[holonomic("loop", 0, 2)];
    const ROWS: [&'static str; 2] = ["loop.x", "loop.y"];
    fn rows(&self, q: &[Expr; 3], _: Expr) -> [Expr; 2] {
        [
            self.crank * q[0].cos() + self.coupler * q[1].cos() - self.rocker * q[2].cos() - self.ground,
            self.crank * q[0].sin() + self.coupler * q[1].sin() - self.rocker * q[2].sin(),
        ]
    }
    fn inertia(&self) -> [f64; 3] {
        [0.1, 0.3, 0.2]
    }
}

/// Freudenstein's equation for the rocker: R₁ cos φ − R₂ cos θ + R₃ = cos(φ − θ), solved by the half angle.
fn freudenstein(bar: &FourBar, crank: f64, branch: f64) -> Option<f64> {
    let FourBar { ground: g, crank: a, coupler: b, rocker: c } = *bar;
    // (a cos θ − g − c cos φ)² + (a sin θ − c sin φ)² = b².
    let (x, y) = (a * crank.cos() - g, a * crank.sin());
    let k = (x * x + y * y + c * c - b * b) / (2.0 * c);
    // x cos φ + y sin φ = k
    let r = x.hypot(y);
    (k.abs() <= r).then(|| y.atan2(x) + branch * (k / r).acos())
}

fn wrapped(angle: f64) -> f64 {
    angle.sin().atan2(angle.cos())
}

fn state<const N: usize>(q: [f64; N]) -> JetState<N> {
    common::at_rest_or_not(q, [0.0; N])
}

const GRASHOF: FourBar = FourBar { ground: 4.0, crank: 1.0, coupler: 3.5, rocker: 3.0 };

#[test]
fn the_guess_chooses_the_branch_of_a_four_bar() {
    let model = Jets(GRASHOF);
    for step in 0..24 {
        let crank = f64::from(step) * TAU / 24.0;
        for branch in [1.0, -1.0] {
            let rocker = freudenstein(&GRASHOF, crank, branch).unwrap();
            // The guess misses by 30°.
            let guess = state([crank, if branch > 0.0 { -0.5 } else { 0.5 }, rocker + 0.5]);
            let found = assemble(&model, guess, &[true, false, false], &[false; 3]).unwrap();
            assert!(wrapped(found.q[2] - rocker).abs() < 1e-13, "{crank} {branch}: {} {rocker}", found.q[2]);
            assert!(model.residual(&found).amax() < 4e-15);
            assert_eq!(found.q[0], crank);
            check_start(&model, &found).unwrap();
        }
    }
}

proptest! {
    #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::default() })]
    /// Whatever is given fulfils the constraints or is an error; what was given stays; velocities have least
    /// energy.
    #[test]
    fn what_is_assembled_fulfils_the_constraints(
        links in proptest::array::uniform4(0.5f64..3.0),
        guess in proptest::array::uniform3(-4.0f64..4.0),
        rate in -3.0f64..3.0,
        which in 0usize..3,
    ) {
        let [ground, crank, coupler, rocker] = links;
        let model = Jets(FourBar { ground, crank, coupler, rocker });
        let given: [bool; 3] = std::array::from_fn(|i| i == which);
        let mut start = state(guess);
        start.u[which] = rate;
        match assemble(&model, start, &given, &given) {
            Ok(found) => {
                prop_assert!(model.residual(&found).amax() < 1e-9);
                prop_assert!(model.velocity_residual(&found).amax() < 1e-9 * (1.0 + found.u.amax()));
                prop_assert_eq!((found.q[which], found.u[which]), (guess[which], rate));
            }
            // Out of reach: then no branch of the closed form exists, where the crank was given; or the start
            // is a dead end.
            Err(StateError::NotAssembled { distance, given: names, .. }) => {
                prop_assert!(distance > 0.0);
                prop_assert!(names.names().eq([FourBar::COORDINATES[which]]));
                if which == 0 {
                    let reach = freudenstein(&FourBar { ground, crank, coupler, rocker }, guess[0], 1.0);
                    prop_assert!(reach.is_none());
                }
            }
            Err(StateError::NotReached { coordinate, .. }) => {
                prop_assert!(FourBar::COORDINATES[which] != coordinate);
                if which == 0 {
                    let reach = freudenstein(&FourBar { ground, crank, coupler, rocker }, guess[0], 1.0);
                    prop_assert!(reach.is_some());
                }
            }
            Err(StateError::SingularGuess { .. } | StateError::VelocityNotAssembled { .. }) => {}
            Err(other) => prop_assert!(false, "{other}"),
        }
    }
}

#[test]
fn a_position_out_of_reach_says_by_how_much() {
    // Ground 5, crank 1 pointing away: the loop needs 6, coupler and rocker reach 5.5.
    let model = Jets(FourBar { ground: 5.0, crank: 1.0, coupler: 3.0, rocker: 2.5 });
    let guess = state([PI, 0.1, PI - 0.1]);
    let error = assemble(&model, guess, &[true, false, false], &[false; 3]).unwrap_err();
    let StateError::NotAssembled { row, residual, given, .. } = error else { panic!("{error}") };
    assert!(row == "loop.x" && given.names().eq(["crank"]));
    assert!((residual.abs() - 0.5).abs() < 1e-9, "{residual}");
    assert!(
        error
            .to_string()
            .contains("change what is given for `crank`, or the dimensions, or give another guess"),
        "{error}"
    );
}

/// Whatever the guess, what is missed is told at the closest approach of all: 0.5, as coupler and rocker
/// point to each other.
#[test]
fn the_miss_is_that_of_the_closest_approach() {
    let model = Jets(FourBar { ground: 5.0, crank: 1.0, coupler: 3.0, rocker: 2.5 });
    for k in 0..60 {
        let (coupler, rocker) = (0.37 * f64::from(k), 2.0 + 0.61 * f64::from(k * k));
        let guess = state([PI, coupler % TAU, rocker % TAU]);
        match assemble(&model, guess, &[true, false, false], &[false; 3]).unwrap_err() {
            StateError::NotAssembled { residual, .. } => {
                assert!(residual.abs() < 0.500_001, "{guess:?}: {residual}")
            }
            error => assert!(matches!(error, StateError::SingularGuess { .. }), "{error}"),
        }
    }
    let guess = state([PI, PI, 0.0]);
    let error = assemble(&model, guess, &[true, false, false], &[false; 3]).unwrap_err();
    assert!(!matches!(error, StateError::NotAssembled { residual, .. } if residual.abs() > 0.51), "{error}");
}

/// A point on a circle about the origin, Φ = x² + y² − l², or its square.
struct Circle {
    squared: bool,
}

impl Mechanism<2, 1> for Circle {
    const COORDINATES: [&'static str; 2] = ["x", "y"];
    const CONSTRAINTS: &'static [Constraint] = &[holonomic("rod", 0, 1)];
    const ROWS: [&'static str; 1] = ["rod"];
    fn rows(&self, q: &[Expr; 2], _: Expr) -> [Expr; 1] {
        let phi = q[0] * q[0] + q[1] * q[1] - 4.0;
        [if self.squared { phi * phi } else { phi }]
    }
    fn inertia(&self) -> [f64; 2] {
        [1.0, 4.0]
    }
}

#[test]
fn a_guess_where_branches_meet_is_an_error_that_names_the_coordinates() {
    let model = Jets(Circle { squared: false });
    let error = assemble(&model, state([0.0, 0.0]), &[false; 2], &[false; 2]).unwrap_err();
    let StateError::SingularGuess { row: "rod", coordinates, .. } = error else { panic!("{error}") };
    assert_eq!(coordinates.count(), 1);
    // One coordinate given: left and right are equally far.
    let error = assemble(&model, state([0.0, 1.0]), &[false, true], &[false; 2]).unwrap_err();
    let StateError::SingularGuess { coordinates, .. } = error else { panic!("{error}") };
    assert!(coordinates.names().eq(["x"]));
    for side in [1.0, -1.0] {
        let found = assemble(&model, state([1e-3 * side, 1.0]), &[false, true], &[false; 2]).unwrap();
        assert!((found.q[0] - side * 3f64.sqrt()).abs() < 1e-15);
    }
}

#[test]
fn nothing_moves_that_need_not() {
    let model = Jets(Circle { squared: false });
    // Heavy along y, so x does most of the way; the nearest point in the mass norm fulfils δx : 4 δy = x : y.
    let found = assemble(&model, state([1.6, 1.6]), &[false; 2], &[false; 2]).unwrap();
    let (dx, dy) = (found.q[0] - 1.6, found.q[1] - 1.6);
    assert!((dx / (4.0 * dy) - found.q[0] / found.q[1]).abs() < 0.3);
    assert!(dx.abs() > 2.0 * dy.abs());
    // What fulfils the constraints stays as it is, to the last bit.
    let exact = state([0.0, -2.0]);
    assert_eq!(assemble(&model, exact, &[false; 2], &[false; 2]).unwrap(), exact);
}

#[test]
fn all_given_and_wrong_is_the_same_error_with_the_same_distance() {
    let model = Jets(Circle { squared: false });
    let off = state([2.1, 0.0]);
    let error = assemble(&model, off, &[true; 2], &[false; 2]).unwrap_err();
    let StateError::NotAssembled { row: "rod", residual, given, .. } = error else { panic!("{error}") };
    assert!((residual - 0.41).abs() < 1e-14);
    assert!(given.names().eq(["x"]));
    let error = check_start(&model, &off).unwrap_err();
    let StateError::ConstraintViolated { row: "rod", distance, .. } = error else { panic!("{error}") };
    assert!((distance - 0.41 / 4.2).abs() < 1e-14);
}

#[test]
fn a_gradient_that_vanishes_on_the_constraint_is_an_error() {
    let model = Jets(Circle { squared: true });
    for (x, y) in [(2.0, 0.0), (2.0 + 1e-9, 0.0), (0.0, -2.0)] {
        let error = check_start(&model, &state([x, y])).unwrap_err();
        assert_eq!(error, StateError::VanishingGradient { row: "rod" }, "{error}");
    }
    let error = assemble(&model, state([1.5, 0.3]), &[false; 2], &[false; 2]).unwrap_err();
    assert_eq!(error, StateError::VanishingGradient { row: "rod" }, "{error}");
}

#[test]
fn what_is_not_a_number_is_an_error() {
    let model = Jets(Circle { squared: false });
    for bad in [f64::NAN, f64::INFINITY] {
        let error = assemble(&model, state([bad, 1.0]), &[true; 2], &[false; 2]).unwrap_err();
        assert!(matches!(error, StateError::NotFinite { name: "x", .. }), "{error}");
    }
    // Finite coordinates whose squares are not.
    let error = assemble(&model, state([1e200, 1.0]), &[false; 2], &[false; 2]).unwrap_err();
    assert_eq!(error, StateError::ConstraintNotFinite { row: "rod" });
    assert_eq!(check_start(&model, &state([1e200, 1.0])), Err(error));
}

/// A skate on a belt that moves with speed 1 along x, with a switched stop x = 0: nonholonomic, affine,
/// released where it does not hold.
struct Skate;

impl Mechanism<3, 2> for Skate {
    const COORDINATES: [&'static str; 3] = ["x", "y", "heading"];
    const CONSTRAINTS: &'static [Constraint] = &[
        Constraint { switched: Some(0), ..holonomic("stop", 0, 1) },
        Constraint { kind: ConstraintKind::Nonholonomic, ..holonomic("edge", 1, 1) },
    ];
    const ROWS: [&'static str; 2] = ["stop", "edge"];
    fn rows(&self, q: &[Expr; 3], _: Expr) -> [Expr; 2] {
        let (sin, cos) = q[2].sin_cos();
        [q[0], (q[0].dt() - 1.0) * sin - q[1].dt() * cos]
    }
    fn inertia(&self) -> [f64; 3] {
        [2.0, 2.0, 0.5]
    }
}

#[test]
fn velocities_have_least_energy_and_given_ones_stay() {
    let model = Jets(Skate);
    let mut start = state([0.7, 0.0, 0.5]);
    start.active_set_mut().release(0, 1.0);
    let found = assemble(&model, start, &[true; 3], &[false; 3]).unwrap();
    // Only the belt moves it: the part of the belt's velocity across the blade.
    let across = [0.5f64.sin() * 0.5f64.sin(), -0.5f64.sin() * 0.5f64.cos(), 0.0];
    (0..3).for_each(|i| assert!((found.u[i] - across[i]).abs() < 1e-15));
    // One rate given: the rest follows from edge alone, with no rotation.
    start.u[0] = 3.0;
    let found = assemble(&model, start, &[true; 3], &[true, false, false]).unwrap();
    assert!((found.u - SVector::from([3.0, 2.0 * 0.5f64.tan(), 0.0])).amax() < 1e-14);
    // Both given, and not fitting.
    start.u[1] = 0.0;
    let error = assemble(&model, start, &[true; 3], &[true, true, false]).unwrap_err();
    let StateError::VelocityNotAssembled { row: "edge", given, .. } = error else { panic!("{error}") };
    assert!(given.names().eq(["y", "x"]));
    let error = check_start(&model, &start).unwrap_err();
    assert!(matches!(error, StateError::VelocityViolated { row: "edge", .. }), "{error}");
    // The stop takes part where it holds.
    start.active_set_mut().engage(0);
    let error = check_start(&model, &start).unwrap_err();
    assert!(matches!(error, StateError::ConstraintViolated { row: "stop", residual: 0.7, .. }), "{error}");
    let found = assemble(&model, state([0.7, 0.0, 0.5]), &[false, true, true], &[false; 3]).unwrap();
    assert!(found.q[0] == 0.0 && found.u[0].abs() < 1e-16);
    assert!((found.u[1] + 0.5f64.tan()).abs() < 1e-15);
}

/// A rod with a sliding end: x = l cos φ with φ = t given by a drive, at its dead point at t = 0 seen from x.
struct Slider;

impl Mechanism<2, 2> for Slider {
    const COORDINATES: [&'static str; 2] = ["x", "phi"];
    const CONSTRAINTS: &'static [Constraint] = &[holonomic("rod", 0, 1), holonomic("drive", 1, 1)];
    const ROWS: [&'static str; 2] = ["rod", "drive"];
    fn rows(&self, q: &[Expr; 2], t: Expr) -> [Expr; 2] {
        [q[0] - q[1].cos(), q[0] - 1.0 + 0.5 * t]
    }
}

#[test]
fn a_drive_at_a_dead_point_has_no_velocity_and_that_is_an_error() {
    let model = Jets(Slider);
    // x is driven with −½ through x = 1, where dx/dφ = 0.
    let error = assemble(&model, state([1.0, 0.0]), &[true, true], &[false; 2]).unwrap_err();
    let StateError::VelocityNotAssembled { given, .. } = error else { panic!("{error}") };
    assert!(given.is_empty() && error.to_string().contains("singular"), "{error}");
    // Beside it there is one.
    let mut start = state([0.9, 0.4]);
    start.t = 0.2;
    let found = assemble(&model, start, &[false; 2], &[false; 2]).unwrap();
    assert!((found.q[1] - 0.9f64.acos()).abs() < 1e-14);
    assert!((found.u[1] - 0.5 / found.q[1].sin()).abs() < 1e-13);
}
