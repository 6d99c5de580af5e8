//! Inertia of common solids of uniform density, about their centers of mass.

use crate::{Expr, Mat3, Vec3};

/// Inertia matrices of solids of uniform density, about the center of mass. The axis of symmetry, if there is
/// one, is z.
///
/// In a model they are ordinary expressions: `Inertia::cylinder(self.m, self.r, self.h)` is computed once per
/// model. (Formulas: E. J. Routh, *Elementary Rigid Dynamics*, 7th ed., chapter 1.)
#[derive(Clone, Copy, Debug)]
pub struct Inertia;

impl Inertia {
    /// Box with edges a, b, c along x, y, z.
    #[must_use]
    pub fn cuboid(mass: impl Into<Expr>, a: impl Into<Expr>, b: impl Into<Expr>, c: impl Into<Expr>) -> Mat3 {
        let (m, a, b, c) = (mass.into() / 12.0, a.into().powi(2), b.into().powi(2), c.into().powi(2));
        Mat3::diagonal(m * (b + c), m * (c + a), m * (a + b))
    }

    /// Cylinder about z; a disk where the height is 0.
    #[must_use]
    pub fn cylinder(mass: impl Into<Expr>, radius: impl Into<Expr>, height: impl Into<Expr>) -> Mat3 {
        let (m, r, h) = (mass.into() / 12.0, radius.into().powi(2), height.into().powi(2));
        let across = m * (3.0 * r + h);
        Mat3::diagonal(across, across, 6.0 * m * r)
    }

    /// Tube about z, between two radii; a hoop where these are equal and the height is 0.
    #[must_use]
    pub fn tube(
        mass: impl Into<Expr>,
        inner: impl Into<Expr>,
        outer: impl Into<Expr>,
        height: impl Into<Expr>,
    ) -> Mat3 {
        let (m, r, h) =
            (mass.into() / 12.0, inner.into().powi(2) + outer.into().powi(2), height.into().powi(2));
        let across = m * (3.0 * r + h);
        Mat3::diagonal(across, across, 6.0 * m * r)
    }

    /// Full sphere.
    #[must_use]
    pub fn sphere(mass: impl Into<Expr>, radius: impl Into<Expr>) -> Mat3 {
        let i = 0.4 * mass.into() * radius.into().powi(2);
        Mat3::diagonal(i, i, i)
    }

    /// Thin spherical shell.
    #[must_use]
    pub fn shell(mass: impl Into<Expr>, radius: impl Into<Expr>) -> Mat3 {
        let i = 2.0 * mass.into() * radius.into().powi(2) / 3.0;
        Mat3::diagonal(i, i, i)
    }

    /// Full cone about z; its center of mass is a quarter of the height above the base.
    #[must_use]
    pub fn cone(mass: impl Into<Expr>, radius: impl Into<Expr>, height: impl Into<Expr>) -> Mat3 {
        let (m, r, h) = (0.0375 * mass.into(), radius.into().powi(2), height.into().powi(2));
        let across = m * (4.0 * r + h);
        Mat3::diagonal(across, across, 8.0 * m * r)
    }

    /// Half of a full sphere, the flat side across z; its center of mass is ⅜ of the radius above that.
    #[must_use]
    pub fn hemisphere(mass: impl Into<Expr>, radius: impl Into<Expr>) -> Mat3 {
        let square = mass.into() * radius.into().powi(2);
        let across = 83.0 / 320.0 * square;
        Mat3::diagonal(across, across, 0.4 * square)
    }

    /// Half of a full cylinder about z, the flat side across x; its center of mass is 4 r/(3π) before that.
    #[must_use]
    pub fn half_cylinder(mass: impl Into<Expr>, radius: impl Into<Expr>, height: impl Into<Expr>) -> Mat3 {
        let (m, r, h) = (mass.into() / 12.0, radius.into().powi(2), height.into().powi(2));
        let nearer = 64.0 / (3.0 * core::f64::consts::PI * core::f64::consts::PI) * r;
        let across = 3.0 * r + h;
        Mat3::diagonal(m * across, m * (across - nearer), m * (6.0 * r - nearer))
    }

    /// Thin ring about z: a hoop.
    #[must_use]
    pub fn ring(mass: impl Into<Expr>, radius: impl Into<Expr>) -> Mat3 {
        let across = 0.5 * mass.into() * radius.into().powi(2);
        Mat3::diagonal(across, across, 2.0 * across)
    }

    /// Thin triangular plate with these corners, from any point; its center of mass is their mean. The plate
    /// has the inertia of three masses m/12 in the corners and ¾ m in that center.
    #[must_use]
    pub fn triangle(
        mass: impl Into<Expr>,
        a: impl Into<Vec3>,
        b: impl Into<Vec3>,
        c: impl Into<Vec3>,
    ) -> Mat3 {
        let (m, a, b, c) = (mass.into() / 12.0, a.into(), b.into(), c.into());
        let center = (a + b + c) / 3.0;
        Inertia::offset(m, a - center) + Inertia::offset(m, b - center) + Inertia::offset(m, c - center)
    }

    /// Thin rod along z. It has no inertia about its axis, so a coordinate for its rotation about it would
    /// have none.
    #[must_use]
    pub fn rod(mass: impl Into<Expr>, length: impl Into<Expr>) -> Mat3 {
        let across = mass.into() * length.into().powi(2) / 12.0;
        Mat3::diagonal(across, across, 0.0 * across)
    }

    /// Thin rectangular plate with edges a along x, b along y.
    #[must_use]
    pub fn plate(mass: impl Into<Expr>, a: impl Into<Expr>, b: impl Into<Expr>) -> Mat3 {
        let (m, a, b) = (mass.into() / 12.0, a.into().powi(2), b.into().powi(2));
        Mat3::diagonal(m * b, m * a, m * (a + b))
    }

    /// Full ellipsoid with semi-axes a, b, c along x, y, z.
    #[must_use]
    pub fn ellipsoid(
        mass: impl Into<Expr>,
        a: impl Into<Expr>,
        b: impl Into<Expr>,
        c: impl Into<Expr>,
    ) -> Mat3 {
        let (m, a, b, c) = (0.2 * mass.into(), a.into().powi(2), b.into().powi(2), c.into().powi(2));
        Mat3::diagonal(m * (b + c), m * (c + a), m * (a + b))
    }

    /// Inertia of a point mass at this distance d from the reference point: m (d·d 1 − d dᵀ), the parallel
    /// axis theorem.
    #[must_use]
    pub fn offset(mass: impl Into<Expr>, distance: impl Into<Vec3>) -> Mat3 {
        let (m, d) = (mass.into(), distance.into());
        m * (Mat3::IDENTITY * d.norm_squared() - Mat3::outer(d, d))
    }

    /// The inertia of the rotated body: R I Rᵀ.
    #[must_use]
    pub fn turned(inertia: impl Into<Mat3>, rotation: impl Into<Mat3>) -> Mat3 {
        let r = rotation.into();
        r * inertia.into() * r.transpose()
    }
}
