//! Accelerations of several states, compiled for the vectors of a processor.

use crate::lanes::{Code, Lanes};
use crate::model::{Dynamics, WideOf};

/// Where the accelerations of several states find parameters, constants and inputs.
pub trait LaneValues<L: Lanes> {
    /// Whether there are this many.
    fn cover(&self, count: usize) -> bool;
    /// The value with an index, in every lane; `of_model` is that of the model at hand.
    fn value(&self, index: usize, of_model: f64) -> L;
}

/// All states belong to one model and have its parameters, and the same inputs.
#[derive(Clone, Copy, Debug)]
pub struct SharedValues;

impl<L: Lanes> LaneValues<L> for SharedValues {
    #[inline(always)]
    fn cover(&self, _: usize) -> bool {
        true
    }
    #[inline(always)]
    fn value(&self, _: usize, of_model: f64) -> L {
        L::splat(of_model)
    }
}

/// Every state has its own parameters and inputs: those that [`Dynamics::lane_values`] wrote, lane by lane.
#[derive(Clone, Copy, Debug)]
pub struct OwnValues<'a, L>(pub &'a [L]);

impl<L: Lanes> LaneValues<L> for OwnValues<'_, L> {
    #[inline(always)]
    fn cover(&self, count: usize) -> bool {
        self.0.len() >= count
    }
    #[inline(always)]
    fn value(&self, index: usize, _: f64) -> L {
        self.0[index]
    }
}

/// [`Dynamics::accelerations_in_lanes`] as code for [`Lanes::call`].
#[derive(Debug)]
pub struct LaneEvaluation<'a, M: Dynamics, L: Lanes, P> {
    /// The model.
    pub model: &'a M,
    /// Its constants.
    pub constants: &'a M::Constants,
    /// Inputs and active set of all states.
    pub state: &'a M::State,
    /// Where parameters and inputs are found.
    pub values: P,
    /// Times of the states.
    pub t: L,
    /// Their coordinates and velocities.
    pub states: [&'a WideOf<M, L>; 2],
    /// Receives q̈.
    pub accelerations: &'a mut WideOf<M, L>,
}

impl<M: Dynamics, L: Lanes, P: LaneValues<L>> Code for LaneEvaluation<'_, M, L, P> {
    /// Whether the code applied to all states.
    type Output = bool;
    #[inline(always)]
    fn run(self) -> bool {
        let Self { model, constants, state, values, t, states, accelerations } = self;
        model.accelerations_in_lanes(constants, state, &values, t, states, accelerations)
    }
}
