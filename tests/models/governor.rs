//! The stiff flyball governor; IFToMM problem A05, González et al. 2006. The tests and the example of error
//! against cost include this file.

use dynamics::prelude::*;

/// A shaft that carries two hinged rods with balls; spring-dampers from the rods' middles hold a slider that
/// turns with it. Shaft, slider and each rod have their own angle about the shaft; constraints make them turn
/// as one.
#[derive(Clone, Debug, Dynamics)]
#[coordinates(psi: rad, slider: rad, arm: [rad; 2], s: m, b: [rad; 2])]
#[units(
    ball: kg, rod: kg, collar: kg, l: m, offset: m, rest: m, k: N / m, c: N * s / m, g: m / s^2,
    shaft_inertia: kg * m^2, collar_inertia: kg * m^2, along: kg * m^2, across: kg * m^2
)]
pub(crate) struct Governor {
    pub(crate) ball: f64,
    pub(crate) rod: f64,
    pub(crate) collar: f64,
    pub(crate) l: f64,
    pub(crate) offset: f64,
    pub(crate) rest: f64,
    pub(crate) k: f64,
    pub(crate) c: f64,
    pub(crate) g: f64,
    pub(crate) shaft_inertia: f64,
    pub(crate) collar_inertia: f64,
    /// Moments of inertia of a rod about its axis and across it.
    pub(crate) along: f64,
    pub(crate) across: f64,
}

#[dynamics]
impl Governor {
    /// A point of rod i at the part `at` of its length: distance from the axis, and height.
    fn point(&self, q: &Coordinates<Self>, i: usize, at: f64) -> Vec2 {
        vec2(self.offset, self.l) + at * self.l * vec2(q.b[i].cos(), -q.b[i].sin())
    }
    fn spring(&self, q: &Coordinates<Self>, i: usize) -> Expr {
        (self.point(q, i, 0.5) - vec2(self.offset, q.s)).norm()
    }
    #[kinetic]
    fn arms(&self, q: &Coordinates<Self>) -> Expr {
        let mut sum = Expr::ZERO;
        for i in 0..2 {
            let spin = q.arm[i].dt();
            let (middle, end) = (self.point(q, i, 0.5), self.point(q, i, 1.0));
            sum += 0.5 * self.rod * (middle.dt().norm_squared() + (middle.x * spin).powi(2));
            sum += 0.5 * self.ball * (end.dt().norm_squared() + (end.x * spin).powi(2));
            sum += 0.5 * self.across * (q.b[i].dt().powi(2) + (spin * q.b[i].cos()).powi(2));
            sum += 0.5 * self.along * (spin * q.b[i].sin()).powi(2);
        }
        sum
    }
    #[kinetic]
    fn shaft(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * self.shaft_inertia * q.psi.dt().powi(2)
            + 0.5 * self.collar_inertia * q.slider.dt().powi(2)
            + 0.5 * self.collar * q.s.dt().powi(2)
    }
    #[potential]
    fn weight(&self, q: &Coordinates<Self>) -> Expr {
        let mut sum = self.collar * self.g * q.s;
        for i in 0..2 {
            sum += self.g * (self.rod * self.point(q, i, 0.5).y + self.ball * self.point(q, i, 1.0).y);
        }
        sum
    }
    #[potential]
    fn springs(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * self.k * ((self.spring(q, 0) - self.rest).powi(2) + (self.spring(q, 1) - self.rest).powi(2))
    }
    #[dissipation]
    fn dampers(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * self.c * (self.spring(q, 0).dt().powi(2) + self.spring(q, 1).dt().powi(2))
    }
    /// The collar's key and the hinges: −λ is the torque that each passes on.
    #[holonomic]
    fn key(&self, q: &Coordinates<Self>) -> Expr {
        q.slider - q.psi
    }
    #[holonomic]
    fn hinges(&self, q: &Coordinates<Self>) -> [Expr; 2] {
        [q.arm[0] - q.psi, q.arm[1] - q.psi]
    }
}

/// The published parameters.
pub(crate) fn model() -> Governor {
    Governor {
        ball: 5.0,
        rod: 0.3,
        collar: 3.0,
        l: 1.0,
        offset: 0.05,
        rest: 0.5,
        k: 8e5,
        c: 4e4,
        g: 9.81,
        shaft_inertia: 0.3 * (0.01f64.powi(2) + 0.01f64.powi(2)) / 12.0,
        collar_inertia: 3.0 * (0.1f64.powi(2) + 0.1f64.powi(2)) / 12.0,
        along: 0.3 * (0.01f64.powi(2) + 0.01f64.powi(2)) / 12.0,
        across: 0.3 * (1.0 + 0.01f64.powi(2)) / 12.0,
    }
}
