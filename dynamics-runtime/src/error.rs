//! Errors, with the values needed to act on them.

use core::fmt;

use crate::model::{Dynamics, ModelState, Quantity, Vector};

/// The mass matrix has no inverse at this state: a pivot of its factorization LDLᵀ vanished against its diagonal.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SingularMassMatrix {
    /// Index of the coordinate whose pivot vanished.
    pub coordinate: usize,
    /// Its name.
    pub name: &'static str,
    /// The pivot.
    pub pivot: f64,
    /// The pivot is negative although M comes from a kinetic energy: M is regular, but not positive definite.
    pub negative: bool,
}

impl fmt::Display for SingularMassMatrix {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if self.negative {
            let (name, pivot) = (self.name, self.pivot);
            return write!(
                f,
                "the mass matrix is not positive definite: coordinate `{name}` has negative inertia at this state (pivot {pivot:e})"
            );
        }
        write!(
            f,
            "the mass matrix is singular: coordinate `{}` has no inertia of its own at this state (pivot {:e})",
            self.name, self.pivot
        )
    }
}

impl core::error::Error for SingularMassMatrix {}

/// A value given to a state builder is not finite.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub enum StateError {
    /// A coordinate, velocity, input or the time is infinite or not a number.
    NotFinite {
        /// What it is: `time`, `coordinate`, `velocity of`, `input`.
        what: &'static str,
        /// Its name; `t` for the time.
        name: &'static str,
        /// The value.
        value: f64,
    },
}

impl StateError {
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

impl fmt::Display for StateError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::NotFinite { what, name, value } => write!(f, "{what} `{name}` is {value}; give a finite number"),
        }
    }
}

impl core::error::Error for StateError {}
