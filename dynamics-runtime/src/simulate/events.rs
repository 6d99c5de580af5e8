//! Events: functions whose zero crossings are located, and what happens there.

pub(crate) mod action;
pub(crate) mod contact_corner;
pub(crate) mod functions;
pub(crate) mod lift_off;
pub(crate) mod location;
pub(crate) mod masked;
pub(crate) mod restart;
pub(crate) mod slip_direction;
pub(crate) mod unilateral;
pub(crate) mod zeno;
