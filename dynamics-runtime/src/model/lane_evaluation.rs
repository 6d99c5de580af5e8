//! Accelerations of several states, compiled for the vectors of a processor.

use crate::lanes::{Code, Lanes};
use crate::model::{Dynamics, WideOf};

/// [`Dynamics::accelerations_in_lanes`] as code for [`Lanes::call`].
#[derive(Debug)]
pub struct LaneEvaluation<'a, M: Dynamics, L: Lanes> {
    /// The model.
    pub model: &'a M,
    /// Its constants.
    pub constants: &'a M::Constants,
    /// Inputs and active set of all states.
    pub state: &'a M::State,
    /// Their times.
    pub t: L,
    /// Their coordinates and velocities.
    pub states: [&'a WideOf<M, L>; 2],
    /// Receives q̈.
    pub accelerations: &'a mut WideOf<M, L>,
}

impl<M: Dynamics, L: Lanes> Code for LaneEvaluation<'_, M, L> {
    /// Whether the code applied to all states.
    type Output = bool;
    #[inline(always)]
    fn run(self) -> bool {
        let Self { model, constants, state, t, states, accelerations } = self;
        model.accelerations_in_lanes(constants, state, t, states, accelerations)
    }
}
