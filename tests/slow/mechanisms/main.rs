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
mod bricard;
mod car_axis;
mod double_pendulum;
mod four_bar;
mod four_bar_40;
mod freedom;
mod governor;
#[path = "../../common/lanes.rs"]
mod lanes;
mod pendulum;
mod redundant;
#[path = "../../common/singular_values.rs"]
mod singular_values;
mod skates;
mod support;
#[path = "../../models/three_cranks.rs"]
mod three_cranks;
#[path = "../../models/turning_trammel.rs"]
mod turning_trammel;
mod windows;
