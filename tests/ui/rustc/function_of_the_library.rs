use dynamics::prelude::*;

/// Not the library's, which takes Cartesian components.
fn vec2(length: Expr, angle: Expr) -> Vec2 {
    length * Vec2::new(angle.cos(), angle.sin())
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
        0.5 * self.m * vec2(q.r, q.phi).dt().norm_squared()
    }

    #[potential]
    fn weight(&self, q: &Coordinates<Self>) -> Expr {
        self.m * self.g * q.r * q.phi.sin()
    }
}

fn main() {}
