//! A ball that bounces on a floor.

use dynamics::prelude::*;

/// A ball above a floor. The floor is a contact: `simulate(.., contact={"floor": 0.7})`.
#[derive(Clone, Debug, Dynamics)]
#[coordinates(y: m)]
#[units(mass: kg, g: m / s^2)]
pub struct Ball {
    pub mass: f64,
    pub g: f64,
}

#[dynamics]
impl Ball {
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * self.mass * q.y.dt().powi(2)
    }
    #[potential]
    fn gravity(&self, q: &Coordinates<Self>) -> Expr {
        self.mass * self.g * q.y
    }
    #[holonomic(switched)]
    fn floor(&self, q: &Coordinates<Self>) -> Expr {
        q.y
    }
    #[drawing]
    fn drawing(&self, q: &Coordinates<Self>) -> Drawing {
        Drawing::new().ground([-0.5, 0.0], [0.5, 0.0]).disc(vec2(0.0, q.y + 0.05), 0.05)
    }
}
