use dynamics::prelude::*;

#[derive(Dynamics)]
#[coordinates(x, y)]
struct Pendulum {
    m: f64,
    l: f64,
}

#[dynamics]
impl Pendulum {
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * self.m * (q.x.dt().powi(2) + q.y.dt().powi(2))
    }

    #[holonomic]
    fn rod(&self, q: &Coordinates<Self>) -> Expr {
        q.x.powi(2) + q.y.powi(2) - self.l.powi(2)
    }

    fn bob(&self, q: &Coordinates<Self>) -> Vec2 {
        vec2(q.x, q.y)
    }

    #[drawing]
    fn drawing(&self, q: &Coordinates<Self>) -> Drawing {
        let along = q.reaction(Self::rod) * self.bob(q);
        Drawing::new().dot(self.bob(q)).dot(along + q.reaction(Self::bob))
    }
}

fn main() {}
