// A path that ends as one of std's was taken for it.
// expect: either
// model: Rod { m: 1.5 }
use dynamics::prelude::*;
mod consts {
    pub const PI: f64 = 3.0;
}
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
        0.5 * consts::PI * q.x.powi(2)
    }
}
