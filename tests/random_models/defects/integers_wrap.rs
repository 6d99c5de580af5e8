// `as u8` wraps, and `f32` rounds.
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
        let mut sum = Expr::ZERO;
        for i in 254..258 {
            sum += ((i as u8) as f64) * q.x.powi(2);
        }
        sum
    }
}
