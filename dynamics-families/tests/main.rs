//! Models with families on models written by hand.

mod border;
mod common;
mod dispersion;
mod failures;
mod frames;
mod implicit;
mod methods;
mod output;
mod statics;
mod step_bound;
mod waves;
