use dynamics::prelude::*;

#[derive(Dynamics)]
#[coordinates(x)]
struct Oscillator {
    m: f64,
}

#[dynamics(fast)]
impl Oscillator {
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * self.m * q.x.dt().powi(2)
    }
}

fn main() {}
