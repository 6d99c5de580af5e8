use dynamics::prelude::*;

#[derive(Dynamics)]
#[coordinates(x, y)]
struct Ramp {
    m: f64,
    k: f64,
}

#[dynamics]
impl Ramp {
    fn place(&self, q: &Coordinates<Self>) -> Vec2 {
        vec2(q.x, q.y + 0.5 * q.x.abs())
    }

    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * self.m * self.place(q).dt().norm_squared()
    }

    #[potential]
    fn potential(&self, q: &Coordinates<Self>) -> Expr {
        self.k * q.x * q.y
    }
}

fn main() {}
