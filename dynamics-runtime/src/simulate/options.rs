//! The options of a simulation that other parts of it know.

pub(crate) mod contact;
pub(crate) mod defaults;
pub(crate) mod formulation;
pub(crate) mod output_times;
