//! Systems of bodies on which nothing acts from outside: momentum and angular momentum are kept, and the
//! motion does not depend on where the world is, how it is turned, or how fast it moves.

use dynamics::prelude::*;
use nalgebra::SVector;
use proptest::prelude::*;

/// Two bodies with a spring and a damper between corners, and a motor that turns one against the other.
macro_rules! pair {
    ($Name:ident, [$($turn:tt)*], |$q:ident, $k:ident| $rotation:expr, { $($constraints:tt)* }) => {
        #[derive(Clone, Debug, Dynamics)]
        #[coordinates(place: [_; 6], $($turn)*)]
        struct $Name {
            m: [f64; 2],
            inertia: [Mat3<f64>; 2],
            center: [Vec3<f64>; 2],
            corner: [Vec3<f64>; 2],
            stiffness: f64,
            damping: f64,
            motor: f64,
        }

        #[dynamics]
        impl $Name {
            fn body(&self, $q: &Coordinates<Self>, $k: usize) -> RigidBody {
                let place = vec3($q.place[3 * $k], $q.place[3 * $k + 1], $q.place[3 * $k + 2]);
                RigidBody::new(self.m[$k], self.center[$k], self.inertia[$k], Frame::new(place, $rotation))
            }
            fn corner(&self, q: &Coordinates<Self>, k: usize) -> Vec3 {
                self.body(q, k).frame.point(self.corner[k])
            }
            #[kinetic]
            fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
                self.body(q, 0).kinetic_energy() + self.body(q, 1).kinetic_energy()
            }
            #[potential]
            fn spring(&self, q: &Coordinates<Self>) -> Expr {
                0.5 * self.stiffness * (self.corner(q, 1) - self.corner(q, 0)).norm_squared()
            }
            #[force]
            fn damper(&self, q: &Coordinates<Self>) -> Force {
                let apart = self.corner(q, 1) - self.corner(q, 0);
                let pull = self.damping * apart.dot(apart.dt()) * apart;
                Force::at(self.corner(q, 0), pull) + Force::at(self.corner(q, 1), -pull)
            }
            #[force]
            fn motor(&self, q: &Coordinates<Self>) -> Force {
                let moment = self.motor * self.body(q, 0).frame.x();
                self.body(q, 0).moment(-moment) + self.body(q, 1).moment(moment)
            }
            $($constraints)*

            fn momentum(&self, q: &Coordinates<Self>) -> Vec3 {
                self.body(q, 0).momentum() + self.body(q, 1).momentum()
            }
            fn angular_momentum(&self, q: &Coordinates<Self>) -> Vec3 {
                self.body(q, 0).angular_momentum(Vec3::ZERO) + self.body(q, 1).angular_momentum(Vec3::ZERO)
            }
        }

        impl $Name {
            fn of_numbers() -> Self {
                Self {
                    m: [1.3, 0.6],
                    inertia: [
                        Mat3::from([[1.0, 0.1, -0.2], [0.1, 1.5, 0.05], [-0.2, 0.05, 1.2]]),
                        Mat3::from([[0.4, 0.0, 0.03], [0.0, 0.3, -0.02], [0.03, -0.02, 0.5]]),
                    ],
                    center: [Vec3::new(0.1, -0.2, 0.05), Vec3::new(0.0, 0.15, -0.1)],
                    corner: [Vec3::new(0.5, 0.4, -0.3), Vec3::new(-0.3, 0.2, 0.6)],
                    stiffness: 7.0,
                    damping: 0.8,
                    motor: 1.1,
                }
            }
        }
    };
}

pair!(Free, [angles: [rad; 6]], |q, k|
    Mat3::euler(EulerSequence::Zyx, [q.angles[3 * k], q.angles[3 * k + 1], q.angles[3 * k + 2]]), {});

pair!(Jointed, [e: [_; 8]], |q, k|
    Mat3::euler_parameters([q.e[4 * k], q.e[4 * k + 1], q.e[4 * k + 2], q.e[4 * k + 3]]), {
    #[holonomic]
    fn units(&self, q: &Coordinates<Self>) -> [Expr; 2] {
        let [a, b, c, d, e, f, g, h] = q.e;
        [
            EulerParameters::new([a, b, c, d]).norm_constraint(),
            EulerParameters::new([e, f, g, h]).norm_constraint()
        ]
    }
    /// Hung in each other: universal joints let the motor work on two axes.
    #[holonomic]
    fn cross(&self, q: &Coordinates<Self>) -> [Expr; 4] {
        let a = self.body(q, 0).frame.frame(vec3(0.0, 0.3, 0.2), Mat3::IDENTITY);
        Joint::universal(a, self.body(q, 1).frame.frame(vec3(-0.2, 0.0, 0.1), Mat3::IDENTITY))
    }
});

/// A body's place, rotation, velocity, and angular velocity in its own axes.
#[derive(Clone, Copy, Debug)]
struct Placed {
    place: Vec3<f64>,
    rotation: Mat3<f64>,
    velocity: Vec3<f64>,
    omega: Vec3<f64>,
}

impl Placed {
    /// Euler parameters and their rates.
    fn parameters(&self) -> ([f64; 4], [f64; 4]) {
        let e = self.rotation.to_euler_parameters().expect("a rotation");
        let (w, v) = (self.omega, Vec3::new(e[1], e[2], e[3]));
        let rate = 0.5 * (e[0] * w + v.cross(w));
        (e, [-0.5 * v.dot(w), rate.x, rate.y, rate.z])
    }
    /// Seen from a world that is elsewhere, turned, and moves.
    fn seen(&self, turn: Mat3<f64>, shift: Vec3<f64>, speed: Vec3<f64>) -> Self {
        let (place, velocity) = (turn * self.place + shift, turn * self.velocity + speed);
        Self { place, velocity, rotation: turn * self.rotation, ..*self }
    }
}

/// Two bodies in the universal joint.
fn jointed(
    place: [f64; 3],
    velocity: [f64; 3],
    omega: [f64; 3],
    angles: [f64; 3],
    bent: [f64; 2],
    rates: [f64; 2],
) -> [Placed; 2] {
    let rotation = Mat3::euler(EulerSequence::Zyx, angles);
    let first = Placed { place: place.into(), rotation, velocity: velocity.into(), omega: omega.into() };
    // z of the second stays at a right angle to z of the first: turned about x by −π/2 in between.
    let (about_z, about_own) = (Mat3::rotation_z(bent[0]), Mat3::rotation_z(bent[1]));
    let between = about_z * Mat3::rotation_x(-core::f64::consts::FRAC_PI_2) * about_own;
    let relative = Vec3::new(0.0, 0.0, rates[1]) + between.transpose() * Vec3::new(0.0, 0.0, rates[0]);
    let second = rotation * between;
    let omega = between.transpose() * first.omega + relative;
    let (here, there) = (Vec3::new(0.0, 0.3, 0.2), Vec3::new(-0.2, 0.0, 0.1));
    let place = first.place + rotation * here - second * there;
    let velocity = first.velocity + rotation * first.omega.cross(here) - second * omega.cross(there);
    [first, Placed { place, rotation: second, velocity, omega }]
}

impl Jointed {
    fn state_of(&self, bodies: [Placed; 2]) -> State<Self> {
        let [(e, e_rate), (f, f_rate)] = bodies.map(|body| body.parameters());
        let both = |a: Vec3<f64>, b: Vec3<f64>| [a.x, a.y, a.z, b.x, b.y, b.z];
        let all = |a: [f64; 4], b: [f64; 4]| core::array::from_fn(|i| if i < 4 { a[i] } else { b[i - 4] });
        self.state()
            .place(both(bodies[0].place, bodies[1].place))
            .place_rate(both(bodies[0].velocity, bodies[1].velocity))
            .e(all(e, f))
            .e_rate(all(e_rate, f_rate))
            .build()
            .expect("the joint is closed")
    }
    fn moving(&self, state: &State<Self>) -> Coordinates<Self> {
        let accelerations = self.accelerations(state).expect("rows are independent");
        Self::coordinates_with(state, &accelerations, &[0.0; 6])
    }
}

proptest! {
    #[test]
    fn free_bodies_keep_their_momenta(
        place in proptest::array::uniform6(-2.0..2.0_f64),
        angles in proptest::array::uniform6(-1.2..1.2_f64),
        velocity in proptest::array::uniform6(-2.0..2.0_f64),
        rates in proptest::array::uniform6(-2.0..2.0_f64),
    ) {
        let model = Free::of_numbers();
        let state =
            model.state().place(place).angles(angles).place_rate(velocity)
            .angles_rate(rates).build().expect("finite");
        let accelerations = model.accelerations(&state).expect("pitches are away from right angles");
        let q = Free::coordinates_with(&state, &accelerations, &[]);
        let scale = 1.0 + accelerations.norm();
        let (force, moment) = (model.momentum(&q).rate().norm(), model.angular_momentum(&q).rate().norm());
        prop_assert!(force < 1e-13 * scale && moment < 1e-12 * scale, "{force:e}, {moment:e}");
        // Something moves.
        prop_assert!(model.body(&q, 0).momentum().rate().norm() > 1e-3);
    }

    #[test]
    fn bodies_in_a_joint_keep_their_momenta_and_know_no_world(
        place in proptest::array::uniform3(-2.0..2.0_f64),
        velocity in proptest::array::uniform3(-2.0..2.0_f64),
        omega in proptest::array::uniform3(-2.0..2.0_f64),
        angles in proptest::array::uniform3(-3.0..3.0_f64),
        bent in proptest::array::uniform2(-3.0..3.0_f64),
        rates in proptest::array::uniform2(-2.0..2.0_f64),
        turn in proptest::array::uniform3(-3.0..3.0_f64),
        shift in proptest::array::uniform3(-5.0..5.0_f64),
        speed in proptest::array::uniform3(-5.0..5.0_f64),
    ) {
        let model = Jointed::of_numbers();
        let here = jointed(place, velocity, omega, angles, bent, rates);
        let q = model.moving(&model.state_of(here));
        let force = model.momentum(&q).rate().norm();
        let moment = model.angular_momentum(&q).rate().norm();
        prop_assert!(force < 1e-11 && moment < 1e-10, "{force:e}, {moment:e}");

        let turn = Mat3::euler(EulerSequence::Xyz, turn);
        let there = here.map(|body| body.seen(turn, shift.into(), speed.into()));
        let seen = model.moving(&model.state_of(there));
        for k in 0..2 {
            let (a, b) = (model.body(&q, k), model.body(&seen, k));
            let accelerations = [turn * a.center_of_mass().dt().rate(), b.center_of_mass().dt().rate()];
            let spins =
                [a.frame.angular_velocity_in_body().rate(), b.frame.angular_velocity_in_body().rate()];
            for [a, b] in [accelerations, spins] {
                prop_assert!((a - b).norm() < 1e-10 * (1.0 + a.norm()), "{a:?} and {b:?}");
            }
        }
    }
}

/// Over a motion: what integration and projection leave of the momenta.
#[test]
fn momenta_are_kept_while_it_moves() {
    let model = Jointed::of_numbers();
    let bodies = jointed(
        [0.2, 0.1, -0.4],
        [0.5, -0.3, 0.1],
        [0.7, -1.1, 0.4],
        [0.4, 0.3, -0.8],
        [0.5, -0.9],
        [1.5, -0.6],
    );
    let start = model.state_of(bodies);
    let motion = model.simulate(start).until(5.0).tolerance(1e-12).run().expect("nothing is singular");
    let of = |state: &State<Jointed>| {
        let q = Jointed::coordinates_with(state, &SVector::zeros(), &[0.0; 6]);
        [model.momentum(&q).value(), model.angular_momentum(&q).value()]
    };
    let (first, last) = (of(&start), of(&motion.end()));
    for (a, b) in first.iter().zip(last) {
        assert!((*a - b).norm() < 1e-9 * (1.0 + a.norm()), "{a:?} became {b:?}");
    }
}
