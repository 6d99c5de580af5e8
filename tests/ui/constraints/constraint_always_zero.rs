use dynamics::prelude::*;

#[derive(Dynamics)]
#[coordinates(x, y)]
struct Model {
    m: f64,
    l: f64,
}

#[dynamics]
impl Model {
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * self.m * (q.x.dt().powi(2) + q.y.dt().powi(2))
    }

    #[holonomic]
    fn rod(&self, q: &Coordinates<Self>) -> Vec2 {
        let turned = vec2(q.x.cos(), q.x.sin());
        vec2(q.y - self.l, turned.norm_squared() - 1.0)
    }
}

fn main() {}
