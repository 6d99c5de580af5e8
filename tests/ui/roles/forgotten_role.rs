use dynamics::prelude::*;

#[derive(Dynamics)]
#[coordinates(x: m)]
#[units(m: kg, k: N / m, length: m)]
pub struct Oscillator {
    pub m: f64,
    pub k: f64,
    pub length: f64,
}

#[dynamics]
impl Oscillator {
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * self.m * q.x.dt().powi(2)
    }

    pub fn spring(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * self.k * (q.x - self.length).powi(2)
    }
}

fn main() {}
