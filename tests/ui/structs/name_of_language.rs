use dynamics::prelude::*;

#[derive(Dynamics)]
#[coordinates(x: m)]
struct Expr {
    m: f64,
    k: f64,
}

#[dynamics]
impl Expr {
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * self.m * q.x.dt().powi(2)
    }

    #[potential]
    fn potential(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * self.k * q.x.powi(2)
    }
}

fn main() {}
