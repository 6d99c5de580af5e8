use dynamics::prelude::*;

#[dynamics]
fn kinetic(m: f64) -> f64 {
    m
}

fn main() {}
