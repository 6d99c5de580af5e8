//! What a model compiles to: names, equations, sines, forces that a motion needs.

mod derivation;
#[path = "../../models/double_pendulum.rs"]
mod double_pendulum;
mod inverse_dynamics;
#[path = "../../models/kepler.rs"]
mod kepler;
#[path = "../../common/lanes.rs"]
mod lanes;
mod sines;
mod surface;
