use dynamics::prelude::*;

#[derive(Dynamics)]
#[coordinates(x)]
struct Mass {
    m: f64,
}

#[dynamics]
impl Mass {
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * self.m * q.x.dt().powi(2)
    }
}

#[derive(Dynamics)]
#[coordinates(x, y)]
struct Mass {
    m: f64,
}

#[dynamics]
impl Mass {
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * self.m * (q.x.dt().powi(2) + q.y.dt().powi(2))
    }
}

fn main() {}
