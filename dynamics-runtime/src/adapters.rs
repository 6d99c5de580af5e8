//! Models on other solvers: a model as the first-order system y = (q, q̇), ẏ = (q̇, q̈).
//!
//! [`FirstOrder`] writes into slices, so that a closure connects it to any solver. The features `ode_solvers`
//! and `diffsol` implement the interfaces of those crates: `adapters::ode_solvers`, `adapters::diffsol`.
//!
//! # What is lost
//!
//! Other solvers have no events, resets and switched constraints: inputs are held or follow a law, and the
//! active set are those of the start. For models with constraints they integrate the augmented formulation
//! (Φ̈ = 0 in every evaluation). Nothing keeps Φ and Φ̇ at zero: errors of the solver make them *drift*,
//! positions in proportion to t², however accurate each step is. [`FirstOrder::state`] gives states whose
//! `residual` measures the drift. To stay on the constraints, use [`crate::simulate::Simulate::simulate`],
//! which projects.
//!
//! # Where a model fails
//!
//! The interfaces have no errors. Where a model has no accelerations, solvers receive NaN. Good ones shorten
//! the step or stop; some return it as a success. [`FirstOrder::state`] checks: a state that is not finite is
//! an error with the reason of the model.

#[cfg(feature = "diffsol")]
pub mod diffsol;
#[cfg(feature = "ode_solvers")]
pub mod ode_solvers;

use alloc::boxed::Box;
use alloc::vec::Vec;
use core::cell::{Cell, RefCell};
use core::fmt;

use crate::error::{SingularMassMatrix, SolveError, StateError};
use crate::integrate::{Phase, StepNode, by_state};
use crate::model::{InputValues, ModelState, Vector};
use crate::simulate::Simulate;
use crate::simulate::{InputLaw, with_inputs};

/// A model as a first-order system of 2N equations, y = (q, q̇), for solvers of others.
///
/// ```
/// # use dynamics_runtime as dynamics;
/// # use dynamics::adapters::{AdapterError, FirstOrder};
/// # use dynamics::simulate::Simulate;
/// fn euler<M: Simulate>(
///     model: &M,
///     start: M::State,
///     steps: usize,
///     h: f64,
/// ) -> Result<M::State, AdapterError> {
///     let system = FirstOrder::new(model, start)?;
///     let (mut y, mut rate) = (system.initial(), system.initial());
///     let mut t = system.start_time();
///     for _ in 0..steps {
///         system.rate(t, &y, &mut rate);
///         y.iter_mut().zip(&rate).for_each(|(y, rate)| *y += h * rate);
///         t += h;
///     }
///     system.state(t, &y)
/// }
/// ```
pub struct FirstOrder<'m, M: Simulate> {
    model: &'m M,
    constants: M::Constants,
    start: M::State,
    law: Option<InputLaw<'m, M>>,
    /// The last evaluation that failed.
    failure: Cell<Option<(f64, SolveError)>>,
    /// The last Jacobian: solvers ask for its product with one direction after another.
    jacobian: RefCell<LastJacobian>,
}

/// ∂q̈/∂q and ∂q̈/∂q̇ at a time and a y.
#[derive(Default)]
struct LastJacobian {
    at: Option<(f64, Vec<f64>)>,
    by_q: Vec<f64>,
    by_u: Vec<f64>,
}

impl<'m, M: Simulate> FirstOrder<'m, M> {
    /// The system of a model from a start; inputs and active set are held as they are there.
    ///
    /// # Errors
    /// [`AdapterError::Parameter`] where one is not finite, or a mass is negative; [`AdapterError::Singular`]
    /// where the parameters alone make the mass matrix singular.
    pub fn new(model: &'m M, start: M::State) -> Result<Self, AdapterError> {
        StateError::check_parameters(model).map_err(AdapterError::Parameter)?;
        let constants = model.constants().map_err(AdapterError::Singular)?;
        Ok(Self {
            model,
            constants,
            start,
            law: None,
            failure: Cell::new(None),
            jacobian: RefCell::default(),
        })
    }

    /// Input values as a function of time and state, as of [`crate::simulate::Simulation::inputs`].
    #[must_use]
    pub fn inputs<R: InputValues<M::Inputs>>(
        mut self,
        law: impl Fn(f64, &M::State) -> R + Send + Sync + 'm,
    ) -> Self {
        self.law = Some(Box::new(move |t, state| law(t, state).values()));
        self
    }

    /// Time of the start.
    #[must_use]
    pub fn start_time(&self) -> f64 {
        self.start.t()
    }

    /// Number of equations, 2N.
    #[must_use]
    pub fn len(&self) -> usize {
        2 * M::Vector::LEN
    }

    /// Whether the model has no coordinates.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// y at the start.
    #[must_use]
    pub fn initial(&self) -> Vec<f64> {
        [self.start.q().as_slice(), self.start.u().as_slice()].concat()
    }

    /// Writes ẏ at (t, y); NaN where there are no accelerations, and where y or `rate` has not 2N elements.
    /// Why is kept: [`FirstOrder::failure`].
    pub fn rate(&self, t: f64, y: &[f64], rate: &mut [f64]) {
        rate.fill(f64::NAN);
        let Some(at) = self.at(t, y).filter(|_| rate.len() == self.len()) else { return };
        match self.model.accelerations_with(&self.constants, &at) {
            Ok(accelerations) => {
                let (velocities, rest) = rate.split_at_mut(M::Vector::LEN);
                velocities.copy_from_slice(at.u().as_slice());
                rest.copy_from_slice(accelerations.as_slice());
            }
            Err(error) => self.failure.set(Some((t, error))),
        }
    }

    /// Writes (∂ẏ/∂y) v at (t, y), inputs held: exact where the model's derivatives are generated, from
    /// differences where they are not or where inputs follow a law, which is then part of it. NaN as of
    /// [`FirstOrder::rate`].
    pub fn rate_along(&self, t: f64, y: &[f64], v: &[f64], along: &mut [f64]) {
        along.fill(f64::NAN);
        let n = M::Vector::LEN;
        if y.len() != 2 * n || v.len() != 2 * n || along.len() != 2 * n || !self.linearise(t, y) {
            return;
        }
        let jacobian = self.jacobian.borrow();
        let row = |matrix: &[f64], i: usize, v: &[f64]| -> f64 {
            matrix[n * i..n * (i + 1)].iter().zip(v).map(|(a, v)| a * v).sum()
        };
        let (of_q, of_u) = v.split_at(n);
        let (velocities, rest) = along.split_at_mut(n);
        velocities.copy_from_slice(of_u);
        for (i, along) in rest.iter_mut().enumerate() {
            *along = row(&jacobian.by_q, i, of_q) + row(&jacobian.by_u, i, of_u);
        }
    }

    /// The state at (t, y), inputs included.
    ///
    /// # Errors
    /// [`AdapterError::Length`] where y has not 2N elements, [`AdapterError::NotFinite`] where one of them is
    /// not finite, with the model's reason; [`AdapterError::Input`] where that is an input without a value.
    pub fn state(&self, t: f64, y: &[f64]) -> Result<M::State, AdapterError> {
        let state = self.at(t, y).ok_or(AdapterError::Length { given: y.len(), needed: self.len() })?;
        match y.iter().position(|x| !x.is_finite()) {
            None if t.is_finite() => Ok(state),
            index => {
                if let Some(input) = self.missing() {
                    return Err(AdapterError::Input { time: t, input });
                }
                let i = index.unwrap_or(0);
                let (name, rate) = (M::COORDINATES[i % M::Vector::LEN].name, i >= M::Vector::LEN);
                Err(AdapterError::NotFinite { time: t, name, rate, failure: self.failure() })
            }
        }
    }

    /// When the model last had no accelerations, and why; a solver may have found its way round since.
    #[must_use]
    pub fn failure(&self) -> Option<(f64, SolveError)> {
        self.failure.get()
    }

    /// An input that has no value: neither the start nor a law gives one.
    fn missing(&self) -> Option<&'static str> {
        let none = self.start.inputs().as_slice().iter().position(|value| value.is_nan());
        M::INPUTS.get(none.filter(|_| self.law.is_none())?).map(|input| input.name)
    }

    fn at(&self, t: f64, y: &[f64]) -> Option<M::State> {
        if y.len() != self.len() {
            return None;
        }
        let (mut q, mut u) = (M::Vector::zeros(), M::Vector::zeros());
        let (of_q, of_u) = y.split_at(M::Vector::LEN);
        q.as_mut_slice().copy_from_slice(of_q);
        u.as_mut_slice().copy_from_slice(of_u);
        Some(self.complete(t, q, u))
    }

    fn complete(&self, t: f64, q: M::Vector, u: M::Vector) -> M::State {
        let mut state = M::State::new(t, q, u, *self.start.inputs());
        *state.active_set_mut() = self.start.active_set();
        with_inputs::<M>(self.law.as_ref(), state)
    }

    /// Whether ∂q̈/∂q and ∂q̈/∂q̇ exist at (t, y); they are kept.
    fn linearise(&self, t: f64, y: &[f64]) -> bool {
        let mut kept = self.jacobian.borrow_mut();
        if kept.at.as_ref().is_some_and(|(time, place)| *time == t && place == y) {
            return true;
        }
        let Some(at) = self.at(t, y) else { return false };
        let squared = M::Vector::LEN * M::Vector::LEN;
        let LastJacobian { at: place, by_q, by_u } = &mut *kept;
        *place = None;
        by_q.resize(squared, f64::NAN);
        by_u.resize(squared, f64::NAN);
        let is_exact = self.law.is_none() && self.model.acceleration_derivatives(&at, by_q, by_u);
        if !is_exact {
            let knot = StepNode { t, y: Phase { q: *at.q(), u: *at.u() }, a: M::Vector::zeros() };
            let accelerations = |y: &Phase<M::Vector>| {
                self.model.accelerations_with(&self.constants, &self.complete(t, y.q, y.u))
            };
            if let Err(error) = by_state(&knot, by_q, by_u, accelerations) {
                self.failure.set(Some((t, error)));
                return false;
            }
        }
        *place = Some((t, y.to_vec()));
        true
    }
}

impl<M: Simulate> fmt::Debug for FirstOrder<'_, M> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("FirstOrder")
            .field("model", &M::NAME)
            .field("start", &self.start)
            .finish_non_exhaustive()
    }
}

/// Why a model cannot be given to another solver, or what came back is no state.
#[derive(Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum AdapterError {
    /// A parameter is not finite, or no body has such a mass or inertia.
    #[error(transparent)]
    Parameter(StateError),
    /// The parameters alone make the mass matrix singular.
    #[error(transparent)]
    Singular(#[from] SingularMassMatrix),
    /// The motion is not finite, for an input has no value.
    #[error(
        "the motion is not finite at t = {time}, as input `{input}` has no value; set it in the start state \
         or give `FirstOrder::inputs(|t, state| ..)`"
    )]
    Input {
        /// When that was seen.
        time: f64,
        /// The input.
        input: &'static str,
    },
    /// A vector of the solver has not as many elements as the system.
    #[error("{given} elements are no state of {needed}; start the solver from `FirstOrder::initial`")]
    Length {
        /// How many it has.
        given: usize,
        /// How many there are.
        needed: usize,
    },
    /// The solver went on to where the motion is not finite.
    #[error(fmt = not_finite)]
    NotFinite {
        /// When.
        time: f64,
        /// The coordinate.
        name: &'static str,
        /// Whether it is its velocity.
        rate: bool,
        /// When the model last had no accelerations before, and why.
        failure: Option<(f64, SolveError)>,
    },
}

fn not_finite(
    time: &f64,
    name: &str,
    rate: &bool,
    failure: &Option<(f64, SolveError)>,
    f: &mut fmt::Formatter<'_>,
) -> fmt::Result {
    let of = if *rate { "the velocity of " } else { "" };
    write!(f, "the solver returned a motion whose {of}`{name}` is not finite at t = {time}")?;
    match failure {
        Some((when, error)) => write!(f, "; the model had no accelerations at t = {when}: {error}"),
        None => f.write_str("; ask it for shorter steps, or simulate the model to learn why"),
    }
}

crate::error::sentence_for_debugging!(AdapterError);
