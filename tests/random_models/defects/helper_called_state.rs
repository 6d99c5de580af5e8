// Every model has a function `state` already.
// expect: refused
// model: Cart { m: 1.5 }
use dynamics::prelude::*;
#[derive(Clone, Debug, Dynamics)]
#[coordinates(x)]
pub struct Cart {
    pub m: f64,
}
#[dynamics]
impl Cart {
    fn state(&self, q: &Coordinates<Self>) -> Expr {
        q.x.sin()
    }
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * self.m * q.x.dt().powi(2)
    }
    #[potential]
    fn spring(&self, q: &Coordinates<Self>) -> Expr {
        self.state(q)
    }
}
