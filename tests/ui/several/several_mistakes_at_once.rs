use dynamics::prelude::*;

#[derive(Dynamics)]
#[coordinates(x, y)]
struct Oscillator {
    m: f64,
    k: f64,
}

#[dynamics]
impl Oscillator {
    #[output]
    fn speed(&self, q: &Coordinates<Self>) -> Expr {
        vec2(q.x, q.y).dt().length()
    }

    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * self.m * (q.x.dt().powi(2) + q.y.dt().powi(2))
    }

    #[potential]
    fn potential(&self, q: &Coordinates<Self>) -> Expr {
        self.k * q.x * q.z + self.stiffnes * (-1.0_f64).sqrt()
    }
}

fn main() {}
