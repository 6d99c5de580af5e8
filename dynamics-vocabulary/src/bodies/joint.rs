//! Joints as constraints: what a function with `#[holonomic]` returns.

use crate::bodies::{Frame, PlanarFrame};
use crate::{Expr, Vec3};

/// Joints in space, between a frame `a` fixed in one body and a frame `b` fixed in another:
/// `link.frame(place, rotation)`, or `Frame::at(place)` in the world.
///
/// Each returns expressions that are zero on every motion. The rows for positions come first and are lengths;
/// those for directions have no unit. Axes that are parallel or at right angles are expressed by products of
/// unit vectors, which are also zero with one axis reversed: the start selects the branch.
#[derive(Clone, Copy, Debug)]
pub struct Joint;

impl Joint {
    /// Ball and socket: the origins coincide.
    #[must_use]
    pub fn spherical(a: Frame, b: Frame) -> Vec3 {
        b.origin() - a.origin()
    }

    /// Hinge: the origins coincide, and so do the z axes.
    #[must_use]
    pub fn revolute(a: Frame, b: Frame) -> [Expr; 5] {
        let d = b.origin() - a.origin();
        [d.x, d.y, d.z, a.x().dot(b.z()), a.y().dot(b.z())]
    }

    /// Slide along the common z axis, without turning.
    #[must_use]
    pub fn prismatic(a: Frame, b: Frame) -> [Expr; 5] {
        let d = b.origin() - a.origin();
        [a.x().dot(d), a.y().dot(d), a.x().dot(b.z()), a.y().dot(b.z()), a.x().dot(b.y())]
    }

    /// Slides along the common z axis and turns about it.
    #[must_use]
    pub fn cylindrical(a: Frame, b: Frame) -> [Expr; 4] {
        let d = b.origin() - a.origin();
        [a.x().dot(d), a.y().dot(d), a.x().dot(b.z()), a.y().dot(b.z())]
    }

    /// Cross of Cardan or Hooke: the origins coincide, and the z axes, which carry the cross, stay at right
    /// angles.
    #[must_use]
    pub fn universal(a: Frame, b: Frame) -> [Expr; 4] {
        let d = b.origin() - a.origin();
        [d.x, d.y, d.z, a.z().dot(b.z())]
    }

    /// Plane on plane: the x-y planes coincide.
    #[must_use]
    pub fn planar(a: Frame, b: Frame) -> [Expr; 3] {
        let d = b.origin() - a.origin();
        [a.z().dot(d), a.x().dot(b.z()), a.y().dot(b.z())]
    }

    /// Screw: as `cylindrical`, and a turn of `b` about `a`'s z axis is an advance along it by `lead` (a
    /// length, not zero; negative for a left-handed thread) per turn. The frames coincide where the thread
    /// begins.
    ///
    /// The angle φ is that of the frames themselves, whatever the bodies' coordinates are. The advance z
    /// counts the turns: the last row is lead / τ · sin(τ z / lead − φ), a length. The sine of a difference
    /// avoids computing an angle from an attitude. The row is also zero half a lead away, on the second
    /// thread: the start selects the branch.
    #[must_use]
    pub fn screw(a: Frame, b: Frame, lead: impl Into<Expr>) -> [Expr; 5] {
        let d = b.origin() - a.origin();
        let per_radian = lead.into() / core::f64::consts::TAU;
        let advanced = a.z().dot(d) / per_radian;
        let off = advanced.sin() * a.x().dot(b.x()) - advanced.cos() * a.y().dot(b.x());
        [a.x().dot(d), a.y().dot(d), a.x().dot(b.z()), a.y().dot(b.z()), per_radian * off]
    }

    /// Bolted together: the frames coincide.
    ///
    /// The rows for the attitude are −sin θ n + (1 − cos θ) w for a rotation from `a` to `b` by θ about n.
    /// The first part, the antisymmetric part of the rotation, is also zero at every half turn, with
    /// dependent gradients there. The second part is of second order near θ = 0 and excludes the half turns.
    /// No three regular rows on the rotations have a single zero: w = (0.3, 0.5, 0.7) leaves one more, the
    /// rotation with cot(θ/2) = |w|, 95° about w, which nobody gives by mistake.
    #[must_use]
    pub fn weld(a: Frame, b: Frame) -> [Expr; 6] {
        let d = b.origin() - a.origin();
        let x = a.y().dot(b.z()) - a.z().dot(b.y());
        let y = a.z().dot(b.x()) - a.x().dot(b.z());
        let z = a.x().dot(b.y()) - a.y().dot(b.x());
        let turned = 3.0 - a.x().dot(b.x()) - a.y().dot(b.y()) - a.z().dot(b.z());
        [d.x, d.y, d.z, 0.5 * (x + 0.3 * turned), 0.5 * (y + 0.5 * turned), 0.5 * (z + 0.7 * turned)]
    }

    /// Two wheels in mesh, with these angles and radii: they turn in opposite directions. An internal gear
    /// has a negative radius.
    #[must_use]
    pub fn gear(
        angle: impl Into<Expr>,
        radius: impl Into<Expr>,
        other: impl Into<Expr>,
        other_radius: impl Into<Expr>,
    ) -> Expr {
        radius.into() * angle.into() + other_radius.into() * other.into()
    }

    /// Rack and pinion, or a wheel that rolls on a line: the advance is the radius times the angle.
    #[must_use]
    pub fn rack(advance: impl Into<Expr>, angle: impl Into<Expr>, radius: impl Into<Expr>) -> Expr {
        advance.into() - radius.into() * angle.into()
    }

    /// Two pulleys with one belt, with these angles and radii: they turn in the same direction. A crossed
    /// belt is a `gear`.
    #[must_use]
    pub fn belt(
        angle: impl Into<Expr>,
        radius: impl Into<Expr>,
        other: impl Into<Expr>,
        other_radius: impl Into<Expr>,
    ) -> Expr {
        radius.into() * angle.into() - other_radius.into() * other.into()
    }
}

/// Joints of the plane, between a frame fixed in one body and a frame fixed in another.
#[derive(Clone, Copy, Debug)]
pub struct PlanarJoint;

impl PlanarJoint {
    /// Pin: the origins coincide.
    #[must_use]
    pub fn revolute(a: PlanarFrame, b: PlanarFrame) -> [Expr; 2] {
        let d = b.origin() - a.origin();
        [d.x, d.y]
    }

    /// Slide along `a`'s x axis, without turning.
    #[must_use]
    pub fn prismatic(a: PlanarFrame, b: PlanarFrame) -> [Expr; 2] {
        [a.y().dot(b.origin() - a.origin()), b.angle() - a.angle()]
    }

    /// Pin in a slot along `a`'s x axis.
    #[must_use]
    pub fn slot(a: PlanarFrame, b: PlanarFrame) -> Expr {
        a.y().dot(b.origin() - a.origin())
    }

    /// Bolted together: the frames coincide.
    #[must_use]
    pub fn weld(a: PlanarFrame, b: PlanarFrame) -> [Expr; 3] {
        let d = b.origin() - a.origin();
        [d.x, d.y, b.angle() - a.angle()]
    }
}
