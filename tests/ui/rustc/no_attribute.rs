use dynamics::prelude::*;

#[derive(Dynamics)]
#[coordinates(x: m)]
struct Falling {
    m: f64,
    g: f64,
}

impl Falling {
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * self.m * q.x.dt().powi(2)
    }
    #[potential]
    fn gravity(&self, q: &Coordinates<Self>) -> Expr {
        self.m * self.g * q.x
    }
}

fn main() {}
