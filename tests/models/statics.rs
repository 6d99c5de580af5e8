//! Small models that rest, or only just.

use dynamics::prelude::*;

/// Two bars under a load; R. von Mises, ZAMM 3 (1923) 406.
#[derive(Clone, Debug, Dynamics)]
#[coordinates(z: m)]
#[units(m: kg, stiffness: N, half_span: m, height: m, load: N)]
pub(crate) struct Truss {
    pub(crate) m: f64,
    pub(crate) stiffness: f64,
    pub(crate) half_span: f64,
    pub(crate) height: f64,
    pub(crate) load: f64,
}
#[dynamics]
impl Truss {
    fn free(&self) -> f64 {
        (self.half_span.powi(2) + self.height.powi(2)).sqrt()
    }
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * self.m * q.z.dt().powi(2)
    }
    #[potential]
    fn bars(&self, q: &Coordinates<Self>) -> Expr {
        self.stiffness / self.free() * (vec2(self.half_span, q.z).norm() - self.free()).powi(2)
    }
    #[force]
    fn load(&self, q: &Coordinates<Self>) -> Force {
        Force::along(q.z, -self.load)
    }
}

/// A top that stands on its tip, in angles that are regular there.
#[derive(Clone, Debug, Dynamics)]
#[coordinates(a: rad, b: rad, spin: rad)]
#[units(across: kg * m^2, along: kg * m^2, weight: N * m)]
pub(crate) struct Top {
    pub(crate) across: f64,
    pub(crate) along: f64,
    pub(crate) weight: f64,
}
#[dynamics]
impl Top {
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        let (da, db) = (q.a.dt() * q.b.cos(), q.b.dt());
        let turn = q.spin.dt() + q.a.dt() * q.b.sin();
        0.5 * self.across * (da.powi(2) + db.powi(2)) + 0.5 * self.along * turn.powi(2)
    }
    #[potential]
    fn height(&self, q: &Coordinates<Self>) -> Expr {
        self.weight * q.a.cos() * q.b.cos()
    }
}

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
