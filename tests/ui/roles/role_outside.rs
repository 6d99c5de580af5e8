use dynamics::prelude::*;

#[kinetic]
fn kinetic(v: Expr) -> Expr {
    0.5 * v.powi(2)
}

fn main() {
    println!("{:?}", kinetic(Expr::ZERO).value());
}
