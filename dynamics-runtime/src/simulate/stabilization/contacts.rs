//! The contacts of a run: which of them touch at an impact, and which hit is too slow to rebound.
//!
//! A hit below the rest speed closes the contact instead of rebounding. Where [`Contact::rest_speed`] is not
//! given it is relative to the fastest hit of that contact so far. The impact itself is solved by
//! [`constrain::impact`]; `events/action.rs` calls it. Infinitely many rebounds that do not fall below the
//! rest speed are found by `events/zeno.rs`.

use alloc::vec::Vec;

use crate::constrain;
use crate::constrain::assemble::size_along;
use crate::error::SolveError;
use crate::model::{ActiveSet, Constraint, Constraints, ModelState, Vector};
use crate::simulate::options::contact::Contact;
use crate::simulate::stabilization::{Distances, Stabilization};

/// A contact of a run, with the fastest hit so far.
#[derive(Clone)]
pub(crate) struct ContactHistory {
    /// Index of its constraint.
    pub(crate) constraint: usize,
    pub(crate) law: Contact,
    /// The largest speed −Φ̇ with which it was hit.
    pub(crate) fastest_hit: f64,
}

/// Gap below which an open contact touches, so that it takes part in an impact of another one:
/// |Φ|/‖Φ_q‖ in parts of its [size](size_along). It is far above rounding, 1e-16 of the size, and far
/// below what steps resolve. A larger bound would let impacts act on contacts that are open.
const TOUCHING_GAP: f64 = 1e-11;
/// Rest speed of a contact, in parts of its fastest hit: a rebound from there has a millionth of the energy.
const REST_SPEED: f64 = 1e-3;
/// The same for a contact that is hit again before it was seen to open. Such hops are shorter than steps
/// resolve, so slower rebounds are not followed.
const HIDDEN_HOP_REST_SPEED: f64 = 0.1;

impl<M: Constraints> Stabilization<M> {
    /// Indices of the constraints of the contacts that hold or touch. Velocities are projected before, so
    /// that contacts that hold have no drift in them.
    pub(crate) fn touching_contacts(
        &mut self,
        model: &M,
        state: &mut M::State,
        active_set: ActiveSet,
    ) -> Result<Vec<usize>, SolveError> {
        if self.contacts.is_empty() {
            return Ok(Vec::new());
        }
        constrain::project_velocities(model, &self.constants, state, &mut self.workspace)?;
        let residual = model.residual(state);
        let distances = Distances::of(model, state, &mut self.workspace);
        let touches = |at: usize| {
            let Constraint { first, switched, .. } = M::CONSTRAINTS[at];
            let size = || size_along(model, state.q().as_slice(), distances.gradients.row(first));
            let is_touching =
                residual[first] <= 0.0 || distances.distance(first, residual[first]) <= TOUCHING_GAP * size();
            switched.is_some_and(|switch| active_set.holds(switch)) || is_touching
        };
        Ok(self.contacts.iter().map(|contact| contact.constraint).filter(|at| touches(*at)).collect())
    }

    /// The coefficient of restitution of a hit: 0 where it is too slow to rebound.
    pub(crate) fn restitution(&mut self, constraint: usize, rates: &M::Rows) -> f64 {
        let Some(contact) = self.contacts.iter_mut().find(|contact| contact.constraint == constraint) else {
            return 0.0;
        };
        let approach = -rates[M::CONSTRAINTS[constraint].first];
        contact.fastest_hit = contact.fastest_hit.max(approach);
        let rest_speed = contact.law.rest_speed.unwrap_or(REST_SPEED * contact.fastest_hit);
        let restitution = contact.law.restitution;
        if approach > rest_speed {
            return restitution;
        }
        if restitution > 0.0 && contact.law.rest_speed.is_none() {
            self.counts.note_rest(approach);
        }
        0.0
    }

    /// Whether a contact approaches or separates below its rest speed.
    pub(crate) fn is_slow(&self, constraint: usize, rates: &M::Rows) -> bool {
        self.is_below_rest(constraint, rates, REST_SPEED)
    }

    /// Whether a contact that is hit again before it was seen to open comes to rest. See
    /// [`HIDDEN_HOP_REST_SPEED`].
    pub(crate) fn rests_after_hidden_hop(&mut self, constraint: usize, rates: &M::Rows) -> bool {
        let rests = self.is_below_rest(constraint, rates, HIDDEN_HOP_REST_SPEED);
        let has_given_speed =
            |contact: &ContactHistory| contact.constraint == constraint && contact.law.rest_speed.is_some();
        if rests && !self.contacts.iter().any(has_given_speed) {
            self.counts.note_rest(rates[M::CONSTRAINTS[constraint].first]);
        }
        rests
    }

    /// Whether a contact whose rebound is below the resolution of velocities comes to rest: always, unless a
    /// rest speed was given, which alone decides.
    pub(crate) fn rests_unresolved(&mut self, constraint: usize, rates: &M::Rows) -> bool {
        let has_given_speed =
            |contact: &ContactHistory| contact.constraint == constraint && contact.law.rest_speed.is_some();
        if self.contacts.iter().any(has_given_speed) {
            return false;
        }
        self.counts.note_rest(rates[M::CONSTRAINTS[constraint].first]);
        true
    }

    fn is_below_rest(&self, constraint: usize, rates: &M::Rows, part: f64) -> bool {
        let rate = rates[M::CONSTRAINTS[constraint].first];
        let contact = self.contacts.iter().find(|contact| contact.constraint == constraint);
        contact
            .is_some_and(|contact| rate.abs() <= contact.law.rest_speed.unwrap_or(part * contact.fastest_hit))
    }
}
