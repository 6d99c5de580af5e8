//! Numbers side by side in vector registers: the same operations for several states at once.
//!
//! * [`Lanes`] is the trait of such numbers: `f64` has one lane, [`Portable`] has four on every target. On
//!   x86-64 there are two more types, of four and eight lanes, in `x86.rs`.
//! * [`Task`] is code that is generic over them. [`in_four_lanes`], [`in_widest_lanes`] and
//!   [`in_fused_lanes`] run a task with the vectors that the processor has, found at run time: a program that
//!   was compiled for every x86-64 processor uses AVX2 or AVX-512 where it is. Methods use four lanes. Many
//!   runs side by side use two of the widest vectors, which is the fastest for long tasks.
//! * [`sin_cos`] has sines and cosines, alone and side by side; [`reciprocal_root`] has 1/√x.
//!
//! **The same bits everywhere.** Every operation rounds each lane as `f64` does, in the same order. Products
//! and sums are fused where the target of the *build* has an instruction for it ([`sin_cos::FUSED`]), not
//! because the processor happens to have one. So the processor decides about the time alone, and results are
//! deterministic for each target of the build. The exception is [`in_fused_lanes`].
//!
//! All `unsafe` code of this crate is in `x86.rs`, whose head says why it is sound.
// Unit tests run on a machine with the standard library, whatever the features.
#![cfg_attr(not(any(feature = "std", test)), no_std)]

mod dispatch;
mod lanes;
mod pair;
mod portable;
pub mod reciprocal_root;
pub mod sin_cos;
#[cfg(target_arch = "x86_64")]
mod x86;

pub use dispatch::{Task, has_fused_lanes, in_four_lanes, in_fused_lanes, in_widest_lanes, limit_vectors};
pub use lanes::{Code, Lanes, Wide};
pub use portable::Portable;
