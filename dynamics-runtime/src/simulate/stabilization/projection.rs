//! Stages and ends of steps are put onto the constraints, as far as rounding errors let them be.

use crate::error::SolveError;
use crate::integrate::Tolerances;
use crate::linalg::max_abs;
use crate::model::{Constraints, ModelState, Route, Vector};
use crate::simulate::options::formulation::Formulation;
use crate::simulate::stabilization::Stabilization;
use crate::{constrain, math};

/// Weight of the last step in the mean sensitivity.
const FADE: f64 = 0.1;

impl<M: Constraints> Stabilization<M> {
    /// Puts a stage onto the constraints.
    pub(crate) fn restore(&mut self, model: &M, state: &mut M::State) -> Result<(), SolveError> {
        match self.held {
            Some(tolerances) => {
                let _ = self.project_between(model, state, &tolerances);
                Ok(())
            }
            None => self.project_state(model, state).map(|_| ()),
        }
    }

    /// Puts a state onto the constraints, to rounding level. Returns by how much it may then still be wrong
    /// in its velocities: rounding errors of Φ, as the constraints amplify them.
    pub(crate) fn project(&mut self, model: &M, state: &mut M::State) -> Result<f64, SolveError> {
        let sensitivity = self.project_state(model, state)?;
        Ok(self.noise(state, sensitivity))
    }

    /// Moves the positions of `end` along M⁻¹Φ_qᵀ of another state onto the holonomic constraints.
    pub(crate) fn move_along(
        &mut self,
        model: &M,
        from: &M::State,
        end: &mut M::State,
    ) -> Result<(), SolveError> {
        constrain::project_along(model, &self.constants, from, end, &mut self.workspace)
    }

    /// Moves the positions of a state onto the holonomic constraints that hold in it.
    pub(crate) fn lift(&mut self, model: &M, state: &mut M::State) -> Result<(), SolveError> {
        constrain::project_positions(model, &self.constants, state, &mut self.workspace).map(|_| ())
    }

    /// Moves a state onto the constraints, weighted by masses. How much that amplified what was off.
    fn project_state(&mut self, model: &M, state: &mut M::State) -> Result<f64, SolveError> {
        let positions = constrain::project_positions(model, &self.constants, state, &mut self.workspace)?;
        let velocities = constrain::project_velocities(model, &self.constants, state, &mut self.workspace)?;
        let anew = self.embeds() && matches!(M::ROUTE, Route::Unrolled { .. });
        self.counts.repartitions += u64::from(anew && positions.general + velocities.general > 0);
        Ok(positions.sensitivity.max(velocities.sensitivity))
    }

    /// Whether stages are put onto the constraints.
    #[inline(always)]
    pub(crate) fn restores(&self) -> bool {
        self.held.is_some() || self.embeds()
    }

    /// Has stages put onto the constraints, as far as tolerances ask for, or no longer, unless they always
    /// are; whether that makes a difference.
    pub(crate) fn hold_stages(&mut self, on: bool, tolerances: &Tolerances) -> bool {
        let possible = self.formulation == Some(Formulation::Projected);
        self.held = (self.embeds() || on && possible).then_some(*tolerances);
        possible
    }

    /// Puts a state between the ends of a step onto the constraints, unless rounding errors would make it
    /// worse than it is: near a position where the constraints lose rank they decide where it ends. Whether
    /// they leave it right to the tolerances.
    pub(crate) fn project_between(
        &mut self,
        model: &M,
        state: &mut M::State,
        tolerances: &Tolerances,
    ) -> bool {
        let mut projected = *state;
        let Ok(sensitivity) = self.project_state(model, &mut projected) else { return false };
        if sensitivity == 0.0 {
            // It is there already.
            return true;
        }
        let usual = *self.usual.get_or_insert(sensitivity);
        let permitted = tolerances.absolute + tolerances.relative * max_abs(projected.u().as_slice());
        let moved =
            projected.u().as_slice().iter().zip(state.u().as_slice()).map(|(to, from)| (to - from).abs());
        let noise = noise_beside(&projected, sensitivity, usual);
        if noise <= moved.fold(permitted, math::max) {
            *state = projected;
        }
        noise <= permitted
    }

    /// Φ is known to ε(1 + |q|). Where corrections are A times as large as usual, the direction that is
    /// nearly lost is wrong by A of that, and, moving on, its velocity by A²|u|.
    fn noise(&mut self, state: &M::State, sensitivity: f64) -> f64 {
        if sensitivity == 0.0 || !sensitivity.is_finite() {
            return 0.0;
        }
        let usual = *self.usual.get_or_insert(sensitivity);
        self.latest = Some(sensitivity);
        noise_beside(state, sensitivity, usual)
    }

    /// A step is over: its sensitivity joins the mean.
    #[inline]
    pub(crate) fn learn(&mut self) {
        if let (Some(usual), Some(latest)) = (self.usual, self.latest.take()) {
            self.usual = Some(math::powf(usual, 1.0 - FADE) * math::powf(latest, FADE));
        }
    }
}

/// See [`Stabilization::noise`].
fn noise_beside<S: ModelState>(state: &S, sensitivity: f64, usual: f64) -> f64 {
    let amplified = (sensitivity / usual).max(1.0);
    let (q, u) = (max_abs(state.q().as_slice()), max_abs(state.u().as_slice()));
    f64::EPSILON * (1.0 + q) * amplified * (1.0 + amplified * u)
}
