//! The contacts of a run: which of them touch, and what of a hit is a rebound and what rest.

use alloc::vec::Vec;

use crate::constrain;
use crate::constrain::assemble::size_along;
use crate::error::SolveError;
use crate::model::{Constraint, Constraints, ModelState, Modes, Vector};
use crate::simulate::options::contact::Contact;
use crate::simulate::stabilization::{Distances, Stabilization};

/// A contact of a run.
#[derive(Clone)]
pub(crate) struct ContactHistory {
    /// Its constraint, by index.
    pub(crate) constraint: usize,
    pub(crate) law: Contact,
    /// The largest speed with which it was hit.
    pub(crate) hardest: f64,
}

/// Contacts closer than this, in parts of their [size](size_along), touch: they are hit at the same instant.
const TOUCHING: f64 = 1e-11;

impl<M: Constraints> Stabilization<M> {
    /// The contacts that hold, and those that touch; by index of their constraints. What holds comes to rest
    /// before, where it has drifted.
    pub(crate) fn touching(
        &mut self,
        model: &M,
        state: &mut M::State,
        modes: Modes,
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
            let near = residual[first] <= 0.0 || distances.along(first, residual[first]) <= TOUCHING * size();
            switched.is_some_and(|switch| modes.holds(switch)) || near
        };
        Ok(self.contacts.iter().map(|contact| contact.constraint).filter(|at| touches(*at)).collect())
    }

    /// The coefficient of restitution with which a contact is hit: 0 where it comes too slowly to rebound.
    pub(crate) fn restitution(&mut self, constraint: usize, rates: &M::Rows) -> f64 {
        let Some(contact) = self.contacts.iter_mut().find(|contact| contact.constraint == constraint) else {
            return 0.0;
        };
        let approach = -rates[M::CONSTRAINTS[constraint].first];
        contact.hardest = contact.hardest.max(approach);
        let rest = contact.law.rest_speed.unwrap_or(1e-3 * contact.hardest);
        let restitution = contact.law.restitution;
        if approach > rest {
            return restitution;
        }
        if restitution > 0.0 && contact.law.rest_speed.is_none() {
            self.counts.rest(approach);
        }
        0.0
    }

    /// Whether a contact moves no faster than what closes instead of rebounding.
    pub(crate) fn is_slow(&self, constraint: usize, rates: &M::Rows) -> bool {
        self.is_below_rest(constraint, rates, 1e-3)
    }

    /// Whether a contact that is back before it was seen to move away may rest. It is as slow as no law would
    /// ask for, where none was given.
    pub(crate) fn rests_unseen(&mut self, constraint: usize, rates: &M::Rows) -> bool {
        let rests = self.is_below_rest(constraint, rates, 0.1);
        let given =
            |contact: &ContactHistory| contact.constraint == constraint && contact.law.rest_speed.is_some();
        if rests && !self.contacts.iter().any(given) {
            self.counts.rest(rates[M::CONSTRAINTS[constraint].first]);
        }
        rests
    }

    /// The same of one that is within what its velocity is known to, however gently it has been hit so far. A
    /// speed that was given decides alone.
    pub(crate) fn rests_unresolved(&mut self, constraint: usize, rates: &M::Rows) -> bool {
        let given =
            |contact: &ContactHistory| contact.constraint == constraint && contact.law.rest_speed.is_some();
        if self.contacts.iter().any(given) {
            return false;
        }
        self.counts.rest(rates[M::CONSTRAINTS[constraint].first]);
        true
    }

    fn is_below_rest(&self, constraint: usize, rates: &M::Rows, part: f64) -> bool {
        let rate = rates[M::CONSTRAINTS[constraint].first];
        let contact = self.contacts.iter().find(|contact| contact.constraint == constraint);
        contact.is_some_and(|contact| rate.abs() <= contact.law.rest_speed.unwrap_or(part * contact.hardest))
    }
}
