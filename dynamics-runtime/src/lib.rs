//! The runtime of `dynamics`: what generated models implement, and what moves, judges and shows them.
//!
//! Users name only the façade crate `dynamics`.
// Unit tests run on a machine with the standard library, whatever the features.
#![cfg_attr(not(any(feature = "std", test)), no_std)]

#[cfg(feature = "alloc")]
extern crate alloc;

#[cfg(feature = "alloc")]
pub mod adapters;
pub mod attitude;
pub mod bodies;
pub mod constrain;
mod debugging;
mod declaration;
pub mod derivative;
pub mod error;
pub mod expr;
pub mod force;
#[doc(hidden)]
pub mod generated;
#[cfg(feature = "alloc")]
mod golden_section;
pub mod integrate;
#[cfg(feature = "alloc")]
pub mod kinematics;
pub mod lanes;
mod linalg;
pub mod mass_properties;
pub mod math;
pub mod matrix;
#[cfg(feature = "alloc")]
pub mod methods;
pub mod model;
#[cfg(feature = "alloc")]
pub mod motion;
#[cfg(feature = "alloc")]
pub mod output;
#[cfg(feature = "alloc")]
pub mod progress;
pub mod reaction;
pub mod rotation;
pub mod scalar;
pub mod series;
pub mod sin_cos;
#[cfg(feature = "std")]
pub mod slow;
pub mod smooth;
#[cfg(feature = "alloc")]
pub mod spline;
pub mod vector;
#[cfg(feature = "alloc")]
pub mod wording;

pub use attitude::{EulerAngles, NotARotation};
pub use bodies::{
    Cylindrical, EulerParameters, Frame, Inertia, Joint, PlanarBody, PlanarFrame, PlanarJoint, Polar,
    RigidBody, Spherical,
};
pub use derivative::TimeDerivative;
pub use expr::Expr;
pub use force::Force;
#[cfg(feature = "alloc")]
pub use mass_properties::MeshError;
pub use mass_properties::{MassProperties, PrincipalAxes, UnphysicalInertia};
pub use matrix::Mat3;
pub use rotation::EulerSequence;
pub use smooth::SmoothFunction;
#[cfg(feature = "alloc")]
pub use spline::{CubicSpline, SplineError};
pub use vector::{Vec2, Vec3, vec2, vec3};
