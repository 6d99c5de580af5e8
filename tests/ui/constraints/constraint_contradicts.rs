use dynamics::prelude::*;

#[derive(Dynamics)]
#[coordinates(x, y)]
struct Model {
    m: f64,
    left: f64,
    right: f64,
}

#[dynamics]
impl Model {
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * self.m * (q.x.dt().powi(2) + q.y.dt().powi(2))
    }

    #[holonomic]
    fn floor(&self, q: &Coordinates<Self>) -> Expr {
        q.y - self.left
    }

    #[holonomic]
    fn ceiling(&self, q: &Coordinates<Self>) -> Expr {
        q.y - self.right
    }
}

fn main() {}
