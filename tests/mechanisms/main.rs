//! Published problems with constraints, from their declarations to the published positions, velocities and
//! multipliers.
//!
//! The reference values were computed in multi-precision arithmetic by two independent routes, or have closed
//! forms; they are rounded to `f64` here. Each problem names its source. Every model is checked by two
//! routes: its mass matrix, forces, Φ_q and γ against those written by hand, its accelerations and
//! multipliers against a dense solution of the KKT system; all formulations against each other at random
//! states that satisfy the constraints.

#![allow(clippy::excessive_precision, reason = "reference values keep their digits")]

mod andrews;
mod car_axis;
mod double_pendulum;
mod four_bar;
mod governor;
mod pendulum;
mod skates;
mod support;
mod trammel;
mod windows;
