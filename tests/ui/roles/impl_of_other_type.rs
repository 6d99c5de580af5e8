use dynamics::prelude::*;

#[dynamics]
impl [f64] {
    fn kinetic(&self) -> f64 {
        0.0
    }
}

fn main() {}
