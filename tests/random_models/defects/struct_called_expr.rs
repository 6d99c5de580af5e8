// A struct of this name hides the type that every function of a model names.
// expect: refused
// model: Expr { m: 1.5 }
use dynamics::prelude::*;
#[derive(Clone, Debug, Dynamics)]
#[coordinates(x)]
pub struct Expr {
    pub m: f64,
}
#[dynamics]
impl Expr {
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> ::dynamics::prelude::Expr {
        0.5 * self.m * q.x.dt().powi(2)
    }
    #[potential]
    fn spring(&self, q: &Coordinates<Self>) -> ::dynamics::prelude::Expr {
        q.x.powi(2).cos()
    }
}
