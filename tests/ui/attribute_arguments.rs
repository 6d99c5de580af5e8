use dynamics::prelude::*;

#[derive(Dynamics)]
#[coordinates(x)]
struct Oscillator {
    m: f64,
}

#[dynamics(fast)]
impl Oscillator {
    fn position(&self, q: &Coordinates<Self>) -> Expr {
        q.x
    }
}

fn main() {}
