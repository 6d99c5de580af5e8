//! The event functions of a run, and their values.
//!
//! A function has one index in the order: events of the model, events given at the simulation, unilateral
//! constraints. `location.rs` finds their crossings.

use alloc::boxed::Box;
use alloc::string::String;
use alloc::vec;
use alloc::vec::Vec;
use core::cell::{RefCell, RefMut};

use crate::constrain::assemble::{CONSISTENT, size_along};
use crate::constrain::{self, ConstrainedAccelerationsOf, Gradients};
use crate::error::SolveError;
use crate::model::{ModelState, SimulationModel, StaticTraits, Vector};
use crate::simulate::events::unilateral::{UnilateralConstraint, UnilateralConstraints};
use crate::simulate::failure::SimulationErrorKind as Kind;
use crate::simulate::stabilization::missed_row;

/// An event function given at the simulation.
pub(crate) struct AddedEvent<'m, S> {
    pub(crate) name: String,
    pub(crate) function: Box<dyn Fn(&S) -> f64 + 'm>,
}

/// All event functions of a run.
pub(crate) struct EventFunctions<'m, M: SimulationModel> {
    pub(crate) model: &'m M,
    constants: M::Constants,
    added_events: Vec<AddedEvent<'m, M::State>>,
    pub(crate) unilaterals: UnilateralConstraints,
    /// Workspace for reactions and gradients of constraints. Empty where there are no functions.
    workspace: RefCell<Vec<f64>>,
}

impl<'m, M: SimulationModel> EventFunctions<'m, M> {
    pub(crate) fn new(
        model: &'m M,
        constants: M::Constants,
        added_events: Vec<AddedEvent<'m, M::State>>,
        unilaterals: UnilateralConstraints,
    ) -> Self {
        let none = M::EVENTS.is_empty() && added_events.is_empty() && unilaterals.is_empty();
        let len = if M::IS_UNCONSTRAINED || none {
            0
        } else {
            constrain::workspace_len(M::COORDINATES.len(), M::ROWS.len())
        };
        Self { model, constants, added_events, unilaterals, workspace: RefCell::new(vec![0.0; len]) }
    }

    pub(crate) fn count(&self) -> usize {
        self.first_unilateral() + self.unilaterals.len()
    }

    pub(crate) fn first_unilateral(&self) -> usize {
        M::EVENTS.len() + self.added_events.len()
    }

    pub(crate) fn name(&self, index: usize) -> &str {
        if let Some(event) = M::EVENTS.get(index) {
            return event.name;
        }
        match self.added_events.get(index - M::EVENTS.len()) {
            Some(event) => &event.name,
            None => &self.unilaterals[index - self.first_unilateral()].name,
        }
    }

    /// Values of all functions at a state.
    pub(crate) fn evaluate(&self, state: &M::State, values: &mut [f64]) -> Result<(), Kind> {
        let (own, given) = values.split_at_mut(M::EVENTS.len());
        self.model.events(state, own)?;
        for (value, event) in given.iter_mut().zip(&self.added_events) {
            *value = (event.function)(state);
        }
        let (events, unilateral_values) = values.split_at_mut(self.first_unilateral());
        let mut known = None;
        for (value, unilateral) in unilateral_values.iter_mut().zip(&self.unilaterals) {
            *value = self.unilateral_value(unilateral, state, |event| Ok(events[event]), &mut known)?;
        }
        match values.iter().position(|value| value.is_nan()) {
            Some(index) => Err(self.not_a_number(index)),
            None => Ok(()),
        }
    }

    /// Value of one function at a state; `scratch` has the length of all functions.
    pub(crate) fn value(&self, index: usize, state: &M::State, scratch: &mut [f64]) -> Result<f64, Kind> {
        let mut event = |index: usize| match self.added_events.get(index.wrapping_sub(M::EVENTS.len())) {
            Some(event) => Ok((event.function)(state)),
            None => self.model.events(state, &mut scratch[..M::EVENTS.len()]).map(|()| scratch[index]),
        };
        let value = match index.checked_sub(self.first_unilateral()) {
            None => event(index)?,
            Some(unilateral) => {
                self.unilateral_value(&self.unilaterals[unilateral], state, event, &mut None)?
            }
        };
        if value.is_nan() { Err(self.not_a_number(index)) } else { Ok(value) }
    }

    /// Value of the function of a unilateral constraint. `event` evaluates events; `known` keeps the
    /// reactions for the other unilateral constraints.
    fn unilateral_value(
        &self,
        unilateral: &UnilateralConstraint,
        state: &M::State,
        event: impl FnMut(usize) -> Result<f64, SolveError>,
        known: &mut Option<ConstrainedAccelerationsOf<M>>,
    ) -> Result<f64, SolveError> {
        if M::IS_UNSWITCHED {
            // A model without switched constraints has no unilateral ones.
            return Ok(f64::NAN);
        }
        let value = unilateral.value(self.model, state, event, || match known {
            Some(reactions) => Ok(*reactions),
            None => Ok(*known.insert(self.reactions(state)?)),
        })?;
        let is_contact = unilateral.is_contact() && unilateral.holds(state);
        if is_contact && value < 0.0 && known.is_some_and(|reactions| !reactions.unique()) {
            constrain::check_unique(
                self.model,
                state,
                unilateral.constraint.first,
                &mut self.workspace.borrow_mut(),
            )?;
        }
        Ok(value)
    }

    fn not_a_number(&self, index: usize) -> Kind {
        Kind::EventNotANumber { event: self.name(index).into() }
    }

    pub(crate) fn holds(&self, index: usize, state: &M::State) -> bool {
        self.unilaterals[index - self.first_unilateral()].holds(state)
    }

    /// Sticking is about to break away at the start of a step, where its reaction may be zero. Notes the
    /// reaction a little later, whose sign decides the direction of the slip.
    pub(crate) fn note_reaction_ahead(&mut self, index: usize, state: &M::State) -> Result<(), Kind> {
        if M::IS_UNSWITCHED {
            return Ok(());
        }
        let unilateral = index - self.first_unilateral();
        if self.holds(index, state) && !self.unilaterals[unilateral].is_contact() {
            let reaction = self.reactions(state)?.multipliers[self.unilaterals[unilateral].constraint.first];
            self.unilaterals[unilateral].note_reaction_ahead(reaction);
        }
        Ok(())
    }

    /// See [`UnilateralConstraint::note_grazing`].
    pub(crate) fn note_grazing(&mut self, index: usize, since: f64, until: f64) {
        let unilateral = index - self.first_unilateral();
        self.unilaterals[unilateral].note_grazing(since, until);
    }

    /// The time up to which a closed contact may pull, because its reaction grazes zero.
    pub(crate) fn grazes_until(&self, index: usize, state: &M::State) -> Option<f64> {
        let unilateral = &self.unilaterals[index.checked_sub(self.first_unilateral())?];
        unilateral.grazes_until().filter(|_| unilateral.holds(state))
    }

    /// Whether a function is that of a closed contact.
    pub(crate) fn is_closed(&self, index: usize, state: &M::State) -> bool {
        let unilateral =
            index.checked_sub(self.first_unilateral()).map(|unilateral| &self.unilaterals[unilateral]);
        unilateral.is_some_and(|unilateral| unilateral.is_contact() && unilateral.holds(state))
    }

    /// Whether a function is the gap of an open contact, which depends on positions alone.
    pub(crate) fn is_open_gap(&self, index: usize, state: &M::State) -> bool {
        let unilateral =
            index.checked_sub(self.first_unilateral()).map(|unilateral| &self.unilaterals[unilateral]);
        unilateral.is_some_and(|unilateral| unilateral.is_contact() && !unilateral.holds(state))
    }

    /// Refuses an open contact whose gap is negative by more than a start may violate a constraint.
    pub(crate) fn check_open(&self, index: usize, state: &M::State) -> Result<(), Kind> {
        if M::IS_UNSWITCHED {
            return Ok(());
        }
        let unilateral = &self.unilaterals[index - self.first_unilateral()];
        if !unilateral.is_contact() {
            return Ok(());
        }
        match missed_row(
            self.model,
            state,
            (unilateral.constraint, CONSISTENT),
            &mut self.workspace.borrow_mut(),
        ) {
            Some((row, residual)) => Err(Kind::Penetration { row, residual }),
            None => Ok(()),
        }
    }

    /// Whether the gap of a contact is larger than a start may violate a constraint.
    pub(crate) fn is_open(&self, index: usize, state: &M::State) -> bool {
        if M::IS_UNSWITCHED {
            return false;
        }
        let unilateral = &self.unilaterals[index - self.first_unilateral()];
        missed_row(self.model, state, (unilateral.constraint, CONSISTENT), &mut self.workspace.borrow_mut())
            .is_some()
    }

    /// The size to which the gap of a contact is relative.
    pub(crate) fn gap_size(&self, index: usize, state: &M::State) -> f64 {
        if M::IS_UNSWITCHED {
            return 0.0;
        }
        let (unilateral, mut workspace) =
            (&self.unilaterals[index - self.first_unilateral()], self.workspace.borrow_mut());
        let gradients = Gradients::alone(self.model, state, &mut workspace);
        size_along(self.model, state.q().as_slice(), gradients.row(unilateral.constraint.first))
    }

    /// The speed |Φ̇| of a contact; 0 for other functions.
    pub(crate) fn impact_speed(&self, index: usize, state: &M::State) -> f64 {
        if M::IS_UNSWITCHED {
            return 0.0;
        }
        let unilateral = index
            .checked_sub(self.first_unilateral())
            .map(|unilateral| &self.unilaterals[unilateral])
            .filter(|unilateral| unilateral.is_contact());
        unilateral
            .map_or(0.0, |unilateral| self.model.velocity_residual(state)[unilateral.constraint.first].abs())
    }

    pub(crate) fn workspace(&self) -> RefMut<'_, Vec<f64>> {
        self.workspace.borrow_mut()
    }

    fn reactions(&self, state: &M::State) -> Result<ConstrainedAccelerationsOf<M>, SolveError> {
        constrain::solve(self.model, &self.constants, state, &mut self.workspace.borrow_mut())
    }
}
