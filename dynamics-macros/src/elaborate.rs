//! The Rust subset of models → `dynamics_symbolic::mechanics::Model`.

mod origins;
pub(crate) mod suggest;

use dynamics_symbolic::mechanics::Model;

use crate::diagnostics::Diagnostics;
use crate::syntax::{Declaration, Implementation};
use origins::Origins;

/// What elaboration hands to the engine, and what the engine's findings need to find their way back.
pub(crate) struct Elaborated {
    pub(crate) model: Model,
    pub(crate) origins: Origins,
}

/// Elaborates all functions that have a role.
pub(crate) fn elaborate(_: &Declaration, _: &Implementation, _: &mut Diagnostics) -> Elaborated {
    Elaborated { model: Model::default(), origins: Origins::default() }
}
