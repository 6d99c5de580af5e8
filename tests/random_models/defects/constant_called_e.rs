// A constant of the module that is called as one of std's was replaced by it.
// expect: either
// model: Rod { m: 1.5 }
use dynamics::prelude::*;
const E: f64 = 2.1;
#[derive(Clone, Debug, Dynamics)]
#[coordinates(x)]
pub struct Rod {
    pub m: f64,
}
#[dynamics]
impl Rod {
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * self.m * q.x.dt().powi(2)
    }
    #[potential]
    fn spring(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * E * q.x.powi(2)
    }
}
