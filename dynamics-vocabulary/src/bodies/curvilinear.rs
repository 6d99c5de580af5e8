//! Polar, cylindrical and spherical coordinates with their unit vectors, velocities and accelerations.

use crate::{Expr, Vec2, Vec3, vec2, vec3};

/// Polar coordinates of the plane: distance from the origin, angle from x toward y.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Polar {
    /// Distance from the origin.
    pub r: Expr,
    /// Angle from x toward y, in rad.
    pub theta: Expr,
}

impl Polar {
    /// From distance and angle.
    #[must_use]
    pub fn new(r: impl Into<Expr>, theta: impl Into<Expr>) -> Self {
        Self { r: r.into(), theta: theta.into() }
    }

    /// The point itself.
    #[must_use]
    pub fn point(self) -> Vec2 {
        self.r * self.radial()
    }

    /// Unit vector toward growing r.
    #[must_use]
    pub fn radial(self) -> Vec2 {
        let (s, c) = self.theta.sin_cos();
        vec2(c, s)
    }

    /// Unit vector toward growing θ.
    #[must_use]
    pub fn transverse(self) -> Vec2 {
        let (s, c) = self.theta.sin_cos();
        vec2(-s, c)
    }

    /// Components of the velocity along the unit vectors: (ṙ, rθ̇).
    #[must_use]
    pub fn velocity(self) -> Vec2 {
        vec2(self.r.dt(), self.r * self.theta.dt())
    }

    /// Components of the acceleration along the unit vectors: (r̈ − rθ̇², rθ̈ + 2ṙθ̇).
    #[must_use]
    pub fn acceleration(self) -> Vec2 {
        let (r, theta) = (self.r.dt(), self.theta.dt());
        vec2(r.dt() - self.r * theta.powi(2), self.r * theta.dt() + 2.0 * r * theta)
    }
}

/// Cylindrical coordinates: distance from the z axis, angle about it from x toward y, height.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Cylindrical {
    /// Distance from the z axis.
    pub r: Expr,
    /// Angle from x toward y, in rad.
    pub theta: Expr,
    /// Height.
    pub z: Expr,
}

impl Cylindrical {
    /// From distance, angle and height.
    #[must_use]
    pub fn new(r: impl Into<Expr>, theta: impl Into<Expr>, z: impl Into<Expr>) -> Self {
        Self { r: r.into(), theta: theta.into(), z: z.into() }
    }

    /// The point itself.
    #[must_use]
    pub fn point(self) -> Vec3 {
        let (s, c) = self.theta.sin_cos();
        vec3(self.r * c, self.r * s, self.z)
    }

    /// Unit vector away from the axis.
    #[must_use]
    pub fn radial(self) -> Vec3 {
        let (s, c) = self.theta.sin_cos();
        vec3(c, s, 0.0)
    }

    /// Unit vector toward growing θ.
    #[must_use]
    pub fn transverse(self) -> Vec3 {
        let (s, c) = self.theta.sin_cos();
        vec3(-s, c, 0.0)
    }

    /// Components of the velocity along the unit vectors: (ṙ, rθ̇, ż).
    #[must_use]
    pub fn velocity(self) -> Vec3 {
        vec3(self.r.dt(), self.r * self.theta.dt(), self.z.dt())
    }

    /// Components of the acceleration along the unit vectors: (r̈ − rθ̇², rθ̈ + 2ṙθ̇, z̈).
    #[must_use]
    pub fn acceleration(self) -> Vec3 {
        let (r, theta) = (self.r.dt(), self.theta.dt());
        vec3(r.dt() - self.r * theta.powi(2), self.r * theta.dt() + 2.0 * r * theta, self.z.dt().dt())
    }
}

/// Spherical coordinates: distance from the origin, angle ϑ from the z axis, angle φ about it from x toward
/// y.
///
/// φ is not determined on the z axis: a point that moves through it needs other coordinates.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Spherical {
    /// Distance from the origin.
    pub r: Expr,
    /// Angle from the z axis, in rad.
    pub theta: Expr,
    /// Angle about the z axis, from x toward y, in rad.
    pub phi: Expr,
}

impl Spherical {
    /// From distance, angle from the z axis, and angle about it.
    #[must_use]
    pub fn new(r: impl Into<Expr>, theta: impl Into<Expr>, phi: impl Into<Expr>) -> Self {
        Self { r: r.into(), theta: theta.into(), phi: phi.into() }
    }

    /// The point itself.
    #[must_use]
    pub fn point(self) -> Vec3 {
        self.r * self.radial()
    }

    /// Unit vector away from the origin.
    #[must_use]
    pub fn radial(self) -> Vec3 {
        let ((s, c), (sp, cp)) = (self.theta.sin_cos(), self.phi.sin_cos());
        vec3(s * cp, s * sp, c)
    }

    /// Unit vector toward growing ϑ, away from the z axis.
    #[must_use]
    pub fn polar(self) -> Vec3 {
        let ((s, c), (sp, cp)) = (self.theta.sin_cos(), self.phi.sin_cos());
        vec3(c * cp, c * sp, -s)
    }

    /// Unit vector toward growing φ, about the z axis.
    #[must_use]
    pub fn azimuthal(self) -> Vec3 {
        let (s, c) = self.phi.sin_cos();
        vec3(-s, c, 0.0)
    }

    /// Components of the velocity along the unit vectors: (ṙ, rϑ̇, rφ̇ sin ϑ).
    #[must_use]
    pub fn velocity(self) -> Vec3 {
        vec3(self.r.dt(), self.r * self.theta.dt(), self.r * self.theta.sin() * self.phi.dt())
    }

    /// Components of the acceleration along the unit vectors:
    /// (r̈ − rϑ̇² − rφ̇² sin²ϑ, rϑ̈ + 2ṙϑ̇ − rφ̇² sin ϑ cos ϑ, (rφ̈ + 2ṙφ̇) sin ϑ + 2rϑ̇φ̇ cos ϑ).
    #[must_use]
    pub fn acceleration(self) -> Vec3 {
        let (s, c) = self.theta.sin_cos();
        let (r, theta, phi) = (self.r.dt(), self.theta.dt(), self.phi.dt());
        let across = self.r * phi.powi(2) * s;
        vec3(
            r.dt() - self.r * theta.powi(2) - across * s,
            self.r * theta.dt() + 2.0 * r * theta - across * c,
            (self.r * phi.dt() + 2.0 * r * phi) * s + 2.0 * self.r * theta * phi * c,
        )
    }
}
