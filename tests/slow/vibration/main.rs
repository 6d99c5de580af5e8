//! Linear vibration and control of derived models, against closed forms, published values and the nonlinear
//! motion; and where the methods fail.

mod bicycle;
#[path = "../../models/bicycle.rs"]
mod bicycle_model;
mod control;
mod harmonic;
mod large;
mod models;
mod normal;
mod rounding;
mod state_space;
mod time;
mod unreached;
