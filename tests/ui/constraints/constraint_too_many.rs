use dynamics::prelude::*;

#[derive(Dynamics)]
#[coordinates(x)]
struct Model {
    m: f64,
    a: f64,
    b: f64,
}

#[dynamics]
impl Model {
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * self.m * (q.x.dt().powi(2))
    }

    #[holonomic]
    fn stop(&self, q: &Coordinates<Self>) -> Expr {
        q.x - self.a
    }

    #[holonomic]
    fn spring(&self, q: &Coordinates<Self>) -> Expr {
        q.x.powi(3) - self.b
    }
}

fn main() {}
