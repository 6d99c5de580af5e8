// A helper called as a function of a trait: the model itself was taken for what it returns.
// expect: runs
// model: Cart { m: 1.5 }
use dynamics::prelude::*;
#[derive(Clone, Debug, Dynamics)]
#[coordinates(x)]
pub struct Cart {
    pub m: f64,
}
#[dynamics]
impl Cart {
    fn clone(&self) -> Vec2 {
        vec2(self.m, 0.3)
    }
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * self.m * q.x.dt().powi(2)
    }
    #[potential]
    fn spring(&self, q: &Coordinates<Self>) -> Expr {
        self.clone().dot(vec2(q.x, q.x.powi(2))).cos()
    }
}
