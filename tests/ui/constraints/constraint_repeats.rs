use dynamics::prelude::*;

#[derive(Dynamics)]
#[coordinates(x, y, z, w)]
struct Model {
    m: f64,
    l: f64,
}

#[dynamics]
impl Model {
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * self.m * (q.x.dt().powi(2) + q.y.dt().powi(2) + q.z.dt().powi(2) + q.w.dt().powi(2))
    }

    #[holonomic]
    fn pin(&self, q: &Coordinates<Self>) -> [Expr; 3] {
        [q.x - self.l, q.x + q.y, q.x - q.z]
    }

    #[holonomic]
    fn closure(&self, q: &Coordinates<Self>) -> [Expr; 2] {
        [q.w - q.x.sin(), q.z - self.l]
    }
}

fn main() {}
