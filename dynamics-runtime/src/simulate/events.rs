//! Events: functions whose zero crossings are located, and what happens there.
//!
//! | step | file |
//! |---|---|
//! | functions that are watched, and their values | `functions.rs`, `unilateral.rs` |
//! | the side to which a function leaves zero at a start | `restart.rs`, `lift_off.rs` |
//! | crossings within a step | `location.rs`, on the interpolant; `integrate/events/` finds the roots |
//! | functions that a constraint holds at zero | `masked.rs` |
//! | the step ends at a crossing by the method itself | `run/event_steps.rs` |
//! | which action is called; what an action may do | `rules.rs`; `action.rs` |
//! | how the motion continues | `run/event_handling.rs` |
//! | Zeno accumulation | `zeno.rs` |
//! | direction of contact friction | `slip_direction.rs`, [`Stabilization::slip_side`], `unilateral.rs` |
//! | corners of contacts | `contact_corner.rs`, `run/constraint_discontinuity.rs` |
//!
//! [`Stabilization::slip_side`]: crate::simulate::stabilization::Stabilization::slip_side

pub(crate) mod action;
pub(crate) mod contact_corner;
pub(crate) mod functions;
pub(crate) mod lift_off;
pub(crate) mod location;
pub(crate) mod masked;
pub(crate) mod restart;
pub(crate) mod rules;
pub(crate) mod slip_direction;
pub(crate) mod unilateral;
pub(crate) mod zeno;
