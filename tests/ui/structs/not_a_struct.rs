use dynamics::prelude::*;

#[derive(Dynamics)]
#[coordinates(x)]
enum Oscillator {
    Light,
    Heavy,
}

#[dynamics]
impl Oscillator {
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * self.m * q.x.dt().powi(2)
    }
}

fn main() {}
