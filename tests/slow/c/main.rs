//! Programs in C99: compiled without a warning by the compilers that are there, and compared with those in
//! Rust.
//!
//! The tests are skipped, with a line, where there is no `cc`.

mod compiler;
mod cortex_m;
#[path = "../../models/double_pendulum.rs"]
mod double_pendulum;
mod driver;
mod examples;
mod functions;
#[path = "../snapshots/models.rs"]
mod models;
mod programs;
#[path = "../snapshots/random_states.rs"]
mod random_states;
mod refused;
