use dynamics::prelude::*;

#[derive(Dynamics)]
#[coordinates(x, y, z)]
struct Model {
    m: f64,
    k: f64,
}

#[dynamics]
impl Model {
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * self.m * (q.x.dt().powi(2) + q.y.dt().powi(2) + q.z.dt().powi(2))
    }

    #[holonomic]
    fn first(&self, q: &Coordinates<Self>) -> Expr {
        q.x + q.y
    }

    #[holonomic]
    fn second(&self, q: &Coordinates<Self>) -> Expr {
        q.y + q.z
    }

    #[holonomic]
    fn third(&self, q: &Coordinates<Self>) -> Expr {
        self.k * (q.x - q.z)
    }
}

fn main() {}
