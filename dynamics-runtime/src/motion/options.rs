//! The options of a simulation that other parts of it know.

pub(crate) mod formulation;
