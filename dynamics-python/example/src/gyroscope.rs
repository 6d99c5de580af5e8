//! A gyroscope on a pivot, released with its axis at rest. It falls a little, and its axis moves in cusps.

use dynamics::prelude::*;

/// A heavy top on a pivot, let go with its axis at rest. It falls a little, is turned aside, and its axis
/// moves in cusps. Take the other starts: pushed just right it precesses evenly, pushed backward it moves in
/// loops, and slow it tumbles.
#[derive(Clone, Debug, Dynamics)]
#[coordinates(angles: [rad; 3])]
#[units(mass: kg, radius: m, thickness: m, arm: m, g: m / s^2)]
pub struct Gyroscope {
    pub mass: f64,
    pub radius: f64,
    pub thickness: f64,
    pub arm: f64,
    pub g: f64,
}

#[dynamics]
impl Gyroscope {
    fn rotor(&self, q: &Coordinates<Self>) -> RigidBody {
        let frame = Frame::turned(Mat3::euler(EulerSequence::Zxz, q.angles));
        let inertia = Inertia::cylinder(self.mass, self.radius, self.thickness);
        RigidBody::new(self.mass, self.arm * Vec3::Z, inertia, frame)
    }
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        self.rotor(q).kinetic_energy()
    }
    #[potential]
    fn weight(&self, q: &Coordinates<Self>) -> Expr {
        self.rotor(q).potential_energy(-self.g * Vec3::Z)
    }
    /// The axis is at the end of its fall, or of its rise.
    #[event]
    fn turning(&self, q: &Coordinates<Self>) -> Expr {
        q.angles[1].dt()
    }
    #[drawing]
    fn drawing(&self, q: &Coordinates<Self>) -> Drawing {
        let frame = self.rotor(q).frame;
        let along = |z: f64| frame.point(vec3(0.0, 0.0, z));
        // A mark on the rotor shows its spin.
        let mark = frame.point(vec3(0.8 * self.radius, 0.0, self.arm + 0.5 * self.thickness));
        Drawing::new()
            .color(Color::Faint)
            .cone([0.0, 0.0, -1.2 * self.arm], [0.0; 3], 0.3 * self.radius)
            .cylinder([0.0; 3], along(1.4 * self.arm), 0.04 * self.radius)
            .plain()
            .cylinder(
                along(self.arm - 0.5 * self.thickness),
                along(self.arm + 0.5 * self.thickness),
                self.radius,
            )
            .color(Color::Red)
            .disc(mark, 0.12 * self.radius)
            .plain()
            .trace("tip", along(1.4 * self.arm))
    }
}
