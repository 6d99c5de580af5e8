use dynamics::prelude::*;

#[derive(Dynamics)]
#[coordinates(x: m)]
struct Falling {
    m: f64,
    g: f64,
}

fn main() {
    let start = Falling { m: 1.0, g: 9.81 }.state().x(1.0).build();
    println!("{start:?}");
}
