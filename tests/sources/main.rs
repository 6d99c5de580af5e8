//! Rules that the sources keep: who may use whom, a case for every message, levels of optimisation that are
//! repeated elsewhere. These tests read files and compile no model.

mod architecture;
mod catalogue;
mod pages;
mod profiles;
