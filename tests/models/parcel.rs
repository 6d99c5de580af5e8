//! A parcel on belts, as friction takes it along.

use dynamics::prelude::*;

/// A parcel on belts: their speed changes in an instant, or from belt to belt.
#[derive(Clone, Debug, Dynamics)]
#[coordinates(x: m)]
#[units(mass: kg, limit: N, first: m / s, then: m / s, at: s, seam: m)]
pub(crate) struct Parcel {
    pub(crate) mass: f64,
    pub(crate) limit: f64,
    pub(crate) first: f64,
    pub(crate) then: f64,
    pub(crate) at: f64,
    pub(crate) seam: f64,
}

#[dynamics]
impl Parcel {
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * self.mass * q.x.dt().powi(2)
    }
    #[nonholonomic(switched, integrable)]
    fn stick(&self, q: &Coordinates<Self>) -> Expr {
        let belt = if q.t < self.at && q.x < self.seam { self.first } else { self.then };
        q.x.dt() - belt
    }
    #[force]
    fn rub(&self, q: &Coordinates<Self>) -> Force {
        Force::along(q.x, -self.limit * q.slip(Self::stick))
    }
    #[event]
    fn grip(&self, q: &Coordinates<Self>) -> Expr {
        self.limit - q.reaction(Self::stick).abs()
    }
    #[event]
    fn passes(&self, q: &Coordinates<Self>) -> Expr {
        q.x - self.seam
    }
}
