use dynamics::prelude::*;

/// A mistake of units, one of roles and one of form, each in a function of its own.
#[derive(Dynamics)]
#[coordinates(x: m, y: m)]
#[units(m: kg, l: m, g: m / s^2)]
struct Model {
    m: f64,
    l: f64,
    g: f64,
}

#[dynamics]
impl Model {
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * self.m * vec2(q.x, q.y).dt().norm_squared()
    }

    #[potential]
    fn gravity(&self, q: &Coordinates<Self>) -> Expr {
        self.m * self.g * q.y
    }

    #[holonomic]
    fn rod(&self, q: &Coordinates<Self>) -> Expr {
        vec2(q.x, q.y).norm_squared() - self.l
    }

    #[holonomic]
    fn still(&self, q: &Coordinates<Self>) -> Expr {
        q.x.dt()
    }

    #[nonholonomic]
    fn governed(&self, q: &Coordinates<Self>) -> Expr {
        q.x.dt() * q.y.dt()
    }
}

fn main() {}
