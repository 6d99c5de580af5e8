//! Frames of reference in space.

use crate::{Mat3, Vec3};

/// A right-handed frame of reference: an origin and three axes at right angles, both of which may move.
///
/// ```
/// # use dynamics_vocabulary as dynamics;
/// use dynamics::{Expr, Frame, Mat3, vec3};
///
/// // A turntable, and what an observer on it sees of a point at rest.
/// let phi = Expr::coordinate(0.0, 2.0, 0.0);
/// let table = Frame::turned(Mat3::rotation_z(phi));
/// let seen = table.velocity_in(vec3(3.0, 0.0, 1.0));
/// assert_eq!(seen.value().to_array(), [0.0, -6.0, 0.0]);
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Frame {
    origin: Vec3,
    rotation: Mat3,
}

impl Frame {
    /// From its origin in the world, and the rotation that turns the world's axes into its own.
    #[must_use]
    pub fn new(origin: impl Into<Vec3>, rotation: impl Into<Mat3>) -> Self {
        Self { origin: origin.into(), rotation: rotation.into() }
    }

    /// The frame that does not move, in which Newton's laws hold.
    #[must_use]
    pub fn world() -> Self {
        Self { origin: Vec3::ZERO, rotation: Mat3::IDENTITY }
    }

    /// Axes parallel to the world's through this origin.
    #[must_use]
    pub fn at(origin: impl Into<Vec3>) -> Self {
        Self { origin: origin.into(), rotation: Mat3::IDENTITY }
    }

    /// Turned about the world's origin.
    #[must_use]
    pub fn turned(rotation: impl Into<Mat3>) -> Self {
        Self { origin: Vec3::ZERO, rotation: rotation.into() }
    }

    /// The frame whose origin and rotation are given in this one: the next link of an arm.
    #[must_use]
    pub fn frame(self, origin: impl Into<Vec3>, rotation: impl Into<Mat3>) -> Self {
        Self { origin: self.point(origin), rotation: self.rotation * rotation.into() }
    }

    /// Its origin, in the world.
    #[must_use]
    pub fn origin(self) -> Vec3 {
        self.origin
    }

    /// The matrix that carries components in this frame into components in the world.
    #[must_use]
    pub fn rotation(self) -> Mat3 {
        self.rotation
    }

    /// Its x axis, a unit vector of the world.
    #[must_use]
    pub fn x(self) -> Vec3 {
        self.rotation.column(0)
    }

    /// Its y axis, a unit vector of the world.
    #[must_use]
    pub fn y(self) -> Vec3 {
        self.rotation.column(1)
    }

    /// Its z axis, a unit vector of the world.
    #[must_use]
    pub fn z(self) -> Vec3 {
        self.rotation.column(2)
    }

    /// The place in the world of a point with these coordinates in the frame.
    #[must_use]
    pub fn point(self, coordinates: impl Into<Vec3>) -> Vec3 {
        self.origin + self.rotation * coordinates.into()
    }

    /// The vector of the world that has these components in the frame.
    #[must_use]
    pub fn vector(self, components: impl Into<Vec3>) -> Vec3 {
        self.rotation * components.into()
    }

    /// Coordinates in the frame of a point of the world.
    #[must_use]
    pub fn coordinates_of(self, point: impl Into<Vec3>) -> Vec3 {
        self.rotation.transpose() * (point.into() - self.origin)
    }

    /// Components in the frame of a vector of the world.
    #[must_use]
    pub fn components_of(self, vector: impl Into<Vec3>) -> Vec3 {
        self.rotation.transpose() * vector.into()
    }

    /// Angular velocity of the frame against the world, in the world's components.
    #[must_use]
    pub fn angular_velocity(self) -> Vec3 {
        self.rotation.angular_velocity()
    }

    /// Angular velocity of the frame against the world, in the frame's own components.
    #[must_use]
    pub fn angular_velocity_in_body(self) -> Vec3 {
        self.rotation.angular_velocity_in_body()
    }

    /// Velocity of a point of the world as an observer in the frame sees it, in the frame's components.
    ///
    /// Turned into the world it differs from the velocity ṙ by [`carried_velocity`](Self::carried_velocity):
    /// the transport theorem.
    #[must_use]
    pub fn velocity_in(self, point: impl Into<Vec3>) -> Vec3 {
        self.coordinates_of(point).dt()
    }

    /// Acceleration of a point of the world as an observer in the frame sees it, in the frame's components:
    /// without the acceleration of the frame, the Coriolis and the centripetal acceleration.
    #[must_use]
    pub fn acceleration_in(self, point: impl Into<Vec3>) -> Vec3 {
        self.coordinates_of(point).dt().dt()
    }

    /// Velocity in the world of the point that is fixed in the frame and is at this place now: ȯ + ω×(r − o).
    #[must_use]
    pub fn carried_velocity(self, point: impl Into<Vec3>) -> Vec3 {
        self.origin.dt() + self.angular_velocity().cross(point.into() - self.origin)
    }
}
