// `f32` rounds.
// expect: either
// model: Cart { m: 1.5 }
use dynamics::prelude::*;
#[derive(Clone, Debug, Dynamics)]
#[coordinates(x)]
pub struct Cart {
    pub m: f64,
}
#[dynamics]
impl Cart {
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * self.m * q.x.dt().powi(2)
    }
    #[potential]
    fn spring(&self, q: &Coordinates<Self>) -> Expr {
        f64::from(0.1f32) * q.x.powi(2)
    }
}
