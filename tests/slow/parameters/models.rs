//! Models that several files here ask.

use dynamics::prelude::*;

/// A damped oscillator.
#[derive(Clone, Debug, Dynamics)]
#[coordinates(x: m)]
#[units(mass: kg, damping: N * s / m, stiffness: N / m)]
pub(crate) struct Oscillator {
    pub(crate) mass: f64,
    pub(crate) damping: f64,
    pub(crate) stiffness: f64,
}

#[dynamics]
impl Oscillator {
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * self.mass * q.x.dt().powi(2)
    }
    #[potential]
    fn spring(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * self.stiffness * q.x.powi(2)
    }
    #[dissipation]
    fn damper(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * self.damping * q.x.dt().powi(2)
    }
    #[output]
    fn pull(&self, q: &Coordinates<Self>) -> Expr {
        self.stiffness * q.x + self.damping * q.x.dt()
    }
    #[output]
    fn power(&self, q: &Coordinates<Self>) -> Expr {
        self.damping * q.x.dt().powi(2)
    }
}

impl Oscillator {
    pub(crate) const PLAIN: Self = Self { mass: 2.0, damping: 1.2, stiffness: 50.0 };

    /// x and ẋ of free vibration: p = [mass, damping, stiffness, x₀, ẋ₀].
    pub(crate) fn closed(p: [f64; 5], t: f64) -> [f64; 2] {
        let [m, c, k, x, v] = p;
        let decay = c / (2.0 * m);
        let omega = (k / m - decay * decay).sqrt();
        let (sin, cos) = (omega * t).sin_cos();
        let (e, b) = ((-decay * t).exp(), (v + decay * x) / omega);
        [e * (x * cos + b * sin), e * ((b * omega - decay * x) * cos - (x * omega + decay * b) * sin)]
    }
}

/// The bob of a pendulum in the plane, once on one rod and once on the same rod twice over; pushed from the
/// side.
macro_rules! bob {
    ($name:ident, $($again:tt)*) => {
        #[derive(Clone, Debug, Dynamics)]
        #[coordinates(x: m, y: m)]
        #[units(mass: kg, length: m, g: m / s^2, push: N)]
        pub(crate) struct $name {
            pub(crate) mass: f64,
            pub(crate) length: f64,
            pub(crate) g: f64,
            pub(crate) push: f64,
        }
        #[dynamics]
        impl $name {
            #[kinetic]
            fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
                0.5 * self.mass * vec2(q.x, q.y).dt().norm_squared()
            }
            #[potential]
            fn weight(&self, q: &Coordinates<Self>) -> Expr {
                self.mass * self.g * q.y - self.push * q.x
            }
            #[holonomic]
            fn rod(&self, q: &Coordinates<Self>) -> Expr {
                0.5 * (vec2(q.x, q.y).norm_squared() - self.length * self.length)
            }
            $($again)*
        }
    };
}

pub(crate) mod once {
    use super::*;
    bob!(Bob,);
}

pub(crate) mod twice {
    use super::*;
    bob!(
        Bob,
        #[holonomic]
        #[redundant]
        fn again(&self, q: &Coordinates<Self>) -> Expr {
            vec2(q.x, q.y).norm() - self.length
        }
    );
}

/// The same in its angle.
#[derive(Clone, Debug, Dynamics)]
#[coordinates(theta: rad)]
#[units(mass: kg, length: m, g: m / s^2, push: N)]
pub(crate) struct Angle {
    pub(crate) mass: f64,
    pub(crate) length: f64,
    pub(crate) g: f64,
    pub(crate) push: f64,
}

#[dynamics]
impl Angle {
    fn bob(&self, q: &Coordinates<Self>) -> Vec2 {
        self.length * vec2(q.theta.sin(), -q.theta.cos())
    }
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * self.mass * self.bob(q).dt().norm_squared()
    }
    #[potential]
    fn weight(&self, q: &Coordinates<Self>) -> Expr {
        self.mass * self.g * self.bob(q).y - self.push * self.bob(q).x
    }
    #[output]
    fn place(&self, q: &Coordinates<Self>) -> Vec2 {
        self.bob(q)
    }
}

/// A ball over a soft floor, with a lamp that is lit while it touches, and one that flashes.
#[derive(Clone, Debug, Dynamics)]
#[coordinates(height: m)]
#[units(mass: kg, g: m / s^2, stiffness: N / m)]
pub(crate) struct Ball {
    pub(crate) mass: f64,
    pub(crate) g: f64,
    pub(crate) stiffness: f64,
}

#[dynamics]
impl Ball {
    const LOW: f64 = 0.5;
    const THICK: f64 = 0.1;
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * self.mass * q.height.dt().powi(2)
    }
    #[potential]
    fn weight(&self, q: &Coordinates<Self>) -> Expr {
        self.mass * self.g * q.height
    }
    #[force]
    fn floor(&self, q: &Coordinates<Self>) -> Force {
        Force::along(q.height, self.stiffness * (-q.height).max(0.0))
    }
    #[event]
    fn low(&self, q: &Coordinates<Self>) -> Expr {
        q.height - Self::LOW
    }
    #[output]
    fn depth(&self, q: &Coordinates<Self>) -> Expr {
        (-q.height).max(0.0) / 1.0
    }
    #[output]
    fn lit(&self, q: &Coordinates<Self>) -> Expr {
        if q.height < Self::LOW { Expr::from(1.0) } else { Expr::ZERO }
    }
    #[output]
    fn flash(&self, q: &Coordinates<Self>) -> Expr {
        if q.height < Self::LOW && q.height > Self::LOW - Self::THICK { Expr::from(1.0) } else { Expr::ZERO }
    }
}
pub(crate) const BALL: Ball = Ball { mass: 1.0, g: 9.81, stiffness: 2e3 };
