//! A thin disk that rolls on a plane without slipping.

use dynamics::prelude::*;

#[derive(Clone, Debug, Dynamics)]
#[coordinates(x: m, y: m, yaw: rad, lean: rad, spin: rad)]
#[units(m: kg, r: m, g: m / s^2)]
pub(crate) struct Disk {
    pub(crate) m: f64,
    pub(crate) r: f64,
    pub(crate) g: f64,
}
#[dynamics]
impl Disk {
    /// The disk, its axle along y; it touches the plane z = 0 at all times.
    fn body(&self, q: &Coordinates<Self>) -> RigidBody {
        let rotation = Mat3::euler(EulerSequence::Zxy, [q.yaw, q.lean, q.spin]);
        let frame = Frame::new(vec3(q.x, q.y, self.r * q.lean.cos()), rotation);
        // A disk about z, turned so that its axle is y.
        let quarter = Mat3::from([[1.0, 0.0, 0.0], [0.0, 0.0, 1.0], [0.0, -1.0, 0.0]]);
        let inertia = Inertia::turned(Inertia::cylinder(self.m, self.r, 0.0), quarter);
        RigidBody::new(self.m, Vec3::ZERO, inertia, frame)
    }
    fn contact(&self, q: &Coordinates<Self>) -> Vec3 {
        let leaning = Frame::turned(Mat3::rotation_z(q.yaw) * Mat3::rotation_x(q.lean));
        self.body(q).center_of_mass() - self.r * leaning.z()
    }
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        self.body(q).kinetic_energy()
    }
    #[potential]
    fn weight(&self, q: &Coordinates<Self>) -> Expr {
        self.body(q).potential_energy(-self.g * Vec3::Z)
    }
    #[nonholonomic]
    fn rolling(&self, q: &Coordinates<Self>) -> Vec2 {
        let slip = self.body(q).frame.carried_velocity(self.contact(q));
        vec2(slip.x, slip.y)
    }
}

pub(crate) const DISK: Disk = Disk { m: 1.0, r: 1.0, g: 1.0 };
