//! N square windows in a row, in absolute coordinates: the model of IFToMM problem A02, for any N.

use dynamics::model::Vector;
use dynamics::prelude::*;
use nalgebra::{DMatrix, DVector};

use crate::support::Kkt;

/// What the tests need of the models, whatever their number of windows.
pub(crate) trait Windows: Simulate {
    /// The model with published parameters.
    fn published() -> Self;
    /// Centres and angles of all rods.
    fn state_of(&self, rods: &[[f64; 3]], rates: &[[f64; 3]]) -> Self::State;
}

/// 2N + 1 uniform rods of unit length: N + 1 that stand on the ground, and N between their tops. Each has the
/// coordinates of its centre and its angle; every joint is a pair of rows: 3 (2N + 1) coordinates, 2 (3N + 1)
/// rows, one degree of freedom, N more where the rods lie in one line.
macro_rules! windows {
    (
        $name:ident, windows: $windows:literal,
        standing: $standing:literal,
        rods: $rods:literal,
        between: $between:literal
    ) => {
        /// N windows in absolute coordinates.
        #[derive(Clone, Debug, Dynamics)]
        #[coordinates(x: [m; $rods], y: [m; $rods], angle: [rad; $rods])]
        #[units(mass: kg, length: m, g: m / s^2)]
        pub(crate) struct $name {
            pub(crate) mass: f64,
            pub(crate) length: f64,
            pub(crate) g: f64,
        }

        #[dynamics]
        impl $name {
            fn centre(&self, q: &Coordinates<Self>, rod: usize) -> Vec2 {
                vec2(q.x[rod], q.y[rod])
            }
            fn half(&self, q: &Coordinates<Self>, rod: usize) -> Vec2 {
                0.5 * self.length * vec2(q.angle[rod].cos(), q.angle[rod].sin())
            }
            #[kinetic]
            fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
                let inertia = self.mass * self.length.powi(2) / 12.0;
                let mut sum = Expr::ZERO;
                for rod in 0..$rods {
                    sum += 0.5 * self.mass * self.centre(q, rod).dt().norm_squared()
                        + 0.5 * inertia * q.angle[rod].dt().powi(2);
                }
                sum
            }
            #[potential]
            fn gravity(&self, q: &Coordinates<Self>) -> Expr {
                let mut sum = Expr::ZERO;
                for rod in 0..$rods {
                    sum += self.mass * self.g * q.y[rod];
                }
                sum
            }
            /// Rod i stands at (i, 0).
            #[holonomic]
            fn ground(&self, q: &Coordinates<Self>) -> [Vec2; $standing] {
                let mut joints = [Vec2::ZERO; $standing];
                for i in 0..$standing {
                    joints[i] = self.centre(q, i) - self.half(q, i) - vec2(i as f64 * self.length, 0.0);
                }
                joints
            }
            /// Rod N + 1 + j begins at the top of rod j and ends at the top of rod j + 1.
            #[holonomic]
            fn corner(&self, q: &Coordinates<Self>) -> [Vec2; $between] {
                let mut joints = [Vec2::ZERO; $between];
                for j in 0..$windows {
                    let beam = $standing + j;
                    let top = self.centre(q, j) + self.half(q, j);
                    let next = self.centre(q, j + 1) + self.half(q, j + 1);
                    joints[2 * j] = self.centre(q, beam) - self.half(q, beam) - top;
                    joints[2 * j + 1] = self.centre(q, beam) + self.half(q, beam) - next;
                }
                joints
            }
        }

        impl $crate::windows::Windows for $name {
            fn published() -> Self {
                Self { mass: 1.0, length: 1.0, g: 9.81 }
            }
            fn state_of(&self, rods: &[[f64; 3]], rates: &[[f64; 3]]) -> State<Self> {
                let part = |k: usize| std::array::from_fn(|i| rods[i][k]);
                let rate = |k: usize| std::array::from_fn(|i| rates[i][k]);
                let builder = self.state().x(part(0)).y(part(1)).angle(part(2));
                builder.x_rate(rate(0)).y_rate(rate(1)).angle_rate(rate(2)).build().expect("rods that meet")
            }
        }
    };
}
pub(crate) use windows;

/// The branch of the reference: all standing rods at the angle θ, the beams level.
pub(crate) fn parallel<M: Windows>(model: &M, theta: f64, rate: f64) -> M::State {
    let windows = (M::Rows::LEN / 2 - 1) / 3;
    let (s, c) = theta.sin_cos();
    let stands = (0..=windows).map(|i| [i as f64 + 0.5 * c, 0.5 * s, theta]);
    let beams = (0..windows).map(|j| [j as f64 + 0.5 + c, s, 0.0]);
    let rods: Vec<_> = stands.chain(beams).collect();
    let moving = (0..=windows).map(|_| [-0.5 * s * rate, 0.5 * c * rate, rate]);
    let carried = (0..windows).map(|_| [-s * rate, c * rate, 0.0]);
    let rates: Vec<_> = moving.chain(carried).collect();
    model.state_of(&rods, &rates)
}

/// θ̈ of the reference: ((N + 1)/3 + N) θ̈ = −((N + 1)/2 + N) g cos θ.
pub(crate) fn angular_acceleration(windows: usize, theta: f64) -> f64 {
    let n = windows as f64;
    -((n + 1.0) / 2.0 + n) / ((n + 1.0) / 3.0 + n) * 9.81 * theta.cos()
}

/// M, Q, Φ_q and γ by hand, for unit lengths and masses; q = (x…, y…, angle…).
pub(crate) fn by_hand<M: Windows>(state: &M::State) -> Kkt {
    let n = M::Vector::LEN;
    let rods = n / 3;
    let windows = (rods - 1) / 2;
    let (q, u) = (state.q().as_slice(), state.u().as_slice());
    let mut mass = DMatrix::identity(n, n);
    let mut force = DVector::zeros(n);
    for rod in 0..rods {
        mass[(2 * rods + rod, 2 * rods + rod)] = 1.0 / 12.0;
        force[rods + rod] = -9.81;
    }
    let rows = M::Rows::LEN;
    let (mut jacobian, mut gamma) = (DMatrix::zeros(rows, n), DVector::zeros(rows));
    // An end of a rod enters a joint with a sign: its centre, and ±½ (cos, sin) of its angle.
    let mut end = |joint: usize, rod: usize, side: f64, sign: f64| {
        let angle = q[2 * rods + rod];
        let (s, c) = angle.sin_cos();
        let rate = u[2 * rods + rod];
        let arm = 0.5 * side * sign;
        jacobian[(2 * joint, rod)] = sign;
        jacobian[(2 * joint + 1, rods + rod)] = sign;
        jacobian[(2 * joint, 2 * rods + rod)] = -arm * s;
        jacobian[(2 * joint + 1, 2 * rods + rod)] = arm * c;
        gamma[2 * joint] += arm * c * rate * rate;
        gamma[2 * joint + 1] += arm * s * rate * rate;
    };
    for i in 0..=windows {
        end(i, i, -1.0, 1.0);
    }
    for j in 0..windows {
        let (beam, joint) = (windows + 1 + j, windows + 1 + 2 * j);
        end(joint, beam, -1.0, 1.0);
        end(joint, j, 1.0, -1.0);
        end(joint + 1, beam, 1.0, 1.0);
        end(joint + 1, j + 1, 1.0, -1.0);
    }
    Kkt { mass, force, jacobian, gamma }
}
