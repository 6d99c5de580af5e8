use dynamics::prelude::*;

#[derive(Dynamics)]
#[coordinates(x, y)]
struct Pendulum {
    m: f64,
    g: f64,
    l: f64,
}

#[dynamics]
impl Pendulum {
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * self.m * (q.x.dt().powi(2) + q.y.dt().powi(2))
    }

    #[potential]
    fn gravity(&self, q: &Coordinates<Self>) -> Expr {
        self.m * self.g * q.y
    }

    #[holonomic(integrable)]
    fn rod(&self, q: &Coordinates<Self>) -> Expr {
        q.x.powi(2) + q.y.powi(2) - self.l.powi(2)
    }
}

fn main() {}
