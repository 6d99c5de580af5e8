//! A proton in crossed electric and magnetic fields.

use dynamics::prelude::*;

/// A proton in a magnetic field goes in a circle. With an electric field across it drifts with E × B/B², at
/// right angles to both fields, whatever its start. Give it a velocity along the field, and the circle
/// becomes a helix.
#[derive(Clone, Debug, Dynamics)]
#[coordinates(x: m, y: m, z: m)]
#[units(mass: kg, charge: C, magnetic: T, electric: V / m)]
pub struct Particle {
    pub mass: f64,
    pub charge: f64,
    pub magnetic: Vec3<f64>,
    pub electric: Vec3<f64>,
}

#[dynamics]
impl Particle {
    fn place(&self, q: &Coordinates<Self>) -> Vec3 {
        vec3(q.x, q.y, q.z)
    }
    #[lagrangian]
    fn lagrangian(&self, q: &Coordinates<Self>) -> Expr {
        let (place, velocity) = (self.place(q), self.place(q).dt());
        let vector_potential = 0.5 * self.magnetic.cross(place);
        let potential = -self.electric.dot(place);
        0.5 * self.mass * velocity.norm_squared() + self.charge * (velocity.dot(vector_potential) - potential)
    }
    #[drawing]
    fn drawing(&self, q: &Coordinates<Self>) -> Drawing {
        let place = self.place(q);
        Drawing::new().axes(5e-3).trace("proton", place).dot(place)
    }
}
