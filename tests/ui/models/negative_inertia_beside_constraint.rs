use dynamics::prelude::*;

#[derive(Clone, Debug, Dynamics)]
#[coordinates(x: m, y: m)]
#[units(m: kg, l: m, g: m / s^2)]
struct Pendulum {
    m: f64,
    l: f64,
    g: f64,
}

#[dynamics]
impl Pendulum {
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        -0.5 * self.m * vec2(q.x, q.y).dt().norm_squared()
    }
    #[potential]
    fn weight(&self, q: &Coordinates<Self>) -> Expr {
        self.m * self.g * q.y
    }
    #[holonomic]
    fn rod(&self, q: &Coordinates<Self>) -> Expr {
        vec2(q.x, q.y).norm() - self.l
    }
}

fn main() {}
