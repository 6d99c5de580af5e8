//! Small models that rest, or only just.

use dynamics::prelude::*;

/// Three masses in a row, with springs to the ground and between them.
#[derive(Clone, Debug, Dynamics)]
#[coordinates(x: [m; 3])]
#[units(m: kg, ground: N / m, between: N / m, damper: N * s / m)]
pub(crate) struct Masses {
    pub(crate) m: f64,
    pub(crate) ground: [f64; 3],
    pub(crate) between: [f64; 2],
    /// Of the first.
    pub(crate) damper: f64,
}
#[dynamics]
impl Masses {
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * self.m * (q.x[0].dt().powi(2) + q.x[1].dt().powi(2) + q.x[2].dt().powi(2))
    }
    #[potential]
    fn springs(&self, q: &Coordinates<Self>) -> Expr {
        let mut sum = Expr::ZERO;
        for i in 0..3 {
            sum += 0.5 * self.ground[i] * q.x[i].powi(2);
        }
        for i in 0..2 {
            sum += 0.5 * self.between[i] * (q.x[i + 1] - q.x[i]).powi(2);
        }
        sum
    }
    #[dissipation]
    fn damper(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * self.damper * q.x[0].dt().powi(2)
    }
}

/// fading · tanh x + slope · |x|.
#[derive(Clone, Debug, Dynamics)]
#[coordinates(x)]
pub(crate) struct Shape {
    pub(crate) fading: f64,
    pub(crate) slope: f64,
}
#[dynamics]
impl Shape {
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * q.x.dt().powi(2)
    }
    #[potential]
    fn shape(&self, q: &Coordinates<Self>) -> Expr {
        self.fading * q.x.tanh() + self.slope * q.x.abs()
    }
}
