//! The models that are written as units.

use dynamics::prelude::*;

/// Two masses between springs, with parameters as arrays.
#[derive(Clone, Debug, Dynamics)]
#[model(targets(c))]
#[coordinates(x: [m; 2])]
#[units(mass: kg, stiffness: N / m, damping: N * s / m)]
pub(crate) struct Masses {
    /// The masses,
    /// from left to right.
    pub(crate) mass: [f64; 2],
    /// Of the springs.
    pub(crate) stiffness: [f64; 3],
    pub(crate) damping: f64,
}

#[dynamics]
impl Masses {
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * (self.mass[0] * q.x[0].dt().powi(2) + self.mass[1] * q.x[1].dt().powi(2))
    }
    #[potential]
    fn springs(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * (self.stiffness[0] * q.x[0].powi(2)
            + self.stiffness[1] * (q.x[1] - q.x[0]).powi(2)
            + self.stiffness[2] * q.x[1].powi(2))
    }
    #[dissipation]
    fn damper(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * self.damping * (q.x[0].dt() - q.x[1].dt()).powi(2)
    }
    #[output]
    fn stretch(&self, q: &Coordinates<Self>) -> Expr {
        q.x[1] - q.x[0]
    }
    #[output]
    fn push(&self, q: &Coordinates<Self>) -> Expr {
        self.mass[0] * q.x[0].dt().dt()
    }
}

/// A cart with a bob & an <input>.
#[derive(Clone, Debug, Dynamics)]
#[model(targets(c))]
#[coordinates(x: m, theta: rad)]
#[inputs(push: N)]
#[units(cart: kg, bob: kg, l: m, g: m / s^2)]
pub(crate) struct CartPole {
    pub(crate) cart: f64,
    pub(crate) bob: f64,
    pub(crate) l: f64,
    pub(crate) g: f64,
}

#[dynamics]
impl CartPole {
    fn bob(&self, q: &Coordinates<Self>) -> Vec2 {
        vec2(q.x, 0.0) + self.l * vec2(q.theta.sin(), -q.theta.cos())
    }
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * self.cart * q.x.dt().powi(2) + 0.5 * self.bob * self.bob(q).dt().norm_squared()
    }
    #[potential]
    fn gravity(&self, q: &Coordinates<Self>) -> Expr {
        self.bob * self.g * self.bob(q).y
    }
    #[force]
    fn drive(&self, q: &Coordinates<Self>) -> Force {
        Force::along(q.x, q.push)
    }
    #[output]
    fn tip(&self, q: &Coordinates<Self>) -> Vec2 {
        self.bob(q)
    }
}

/// A slider-crank of uniform rods, one loop closed by a vector, with a light brake.
#[derive(Clone, Debug, Dynamics)]
#[model(targets(c))]
#[coordinates(crank: rad, rod: rad, slide: m)]
#[units(m: kg, r: m, l: m, g: m / s^2, brake: N * m * s)]
#[nominal(m = [1.0, 2.0, 3.0], r = 0.5, l = 1.5)]
pub(crate) struct SliderCrank {
    pub(crate) m: [f64; 3],
    pub(crate) r: f64,
    pub(crate) l: f64,
    pub(crate) g: f64,
    pub(crate) brake: f64,
}

#[dynamics]
impl SliderCrank {
    fn pin(&self, q: &Coordinates<Self>) -> Vec2 {
        self.r * vec2(q.crank.cos(), q.crank.sin())
    }
    fn along(&self, q: &Coordinates<Self>) -> Vec2 {
        self.l * vec2(q.rod.cos(), -q.rod.sin())
    }
    fn middle(&self, q: &Coordinates<Self>) -> Vec2 {
        self.pin(q) + 0.5 * self.along(q)
    }
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        self.m[0] * self.pin(q).dt().norm_squared() / 6.0
            + 0.5 * self.m[1] * (self.middle(q).dt().norm_squared() + (self.l * q.rod.dt()).powi(2) / 12.0)
            + 0.5 * self.m[2] * q.slide.dt().powi(2)
    }
    #[potential]
    fn gravity(&self, q: &Coordinates<Self>) -> Expr {
        self.g * (0.5 * self.m[0] * self.pin(q).y + self.m[1] * self.middle(q).y)
    }
    #[dissipation]
    fn friction(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * self.brake * q.crank.dt().powi(2)
    }
    #[holonomic]
    fn closure(&self, q: &Coordinates<Self>) -> Vec2 {
        self.pin(q) + self.along(q) - vec2(q.slide, 0.0)
    }
    #[output]
    fn bearing(&self, q: &Coordinates<Self>) -> Expr {
        q.reaction(Self::closure).y
    }
    #[event]
    fn passes_mark(&self, q: &Coordinates<Self>) -> Expr {
        (7.0 * q.crank + 0.3).sin()
    }
    /// Zero at a start from rest.
    #[event]
    fn turns(&self, q: &Coordinates<Self>) -> Expr {
        -q.crank.dt()
    }
}

/// A ball on a soft floor, which pushes where it is touched, in a wind that a spline gives over the height.
#[derive(Clone, Debug, Dynamics)]
#[model(targets(c))]
#[coordinates(x, y)]
pub(crate) struct Ball {
    pub(crate) mass: f64,
    pub(crate) g: f64,
    pub(crate) floor: f64,
    pub(crate) line: f64,
    pub(crate) wind: CubicSpline,
}

#[dynamics]
impl Ball {
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * self.mass * vec2(q.x, q.y).dt().norm_squared()
    }
    #[potential]
    fn gravity(&self, q: &Coordinates<Self>) -> Expr {
        let below = (0.0 - q.y).max(0.0);
        self.mass * self.g * q.y + 0.5 * self.floor * below.powi(2)
    }
    #[force]
    fn blow(&self, q: &Coordinates<Self>) -> Force {
        Force::along(q.x, self.wind.at(q.y))
    }
    #[event]
    fn apex(&self, q: &Coordinates<Self>) -> Expr {
        q.y.dt()
    }
    #[event]
    fn crosses_line(&self, q: &Coordinates<Self>) -> Expr {
        q.x - self.line
    }
}

/// A chain that hangs from a cart.
#[derive(Clone, Debug, Dynamics)]
#[model(targets(c))]
#[coordinates(x: m, theta: [rad; 8])]
#[units(cart: kg, mass: kg, length: m, g: m / s^2)]
pub(crate) struct Chain {
    pub(crate) cart: f64,
    pub(crate) mass: f64,
    pub(crate) length: f64,
    pub(crate) g: f64,
}

#[dynamics]
impl Chain {
    fn joint(&self, q: &Coordinates<Self>, i: usize) -> Vec2 {
        let mut place = vec2(q.x, 0.0);
        for j in 0..i + 1 {
            place += self.length * vec2(q.theta[j].sin(), -q.theta[j].cos());
        }
        place
    }
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        let mut sum = 0.5 * self.cart * q.x.dt().powi(2);
        for i in 0..8 {
            sum += 0.5 * self.mass * self.joint(q, i).dt().norm_squared();
        }
        sum
    }
    #[potential]
    fn gravity(&self, q: &Coordinates<Self>) -> Expr {
        let mut sum = Expr::ZERO;
        for i in 0..8 {
            sum += self.mass * self.g * self.joint(q, i).y;
        }
        sum
    }
}

/// A wagon on a spring, and a hook that may hold it.
#[derive(Clone, Debug, Dynamics)]
#[model(targets(c))]
#[coordinates(x: m)]
#[units(mass: kg, stiffness: N / m, place: m)]
pub(crate) struct Wagon {
    pub(crate) mass: f64,
    pub(crate) stiffness: f64,
    pub(crate) place: f64,
}

#[dynamics]
impl Wagon {
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * self.mass * q.x.dt().powi(2)
    }
    #[potential]
    fn spring(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * self.stiffness * q.x.powi(2)
    }
    #[holonomic(switched)]
    fn hook(&self, q: &Coordinates<Self>) -> Expr {
        q.x - self.place
    }
    #[event]
    fn at_hook(&self, q: &Coordinates<Self>) -> Expr {
        q.x - self.place
    }
}

/// No parameters, no units, and a name that only the flat naming convention allows.
#[derive(Clone, Debug, Dynamics)]
#[model(targets(c))]
#[coordinates(größe)]
pub(crate) struct Fmu {}

#[dynamics]
impl Fmu {
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * q.größe.dt().powi(2)
    }
    #[potential]
    fn well(&self, q: &Coordinates<Self>) -> Expr {
        1.0 - q.größe.cos()
    }
}

/// Names that are used twice: of a parameter and the time, of an output and the energy.
#[derive(Clone, Debug, Dynamics)]
#[model(targets(c))]
#[coordinates(x)]
pub(crate) struct Twice {
    pub(crate) time: f64,
    pub(crate) turn: [[f64; 2]; 2],
}

#[dynamics]
impl Twice {
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * self.time * q.x.dt().powi(2)
    }
    #[potential]
    fn potential(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * (self.turn[0][0] + self.turn[0][1] + self.turn[1][0] + self.turn[1][1]) * q.x.powi(2)
    }
    #[output]
    fn kinetic_energy(&self, q: &Coordinates<Self>) -> Expr {
        2.0 * q.x
    }
}
