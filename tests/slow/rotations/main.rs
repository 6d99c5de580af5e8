//! Rotations in every set of angles and in Euler parameters, and charts that change on the way.

#[path = "../../models/parametrised.rs"]
mod parametrised;

mod atlas;
mod charts;
