//! Angles that lock: starts and motions beside the singular value of a set say which angle and which set,
//! wherever the mass matrix suffers from it, and only there.

use dynamics::model::AngleSet;
use dynamics::prelude::*;
use dynamics::simulate::SimulationErrorKind;

/// A top on its tip, in Euler's angles, in a ring that turns along with the first of them.
#[derive(Clone, Debug, Dynamics)]
#[coordinates(phi: rad, theta: rad, psi: rad)]
#[units(m: kg, l: m, across: kg * m^2, along: kg * m^2, ring: kg * m^2, g: m / s^2)]
struct Top {
    m: f64,
    l: f64,
    across: f64,
    along: f64,
    ring: f64,
    g: f64,
}

#[dynamics]
impl Top {
    fn body(&self, q: &Coordinates<Self>) -> RigidBody {
        let frame = Frame::turned(Mat3::euler(EulerSequence::Zxz, [q.phi, q.theta, q.psi]));
        RigidBody::new(self.m, self.l * Vec3::Z, Mat3::diagonal(self.across, self.across, self.along), frame)
    }
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        self.body(q).kinetic_energy() + 0.5 * self.ring * q.phi.dt().powi(2)
    }
    #[potential]
    fn weight(&self, q: &Coordinates<Self>) -> Expr {
        self.body(q).potential_energy(-self.g * Vec3::Z)
    }
}

const FREE: Top = Top { m: 1.0, l: 0.1, across: 2e-3, along: 1e-3, ring: 0.0, g: 9.81 };

/// The same turned by hand, the other way round and with a constant in between.
#[derive(Clone, Debug, Dynamics)]
#[coordinates(yaw: rad, pitch: rad, roll: rad)]
#[units(inertia: kg * m^2, k: N * m)]
struct Plane {
    inertia: Vec3<f64>,
    k: f64,
}

#[dynamics]
impl Plane {
    fn rotation(&self, q: &Coordinates<Self>) -> Mat3 {
        let into_body = Mat3::rotation_x(-q.roll) * Mat3::rotation_y(-q.pitch) * Mat3::rotation_z(-q.yaw);
        into_body.transpose()
    }
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        let [a, b, c] = self.inertia.to_array();
        self.rotation(q).rotational_energy(Mat3::diagonal(a, b, c))
    }
    #[potential]
    fn springs(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * self.k * (q.pitch.powi(2) + q.roll.powi(2))
    }
}

#[test]
fn sets_are_known_however_they_are_written() {
    assert_eq!(Top::ANGLE_SETS, [AngleSet { angles: [0, 1, 2], axes: [3, 1, 3] }]);
    assert_eq!(Plane::ANGLE_SETS, [AngleSet { angles: [0, 1, 2], axes: [3, 2, 1] }]);
}

#[test]
fn a_start_in_gimbal_lock_is_named() {
    for (theta, wanted) in [(0.0, "of 0"), (std::f64::consts::PI, "of π")] {
        let start = FREE.state().theta(theta).phi_rate(1.0).psi_rate(20.0).build().unwrap();
        let error = FREE.simulate(start).until(1.0).run().unwrap_err();
        let SimulationErrorKind::GimbalLock { at, .. } = &error.kind else { panic!("{error}") };
        assert_eq!((at.set.to_string().as_str(), at.names), ("3-1-3", ["phi", "theta", "psi"]));
        assert!(at.distance < 1e-15);
        let text = error.to_string();
        assert!(
            text.contains("gimbal lock: `theta`") && text.contains(wanted) && text.contains("such as 1-2-3"),
            "{text}"
        );
    }
    let plane = Plane { inertia: Vec3::new(1.0, 2.0, 2.5), k: 0.1 };
    let start = plane.state().pitch(-std::f64::consts::FRAC_PI_2).yaw_rate(0.3).build().unwrap();
    let error = plane.simulate(start).until(1.0).run().unwrap_err().to_string();
    assert!(error.contains("`pitch`") && error.contains("of -π/2") && error.contains("3-2-1 set"), "{error}");
}

/// A pendulum falls through its lowest place, where its Euler angles lock: none comes back as if nothing
/// were.
#[test]
fn motions_through_gimbal_lock_are_told() {
    for (rate, tolerance) in [(0.0, 1e-9), (1e-6, 1e-6), (1e-6, 1e-9), (1e-3, 1e-9), (1e-3, 1e-12)] {
        // Down is at π; a swing with that little turning about the vertical passes it closely.
        let start = FREE.state().theta(2.5).phi_rate(rate).build().unwrap();
        match FREE.simulate(start).until(2.0).tolerance(tolerance).run() {
            Ok(motion) => {
                let summary = motion.verify();
                let Some(locking) = summary.gimbal_lock else { panic!("{rate} at {tolerance}: {summary}") };
                // The angular momentum about the vertical over that of the fall: the least distance.
                let inertia = FREE.across + FREE.m * FREE.l * FREE.l;
                let fall = (2.0 * FREE.m * FREE.g * FREE.l * (1.0 + 2.5f64.cos()) / inertia).sqrt();
                let wanted = rate * 2.5f64.sin().powi(2) / fall;
                println!("{rate} at {tolerance}: {:.2e}, wanted {wanted:.2e}", locking.distance);
                assert!(
                    (locking.distance - wanted).abs() < 0.5 * wanted + 1e-9,
                    "{rate} at {tolerance}: {summary}"
                );
                assert!(locking.doubtful || locking.distance > 1e-4, "{rate} at {tolerance}: {summary}");
                assert_eq!(
                    locking.doubtful,
                    summary.to_string().contains("warning      gimbal lock at"),
                    "{summary}"
                );
                assert!(
                    summary.to_string().contains("of π, the singular value of its 3-1-3 set"),
                    "{summary}"
                );
            }
            Err(error) => {
                println!("{rate} at {tolerance}: {error}");
                assert!(
                    matches!(error.kind, SimulationErrorKind::GimbalLock { .. }),
                    "{rate} at {tolerance}: {error}"
                );
            }
        }
    }
}

/// However slender a body is: its own axis has little inertia everywhere, and less and less of it tells.
#[test]
fn slender_bodies_lock_as_well() {
    let slender = Top { along: 1e-6, ..FREE };
    let start = slender.state().theta(2.5).phi_rate(1e-3).build().unwrap();
    match slender.simulate(start).until(2.0).tolerance(1e-9).run() {
        Ok(motion) => {
            let summary = motion.verify();
            let locking = summary.gimbal_lock.as_ref().unwrap_or_else(|| panic!("{summary}"));
            assert!(locking.distance < 1e-3 && locking.conditioning > 1e3, "{summary}");
            assert_eq!(locking.doubtful, f64::EPSILON * locking.conditioning > 1e-9, "{summary}");
        }
        Err(error) => assert!(matches!(error.kind, SimulationErrorKind::GimbalLock { .. }), "{error}"),
    }
}

#[test]
fn what_does_not_suffer_is_not_told_of() {
    // A ring with inertia of its own keeps the mass matrix regular, and the angles what they are.
    let ringed = Top { ring: 1e-3, ..FREE };
    let start = ringed.state().theta(2.5).phi_rate(1e-3).build().unwrap();
    let motion = ringed.simulate(start).until(2.0).tolerance(1e-9).run().unwrap();
    let summary = motion.verify();
    assert!(summary.gimbal_lock.is_none(), "{summary}");
    // In no way at any distance; nor is a mass that is missing elsewhere put down to it.
    for theta in [2e-3, 0.02, 0.04] {
        let still = Top { g: 0.0, ring: 0.5, ..FREE };
        let start = still.state().theta(theta).build().unwrap();
        let summary = still.simulate(start).until(0.1).run().unwrap().verify();
        assert!(summary.gimbal_lock.is_none(), "{summary}");
    }
    let none = Top { across: 0.0, along: 0.0, l: 0.0, ..FREE };
    let error = none.simulate(none.state().build().unwrap()).until(1.0).run().unwrap_err();
    assert!(!matches!(error.kind, SimulationErrorKind::GimbalLock { .. }), "{error}");
    // And far from where it locks no set is told of.
    let start = FREE.state().theta(1.5).phi_rate(3.0).psi_rate(150.0).build().unwrap();
    let summary = FREE.simulate(start).until(1.0).run().unwrap().verify();
    assert!(summary.gimbal_lock.is_none(), "{summary}");
}

/// A step from one side of the lock to the other sees nothing of it: the angles turn by half a turn within.
#[test]
fn fixed_steps_that_pass_over_gimbal_lock_are_told() {
    for (rate, h) in [(1e-2, 2e-2), (1e-3, 1e-2), (1e-3, 5e-2), (1e-3, 0.11), (1e-6, 1e-3)] {
        let start = FREE.state().theta(2.5).phi_rate(rate).build().unwrap();
        match FREE.simulate(start).until(1.1).fixed_step(h).run() {
            Ok(motion) => {
                let summary = motion.verify();
                let locking =
                    summary.gimbal_lock.as_ref().unwrap_or_else(|| panic!("{rate} by {h}: {summary}"));
                assert!(locking.doubtful && locking.passed_over, "{rate} by {h}: {summary}");
                let text = summary.to_string();
                assert!(
                    text.contains("warning      gimbal lock at t = ")
                        && text.contains("the fixed steps are too long"),
                    "{text}"
                );
            }
            // Nor is what is thrown out there a motion.
            Err(error) => {
                assert!(!error.state.theta().abs().is_nan() && error.state.theta().abs() > 10.0, "{error}")
            }
        }
    }
    // Short enough for a wide berth, they are as good as any.
    let start = FREE.state().theta(2.5).phi_rate(0.5).build().unwrap();
    let summary = FREE.simulate(start).until(1.1).fixed_step(1e-4).run().unwrap().verify();
    assert!(summary.gimbal_lock.is_none_or(|locking| !locking.doubtful), "{summary}");
}

/// A body about its centre, its energy written out in Euler parameters: ω = 2 G(p) ṗ.
#[derive(Clone, Debug, Dynamics)]
#[coordinates(p: [_; 4])]
struct Spinning {
    inertia: [f64; 3],
}

#[dynamics]
impl Spinning {
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        let [w, x, y, z] = q.p;
        let about_x = 2.0 * (w * x.dt() - x * w.dt() + z * y.dt() - y * z.dt());
        let about_y = 2.0 * (w * y.dt() - y * w.dt() + x * z.dt() - z * x.dt());
        let about_z = 2.0 * (w * z.dt() - z * w.dt() + y * x.dt() - x * y.dt());
        0.5 * (self.inertia[0] * about_x.powi(2)
            + self.inertia[1] * about_y.powi(2)
            + self.inertia[2] * about_z.powi(2))
    }
    #[holonomic]
    fn norm(&self, q: &Coordinates<Self>) -> Expr {
        let [w, x, y, z] = q.p;
        0.5 * (w * w + x * x + y * y + z * z - 1.0)
    }
}

/// M has rank 3 of 4, and the constraint holds the fourth direction: what is told is how well the two
/// together determine the accelerations, which is badly only where the body itself has next to no inertia
/// about an axis.
#[test]
fn conditioning_of_euler_parameters_is_that_of_what_the_constraint_leaves() {
    let conditioning = |inertia| {
        let body = Spinning { inertia };
        let start = body.state().p([0.8, 0.0, 0.6, 0.0]).p_rate([0.3, 0.5, -0.4, 0.2]).build().unwrap();
        let summary = body.simulate(start).until(1.0).run().unwrap().verify();
        assert!(summary.conditioning.largest >= 1.0, "{summary}");
        summary.conditioning.largest
    };
    assert!(conditioning([1.0, 2.0, 3.0]) < 30.0, "{}", conditioning([1.0, 2.0, 3.0]));
    assert!(conditioning([1.0, 1.0, 1e-9]) > 1e7, "{}", conditioning([1.0, 1.0, 1e-9]));
}
