//! Kepler's problem. Tests and benchmarks include this file.

use dynamics::prelude::*;

/// Two bodies that attract each other: the motion of one about the other (Hairer, Lubich, Wanner, *Geometric
/// Numerical Integration*, §I.2).
#[derive(Clone, Debug, Dynamics)]
#[coordinates(x, y)]
pub(crate) struct Kepler {
    pub(crate) mu: f64,
}

#[dynamics]
impl Kepler {
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * vec2(q.x, q.y).dt().norm_squared()
    }
    #[potential]
    fn gravitation(&self, q: &Coordinates<Self>) -> Expr {
        -self.mu / vec2(q.x, q.y).norm()
    }
}
