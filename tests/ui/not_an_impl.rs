use dynamics::prelude::*;

#[derive(Dynamics)]
#[coordinates(x)]
struct Oscillator {
    m: f64,
}

#[dynamics]
fn kinetic(m: f64) -> f64 {
    m
}

fn main() {}
