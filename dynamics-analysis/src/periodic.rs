//! Periodic and chaotic motions: Floquet multipliers, closed motions by shooting, Lyapunov exponents,
//! Poincaré sections.
//!
//! ```text
//! // The growth of small disturbances over a period.
//! let judged = model.floquet(&start, period)?;
//! // The closed motion nearby, with its multipliers.
//! let orbit = model.periodic(guess, period).run()?;
//! // The rates at which neighbouring motions separate.
//! let exponents = model.lyapunov(start).settle(100.0).during(2000.0).run()?;
//! // The motion, once a period.
//! let section = model.poincare(start).every(period).points(2000).run()?;
//! ```
//!
//! All use exact variational equations (`flow.rs`), under constraints on their tangent space. Inputs are
//! held. Switched constraints keep the on/off state of the start. Event actions are not executed: a motion
//! whose velocities jump at events is not the one that is judged here.

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

/// Local error per step that is permitted unless one is given: multipliers then have about ten digits.
const TOLERANCE: f64 = 1e-12;
/// Steps of one shot: of a motion that takes more something is stiff, or the period is not one.
const MOST_STEPS: usize = 200_000;

/// See [`Analyze::floquet`](crate::Analyze::floquet).
pub(crate) fn floquet_of<M: Simulate>(
    model: &M,
    start: &M::State,
    period: f64,
) -> Result<Floquet, PeriodicError> {
    check_period(period)?;
    check(model, start)?;
    let advance = DVector::zeros(2 * M::Vector::LEN);
    floquet::of_motion(model, &[*start], period, &advance, (TOLERANCE, MOST_STEPS))
}

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
