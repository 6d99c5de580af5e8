//! Models of one coordinate, or one that a constraint leaves.

use dynamics::prelude::*;

/// A pendulum from the upright, whose pivot is shaken up and down, with damping.
#[derive(Clone, Debug, Dynamics)]
#[coordinates(theta: rad)]
#[units(m: kg, l: m, amplitude: m, frequency: rad / s, damping: N * m * s, g: m / s^2)]
pub(crate) struct Shaken {
    pub(crate) m: f64,
    pub(crate) l: f64,
    pub(crate) amplitude: f64,
    pub(crate) frequency: f64,
    pub(crate) damping: f64,
    pub(crate) g: f64,
}

#[dynamics]
impl Shaken {
    fn pivot(&self, q: &Coordinates<Self>) -> Vec2 {
        vec2(0.0, self.amplitude * (self.frequency * q.t).cos())
    }
    fn bob(&self, q: &Coordinates<Self>) -> Vec2 {
        self.pivot(q) + self.l * vec2(q.theta.sin(), q.theta.cos())
    }
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * self.m * self.bob(q).dt().norm_squared()
    }
    #[potential]
    fn weight(&self, q: &Coordinates<Self>) -> Expr {
        self.m * self.g * self.bob(q).y
    }
    #[dissipation]
    fn friction(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * self.damping * q.theta.dt().powi(2)
    }
}

/// The same in the plane, with a rod that is a constraint, twice.
#[derive(Clone, Debug, Dynamics)]
#[coordinates(x: m, y: m)]
#[units(m: kg, l: m, amplitude: m, frequency: rad / s, g: m / s^2)]
pub(crate) struct ShakenInPlane {
    pub(crate) m: f64,
    pub(crate) l: f64,
    pub(crate) amplitude: f64,
    pub(crate) frequency: f64,
    pub(crate) g: f64,
}

#[dynamics]
impl ShakenInPlane {
    fn arm(&self, q: &Coordinates<Self>) -> Vec2 {
        vec2(q.x, q.y - self.amplitude * (self.frequency * q.t).cos())
    }
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * self.m * vec2(q.x, q.y).dt().norm_squared()
    }
    #[potential]
    fn weight(&self, q: &Coordinates<Self>) -> Expr {
        self.m * self.g * q.y
    }
    #[holonomic]
    fn rod(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * (self.arm(q).norm_squared() - self.l.powi(2))
    }
}

/// The same with the rod said twice: only the general solver has its accelerations, and derivatives stand
/// before their solution only.
#[derive(Clone, Debug, Dynamics)]
#[coordinates(x: m, y: m)]
#[units(m: kg, l: m, amplitude: m, frequency: rad / s, g: m / s^2)]
pub(crate) struct TwiceHeld {
    pub(crate) m: f64,
    pub(crate) l: f64,
    pub(crate) amplitude: f64,
    pub(crate) frequency: f64,
    pub(crate) g: f64,
}

#[dynamics]
impl TwiceHeld {
    fn arm(&self, q: &Coordinates<Self>) -> Vec2 {
        vec2(q.x, q.y - self.amplitude * (self.frequency * q.t).cos())
    }
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * self.m * vec2(q.x, q.y).dt().norm_squared()
    }
    #[potential]
    fn weight(&self, q: &Coordinates<Self>) -> Expr {
        self.m * self.g * q.y
    }
    #[holonomic]
    fn rod(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * (self.arm(q).norm_squared() - self.l.powi(2))
    }
    #[holonomic]
    #[redundant]
    fn again(&self, q: &Coordinates<Self>) -> Expr {
        self.arm(q).norm() - self.l
    }
}

/// A pendulum that hangs.
#[derive(Clone, Debug, Dynamics)]
#[coordinates(theta: rad)]
#[units(m: kg, l: m, g: m / s^2)]
pub(crate) struct Pendulum {
    pub(crate) m: f64,
    pub(crate) l: f64,
    pub(crate) g: f64,
}

#[dynamics]
impl Pendulum {
    fn bob(&self, q: &Coordinates<Self>) -> Vec2 {
        self.l * vec2(q.theta.sin(), -q.theta.cos())
    }
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * self.m * self.bob(q).dt().norm_squared()
    }
    #[potential]
    fn weight(&self, q: &Coordinates<Self>) -> Expr {
        self.m * self.g * self.bob(q).y
    }
}

/// ẍ − μ(1 − x²)ẋ + x = 0.
#[derive(Clone, Debug, Dynamics)]
#[coordinates(x)]
pub(crate) struct VanDerPol {
    pub(crate) mu: f64,
}

#[dynamics]
impl VanDerPol {
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * q.x.dt().powi(2)
    }
    #[potential]
    fn spring(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * q.x.powi(2)
    }
    #[force]
    fn pump(&self, q: &Coordinates<Self>) -> Force {
        Force::along(q.x, self.mu * (1.0 - q.x.powi(2)) * q.x.dt())
    }
}

/// ẍ + δẋ + αx + βx³ = γ cos ωt.
#[derive(Clone, Debug, Dynamics)]
#[coordinates(x)]
pub(crate) struct Duffing {
    pub(crate) alpha: f64,
    pub(crate) beta: f64,
    pub(crate) delta: f64,
    pub(crate) gamma: f64,
    pub(crate) omega: f64,
}

#[dynamics]
impl Duffing {
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * q.x.dt().powi(2)
    }
    #[potential]
    fn spring(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * self.alpha * q.x.powi(2) + 0.25 * self.beta * q.x.powi(4)
    }
    #[dissipation]
    fn damper(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * self.delta * q.x.dt().powi(2)
    }
    #[force]
    fn drive(&self, q: &Coordinates<Self>) -> Force {
        Force::along(q.x, self.gamma * (self.omega * q.t).cos())
    }
}

/// ẍ + kx + jump·sgn x + dry·sgn ẋ = γ cos ωt: forces that jump.
#[derive(Clone, Debug, Dynamics)]
#[coordinates(x)]
pub(crate) struct Relay {
    pub(crate) k: f64,
    pub(crate) jump: f64,
    pub(crate) dry: f64,
    pub(crate) gamma: f64,
    pub(crate) omega: f64,
}

#[dynamics]
impl Relay {
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * q.x.dt().powi(2)
    }
    #[potential]
    fn spring(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * self.k * q.x.powi(2)
    }
    #[force]
    fn relay(&self, q: &Coordinates<Self>) -> Force {
        let jumps = self.jump * q.x.signum() + self.dry * q.x.dt().signum();
        Force::along(q.x, self.gamma * (self.omega * q.t).cos() - jumps)
    }
}

/// The top of a hill in a magnetic field: s⁴ + (field² − 2 slope) s² + slope² = 0, which keeps it up from
/// field² = 4 slope on.
#[derive(Clone, Debug, Dynamics)]
#[coordinates(x, y)]
pub(crate) struct Hilltop {
    pub(crate) field: f64,
    pub(crate) slope: f64,
}

#[dynamics]
impl Hilltop {
    #[lagrangian]
    fn lagrangian(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * vec2(q.x, q.y).dt().norm_squared()
            + 0.5 * self.field * (q.x * q.y.dt() - q.y * q.x.dt())
            + 0.5 * self.slope * vec2(q.x, q.y).norm_squared()
    }
}

/// A spring, and beside it a soft one whose stiffness swings.
#[derive(Clone, Debug, Dynamics)]
#[coordinates(x, y)]
pub(crate) struct Beside {
    pub(crate) stiff: f64,
    pub(crate) soft: f64,
    pub(crate) frequency: f64,
}

#[dynamics]
impl Beside {
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * vec2(q.x, q.y).dt().norm_squared()
    }
    #[potential]
    fn springs(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * self.stiff * q.x.powi(2) + 0.5 * self.soft * (1.0 + (self.frequency * q.t).cos()) * q.y.powi(2)
    }
}

/// A skate on springs: it does not move aside.
#[derive(Clone, Debug, Dynamics)]
#[coordinates(x: m, y: m, phi: rad)]
#[units(m: kg, i: kg * m^2, a: m, k: N / m, turning: N * m, c: N * s / m)]
pub(crate) struct Skate {
    pub(crate) m: f64,
    pub(crate) i: f64,
    pub(crate) a: f64,
    pub(crate) k: f64,
    pub(crate) turning: f64,
    pub(crate) c: f64,
}

#[dynamics]
impl Skate {
    fn center(&self, q: &Coordinates<Self>) -> Vec2 {
        vec2(q.x, q.y) + self.a * vec2(q.phi.cos(), q.phi.sin())
    }
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * self.m * self.center(q).dt().norm_squared() + 0.5 * self.i * q.phi.dt().powi(2)
    }
    #[potential]
    fn springs(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * self.k * self.center(q).norm_squared() + 0.5 * self.turning * q.phi.powi(2)
    }
    #[dissipation]
    fn damper(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * self.c * self.center(q).dt().norm_squared()
    }
    #[nonholonomic]
    fn blade(&self, q: &Coordinates<Self>) -> Expr {
        q.y.dt() * q.phi.cos() - q.x.dt() * q.phi.sin()
    }
}

/// A spring whose stiffness jumps in the rhythm of a sine (Meissner 1918).
#[derive(Clone, Debug, Dynamics)]
#[coordinates(x: m)]
#[units(m: kg, k: N / m, depth: 1, omega: rad / s)]
pub(crate) struct Meissner {
    pub(crate) m: f64,
    pub(crate) k: f64,
    pub(crate) depth: f64,
    pub(crate) omega: f64,
}

#[dynamics]
impl Meissner {
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * self.m * q.x.dt().powi(2)
    }
    #[force]
    fn spring(&self, q: &Coordinates<Self>) -> Force {
        Force::along(q.x, -self.k * (1.0 + self.depth * (self.omega * q.t).sin().signum()) * q.x)
    }
}

/// The same by a choice.
#[derive(Clone, Debug, Dynamics)]
#[coordinates(x: m)]
#[units(m: kg, k: N / m, depth: 1, omega: rad / s)]
pub(crate) struct Chosen {
    pub(crate) m: f64,
    pub(crate) k: f64,
    pub(crate) depth: f64,
    pub(crate) omega: f64,
}

#[dynamics]
impl Chosen {
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * self.m * q.x.dt().powi(2)
    }
    #[force]
    fn spring(&self, q: &Coordinates<Self>) -> Force {
        let depth =
            if (self.omega * q.t).sin() > 0.0 { Expr::from(self.depth) } else { Expr::from(-self.depth) };
        Force::along(q.x, -self.k * (1.0 + depth) * q.x)
    }
}
