//! Frames, bodies, inertia and joints, as models write them.
//!
//! **These files are read twice.** The compiler turns them into code on time jets. The macro elaborates the
//! same text if a model uses its types ([`sources`](crate::sources)). So they are written in the language of
//! models: plain expressions over `Expr`, vectors and matrices, functions without recursion, no closures.
//! Code for run time alone is elsewhere (`attitude.rs`, `mass_properties.rs`).

mod curvilinear;
mod euler_parameters;
mod frame;
mod inertia;
mod joint;
mod planar;
mod rigid_body;

pub use curvilinear::{Cylindrical, Polar, Spherical};
pub use euler_parameters::EulerParameters;
pub use frame::Frame;
pub use inertia::Inertia;
pub use joint::{Joint, PlanarJoint};
pub use planar::{PlanarBody, PlanarFrame};
pub use rigid_body::RigidBody;

#[cfg(test)]
mod tests;
