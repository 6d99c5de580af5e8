//! Parameters and elements of the start by name: what analyses can vary.

use alloc::borrow::ToOwned;
use alloc::format;
use alloc::string::String;
use alloc::vec::Vec;
use core::fmt;

use dynamics_runtime::model::{Dynamics, ModelState, Parameters, Quantity};
use dynamics_view::suggest;

/// A parameter, or an element of the start.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Variable {
    /// The scalar parameter of this index.
    Parameter(usize),
    /// The coordinate of this index at the start.
    Position(usize),
    /// The velocity of the coordinate of this index at the start.
    Velocity(usize),
}

/// A name that cannot be varied, or an invalid value.
#[derive(Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum VariableError {
    /// No parameter, coordinate or velocity has this name.
    #[error(fmt = unknown)]
    Unknown {
        /// The name that was asked for.
        name: String,
        /// A similar name.
        nearest: Option<String>,
    },
    /// A parameter and a coordinate have this name.
    #[error("`{name}` is a parameter and a coordinate; rename one of them")]
    Ambiguous {
        /// The name.
        name: String,
    },
    /// The same was named twice.
    #[error("`{name}` is named twice; once is enough")]
    Twice {
        /// The name.
        name: String,
    },
    /// The model, written by hand, does not let this parameter be changed.
    #[error("the model does not let `{name}` be changed; implement `Parameters::set_parameter` for it")]
    Fixed {
        /// The parameter.
        name: String,
    },
    /// A value is not a finite number.
    #[error("`{name}` cannot be {value}; give finite numbers")]
    NotFinite {
        /// The name.
        name: String,
        /// The value.
        value: f64,
    },
}

fn unknown(name: &str, nearest: &Option<String>, f: &mut fmt::Formatter<'_>) -> fmt::Result {
    match nearest {
        Some(near) => write!(f, "there is no parameter or start `{name}`; did you mean `{near}`?"),
        None => write!(
            f,
            "there is no parameter or start `{name}`; `PARAMETERS` and `COORDINATES` list what \
             there is"
        ),
    }
}

dynamics_runtime::sentence_for_debugging!(VariableError);

/// The name of a coordinate's velocity: `theta_rate`, `x_rate[3]`.
fn rate_name(coordinate: &str) -> String {
    match coordinate.split_once('[') {
        Some((name, index)) => format!("{name}_rate[{index}"),
        None => format!("{coordinate}_rate"),
    }
}

impl Variable {
    /// The variable of a name.
    ///
    /// # Errors
    /// A name that is unknown or has two meanings.
    #[doc(hidden)]
    pub fn of<M: Dynamics>(name: &str) -> Result<Self, VariableError> {
        let at = |list: &[Quantity]| list.iter().position(|q| q.name == name);
        let rate = M::COORDINATES.iter().position(|q| rate_name(q.name) == name).map(Self::Velocity);
        let found = [at(M::PARAMETERS).map(Self::Parameter), at(M::COORDINATES).map(Self::Position), rate];
        let mut found = found.into_iter().flatten();
        match (found.next(), found.next()) {
            (Some(one), None) => Ok(one),
            (Some(_), Some(_)) => Err(VariableError::Ambiguous { name: name.to_owned() }),
            (None, _) => {
                let rates: Vec<String> = M::COORDINATES.iter().map(|q| rate_name(q.name)).collect();
                let known = M::PARAMETERS.iter().chain(M::COORDINATES).map(|q| q.name);
                let nearest = suggest(name, known.chain(rates.iter().map(String::as_str)));
                Err(VariableError::Unknown { name: name.to_owned(), nearest })
            }
        }
    }

    /// The variables of several names, each once.
    ///
    /// # Errors
    /// As of [`Variable::of`], and a name that occurs twice.
    #[doc(hidden)]
    pub fn all_of<M: Dynamics>(names: &[String]) -> Result<Vec<Self>, VariableError> {
        let mut variables = Vec::new();
        for name in names {
            let variable = Self::of::<M>(name)?;
            if variables.contains(&variable) {
                return Err(VariableError::Twice { name: name.clone() });
            }
            variables.push(variable);
        }
        Ok(variables)
    }

    /// Its name.
    #[must_use]
    pub fn name<M: Dynamics>(self) -> String {
        match self {
            Self::Parameter(i) => M::PARAMETERS[i].name.to_owned(),
            Self::Position(i) => M::COORDINATES[i].name.to_owned(),
            Self::Velocity(i) => rate_name(M::COORDINATES[i].name),
        }
    }

    /// Its unit, `""` where it is 1 or not known.
    #[must_use]
    pub fn unit<M: Dynamics>(self) -> String {
        match self {
            Self::Parameter(i) => M::PARAMETERS[i].unit.to_owned(),
            Self::Position(i) => M::COORDINATES[i].unit.to_owned(),
            Self::Velocity(i) => match M::COORDINATES[i].unit {
                "" => String::new(),
                unit => format!("{unit}/s"),
            },
        }
    }

    /// Its value; `None` if a model written by hand does not give its parameters.
    #[doc(hidden)]
    pub fn value<M: Dynamics>(self, model: &M, start: &M::State) -> Option<f64> {
        match self {
            Self::Parameter(i) => model.parameter(i),
            Self::Position(i) => Some(start.q()[i]),
            Self::Velocity(i) => Some(start.u()[i]),
        }
    }

    /// Checks that it can be changed. Models written by hand may forbid it for some parameters.
    ///
    /// # Errors
    /// A parameter that cannot be changed.
    #[doc(hidden)]
    pub fn check<M: Parameters + Clone>(
        self,
        model: &M,
        start: &M::State,
        value: f64,
    ) -> Result<(), VariableError> {
        let changed = self.set(&mut model.clone(), &mut start.clone(), value);
        if changed { Ok(()) } else { Err(VariableError::Fixed { name: self.name::<M>() }) }
    }

    /// Sets it, and returns whether it can be set.
    #[doc(hidden)]
    pub fn set<M: Parameters>(self, model: &mut M, start: &mut M::State, value: f64) -> bool {
        match self {
            Self::Parameter(i) => return model.set_parameter(i, value),
            Self::Position(i) => start.q_mut()[i] = value,
            Self::Velocity(i) => start.u_mut()[i] = value,
        }
        true
    }
}

/// The model with a parameter moved by `by`.
pub(super) fn moved<M: Parameters + Clone>(model: &M, parameter: usize, by: f64) -> Option<M> {
    model.with_parameter(parameter, model.parameter(parameter)? + by)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn velocities_of_arrays_are_named_as_in_tables() {
        assert_eq!(rate_name("theta"), "theta_rate");
        assert_eq!(rate_name("x[3]"), "x_rate[3]");
    }
}
