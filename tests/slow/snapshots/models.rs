//! One small model for every kind of structure that the derivation tells apart.

use crate::double_pendulum;

use dynamics::prelude::*;

pub(crate) use double_pendulum::DoublePendulum;

macro_rules! pendulum {
    ($name:ident) => {
        /// One degree of freedom, with dissipation.
        #[derive(Clone, Debug, Dynamics)]
        #[model(targets(c))]
        #[coordinates(theta: rad)]
        #[units(m: kg, l: m, g: m / s^2, c: N * m * s)]
        pub(crate) struct $name {
            pub(crate) m: f64,
            pub(crate) l: f64,
            pub(crate) g: f64,
            pub(crate) c: f64,
        }

        #[dynamics]
        impl $name {
            fn bob(&self, q: &Coordinates<Self>) -> Vec2 {
                self.l * vec2(q.theta.sin(), -q.theta.cos())
            }
            #[kinetic]
            fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
                0.5 * self.m * self.bob(q).dt().norm_squared()
            }
            #[potential]
            fn gravity(&self, q: &Coordinates<Self>) -> Expr {
                self.m * self.g * self.bob(q).y
            }
            #[dissipation]
            fn bearing(&self, q: &Coordinates<Self>) -> Expr {
                0.5 * self.c * q.theta.dt().powi(2)
            }
        }
    };
}
pendulum!(Pendulum);
pendulum!(Twin);

/// An input.
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
    fn tip(&self, q: &Coordinates<Self>) -> Vec2 {
        vec2(q.x, 0.0) + self.l * vec2(q.theta.sin(), -q.theta.cos())
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
    fn drive(&self, q: &Coordinates<Self>) -> Force {
        Force::along(q.x, q.push)
    }
}

/// Three dimensions, an ignorable angle, a diagonal mass matrix.
#[derive(Clone, Debug, Dynamics)]
#[model(targets(c))]
#[coordinates(theta: rad, phi: rad)]
pub(crate) struct SphericalPendulum {
    pub(crate) m: f64,
    pub(crate) l: f64,
    pub(crate) g: f64,
}

#[dynamics]
impl SphericalPendulum {
    fn bob(&self, q: &Coordinates<Self>) -> Vec3 {
        let ((s, c), (sp, cp)) = (q.theta.sin_cos(), q.phi.sin_cos());
        self.l * vec3(s * cp, s * sp, -c)
    }
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * self.m * self.bob(q).dt().norm_squared()
    }
    #[potential]
    fn gravity(&self, q: &Coordinates<Self>) -> Expr {
        self.m * self.g * self.bob(q).z
    }
}

/// Arrays and loops.
#[derive(Clone, Debug, Dynamics)]
#[model(targets(c))]
#[coordinates(x: m, theta: [rad; 4])]
#[units(cart: kg, mass: kg, length: m, g: m / s^2)]
pub(crate) struct Chain {
    pub(crate) cart: f64,
    pub(crate) mass: [f64; 4],
    pub(crate) length: [f64; 4],
    pub(crate) g: f64,
}

#[dynamics]
impl Chain {
    pub(crate) fn link(&self, q: &Coordinates<Self>, i: usize) -> Vec2 {
        self.length[i] * vec2(q.theta[i].sin(), -q.theta[i].cos())
    }
    pub(crate) fn place(&self, q: &Coordinates<Self>, i: usize) -> Vec2 {
        let mut place = vec2(q.x, 0.0);
        for k in 0..=i {
            place += self.link(q, k);
        }
        place
    }
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        let mut sum = 0.5 * self.cart * q.x.dt().powi(2);
        for i in 0..4 {
            sum += 0.5 * self.mass[i] * self.place(q, i).dt().norm_squared();
        }
        sum
    }
    #[potential]
    fn gravity(&self, q: &Coordinates<Self>) -> Expr {
        let mut sum = Expr::ZERO;
        for i in 0..4 {
            sum += self.mass[i] * self.g * self.place(q, i).y;
        }
        sum
    }
}

/// A smooth function.
#[derive(Clone, Debug, Dynamics)]
#[model(targets(c))]
#[coordinates(x: m)]
pub(crate) struct Bead {
    pub(crate) m: f64,
    pub(crate) g: f64,
    pub(crate) track: CubicSpline,
}

#[dynamics]
impl Bead {
    fn place(&self, q: &Coordinates<Self>) -> Vec2 {
        vec2(q.x, self.track.at(q.x))
    }
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * self.m * self.place(q).dt().norm_squared()
    }
    #[potential]
    fn gravity(&self, q: &Coordinates<Self>) -> Expr {
        self.m * self.g * self.place(q).y
    }
}

/// Explicit time.
#[derive(Clone, Debug, Dynamics)]
#[model(targets(c))]
#[coordinates(theta: rad)]
#[units(m: kg, l: m, g: m / s^2, amplitude: m, omega: rad / s)]
pub(crate) struct DrivenPivot {
    pub(crate) m: f64,
    pub(crate) l: f64,
    pub(crate) g: f64,
    pub(crate) amplitude: f64,
    pub(crate) omega: f64,
}

#[dynamics]
impl DrivenPivot {
    fn bob(&self, q: &Coordinates<Self>) -> Vec2 {
        vec2(0.0, self.amplitude * (self.omega * q.t).cos()) + self.l * vec2(q.theta.sin(), -q.theta.cos())
    }
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * self.m * self.bob(q).dt().norm_squared()
    }
    #[potential]
    fn gravity(&self, q: &Coordinates<Self>) -> Expr {
        self.m * self.g * self.bob(q).y
    }
}

/// A constant mass matrix with a decoupled part.
#[derive(Clone, Debug, Dynamics)]
#[model(targets(c))]
#[coordinates(x, gap, y)]
pub(crate) struct Masses {
    pub(crate) m: [f64; 3],
    pub(crate) k: f64,
    pub(crate) c: f64,
}

#[dynamics]
impl Masses {
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        let second = q.x + q.gap;
        0.5 * (self.m[0] * q.x.dt().powi(2) + self.m[1] * second.dt().powi(2) + self.m[2] * q.y.dt().powi(2))
    }
    #[potential]
    fn springs(&self, q: &Coordinates<Self>) -> Expr {
        self.k * (0.5 * q.gap.powi(2) + 0.25 * q.y.powi(4))
    }
    #[dissipation]
    fn damper(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * self.c * q.gap.dt().powi(2)
    }
}

/// Branches.
#[derive(Clone, Debug, Dynamics)]
#[model(targets(c))]
#[coordinates(x: m)]
#[units(m: kg, k: N / m, c: N * s / m, gap: m)]
pub(crate) struct Contact {
    pub(crate) m: f64,
    pub(crate) k: f64,
    pub(crate) c: f64,
    pub(crate) gap: f64,
}

#[dynamics]
impl Contact {
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * self.m * q.x.dt().powi(2)
    }
    #[potential]
    fn wall(&self, q: &Coordinates<Self>) -> Expr {
        let depth = (q.x - self.gap).max(0.0);
        0.5 * self.k * depth.powi(2)
    }
    #[dissipation]
    fn mud(&self, q: &Coordinates<Self>) -> Expr {
        if q.x > self.gap { 0.5 * self.c * q.x.dt().powi(2) } else { Expr::ZERO }
    }
}

/// A Lagrangian that is not T − V.
#[derive(Clone, Debug, Dynamics)]
#[model(targets(c))]
#[coordinates(x: m, y: m, z: m)]
#[units(mass: kg, charge: C, magnetic: T, electric: V / m)]
pub(crate) struct Particle {
    pub(crate) mass: f64,
    pub(crate) charge: f64,
    pub(crate) magnetic: Vec3<f64>,
    pub(crate) electric: Vec3<f64>,
}

#[dynamics]
impl Particle {
    #[lagrangian]
    fn lagrangian(&self, q: &Coordinates<Self>) -> Expr {
        let place = vec3(q.x, q.y, q.z);
        let velocity = place.dt();
        let vector_potential = 0.5 * self.magnetic.cross(place);
        let potential = -self.electric.dot(place);
        0.5 * self.mass * velocity.norm_squared() + self.charge * (velocity.dot(vector_potential) - potential)
    }
}

/// Rotations and a tensor; body-frame angular velocities are no time derivatives.
#[derive(Clone, Debug, Dynamics)]
#[model(targets(c))]
#[coordinates(yaw: rad, tilt: rad, spin: rad)]
pub(crate) struct RigidBody {
    pub(crate) inertia: Mat3<f64>,
}

#[dynamics]
impl RigidBody {
    /// Angular velocity in the frame of the body, from Rᵀ Ṙ.
    pub(crate) fn omega(&self, q: &Coordinates<Self>) -> Vec3 {
        let r = Mat3::rotation_z(q.yaw) * Mat3::rotation_x(q.tilt) * Mat3::rotation_z(q.spin);
        let turning = r.transpose() * r.dt();
        vec3(turning[(2, 1)], turning[(0, 2)], turning[(1, 0)])
    }
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        let omega = self.omega(q);
        0.5 * omega.dot(self.inertia * omega)
    }
}

/// A force that is no potential, an output and an event.
#[derive(Clone, Debug, Dynamics)]
#[model(targets(c))]
#[coordinates(x: m, y: m)]
#[units(mass: kg, k: kg / m, g: m / s^2)]
pub(crate) struct Ball {
    pub(crate) mass: f64,
    pub(crate) k: f64,
    pub(crate) g: f64,
}

#[dynamics]
impl Ball {
    fn place(&self, q: &Coordinates<Self>) -> Vec2 {
        vec2(q.x, q.y)
    }
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * self.mass * self.place(q).dt().norm_squared()
    }
    #[potential]
    fn gravity(&self, q: &Coordinates<Self>) -> Expr {
        self.mass * self.g * q.y
    }
    #[force]
    fn drag(&self, q: &Coordinates<Self>) -> Force {
        let velocity = self.place(q).dt();
        Force::at(self.place(q), -self.k * velocity.norm() * velocity)
    }
    #[output]
    fn speed(&self, q: &Coordinates<Self>) -> Expr {
        self.place(q).dt().norm()
    }
    #[event]
    fn ground(&self, q: &Coordinates<Self>) -> Expr {
        q.y
    }
}

/// A conserved momentum that depends on a coordinate.
#[derive(Clone, Debug, Dynamics)]
#[model(targets(c))]
#[coordinates(r: m, phi: rad)]
#[units(m: kg, hub: kg * m^2)]
pub(crate) struct Tube {
    pub(crate) m: f64,
    pub(crate) hub: f64,
}

#[dynamics]
impl Tube {
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        let place = q.r * vec2(q.phi.cos(), q.phi.sin());
        0.5 * self.m * place.dt().norm_squared() + 0.5 * self.hub * q.phi.dt().powi(2)
    }
}

/// A pendulum in Cartesian coordinates: the rod is a constraint.
#[derive(Clone, Debug, Dynamics)]
#[model(targets(c))]
#[coordinates(x: m, y: m)]
#[units(m: kg, l: m, g: m / s^2)]
pub(crate) struct CartesianPendulum {
    pub(crate) m: f64,
    pub(crate) l: f64,
    pub(crate) g: f64,
}

#[dynamics]
impl CartesianPendulum {
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * self.m * vec2(q.x, q.y).dt().norm_squared()
    }
    #[potential]
    fn gravity(&self, q: &Coordinates<Self>) -> Expr {
        self.m * self.g * q.y
    }
    #[holonomic]
    fn rod(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * (vec2(q.x, q.y).norm_squared() - self.l * self.l)
    }
    #[output]
    fn tension(&self, q: &Coordinates<Self>) -> Expr {
        -self.l * q.reaction(Self::rod)
    }
}

/// A slider-crank of uniform rods, one loop closed by a vector.
#[derive(Clone, Debug, Dynamics)]
#[model(targets(c))]
#[coordinates(crank: rad, rod: rad, slide: m)]
#[units(m: kg, r: m, l: m, g: m / s^2)]
#[nominal(m = [1.0, 2.0, 3.0], r = 0.5, l = 1.5)]
pub(crate) struct SliderCrank {
    pub(crate) m: [f64; 3],
    pub(crate) r: f64,
    pub(crate) l: f64,
    pub(crate) g: f64,
}

#[dynamics]
impl SliderCrank {
    fn pin(&self, q: &Coordinates<Self>) -> Vec2 {
        self.r * vec2(q.crank.cos(), q.crank.sin())
    }
    fn along(&self, q: &Coordinates<Self>) -> Vec2 {
        self.l * vec2(q.rod.cos(), -q.rod.sin())
    }
    pub(crate) fn middle(&self, q: &Coordinates<Self>) -> Vec2 {
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
    #[holonomic]
    fn closure(&self, q: &Coordinates<Self>) -> Vec2 {
        self.pin(q) + self.along(q) - vec2(q.slide, 0.0)
    }
}

/// A sleigh on a knife edge, its centre of mass ahead of the edge.
#[derive(Clone, Debug, Dynamics)]
#[model(targets(c))]
#[coordinates(x: m, y: m, heading: rad)]
#[units(m: kg, inertia: kg * m^2, ahead: m)]
pub(crate) struct Sleigh {
    pub(crate) m: f64,
    pub(crate) inertia: f64,
    pub(crate) ahead: f64,
}

#[dynamics]
impl Sleigh {
    fn direction(&self, q: &Coordinates<Self>) -> Vec2 {
        vec2(q.heading.cos(), q.heading.sin())
    }
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        let centre = vec2(q.x, q.y) + self.ahead * self.direction(q);
        0.5 * self.m * centre.dt().norm_squared() + 0.5 * self.inertia * q.heading.dt().powi(2)
    }
    #[nonholonomic]
    fn edge(&self, q: &Coordinates<Self>) -> Expr {
        self.direction(q).perp().dot(vec2(q.x, q.y).dt())
    }
}

/// A block that slides on an incline or sticks to it.
#[derive(Clone, Debug, Dynamics)]
#[model(targets(c))]
#[coordinates(x: m, y: m)]
#[units(m: kg, g: m / s^2)]
pub(crate) struct Block {
    pub(crate) m: f64,
    pub(crate) g: f64,
    pub(crate) slope: f64,
    pub(crate) friction: f64,
}

#[dynamics]
impl Block {
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * self.m * vec2(q.x, q.y).dt().norm_squared()
    }
    #[potential]
    fn gravity(&self, q: &Coordinates<Self>) -> Expr {
        self.m * self.g * (q.y * self.slope.cos() - q.x * self.slope.sin())
    }
    #[holonomic]
    fn floor(&self, q: &Coordinates<Self>) -> Expr {
        q.y
    }
    #[nonholonomic(switched, integrable)]
    fn stick(&self, q: &Coordinates<Self>) -> Expr {
        q.x.dt()
    }
    #[force]
    fn rubbing(&self, q: &Coordinates<Self>) -> Force {
        Force::along(q.x, -self.friction * q.reaction(Self::floor) * q.slip(Self::stick))
    }
    #[event]
    fn breakaway(&self, q: &Coordinates<Self>) -> Expr {
        self.friction * q.reaction(Self::floor) - q.reaction(Self::stick).abs()
    }
}
