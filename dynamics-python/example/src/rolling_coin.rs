//! A coin rolls on a table without slipping, in a circle. Pushed, it wobbles about that circle.

use dynamics::prelude::*;

/// A coin rolls on a table without slipping, in a circle. Pushed, it wobbles about that circle; slower, it
/// wobbles more and more. Energy is conserved, so it never falls flat. Drag it, and turn the picture.
#[derive(Clone, Debug, Dynamics)]
#[coordinates(x: m, y: m, yaw: rad, lean: rad, spin: rad)]
#[units(mass: kg, radius: m, g: m / s^2)]
pub struct Coin {
    pub mass: f64,
    pub radius: f64,
    pub g: f64,
}

#[dynamics]
impl Coin {
    /// Heading and lean, without the spin: x along the track, y along the axle, −z toward the table.
    fn leaning(&self, q: &Coordinates<Self>) -> Frame {
        let center = vec3(q.x, q.y, self.radius * q.lean.cos());
        Frame::new(center, Mat3::rotation_z(q.yaw) * Mat3::rotation_x(q.lean))
    }
    /// The axle is y: a thin disk has half its inertia across.
    fn coin(&self, q: &Coordinates<Self>) -> RigidBody {
        let across = 0.25 * self.mass * self.radius.powi(2);
        let inertia = Mat3::diagonal(across, 2.0 * across, across);
        RigidBody::new(
            self.mass,
            Vec3::ZERO,
            inertia,
            self.leaning(q).frame(Vec3::ZERO, Mat3::rotation_y(q.spin)),
        )
    }
    fn contact(&self, q: &Coordinates<Self>) -> Vec3 {
        self.leaning(q).point(-self.radius * Vec3::Z)
    }
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        self.coin(q).kinetic_energy()
    }
    #[potential]
    fn weight(&self, q: &Coordinates<Self>) -> Expr {
        self.coin(q).potential_energy(-self.g * Vec3::Z)
    }
    /// What is fixed in the coin rests where it touches the table.
    #[nonholonomic]
    fn rolling(&self, q: &Coordinates<Self>) -> Vec2 {
        let slip = self.coin(q).frame.carried_velocity(self.contact(q));
        vec2(slip.x, slip.y)
    }
    #[drawing]
    fn drawing(&self, q: &Coordinates<Self>) -> Drawing {
        let frame = self.coin(q).frame;
        let along = |y: f64| frame.point(vec3(0.0, y, 0.0));
        // A mark beside the rim shows how it turns.
        let mark = frame.point(vec3(0.0, 0.1 * self.radius, 0.75 * self.radius));
        Drawing::new()
            .cylinder(along(-0.07 * self.radius), along(0.07 * self.radius), self.radius)
            .color(Color::Red)
            .disc(mark, 0.1 * self.radius)
            .plain()
            .trace("contact", self.contact(q))
    }
}
