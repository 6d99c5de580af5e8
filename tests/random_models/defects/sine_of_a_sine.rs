// Angles that are results of their own batch of sines and cosines.
// expect: runs
// model: Arm { m: 1.5, l: 1.2, omega: 0.7 }
use dynamics::prelude::*;
#[derive(Clone, Debug, Dynamics)]
#[coordinates(x)]
pub struct Arm {
    pub m: f64,
    pub l: f64,
    pub omega: f64,
}
#[dynamics]
impl Arm {
    fn place(&self, q: &Coordinates<Self>) -> Vec2 {
        let angle = (self.omega * q.t).sin();
        (self.l + q.x) * vec2(angle.sin(), -angle.cos())
    }
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * self.m * self.place(q).dt().norm_squared()
    }
    #[potential]
    fn spring(&self, q: &Coordinates<Self>) -> Expr {
        q.x.sin().sin()
    }
}
