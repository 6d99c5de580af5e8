//! A book in orbit, spun about its intermediate axis. It turns over, again and again, at even intervals.

use dynamics::prelude::*;

/// A book in orbit that is spun about its intermediate axis turns over again and again, at even intervals.
/// Take the other starts: about the long and the short axis it only wobbles. Then change the sides of the
/// book.
#[derive(Clone, Debug, Dynamics)]
#[coordinates(e: [_; 4])]
#[units(mass: kg, size: m)]
pub struct Book {
    pub mass: f64,
    /// Height, width, thickness: along the body's x, y, z.
    pub size: [f64; 3],
}

#[dynamics]
impl Book {
    fn body(&self, q: &Coordinates<Self>) -> RigidBody {
        let [a, b, c] = self.size;
        let frame = Frame::turned(EulerParameters::new(q.e).rotation());
        RigidBody::new(self.mass, Vec3::ZERO, Inertia::cuboid(self.mass, a, b, c), frame)
    }
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        self.body(q).kinetic_energy()
    }
    #[holonomic]
    fn unit(&self, q: &Coordinates<Self>) -> Expr {
        EulerParameters::new(q.e).norm_constraint()
    }
    /// In the body's components.
    #[output]
    fn omega(&self, q: &Coordinates<Self>) -> Vec3 {
        self.body(q).frame.angular_velocity_in_body()
    }
    #[output]
    fn momentum(&self, q: &Coordinates<Self>) -> Vec3 {
        self.body(q).angular_momentum(Vec3::ZERO)
    }
    #[event]
    fn turning_over(&self, q: &Coordinates<Self>) -> Expr {
        self.omega(q).y
    }
    #[drawing]
    fn drawing(&self, q: &Coordinates<Self>) -> Drawing {
        let frame = self.body(q).frame;
        let [a, b, c] = self.size.map(|side| 0.5 * side);
        Drawing::new()
            .cuboid(frame, Vec3::ZERO, self.size)
            .color(Color::Red)
            .disc(frame.point(vec3(a, b, c)), 0.006)
            .trace("corner", frame.point(vec3(a, b, c)))
    }
}
