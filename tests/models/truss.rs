//! Von Mises' truss, whose limit load has a closed form.

use dynamics::prelude::*;

/// Two bars to an apex that a load presses down; R. von Mises, ZAMM 3 (1923) 406.
#[derive(Clone, Debug, Dynamics)]
#[coordinates(z: m)]
#[units(m: kg, stiffness: N, half_span: m, height: m, load: N)]
pub(crate) struct Truss {
    pub(crate) m: f64,
    pub(crate) stiffness: f64,
    pub(crate) half_span: f64,
    pub(crate) height: f64,
    pub(crate) load: f64,
}
#[dynamics]
impl Truss {
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * self.m * q.z.dt().powi(2)
    }
    #[potential]
    fn bars(&self, q: &Coordinates<Self>) -> Expr {
        let free = (self.half_span.powi(2) + self.height.powi(2)).sqrt();
        let length = (q.z.powi(2) + self.half_span.powi(2)).sqrt();
        self.stiffness / free * (length - free).powi(2)
    }
    #[force]
    fn load(&self, q: &Coordinates<Self>) -> Force {
        Force::along(q.z, -self.load)
    }
}
pub(crate) const TRUSS: Truss = Truss { m: 1.0, stiffness: 1.0, half_span: 1.0, height: 0.5, load: 0.0 };
/// Limit load and height, to 30 digits.
pub(crate) const LIMIT: [f64; 2] = [0.038_383_739_817_434_71, 0.277_880_091_075_164_76];
