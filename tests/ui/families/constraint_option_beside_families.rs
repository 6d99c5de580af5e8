use dynamics::prelude::*;

#[derive(Dynamics)]
#[coordinates(x: [m; self.links], y: [m; self.links])]
#[units(pitch: m, mass: kg, g: m / s^2)]
struct Chain {
    links: usize,
    pitch: f64,
    mass: f64,
    g: f64,
}

#[dynamics]
impl Chain {
    fn bead(&self, q: &Coordinates<Self>, i: usize) -> Vec2 {
        if i == 0 { vec2(0.0, 0.0) } else { vec2(q.x[i - 1], q.y[i - 1]) }
    }

    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        (1..=self.links).map(|i| 0.5 * self.mass * self.bead(q, i).dt().norm_squared()).sum()
    }

    #[potential]
    fn weight(&self, q: &Coordinates<Self>) -> Expr {
        (0..self.links).map(|i| self.mass * self.g * q.y[i]).sum()
    }

    #[holonomic(switched)]
    fn link(&self, q: &Coordinates<Self>) -> Vec<Expr> {
        (0..self.links).map(|i| (self.bead(q, i + 1) - self.bead(q, i)).norm() - self.pitch).collect()
    }
}

fn main() {}
