//! Projection: ends of steps, stages and states in between are moved onto the constraints.
//!
//! Positions move along M⁻¹Φ_qᵀ to Φ = 0, velocities along M⁻¹Φ_qᵀ to Φ̇ = 0
//! ([`constrain::project_positions`], [`constrain::project_velocities`]). This file decides which states are
//! projected and whether rounding errors would make the projected state worse than the given one. Near
//! singular positions corrections amplify rounding errors of Φ. That is measured by the sensitivity of a
//! projection: the size of its correction over the violation that it corrects. The stepper asks for projected
//! ends in [`crate::simulate::right_hand_side`], and rejects a step whose end moves too far.

use crate::error::SolveError;
use crate::integrate::Tolerances;
use crate::linalg::max_abs;
use crate::model::{Constraints, ModelState, SolverKind, Vector};
use crate::simulate::options::formulation::Formulation;
use crate::simulate::stabilization::Stabilization;
use crate::{constrain, math};

/// Weight of the last step in the geometric mean of sensitivities: the mean follows the motion within about
/// ten steps. With a larger weight, a few steps near a singular position would make their own amplification
/// count as normal; with a smaller one the mean would remember the start for long.
const WEIGHT_OF_LATEST_SENSITIVITY: f64 = 0.1;

impl<M: Constraints> Stabilization<M> {
    /// Projects a stage: to the tolerances of the stages where such are set, else to rounding level.
    pub(crate) fn project_stage(&mut self, model: &M, state: &mut M::State) -> Result<(), SolveError> {
        match self.stage_tolerances {
            Some(tolerances) => {
                let _ = self.project_between(model, state, &tolerances);
                Ok(())
            }
            None => self.project_state(model, state).map(|_| ()),
        }
    }

    /// Projects a state to rounding level. Returns the error that may remain in its velocities: rounding
    /// errors of Φ, amplified by the constraints.
    pub(crate) fn project(&mut self, model: &M, state: &mut M::State) -> Result<f64, SolveError> {
        let sensitivity = self.project_state(model, state)?;
        Ok(self.note_projection_noise(state, sensitivity))
    }

    /// Projects the positions of `end` onto the holonomic constraints along M⁻¹Φ_qᵀ of the state
    /// `from`.
    pub(crate) fn project_positions_along(
        &mut self,
        model: &M,
        from: &M::State,
        end: &mut M::State,
    ) -> Result<(), SolveError> {
        constrain::project_along(model, &self.constants, from, end, &mut self.workspace)
    }

    /// Projects the positions of a state onto the holonomic constraints that hold in it.
    pub(crate) fn project_positions(&mut self, model: &M, state: &mut M::State) -> Result<(), SolveError> {
        constrain::project_positions(model, &self.constants, state, &mut self.workspace).map(|_| ())
    }

    /// Projects positions, then velocities. Returns the larger sensitivity of both.
    fn project_state(&mut self, model: &M, state: &mut M::State) -> Result<f64, SolveError> {
        let positions = constrain::project_positions(model, &self.constants, state, &mut self.workspace)?;
        let velocities = constrain::project_velocities(model, &self.constants, state, &mut self.workspace)?;
        let has_generated_partition = self.embeds() && matches!(M::SOLVER, SolverKind::Unrolled { .. });
        self.counts.repartitions +=
            u64::from(has_generated_partition && positions.general + velocities.general > 0);
        Ok(positions.sensitivity.max(velocities.sensitivity))
    }

    /// Whether stages are projected.
    #[inline(always)]
    pub(crate) fn projects_stages(&self) -> bool {
        self.stage_tolerances.is_some() || self.embeds()
    }

    /// Switches the projection of stages, to these tolerances, on or off. The embedded formulation always
    /// projects them. Returns whether the formulation leaves a choice.
    pub(crate) fn switch_stage_projection(&mut self, on: bool, tolerances: &Tolerances) -> bool {
        let possible = self.formulation == Some(Formulation::Projected);
        self.stage_tolerances = (self.embeds() || on && possible).then_some(*tolerances);
        possible
    }

    /// Projects a state between the ends of a step, unless the noise of the projection is larger than its
    /// change of the velocities and than the tolerance, as near a position where the constraints lose rank.
    /// Returns whether that noise is within the tolerances.
    pub(crate) fn project_between(
        &mut self,
        model: &M,
        state: &mut M::State,
        tolerances: &Tolerances,
    ) -> bool {
        let mut projected = *state;
        let Ok(sensitivity) = self.project_state(model, &mut projected) else { return false };
        if sensitivity == 0.0 {
            // The state fulfils the constraints already.
            return true;
        }
        let mean = *self.mean_sensitivity.get_or_insert(sensitivity);
        let permitted = tolerances.absolute + tolerances.relative * max_abs(projected.u().as_slice());
        let velocity_changes =
            projected.u().as_slice().iter().zip(state.u().as_slice()).map(|(to, from)| (to - from).abs());
        let noise = projection_noise(&projected, sensitivity, mean);
        if noise <= velocity_changes.fold(permitted, math::max) {
            *state = projected;
        }
        noise <= permitted
    }

    /// Notes the sensitivity of a step's end, and returns the error that rounding leaves in its velocities.
    ///
    /// Φ is known to ε(1 + |q|). Where corrections are A times as large as in the mean, positions are wrong
    /// by A times that along the direction that is nearly lost, and velocities by A²|q̇| times that.
    fn note_projection_noise(&mut self, state: &M::State, sensitivity: f64) -> f64 {
        if sensitivity == 0.0 || !sensitivity.is_finite() {
            return 0.0;
        }
        let mean = *self.mean_sensitivity.get_or_insert(sensitivity);
        self.latest_sensitivity = Some(sensitivity);
        projection_noise(state, sensitivity, mean)
    }

    /// A step was recorded: includes its sensitivity in the mean.
    #[inline]
    pub(crate) fn update_mean_sensitivity(&mut self) {
        if let (Some(mean), Some(latest)) = (self.mean_sensitivity, self.latest_sensitivity.take()) {
            self.mean_sensitivity = Some(
                math::powf(mean, 1.0 - WEIGHT_OF_LATEST_SENSITIVITY)
                    * math::powf(latest, WEIGHT_OF_LATEST_SENSITIVITY),
            );
        }
    }
}

/// See [`Stabilization::note_projection_noise`].
fn projection_noise<S: ModelState>(state: &S, sensitivity: f64, mean: f64) -> f64 {
    let amplified = (sensitivity / mean).max(1.0);
    let (q, u) = (max_abs(state.q().as_slice()), max_abs(state.u().as_slice()));
    f64::EPSILON * (1.0 + q) * amplified * (1.0 + amplified * u)
}
