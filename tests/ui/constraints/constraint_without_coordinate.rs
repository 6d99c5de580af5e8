use dynamics::prelude::*;

#[derive(Dynamics)]
#[coordinates(x, y)]
struct Model {
    m: f64,
    l: f64,
    d: f64,
}

#[dynamics]
impl Model {
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * self.m * (q.x.dt().powi(2) + q.y.dt().powi(2))
    }

    #[holonomic]
    fn length(&self, q: &Coordinates<Self>) -> Expr {
        self.l - self.d * q.t
    }
}

fn main() {}
