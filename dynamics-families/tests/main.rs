//! Models with families on models written by hand.

mod common;
mod failures;
mod frames;
mod methods;
mod step_bound;
mod waves;
