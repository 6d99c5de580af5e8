//! Linear vibration and control of derived models, against closed forms, published values and the nonlinear
//! motion; and where the methods fail.

mod control;
mod harmonic;
mod large;
mod models;
mod normal;
mod rotor;
mod rounding;
mod state_space;
mod steady;
mod time;
mod unreached;
