// Variables of generated code cannot be called as statics of the module.
// expect: runs
// model: Swing { m: 1.5 }
#![allow(dead_code, non_upper_case_globals)]
use dynamics::prelude::*;
static v0: f64 = 1.0;
static v2: f64 = 1.0;
const x: f64 = 1.0;
#[derive(Clone, Debug, Dynamics)]
#[coordinates(phi, y)]
pub struct Swing {
    pub m: f64,
}
#[dynamics]
impl Swing {
    fn place(&self, q: &Coordinates<Self>) -> Vec2 {
        vec2(q.phi.sin() + q.y, q.phi.cos())
    }
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * self.m * self.place(q).dt().norm_squared() + q.phi.dt().powi(2)
    }
    #[potential]
    fn weight(&self, q: &Coordinates<Self>) -> Expr {
        self.m * self.place(q).y
    }
}
