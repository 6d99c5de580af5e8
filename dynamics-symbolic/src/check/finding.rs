//! What the checks find, with the values that a message needs; the wording is the caller's.

use crate::graph::Origin;

/// A mistake in a model.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub enum Finding {
    /// A declared coordinate, parameter, input or function that nothing reads.
    Unused {
        /// `coordinate`, `parameter`, `input`, `function`.
        what: &'static str,
        /// Its name.
        name: String,
        /// Its declaration.
        origin: Origin,
    },
    /// M has no inverse at any state: a direction of motion without inertia.
    NoInertia {
        /// The null direction as text, for example `x - 2 y`; a single name where one coordinate has none.
        direction: String,
        /// Declarations of the coordinates involved.
        origins: Vec<Origin>,
    },
    /// An output or event divides by an expression that is zero on every motion.
    ZeroDenominator,
    /// More operations than rustc can be trusted with.
    TooLarge {
        /// Function that is too large.
        function: String,
        /// Its operations.
        operations: usize,
        /// The limit.
        limit: usize,
    },
}
