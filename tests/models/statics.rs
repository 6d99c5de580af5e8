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

/// Three masses in a row, the first held to the ground.
#[derive(Clone, Debug, Dynamics)]
#[coordinates(x: [m; 3])]
#[units(m: kg, k: N / m, damper: N * s / m)]
pub(crate) struct Masses {
    pub(crate) m: f64,
    pub(crate) k: [f64; 3],
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
        0.5 * self.k[0] * q.x[0].powi(2)
            + 0.5 * self.k[1] * (q.x[1] - q.x[0]).powi(2)
            + 0.5 * self.k[2] * (q.x[2] - q.x[1]).powi(2)
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
