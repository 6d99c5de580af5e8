//! The runtime of `dynamics`: what generated models implement, and what moves, judges and shows them.
//!
//! Users name only the façade crate `dynamics`.
#![cfg_attr(not(feature = "std"), no_std)]

#[cfg(feature = "alloc")]
extern crate alloc;

pub mod error;
pub mod math;
pub mod model;
#[cfg(feature = "alloc")]
pub mod output;
