//! Rotations about an axis, by sequences of angles and by Euler parameters, and their angular velocity.
//!
//! Rotations are active and right-handed: R r is r turned. Where R carries the components in a body into
//! those in the world, the angular velocity ω of the body has the skew matrix Ṙ Rᵀ in the world's components
//! and Rᵀ Ṙ in the body's (A. A. Shabana, *Dynamics of Multibody Systems*, 5th ed., Cambridge 2020, chapter
//! 2). Where R mirrors, det R = −1, the components along the body's axes are still Rᵀω, but Rᵀ Ṙ = −(Rᵀω)×.

use crate::expr::Expr;
use crate::matrix::Mat3;
use crate::scalar::{Mixed, Scalar, With};
use crate::vector::Vec3;

/// Three axes to turn about, one after another: the six sequences of Tait and Bryan, all axes different, and
/// the six of Euler, the first axis again as the last. 3-1-3 is `Zxz`, 3-2-1 (yaw, pitch, roll) is `Zyx`.
///
/// ```
/// # use dynamics_vocabulary as dynamics;
/// use dynamics::{EulerSequence, Expr, Mat3};
///
/// let [phi, theta, psi] = [0.3, 0.7, -0.2].map(Expr::from);
/// let turned = Mat3::euler(EulerSequence::Zxz, [phi, theta, psi]);
/// let by_hand = Mat3::rotation_z(phi) * Mat3::rotation_x(theta) * Mat3::rotation_z(psi);
/// assert_eq!(turned, by_hand);
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[allow(missing_docs)] // The names say it.
pub enum EulerSequence {
    Xyz,
    Xzy,
    Yxz,
    Yzx,
    Zxy,
    Zyx,
    Xyx,
    Xzx,
    Yxy,
    Yzy,
    Zxz,
    Zyz,
}

impl EulerSequence {
    /// All twelve.
    pub const ALL: [Self; 12] = [
        Self::Xyz,
        Self::Xzy,
        Self::Yxz,
        Self::Yzx,
        Self::Zxy,
        Self::Zyx,
        Self::Xyx,
        Self::Xzx,
        Self::Yxy,
        Self::Yzy,
        Self::Zxz,
        Self::Zyz,
    ];

    /// The axes in order: 0 for x, 1 for y, 2 for z.
    #[must_use]
    pub const fn axes(self) -> [usize; 3] {
        match self {
            Self::Xyz => [0, 1, 2],
            Self::Xzy => [0, 2, 1],
            Self::Yxz => [1, 0, 2],
            Self::Yzx => [1, 2, 0],
            Self::Zxy => [2, 0, 1],
            Self::Zyx => [2, 1, 0],
            Self::Xyx => [0, 1, 0],
            Self::Xzx => [0, 2, 0],
            Self::Yxy => [1, 0, 1],
            Self::Yzy => [1, 2, 1],
            Self::Zxz => [2, 0, 2],
            Self::Zyz => [2, 1, 2],
        }
    }

    /// Whether the last axis is the first again: the sequences of Euler, which are singular where the second
    /// angle is 0 or π; those of Tait and Bryan are where it is ±π/2.
    #[must_use]
    pub const fn is_proper(self) -> bool {
        let [first, _, last] = self.axes();
        first == last
    }
}

impl Mat3 {
    /// Turns vectors about `axis`, of any length but 0, by an angle in rad, right-handed (Rodrigues); NaN for
    /// an axis of length 0.
    #[inline]
    #[must_use]
    pub fn axis_angle(axis: impl Into<Vec3>, angle: impl Into<Expr>) -> Self {
        let axis = axis.into();
        let largest = axis.value().to_array().into_iter().fold(0.0, |m: f64, x| m.max(x.abs()));
        // Squares of other lengths overflow, or vanish.
        let axis = if (1e-140..1e140).contains(&largest) { axis } else { axis / largest };
        let (n, (s, c)) = (axis.normalize(), angle.into().sin_cos());
        Self::outer((1.0 - c) * n, n) + Self::skew(s * n) + Self::diagonal(c, c, c)
    }

    /// Kinetic energy ½ ω·I ω of a body with this attitude. The inertia is about the center of mass, in the
    /// body's components.
    ///
    /// In the compiled model ω is taken in the components that make it shortest. If a body is symmetric about
    /// the axis of its last rotation, the angle of that rotation does not appear.
    #[inline]
    #[must_use]
    pub fn rotational_energy(self, inertia: impl Into<Self>) -> Expr {
        // Squared, the sign that Rᵀ Ṙ has behind a mirror is gone.
        let (rate, [x, y, z]) = (self.dt(), [self.column(0), self.column(1), self.column(2)]);
        let omega = Vec3 { x: z.dot(rate.column(1)), y: x.dot(rate.column(2)), z: y.dot(rate.column(0)) };
        0.5 * omega.dot(inertia.into() * omega)
    }
}

impl<T: Scalar> Mat3<T> {
    /// The matrix a bᵀ: `Mat3::outer(a, b) * c` is a (b·c).
    #[inline(always)]
    #[must_use]
    pub fn outer<B: Scalar>(a: Vec3<T>, b: Vec3<B>) -> Mat3<Mixed<T, B>>
    where
        T: With<B>,
    {
        Mat3::from_rows(b.map(|y| a.x * y), b.map(|y| a.y * y), b.map(|y| a.z * y))
    }

    /// By an angle in rad about the axis of this index.
    #[doc(hidden)]
    #[must_use]
    pub fn about(axis: usize, angle: T) -> Self {
        match axis {
            0 => Self::rotation_x(angle),
            1 => Self::rotation_y(angle),
            _ => Self::rotation_z(angle),
        }
    }

    /// Rotates about axes of the body, which move with it: the second angle is about the second axis after
    /// the first rotation. In rad; R = R₁R₂R₃.
    #[inline]
    #[must_use]
    pub fn euler(sequence: EulerSequence, [a, b, c]: [T; 3]) -> Self {
        let [i, j, k] = sequence.axes();
        Self::about(i, a) * Self::about(j, b) * Self::about(k, c)
    }

    /// Rotates about axes that are fixed in space, in the order of the sequence. In rad; R = R₃R₂R₁.
    #[inline]
    #[must_use]
    pub fn euler_space(sequence: EulerSequence, [a, b, c]: [T; 3]) -> Self {
        let [i, j, k] = sequence.axes();
        Self::about(k, c) * Self::about(j, b) * Self::about(i, a)
    }

    /// The rotation of the Euler parameters e₀ = cos φ/2, (e₁, e₂, e₃) = n sin φ/2, whose squares have the
    /// sum 1. If the sum is s, the result is s times a rotation.
    #[inline]
    #[must_use]
    pub fn euler_parameters([e0, e1, e2, e3]: [T; 4]) -> Self {
        let two = T::ONE + T::ONE;
        let (a, b, c, d) = (e0 * e0, e1 * e1, e2 * e2, e3 * e3);
        Self::from([
            [a + b - c - d, two * (e1 * e2 - e0 * e3), two * (e1 * e3 + e0 * e2)],
            [two * (e1 * e2 + e0 * e3), a - b + c - d, two * (e2 * e3 - e0 * e1)],
            [two * (e1 * e3 - e0 * e2), two * (e2 * e3 + e0 * e1), a - b - c + d],
        ])
    }

    /// Angular velocity of a body with this attitude, in components of the world: ω with ω× = Ṙ Rᵀ, in rad
    /// per unit of time. Meaningless for a matrix that neither rotates nor mirrors.
    #[inline]
    #[must_use]
    pub fn angular_velocity(self) -> Vec3<T> {
        let (rate, rows) = (self.dt(), [self.row(0), self.row(1), self.row(2)]);
        Vec3 { x: rate.row(2).dot(rows[1]), y: rate.row(0).dot(rows[2]), z: rate.row(1).dot(rows[0]) }
    }

    /// Angular velocity of a body with this attitude, in the body's components: Rᵀω, in rad per unit of time,
    /// also if the body's axes are left-handed. Meaningless for a matrix that neither rotates nor mirrors.
    #[inline]
    #[must_use]
    pub fn angular_velocity_in_body(self) -> Vec3<T> {
        self.transpose() * self.angular_velocity()
    }
}
