// A struct of this name was refused where the type is named by its path.
// expect: runs
// model: Drawing { m: 1.5 }
use dynamics::prelude::*;
#[derive(Clone, Debug, Dynamics)]
#[coordinates(x)]
pub struct Drawing {
    pub m: f64,
}
#[dynamics]
impl Drawing {
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * self.m * q.x.dt().powi(2)
    }
    #[potential]
    fn spring(&self, q: &Coordinates<Self>) -> Expr {
        q.x.powi(2).cos()
    }
    #[drawing]
    fn picture(&self, q: &Coordinates<Self>) -> ::dynamics::prelude::Drawing {
        ::dynamics::prelude::Drawing::new().line(vec2(q.x, 0.5), vec2(0.0, 1.0))
    }
}
