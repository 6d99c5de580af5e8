//! A mass on a spring whose parameters have the names of the textbook, some of which are keywords of Python.

use dynamics::prelude::*;

/// A mass on a spring that rests at a stretch `lambda` of its length.
#[derive(Clone, Debug, Dynamics)]
#[coordinates(x: m)]
#[inputs(from: N)]
#[units(mass: kg, stiffness: N / m, length: m)]
pub struct Spring {
    pub mass: f64,
    pub stiffness: f64,
    pub length: f64,
    /// Stretch at rest: the spring is in equilibrium at `lambda` times its length.
    pub lambda: f64,
    /// Grade of its wire: a multiple of the stiffness.
    pub r#type: f64,
}

#[dynamics]
impl Spring {
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * self.mass * q.x.dt().powi(2)
    }
    #[potential]
    fn spring(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * self.stiffness * self.r#type * (q.x - self.lambda * self.length).powi(2)
    }
    #[force]
    fn push(&self, q: &Coordinates<Self>) -> Force {
        Force::along(q.x, q.from)
    }
}
