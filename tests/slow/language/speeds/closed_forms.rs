//! Equations in speeds as the books have them: the rates of the speeds at solved accelerations.

use dynamics::model::Constraints;
use dynamics::prelude::*;

use super::models::*;

/// The model's functions where it moves: jets at solved accelerations.
fn moving<M: Constraints>(model: &M, state: &M::State) -> Coordinates<M> {
    M::coordinates_with(state, &model.accelerations(state).expect("regular"), &[])
}

#[test]
fn a_body_in_its_principal_axes_obeys_euler() {
    // A ω̇₁ = (B − C) ω₂ ω₃ and so on, without weight.
    let (a, b, c) = (1.1, 2.3, 2.9);
    let top = Top { a, b, c, weight: 0.0, height: 1.0 };
    let omega = [0.7, -1.9, 2.2];
    let state = top.state().phi(0.4).theta(0.9).psi(-1.3).omega(omega).build().expect("regular");
    let rates = top.omega(&moving(&top, &state)).dt().value();
    let [x, y, z] = omega;
    let euler = [(b - c) / a * y * z, (c - a) / b * z * x, (a - b) / c * x * y];
    for (found, expected) in [rates.x, rates.y, rates.z].into_iter().zip(euler) {
        assert!((found - expected).abs() < 1e-13, "{rates:?}, not {euler:?}");
    }
    assert!(Top::REPORT.contains("the speeds, with inertia 3 x 3, diagonal, constant"), "{}", Top::REPORT);
    assert!(
        Top::LISTING.contains("a - c") && Top::LISTING.contains("c - b"),
        "Euler's terms: {}",
        Top::LISTING
    );
}

#[test]
fn so_does_one_in_euler_parameters_with_any_axes() {
    // J ω̇ = −ω × J ω, J the symmetric part.
    let inertia = Mat3::from([[2.0, 0.3, -0.1], [0.3, 3.0, 0.4], [-0.1, 0.4, 2.5]]);
    let satellite = Satellite { inertia };
    let e = [0.5, -0.5, 0.1, 0.7];
    let state = satellite.state().e(e).omega([0.7, -1.9, 2.2]).build().expect("regular");
    let q = moving(&satellite, &state);
    let (omega, rates) = (satellite.omega(&q).value(), satellite.omega(&q).dt().value());
    let left = inertia * rates + omega.cross(inertia * omega);
    assert!(left.norm() < 1e-13, "{left:?}");
}

#[test]
fn the_sleigh_forgets_where_it_is() {
    // v̇ = a ω², (I + m a²) ω̇ = −m a v ω (Bloch, Nonholonomic Mechanics and Control, 1.7).
    let (mass, inertia, a) = (1.3, 0.4, 0.25);
    let sleigh = Sleigh { mass, inertia, a };
    for (phi, v, spin) in [(0.0, 1.0, 2.0), (2.1, -0.7, 1.4), (-3.0, 0.2, -3.0)] {
        let state = sleigh.state().x(3.0).phi(phi).v(v).spin(spin).build().expect("regular");
        let q = moving(&sleigh, &state);
        assert!((sleigh.v(&q).dt().value() - a * spin * spin).abs() < 1e-13);
        let expected = -mass * a * v * spin / (inertia + mass * a * a);
        assert!((sleigh.spin(&q).dt().value() - expected).abs() < 1e-13);
    }
}

#[test]
fn a_rolling_disk_in_the_axes_of_heading_and_lean() {
    // Momentum about the center with the force at the contact put in by ṙ = −ω × (contact − r), in axes that
    // turn with Ω = (ω₁, ω₃ tan θ, ω₃): A = ¼ m r² across, C = ½ m r² about the axle, (A + m r²) ω̇₁ = m g r
    // sin θ + (C + m r²) ω₂ω₃ − A ω₃² tan θ, (C + m r²) ω̇₂ = −m r² ω₁ω₃, A ω̇₃ = A ω₁ω₃ tan θ − C ω₁ω₂.
    let disk = Disk { m: 1.2, r: 0.6, g: 9.81 };
    let (lean, omega) = (0.35_f64, [0.8, -2.5, 1.7]);
    let state = disk.state().yaw(0.9).lean(lean).spin(0.2).omega(omega).build().expect("regular");
    let rates = disk.omega(&moving(&disk, &state)).dt().value();
    let (across, about) = (0.25 * 1.2 * 0.36, 0.5 * 1.2 * 0.36);
    let (mr2, [w1, w2, w3]) = (1.2 * 0.36, omega);
    let turning = w3 * lean.tan();
    let first =
        (1.2 * 9.81 * 0.6 * lean.sin() + (about + mr2) * w3 * w2 - across * w3 * turning) / (across + mr2);
    let second = -mr2 * w1 * w3 / (about + mr2);
    let third = (across * w1 * turning - about * w1 * w2) / across;
    for (found, expected) in [(rates.x, first), (rates.y, second), (rates.z, third)] {
        assert!((found - expected).abs() < 1e-12, "{rates:?}, not {first}, {second}, {third}");
    }
}

#[test]
fn what_an_observer_on_a_turntable_sees() {
    // v̇ = F/m − 2 Ω × v − Ω × (Ω × ρ) in the table's axes.
    let (m, turning, k) = (1.5, 0.7, 2.0);
    let table = Turntable { m, turning, k };
    let (t, x, y, seen) = (2.3, 0.8, -0.4, [0.5, 1.1]);
    let state = table.state().at_time(t).x(x).y(y).seen(seen).build().expect("regular");
    let rates = table.seen(&moving(&table, &state)).dt().value();
    let (sin, cos) = (turning * t).sin_cos();
    let [rx, ry] = [cos * x + sin * y, -sin * x + cos * y];
    let expected = [
        (turning * turning - k / m) * rx + 2.0 * turning * seen[1],
        (turning * turning - k / m) * ry - 2.0 * turning * seen[0],
    ];
    assert!(
        (rates.x - expected[0]).abs() < 1e-13 && (rates.y - expected[1]).abs() < 1e-13,
        "{rates:?}, {expected:?}"
    );
}

#[test]
fn speeds_are_taken_where_they_are_shorter() {
    let cases = [
        (Top::OPERATIONS, TopInAngles::OPERATIONS, true),
        (Aircraft::OPERATIONS, AircraftInAngles::OPERATIONS, true),
        (Satellite::OPERATIONS, SatelliteInParameters::OPERATIONS, true),
        (Disk::OPERATIONS, DiskInAngles::OPERATIONS, false),
    ];
    for (i, (with, without, shorter)) in cases.into_iter().enumerate() {
        let (with, without) = (with.expect("a program"), without.expect("a program"));
        assert!(if shorter { with < without } else { with == without }, "case {i}: {with} beside {without}");
    }
    // A few operations more, and no division by what moves.
    assert!(matches!(
        Sleigh::SOLVER,
        dynamics::model::SolverKind::Unrolled { elimination: "the declared speeds lead" }
    ));
    assert!(
        Disk::REPORT.contains("coordinates, which takes no more work than the speeds"),
        "{}",
        Disk::REPORT
    );
    assert!(matches!(
        Satellite::SOLVER,
        dynamics::model::SolverKind::Unrolled { elimination: "the declared speeds lead" }
    ));
}
