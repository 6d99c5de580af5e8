//! A top that stands on its tip.

use dynamics::prelude::*;

/// A heavy symmetrical top in Cardan angles, upright at zero, which are regular there; H. Goldstein,
/// *Classical Mechanics*, §5.7.
#[derive(Clone, Debug, Dynamics)]
#[coordinates(a: rad, b: rad, spin: rad)]
#[units(across: kg * m^2, along: kg * m^2, weight: N * m)]
pub(crate) struct Top {
    pub(crate) across: f64,
    pub(crate) along: f64,
    /// m g l.
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
