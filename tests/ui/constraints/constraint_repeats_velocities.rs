use dynamics::prelude::*;

#[derive(Dynamics)]
#[coordinates(x, y)]
struct Model {
    m: f64,
    l: f64,
}

#[dynamics]
impl Model {
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * self.m * (q.x.dt().powi(2) + q.y.dt().powi(2))
    }

    #[holonomic]
    fn rod(&self, q: &Coordinates<Self>) -> Expr {
        q.x.powi(2) + q.y.powi(2) - self.l.powi(2)
    }

    #[nonholonomic]
    fn turning(&self, q: &Coordinates<Self>) -> Expr {
        q.x * q.x.dt() + q.y * q.y.dt()
    }
}

fn main() {}
