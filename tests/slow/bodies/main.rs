//! Rigid bodies in space: frames, bodies and joints as words of the language, and published problems.

#[path = "../../models/parametrised.rs"]
mod parametrised;
#[path = "../../models/rolling_disk.rs"]
mod rolling_disk;

mod bodies;
mod references_bodies;
