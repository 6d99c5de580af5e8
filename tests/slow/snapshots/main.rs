//! What the models of `snapshots/models.rs` compile to, as text: a change of the engine shows as a difference
//! of these files.
//!
//! `UPDATE_SNAPSHOTS=1 cargo test --workspace --test snapshots` writes them anew; read the difference before
//! it is committed. A snapshot only says that something changed, so every model also answers for its physics,
//! by routes that do not pass through the listing.

mod compare;
#[path = "../../models/double_pendulum.rs"]
mod double_pendulum;
mod models;
mod physics;

use compare::snapshot;
use dynamics::model::{PrintedInC as _, ProgramsInC};
use dynamics::prelude::*;
use dynamics::simulate::PivotBreakdown;
use models::*;
// The prelude has one, too.
use models::{Contact, RigidBody};
use physics::{balanced, held, near};

#[test]
fn pendulum() {
    snapshot("pendulum", Pendulum::LISTING);
    let model = Pendulum { m: 0.7, l: 1.3, g: 9.81, c: 0.2 };
    let s = model.state().theta(0.8).theta_rate(-1.1).build().unwrap();
    // m l² θ̈ = −m g l sin θ − c θ̇
    let expected = -9.81 / 1.3 * 0.8f64.sin() + 0.2 / (0.7 * 1.3 * 1.3) * 1.1;
    balanced(&model, &s, &[expected]);
}

#[test]
fn double_pendulum() {
    snapshot("double_pendulum", DoublePendulum::LISTING);
    let model = DoublePendulum { m1: 1.1, m2: 1.3, l1: 1.0, l2: 0.8, g: 9.81 };
    let s = model.state().theta1(2.0).theta2(-0.4).theta1_rate(0.3).theta2_rate(1.7).build().unwrap();
    // Force along the rods eliminated by hand, Δ = θ₁ − θ₂ (closed form of Goldstein's problem 1.22).
    let (sin, cos) = 2.4f64.sin_cos();
    let d = 2.4 - 1.3 * cos * cos;
    let (w1, w2) = (0.3f64.powi(2), 0.8 * 1.7f64.powi(2));
    let (g1, g2) = (9.81 * 2f64.sin(), 9.81 * (-0.4f64).sin());
    let a1 = (-1.3 * sin * (w1 * cos + w2) - 2.4 * g1 + 1.3 * cos * g2) / d;
    let a2 = (sin * (2.4 * w1 + 1.3 * w2 * cos) + 2.4 * (g1 * cos - g2)) / (0.8 * d);
    balanced(&model, &s, &[a1, a2]);
}

/// The text in C, as a template. `tests/slow/c/` compiles and runs the texts of all models.
#[test]
fn double_pendulum_in_c() {
    let ProgramsInC { header, support, programs, .. } = DoublePendulum::C;
    snapshot("double_pendulum_in_c", &[header, support, programs].concat());
}

#[test]
fn cart_pole() {
    snapshot("cart_pole", CartPole::LISTING);
    let model = CartPole { cart: 2.0, bob: 0.6, l: 0.9, g: 9.81 };
    let s = model.state().x(0.2).theta(0.7).x_rate(-0.5).theta_rate(1.4).push(3.0).build().unwrap();
    let (sin, cos) = 0.7f64.sin_cos();
    // (M + m sin²θ) ẍ = F + m sin θ (l θ̇² + g cos θ), l θ̈ = −ẍ cos θ − g sin θ
    let x = (3.0 + 0.6 * sin * (0.9 * 1.4 * 1.4 + 9.81 * cos)) / (2.0 + 0.6 * sin * sin);
    balanced(&model, &s, &[x, -(x * cos + 9.81 * sin) / 0.9]);
}

#[test]
fn spherical_pendulum() {
    snapshot("spherical_pendulum", SphericalPendulum::LISTING);
    let model = SphericalPendulum { m: 0.4, l: 1.2, g: 9.81 };
    let s = model.state().theta(0.9).phi(0.3).theta_rate(0.5).phi_rate(-1.6).build().unwrap();
    // θ̈ = φ̇² sin θ cos θ − (g/l) sin θ, φ̈ = −2 θ̇ φ̇ cot θ
    let (sin, cos) = 0.9f64.sin_cos();
    balanced(&model, &s, &[1.6 * 1.6 * sin * cos - 9.81 / 1.2 * sin, 2.0 * 0.5 * 1.6 * cos / sin]);
    assert!(SphericalPendulum::CONSERVED.len() >= 2, "energy and the momentum of φ");
}

#[test]
fn chain() {
    snapshot("chain", Chain::LISTING);
    let model = Chain { cart: 2.0, mass: [0.5, 0.4, 0.3, 0.2], length: [0.8, 0.7, 0.6, 0.5], g: 9.81 };
    let s =
        model.state().x(0.1).theta([0.3, -0.4, 1.1, 2.0]).theta_rate([0.5, -0.2, 0.9, -1.3]).build().unwrap();
    // D'Alembert at the accelerations found: nothing pushes sideways, and the moment of the links below joint
    // j about it vanishes.
    let a = model.accelerations(&s).unwrap();
    let q = Chain::coordinates_with(&s, &a, &[]);
    let pull: [Vec2<f64>; 4] = std::array::from_fn(|i| {
        let acceleration = model.place(&q, i).dt().dt().value();
        model.mass[i] * (acceleration + Vec2::new(0.0, 9.81))
    });
    near(2.0 * a[0] + pull.iter().map(|f| f.x).sum::<f64>(), 0.0, 20.0, "sideways force");
    for j in 0..4 {
        let (arm, below) =
            (model.link(&q, j).value(), pull[j..].iter().fold(Vec2::new(0.0, 0.0), |sum, f| sum + *f));
        near(arm.cross(below), 0.0, 20.0, "moment about a joint");
    }
    balanced(&model, &s, a.as_slice());
}

#[test]
fn bead_on_spline() {
    snapshot("bead_on_spline", Bead::LISTING);
    let knots: Vec<f64> = (-6..=6).map(f64::from).collect();
    let track =
        CubicSpline::natural(&knots, &knots.iter().map(|x| (0.7 * x).sin()).collect::<Vec<_>>()).unwrap();
    let model = Bead { m: 0.3, g: 9.81, track };
    let s = model.state().x(0.45).x_rate(1.2).build().unwrap();
    // (1 + y'²) ẍ = −y' (g + y'' ẋ²)
    let [_, first, second, _] = model.track.derivatives(0.45);
    balanced(&model, &s, &[-first * (9.81 + second * 1.44) / (1.0 + first * first)]);
}

#[test]
fn driven_pivot() {
    snapshot("driven_pivot", DrivenPivot::LISTING);
    let model = DrivenPivot { m: 0.2, l: 0.5, g: 9.81, amplitude: 0.03, omega: 40.0 };
    let s = model.state().theta(2.6).theta_rate(0.4).at_time(0.37).build().unwrap();
    // l θ̈ = −(g − a ω² cos ωt) sin θ
    let felt = 9.81 - 0.03 * 1600.0 * (40.0 * 0.37f64).cos();
    balanced(&model, &s, &[-felt / 0.5 * 2.6f64.sin()]);
}

#[test]
fn constant_mass_matrix() {
    snapshot("constant_mass_matrix", Masses::LISTING);
    let model = Masses { m: [1.0, 2.0, 0.5], k: 30.0, c: 0.4 };
    let s = model.state().x(0.1).gap(-0.2).y(0.3).x_rate(0.5).gap_rate(0.7).y_rate(-0.2).build().unwrap();
    // m₂ is x + gap: both masses feel the spring and damper of the gap, y only its own cubic spring.
    let force = 30.0 * 0.2 - 0.4 * 0.7;
    let x = -force / 1.0;
    balanced(&model, &s, &[x, force / 2.0 - x, -30.0 * 0.3f64.powi(3) / 0.5]);
}

#[test]
fn contact() {
    snapshot("contact", Contact::LISTING);
    let model = Contact { m: 0.5, k: 200.0, c: 1.0, gap: 0.1 };
    let acceleration = |x: f64, v: f64| {
        let s = model.state().x(x).x_rate(v).build().unwrap();
        let a = if x > 0.1 { -(200.0 * (x - 0.1) + 1.0 * v) / 0.5 } else { 0.0 };
        balanced(&model, &s, &[a]);
        a
    };
    assert!(acceleration(0.05, 2.0) == 0.0 && acceleration(0.3, 2.0) < 0.0);
}

#[test]
fn charged_particle() {
    snapshot("charged_particle", Particle::LISTING);
    let (b, e) = (Vec3::new(0.1, -0.4, 0.9), Vec3::new(0.3, 0.2, -0.1));
    let model = Particle { mass: 1.7, charge: 0.8, magnetic: b, electric: e };
    let s = model.state().x(0.3).y(-0.6).z(1.1).x_rate(0.9).y_rate(0.2).z_rate(-0.7).build().unwrap();
    // Lorentz: m r̈ = e (E + ṙ × B)
    let a = 0.8 / 1.7 * (e + Vec3::new(0.9, 0.2, -0.7).cross(b));
    balanced(&model, &s, &[a.x, a.y, a.z]);
}

#[test]
fn rigid_body() {
    snapshot("rigid_body", RigidBody::LISTING);
    let inertia = Mat3::from([[1.3, 0.1, -0.05], [0.1, 0.9, 0.2], [-0.05, 0.2, 0.7]]);
    let model = RigidBody { inertia };
    let s = model
        .state()
        .yaw(0.4)
        .tilt(1.1)
        .spin(-0.3)
        .yaw_rate(0.8)
        .tilt_rate(-0.5)
        .spin_rate(2.0)
        .build()
        .unwrap();
    let a = model.accelerations(&s).unwrap();
    // Euler: J ω̇ + ω × J ω = 0 in the frame of the body.
    let omega = model.omega(&RigidBody::coordinates_with(&s, &a, &[]));
    let moment = (inertia * omega.dt() + omega.cross(inertia * omega)).value();
    moment.to_array().iter().for_each(|x| near(*x, 0.0, 5.0, "moment"));
    balanced(&model, &s, a.as_slice());
}

#[test]
fn projectile() {
    snapshot("projectile", Ball::LISTING);
    let model = Ball { mass: 0.145, k: 8.8e-4, g: 9.81 };
    let s = model.state().x(1.0).y(2.0).x_rate(30.0).y_rate(-4.0).build().unwrap();
    let speed = 30f64.hypot(4.0);
    let drag = 8.8e-4 / 0.145 * speed;
    balanced(&model, &s, &[-drag * 30.0, -9.81 + drag * 4.0]);
    let (mut output, mut event) = ([0.0], [0.0]);
    model.outputs(&s, &mut output).unwrap();
    model.events(&s, &mut event).unwrap();
    near(output[0], speed, speed, "speed");
    assert_eq!(event, [2.0]);
}

#[test]
fn rotating_tube() {
    snapshot("rotating_tube", Tube::LISTING);
    let model = Tube { m: 0.2, hub: 1.5 };
    let s = model.state().r(0.7).phi(0.2).r_rate(0.1).phi_rate(2.5).build().unwrap();
    // r̈ = r φ̇², and (I + m r²) φ̇ stays: φ̈ = −2 m r ṙ φ̇ / (I + m r²)
    balanced(&model, &s, &[0.7 * 6.25, -2.0 * 0.2 * 0.7 * 0.1 * 2.5 / (1.5 + 0.2 * 0.49)]);
    let named: Vec<&str> = Tube::CONSERVED.iter().map(|c| c.name).collect();
    assert_eq!(named.len(), 2, "{named:?}");
    let mut values = [0.0; 2];
    model.conserved(&s, &mut values);
    assert!(
        values.iter().any(|v| (v - (1.5 + 0.2 * 0.49) * 2.5).abs() < 1e-14),
        "the angular momentum: {values:?}"
    );
}

#[test]
fn cartesian_pendulum() {
    snapshot("cartesian_pendulum", CartesianPendulum::LISTING);
    let model = CartesianPendulum { m: 0.7, l: 1.3, g: 9.81 };
    let ((sin, cos), rate) = (0.8f64.sin_cos(), -1.1);
    let s = model
        .state()
        .x(1.3 * sin)
        .y(-1.3 * cos)
        .x_rate(1.3 * cos * rate)
        .y_rate(1.3 * sin * rate)
        .build()
        .unwrap();
    // l θ̈ = −g sin θ; the rod pulls with m (g cos θ + l θ̇²), which is −λ l.
    let (turning, pull) = (-9.81 * sin, 0.7 * (9.81 * cos + 1.3 * rate * rate));
    let inward = 1.3 * rate * rate;
    held(&model, &s, &[cos * turning - sin * inward, sin * turning + cos * inward], &[-pull / 1.3]);
    let mut tension = [f64::NAN];
    model.outputs(&s, &mut tension).unwrap();
    near(tension[0], pull, pull, "tension");
}

#[test]
fn slider_crank() {
    snapshot("slider_crank", SliderCrank::LISTING);
    let model = SliderCrank { m: [1.0, 2.0, 3.0], r: 0.5, l: 1.5, g: 9.81 };
    let s = model.state().crank(0.9).crank_rate(2.0).slide_guess(1.8).assemble().unwrap();
    // One degree of freedom: everything as a function of the crank angle α; sin β = (r/l) sin α, β the angle
    // of the rod.
    let moments = |alpha: f64| {
        let beta = (0.5 / 1.5 * alpha.sin()).asin();
        let (rod, slide) =
            (0.5 * alpha.cos() / (1.5 * beta.cos()), -0.5 * (alpha.sin() + alpha.cos() * beta.tan()));
        // Velocity of the rod's middle per unit of the crank's.
        let (x, y) =
            (-0.5 * alpha.sin() - 0.75 * beta.sin() * rod, 0.5 * alpha.cos() - 0.75 * beta.cos() * rod);
        let inertia = 0.25 / 3.0 + 2.0 * (x * x + y * y + 2.25 * rod * rod / 12.0) + 3.0 * slide * slide;
        (inertia, rod, slide, 9.81 * (0.25 * alpha.cos() + 2.0 * y))
    };
    // I α̈ + ½ I′ α̇² = −V′ (Eksergian), derivatives by differences of sixth order.
    let d = |f: &dyn Fn(f64) -> f64| {
        let k = |k: f64| f(0.9 + k * 1e-2) - f(0.9 - k * 1e-2);
        (45.0 * k(1.0) - 9.0 * k(2.0) + k(3.0)) / 0.6
    };
    let (inertia, rod, slide, weight) = moments(0.9);
    let a = model.accelerations(&s).unwrap();
    let crank = (-weight - 0.5 * d(&|x| moments(x).0) * 4.0) / inertia;
    let expected =
        [crank, rod * crank + d(&|x| moments(x).1) * 4.0, slide * crank + d(&|x| moments(x).2) * 4.0];
    (0..3).for_each(|i| {
        assert!((a[i] - expected[i]).abs() < 1e-9 * (1.0 + expected[i].abs()), "{a} {expected:?}")
    });
    // The slider is moved by the closure alone: m ẍ = −λₓ. Moments about the crank's axle: the pin carries λ.
    let (lx, g) = (-3.0 * a[2], 9.81);
    let (sin, cos) = 0.9f64.sin_cos();
    let ly = (0.25 / 3.0 * a[0] + 0.25 * g * cos) / (0.5 * cos) + lx * sin / cos;
    let q = SliderCrank::coordinates_with(&s, &a, &[]);
    let middle = model.middle(&q).dt().dt().value();
    // The crank and the rod share the pin: what the rod needs there is counted with the closure's force.
    let pin = 2.0 * (middle + Vec2::new(0.0, g));
    let ly = ly + (pin.y * cos - pin.x * sin) / cos;
    held(&model, &s, a.as_slice(), &[lx, ly]);
}

#[test]
fn sleigh() {
    snapshot("sleigh", Sleigh::LISTING);
    let model = Sleigh { m: 2.0, inertia: 0.3, ahead: 0.4 };
    let (heading, v, w) = (0.6f64, 1.5, 0.8);
    let (sin, cos) = heading.sin_cos();
    let s = model.state().heading(heading).x_rate(v * cos).y_rate(v * sin).heading_rate(w).build().unwrap();
    // v̇ = a ω², (I + m a²) ω̇ = −m a v ω (Chaplygin 1911); the edge pushes sideways with m (v ω + a ω̇).
    let (faster, turning) = (0.4 * w * w, -2.0 * 0.4 * v * w / (0.3 + 2.0 * 0.16));
    let sideways = v * w;
    held(
        &model,
        &s,
        &[faster * cos - sideways * sin, faster * sin + sideways * cos, turning],
        &[2.0 * (v * w + 0.4 * turning)],
    );
}

/// Where generated code does not apply the summary says what no longer follows from what: across the way the
/// edge says nothing of what leads along it.
#[test]
fn the_pivot_of_a_sleigh_that_vanishes_is_named() {
    let model = Sleigh { m: 2.0, inertia: 0.3, ahead: 0.4 };
    let straight = |heading: f64| {
        let start =
            model.state().heading(heading).x_rate(heading.cos()).y_rate(heading.sin()).build().unwrap();
        model.simulate(start).until(1.0).run().unwrap().verify()
    };
    let (along, across) = (straight(0.0), straight(core::f64::consts::FRAC_PI_2));
    assert!(along.stabilization.general == 0 && along.pivot_breakdown.is_none(), "{along}");
    assert_eq!(across.stabilization.general, across.evaluations, "{across}");
    let wanted = PivotBreakdown { rows: vec!["edge"], coordinates: vec!["y"] };
    assert_eq!(
        (across.pivot_breakdown.as_ref(), across.stabilization.general_at),
        (Some(&wanted), Some(0.0))
    );
    let words = "a pivot of the generated code vanished: `y` from `edge`, first at t = 0; each takes several \
        times as long";
    assert!(across.to_string().contains(words), "{across}");
}

#[test]
fn block() {
    snapshot("block", Block::LISTING);
    let model = Block { m: 2.0, g: 9.81, slope: 0.4, friction: 0.3 };
    let (sin, cos) = 0.4f64.sin_cos();
    let stuck = model.state().build().unwrap();
    held(&model, &stuck, &[0.0, 0.0], &[2.0 * 9.81 * cos, -2.0 * 9.81 * sin]);
    let mut sliding = model.state().release("stick").build().unwrap();
    sliding.set_x_rate(0.7);
    held(&model, &sliding, &[9.81 * (sin - 0.3 * cos), 0.0], &[2.0 * 9.81 * cos, 0.0]);
}

#[test]
fn every_snapshot_belongs_to_a_test() {
    compare::no_leftovers(include_str!("main.rs"));
}

#[test]
fn the_same_model_under_another_name_has_the_same_listing() {
    assert_eq!(Pendulum::LISTING.replace("Pendulum", "X"), Twin::LISTING.replace("Twin", "X"));
    let a = Twin { m: 1.0, l: 1.0, g: 1.0, c: 0.0 };
    let s = a.state().theta(1.0).build().unwrap();
    assert_eq!(a.accelerations(&s).unwrap()[0], -1f64.sin());
}
