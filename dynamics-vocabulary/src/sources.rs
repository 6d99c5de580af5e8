//! The text of frames, bodies and joints.

/// One entry for each file of [`bodies`](crate::bodies): the types that it declares, and its text.
pub const SOURCES: &[(&[&str], &str)] = &[
    (&["Polar", "Cylindrical", "Spherical"], include_str!("bodies/curvilinear.rs")),
    (&["EulerParameters"], include_str!("bodies/euler_parameters.rs")),
    (&["Frame"], include_str!("bodies/frame.rs")),
    (&["Inertia"], include_str!("bodies/inertia.rs")),
    (&["Joint", "PlanarJoint"], include_str!("bodies/joint.rs")),
    (&["PlanarFrame", "PlanarBody"], include_str!("bodies/planar.rs")),
    (&["RigidBody"], include_str!("bodies/rigid_body.rs")),
];
