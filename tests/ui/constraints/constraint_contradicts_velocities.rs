use dynamics::prelude::*;

#[derive(Dynamics)]
#[coordinates(x, y)]
struct Model {
    m: f64,
    v: f64,
}

#[dynamics]
impl Model {
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * self.m * (q.x.dt().powi(2) + q.y.dt().powi(2))
    }

    #[nonholonomic]
    fn belt(&self, q: &Coordinates<Self>) -> Expr {
        q.x.dt() - self.v * q.y
    }

    #[nonholonomic]
    fn brake(&self, q: &Coordinates<Self>) -> Expr {
        q.x.dt()
    }
}

fn main() {}
