//! What is known of a model when it is compiled, so that the compiler leaves out what the model has no use
//! for.
//!
//! Generic code is made for every model before it is optimised, and most of the time of compiling a small
//! model goes there. Behind a test of one of these constants by itself (`if M::IS_FREE`), or of a constant
//! block (`if const { V::LEN > 4 }`), nothing is made that the test rules out; behind `!M::IS_FREE` or a
//! comparison everything is made first. So tests stand where a part begins, the empty branch first, also
//! where what follows would find nothing to do by itself.

#[cfg(feature = "alloc")]
use super::Constraint;
use super::{Constraints, Route};

/// See the module.
pub(crate) trait Known: Constraints {
    /// It has no constraints.
    const IS_FREE: bool = Self::ROWS.is_empty();
    /// Its accelerations are those of [`accelerations_with`](crate::model::Dynamics::accelerations_with), and
    /// nothing else is asked.
    const IS_DIRECT: bool = matches!(Self::ROUTE, Route::Unconstrained);
    /// It has constraints.
    #[cfg(feature = "alloc")]
    const IS_HELD: bool = !Self::ROWS.is_empty();
    /// None of its constraints is switched on and off.
    #[cfg(feature = "alloc")]
    const IS_UNSWITCHED: bool = no_switches(Self::CONSTRAINTS);
    /// Its expressions have branches.
    #[cfg(feature = "alloc")]
    const HAS_KINKS: bool = Self::KINKS > 0;
    /// What depends on its reactions has branches.
    #[cfg(feature = "alloc")]
    const HAS_REACTION_KINKS: bool = Self::REACTION_KINKS > 0;
    /// There are no branches at all.
    #[cfg(feature = "alloc")]
    const IS_SMOOTH: bool = Self::KINKS + Self::REACTION_KINKS == 0;
}

impl<M: Constraints> Known for M {}

#[cfg(feature = "alloc")]
const fn no_switches(constraints: &[Constraint]) -> bool {
    let mut rest = constraints;
    while let [first, others @ ..] = rest {
        if first.switched.is_some() {
            return false;
        }
        rest = others;
    }
    true
}
