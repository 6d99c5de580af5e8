//! Frames and rigid bodies in the plane.

use crate::{Expr, Force, Vec2, vec2};

/// A frame of reference of the plane: an origin and an angle, counter-clockwise from the world's x axis.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PlanarFrame {
    origin: Vec2,
    angle: Expr,
}

impl PlanarFrame {
    /// From its origin in the world and its angle in rad.
    #[must_use]
    pub fn new(origin: impl Into<Vec2>, angle: impl Into<Expr>) -> Self {
        Self { origin: origin.into(), angle: angle.into() }
    }

    /// The frame that does not move, in which Newton's laws hold.
    #[must_use]
    pub fn world() -> Self {
        Self { origin: Vec2::ZERO, angle: Expr::ZERO }
    }

    /// The frame whose origin and angle are given in this one.
    #[must_use]
    pub fn frame(self, origin: impl Into<Vec2>, angle: impl Into<Expr>) -> Self {
        Self { origin: self.point(origin), angle: self.angle + angle.into() }
    }

    /// Its origin, in the world.
    #[must_use]
    pub fn origin(self) -> Vec2 {
        self.origin
    }

    /// Its angle in rad.
    #[must_use]
    pub fn angle(self) -> Expr {
        self.angle
    }

    /// Its x axis, a unit vector of the world.
    #[must_use]
    pub fn x(self) -> Vec2 {
        let (s, c) = self.angle.sin_cos();
        vec2(c, s)
    }

    /// Its y axis, a unit vector of the world.
    #[must_use]
    pub fn y(self) -> Vec2 {
        let (s, c) = self.angle.sin_cos();
        vec2(-s, c)
    }

    /// The place in the world of a point with these coordinates in the frame.
    #[must_use]
    pub fn point(self, coordinates: impl Into<Vec2>) -> Vec2 {
        self.origin + self.vector(coordinates)
    }

    /// The vector of the world that has these components in the frame.
    #[must_use]
    pub fn vector(self, components: impl Into<Vec2>) -> Vec2 {
        let v = components.into();
        let (s, c) = self.angle.sin_cos();
        vec2(c * v.x - s * v.y, s * v.x + c * v.y)
    }

    /// Coordinates in the frame of a point of the world.
    #[must_use]
    pub fn coordinates_of(self, point: impl Into<Vec2>) -> Vec2 {
        self.components_of(point.into() - self.origin)
    }

    /// Components in the frame of a vector of the world.
    #[must_use]
    pub fn components_of(self, vector: impl Into<Vec2>) -> Vec2 {
        let v = vector.into();
        let (s, c) = self.angle.sin_cos();
        vec2(c * v.x + s * v.y, c * v.y - s * v.x)
    }

    /// Angular velocity against the world, counter-clockwise.
    #[must_use]
    pub fn angular_velocity(self) -> Expr {
        self.angle.dt()
    }

    /// Velocity of a point of the world as an observer in the frame sees it, in the frame's components.
    #[must_use]
    pub fn velocity_in(self, point: impl Into<Vec2>) -> Vec2 {
        self.coordinates_of(point).dt()
    }

    /// Acceleration of a point of the world as an observer in the frame sees it, in the frame's components.
    #[must_use]
    pub fn acceleration_in(self, point: impl Into<Vec2>) -> Vec2 {
        self.coordinates_of(point).dt().dt()
    }

    /// Velocity in the world of what is fixed in the frame where a point just is.
    #[must_use]
    pub fn carried_velocity(self, point: impl Into<Vec2>) -> Vec2 {
        self.origin.dt() + self.angle.dt() * (point.into() - self.origin).perp()
    }
}

/// A rigid body that moves in its plane.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PlanarBody {
    /// Mass.
    pub mass: Expr,
    /// Center of mass, in the frame.
    pub center: Vec2,
    /// Moment of inertia about the center of mass.
    pub inertia: Expr,
    /// Where the body is.
    pub frame: PlanarFrame,
}

impl PlanarBody {
    /// From mass, center of mass in the frame, and moment of inertia about the center of mass.
    #[must_use]
    pub fn new(
        mass: impl Into<Expr>,
        center: impl Into<Vec2>,
        inertia: impl Into<Expr>,
        frame: PlanarFrame,
    ) -> Self {
        Self { mass: mass.into(), center: center.into(), inertia: inertia.into(), frame }
    }

    /// Where the center of mass is.
    #[must_use]
    pub fn center_of_mass(self) -> Vec2 {
        self.frame.point(self.center)
    }

    /// Kinetic energy.
    #[must_use]
    pub fn kinetic_energy(self) -> Expr {
        let velocity = self.center_of_mass().dt();
        0.5 * (self.mass * velocity.norm_squared() + self.inertia * self.frame.angular_velocity().powi(2))
    }

    /// Potential energy under this acceleration of gravity, zero at the world's origin.
    #[must_use]
    pub fn potential_energy(self, gravity: impl Into<Vec2>) -> Expr {
        -self.mass * self.center_of_mass().dot(gravity.into())
    }

    /// Momentum m v of the center of mass.
    #[must_use]
    pub fn momentum(self) -> Vec2 {
        self.mass * self.center_of_mass().dt()
    }

    /// Angular momentum about a point of the world, which may move. Velocities are those relative to the
    /// world.
    #[must_use]
    pub fn angular_momentum(self, about: impl Into<Vec2>) -> Expr {
        let arm = self.center_of_mass() - about.into();
        arm.cross(self.momentum()) + self.inertia * self.frame.angular_velocity()
    }

    /// A moment on the body, counter-clockwise.
    #[must_use]
    pub fn moment(self, moment: impl Into<Expr>) -> Force {
        Force::along(self.frame.angle(), moment)
    }
}
