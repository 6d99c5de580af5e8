//! Properties of a model at compile time, so that the compiler leaves out code that the model does not need.
//!
//! Generic code is instantiated for every model before it is optimised. This takes most of the time of
//! compiling a small model. The compiler does not instantiate a branch behind one of these constants alone
//! (`if M::IS_UNCONSTRAINED`) or a constant block (`if const { V::LEN > 4 }`) that is false. Behind
//! `!M::IS_UNCONSTRAINED` or a comparison it instantiates both branches first. So such a test stands at the
//! beginning of a part, with the empty branch first, also where the part would have nothing to do.

#[cfg(feature = "alloc")]
use super::Constraint;
use super::{Constraints, SolverKind};

/// See the module.
pub(crate) trait StaticTraits: Constraints {
    /// It has no constraints.
    const IS_UNCONSTRAINED: bool = Self::ROWS.is_empty();
    /// Its accelerations are those of [`accelerations_with`](crate::model::Dynamics::accelerations_with), and
    /// nothing else is asked.
    const IS_DIRECT: bool = matches!(Self::SOLVER, SolverKind::Unconstrained);
    /// It has constraints.
    #[cfg(feature = "alloc")]
    const IS_CONSTRAINED: bool = !Self::ROWS.is_empty();
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

impl<M: Constraints> StaticTraits for M {}

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
