use dynamics::prelude::*;

#[derive(Dynamics)]
#[coordinates(x, y)]
#[nominal(k = [1.0, 2.0, 3.0])]
struct Oscillator {
    m: f64,
    k: [f64; 2],
}

#[dynamics]
impl Oscillator {
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * self.m * (q.x.dt().powi(2) + q.y.dt().powi(2))
    }

    #[potential]
    fn potential(&self, q: &Coordinates<Self>) -> Expr {
        self.k[0] * q.x * q.y + self.k[1] * q.x
    }
}

fn main() {}
