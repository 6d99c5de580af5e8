//! Rigid bodies in space.

use crate::bodies::Frame;
use crate::{Expr, Force, Mat3, Vec3};

/// A rigid body: mass, center of mass, inertia, and its frame.
///
/// ```
/// # use dynamics_vocabulary as dynamics;
/// use dynamics::{Expr, Frame, Mat3, RigidBody, Vec3};
///
/// // A wheel that turns about its axle with 10 rad/s.
/// let spin = Expr::coordinate(0.0, 10.0, 0.0);
/// let frame = Frame::turned(Mat3::rotation_z(spin));
/// let wheel = RigidBody::new(3.0, Vec3::ZERO, Mat3::diagonal(0.2, 0.2, 0.4), frame);
/// assert_eq!(wheel.kinetic_energy().value(), 0.5 * 0.4 * 100.0);
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RigidBody {
    /// Mass.
    pub mass: Expr,
    /// Center of mass, in the frame.
    pub center: Vec3,
    /// Inertia about the center of mass, in the frame's axes.
    pub inertia: Mat3,
    /// Where the body is.
    pub frame: Frame,
}

impl RigidBody {
    /// From mass, center of mass in the frame, and inertia about the center of mass in the frame's axes.
    #[must_use]
    pub fn new(
        mass: impl Into<Expr>,
        center: impl Into<Vec3>,
        inertia: impl Into<Mat3>,
        frame: Frame,
    ) -> Self {
        Self { mass: mass.into(), center: center.into(), inertia: inertia.into(), frame }
    }

    /// Where the center of mass is.
    #[must_use]
    pub fn center_of_mass(self) -> Vec3 {
        self.frame.point(self.center)
    }

    /// Angular velocity, in the world's components.
    #[must_use]
    pub fn angular_velocity(self) -> Vec3 {
        self.frame.angular_velocity()
    }

    /// Kinetic energy ½ m v² + ½ ω·I ω, with ω and I in the body's components, in which I is constant.
    #[must_use]
    pub fn kinetic_energy(self) -> Expr {
        let velocity = self.center_of_mass().dt();
        0.5 * self.mass * velocity.norm_squared() + self.frame.rotation().rotational_energy(self.inertia)
    }

    /// Potential energy under this acceleration of gravity, zero at the world's origin: `vec3(0.0, 0.0, -g)`
    /// where z is up.
    #[must_use]
    pub fn potential_energy(self, gravity: impl Into<Vec3>) -> Expr {
        -self.mass * self.center_of_mass().dot(gravity.into())
    }

    /// Momentum m v of the center of mass.
    #[must_use]
    pub fn momentum(self) -> Vec3 {
        self.mass * self.center_of_mass().dt()
    }

    /// Angular momentum about a point of the world, which may move, in components of the world. Velocities
    /// are those relative to the world.
    #[must_use]
    pub fn angular_momentum(self, about: impl Into<Vec3>) -> Vec3 {
        let spin = self.frame.vector(self.inertia * self.frame.angular_velocity_in_body());
        (self.center_of_mass() - about.into()).cross(self.momentum()) + spin
    }

    /// A moment on the body, a vector of the world: its power is moment·ω.
    ///
    /// It is written as three couples: forces ½ M×a at the ends of unit vectors a along the frame's axes. The
    /// sum of a×(M×a) is 2M.
    #[must_use]
    pub fn moment(self, moment: impl Into<Vec3>) -> Force {
        let half = 0.5 * moment.into();
        Force::at(self.frame.x(), half.cross(self.frame.x()))
            + Force::at(self.frame.y(), half.cross(self.frame.y()))
            + Force::at(self.frame.z(), half.cross(self.frame.z()))
    }
}
