//! Models as functional mock-up units: their description against the rules of the standard, their C through
//! all functions of the interface, and both interfaces in another program against Rust.
//!
//! What needs a compiler of C, or Python with FMPy, is skipped with a line where there is none; under
//! `DYNAMICS_FMPY=1` the latter is an error.

#[path = "../c/compiler.rs"]
#[allow(dead_code)] // folders of this theme have a place of their own
mod compiler;
mod description;
#[path = "../../models/double_pendulum.rs"]
mod double_pendulum;
mod fmpy;
mod interface;
mod models;
mod refused;
mod steps;
mod units;
