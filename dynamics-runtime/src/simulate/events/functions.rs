//! The functions that a run watches, and their values.

use alloc::boxed::Box;
use alloc::string::String;
use alloc::vec;
use alloc::vec::Vec;
use core::cell::{RefCell, RefMut};

use crate::constrain::assemble::{CONSISTENT, size_along};
use crate::constrain::{self, ConstrainedAccelerationsOf, Gradients};
use crate::error::SolveError;
use crate::model::{Known, ModelState, SimulationModel, Vector};
use crate::simulate::events::unilateral::{UnilateralConstraint, UnilateralConstraints};
use crate::simulate::failure::SimulationErrorKind as Fault;
use crate::simulate::stabilization::apart;

/// An event function given at the simulation.
pub(crate) struct AddedEvent<'m, S> {
    pub(crate) name: String,
    pub(crate) function: Box<dyn Fn(&S) -> f64 + 'm>,
}

/// The functions that are watched: those of the model, those given at the simulation, those of the
/// unilateral constraints.
pub(crate) struct EventFunctions<'m, M: SimulationModel> {
    pub(crate) model: &'m M,
    constants: M::Constants,
    added_events: Vec<AddedEvent<'m, M::State>>,
    pub(crate) unilaterals: UnilateralConstraints,
    /// For reactions of unilateral constraints, and gradients of constraints where one is asked for; none
    /// where nothing is watched.
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
        let len = if M::IS_FREE || none {
            0
        } else {
            constrain::workspace_len(M::COORDINATES.len(), M::ROWS.len())
        };
        Self { model, constants, added_events, unilaterals, workspace: RefCell::new(vec![0.0; len]) }
    }

    pub(crate) fn count(&self) -> usize {
        self.first_guard() + self.unilaterals.len()
    }

    pub(crate) fn first_guard(&self) -> usize {
        M::EVENTS.len() + self.added_events.len()
    }

    pub(crate) fn name(&self, index: usize) -> &str {
        if let Some(event) = M::EVENTS.get(index) {
            return event.name;
        }
        match self.added_events.get(index - M::EVENTS.len()) {
            Some(event) => &event.name,
            None => &self.unilaterals[index - self.first_guard()].name,
        }
    }

    /// Values of all functions at a state.
    pub(crate) fn evaluate(&self, state: &M::State, values: &mut [f64]) -> Result<(), Fault> {
        let (own, given) = values.split_at_mut(M::EVENTS.len());
        self.model.events(state, own)?;
        for (value, event) in given.iter_mut().zip(&self.added_events) {
            *value = (event.function)(state);
        }
        let (events, guarded) = values.split_at_mut(self.first_guard());
        let mut known = None;
        for (value, unilateral) in guarded.iter_mut().zip(&self.unilaterals) {
            *value = self.guarded(unilateral, state, |event| Ok(events[event]), &mut known)?;
        }
        match values.iter().position(|value| value.is_nan()) {
            Some(index) => Err(self.not_a_number(index)),
            None => Ok(()),
        }
    }

    /// Value of one function at a state; `scratch` has room for all.
    pub(crate) fn value(&self, index: usize, state: &M::State, scratch: &mut [f64]) -> Result<f64, Fault> {
        let mut event = |index: usize| match self.added_events.get(index.wrapping_sub(M::EVENTS.len())) {
            Some(event) => Ok((event.function)(state)),
            None => self.model.events(state, &mut scratch[..M::EVENTS.len()]).map(|()| scratch[index]),
        };
        let value = match index.checked_sub(self.first_guard()) {
            None => event(index)?,
            Some(unilateral) => self.guarded(&self.unilaterals[unilateral], state, event, &mut None)?,
        };
        if value.is_nan() { Err(self.not_a_number(index)) } else { Ok(value) }
    }

    /// Value of the function of a unilateral constraint; `event` gives those of events, `known` keeps the
    /// reactions for other unilateral constraints.
    fn guarded(
        &self,
        unilateral: &UnilateralConstraint,
        state: &M::State,
        event: impl FnMut(usize) -> Result<f64, SolveError>,
        known: &mut Option<ConstrainedAccelerationsOf<M>>,
    ) -> Result<f64, SolveError> {
        if M::IS_UNSWITCHED {
            // It has no unilateral constraints.
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

    fn not_a_number(&self, index: usize) -> Fault {
        Fault::EventNotANumber { event: self.name(index).into() }
    }

    pub(crate) fn holds(&self, index: usize, state: &M::State) -> bool {
        self.unilaterals[index - self.first_guard()].holds(state)
    }

    /// What sticks is about to break away at the start of a step: its reaction, which may be zero there, is
    /// that of a state a little later.
    pub(crate) fn look_ahead(&mut self, index: usize, state: &M::State) -> Result<(), Fault> {
        if M::IS_UNSWITCHED {
            return Ok(());
        }
        let unilateral = index - self.first_guard();
        if self.holds(index, state) && !self.unilaterals[unilateral].is_contact() {
            let reaction = self.reactions(state)?.multipliers[self.unilaterals[unilateral].constraint.first];
            self.unilaterals[unilateral].look_ahead(reaction);
        }
        Ok(())
    }

    /// What [`UnilateralConstraint::graze`] notes.
    pub(crate) fn graze(&mut self, index: usize, since: f64, until: f64) {
        let unilateral = index - self.first_guard();
        self.unilaterals[unilateral].graze(since, until);
    }

    /// Up to when the contact whose function this is may pull, because its reaction has grazed zero.
    pub(crate) fn grazes_until(&self, index: usize, state: &M::State) -> Option<f64> {
        let unilateral = &self.unilaterals[index.checked_sub(self.first_guard())?];
        unilateral.grazes_until().filter(|_| unilateral.holds(state))
    }

    /// Whether a function is that of a contact that holds.
    pub(crate) fn is_closed(&self, index: usize, state: &M::State) -> bool {
        let unilateral =
            index.checked_sub(self.first_guard()).map(|unilateral| &self.unilaterals[unilateral]);
        unilateral.is_some_and(|unilateral| unilateral.is_contact() && unilateral.holds(state))
    }

    /// Whether a function is one of positions alone, the gap of an open contact.
    pub(crate) fn is_position(&self, index: usize, state: &M::State) -> bool {
        let unilateral =
            index.checked_sub(self.first_guard()).map(|unilateral| &self.unilaterals[unilateral]);
        unilateral.is_some_and(|unilateral| unilateral.is_contact() && !unilateral.holds(state))
    }

    /// A contact that is open has to be so where it is free, but for rounding.
    pub(crate) fn check_open(&self, index: usize, state: &M::State) -> Result<(), Fault> {
        if M::IS_UNSWITCHED {
            return Ok(());
        }
        let unilateral = &self.unilaterals[index - self.first_guard()];
        if !unilateral.is_contact() {
            return Ok(());
        }
        match apart(self.model, state, (unilateral.constraint, CONSISTENT), &mut self.workspace.borrow_mut())
        {
            Some((row, residual)) => Err(Fault::Penetration { row, residual }),
            None => Ok(()),
        }
    }

    /// Whether the constraint of a contact is missed by more than rounding.
    pub(crate) fn is_apart(&self, index: usize, state: &M::State) -> bool {
        if M::IS_UNSWITCHED {
            return false;
        }
        let unilateral = &self.unilaterals[index - self.first_guard()];
        apart(self.model, state, (unilateral.constraint, CONSISTENT), &mut self.workspace.borrow_mut())
            .is_some()
    }

    /// The size against which the gap of a contact is judged.
    pub(crate) fn size(&self, index: usize, state: &M::State) -> f64 {
        if M::IS_UNSWITCHED {
            return 0.0;
        }
        let (unilateral, mut workspace) =
            (&self.unilaterals[index - self.first_guard()], self.workspace.borrow_mut());
        let gradients = Gradients::alone(self.model, state, &mut workspace);
        size_along(self.model, state.q().as_slice(), gradients.row(unilateral.constraint.first))
    }

    /// The speed with which a contact is hit: 0 of what is none.
    pub(crate) fn approach(&self, index: usize, state: &M::State) -> f64 {
        if M::IS_UNSWITCHED {
            return 0.0;
        }
        let unilateral = index
            .checked_sub(self.first_guard())
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
