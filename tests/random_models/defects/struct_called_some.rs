// A struct of this name hid what generated code meant.
// expect: runs
// model: Some { m: 1.5 }
use dynamics::prelude::*;
#[derive(Clone, Debug, Dynamics)]
#[coordinates(x)]
pub struct Some {
    pub m: f64,
}
#[dynamics]
impl Some {
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * self.m * q.x.dt().powi(2)
    }
    #[potential]
    fn spring(&self, q: &Coordinates<Self>) -> Expr {
        q.x.powi(2).cos()
    }
}
