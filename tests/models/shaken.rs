//! A mass on a spring that forces of time shake, by parameters that may be 0.

use dynamics::prelude::*;

/// ẍ = pull − (stiffness − load) x − cubic x³ + growth ẋ + even cos 2t + odd sin 3t + late, which comes and
/// goes within a tenth of a second at 20 s.
#[derive(Clone, Debug, Dynamics)]
#[coordinates(x: m)]
#[units(
    m: kg, stiffness: N / m, load: N / m, cubic: N / m^3, pull: N, growth: N * s / m, even: N, odd: N,
    late: N, rate: 1 / s
)]
pub(crate) struct Shaken {
    pub(crate) m: f64,
    pub(crate) stiffness: f64,
    pub(crate) load: f64,
    pub(crate) cubic: f64,
    pub(crate) pull: f64,
    pub(crate) growth: f64,
    pub(crate) even: f64,
    pub(crate) odd: f64,
    pub(crate) late: f64,
    pub(crate) rate: f64,
}
#[dynamics]
impl Shaken {
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * self.m * q.x.dt().powi(2)
    }
    #[potential]
    fn spring(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * (self.stiffness - self.load) * q.x.powi(2) + 0.25 * self.cubic * q.x.powi(4) - self.pull * q.x
    }
    #[force]
    fn shaking(&self, q: &Coordinates<Self>) -> Force {
        let turn = self.rate * q.t;
        let late = self.late * (-(10.0 * (turn - 20.0)).powi(2)).exp();
        Force::along(
            q.x,
            self.growth * q.x.dt() + self.even * (2.0 * turn).cos() + self.odd * (3.0 * turn).sin() + late,
        )
    }
}
pub(crate) const STILL: Shaken = Shaken {
    m: 1.0,
    stiffness: 1.0,
    load: 0.0,
    cubic: 0.0,
    pull: 0.0,
    growth: 0.0,
    even: 0.0,
    odd: 0.0,
    late: 0.0,
    rate: 1.0,
};
