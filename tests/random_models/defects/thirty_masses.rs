// Undamped, constant mass matrix, more than 20 coordinates: a matrix that is all zero.
// expect: runs
// model: Chain { m: 1.5, k: 2.0 }
use dynamics::prelude::*;
#[derive(Clone, Debug, Dynamics)]
#[coordinates(x: [_; 30])]
pub struct Chain {
    pub m: f64,
    pub k: f64,
}
#[dynamics]
impl Chain {
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        let mut sum = Expr::ZERO;
        for i in 0..30 {
            sum += 0.5 * self.m * q.x[i].dt().powi(2);
        }
        sum
    }
    #[potential]
    fn springs(&self, q: &Coordinates<Self>) -> Expr {
        let mut sum = 0.5 * self.k * (q.x[0].powi(2) + q.x[29].powi(2));
        for i in 1..30 {
            sum += 0.5 * self.k * (q.x[i] - q.x[i - 1]).powi(2);
        }
        sum
    }
}
