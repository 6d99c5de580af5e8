// A struct of this name hides the type that every function of a model names.
// expect: refused
// model: Coordinates { m: 1.5 }
use dynamics::prelude::*;
#[derive(Clone, Debug, Dynamics)]
#[coordinates(x)]
pub struct Coordinates {
    pub m: f64,
}
#[dynamics]
impl Coordinates {
    #[kinetic]
    fn kinetic(&self, q: &::dynamics::prelude::Coordinates<Self>) -> Expr {
        0.5 * self.m * q.x.dt().powi(2)
    }
    #[potential]
    fn spring(&self, q: &::dynamics::prelude::Coordinates<Self>) -> Expr {
        q.x.powi(2).cos()
    }
}
