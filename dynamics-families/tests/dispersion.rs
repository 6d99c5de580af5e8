//! Frequencies and group velocities of waves against closed forms.

use dynamics_families::{FamilyErrorKind, SimulateFamilies};

use crate::common::{Bar, GuitarString, Lattice, Trolley, state};

/// Lumped: ω = 2 (c/h) sin(κ/2). Consistent: ω² = 6 (c/h)² (1 − cos κ)/(2 + cos κ). Their group velocities
/// are derivatives of these.
#[test]
fn bars_have_the_waves_of_their_closed_forms() {
    for elements in [4, 5, 25, 1000] {
        let lumped = Bar::<false> { elements, length: 2.0, ea: 7.0, rho: 3.0, between_walls: false };
        let consistent = Bar::<true> { elements, length: 2.0, ea: 7.0, rho: 3.0, between_walls: false };
        let speed = lumped.c() / lumped.h();
        for phase in [1e-9, 1e-3, 0.1, 1.0, -2.0, 3.0, core::f64::consts::PI] {
            let (c, s) = (f64::cos(phase), f64::sin(phase));
            let [own] = lumped.dispersion(&state(&lumped, |_| 0.0, |_| 0.0), [phase]).expect("waves")[..]
            else {
                panic!("one branch")
            };
            let half = 0.5 * phase;
            assert!((own.frequency - 2.0 * speed * half.sin().abs()).abs() < 1e-13 * own.frequency);
            let exact = speed * half.cos() * half.signum();
            assert!((own.group_velocity - exact).abs() < 1e-12 * speed, "{phase} {own:?} {exact}");
            let own =
                consistent.dispersion(&state(&consistent, |_| 0.0, |_| 0.0), [phase]).expect("waves")[0];
            let versine = 2.0 * half.sin().powi(2);
            let exact = speed * (6.0 * versine / (2.0 + c)).sqrt();
            assert!((own.frequency - exact).abs() < 1e-13 * exact, "{phase} {own:?} {exact}");
            // ω ω' = 9 (c/h)² sin κ/(2 + cos κ)².
            let slope = 9.0 * speed.powi(2) * s / (2.0 + c).powi(2) / exact;
            assert!((own.group_velocity - slope).abs() < 1e-12 * speed, "{phase} {own:?} {slope}");
        }
    }
}

/// For κ = 0 nothing moves, and the group velocity is the speed of sound.
#[test]
fn long_waves_have_the_speed_of_sound() {
    let bar = Bar::<true> { elements: 50, length: 2.0, ea: 7.0, rho: 3.0, between_walls: true };
    let own = bar.dispersion(&state(&bar, |_| 0.0, |_| 0.0), [0.0]).expect("waves");
    assert_eq!(own.len(), 1);
    assert_eq!(own[0].frequency, 0.0);
    assert!((own[0].group_velocity / (bar.c() / bar.h()) - 1.0).abs() < 1e-14);
    // A taut string has two: across by its tension, along by its stiffness.
    let string = GuitarString::uniform(40);
    let [across, along] = string.dispersion(&state(&string, |_| 0.0, |_| 0.0), [0.0]).expect("waves")[..]
    else {
        panic!("two branches")
    };
    assert!(across.frequency == 0.0 && along.frequency == 0.0);
    let exact = [string.tension, string.ea].map(|force| (force / (string.mass[0] * string.pitch)).sqrt());
    assert!((across.group_velocity / exact[0] - 1.0).abs() < 1e-12, "{across:?} {exact:?}");
    assert!((along.group_velocity / exact[1] - 1.0).abs() < 1e-12, "{along:?} {exact:?}");
}

/// The derivative of the frequency by differences, for a string that is stretched to one side: both branches
/// are coupled there.
#[test]
fn group_velocities_are_slopes_of_frequencies() {
    let string = GuitarString::uniform(60);
    let slanted = state(&string, |i| if i < 60 { 0.01 * i as f64 } else { 0.3 * (i - 59) as f64 }, |_| 0.0);
    let at = |phase: f64| string.dispersion(&slanted, [phase]).expect("waves");
    for phase in [0.3, 1.1, 2.5] {
        let (low, own, high) = (at(phase - 1e-4), at(phase), at(phase + 1e-4));
        for branch in 0..2 {
            let slope = (high[branch].frequency - low[branch].frequency) / 2e-4;
            assert!((own[branch].group_velocity / slope - 1.0).abs() < 1e-7, "{phase} {own:?} {slope}");
        }
    }
    // That of long waves is the limit of those of short phases.
    for (limit, near) in at(0.0).iter().zip(at(1e-4)) {
        assert!((limit.group_velocity / near.group_velocity - 1.0).abs() < 1e-6, "{limit:?} {near:?}");
    }
}

/// Ordinary coordinates are held: the rope of a trolley has the waves of a rope.
#[test]
fn coordinates_beside_are_held() {
    let trolley = Trolley { masses: 30, trolley: 2.0, k: 3.0 };
    let own = trolley.dispersion(&state(&trolley, |_| 0.0, |_| 0.0), [0.7]).expect("waves");
    let exact = 2.0 * 0.35f64.sin() * trolley.k.sqrt();
    assert!((own[0].frequency / exact - 1.0).abs() < 1e-12, "{own:?} {exact}");
}

#[test]
fn what_has_no_waves_says_why() {
    let lattice = Lattice { masses: 40, alpha: 1.0 };
    let rest = state(&lattice, |_| 0.0, |_| 0.0);
    let curved = state(&lattice, |i| 1e-3 * (i as f64).powi(2), |_| 0.0);
    let error = lattice.dispersion(&curved, [0.1]).expect_err("springs differ");
    assert!(
        matches!(&error.kind, FamilyErrorKind::NodesDiffer { coordinate } if coordinate.starts_with("x["))
    );
    // All springs shortened beyond their softest point push.
    let buckled = state(&lattice, |i| -0.8 * (i + 1) as f64, |_| 0.0);
    let error = lattice.dispersion(&buckled, [0.1]).expect_err("unstable");
    let square = 0.6 * 4.0 * 0.05f64.sin().powi(2);
    assert!(
        matches!(error.kind, FamilyErrorKind::WaveGrows { rate, .. } if (rate - square.sqrt()).abs() < 1e-12)
    );
    let error = lattice.dispersion(&rest, [0.1, 0.2]).expect_err("one index");
    assert_eq!(error.kind, FamilyErrorKind::PhaseCount { given: 2, needed: 1 });
    assert!(lattice.dispersion(&rest, [f64::NAN]).is_err());
    let short = Lattice { masses: 2, alpha: 0.0 };
    let error = short.dispersion(&state(&short, |_| 0.0, |_| 0.0), [0.1]).expect_err("no interior");
    assert_eq!(error.kind, FamilyErrorKind::NoInterior);
}
