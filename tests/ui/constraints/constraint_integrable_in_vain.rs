use dynamics::prelude::*;

#[derive(Dynamics)]
#[coordinates(x, y, psi)]
struct Model {
    m: f64,
}

#[dynamics]
impl Model {
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * self.m * (q.x.dt().powi(2) + q.y.dt().powi(2) + q.psi.dt().powi(2))
    }

    #[nonholonomic(integrable)]
    fn skate(&self, q: &Coordinates<Self>) -> Expr {
        q.x.dt() * q.psi.sin() - q.y.dt() * q.psi.cos()
    }
}

fn main() {}
