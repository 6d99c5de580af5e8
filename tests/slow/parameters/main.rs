//! What motions, equilibria and frequencies make of parameters and starts, against closed forms and whole
//! motions; parameters found from measured motion; sweeps.

#[path = "../../models/double_pendulum.rs"]
mod double_pendulum;
mod ends;
mod fit;
mod fit_refused;
mod gradients;
mod gradients_refused;
mod models;
#[path = "../../models/rolling_disk.rs"]
mod rolling_disk;
mod sensitivities;
mod sensitivities_refused;
#[path = "../../models/shaken.rs"]
mod shaken;
mod statics;
mod sweep;
#[path = "../../models/turned_hoop.rs"]
mod turned_hoop;

/// (8 (f₁ − f₋₁) − (f₂ − f₋₂)) / 12 h.
fn difference(h: f64, f: impl Fn(f64) -> f64) -> f64 {
    (8.0 * (f(h) - f(-h)) - (f(2.0 * h) - f(-2.0 * h))) / (12.0 * h)
}
