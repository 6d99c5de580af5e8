use dynamics::prelude::*;

#[derive(Dynamics)]
#[coordinates(x, y)]
struct Oscillator {
    m: f64,
}

#[dynamics]
impl Oscillator {
    #[output]
    fn ratio(&self, q: &Coordinates<Self>) -> Expr {
        q.x / q.y.dt().dt()
    }

    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * self.m * (q.x.dt().powi(2) + q.y.dt().powi(2))
    }
}

fn main() {}
