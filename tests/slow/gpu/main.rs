//! Runs on graphics cards. No card is needed: the text of a kernel is C99, too, and is compiled for the
//! processor here and compared with its lanes, bit by bit. Kernels are compiled where the compiler of kernels
//! can be loaded.

mod bits;
#[path = "../c/compiler.rs"]
mod compiler;
#[path = "../../models/double_pendulum.rs"]
mod double_pendulum;
mod host;
mod kernels;
#[path = "../snapshots/models.rs"]
mod models;
#[path = "../snapshots/random_states.rs"]
mod random_states;
mod single;
