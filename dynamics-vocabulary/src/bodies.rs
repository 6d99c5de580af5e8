//! Frames, bodies, inertia and joints, as models write them.
//!
//! **These files are read twice.** The compiler makes of them what runs on time jets; the macro elaborates
//! the very same text where a model uses its words ([`sources`](crate::sources)). So they are written in the
//! language of models: plain expressions over `Expr`, vectors and matrices, functions that call one another
//! without cycles, no closures. Whatever is for run time alone stands elsewhere (`attitude.rs`,
//! `mass_properties.rs`).

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
