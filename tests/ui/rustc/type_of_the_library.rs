use dynamics::prelude::*;

/// Not the library's, which has other angles.
struct Polar {
    r: Expr,
    theta: Expr,
}

impl Polar {
    fn point(self) -> Vec2 {
        self.r * vec2(self.theta.sin(), self.theta.cos())
    }
}

#[derive(Dynamics)]
#[coordinates(r, phi)]
struct Bead {
    m: f64,
    g: f64,
}

#[dynamics]
impl Bead {
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * self.m * (q.r.dt().powi(2) + (q.r * q.phi.dt()).powi(2))
    }

    #[potential]
    fn weight(&self, q: &Coordinates<Self>) -> Expr {
        let polar = Polar { r: q.r, theta: q.phi };
        self.m * self.g * polar.point().y
    }
}

fn main() {}
