//! Equilibria and modes against closed forms.

use dynamics_families::model::FamilyState;
use dynamics_families::{FamilyErrorKind, SimulateFamilies};

use crate::common::{Bar, GuitarString, Lattice, state};

const PI: f64 = core::f64::consts::PI;

/// All frequencies of 25 elements. Lumped: 2 (c/h) sin(θ/2). Consistent: √(6 (1 − cos θ)/(2 + cos θ)) c/h.
/// θ = kπ/N between walls, (2k − 1)π/2N with a free end.
#[test]
fn bars_have_the_frequencies_of_closed_forms() {
    for (between_walls, wanted) in [(true, 24), (false, 25), (false, 6), (true, 1)] {
        let theta = |k: usize| match between_walls {
            true => (k + 1) as f64 * PI / 25.0,
            false => (2 * k + 1) as f64 * PI / 50.0,
        };
        let lumped = Bar::<false> { elements: 25, length: 2.0, ea: 7.0, rho: 3.0, between_walls };
        let consistent = Bar::<true> { elements: 25, length: 2.0, ea: 7.0, rho: 3.0, between_walls };
        let ratio = lumped.c() / lumped.h();
        let modes = lumped.modes(&state(&lumped, |_| 0.0, |_| 0.0), wanted).expect("modes");
        assert_eq!(modes.len(), wanted);
        for (k, mode) in modes.iter().enumerate() {
            let exact = 2.0 * ratio * (0.5 * theta(k)).sin();
            assert!((mode.frequency() / exact - 1.0).abs() < 1e-12, "{k} {}", mode.frequency());
            let shape = |i: usize| ((i + 1) as f64 * theta(k)).sin();
            let factor = mode.shape[0] / shape(0);
            assert!(mode.shape.iter().enumerate().all(|(i, x)| (x - factor * shape(i)).abs() < 1e-9), "{k}");
        }
        let modes = consistent.modes(&state(&consistent, |_| 0.0, |_| 0.0), wanted).expect("modes");
        for (k, mode) in modes.iter().enumerate() {
            let cosine = theta(k).cos();
            let exact = ratio * (6.0 * (1.0 - cosine) / (2.0 + cosine)).sqrt();
            assert!((mode.frequency() / exact - 1.0).abs() < 1e-12, "{k} {}", mode.frequency());
        }
    }
}

/// Two of the digits that were made elsewhere.
#[test]
fn bars_have_the_frequencies_of_the_reference() {
    let lumped = Bar::<false> { elements: 25, length: 2.0, ea: 7.0, rho: 3.0, between_walls: true };
    let modes = lumped.modes(&state(&lumped, |_| 0.0, |_| 0.0), 24).expect("modes");
    assert!((modes[0].frequency() - 2.3978525722390125).abs() < 1e-12);
    assert!((modes[23].frequency() - 38.11277523843075).abs() < 1e-11);
    let consistent = Bar::<true> { between_walls: true, elements: 25, length: 2.0, ea: 7.0, rho: 3.0 };
    let modes = consistent.modes(&state(&consistent, |_| 0.0, |_| 0.0), 9).expect("modes");
    assert!((modes[0].frequency() - 2.4010100953968245).abs() < 1e-12);
    assert!((modes[8].frequency() - 22.755575004315876).abs() < 1e-11);
}

/// Along and across the same string: ω = 2 √(k/m) sin(θ/2), k from `ea` and from the tension, counted
/// together.
#[test]
fn a_taut_string_has_modes_along_and_across() {
    let string = GuitarString { ea: 4.0, ..GuitarString::uniform(300) };
    let modes = string.modes(&state(&string, |_| 0.0, |_| 0.0), 12).expect("modes");
    let mut exact: Vec<f64> = Vec::new();
    for k in 1..=12 {
        let sine = (k as f64 * PI / 602.0).sin();
        exact.extend([1.0f64, 4.0].map(|k| 2.0 * k.sqrt() / string.pitch * sine));
    }
    exact.sort_by(f64::total_cmp);
    for (mode, exact) in modes.iter().zip(&exact) {
        assert!((mode.frequency() / exact - 1.0).abs() < 1e-10, "{} {exact}", mode.frequency());
    }
}

/// Pulled across in its middle a string makes two straight lines, stable; without tension the straight line
/// is neutral.
#[test]
fn a_pulled_string_is_two_straight_lines() {
    let string = GuitarString::uniform(31);
    let mut guess = state(&string, |_| 0.0, |_| 0.0);
    guess.parts_mut().3[0] = 3.0;
    let found = string.equilibrium(&guess).expect("converges");
    assert_eq!(found.is_stable(), Some(true));
    let (half, w) = (0.5, &found.state.q()[31..]);
    let depth = w[15];
    for (i, w) in w.iter().enumerate() {
        let part = 1.0 - (i as f64 - 15.0).abs() / 16.0;
        assert!((w - part * depth).abs() < 1e-12, "{i}");
    }
    // 2 T sin = 3 with T = tension + ea (l/l₀ − 1).
    let length = depth.hypot(half);
    let tension = 1.0 + 50.0 * (length / half - 1.0);
    assert!((2.0 * tension * depth / length - 3.0).abs() < 1e-11);

    let slack = GuitarString { tension: 0.0, ..string.clone() };
    let error = slack.equilibrium(&guess).err();
    assert!(error.is_some_and(|error| matches!(error.kind, FamilyErrorKind::Singular { .. })));
    guess.parts_mut().3[0] = f64::NAN;
    let error = string.equilibrium(&guess).expect_err("no input");
    assert!(error.to_string().contains("`pluck` has no value"), "{error}");
}

/// A compressed chain of springs with −r²: the straight state is unstable where springs are softer than
/// nothing, and so are as many modes as are counted.
#[test]
fn unstable_displacements_are_counted() {
    let lattice = Lattice { masses: 9, alpha: 0.25 };
    let straight = lattice.equilibrium(&state(&lattice, |_| 0.0, |_| 0.0)).expect("at once");
    assert_eq!((straight.is_stable(), straight.iterations), (Some(true), 0));
    // One spring stretched by −4 has stiffness −1, and so one mode grows.
    let torn = state(&lattice, |i| if i < 4 { 2.0 } else { -2.0 }, |_| 0.0);
    let modes = lattice.modes(&torn, 3).expect("modes");
    assert!(modes[0].omega_squared < 0.0 && modes[0].frequency().is_nan());
    assert!(modes[1].omega_squared > 0.0);
}
