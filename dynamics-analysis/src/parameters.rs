//! How motions, equilibria and frequencies depend on parameters and starts: by many runs ([`Sweep`]), and by
//! exact derivatives ([`Sensitivities`], or [`Gradient`] for many parameters). The inverse problem is
//! parameters from measured motion ([`Fit`]).
//!
//! Parameters are named as in [`Dynamics::PARAMETERS`](dynamics_runtime::model::Dynamics::PARAMETERS) (`m1`,
//! `stiffness[2]`, `track.x`), starts by the coordinate (`theta1`) or its velocity (`theta1_rate`,
//! `x_rate[3]`), everywhere alike.

mod equations;
mod equilibrium_sensitivity;
mod fit;
mod gradient;
pub(crate) mod parallel;
mod sensitivity;
mod sensitivity_error;
mod sweep;
mod variable;

pub use equilibrium_sensitivity::{EquilibriumChange, FrequencyChange};
pub use fit::{Fit, FitError, Fitted, Fitting, Loss, Outlier, Resampled, Residuals};
pub use gradient::{Gradient, Objective};
pub use sensitivity::{Sensitivities, Sensitivity};
pub use sensitivity_error::SensitivityError;
pub use sweep::grid_indices;
pub use sweep::{RunFailure, Sweep, SweepAxis, SweepError, Sweeping};
pub use variable::{Variable, VariableError};

use dynamics_runtime::model::Parameters;
use dynamics_runtime::simulate::Simulate;

/// Models whose parameters and starts can be varied: every derived model that is `Clone`.
pub trait Vary: Simulate + Parameters + Clone {
    /// Begins a sweep over a grid of parameters and starts. Quantities without an axis have the values of
    /// this model and this start.
    fn sweep(&self, start: Self::State) -> Sweeping<'_, Self> {
        Sweeping::new(self, start)
    }

    /// Begins the sensitivities of the motion from a start. Options follow; [`Sensitivity::run`] runs it.
    fn sensitivities(&self, start: Self::State) -> Sensitivity<'_, Self> {
        Sensitivity::new(self, start)
    }

    /// Begins an objective: one number of the motion from a start, to be differentiated by all parameters and
    /// starts at once. Its terms follow; [`Objective::run`] runs it.
    fn objective(&self, start: Self::State) -> Objective<'_, Self> {
        Objective::new(self, start)
    }

    /// Begins a fit of parameters and starts to measured motion. The first values are those of this model and
    /// this start.
    fn fit(&self, start: Self::State) -> Fitting<'_, Self> {
        Fitting::new(self, start)
    }

    /// How an equilibrium moves with a parameter.
    ///
    /// # Errors
    /// An unknown name; a state that is not an equilibrium; an equilibrium without a derivative, as in a
    /// fold; forces that change with time, at this or a neighbouring value of the parameter.
    fn equilibrium_by(
        &self,
        state: &Self::State,
        parameter: &str,
    ) -> Result<EquilibriumChange, SensitivityError> {
        equilibrium_sensitivity::equilibrium_by(self, state, parameter)
    }

    /// How the natural frequencies of undamped small motions about an equilibrium change with a parameter.
    /// The change of the equilibrium is included.
    ///
    /// # Errors
    /// As [`Vary::equilibrium_by`]; also where small motions are damped, gyroscopic or circulatory.
    fn frequencies_by(
        &self,
        state: &Self::State,
        parameter: &str,
    ) -> Result<Vec<FrequencyChange>, SensitivityError> {
        equilibrium_sensitivity::frequencies_by(self, state, parameter)
    }
}

impl<M: Simulate + Parameters + Clone> Vary for M {}
