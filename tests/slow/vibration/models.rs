//! Models that several files ask.

use dynamics::analysis::StateSpace;
use dynamics::prelude::*;

/// A mass on a spring and a damper, pushed, on a base that moves; outputs of all kinds.
#[derive(Clone, Debug, Dynamics)]
#[coordinates(x: m)]
#[inputs(force: N, base: m, base_rate: m / s)]
#[units(m: kg, c: N * s / m, k: N / m)]
pub(crate) struct Oscillator {
    pub(crate) m: f64,
    pub(crate) c: f64,
    pub(crate) k: f64,
}
#[dynamics]
impl Oscillator {
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * self.m * q.x.dt().powi(2)
    }
    #[potential]
    fn spring(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * self.k * (q.x - q.base).powi(2)
    }
    #[force]
    fn damper(&self, q: &Coordinates<Self>) -> Force {
        Force::along(q.x, self.c * (q.base_rate - q.x.dt()) + q.force)
    }
    #[output]
    fn to_ground(&self, q: &Coordinates<Self>) -> Expr {
        self.k * (q.x - q.base) + self.c * (q.x.dt() - q.base_rate)
    }
    #[output]
    fn felt(&self, q: &Coordinates<Self>) -> Expr {
        q.x.dt().dt()
    }
}

impl Oscillator {
    /// With natural frequency 2 rad/s, mass 3 kg, and this damping ratio.
    pub(crate) fn damped(ratio: f64) -> Self {
        Self { m: 3.0, c: 2.0 * ratio * 3.0 * 2.0, k: 3.0 * 4.0 }
    }
    pub(crate) fn space(&self) -> StateSpace {
        self.state_space(&self.rest()).unwrap()
    }
    pub(crate) fn rest(&self) -> State<Self> {
        self.state().force(0.0).base(0.0).base_rate(0.0).build().unwrap()
    }
}

/// A cart that carries a pole.
#[derive(Clone, Debug, Dynamics)]
#[coordinates(x: m, theta: rad)]
#[inputs(force: N)]
#[units(cart: kg, bob: kg, length: m, g: m / s^2)]
pub(crate) struct CartPole {
    pub(crate) cart: f64,
    pub(crate) bob: f64,
    pub(crate) length: f64,
    pub(crate) g: f64,
}
#[dynamics]
impl CartPole {
    fn tip(&self, q: &Coordinates<Self>) -> Vec2 {
        vec2(q.x + self.length * q.theta.sin(), self.length * q.theta.cos())
    }
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * self.cart * q.x.dt().powi(2) + 0.5 * self.bob * self.tip(q).dt().norm_squared()
    }
    #[potential]
    fn gravity(&self, q: &Coordinates<Self>) -> Expr {
        self.bob * self.g * self.tip(q).y
    }
    #[force]
    fn motor(&self, q: &Coordinates<Self>) -> Force {
        Force::along(q.x, q.force)
    }
}

/// The same pole, its bob in Cartesian coordinates on a rod, which is a constraint; the rod's force is an
/// output.
#[derive(Clone, Debug, Dynamics)]
#[coordinates(x: m, bob_x: m, bob_y: m)]
#[inputs(force: N)]
#[units(cart: kg, bob: kg, length: m, g: m / s^2)]
pub(crate) struct RodCart {
    pub(crate) cart: f64,
    pub(crate) bob: f64,
    pub(crate) length: f64,
    pub(crate) g: f64,
}
#[dynamics]
impl RodCart {
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * self.cart * q.x.dt().powi(2) + 0.5 * self.bob * vec2(q.bob_x, q.bob_y).dt().norm_squared()
    }
    #[potential]
    fn gravity(&self, q: &Coordinates<Self>) -> Expr {
        self.bob * self.g * q.bob_y
    }
    #[holonomic]
    fn rod(&self, q: &Coordinates<Self>) -> Expr {
        (q.bob_x - q.x).powi(2) + q.bob_y.powi(2) - self.length.powi(2)
    }
    #[force]
    fn motor(&self, q: &Coordinates<Self>) -> Force {
        Force::along(q.x, q.force)
    }
    #[output]
    fn pull(&self, q: &Coordinates<Self>) -> Expr {
        2.0 * self.length * q.reaction(Self::rod)
    }
    #[output]
    fn sideways(&self, q: &Coordinates<Self>) -> Expr {
        2.0 * (q.x - q.bob_x) * q.reaction(Self::rod)
    }
    #[output]
    fn bob_acceleration(&self, q: &Coordinates<Self>) -> Vec2 {
        vec2(q.bob_x, q.bob_y).dt().dt() + vec2(q.force / self.cart, 0.0)
    }
}
