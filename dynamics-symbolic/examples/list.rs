#[path = "../tests/common/mod.rs"]
mod common;
use common::mechanisms::*;
use dynamics_symbolic::compile::compile;
fn main() {
    let m = andrews();
    let p = m.parameters.clone();
    let mut model = m.closed();
    model.nominal = p.iter().enumerate().map(|(i, x)| (i as u32, *x)).collect();
    let c = compile(model).unwrap();
    println!("{}", c.listing);
}
