// A struct of this name was refused where the type is named by its path.
// expect: runs
// model: Force { m: 1.5 }
use dynamics::prelude::*;
#[derive(Clone, Debug, Dynamics)]
#[coordinates(x)]
pub struct Force {
    pub m: f64,
}
#[dynamics]
impl Force {
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * self.m * q.x.dt().powi(2)
    }
    #[potential]
    fn spring(&self, q: &Coordinates<Self>) -> Expr {
        q.x.powi(2).cos()
    }
    #[force]
    fn drag(&self, q: &Coordinates<Self>) -> ::dynamics::prelude::Force {
        ::dynamics::prelude::Force::along(q.x, -0.3 * q.x.dt() * q.x.dt().abs())
    }
}
