use dynamics::prelude::*;

/// A bead between two others on one line.
#[derive(Dynamics)]
#[coordinates(x: [_; 2], y: [_; 2])]
struct Model {
    m: f64,
    l: f64,
}

#[dynamics]
impl Model {
    fn bead(&self, q: &Coordinates<Self>, i: usize) -> Vec2 {
        vec2(q.x[i], q.y[i])
    }

    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * self.m * (self.bead(q, 0).dt().norm_squared() + self.bead(q, 1).dt().norm_squared())
    }

    #[holonomic]
    fn near(&self, q: &Coordinates<Self>) -> [Expr; 2] {
        [
            self.bead(q, 0).norm_squared() - self.l.powi(2),
            (self.bead(q, 1) - self.bead(q, 0)).norm_squared() - self.l.powi(2),
        ]
    }

    #[holonomic]
    fn far(&self, q: &Coordinates<Self>) -> Expr {
        self.bead(q, 1).norm_squared() - (2.0 * self.l).powi(2)
    }
}

fn main() {}
