//! Derived models in motion: starts, inputs, events, published end values, and what errors advise.

#[path = "../../models/arenstorf.rs"]
mod arenstorf;
#[path = "../../models/double_pendulum.rs"]
mod double_pendulum;
#[path = "../../models/kepler.rs"]
mod kepler;
mod references;
mod remedies;
mod simulation;
mod sizes;
