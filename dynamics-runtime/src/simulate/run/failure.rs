//! Why a run ended early, as an error with a kind.
//!
//! The kinds and their texts are in [`crate::simulate::failure`]. [`RunFailure::explained`] looks for the
//! cause at the last state, by [`crate::simulate::diagnosis`].

use crate::integrate::{Method, StepError};
use crate::model::{Dynamics, ModelState, SimulationModel};
use crate::simulate::diagnosis::{self, RunMethod};
use crate::simulate::failure::SimulationErrorKind as Kind;
use crate::simulate::right_hand_side::EvaluationError;
use crate::simulate::run::plan::RunPlan;

/// Why a run ended early, and the size of the step in which it did (0 where no step was attempted).
pub(crate) struct RunFailure {
    pub(crate) kind: Kind,
    pub(crate) h: f64,
}

impl RunFailure {
    /// A failure at the current state, outside of any step.
    pub(crate) fn here(kind: Kind) -> Self {
        Self { kind, h: 0.0 }
    }

    /// A step that could not be made.
    pub(crate) fn of_step<M: Dynamics>(error: StepError<EvaluationError>) -> Self {
        let name = |i: usize| M::COORDINATES[i].name;
        match error {
            StepError::Evaluation(error) => Self::here(evaluation::<M>(error)),
            StepError::NotFinite { coordinate, h } => {
                Self { kind: Kind::AccelerationNotFinite { coordinate: name(coordinate) }, h }
            }
            StepError::StepTooSmall { coordinate, h } => {
                Self { kind: Kind::StepSizeTooSmall { coordinate: name(coordinate) }, h }
            }
            StepError::Displaced { coordinate, h } => {
                Self { kind: Kind::StepDisplaced { coordinate: name(coordinate) }, h }
            }
            StepError::NotSolved { coordinate, h } => {
                Self { kind: Kind::StepNotSolved { coordinate: name(coordinate) }, h }
            }
        }
    }

    /// The failure with its cause, where the diagnosis finds one.
    pub(crate) fn explained<M: SimulationModel>(
        self,
        plan: &RunPlan<'_, '_, M>,
        at: &M::State,
        method: Method,
    ) -> Self {
        let run_method = RunMethod::of(method, &plan.options, plan.rhs.stabilization.formulation);
        // A failed evaluation has no step size: take the fixed one.
        let direction = if plan.end < at.t() { -1.0 } else { 1.0 };
        let fixed = || plan.options.fixed.map_or(0.0, |fixed| direction * fixed.abs());
        let h = if self.h == 0.0 { fixed() } else { self.h };
        Self { kind: diagnosis::explain(plan.rhs.model, &plan.start, at, (self.kind, h), run_method), h }
    }
}

/// The kind of a failed evaluation of the right-hand side.
pub(crate) fn evaluation<M: Dynamics>(error: EvaluationError) -> Kind {
    match error {
        EvaluationError::Solve(error) => error.into(),
        EvaluationError::Input(i) => Kind::InputNotFinite { input: M::INPUTS[i].name },
    }
}
