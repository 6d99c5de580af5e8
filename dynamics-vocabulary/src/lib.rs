//! The vocabulary of models: time jets, vectors, rotations, splines, frames, bodies and joints, and the
//! elementary functions that they and generated code use.
//!
//! Users name only the façade crate `dynamics`. Frames, bodies and joints are written in the language of
//! models. The compiler turns them into code here, and the macros elaborate the same text
//! ([`sources::SOURCES`]), so a word cannot have two meanings.
// Unit tests run on a machine with the standard library, whatever the features.
#![cfg_attr(not(any(feature = "std", test)), no_std)]

#[cfg(feature = "alloc")]
extern crate alloc;

#[cfg(feature = "code")]
pub mod attitude;
#[cfg(feature = "code")]
pub mod bodies;
#[cfg(feature = "code")]
mod debugging;
#[cfg(feature = "code")]
pub mod derivative;
#[cfg(feature = "code")]
pub mod expr;
#[cfg(feature = "code")]
pub mod force;
#[cfg(feature = "code")]
pub mod mass_properties;
#[cfg(feature = "code")]
pub mod math;
#[cfg(feature = "code")]
pub mod matrix;
#[cfg(feature = "view")]
mod places;
#[cfg(feature = "code")]
pub mod rotation;
#[cfg(feature = "code")]
pub mod scalar;
#[cfg(feature = "code")]
pub mod smooth;
#[doc(hidden)]
pub mod sources;
#[cfg(feature = "alloc")]
pub mod spline;
#[cfg(feature = "code")]
pub mod vector;

#[cfg(feature = "code")]
pub use attitude::{EulerAngles, NotARotation};
#[cfg(feature = "code")]
pub use bodies::{
    Cylindrical, EulerParameters, Frame, Inertia, Joint, PlanarBody, PlanarFrame, PlanarJoint, Polar,
    RigidBody, Spherical,
};
#[cfg(feature = "code")]
pub use derivative::TimeDerivative;
#[cfg(feature = "code")]
pub use dynamics_simd::{self as lanes, sin_cos};
#[cfg(feature = "code")]
pub use expr::Expr;
#[cfg(feature = "code")]
pub use force::Force;
#[cfg(feature = "alloc")]
pub use mass_properties::MeshError;
#[cfg(feature = "code")]
pub use mass_properties::{MassProperties, PrincipalAxes, UnphysicalInertia};
#[cfg(feature = "code")]
pub use matrix::Mat3;
#[cfg(feature = "code")]
pub use rotation::EulerSequence;
#[cfg(feature = "code")]
pub use smooth::SmoothFunction;
#[cfg(feature = "alloc")]
pub use spline::{CubicSpline, SplineError};
#[cfg(feature = "code")]
pub use vector::{Vec2, Vec3, vec2, vec3};
