//! Generalized speeds.

mod models;

use dynamics::prelude::*;
use models::*;

#[test]
fn first() {
    println!("{}", Top::REPORT);
    println!("{}", TopInAngles::REPORT);
    let top = Top { a: 1.0, b: 2.0, c: 2.5, weight: 0.0, height: 1.0 };
    let s = top.state().phi(0.3).theta(1.0).psi(0.2).omega([1.0, 2.0, 3.0]).build().unwrap();
    println!("{s:?}");
    println!("{}", Top::LISTING.split("mass_matrix").next().unwrap());
}
