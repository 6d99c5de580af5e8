use dynamics::prelude::*;

#[derive(Dynamics)]
#[coordinates(x)]
struct Oscillator {
    m: f64,
}

#[dynamics]
impl [Oscillator] {
    fn position(&self) -> f64 {
        0.0
    }
}

fn main() {}
