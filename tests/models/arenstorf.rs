//! The restricted three-body problem. Tests and benchmarks include this file.

use dynamics::prelude::*;

/// Arenstorf's orbit in the frame that turns with earth and moon (Hairer, Nørsett, Wanner, *Solving ODE I*,
/// p. 129).
#[derive(Clone, Debug, Dynamics)]
#[coordinates(x, y)]
pub(crate) struct Arenstorf {
    pub(crate) mu: f64,
}

#[dynamics]
impl Arenstorf {
    #[lagrangian]
    fn lagrangian(&self, q: &Coordinates<Self>) -> Expr {
        let velocity = vec2(q.x.dt() - q.y, q.y.dt() + q.x);
        let earth = (q.x + self.mu).hypot(q.y);
        let moon = (q.x - (1.0 - self.mu)).hypot(q.y);
        0.5 * velocity.norm_squared() + (1.0 - self.mu) / earth + self.mu / moon
    }
}
