//! An arm of seven links and seven hinges, each axis at a right angle to the one before.

use core::f64::consts::FRAC_PI_2;

use dynamics::prelude::*;

/// The arm, with these sines if others are wanted.
macro_rules! arm_of_seven_hinges {
    ($name:ident $(, $sines:ident)?) => {
        /// The arm; angles are zero where all links stand upright. Forces come from motors at the hinges.
        #[derive(Clone, Debug, Dynamics)]
        $(#[model(sin_cos = $sines)])?
        #[coordinates(angles: [rad; 7])]
        #[inputs(motors: [N * m; 7])]
        #[units(masses: kg, centers: m, inertia: kg * m^2, hinges: m, g: m / s^2)]
        pub(crate) struct $name {
            /// Mass of each link.
            pub(crate) masses: [f64; 7],
            /// Centers of mass in the links.
            pub(crate) centers: [Vec3<f64>; 7],
            /// Inertia of any link about its center of mass.
            pub(crate) inertia: Mat3<f64>,
            /// Hinges, each in the link before; the axis is z of the link that it carries.
            pub(crate) hinges: [Vec3<f64>; 7],
            /// Gravity, against z.
            pub(crate) g: f64,
        }

        #[dynamics]
        impl $name {
            fn link(&self, q: &Coordinates<Self>, i: usize) -> RigidBody {
                let mut frame = Frame::world();
                for k in 0..=i {
                    let quarter = if k == 0 {
                        0.0
                    } else if k % 2 == 0 {
                        FRAC_PI_2
                    } else {
                        -FRAC_PI_2
                    };
                    frame =
                        frame.frame(
                            self.hinges[k],
                            Mat3::rotation_x(quarter) * Mat3::rotation_z(q.angles[k])
                        );
                }
                RigidBody::new(self.masses[i], self.centers[i], self.inertia, frame)
            }
            #[kinetic]
            fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
                let mut sum = Expr::ZERO;
                for i in 0..7 {
                    sum += self.link(q, i).kinetic_energy();
                }
                sum
            }
            #[potential]
            fn weight(&self, q: &Coordinates<Self>) -> Expr {
                let mut sum = Expr::ZERO;
                for i in 0..7 {
                    sum += self.link(q, i).potential_energy(-self.g * Vec3::Z);
                }
                sum
            }
            #[force]
            fn drive(&self, q: &Coordinates<Self>) -> Force {
                let mut sum = Force::along(q.angles[0], q.motors[0]);
                for i in 1..7 {
                    sum += Force::along(q.angles[i], q.motors[i]);
                }
                sum
            }
            #[drawing]
            fn drawing(&self, q: &Coordinates<Self>) -> Drawing {
                let mut drawing = Drawing::new().cylinder([0.0; 3], self.link(q, 0).frame.origin(), 0.06);
                for i in 0..7 {
                    let (frame, width) = (self.link(q, i).frame, 0.04 - 0.003 * i as f64);
                    let next = if i < 6 {
                        self.link(q, i + 1).frame.origin()
                    } else {
                        frame.point(2.0 * self.centers[i])
                    };
                    drawing = drawing.cylinder(frame.origin(), next, width).disc(frame.origin(), 1.4 * width);
                }
                let last = self.link(q, 6).frame;
                drawing.color(Color::Red).trace("hand", last.point(2.0 * self.centers[6]))
            }
        }
    };
}

arm_of_seven_hinges!(Arm);

/// The arm of the tables, in SI units.
pub(crate) fn arm() -> Arm {
    let numbers = [1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0];
    Arm {
        masses: numbers.map(|i| 3.0 - 0.3 * i),
        centers: numbers.map(|i| Vec3::new(0.01, if i % 2.0 == 0.0 { 0.02 } else { -0.02 }, 0.1)),
        inertia: Mat3::from([[0.02, 0.001, 0.002], [0.001, 0.018, 0.0015], [0.002, 0.0015, 0.01]]),
        hinges: numbers.map(|i| Vec3::new(0.02, -0.01 * i, 0.2 + 0.01 * i)),
        g: 9.81,
    }
}
