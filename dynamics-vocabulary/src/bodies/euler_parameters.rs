//! Euler parameters: four coordinates without a singularity, and one constraint.

use crate::{Expr, Mat3, Vec3};

/// Euler parameters, a unit quaternion: e₀ = cos φ/2 and (e₁, e₂, e₃) = n sin φ/2 of a turn by φ about n.
///
/// As coordinates `e: [_; 4]` they need their norm constraint:
///
/// ```text
/// #[holonomic]
/// fn unit(&self, q: &Coordinates<Self>) -> Expr {
///     EulerParameters::new(q.e).norm_constraint()
/// }
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct EulerParameters {
    e: [Expr; 4],
}

impl EulerParameters {
    /// From (e₀, e₁, e₂, e₃).
    #[must_use]
    pub fn new(e: [Expr; 4]) -> Self {
        Self { e }
    }

    /// e₀² + e₁² + e₂² + e₃² − 1, which is zero on every motion.
    #[must_use]
    pub fn norm_constraint(self) -> Expr {
        let [e0, e1, e2, e3] = self.e;
        e0 * e0 + e1 * e1 + e2 * e2 + e3 * e3 - 1.0
    }

    /// The rotation that they stand for.
    #[must_use]
    pub fn rotation(self) -> Mat3 {
        Mat3::euler_parameters(self.e)
    }

    /// Angular velocity in the world's components.
    #[must_use]
    pub fn angular_velocity(self) -> Vec3 {
        self.rotation().angular_velocity()
    }

    /// Angular velocity in the body's components.
    #[must_use]
    pub fn angular_velocity_in_body(self) -> Vec3 {
        self.rotation().angular_velocity_in_body()
    }
}
