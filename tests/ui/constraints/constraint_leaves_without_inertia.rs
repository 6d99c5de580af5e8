use dynamics::prelude::*;

#[derive(Dynamics)]
#[coordinates(x, y, z)]
struct Model {
    m: f64,
}

#[dynamics]
impl Model {
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * self.m * (q.x.dt().powi(2))
    }

    #[potential]
    fn spring(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * (q.y - q.x).powi(2)
    }

    #[holonomic]
    fn rod(&self, q: &Coordinates<Self>) -> Expr {
        q.z - q.x.sin()
    }
}

fn main() {}
