//! Problems with known end values, from their Lagrangians.
//!
//! The end values were computed in multiple precision by two formulations and hold to all digits printed.

use dynamics::prelude::*;

/// Two bobs on massless rods (Levien, Tan, Am. J. Phys. 61 (1993) 1038).
#[derive(Clone, Debug, Dynamics)]
#[coordinates(theta1, theta2)]
pub(crate) struct DoublePendulum {
    m: f64,
    l: f64,
    g: f64,
}

#[dynamics]
impl DoublePendulum {
    fn bob1(&self, q: &Coordinates<Self>) -> Vec2 {
        self.l * vec2(q.theta1.sin(), -q.theta1.cos())
    }
    fn bob2(&self, q: &Coordinates<Self>) -> Vec2 {
        self.bob1(q) + self.l * vec2(q.theta2.sin(), -q.theta2.cos())
    }
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * self.m * (self.bob1(q).dt().norm_squared() + self.bob2(q).dt().norm_squared())
    }
    #[potential]
    fn gravity(&self, q: &Coordinates<Self>) -> Expr {
        self.m * self.g * (self.bob1(q).y + self.bob2(q).y)
    }
}

/// Kepler's problem (Hairer, Lubich, Wanner, *Geometric Numerical Integration*, §I.2).
#[derive(Clone, Debug, Dynamics)]
#[coordinates(x, y)]
pub(crate) struct Kepler {
    mu: f64,
}

#[dynamics]
impl Kepler {
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * vec2(q.x, q.y).dt().norm_squared()
    }
    #[potential]
    fn gravitation(&self, q: &Coordinates<Self>) -> Expr {
        -self.mu / vec2(q.x, q.y).norm()
    }
}

/// Arenstorf's orbit in the frame that turns with earth and moon (Hairer, Nørsett, Wanner, *Solving ODE I*, p. 129).
#[derive(Clone, Debug, Dynamics)]
#[coordinates(x, y)]
pub(crate) struct Arenstorf {
    mu: f64,
}

#[dynamics]
impl Arenstorf {
    #[lagrangian]
    fn lagrangian(&self, q: &Coordinates<Self>) -> Expr {
        let velocity = vec2(q.x.dt() - q.y, q.y.dt() + q.x);
        let earth = (q.x + self.mu).hypot(q.y);
        let moon = (q.x - (1.0 - self.mu)).hypot(q.y);
        0.5 * velocity.norm_squared() + (1.0 - self.mu) / earth + self.mu / moon
    }
}

/// A model with its start at t = 0, and q and u at the end.
pub(crate) struct Problem<M: Simulate> {
    pub(crate) name: &'static str,
    pub(crate) model: M,
    pub(crate) start: M::State,
    pub(crate) end: f64,
    pub(crate) reference: [f64; 4],
    /// Fixed steps are from 1/2 to the first of these powers of the interval to 1/2 to the second.
    pub(crate) halvings: (i32, i32),
}

pub(crate) fn double_pendulum() -> Problem<DoublePendulum> {
    use std::f64::consts::PI;
    let model = DoublePendulum { m: 1.0, l: 1.0, g: 9.8 };
    Problem {
        name: "double pendulum, 5 s",
        start: model.state().theta1(2.0 * PI / 3.0).theta2(-PI / 18.0).build().expect("finite values"),
        model,
        end: 5.0,
        reference: [-0.44021974536666475, 7.049578950150241, -3.52113897832026, -3.9088281777737452],
        halvings: (6, 15),
    }
}

pub(crate) fn kepler() -> Problem<Kepler> {
    let model = Kepler { mu: 1.0 };
    Problem {
        name: "Kepler, e = 0.9, t = 20",
        start: model.state().x(0.1).y_rate(19f64.sqrt()).build().expect("finite values"),
        model,
        end: 20.0,
        reference: [-1.2952662509875743, 0.4003938963792322, -0.6775390924707566, -0.12708381542786862],
        halvings: (11, 18),
    }
}

pub(crate) fn arenstorf() -> Problem<Arenstorf> {
    let model = Arenstorf { mu: 0.012277471 };
    Problem {
        name: "Arenstorf, one period",
        start: model.state().x(0.994).y_rate(-2.0015851063790825).build().expect("finite values"),
        model,
        end: 17.065216560157964,
        reference: [0.994, 0.0, 0.0, -2.0015851063790825],
        halvings: (13, 19),
    }
}
