//! Frames, bodies and joints in derived models: every word compiled against the same functions on jets, and
//! what each joint leaves of a fall.
#![allow(missing_docs, unreachable_pub, reason = "models as users write them")]

use dynamics::prelude::*;
use dynamics::{Cylindrical, Polar, Spherical};
use proptest::prelude::*;

/// One body that moves freely, described by whatever the library offers.
#[derive(Clone, Debug, Dynamics)]
#[coordinates(x: m, y: m, z: m, a: rad, b: rad, c: rad)]
#[units(m: kg, center: m, inertia: kg * m^2, size: m, gravity: m / s^2)]
pub struct Words {
    /// Mass.
    pub m: f64,
    /// Center of mass in the frame.
    pub center: Vec3<f64>,
    /// Inertia about it.
    pub inertia: Mat3<f64>,
    /// Lengths.
    pub size: [f64; 3],
    /// Gravity.
    pub gravity: f64,
}

#[dynamics]
impl Words {
    fn frame(&self, q: &Coordinates<Self>) -> Frame {
        Frame::new(vec3(q.x, q.y, q.z), Mat3::euler(EulerSequence::Zyx, [q.a, q.b, q.c]))
    }
    fn body(&self, q: &Coordinates<Self>) -> RigidBody {
        RigidBody::new(self.m, self.center, self.inertia, self.frame(q))
    }
    fn flat(&self, q: &Coordinates<Self>) -> PlanarFrame {
        PlanarFrame::new(vec2(q.x, q.y), q.a)
    }
    fn plate(&self, q: &Coordinates<Self>) -> PlanarBody {
        let frame = self.flat(q).frame(Vec2::X * self.size[0], q.b);
        PlanarBody {
            mass: self.m.into(),
            center: vec2(q.z, self.size[1]),
            inertia: self.inertia[(2, 2)].into(),
            frame,
        }
    }
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        self.body(q).kinetic_energy()
    }
    #[potential]
    fn potential(&self, q: &Coordinates<Self>) -> Expr {
        self.body(q).potential_energy(vec3(0.0, 0.0, -self.gravity))
    }
    #[force]
    fn pushed(&self, q: &Coordinates<Self>) -> Force {
        let moment = self.m * self.gravity * self.size[0];
        self.body(q).moment(moment * vec3(0.3, 1.0, -0.2)) + self.plate(q).moment(0.1 * moment)
    }

    #[output]
    fn frames(&self, q: &Coordinates<Self>) -> [Vec3; 5] {
        let frame = self.frame(q);
        let next = frame.frame(self.center, Mat3::rotation_x(q.a));
        let point = next.point(vec3(q.y, q.x, self.size[2])) + frame.vector(self.center) + next.origin();
        let seen = next.coordinates_of(point) + frame.components_of(point - self.center);
        let axes = next.x().cross(next.y()) - 0.5 * next.z() + next.rotation().row(1);
        [
            point,
            seen,
            self.size[1] * axes,
            Frame::at(self.center).point(point),
            Frame::turned(next.rotation()).vector(point),
        ]
    }
    #[output]
    fn rates(&self, q: &Coordinates<Self>) -> [Vec3; 3] {
        let (frame, point) = (self.frame(q), vec3(q.z, q.x, q.y));
        let turning = frame.angular_velocity().cross(point) + frame.angular_velocity_in_body().cross(point);
        let from_the_world = Frame::world().velocity_in(point);
        [
            frame.velocity_in(point) + from_the_world,
            turning - frame.carried_velocity(point),
            frame.velocity_in(self.center),
        ]
    }
    #[output]
    fn accelerations_seen(&self, q: &Coordinates<Self>) -> [Vec3; 2] {
        let flat = self.flat(q).acceleration_in(vec2(q.z, self.size[0]));
        [self.frame(q).acceleration_in(vec3(q.x, q.z, self.size[2])), vec3(flat.x, flat.y, 0.0)]
    }
    #[output]
    fn momenta(&self, q: &Coordinates<Self>) -> [Vec3; 2] {
        let body = self.body(q);
        let other = vec3(q.y, q.x, self.size[0]);
        let omega = body.angular_velocity();
        [
            body.momentum() + self.m * omega.cross(body.center_of_mass()),
            body.angular_momentum(other) / self.size[0],
        ]
    }
    #[output]
    fn plane(&self, q: &Coordinates<Self>) -> [Vec2; 5] {
        let (frame, point) = (self.flat(q), vec2(q.z, q.y));
        let axes = self.size[0] * (frame.x() - 2.0 * frame.y());
        let there = frame.vector(point) + frame.components_of(point) + frame.origin();
        let world = PlanarFrame::world().coordinates_of(point);
        let rate = frame.velocity_in(point) - frame.carried_velocity(point);
        let turning = vec2(frame.angle().sin() * frame.angular_velocity(), frame.angular_velocity());
        [axes, there + world, rate, self.size[0] * turning, frame.point(point) - frame.coordinates_of(point)]
    }
    #[output]
    fn planar_body(&self, q: &Coordinates<Self>) -> [Expr; 4] {
        let plate = self.plate(q);
        let PlanarBody { mass, center, .. } = plate;
        let momentum = plate.momentum() - mass * center.dt();
        let kinetic = plate.kinetic_energy();
        [
            kinetic,
            plate.potential_energy(vec2(0.0, -self.gravity)),
            plate.angular_momentum(vec2(q.x, q.z)),
            momentum.x + momentum.y,
        ]
    }
    #[output]
    fn curvilinear(&self, q: &Coordinates<Self>) -> [Vec3; 5] {
        let (round, ball) = (Cylindrical::new(q.x, q.a, q.z), Spherical::new(q.y, q.b, q.c));
        let polar = Polar::new(q.z, q.b);
        let flat = polar.point() + polar.r * (polar.radial() + polar.transverse());
        [
            round.point() + ball.point() + vec3(flat.x, flat.y, round.r * ball.theta),
            round.r
                * (round.radial() + round.transverse())
                    .cross(ball.polar() + ball.azimuthal() + ball.radial()),
            round.velocity() + ball.velocity(),
            round.acceleration() + ball.acceleration(),
            vec3(polar.velocity().dt().x, polar.acceleration().y, polar.acceleration().x),
        ]
    }
    #[output]
    fn parameters(&self, q: &Coordinates<Self>) -> [Vec3; 3] {
        let ((s, c), (s2, c2)) = (q.a.sin_cos(), q.b.sin_cos());
        let e = EulerParameters::new([c * c2, c * s2, -s * s2, s * c2]);
        let point = vec3(q.x, q.y, q.z);
        [
            e.rotation() * point,
            e.angular_velocity() + e.angular_velocity_in_body(),
            e.norm_constraint() * Vec3::X,
        ]
    }
    #[output]
    fn solids(&self, q: &Coordinates<Self>) -> [Vec3; 5] {
        let [a, b, c] = self.size;
        let sum = Inertia::cuboid(self.m, a, b, c) + Inertia::cylinder(self.m, a, q.x)
            - Inertia::tube(self.m, a, b, c);
        let round =
            Inertia::sphere(self.m, q.y) + Inertia::shell(self.m, a) - Inertia::ellipsoid(self.m, b, q.z, a);
        let thin = Inertia::cone(self.m, c, q.y) + Inertia::rod(self.m, b) - Inertia::plate(self.m, q.x, c);
        let moved = Inertia::turned(sum, Mat3::rotation_y(q.b)) - Inertia::offset(self.m, vec3(q.x, q.y, c));
        let halves = Inertia::hemisphere(self.m, c) - Inertia::half_cylinder(self.m, q.y, b)
            + Inertia::ring(self.m, q.x)
            + Inertia::triangle(self.m, vec3(q.x, 0.0, a), vec3(b, q.z, 0.0), vec3(0.0, c, q.y));
        let v = vec3(0.3, 1.0, -0.7);
        [sum * v, round * v, thin * v, moved * v, halves * v]
    }
    fn other(&self, q: &Coordinates<Self>) -> Frame {
        Frame::at(self.center).frame(vec3(q.y, self.size[2], 0.0), Mat3::rotation_z(q.b))
    }
    #[output]
    fn hinges(&self, q: &Coordinates<Self>) -> [[Expr; 5]; 3] {
        let (a, b) = (self.frame(q), self.other(q));
        [Joint::revolute(a, b), Joint::prismatic(a, b), Joint::screw(a, b, self.size[1])]
    }
    #[output]
    fn fewer_rows(&self, q: &Coordinates<Self>) -> [[Expr; 4]; 2] {
        [Joint::cylindrical(self.frame(q), self.other(q)), Joint::universal(self.frame(q), self.other(q))]
    }
    #[output]
    fn bolts(&self, q: &Coordinates<Self>) -> [Expr; 6] {
        Joint::weld(self.frame(q), self.other(q))
    }
    #[output]
    fn sliding_planes(&self, q: &Coordinates<Self>) -> [Expr; 3] {
        let ball = Joint::spherical(self.frame(q), self.other(q));
        let plane = Joint::planar(self.frame(q), self.other(q));
        [plane[0] + ball.x, plane[1], plane[2]]
    }
    #[output]
    fn wheels(&self, q: &Coordinates<Self>) -> [Expr; 3] {
        let [r, s, _] = self.size;
        [Joint::gear(q.a, r, q.b, s), Joint::rack(q.x, q.b, s), Joint::belt(q.a, r, q.c, s)]
    }
    #[output]
    fn joints_of_the_plane(&self, q: &Coordinates<Self>) -> [Expr; 8] {
        let (a, b) = (self.flat(q), PlanarFrame::new(vec2(q.z, self.size[0]), q.c));
        let ([x, y], [across, angle]) = (PlanarJoint::revolute(a, b), PlanarJoint::prismatic(a, b));
        let [dx, dy, turned] = PlanarJoint::weld(a, b);
        [x, y, across, angle, PlanarJoint::slot(a, b), dx, dy, turned]
    }
}

fn words() -> Words {
    Words {
        m: 1.4,
        center: Vec3::new(0.2, -0.3, 0.1),
        inertia: Mat3::from([[1.0, 0.1, -0.2], [0.1, 1.5, 0.05], [-0.2, 0.05, 1.2]]),
        size: [0.4, 0.7, 0.9],
        gravity: 9.81,
    }
}

/// The numbers of a result in the order in which the macro lists its components.
trait Flat {
    fn flat(&self) -> Vec<f64>;
}
impl Flat for Expr {
    fn flat(&self) -> Vec<f64> {
        vec![self.value()]
    }
}
impl Flat for Vec2 {
    fn flat(&self) -> Vec<f64> {
        self.value().to_array().to_vec()
    }
}
impl Flat for Vec3 {
    fn flat(&self) -> Vec<f64> {
        self.value().to_array().to_vec()
    }
}
impl<T: Flat, const N: usize> Flat for [T; N] {
    fn flat(&self) -> Vec<f64> {
        self.iter().flat_map(Flat::flat).collect()
    }
}

proptest! {
    #[test]
    fn compiled_words_and_their_functions_agree(
        q in proptest::array::uniform6(-1.2..1.2_f64),
        u in proptest::array::uniform6(-1.5..1.5_f64),
    ) {
        let model = words();
        let state = model.state().x(q[0]).y(q[1]).z(q[2]).a(q[3]).b(q[4]).c(q[5])
            .x_rate(u[0]).y_rate(u[1]).z_rate(u[2]).a_rate(u[3]).b_rate(u[4]).c_rate(u[5])
            .build().expect("every number is finite");
        let accelerations = model.accelerations(&state).expect("the pitch is away from a right angle");
        let q = Words::coordinates_with(&state, &accelerations, &[]);
        let mut compiled = vec![0.0; Words::OUTPUTS.len()];
        model.outputs(&state, &mut compiled).expect("the pitch is away from a right angle");
        let all = [
            model.frames(&q).flat(), model.rates(&q).flat(), model.accelerations_seen(&q).flat(),
                model.momenta(&q).flat(),
            model.plane(&q).flat(), model.planar_body(&q).flat(), model.curvilinear(&q).flat(),
                model.parameters(&q).flat(),
            model.solids(&q).flat(), model.hinges(&q).flat(), model.fewer_rows(&q).flat(),
                model.bolts(&q).flat(),
            model.sliding_planes(&q).flat(), model.wheels(&q).flat(), model.joints_of_the_plane(&q).flat(),
        ].concat();
        prop_assert_eq!(all.len(), compiled.len());
        let scale = 1.0 + accelerations.norm();
        for ((quantity, compiled), by_jets) in Words::OUTPUTS.iter().zip(&compiled).zip(&all) {
            let error = (compiled - by_jets).abs();
            prop_assert!(error < 1e-12 * scale, "{}: {} compiled, {} by \
                jets", quantity.name, compiled, by_jets);
        }
        prop_assert!((model.kinetic_energy(&state) - model.kinetic(&q).value()).abs() < 1e-13 * scale);
        prop_assert!((model.potential_energy(&state) - model.potential(&q).value()).abs() < 1e-13 * scale);
        let mut powers = vec![0.0; Words::POWERS.len()];
        model.powers(&state, &mut powers);
        let force = Words::POWERS.iter().position(|p| p.name == "pushed").expect("a force has its power");
        prop_assert!((powers[force] - model.pushed(&q).power()).abs() < 1e-12 * scale);
    }
}

/// A body on a joint in the world, at rest: how it starts to move is what the joint leaves of its fall.
macro_rules! on_a_joint {
    ($($Name:ident $joint:ident $rows:literal)*) => {$(
        /// A body with a joint in its corner.
        #[derive(Clone, Debug, Dynamics)]
        #[coordinates(place: [m; 3], e: [_; 4])]
        #[units(m: kg, inertia: kg * m^2, gravity: m / s^2, anchor: m, corner: m)]
        pub struct $Name {
            /// Mass.
            pub m: f64,
            /// Inertia about the center of mass.
            pub inertia: Mat3<f64>,
            /// Gravity.
            pub gravity: Vec3<f64>,
            /// Where the joint is in the world.
            pub anchor: Vec3<f64>,
            /// How its axes stand there.
            pub axes: Mat3<f64>,
            /// Where it is in the body.
            pub corner: Vec3<f64>,
        }
        #[dynamics]
        impl $Name {
            fn body(&self, q: &Coordinates<Self>) -> RigidBody {
                let frame = Frame::new(Vec3::from(q.place), EulerParameters::new(q.e).rotation());
                RigidBody::new(self.m, Vec3::ZERO, self.inertia, frame)
            }
            #[kinetic]
            fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
                self.body(q).kinetic_energy()
            }
            #[potential]
            fn weight(&self, q: &Coordinates<Self>) -> Expr {
                self.body(q).potential_energy(self.gravity)
            }
            #[holonomic]
            fn unit(&self, q: &Coordinates<Self>) -> Expr {
                EulerParameters::new(q.e).norm_constraint()
            }
            #[holonomic]
            fn joint(&self, q: &Coordinates<Self>) -> [Expr; $rows] {
                Joint::$joint(
                    Frame::new(self.anchor, self.axes),
                    self.body(q).frame.frame(self.corner, Mat3::IDENTITY)
                )
            }
        }
        impl $Name {
            /// Accelerations of the center of mass and about it, in the world.
            fn falls() -> [Vec3<f64>; 2] {
                let Fall { m, inertia, gravity, anchor, axes, corner } = fall();
                let model = Self { m, inertia, gravity, anchor, axes, corner };
                let (place, e) = (anchor - axes * corner, axes.to_euler_parameters().expect("a rotation"));
                let state = model.state().place(place.to_array()).e(e).build().expect("the frames of the \
                    joint are one");
                let accelerations = model.accelerations(&state).expect("the joint is regular");
                let q = Self::coordinates_with(&state, &accelerations, &[0.0; 1 + $rows]);
                let body = model.body(&q);
                [body.center_of_mass().dt().rate(), body.angular_velocity().rate()]
            }
        }
    )*};
}

on_a_joint! {
    Hinged revolute 5
    Sliding prismatic 5
    OnAShaft cylindrical 4
    OnAPlane planar 3
    Welded weld 6
}

struct Fall {
    m: f64,
    inertia: Mat3<f64>,
    gravity: Vec3<f64>,
    anchor: Vec3<f64>,
    axes: Mat3<f64>,
    corner: Vec3<f64>,
}

fn fall() -> Fall {
    Fall {
        m: 1.7,
        inertia: Mat3::from([[1.0, 0.1, -0.2], [0.1, 1.5, 0.05], [-0.2, 0.05, 1.2]]),
        gravity: Vec3::new(0.7, -1.1, -9.3),
        anchor: Vec3::new(0.4, 1.0, -0.6),
        axes: Mat3::euler(EulerSequence::Zyx, [0.4, -0.7, 1.2]),
        corner: Vec3::new(0.3, -0.5, 0.2),
    }
}

#[test]
fn joints_leave_what_they_say() {
    let Fall { m, inertia, gravity, axes, corner, .. } = fall();
    let (n, arm) = (axes.column(2), axes * corner * -1.0);
    let along = n * n.dot(gravity);
    // About the axis: the moment of the weight by the moment of inertia.
    let turning = Inertia::turned(inertia, axes).value() + Inertia::offset(m, arm).value();
    let spin = n * (n.dot(arm.cross(gravity * m)) / n.dot(turning * n));
    let zero = Vec3::new(0.0, 0.0, 0.0);
    for (name, found, expected) in [
        ("revolute", Hinged::falls(), [spin.cross(arm), spin]),
        ("prismatic", Sliding::falls(), [along, zero]),
        ("cylindrical", OnAShaft::falls(), [along + spin.cross(arm), spin]),
        ("planar", OnAPlane::falls(), [gravity - along, zero]),
        ("weld", Welded::falls(), [zero, zero]),
    ] {
        for (found, expected) in found.iter().zip(expected) {
            let error = (*found - expected).norm();
            assert!(error < 1e-12, "{name}: {found:?} instead of {expected:?}, {error:e} off");
        }
    }
}

/// A symmetric top, said with words and by hand.
mod symmetric_top {
    use super::*;

    /// With words: the spin leaves the inertia as it is.
    #[derive(Clone, Debug, Dynamics)]
    #[coordinates(angles: [rad; 3])]
    struct Said {
        across: f64,
        along: f64,
        moment: f64,
    }
    #[dynamics]
    impl Said {
        #[kinetic]
        fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
            let inertia = Mat3::diagonal(self.across, self.across, self.along);
            Mat3::euler(EulerSequence::Zxz, q.angles).rotational_energy(inertia)
        }
        #[potential]
        fn weight(&self, q: &Coordinates<Self>) -> Expr {
            self.moment * q.angles[1].cos()
        }
    }

    /// As in textbooks: ½ A (ϑ̇² + φ̇² sin²ϑ) + ½ C (ψ̇ + φ̇ cos ϑ)².
    #[derive(Clone, Debug, Dynamics)]
    #[coordinates(angles: [rad; 3])]
    struct ByHand {
        across: f64,
        along: f64,
        moment: f64,
    }
    #[dynamics]
    impl ByHand {
        #[kinetic]
        fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
            let [phi, theta, psi] = q.angles;
            let across = theta.dt().powi(2) + (phi.dt() * theta.sin()).powi(2);
            0.5 * self.across * across + 0.5 * self.along * (psi.dt() + phi.dt() * theta.cos()).powi(2)
        }
        #[potential]
        fn weight(&self, q: &Coordinates<Self>) -> Expr {
            self.moment * q.angles[1].cos()
        }
    }

    /// Operations of the accelerations, per evaluation.
    fn operations(listing: &str) -> u32 {
        let line =
            listing.lines().find_map(|line| line.strip_prefix("accelerations: ")).expect("they are listed");
        line.split(' ').next().and_then(|count| count.parse().ok()).expect("a count comes first")
    }

    #[test]
    fn words_cost_what_the_textbook_costs() {
        let (said, by_hand) = (operations(Said::LISTING), operations(ByHand::LISTING));
        assert!(said <= by_hand && by_hand < 40, "{said} operations, by hand {by_hand}");
        let (across, along, moment) = (0.05, 0.01, 0.5);
        let (said, by_hand) = (Said { across, along, moment }, ByHand { across, along, moment });
        let (angles, rates) = ([0.3, 1.1, -0.7], [0.9, -0.4, 30.0]);
        let said =
            said.accelerations(&said.state().angles(angles).angles_rate(rates).build().expect("finite"));
        let hand = by_hand
            .accelerations(&by_hand.state().angles(angles).angles_rate(rates).build().expect("finite"));
        let (said, hand) = (said.expect("regular"), hand.expect("regular"));
        assert!((said - hand).norm() < 1e-13 * hand.norm(), "{said} and {hand}");
    }
}

mod assumptions;
