use dynamics::prelude::*;

#[derive(Dynamics)]
#[coordinates(x, y, theta1, theta2)]
struct Oscillator {
    m: f64,
    k: f64,
}

#[dynamics]
impl Oscillator {
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * self.m * (q.x.dt().powi(2) + q.y.dt().powi(2) + q.theta1.dt().powi(2) + q.theta2.dt().powi(2))
    }

    #[potential]
    fn potential(&self, q: &Coordinates<Self>) -> Expr {
        self.k * q.theta1 * q.teta2
    }
}

fn main() {}
