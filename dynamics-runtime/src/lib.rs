//! The runtime of `dynamics`: the traits of generated models, their simulation, and their output.
//!
//! Users name only the façade crate `dynamics`.
// Unit tests run on a machine with the standard library, whatever the features.
#![cfg_attr(not(any(feature = "std", test)), no_std)]

#[cfg(feature = "alloc")]
extern crate alloc;

#[cfg(feature = "alloc")]
pub mod adapters;
pub mod constrain;
mod declaration;
pub mod error;
#[doc(hidden)]
pub mod generated;
#[cfg(feature = "alloc")]
mod golden_section;
pub mod integrate;
#[cfg(feature = "alloc")]
pub mod kinematics;
mod linalg;
#[cfg(feature = "alloc")]
pub mod mechanism;
#[cfg(feature = "alloc")]
pub mod methods;
pub mod model;
#[cfg(feature = "alloc")]
pub mod output;
// Public for dynamics-analysis alone.
#[cfg(feature = "alloc")]
#[doc(hidden)]
pub mod progress;
pub mod reaction;
pub mod series;
#[cfg(feature = "alloc")]
pub mod simulate;
// Public for dynamics-analysis alone.
#[cfg(feature = "std")]
#[doc(hidden)]
pub mod slow_build;
// Public for dynamics-analysis alone.
#[cfg(feature = "alloc")]
#[doc(hidden)]
pub mod wording;

#[doc(hidden)]
pub use dynamics_vocabulary::sentence_for_debugging;
#[cfg(feature = "alloc")]
#[doc(inline)]
pub use dynamics_vocabulary::{CubicSpline, MeshError, SplineError, spline};
#[doc(inline)]
pub use dynamics_vocabulary::{
    Cylindrical, EulerAngles, EulerParameters, EulerSequence, Expr, Force, Frame, Inertia, Joint,
    MassProperties, Mat3, NotARotation, PlanarBody, PlanarFrame, PlanarJoint, Polar, PrincipalAxes,
    RigidBody, SmoothFunction, Spherical, TimeDerivative, UnphysicalInertia, Vec2, Vec3, vec2, vec3,
};
#[doc(inline)]
pub use dynamics_vocabulary::{
    attitude, bodies, derivative, expr, force, lanes, mass_properties, math, matrix, rotation, scalar,
    sin_cos, smooth, vector,
};
