use dynamics::prelude::*;

#[derive(Dynamics)]
#[coordinates(x, theta)]
struct Model {
    m: f64,
    r: f64,
}

#[dynamics]
impl Model {
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * self.m * (q.x.dt().powi(2) + q.theta.dt().powi(2))
    }

    #[nonholonomic]
    fn roll(&self, q: &Coordinates<Self>) -> Expr {
        q.x.dt() - self.r * q.theta.dt()
    }
}

fn main() {}
