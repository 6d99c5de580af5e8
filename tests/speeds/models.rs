//! Models with generalized speeds.

use dynamics::prelude::*;

/// A body that turns about a fixed point, with the components of its angular velocity in its principal axes as speeds; and the same without speeds.
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
            fn omega(&self, q: &Coordinates<Self>) -> Vec3 {
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
