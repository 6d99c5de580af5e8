//! The problems.

use dynamics::prelude::*;

pub(crate) use crate::double_pendulum;
pub(crate) use crate::hencky;
pub(crate) use crate::kepler;
pub(crate) use crate::neutral;
pub(crate) use crate::top;
pub(crate) use crate::truss;
pub(crate) use crate::ziegler;

use double_pendulum::DoublePendulum;
use kepler::Kepler;

/// A mass that flies over a narrow well: behind it it is as fast as before, and further.
#[derive(Clone, Debug, Dynamics)]
#[coordinates(x: m)]
#[units(mass: kg, depth: J, width: m)]
pub(crate) struct Well {
    pub(crate) mass: f64,
    pub(crate) depth: f64,
    pub(crate) width: f64,
}

#[dynamics]
impl Well {
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * self.mass * q.x.dt().powi(2)
    }
    #[potential]
    fn well(&self, q: &Coordinates<Self>) -> Expr {
        -self.depth * (-(q.x / self.width).powi(2)).exp()
    }
}

/// A mass that a spring and a damper hold to a moving guide, x = cos t where it starts on it: Prothero and
/// Robinson's problem.
#[derive(Clone, Debug, Dynamics)]
#[coordinates(x: m)]
#[units(mass: kg, stiffness: N / m, damping: N * s / m, amplitude: m, omega: rad / s)]
pub(crate) struct Guided {
    pub(crate) mass: f64,
    pub(crate) stiffness: f64,
    pub(crate) damping: f64,
    pub(crate) amplitude: f64,
    pub(crate) omega: f64,
}

#[dynamics]
impl Guided {
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * self.mass * q.x.dt().powi(2)
    }
    fn guide(&self, q: &Coordinates<Self>) -> Expr {
        self.amplitude * (self.omega * q.t).cos()
    }
    #[force]
    fn hold(&self, q: &Coordinates<Self>) -> Force {
        let guide = self.guide(q);
        let carried = self.mass * guide.dt().dt();
        let pull = self.stiffness * (guide - q.x) + self.damping * (guide.dt() - q.x.dt());
        Force::along(q.x, carried + pull)
    }
}

impl Guided {
    /// Forces that bring the mass back in a time of 1/damping, and then slowly.
    pub(crate) fn stiff(damping: f64) -> Self {
        Self { mass: 1.0, stiffness: damping, damping, amplitude: 1.0, omega: 1.0 }
    }
    /// Critically damped: they bring it back in a time of 2/damping.
    pub(crate) fn critical(damping: f64) -> Self {
        Self { stiffness: 0.25 * damping * damping, ..Self::stiff(damping) }
    }
    pub(crate) fn on_guide(&self) -> State<Self> {
        self.state().x(1.0).build().unwrap()
    }
    /// Largest error of x at the steps.
    pub(crate) fn error(motion: &Motion<'_, Self>) -> f64 {
        motion.steps().map(|state| (state.x() - state.t.cos()).abs()).fold(0.0, f64::max)
    }
}

/// A pendulum in Cartesian coordinates.
#[derive(Clone, Debug, Dynamics)]
#[coordinates(x: m, y: m)]
#[units(mass: kg, length: m, g: m / s^2)]
pub(crate) struct Rod {
    pub(crate) mass: f64,
    pub(crate) length: f64,
    pub(crate) g: f64,
}

#[dynamics]
impl Rod {
    fn bob(&self, q: &Coordinates<Self>) -> Vec2 {
        vec2(q.x, q.y)
    }
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * self.mass * self.bob(q).dt().norm_squared()
    }
    #[potential]
    fn gravity(&self, q: &Coordinates<Self>) -> Expr {
        self.mass * self.g * self.bob(q).y
    }
    #[holonomic]
    fn rod(&self, q: &Coordinates<Self>) -> Expr {
        self.bob(q).norm() - self.length
    }
}

pub(crate) const ROD: Rod = Rod { mass: 1.0, length: 1.0, g: 9.81 };

/// A mass on a spring, pushed by an input.
#[derive(Clone, Debug, Dynamics)]
#[coordinates(x: m)]
#[inputs(push: N)]
#[units(mass: kg, stiffness: N / m)]
pub(crate) struct Spring {
    pub(crate) mass: f64,
    pub(crate) stiffness: f64,
}

#[dynamics]
impl Spring {
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * self.mass * q.x.dt().powi(2)
    }
    #[potential]
    fn spring(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * self.stiffness * q.x.powi(2)
    }
    #[force]
    fn pushed(&self, q: &Coordinates<Self>) -> Force {
        Force::along(q.x, q.push)
    }
}

/// ω = 1.
pub(crate) const SPRING: Spring = Spring { mass: 1.0, stiffness: 1.0 };

/// A mass in a well with two bottoms, shaken, kicked for a moment, and before a buffer that it need not
/// reach.
#[derive(Clone, Debug, Dynamics)]
#[coordinates(x: m)]
#[units(
    mass: kg, stiffness: N / m, cubic: N / m^3, damping: N * s / m, force: N, omega: rad / s, kick: N, at: s,
    width: s, buffer: m
)]
pub(crate) struct Kicked {
    pub(crate) mass: f64,
    pub(crate) stiffness: f64,
    pub(crate) cubic: f64,
    pub(crate) damping: f64,
    pub(crate) force: f64,
    pub(crate) omega: f64,
    pub(crate) kick: f64,
    pub(crate) at: f64,
    pub(crate) width: f64,
    pub(crate) buffer: f64,
}

#[dynamics]
impl Kicked {
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * self.mass * q.x.dt().powi(2)
    }
    #[potential]
    fn well(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * self.stiffness * q.x.powi(2) + 0.25 * self.cubic * q.x.powi(4)
    }
    #[potential]
    fn buffer(&self, q: &Coordinates<Self>) -> Expr {
        let pressed = q.x - self.buffer;
        if pressed > 0.0 { 0.5 * self.mass * (self.omega * pressed).powi(2) } else { Expr::ZERO }
    }
    #[dissipation]
    fn damper(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * self.damping * q.x.dt().powi(2)
    }
    #[force]
    fn shaken(&self, q: &Coordinates<Self>) -> Force {
        let kick = self.kick * (-((q.t - self.at) / self.width).powi(2)).exp();
        Force::along(q.x, self.force * (self.omega * q.t).cos() + kick)
    }
}

/// Nothing but the kick: of 1 N·s √π at 50 s, for a second or two.
pub(crate) const KICKED: Kicked = Kicked {
    mass: 1.0,
    stiffness: 0.0,
    cubic: 0.0,
    damping: 0.0,
    force: 0.0,
    omega: 1.0,
    kick: 1.0,
    at: 50.0,
    width: 1.0,
    buffer: 1e6,
};

/// Chaotic.
pub(crate) const DUFFING: Kicked =
    Kicked { stiffness: -1.0, cubic: 1.0, damping: 0.3, force: 0.5, omega: 1.2, kick: 0.0, ..KICKED };

/// A bob on a spring with a damper along it.
#[derive(Clone, Debug, Dynamics)]
#[coordinates(x: m, y: m)]
#[units(mass: kg, stiffness: N / m, damping: N * s / m, length: m, g: m / s^2)]
pub(crate) struct Sprung {
    pub(crate) mass: f64,
    pub(crate) stiffness: f64,
    pub(crate) damping: f64,
    pub(crate) length: f64,
    pub(crate) g: f64,
}

#[dynamics]
impl Sprung {
    fn bob(&self, q: &Coordinates<Self>) -> Vec2 {
        vec2(q.x, q.y)
    }
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * self.mass * self.bob(q).dt().norm_squared()
    }
    #[potential]
    fn stretch(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * self.stiffness * (self.bob(q).norm() - self.length).powi(2)
    }
    #[potential]
    fn gravity(&self, q: &Coordinates<Self>) -> Expr {
        self.mass * self.g * q.y
    }
    #[dissipation]
    fn damper(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * self.damping * self.bob(q).norm().dt().powi(2)
    }
}

/// It swings as on a rod.
pub(crate) const STIFF: Sprung = Sprung { mass: 1.0, stiffness: 1e8, damping: 2e4, length: 1.0, g: 9.81 };

/// A mass that falls into a centre of attraction.
#[derive(Clone, Debug, Dynamics)]
#[coordinates(x: m)]
#[units(mass: kg, strength: N * m^2)]
pub(crate) struct Falling {
    pub(crate) mass: f64,
    pub(crate) strength: f64,
}

#[dynamics]
impl Falling {
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * self.mass * q.x.dt().powi(2)
    }
    #[potential]
    fn well(&self, q: &Coordinates<Self>) -> Expr {
        -self.strength / q.x
    }
}

/// Levien and Tan's double pendulum.
pub(crate) const CHAOTIC: DoublePendulum = DoublePendulum { m1: 1.0, m2: 1.0, l1: 1.0, l2: 1.0, g: 9.8 };

pub(crate) fn chaotic_start() -> State<DoublePendulum> {
    use core::f64::consts::PI;
    CHAOTIC.state().theta1(2.0 * PI / 3.0).theta2(-PI / 18.0).build().unwrap()
}

pub(crate) const KEPLER: Kepler = Kepler { mu: 1.0 };

/// At the apocentre of an orbit of semi-axis 1, whose period is 2π.
pub(crate) fn apocentre(eccentricity: f64) -> State<Kepler> {
    let speed = ((1.0 - eccentricity) / (1.0 + eccentricity)).sqrt();
    KEPLER.state().x(1.0 + eccentricity).y_rate(speed).build().unwrap()
}
