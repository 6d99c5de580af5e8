//! Checks of the parameters of a model and of the values of a state.

use super::{Dynamics, ModelState, Vector};
use crate::declaration::{Assumption, AssumptionViolation, Quantity};
use crate::error::StateError;

/// The first assumption of a model that does not hold: of those that parameters decide, or, with a state, of
/// the others.
pub(crate) fn violated_assumption<M: Dynamics>(
    model: &M,
    state: Option<&M::State>,
) -> Option<(&'static Assumption, AssumptionViolation)> {
    if !M::ASSUMPTIONS.iter().any(|assumption| assumption.constant != state.is_some()) {
        return None;
    }
    let nowhere = || M::State::new(f64::NAN, M::Vector::zeros(), M::Vector::zeros(), M::Inputs::zeros());
    let (mut assumptions, mut first) = (M::ASSUMPTIONS.iter(), None);
    model.assumptions(&state.copied().unwrap_or_else(nowhere), &mut |values| {
        let assumption =
            assumptions.next().filter(|assumption| first.is_none() && assumption.constant != state.is_some());
        first = first.or_else(|| {
            assumption.and_then(|assumption| Some((assumption, assumption.check(values).err()?)))
        });
    });
    first
}

/// The first scalar parameter that is infinite or not a number, of models that tell them, with its value.
pub(crate) fn parameter_not_finite<M: Dynamics>(model: &M) -> Option<(&'static str, f64)> {
    let mut values =
        M::PARAMETERS.iter().enumerate().filter_map(|(i, named)| Some((named.name, model.parameter(i)?)));
    values.find(|(_, value)| !value.is_finite())
}

impl StateError {
    /// Checks that all scalar parameters are finite, of models that tell them, and that they make bodies and
    /// rotations.
    ///
    /// # Errors
    /// [`StateError::NotFinite`] with the first that is not, [`StateError::Unphysical`].
    // Public for dynamics-analysis alone.
    #[doc(hidden)]
    pub fn check_parameters<M: Dynamics>(model: &M) -> Result<(), Self> {
        if let Some((name, value)) = parameter_not_finite(model) {
            return Err(Self::NotFinite { what: "parameter", name, value });
        }
        violated_assumption(model, None)
            .map_or(Ok(()), |(assumption, why)| Err(Self::Unphysical { assumption, why }))
    }

    /// Checks that masses, inertia and rotations that coordinates and time decide are some in this state.
    ///
    /// # Errors
    /// [`StateError::Unphysical`]
    pub fn check_bodies<M: Dynamics>(model: &M, state: &M::State) -> Result<(), Self> {
        violated_assumption(model, Some(state))
            .map_or(Ok(()), |(assumption, why)| Err(Self::Unphysical { assumption, why }))
    }

    /// Checks that all values of a state are finite; inputs may be NaN, which means not set.
    pub fn check<M: Dynamics>(state: &M::State) -> Result<(), Self> {
        fn all(what: &'static str, values: &[f64], names: &'static [Quantity]) -> Result<(), StateError> {
            match values.iter().zip(names).find(|(value, _)| !value.is_finite()) {
                Some((&value, quantity)) => Err(StateError::NotFinite { what, name: quantity.name, value }),
                None => Ok(()),
            }
        }
        if !state.t().is_finite() {
            return Err(Self::NotFinite { what: "time", name: "t", value: state.t() });
        }
        all("coordinate", state.q().as_slice(), M::COORDINATES)?;
        all("velocity of", state.u().as_slice(), M::COORDINATES)?;
        match state.inputs().as_slice().iter().zip(M::INPUTS).find(|(value, _)| value.is_infinite()) {
            Some((&value, quantity)) => Err(Self::NotFinite { what: "input", name: quantity.name, value }),
            None => Ok(()),
        }
    }
}
