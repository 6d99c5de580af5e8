//! What cannot vary as it was asked for.

/// Why values cannot be given to the runs.
#[derive(Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum InputError {
    /// Nothing varies.
    #[error("nothing varies; name a parameter or an element of the start, as in `.over(name, values)`")]
    NothingVaries,
    /// An axis has no values.
    #[error("the axis `{name}` has no values; give at least one")]
    Empty {
        /// What was to vary along it.
        name: String,
    },
    /// A value is not finite.
    #[error("`{name}` cannot be {value}; give finite numbers")]
    NotFinite {
        /// What was to have it.
        name: String,
        /// The value.
        value: f64,
    },
    /// A point has too many or too few values.
    #[error("point {point} has {found} values for {names} names; give one for each name")]
    Length {
        /// The point.
        point: usize,
        /// Its values.
        found: usize,
        /// How many there have to be.
        names: usize,
    },
    /// No runs.
    #[error("there are no runs; ask for at least {least}")]
    TooFew {
        /// The fewest runs.
        least: usize,
    },
    /// The runs cannot be counted.
    #[error("there are more than 2⁵² runs; divide them")]
    TooMany,
    /// An interval that is empty or not finite.
    #[error("`{name}` cannot lie between {low} and {high}; give finite bounds, the lower one first")]
    Interval {
        /// What was to lie there.
        name: String,
        /// The lower bound.
        low: f64,
        /// The upper bound.
        high: f64,
    },
    /// A logarithmic interval that is not positive.
    #[error("the bounds of `{name}` must be above 0 for a logarithmic scale, and one is {low}")]
    Logarithm {
        /// What was to lie there.
        name: String,
        /// The lower bound.
        low: f64,
    },
    /// A standard deviation that is not positive.
    #[error("the standard deviation of `{name}` is {deviation}; give a finite number above 0")]
    Deviation {
        /// Whose.
        name: String,
        /// The standard deviation.
        deviation: f64,
    },
    /// A covariance matrix that is none.
    #[error("the covariance of {names} {problem}")]
    Covariance {
        /// Of what.
        names: String,
        /// What is wrong, and what to do.
        problem: String,
    },
    /// More inputs than the sequence has dimensions.
    #[error(
        "the Sobol sequence here has {most} dimensions, and this needs {needed}; use \
         `Samples::latin_hypercube(..)` or `Samples::random(..)`"
    )]
    Dimensions {
        /// How many there are.
        most: usize,
        /// How many are needed.
        needed: usize,
    },
    /// Indices of correlated inputs.
    #[error(
        "Sobol indices need independent inputs, and {names} are correlated; vary the independent causes \
         instead"
    )]
    Correlated {
        /// Which.
        names: String,
    },
}

dynamics_runtime::sentence_for_debugging!(InputError);
