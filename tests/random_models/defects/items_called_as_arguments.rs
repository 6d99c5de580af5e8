// Constants, statics and unit structs called as what generated code binds.
// expect: runs
// model: Cart { m: 1.5 }
#![allow(dead_code, nonstandard_style)]
use dynamics::prelude::*;
const inputs: f64 = 1.0;
const values: f64 = 1.0;
const u: f64 = 1.0;
static state: f64 = 1.0;
static name: f64 = 1.0;
struct model;
struct constants;
#[derive(Clone, Debug, Dynamics)]
#[coordinates(x)]
pub struct Cart {
    pub m: f64,
}
#[dynamics]
impl Cart {
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * self.m * q.x.dt().powi(2)
    }
    #[potential]
    fn spring(&self, q: &Coordinates<Self>) -> Expr {
        q.x.powi(2).cos()
    }
    #[output]
    fn seen(&self, q: &Coordinates<Self>) -> Vec2 {
        vec2(q.x.dt().dt(), q.t)
    }
}
