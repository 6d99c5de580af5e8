//! Periodic and chaotic motions: Floquet multipliers, closed motions by shooting, Lyapunov exponents,
//! Poincaré sections.
//!
//! ```text
//! let judged = model.floquet(&start, period)?;                                // growth of disturbances
//! let orbit = model.periodic(guess, period).run()?;                           // the closed motion nearby
//! let exponents = model.lyapunov(start).settle(100.0).during(2000.0).run()?;  // Lyapunov exponents
//! let section = model.poincare(start).every(period).points(2000).run()?;      // points once a period
//! ```
//!
//! All use exact variational equations (`flow.rs`), under constraints on their tangent space. Inputs are
//! held. Switched constraints keep the on/off state of the start. Event actions are not executed: a motion
//! whose velocities jump at events is not the one that is analysed here.

mod corners;
mod error;
mod floquet;
mod flow;
mod frame;
mod lyapunov;
mod poincare;
mod shooting;
mod symmetry;
mod variation;

use dynamics_runtime::constrain::check_start;
use dynamics_runtime::error::StateError;
use dynamics_runtime::model::Vector;
use dynamics_runtime::simulate::Simulate;
use nalgebra::DVector;

pub use error::PeriodicError;
pub use floquet::{Floquet, FloquetVerdict, Multiplier, Threshold};
pub use lyapunov::{Exponent, ExponentSign, Lyapunov, LyapunovExponents};
pub use poincare::{Poincare, Return, Section};
pub use shooting::{PeriodicOrbit, Shooting};
pub use symmetry::Trivial;

/// Default permitted local error per step: multipliers then have about ten digits.
const DEFAULT_TOLERANCE: f64 = 1e-12;
/// Default limit on the steps of one shot. A motion that takes more is stiff, or the period is far too long.
const DEFAULT_MAX_STEPS: usize = 200_000;

/// See [`Analyze::floquet`](crate::Analyze::floquet).
pub(crate) fn floquet_of<M: Simulate>(
    model: &M,
    start: &M::State,
    period: f64,
) -> Result<Floquet, PeriodicError> {
    check_period(period)?;
    check(model, start)?;
    let advance = DVector::zeros(2 * M::Vector::LEN);
    floquet::of_motion(model, &[*start], period, &advance, (DEFAULT_TOLERANCE, DEFAULT_MAX_STEPS))
}

/// Checks the parameters, the state, and that the state lies on the constraints.
fn check<M: Simulate>(model: &M, start: &M::State) -> Result<(), PeriodicError> {
    StateError::check_parameters(model)?;
    StateError::check::<M>(start)?;
    check_start(model, start)?;
    Ok(())
}

fn check_period(period: f64) -> Result<(), PeriodicError> {
    positive("the period", period)
}

fn positive(what: &'static str, value: f64) -> Result<(), PeriodicError> {
    if value > 0.0 && value.is_finite() {
        return Ok(());
    }
    Err(PeriodicError::Option { what, value, needed: "positive and finite" })
}

fn finite(what: &'static str, value: f64) -> Result<(), PeriodicError> {
    if value.is_finite() { Ok(()) } else { Err(PeriodicError::Option { what, value, needed: "finite" }) }
}

/// The index of a coordinate by its name.
fn index<M: Simulate>(name: &str) -> Result<usize, PeriodicError> {
    let found = M::COORDINATES.iter().position(|q| q.name == name);
    found.ok_or_else(|| PeriodicError::UnknownCoordinate {
        name: name.into(),
        nearest: dynamics_view::suggest(name, M::COORDINATES.iter().map(|q| q.name)),
    })
}
