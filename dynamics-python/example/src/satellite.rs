//! A satellite that turns by its reaction wheels.

use dynamics::prelude::*;

/// A satellite that turns by the motors of three reaction wheels.
#[derive(Clone, Debug, Dynamics)]
#[coordinates(e: [_; 4], wheels: [rad; 3])]
#[inputs(motors: [N * m; 3])]
#[units(mass: kg, size: m, wheel: kg, radius: m)]
pub struct Satellite {
    pub mass: f64,
    pub size: [f64; 3],
    pub wheel: f64,
    pub radius: f64,
}

#[dynamics]
impl Satellite {
    fn hub(&self, q: &Coordinates<Self>) -> RigidBody {
        let [a, b, c] = self.size;
        let frame = Frame::turned(EulerParameters::new(q.e).rotation());
        RigidBody::new(self.mass, Vec3::ZERO, Inertia::cuboid(self.mass, a, b, c), frame)
    }
    /// A wheel about each axis of the hub, through its middle.
    fn wheel(&self, q: &Coordinates<Self>, k: usize) -> RigidBody {
        let quarter = core::f64::consts::FRAC_PI_2;
        let mount = match k {
            0 => Mat3::rotation_y(quarter),
            1 => Mat3::rotation_x(-quarter),
            _ => Mat3::rotation_z(0.0),
        };
        let frame = self.hub(q).frame.frame(Vec3::ZERO, mount * Mat3::rotation_z(q.wheels[k]));
        RigidBody::new(self.wheel, Vec3::ZERO, Inertia::cylinder(self.wheel, self.radius, 0.0), frame)
    }
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        let mut sum = self.hub(q).kinetic_energy();
        for k in 0..3 {
            sum += self.wheel(q, k).kinetic_energy();
        }
        sum
    }
    #[holonomic]
    fn unit(&self, q: &Coordinates<Self>) -> Expr {
        EulerParameters::new(q.e).norm_constraint()
    }
    #[force]
    fn drive(&self, q: &Coordinates<Self>) -> Force {
        let [x, y, z] = q.motors;
        Force::along(q.wheels[0], x) + Force::along(q.wheels[1], y) + Force::along(q.wheels[2], z)
    }
    #[output]
    fn momentum(&self, q: &Coordinates<Self>) -> Vec3 {
        let mut sum = self.hub(q).angular_momentum(Vec3::ZERO);
        for k in 0..3 {
            sum += self.wheel(q, k).angular_momentum(Vec3::ZERO);
        }
        sum
    }
    /// Of the hub, in its axes.
    #[output]
    fn omega(&self, q: &Coordinates<Self>) -> Vec3 {
        self.hub(q).frame.angular_velocity_in_body()
    }
    #[drawing]
    fn drawing(&self, q: &Coordinates<Self>) -> Drawing {
        let (frame, [a, b, c]) = (self.hub(q).frame, self.size);
        let mut drawing = Drawing::new().cuboid(frame, Vec3::ZERO, self.size).color(Color::Blue);
        for side in [-1.0, 1.0] {
            drawing = drawing.cuboid(
                frame,
                vec3(0.0, side * (0.5 * b + 0.9 * a), 0.0),
                [0.8 * a, 1.6 * a, 0.02 * a],
            );
        }
        let tip = frame.point(vec3(0.0, 0.0, 1.4 * c));
        drawing
            .color(Color::Red)
            .cylinder(frame.point(vec3(0.0, 0.0, 0.5 * c)), tip, 0.03 * a)
            .trace("antenna", tip)
    }
}
