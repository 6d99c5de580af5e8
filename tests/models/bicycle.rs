//! Whipple's bicycle with the parameters of J. P. Meijaard, J. M. Papadopoulos, A. Ruina and A. L. Schwab,
//! Proc. R. Soc. A 463 (2007) 1955, table 1. Tests and the example include this file.

use dynamics::prelude::*;

/// Four rigid bodies, hands off: wheels, the frame with a rigid rider, fork and handlebar. x forward, y to
/// the right, z down; thin wheels roll without slipping on the plane z = 0.
#[derive(Clone, Debug, Dynamics)]
#[coordinates(x: m, y: m, yaw: rad, roll: rad, pitch: rad, steer: rad, rear: rad, front: rad)]
#[units(wheelbase: m, trail: m, tilt: rad, g: m / s^2, radius: m, mass: kg, frame_center: m, fork_center: m,
    frame_inertia: kg * m^2, fork_inertia: kg * m^2, rear_inertia: kg * m^2, front_inertia: kg * m^2)]
#[nominal(wheelbase = 1.02, trail = 0.08, tilt = 0.3)]
pub(crate) struct Bicycle {
    pub(crate) wheelbase: f64,
    /// From the point of the ground on the steer axis back to the front contact.
    pub(crate) trail: f64,
    /// Of the steer axis against the vertical.
    pub(crate) tilt: f64,
    pub(crate) g: f64,
    /// Of rear and front wheel.
    pub(crate) radius: [f64; 2],
    /// Of rear wheel, frame with rider, fork with handlebar, front wheel.
    pub(crate) mass: [f64; 4],
    /// Centers of mass, from the rear contact, as the bicycle stands upright.
    pub(crate) frame_center: Vec3<f64>,
    pub(crate) fork_center: Vec3<f64>,
    /// About the centers of mass.
    pub(crate) frame_inertia: Mat3<f64>,
    pub(crate) fork_inertia: Mat3<f64>,
    /// About a diameter, about the axle.
    pub(crate) rear_inertia: [f64; 2],
    pub(crate) front_inertia: [f64; 2],
}

#[dynamics]
impl Bicycle {
    /// Where the rear wheel touches the ground, turned by yaw and roll.
    fn leaning(&self, q: &Coordinates<Self>) -> Frame {
        Frame::new(vec3(q.x, q.y, 0.0), Mat3::rotation_z(q.yaw) * Mat3::rotation_x(q.roll))
    }
    /// The rear frame, its origin in the rear hub.
    fn rear_frame(&self, q: &Coordinates<Self>) -> Frame {
        self.leaning(q).frame(-self.radius[0] * Vec3::Z, Mat3::rotation_y(q.pitch))
    }
    /// A point of the upright bicycle, given from the rear contact, as seen from the rear hub.
    fn seen_from_hub(&self, place: Vec3) -> Vec3 {
        place + self.radius[0] * Vec3::Z
    }
    /// The fork, its origin where the steer axis meets the ground.
    fn fork_frame(&self, q: &Coordinates<Self>) -> Frame {
        let axis = self.seen_from_hub(vec3(self.wheelbase + self.trail, 0.0, 0.0));
        let tilted = self.rear_frame(q).frame(axis, Mat3::rotation_y(self.tilt));
        tilted.frame(Vec3::ZERO, Mat3::rotation_z(q.steer)).frame(Vec3::ZERO, Mat3::rotation_y(-self.tilt))
    }
    fn front_hub(&self, q: &Coordinates<Self>) -> Frame {
        self.fork_frame(q).frame(vec3(-self.trail, 0.0, -self.radius[1]), Mat3::IDENTITY)
    }
    fn rear_wheel(&self, q: &Coordinates<Self>) -> RigidBody {
        let [across, along] = self.rear_inertia;
        let hub = self.leaning(q).frame(-self.radius[0] * Vec3::Z, Mat3::rotation_y(q.rear));
        RigidBody::new(self.mass[0], Vec3::ZERO, Mat3::diagonal(across, along, across), hub)
    }
    fn rider(&self, q: &Coordinates<Self>) -> RigidBody {
        let center = self.seen_from_hub(self.frame_center.into());
        RigidBody::new(self.mass[1], center, self.frame_inertia, self.rear_frame(q))
    }
    fn fork(&self, q: &Coordinates<Self>) -> RigidBody {
        let center =
            vec3(self.fork_center.x - self.wheelbase - self.trail, self.fork_center.y, self.fork_center.z);
        RigidBody::new(self.mass[2], center, self.fork_inertia, self.fork_frame(q))
    }
    fn front_wheel(&self, q: &Coordinates<Self>) -> RigidBody {
        let [across, along] = self.front_inertia;
        let hub = self.front_hub(q).frame(Vec3::ZERO, Mat3::rotation_y(q.front));
        RigidBody::new(self.mass[3], Vec3::ZERO, Mat3::diagonal(across, along, across), hub)
    }
    /// The lowest point of the front wheel: down in its plane.
    fn front_contact(&self, q: &Coordinates<Self>) -> Vec3 {
        let hub = self.front_hub(q);
        let axle = hub.y();
        let down = Vec3::Z - axle.z * axle;
        hub.origin() + self.radius[1] * down.normalize()
    }
    /// Seen by one who rides along: the rear contact stands still, up is up.
    #[drawing]
    fn drawing(&self, q: &Coordinates<Self>) -> Drawing {
        let seen = |place: Vec3| vec3(place.x - q.x, q.y - place.y, -place.z);
        let wheel = |hub: Frame, radius: f64| {
            let rim = |angle: f64| seen(hub.point(vec3(radius * angle.sin(), 0.0, radius * angle.cos())));
            let spokes = (0..6).map(|k| rim(f64::from(k) * std::f64::consts::FRAC_PI_3));
            let round = Drawing::new().curve(0.0, std::f64::consts::TAU, 36, rim);
            spokes.fold(round, |drawing, end| drawing.line(seen(hub.origin()), end))
        };
        let (rear, fork) = (self.rear_frame(q), self.fork_frame(q));
        let along = |frame: Frame, x: f64, z: f64| seen(frame.point(vec3(x, 0.0, z)));
        let head = |height: f64| along(fork, -height * self.tilt.tan(), -height);
        let hub = self.front_hub(q).origin();
        let grip = |side: f64| seen(fork.point(vec3(-0.42, side, -1.05)));
        let saddle = along(rear, 0.25, -0.6);
        wheel(self.rear_wheel(q).frame, self.radius[0])
            .with(wheel(self.front_wheel(q).frame, self.radius[1]))
            .polyline([seen(rear.origin()), saddle, head(0.85), seen(rear.origin())])
            .polyline([seen(hub), head(0.6), head(1.0)])
            .polyline([grip(0.3), head(1.0), grip(-0.3)])
            .polyline([saddle, along(rear, 0.3, -1.2)])
            .dot(seen(self.rider(q).center_of_mass()))
    }
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        let wheels = self.rear_wheel(q).kinetic_energy() + self.front_wheel(q).kinetic_energy();
        wheels + self.rider(q).kinetic_energy() + self.fork(q).kinetic_energy()
    }
    #[potential]
    fn weight(&self, q: &Coordinates<Self>) -> Expr {
        let down = self.g * Vec3::Z;
        let wheels = self.rear_wheel(q).potential_energy(down) + self.front_wheel(q).potential_energy(down);
        wheels + self.rider(q).potential_energy(down) + self.fork(q).potential_energy(down)
    }
    /// The front wheel touches the ground: the pitch follows from lean and steer.
    #[holonomic]
    fn touching(&self, q: &Coordinates<Self>) -> Expr {
        self.front_contact(q).z
    }
    /// What is fixed in a wheel rests where it touches the ground.
    #[nonholonomic]
    fn rear_rolling(&self, q: &Coordinates<Self>) -> Vec2 {
        let slip = self.rear_wheel(q).frame.carried_velocity(self.leaning(q).origin());
        vec2(slip.x, slip.y)
    }
    #[nonholonomic]
    fn front_rolling(&self, q: &Coordinates<Self>) -> Vec2 {
        let slip = self.front_wheel(q).frame.carried_velocity(self.front_contact(q));
        vec2(slip.x, slip.y)
    }
}

/// The published parameters.
pub(crate) fn model() -> Bicycle {
    let inertia = |[xx, yy, zz, xz]: [f64; 4]| Mat3::from([[xx, 0.0, xz], [0.0, yy, 0.0], [xz, 0.0, zz]]);
    Bicycle {
        wheelbase: 1.02,
        trail: 0.08,
        tilt: std::f64::consts::PI / 10.0,
        g: 9.81,
        radius: [0.3, 0.35],
        mass: [2.0, 85.0, 4.0, 3.0],
        frame_center: Vec3::new(0.3, 0.0, -0.9),
        fork_center: Vec3::new(0.9, 0.0, -0.7),
        frame_inertia: inertia([9.2, 11.0, 2.8, 2.4]),
        fork_inertia: inertia([0.05892, 0.06, 0.00708, -0.00756]),
        rear_inertia: [0.0603, 0.12],
        front_inertia: [0.1405, 0.28],
    }
}

impl Bicycle {
    /// Upright, straight on at this speed.
    pub(crate) fn running(&self, speed: f64) -> State<Self> {
        let [rear, front] = self.radius.map(|radius| -speed / radius);
        self.state().x_rate(speed).rear_rate(rear).front_rate(front).build().expect("it rolls")
    }
}
