// A constant of the block that is called as one of std's.
// expect: runs
// model: Rod { m: 1.5 }
use dynamics::prelude::*;
#[derive(Clone, Debug, Dynamics)]
#[coordinates(x)]
pub struct Rod {
    pub m: f64,
}
#[dynamics]
impl Rod {
    const TAU: f64 = 2.5;
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * self.m * q.x.dt().powi(2)
    }
    #[potential]
    fn spring(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * Self::TAU * q.x.powi(2)
    }
}
