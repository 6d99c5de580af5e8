//! Structures with closed forms, and forces made up for what they do to a branch.

use crate::truss;

use dynamics::prelude::*;

pub(crate) use truss::{LIMIT, TRUSS, Truss};

/// The same truss by its apex and the length of its bars, said twice.
#[derive(Clone, Debug, Dynamics)]
#[coordinates(x: m, z: m, length: m)]
#[units(m: kg, stiffness: N, half_span: m, free: m, load: N)]
pub(crate) struct Bars {
    pub(crate) m: f64,
    pub(crate) stiffness: f64,
    pub(crate) half_span: f64,
    pub(crate) free: f64,
    pub(crate) load: f64,
}
#[dynamics]
impl Bars {
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * self.m * (q.x.dt().powi(2) + q.z.dt().powi(2) + 0.1 * q.length.dt().powi(2))
    }
    #[potential]
    fn bars(&self, q: &Coordinates<Self>) -> Expr {
        self.stiffness / self.free * (q.length - self.free).powi(2)
    }
    #[holonomic]
    fn closure(&self, q: &Coordinates<Self>) -> [Expr; 2] {
        [q.x, 0.5 * (q.length.powi(2) - q.z.powi(2) - self.half_span.powi(2))]
    }
    #[holonomic]
    #[redundant]
    fn again(&self, q: &Coordinates<Self>) -> Expr {
        q.length - (q.z.powi(2) + self.half_span.powi(2)).sqrt()
    }
    #[force]
    fn load(&self, q: &Coordinates<Self>) -> Force {
        Force::along(q.z, -self.load)
    }
}

/// The truss below a spring whose upper end is pressed down: snap-back, where the spring is the softer.
#[derive(Clone, Debug, Dynamics)]
#[coordinates(z: m)]
#[units(m: kg, stiffness: N, half_span: m, height: m, spring: N / m, down: m)]
pub(crate) struct SnapBack {
    pub(crate) m: f64,
    pub(crate) stiffness: f64,
    pub(crate) half_span: f64,
    pub(crate) height: f64,
    pub(crate) spring: f64,
    pub(crate) down: f64,
}
#[dynamics]
impl SnapBack {
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * self.m * q.z.dt().powi(2)
    }
    #[potential]
    fn bars(&self, q: &Coordinates<Self>) -> Expr {
        let free = (self.half_span.powi(2) + self.height.powi(2)).sqrt();
        let length = (q.z.powi(2) + self.half_span.powi(2)).sqrt();
        self.stiffness / free * (length - free).powi(2)
    }
    #[potential]
    fn in_series(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * self.spring * (self.down - (self.height - q.z)).powi(2)
    }
}

/// (4k/l) sin²((2j−1)π/22).
pub(crate) fn hencky(j: usize) -> f64 {
    4.0 * ((2 * j - 1) as f64 * std::f64::consts::PI / 22.0).sin().powi(2)
}

/// A rigid bar upright on a hinge, held at its head by a level spring, `offset` (as a part of its length) out
/// of the upright when nothing pulls; Z. P. Bažant & L. Cedolin, *Stability of Structures*, §4.5.
#[derive(Clone, Debug, Dynamics)]
#[coordinates(theta: rad)]
#[units(m: kg, length: m, spring: N / m, offset: 1, load: N)]
pub(crate) struct Level {
    pub(crate) m: f64,
    pub(crate) length: f64,
    pub(crate) spring: f64,
    pub(crate) offset: f64,
    pub(crate) load: f64,
}
#[dynamics]
impl Level {
    fn head(&self, q: &Coordinates<Self>) -> Vec2 {
        self.length * vec2(q.theta.sin(), q.theta.cos())
    }
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * self.m * self.head(q).dt().norm_squared()
    }
    #[potential]
    fn spring(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * self.spring * (self.head(q).x - self.length * self.offset).powi(2)
    }
    #[force]
    fn load(&self, q: &Coordinates<Self>) -> Force {
        Force::at(self.head(q), vec2(0.0, -self.load))
    }
}

/// The same bar, held by a spring at 45°: it resists to one side more than to the other.
#[derive(Clone, Debug, Dynamics)]
#[coordinates(theta: rad)]
#[units(m: kg, length: m, spring: N / m, offset: 1, load: N)]
pub(crate) struct Inclined {
    pub(crate) m: f64,
    pub(crate) length: f64,
    pub(crate) spring: f64,
    pub(crate) offset: f64,
    pub(crate) load: f64,
}
#[dynamics]
impl Inclined {
    fn head(&self, q: &Coordinates<Self>) -> Vec2 {
        self.length * vec2(q.theta.sin(), q.theta.cos())
    }
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * self.m * self.head(q).dt().norm_squared()
    }
    #[potential]
    fn spring(&self, q: &Coordinates<Self>) -> Expr {
        let foot = vec2(-self.length, 0.0);
        let free = self.length * (2.0 * (1.0 + self.offset)).sqrt();
        0.5 * self.spring * ((self.head(q) - foot).norm() - free).powi(2)
    }
    #[force]
    fn load(&self, q: &Coordinates<Self>) -> Force {
        Force::at(self.head(q), vec2(0.0, -self.load))
    }
}

/// Equilibria on a circle in the plane of coordinate and parameter.
#[derive(Clone, Debug, Dynamics)]
#[coordinates(x)]
pub(crate) struct Circle {
    pub(crate) m: f64,
    pub(crate) p: f64,
}
#[dynamics]
impl Circle {
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * self.m * q.x.dt().powi(2)
    }
    #[force]
    fn push(&self, q: &Coordinates<Self>) -> Force {
        Force::along(q.x, 1.0 - self.p.powi(2) - q.x.powi(2))
    }
}

/// Two coordinates whose stiffnesses are `first` and `second`, with springs that harden.
#[derive(Clone, Debug, Dynamics)]
#[coordinates(x, y)]
pub(crate) struct Apart {
    pub(crate) m: f64,
    pub(crate) first: f64,
    pub(crate) second: f64,
}
#[dynamics]
impl Apart {
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * self.m * (q.x.dt().powi(2) + q.y.dt().powi(2))
    }
    #[potential]
    fn springs(&self, q: &Coordinates<Self>) -> Expr {
        // Coupled, so that shapes turn.
        let (a, b) = (q.x + 0.3 * q.y, q.y - 0.3 * q.x);
        0.5 * (self.first * a.powi(2) + self.second * b.powi(2)) + 0.25 * (a.powi(4) + b.powi(4))
    }
}

/// A bead on a hoop, in the plane, that gravity pulls to any side.
#[derive(Clone, Debug, Dynamics)]
#[coordinates(x: m, z: m)]
#[units(m: kg, radius: m, g: m / s^2, side: rad)]
pub(crate) struct Bead {
    pub(crate) m: f64,
    pub(crate) radius: f64,
    pub(crate) g: f64,
    pub(crate) side: f64,
}
#[dynamics]
impl Bead {
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * self.m * (q.x.dt().powi(2) + q.z.dt().powi(2))
    }
    #[potential]
    fn weight(&self, q: &Coordinates<Self>) -> Expr {
        -self.m * self.g * (self.side.sin() * q.x - self.side.cos() * q.z)
    }
    #[holonomic]
    fn hoop(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * (q.x.powi(2) + q.z.powi(2) - self.radius.powi(2))
    }
}

/// A rigid bar on a hinge with a spring, `offset` out of the upright when nothing pulls.
#[derive(Clone, Debug, Dynamics)]
#[coordinates(theta: rad)]
#[units(m: kg, length: m, spring: N * m, offset: rad, load: N, torque: N * m)]
pub(crate) struct Hinged {
    pub(crate) m: f64,
    pub(crate) length: f64,
    pub(crate) spring: f64,
    pub(crate) offset: f64,
    pub(crate) load: f64,
    pub(crate) torque: f64,
}
#[dynamics]
impl Hinged {
    fn head(&self, q: &Coordinates<Self>) -> Vec2 {
        self.length * vec2(q.theta.sin(), q.theta.cos())
    }
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * self.m * self.head(q).dt().norm_squared()
    }
    #[potential]
    fn spring(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * self.spring * (q.theta - self.offset).powi(2)
    }
    #[force]
    fn loads(&self, q: &Coordinates<Self>) -> Force {
        Force::at(self.head(q), vec2(0.0, -self.load)) + Force::along(q.theta, self.torque)
    }
}

/// A spring that gives way at one: its force has a corner there.
#[derive(Clone, Debug, Dynamics)]
#[coordinates(x)]
pub(crate) struct Yields {
    pub(crate) m: f64,
    pub(crate) load: f64,
}
#[dynamics]
impl Yields {
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * self.m * q.x.dt().powi(2)
    }
    #[force]
    fn spring(&self, q: &Coordinates<Self>) -> Force {
        Force::along(q.x, self.load - q.x.min(2.0 - q.x))
    }
}

/// Two bars to an apex that may go aside: tall ones buckle to the side before they snap.
#[derive(Clone, Debug, Dynamics)]
#[coordinates(x: m, z: m)]
#[units(m: kg, stiffness: N / m, half_span: m, height: m, load: N)]
pub(crate) struct Tall {
    pub(crate) m: f64,
    pub(crate) stiffness: f64,
    pub(crate) half_span: f64,
    pub(crate) height: f64,
    pub(crate) load: f64,
}
#[dynamics]
impl Tall {
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * self.m * (q.x.dt().powi(2) + q.z.dt().powi(2))
    }
    #[potential]
    fn bars(&self, q: &Coordinates<Self>) -> Expr {
        let free = (self.half_span.powi(2) + self.height.powi(2)).sqrt();
        let left = vec2(q.x + self.half_span, q.z).norm();
        let right = vec2(q.x - self.half_span, q.z).norm();
        0.5 * self.stiffness * ((left - free).powi(2) + (right - free).powi(2))
    }
    #[force]
    fn load(&self, q: &Coordinates<Self>) -> Force {
        Force::along(q.z, -self.load)
    }
}

/// A sleigh held by a spring: it rests in many positions.
#[derive(Clone, Debug, Dynamics)]
#[coordinates(x: m, y: m, phi: rad)]
#[units(m: kg, gyration: m, stiffness: N / m)]
pub(crate) struct Sleigh {
    pub(crate) gyration: f64,
    pub(crate) m: f64,
    pub(crate) stiffness: f64,
}
#[dynamics]
impl Sleigh {
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * self.m * (vec2(q.x, q.y).dt().norm_squared() + self.gyration.powi(2) * q.phi.dt().powi(2))
    }
    #[potential]
    fn spring(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * self.stiffness * (q.x.powi(2) + q.y.powi(2) + (self.gyration * q.phi).powi(2))
    }
    #[nonholonomic]
    fn blade(&self, q: &Coordinates<Self>) -> Expr {
        q.x.dt() * q.phi.sin() - q.y.dt() * q.phi.cos()
    }
}

/// A groove among many like it, side by side, that wind as the parameter changes.
#[derive(Clone, Debug, Dynamics)]
#[coordinates(x)]
pub(crate) struct Grooves {
    pub(crate) m: f64,
    pub(crate) apart: f64,
    pub(crate) p: f64,
}
#[dynamics]
impl Grooves {
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * self.m * q.x.dt().powi(2)
    }
    #[force]
    fn sides(&self, q: &Coordinates<Self>) -> Force {
        Force::along(q.x, (((4.0 * self.p).sin() - q.x) / self.apart).sin())
    }
}

/// A force that is any polynomial of (x − from)/size.
#[derive(Clone, Debug, Dynamics)]
#[coordinates(x: m)]
pub(crate) struct Polynomial {
    pub(crate) m: f64,
    pub(crate) c: [f64; 5],
    pub(crate) from: f64,
    pub(crate) size: f64,
}
#[dynamics]
impl Polynomial {
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * self.m * q.x.dt().powi(2)
    }
    #[force]
    fn force(&self, q: &Coordinates<Self>) -> Force {
        let x = (q.x - self.from) / self.size;
        let sum =
            self.c[0] + self.c[1] * x + self.c[2] * x.powi(2) + self.c[3] * x.powi(3) + self.c[4] * x.powi(4);
        Force::along(q.x, sum)
    }
}

/// A whirling mass: springs, damping, and a force across the displacement.
#[derive(Clone, Debug, Dynamics)]
#[coordinates(x: m, y: m)]
pub(crate) struct Whirl {
    pub(crate) m: f64,
    pub(crate) springs: [f64; 2],
    pub(crate) damping: f64,
    pub(crate) across: f64,
}
#[dynamics]
impl Whirl {
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * self.m * (q.x.dt().powi(2) + q.y.dt().powi(2))
    }
    #[force]
    fn force(&self, q: &Coordinates<Self>) -> Force {
        Force::along(q.x, -self.springs[0] * q.x - self.damping * q.x.dt() - self.across * q.y)
            + Force::along(q.y, -self.springs[1] * q.y - self.damping * q.y.dt() + self.across * q.x)
    }
}
