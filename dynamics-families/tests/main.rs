//! Models with families on models written by hand.

mod common;
mod failures;
mod frames;
mod implicit;
mod methods;
mod statics;
mod step_bound;
mod waves;
