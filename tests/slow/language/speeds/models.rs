//! Models with generalized speeds, and some of them without.

use dynamics::prelude::*;

/// A body that turns about a fixed point, with the components of its angular velocity in its principal axes
/// as speeds; and the same without speeds.
macro_rules! top {
    ($Name:ident $([$speeds:meta] [$kinematic:meta])?) => {
        #[derive(Clone, Debug, Dynamics)]
        #[coordinates(phi: rad, theta: rad, psi: rad)]
        $(#[$speeds])?
        #[units(a: kg * m^2, b: kg * m^2, c: kg * m^2, weight: N, height: m)]
        pub(crate) struct $Name {
            pub(crate) a: f64,
            pub(crate) b: f64,
            pub(crate) c: f64,
            pub(crate) weight: f64,
            pub(crate) height: f64,
        }
        #[dynamics]
        impl $Name {
            fn attitude(&self, q: &Coordinates<Self>) -> Mat3 {
                Mat3::euler(EulerSequence::Zxz, [q.phi, q.theta, q.psi])
            }
            $(#[$kinematic])?
            pub(crate) fn omega(&self, q: &Coordinates<Self>) -> Vec3 {
                self.attitude(q).angular_velocity_in_body()
            }
            #[kinetic]
            fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
                let w = self.omega(q);
                0.5 * (self.a * w.x * w.x + self.b * w.y * w.y + self.c * w.z * w.z)
            }
            #[potential]
            fn potential(&self, q: &Coordinates<Self>) -> Expr {
                self.weight * self.height * self.attitude(q).column(2).z
            }
        }
    };
}
top!(Top [speeds(omega: [rad / s; 3])] [kinematic]);
top!(TopInAngles);

/// A body that flies, its center of mass beside its origin: speeds of its origin and angular velocity, all in
/// its own axes. A thrust follows from a speed.
macro_rules! aircraft {
    ($Name:ident $([$speeds:meta] [$kinematic:meta])?) => {
        #[derive(Clone, Debug, Dynamics)]
        #[coordinates(r: [m; 3], angles: [rad; 3])]
        $(#[$speeds])?
        #[units(mass: kg, center: m, inertia: kg * m^2, gravity: m / s^2, drag: N * s / m)]
        pub(crate) struct $Name {
            pub(crate) mass: f64,
            pub(crate) center: Vec3<f64>,
            pub(crate) inertia: Mat3<f64>,
            pub(crate) gravity: Vec3<f64>,
            pub(crate) drag: f64,
        }
        #[dynamics]
        impl $Name {
            fn body(&self, q: &Coordinates<Self>) -> RigidBody {
                let rotation = Mat3::euler(EulerSequence::Zyx, q.angles);
                let frame = Frame::new(vec3(q.r[0], q.r[1], q.r[2]), rotation);
                RigidBody::new(self.mass, self.center, self.inertia, frame)
            }
            $(#[$kinematic])?
            fn v(&self, q: &Coordinates<Self>) -> Vec3 {
                let frame = self.body(q).frame;
                frame.components_of(frame.origin().dt())
            }
            $(#[$kinematic])?
            #[allow(dead_code, reason = "nothing reads it of the model in coordinates")]
            fn omega(&self, q: &Coordinates<Self>) -> Vec3 {
                self.body(q).frame.angular_velocity_in_body()
            }
            #[kinetic]
            fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
                self.body(q).kinetic_energy()
            }
            #[potential]
            fn weight(&self, q: &Coordinates<Self>) -> Expr {
                self.body(q).potential_energy(self.gravity)
            }
            /// Air that brakes what moves along the body.
            #[force]
            fn air(&self, q: &Coordinates<Self>) -> Force {
                let frame = self.body(q).frame;
                Force::at(frame.origin(), -self.drag * self.v(q).x * frame.x())
            }
        }
    };
}
aircraft!(Aircraft [speeds(v: [m / s; 3], omega: [rad / s; 3])] [kinematic]);
aircraft!(AircraftInAngles);

/// A body in Euler parameters: four coordinates, three speeds, and the constraint on the norm.
macro_rules! satellite {
    ($Name:ident $([$speeds:meta] [$kinematic:meta])?) => {
        #[derive(Clone, Debug, Dynamics)]
        #[coordinates(e: [_; 4])]
        $(#[$speeds])?
        pub(crate) struct $Name {
            pub(crate) inertia: Mat3<f64>,
        }
        #[dynamics]
        impl $Name {
            $(#[$kinematic])?
            pub(crate) fn omega(&self, q: &Coordinates<Self>) -> Vec3 {
                let [e0, e1, e2, e3] = q.e;
                let [d0, d1, d2, d3] = [e0.dt(), e1.dt(), e2.dt(), e3.dt()];
                2.0 * vec3(
                    -e1 * d0 + e0 * d1 + e3 * d2 - e2 * d3,
                    -e2 * d0 - e3 * d1 + e0 * d2 + e1 * d3,
                    -e3 * d0 + e2 * d1 - e1 * d2 + e0 * d3,
                )
            }
            #[kinetic]
            fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
                let w = self.omega(q);
                0.5 * w.dot(self.inertia * w)
            }
            #[holonomic]
            fn unit(&self, q: &Coordinates<Self>) -> Expr {
                EulerParameters::new(q.e).norm_constraint()
            }
        }
    };
}
satellite!(Satellite [speeds(omega: [_; 3])] [kinematic]);
satellite!(SatelliteInParameters);

/// Chaplygin's sleigh in the speed of its skate and its spin.
macro_rules! sleigh {
    ($Name:ident $([$speeds:meta] [$kinematic:meta])?) => {
        #[derive(Clone, Debug, Dynamics)]
        #[coordinates(x: m, y: m, phi: rad)]
        $(#[$speeds])?
        #[units(mass: kg, inertia: kg * m^2, a: m)]
        pub(crate) struct $Name {
            pub(crate) mass: f64,
            pub(crate) inertia: f64,
            pub(crate) a: f64,
        }
        #[dynamics]
        impl $Name {
            fn forward(&self, q: &Coordinates<Self>) -> Vec2 {
                vec2(q.phi.cos(), q.phi.sin())
            }
            fn skate(&self, q: &Coordinates<Self>) -> Vec2 {
                vec2(q.x, q.y) - self.a * self.forward(q)
            }
            #[kinetic]
            fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
                0.5 * self.mass * vec2(q.x, q.y).dt().norm_squared() + 0.5 * self.inertia * q.phi.dt().powi(2)
            }
            #[nonholonomic]
            fn edge(&self, q: &Coordinates<Self>) -> Expr {
                self.skate(q).dt().dot(self.forward(q).perp())
            }
            $(#[$kinematic])?
            pub(crate) fn v(&self, q: &Coordinates<Self>) -> Expr {
                self.skate(q).dt().dot(self.forward(q))
            }
            $(#[$kinematic])?
            pub(crate) fn spin(&self, q: &Coordinates<Self>) -> Expr {
                q.phi.dt()
            }
            #[output]
            fn speed_and_spin(&self, q: &Coordinates<Self>) -> Expr {
                self.v(q) * self.spin(q)
            }
        }
    };
}
sleigh!(Sleigh [speeds(v: m / s, spin: rad / s)] [kinematic]);
sleigh!(SleighInCoordinates);

/// A disk that rolls: its angular velocity in the axes of heading and lean, which do not spin with it.
macro_rules! disk {
    ($Name:ident $([$speeds:meta] [$kinematic:meta])?) => {
        #[derive(Clone, Debug, Dynamics)]
        #[coordinates(x: m, y: m, yaw: rad, lean: rad, spin: rad)]
        $(#[$speeds])?
        #[units(m: kg, r: m, g: m / s^2)]
        pub(crate) struct $Name {
            pub(crate) m: f64,
            pub(crate) r: f64,
            pub(crate) g: f64,
        }
        #[dynamics]
        impl $Name {
            fn leaning(&self, q: &Coordinates<Self>) -> Frame {
                let center = vec3(q.x, q.y, self.r * q.lean.cos());
                Frame::new(center, Mat3::rotation_z(q.yaw) * Mat3::rotation_x(q.lean))
            }
            fn body(&self, q: &Coordinates<Self>) -> RigidBody {
                let across = 0.25 * self.m * self.r.powi(2);
                let inertia = Mat3::diagonal(across, 2.0 * across, across);
                RigidBody::new(
                    self.m, Vec3::ZERO, inertia,
                    self.leaning(q).frame(Vec3::ZERO, Mat3::rotation_y(q.spin))
                )
            }
            $(#[$kinematic])?
            #[allow(dead_code, reason = "nothing reads it of the model in coordinates")]
            pub(crate) fn omega(&self, q: &Coordinates<Self>) -> Vec3 {
                self.leaning(q).components_of(self.body(q).angular_velocity())
            }
            #[kinetic]
            fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
                self.body(q).kinetic_energy()
            }
            #[potential]
            fn weight(&self, q: &Coordinates<Self>) -> Expr {
                self.body(q).potential_energy(-self.g * Vec3::Z)
            }
            #[nonholonomic]
            fn rolling(&self, q: &Coordinates<Self>) -> Vec2 {
                let slip = self.body(q).frame.carried_velocity(self.leaning(q).point(-self.r * Vec3::Z));
                vec2(slip.x, slip.y)
            }
        }
    };
}
disk!(Disk [speeds(omega: [rad / s; 3])] [kinematic]);
disk!(DiskInAngles);

/// A particle on a turntable, in the world's coordinates: speeds are what an observer on the table sees, y
/// ≠ 0.
#[derive(Clone, Debug, Dynamics)]
#[coordinates(x: m, y: m)]
#[speeds(seen: [m / s; 2])]
#[units(m: kg, turning: rad / s, k: N / m)]
pub(crate) struct Turntable {
    pub(crate) m: f64,
    pub(crate) turning: f64,
    pub(crate) k: f64,
}
#[dynamics]
impl Turntable {
    fn table(&self, q: &Coordinates<Self>) -> Frame {
        Frame::turned(Mat3::rotation_z(self.turning * q.t))
    }
    #[kinematic]
    pub(crate) fn seen(&self, q: &Coordinates<Self>) -> Vec2 {
        let seen = self.table(q).velocity_in(vec3(q.x, q.y, 0.0));
        vec2(seen.x, seen.y)
    }
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * self.m * vec2(q.x, q.y).dt().norm_squared()
    }
    #[potential]
    fn spring(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * self.k * vec2(q.x, q.y).norm_squared()
    }
}

/// Two rods on a hinge each, the second angle measured from the first rod: the absolute turning rates are the
/// speeds, whose inertia moves.
#[derive(Clone, Debug, Dynamics)]
#[coordinates(shoulder: rad, elbow: rad)]
#[speeds(upper: rad / s, lower: rad / s)]
#[units(m: kg, l: m, g: m / s^2, motor: N * m)]
pub(crate) struct Rods {
    pub(crate) m: [f64; 2],
    pub(crate) l: [f64; 2],
    pub(crate) g: f64,
    pub(crate) motor: f64,
}
#[dynamics]
impl Rods {
    fn rod(&self, q: &Coordinates<Self>, i: usize) -> Vec2 {
        let angle = if i == 0 { q.shoulder } else { q.shoulder + q.elbow };
        self.l[i] * vec2(angle.sin(), -angle.cos())
    }
    #[kinematic]
    fn upper(&self, q: &Coordinates<Self>) -> Expr {
        q.shoulder.dt()
    }
    #[kinematic]
    fn lower(&self, q: &Coordinates<Self>) -> Expr {
        q.shoulder.dt() + q.elbow.dt()
    }
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        let end = self.rod(q, 0) + self.rod(q, 1);
        0.5 * self.m[0] * self.rod(q, 0).dt().norm_squared() + 0.5 * self.m[1] * end.dt().norm_squared()
    }
    #[potential]
    fn weight(&self, q: &Coordinates<Self>) -> Expr {
        self.g * (self.m[0] * self.rod(q, 0).y + self.m[1] * (self.rod(q, 0) + self.rod(q, 1)).y)
    }
    #[force]
    fn elbow(&self, q: &Coordinates<Self>) -> Force {
        Force::along(q.elbow, self.motor)
    }
}

/// A body that flies, its origin's speeds counted in strides: they say nothing where a stride is 0, and M is
/// as regular as ever.
#[derive(Clone, Debug, Dynamics)]
#[coordinates(r: [m; 3], angles: [rad; 3])]
#[speeds(v: [_; 3], omega: [rad / s; 3])]
pub(crate) struct Strides {
    pub(crate) mass: f64,
    pub(crate) center: Vec3<f64>,
    pub(crate) inertia: Mat3<f64>,
    pub(crate) drag: f64,
    pub(crate) per_metre: f64,
}
#[dynamics]
impl Strides {
    fn body(&self, q: &Coordinates<Self>) -> RigidBody {
        let frame = Frame::new(vec3(q.r[0], q.r[1], q.r[2]), Mat3::euler(EulerSequence::Zyx, q.angles));
        RigidBody::new(self.mass, self.center, self.inertia, frame)
    }
    fn ahead(&self, q: &Coordinates<Self>) -> Vec3 {
        let frame = self.body(q).frame;
        frame.components_of(frame.origin().dt())
    }
    #[kinematic]
    fn v(&self, q: &Coordinates<Self>) -> Vec3 {
        self.per_metre * self.ahead(q)
    }
    #[kinematic]
    fn omega(&self, q: &Coordinates<Self>) -> Vec3 {
        self.body(q).frame.angular_velocity_in_body()
    }
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        self.body(q).kinetic_energy()
    }
    #[force]
    fn air(&self, q: &Coordinates<Self>) -> Force {
        let frame = self.body(q).frame;
        Force::at(frame.origin(), -self.drag * self.ahead(q).x * frame.x())
    }
}
