//! Options of a simulation that are types of their own, and defaults. The builder that takes all options is
//! [`crate::simulate::Simulation`]; `simulation/check.rs` checks them.

pub(crate) mod contact;
pub(crate) mod defaults;
pub(crate) mod formulation;
pub(crate) mod output_times;
