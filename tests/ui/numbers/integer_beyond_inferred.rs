use dynamics::prelude::*;

#[derive(Dynamics)]
#[coordinates(x, y)]
struct Oscillator {
    m: f64,
    k: f64,
}

#[dynamics]
impl Oscillator {
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * self.m * (q.x.dt().powi(2) + q.y.dt().powi(2))
    }

    #[potential]
    fn potential(&self, q: &Coordinates<Self>) -> Expr {
        let stiffnesses = [self.k, 2.0 * self.k];
        let mut sum = Expr::ZERO;
        for i in 0..2 {
            sum += stiffnesses[i] * (i - 1) as f64 * q.x * q.y;
        }
        sum
    }
}

fn main() {}
