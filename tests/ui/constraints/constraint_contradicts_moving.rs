use dynamics::prelude::*;

#[derive(Dynamics)]
#[coordinates(x, y)]
struct Model {
    m: f64,
}

#[dynamics]
impl Model {
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * self.m * (q.x.dt().powi(2) + q.y.dt().powi(2))
    }

    #[holonomic]
    fn belt(&self, q: &Coordinates<Self>) -> Expr {
        q.x + q.y - q.t.sin()
    }

    #[holonomic]
    fn stop(&self, q: &Coordinates<Self>) -> Expr {
        2.0 * (q.x + q.y)
    }
}

fn main() {}
