use dynamics::prelude::*;

#[derive(Dynamics)]
#[coordinates(x, y, phi, psi)]
struct Model {
    m: f64,
    r: f64,
}

#[dynamics]
impl Model {
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * self.m * (q.x.dt().powi(2) + q.y.dt().powi(2) + q.phi.dt().powi(2) + q.psi.dt().powi(2))
    }

    #[nonholonomic]
    fn roll(&self, q: &Coordinates<Self>) -> Vec2 {
        vec2(q.x, q.y).dt() - self.r * q.phi.dt() * vec2(q.psi.cos(), q.psi.sin())
    }

    #[nonholonomic]
    fn turn(&self, q: &Coordinates<Self>) -> Expr {
        q.psi.dt() - q.t * q.psi
    }
}

fn main() {}
