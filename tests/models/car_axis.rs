//! The car axis: a moving constraint and a small mass; Schneider, Test Set for IVP Solvers (Mazzia, Magherini
//! & Iavernaro). The tests and the example of error against cost include this file.

use dynamics::prelude::*;

/// A bar between two springs that follow a bumpy road: the right wheel at (x_b, y_b) goes up and down, the
/// left one stays at (0, 0).
#[derive(Clone, Debug, Dynamics)]
#[coordinates(xl, yl, xr, yr)]
pub(crate) struct CarAxis {
    /// M ε²/2.
    pub(crate) mass: f64,
    pub(crate) length: f64,
    pub(crate) rest: f64,
    pub(crate) bump: f64,
    pub(crate) frequency: f64,
    pub(crate) g: f64,
}

#[dynamics]
impl CarAxis {
    fn left(&self, q: &Coordinates<Self>) -> Vec2 {
        vec2(q.xl, q.yl)
    }
    fn right(&self, q: &Coordinates<Self>) -> Vec2 {
        vec2(q.xr, q.yr)
    }
    fn wheel(&self, q: &Coordinates<Self>) -> Vec2 {
        let y = self.bump * (self.frequency * q.t).sin();
        vec2((self.length.powi(2) - y * y).sqrt(), y)
    }
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * self.mass * (self.left(q).dt().norm_squared() + self.right(q).dt().norm_squared())
    }
    #[potential]
    fn springs(&self, q: &Coordinates<Self>) -> Expr {
        let (left, right) = (self.left(q).norm(), (self.right(q) - self.wheel(q)).norm());
        0.5 * ((left - self.rest).powi(2) + (right - self.rest).powi(2))
    }
    #[potential]
    fn gravity(&self, q: &Coordinates<Self>) -> Expr {
        self.mass * self.g * (q.yl + q.yr)
    }
    /// The left spring stays at right angles to the road.
    #[holonomic]
    fn upright(&self, q: &Coordinates<Self>) -> Expr {
        self.left(q).dot(self.wheel(q))
    }
    #[holonomic]
    fn bar(&self, q: &Coordinates<Self>) -> Expr {
        (self.left(q) - self.right(q)).norm_squared() - self.length.powi(2)
    }
}

/// The published parameters.
pub(crate) fn model() -> CarAxis {
    let eps: f64 = 1e-2;
    CarAxis { mass: 10.0 * eps * eps / 2.0, length: 1.0, rest: 0.5, bump: 0.1, frequency: 10.0, g: 1.0 }
}

/// The published start.
pub(crate) fn start(model: &CarAxis) -> State<CarAxis> {
    model
        .state()
        .yl(0.5)
        .xr(1.0)
        .yr(0.5)
        .xl_rate(-0.5)
        .xr_rate(-0.5)
        .build()
        .expect("it fulfils the constraints")
}
