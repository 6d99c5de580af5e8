//! A model with its inputs, as the integrators see it.

use alloc::boxed::Box;

use crate::error::SolveError;
use crate::integrate::System;
use crate::model::{Dynamics, Model, ModelState, Vector};

/// Input values as a function of time and state.
pub(crate) type InputLaw<'m, M> = Box<dyn Fn(f64, &<M as Model>::State) -> <M as Model>::Inputs + Send + Sync + 'm>;

/// Why accelerations do not exist at a state.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum EvaluationError {
    Solve(SolveError),
    /// Index of the input whose value is not finite.
    Input(usize),
}

/// q̈ of a model whose inputs are held or come from a law.
pub(crate) struct Plant<'r, 'm, M: Dynamics> {
    pub(crate) model: &'m M,
    pub(crate) constants: &'r M::Constants,
    pub(crate) law: Option<&'r InputLaw<'m, M>>,
    /// Input values where there is no law; a law sees them in the state it gets.
    pub(crate) held: M::Inputs,
    pub(crate) evaluations: u64,
}

impl<M: Dynamics> Plant<'_, '_, M> {
    /// The state with its inputs.
    #[inline(always)]
    pub(crate) fn state(&self, t: f64, q: &M::Vector, u: &M::Vector) -> M::State {
        with_inputs::<M>(self.law, M::State::new(t, *q, *u, self.held))
    }
}

/// Replaces the inputs of a state by what the law says, if there is one.
#[inline(always)]
pub(crate) fn with_inputs<M: Model>(law: Option<&InputLaw<'_, M>>, mut state: M::State) -> M::State {
    if let Some(law) = law {
        *state.inputs_mut() = law(state.t(), &state);
    }
    state
}

impl<M: Dynamics> System<M::Vector> for Plant<'_, '_, M> {
    type Error = EvaluationError;

    #[inline(always)]
    fn accelerations(&mut self, t: f64, q: &M::Vector, u: &M::Vector) -> Result<M::Vector, EvaluationError> {
        self.evaluations += 1;
        let state = self.state(t, q, u);
        if self.law.is_some()
            && let Some(index) = state.inputs().as_slice().iter().position(|x| !x.is_finite())
        {
            return Err(EvaluationError::Input(index));
        }
        self.model.accelerations_with(self.constants, &state).map_err(EvaluationError::Solve)
    }
}
