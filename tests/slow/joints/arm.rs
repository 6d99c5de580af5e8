//! Bodies that hang on one another: the arm of seven hinges at the cost of an expert's derivation, and trees
//! of bodies against the same energies written out, from which they are derived by other means.

use crate::arm7;

use arm7::{Arm, arm};
use dynamics::prelude::*;
use nalgebra::{Matrix3, Rotation3, Vector3};
use proptest::prelude::*;

/// Operations of a program of a listing, per evaluation.
fn operations(listing: &str, program: &str) -> u32 {
    let line =
        listing.lines().find_map(|line| line.strip_prefix(&format!("{program}: "))).expect("it is listed");
    line.split(' ').next().and_then(|count| count.parse().ok()).expect("a count comes first")
}

fn is_derived_from_bodies(report: &str) -> bool {
    report.contains("bodies that hang on one another")
}

/// Findings: 1511 operations by an expert's choice of composite inertias, 978 for inverse dynamics; 8606 from
/// velocities in the world.
#[test]
fn the_arm_costs_what_an_expert_pays() {
    assert!(is_derived_from_bodies(Arm::REPORT), "{}", Arm::REPORT);
    let [all, mass] = ["accelerations", "mass_matrix"].map(|program| operations(Arm::LISTING, program));
    assert!(all <= 1530 && mass <= 920, "{all} operations, {mass} of them for M");
    assert!(Arm::REPORT.contains("state_jacobian") && !Arm::REPORT.contains("Jacobians           none"));
}

/// Torques at the hinges by Newton and Euler in the world's axes, link by link: nothing of the library but
/// the numbers of the model.
fn torques(model: &Arm, q: [f64; 7], u: [f64; 7], a: [f64; 7]) -> [f64; 7] {
    let vector = |v: Vec3<f64>| Vector3::from(v);
    let inertia = Matrix3::from(model.inertia);
    let mut rotation = Rotation3::identity();
    let (mut origin, mut omega, mut alpha) = (Vector3::zeros(), Vector3::zeros(), Vector3::zeros());
    // Weight is an acceleration of the world upward.
    let mut acceleration = Vector3::new(0.0, 0.0, model.g);
    let (mut origins, mut axes, mut loads) = (Vec::new(), Vec::new(), Vec::new());
    for k in 0..7 {
        let arm: Vector3<f64> = rotation * vector(model.hinges[k]);
        acceleration += alpha.cross(&arm) + omega.cross(&omega.cross(&arm));
        origin += arm;
        let quarter = [0.0, 1.0, -1.0][if k == 0 { 0 } else { 2 - usize::from(k % 2 == 0) }]
            * core::f64::consts::FRAC_PI_2;
        rotation *= Rotation3::from_axis_angle(&Vector3::x_axis(), quarter);
        rotation *= Rotation3::from_axis_angle(&Vector3::z_axis(), q[k]);
        let axis = rotation * Vector3::z();
        alpha += axis * a[k] + omega.cross(&(axis * u[k]));
        omega += axis * u[k];
        let center = rotation * vector(model.centers[k]);
        let force =
            model.masses[k] * (acceleration + alpha.cross(&center) + omega.cross(&omega.cross(&center)));
        let turned = rotation.matrix() * inertia * rotation.matrix().transpose();
        let moment = turned * alpha + omega.cross(&(turned * omega));
        origins.push(origin);
        axes.push(axis);
        loads.push((origin + center, force, moment));
    }
    core::array::from_fn(|k| {
        let about = |(at, force, moment): &(Vector3<f64>, Vector3<f64>, Vector3<f64>)| {
            moment + (at - origins[k]).cross(force)
        };
        axes[k].dot(&loads[k..].iter().map(about).sum())
    })
}

proptest! {
    #[test]
    fn the_arm_obeys_newton_and_euler(
        q in proptest::array::uniform7(-3.0..3.0_f64),
        u in proptest::array::uniform7(-3.0..3.0_f64),
        motors in proptest::array::uniform7(-20.0..20.0_f64),
    ) {
        let model = arm();
        let state = model.state().angles(q).angles_rate(u).motors(motors).build().expect("finite");
        let found = model.accelerations(&state).expect("every joint has inertia");
        let needed = torques(&model, q, u, found.into());
        // What adds up to the torques: M q̈ and Q, entry by entry.
        let mass = model.mass_matrix(&state);
        for k in 0..7 {
            let scale: f64 = (0..7).map(|j| (mass[(k, j)] * found[j]).abs()).sum::<f64>() + 10.0;
            prop_assert!(
                (needed[k] - motors[k]).abs() < 1e-12 * scale,
                "{k}: {} for {}",
                needed[k], motors[k]
            );
        }
        // And asked for by itself, at any accelerations: what the motors have to give beside what they do.
        let wanted: [f64; 7] = core::array::from_fn(|k| motors[6 - k] - q[k]);
        let (asked, by_hand) =
            (model.inverse_dynamics(&state, &wanted.into()), torques(&model, q, u, wanted));
        for k in 0..7 {
            let scale: f64 = (0..7).map(|j| (mass[(k, j)] * wanted[j]).abs()).sum::<f64>() + 30.0;
            prop_assert!(
                (asked[k] - (by_hand[k] - motors[k])).abs() < 1e-12 * scale,
                "{k}: {} for {}",
                asked[k], by_hand[k]
            );
        }
    }
}

/// The same bodies twice: said as bodies, and with their energies written out, of which nobody knows that
/// they are those of bodies.
macro_rules! twice {
    ($module:ident, [$($coordinate:ident),*], |$s:ident, $q:ident| $frames:expr) => {
        mod $module {
            use super::*;

            /// Said as bodies.
            #[derive(Clone, Debug, Dynamics)]
            #[coordinates($($coordinate),*)]
            pub(super) struct Said {
                m: [f64; 4],
                centers: [Vec3<f64>; 4],
                inertias: [Mat3<f64>; 4],
                l: f64,
                tilt: f64,
                gravity: Vec3<f64>,
            }
            /// Written out.
            #[derive(Clone, Debug, Dynamics)]
            #[coordinates($($coordinate),*)]
            pub(super) struct Written {
                m: [f64; 4],
                centers: [Vec3<f64>; 4],
                inertias: [Mat3<f64>; 4],
                l: f64,
                tilt: f64,
                gravity: Vec3<f64>,
            }
            #[dynamics]
            impl Said {
                fn frames(&self, q: &Coordinates<Self>) -> [Frame; 4] {
                    let ($s, $q) = (self, q);
                    $frames
                }
                #[kinetic]
                fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
                    let (frames, mut sum) = (self.frames(q), Expr::ZERO);
                    for i in 0..4 {
                        sum +=
                            RigidBody::new(self.m[i], self.centers[i], self.inertias[i], frames[i])
                                .kinetic_energy();
                    }
                    // Something that is no body.
                    sum + 0.5 * self.m[0] * frames[3].origin().dt().norm_squared()
                }
                #[potential]
                fn weight(&self, q: &Coordinates<Self>) -> Expr {
                    let (frames, mut sum) = (self.frames(q), Expr::ZERO);
                    for i in 0..4 {
                        let body = RigidBody::new(self.m[i], self.centers[i], self.inertias[i], frames[i]);
                        sum += body.potential_energy(self.gravity);
                    }
                    sum + 3.0 * frames[2].origin().norm_squared()
                }
            }
            #[dynamics]
            impl Written {
                fn frames(&self, q: &Coordinates<Self>) -> [Frame; 4] {
                    let ($s, $q) = (self, q);
                    $frames
                }
                #[kinetic]
                fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
                    let (frames, mut sum) = (self.frames(q), Expr::ZERO);
                    for i in 0..4 {
                        let (center, omega) =
                            (frames[i].point(self.centers[i]), frames[i].angular_velocity_in_body());
                        sum += 0.5 * self.m[i] * center.dt().norm_squared()
                            + 0.5 * omega.dot(self.inertias[i] * omega);
                    }
                    sum + 0.5 * self.m[0] * frames[3].origin().dt().norm_squared()
                }
                #[potential]
                fn weight(&self, q: &Coordinates<Self>) -> Expr {
                    let (frames, mut sum) = (self.frames(q), Expr::ZERO);
                    for i in 0..4 {
                        sum -= self.m[i] * frames[i].point(self.centers[i]).dot(self.gravity);
                    }
                    sum + 3.0 * frames[2].origin().norm_squared()
                }
            }

            proptest! {
                #[test]
                fn both_move_alike(
                    q in proptest::array::uniform4(-1.3..1.3_f64),
                    u in proptest::array::uniform4(-2.0..2.0_f64),
                ) {
                    prop_assert!(
                        is_derived_from_bodies(Said::REPORT)
                        && !is_derived_from_bodies(Written::REPORT)
                    );
                    let (m, l, tilt, gravity) = ([1.0, 0.7, 1.9, 0.4], 0.8, 0.3, Vec3::new(1.0, -2.0, -9.0));
                    let centers = [1.0, 2.0, 3.0, 4.0].map(|i| Vec3::new(0.1 * i, 0.2 - 0.05 * i, 0.3));
                    let inertias = [1.0, 2.0, 3.0, 4.0].map(|i| {
                        Mat3::from([
                            [0.9 + 0.1 * i, 0.1, -0.05],
                            [0.1, 0.9, 0.02 * i],
                            [-0.05, 0.02 * i, 0.7]
                        ])
                    });
                    let said = Said { m, centers, inertias, l, tilt, gravity };
                    let written = Written { m, centers, inertias, l, tilt, gravity };
                    let (mut one, mut other) =
                        (said.state().build().expect("finite"), written.state().build().expect("finite"));
                    (one.q, one.u) = (q.into(), u.into());
                    (other.q, other.u) = (q.into(), u.into());
                    let a = said.accelerations(&one).expect("regular");
                    let b = written.accelerations(&other).expect("regular");
                    prop_assert!((a - b).norm() < 1e-11 * (1.0 + b.norm()), "{a} and {b}");
                    let (a, b) = (said.momenta(&one), written.momenta(&other));
                    prop_assert!((a - b).norm() < 1e-12 * (1.0 + b.norm()), "{a} and {b}");
                    let (a, b) = (said.generalized_force(&one), written.generalized_force(&other));
                    prop_assert!((a - b).norm() < 1e-12 * (10.0 + b.norm()), "{a} and {b}");
                    let (a, b) = (said.kinetic_energy(&one), written.kinetic_energy(&other));
                    prop_assert!((a - b).abs() < 1e-12 * (1.0 + b.abs()), "{a} and {b}");
                }
            }
        }
    };
}

// A chain of hinges, one of them askew; the first angle turns the last link, too.
twice!(geared, [a, b, c, d], |s, q| {
    let first = Frame::turned(Mat3::rotation_z(q.a));
    let second = first.frame(s.l * Vec3::X, Mat3::rotation_x(s.tilt) * Mat3::rotation_z(q.b));
    let third = second.frame(vec3(0.0, s.l, 0.2), Mat3::axis_angle(Vec3::new(0.0, 0.6, 0.8), q.c));
    let fourth = third.frame(s.l * Vec3::Z, Mat3::rotation_y(q.d + 0.5 * q.a));
    [first, second, third, fourth]
});

// A crane: a trolley, a mast that turns, a boom that tilts and grows, and a branch with a screw.
twice!(crane, [x, turn, dip, reach], |s, q| {
    let trolley = Frame::at(vec3(q.x, 0.0, s.l));
    let mast = trolley.frame(Vec3::ZERO, Mat3::rotation_z(q.turn));
    let boom = mast
        .frame(vec3(0.0, 0.1, s.l), Mat3::rotation_y(q.dip))
        .frame(vec3(q.reach, 0.0, 0.2 * q.reach * q.reach), Mat3::IDENTITY);
    let nut = mast.frame(vec3(0.1, 0.0, 0.3 * q.x), Mat3::rotation_z(2.0 * q.x) * Mat3::rotation_x(s.tilt));
    [trolley, mast, boom, nut]
});

// Two arms on one base, and two angles in one hinge.
twice!(branches, [a, b, c, d], |s, q| {
    let base = Frame::new(vec3(0.3, 0.0, 0.0), Mat3::rotation_y(q.a) * Mat3::rotation_x(q.b));
    let left = base.frame(vec3(0.0, s.l, 0.0), Mat3::rotation_z(q.c));
    let right = base.frame(vec3(0.0, -s.l, 0.1), Mat3::rotation_x(s.tilt) * Mat3::rotation_y(q.d));
    let hand = left.frame(vec3(0.0, 0.0, s.l), Mat3::rotation_y(0.3) * Mat3::rotation_x(q.d - q.c));
    [base, left, right, hand]
});

// A cam that lifts by the sine of an angle that turns nothing, a stroke by an exponential, and hinges that
// turn by products.
twice!(cam, [a, b, c, d], |s, q| {
    let lifted = Frame::new(vec3(0.0, s.l * q.a.sin(), 0.3 * q.d.exp()), Mat3::rotation_z(q.b * q.c));
    let first = lifted.frame(vec3(s.l, 0.0, 0.0), Mat3::rotation_x(q.c.powi(2) + q.b));
    let second = first.frame(vec3(0.0, q.d, s.l), Mat3::rotation_y(s.tilt) * Mat3::rotation_z(q.d));
    [lifted, first, second, second.frame(s.l * Vec3::X, Mat3::rotation_y(q.a + 0.2 * q.b))]
});

/// The left wing is the right one, mirrored: its frame is left-handed, and so is one that a parameter makes.
#[derive(Clone, Debug, Dynamics)]
#[coordinates(body, flap, twist)]
struct Wings {
    m: f64,
    center: Vec3<f64>,
    inertia: Mat3<f64>,
    mirror: Mat3<f64>,
}

#[dynamics]
impl Wings {
    fn wing(&self, q: &Coordinates<Self>, root: Frame) -> RigidBody {
        let flapping = root.frame(vec3(0.2, 0.5, 0.1), Mat3::rotation_x(q.flap));
        RigidBody::new(
            self.m,
            self.center,
            self.inertia,
            flapping.frame(0.3 * Vec3::Y, Mat3::rotation_y(q.twist)),
        )
    }
    fn left(&self, q: &Coordinates<Self>, mirror: Mat3) -> RigidBody {
        let body = Frame::turned(Mat3::rotation_z(q.body));
        self.wing(q, body.frame(0.1 * Vec3::X, mirror))
    }
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        let said = self.left(q, Mat3::diagonal(Expr::ONE, -Expr::ONE, Expr::ONE)).kinetic_energy();
        said + self.left(q, self.mirror.into()).kinetic_energy()
    }
    #[output]
    fn spins(&self, q: &Coordinates<Self>) -> [Vec3; 2] {
        let frame = self.left(q, self.mirror.into()).frame;
        [frame.angular_velocity(), frame.angular_velocity_in_body()]
    }
    #[output]
    fn angular_momentum(&self, q: &Coordinates<Self>) -> Vec3 {
        let said =
            self.left(q, Mat3::diagonal(Expr::ONE, -Expr::ONE, Expr::ONE)).angular_momentum(Vec3::ZERO);
        said + self.left(q, self.mirror.into()).angular_momentum(Vec3::ZERO)
    }
}

proptest! {
    /// The jets know nothing of turns: they differentiate the matrices.
    #[test]
    fn mirrored_frames_turn_the_other_way(
        q in proptest::array::uniform3(-1.3..1.3_f64),
        u in proptest::array::uniform3(-2.0..2.0_f64),
    ) {
        let inertia = Mat3::from([[0.5, 0.1, -0.05], [0.1, 0.7, 0.02], [-0.05, 0.02, 0.9]]);
        let mirror = Mat3::from([[0.0, 0.0, 1.0], [0.0, 1.0, 0.0], [1.0, 0.0, 0.0]]);
        let wings = Wings { m: 0.7, center: Vec3::new(0.1, 0.4, -0.1), inertia, mirror };
        let mut state = wings.state().build().expect("finite");
        (state.q, state.u) = (q.into(), u.into());
        let accelerations = wings.accelerations(&state).expect("regular");
        let jets = Wings::coordinates_with(&state, &accelerations, &[]);
        let (compiled, seen) = (wings.kinetic_energy(&state), wings.kinetic(&jets).value());
        prop_assert!((compiled - seen).abs() < 1e-13 * (1.0 + seen), "{compiled} and {seen}");
        let mut compiled = [f64::NAN; 9];
        wings.outputs(&state, &mut compiled).expect("regular");
        let momentum = wings.angular_momentum(&jets);
        let seen = wings.spins(&jets).into_iter().chain([momentum]).flat_map(|v| v.value().to_array());
        let seen: Vec<f64> = seen.collect();
        // All turns about z with the body, and no force does: L_z is the momentum of its angle, which comes
        // from T alone, and stays.
        let of_angle = (wings.mass_matrix(&state) * state.u)[0];
        prop_assert!(
            (momentum.z.value() - of_angle).abs() < 1e-13 * 10.0,
            "{} and {of_angle}",
            momentum.z.value()
        );
        prop_assert!(momentum.z.rate().abs() < 1e-12 * 10.0, "{} is left", momentum.z.rate());
        // R Rᵀω is ω, whatever R mirrors.
        let back =
            wings.left(&jets, mirror.into()).frame.vector(Vec3::new(compiled[3], compiled[4], compiled[5]));
        prop_assert!((back.value() - Vec3::new(compiled[0], compiled[1], compiled[2])).norm() < 1e-13);
        for (compiled, seen) in compiled.iter().zip(&seen) {
            prop_assert!((compiled - seen).abs() < 1e-13, "{compiled} and {seen}");
        }
    }
}
