//! A double pendulum under a force that follows its second link, or a part of its angle; H. Ziegler,
//! Ing.-Archiv 20 (1952) 49.

use dynamics::prelude::*;

#[derive(Clone, Debug, Dynamics)]
#[coordinates(phi: [rad; 2])]
#[units(m: kg, l: m, k: N * m, c: N * m * s, p: N, follows: 1)]
pub(crate) struct Ziegler {
    /// The part of the last link's angle that the force follows.
    pub(crate) follows: f64,
    pub(crate) m: f64,
    pub(crate) l: f64,
    pub(crate) k: f64,
    pub(crate) c: f64,
    pub(crate) p: f64,
}

#[dynamics]
impl Ziegler {
    fn joints(&self, q: &Coordinates<Self>) -> [Vec2; 2] {
        let first = self.l * vec2(q.phi[0].cos(), q.phi[0].sin());
        [first, first + self.l * vec2(q.phi[1].cos(), q.phi[1].sin())]
    }
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        let [a, b] = self.joints(q);
        self.m * a.dt().norm_squared() + 0.5 * self.m * b.dt().norm_squared()
    }
    #[potential]
    fn springs(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * self.k * (q.phi[0].powi(2) + (q.phi[1] - q.phi[0]).powi(2))
    }
    #[dissipation]
    fn dampers(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * self.c * (q.phi[0].dt().powi(2) + (q.phi[1] - q.phi[0]).dt().powi(2))
    }
    #[force]
    fn follower(&self, q: &Coordinates<Self>) -> Force {
        let [_, end] = self.joints(q);
        let angle = self.follows * q.phi[1];
        Force::at(end, -self.p * vec2(angle.cos(), angle.sin()))
    }
}
