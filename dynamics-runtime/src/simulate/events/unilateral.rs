//! Unilateral constraints: contacts that push and never pull, and sticking that breaks away.
//!
//! A contact fulfils Φ ≥ 0, λ ≥ 0, Φλ = 0 (Signorini's condition, in the complementarity form of P.
//! Lötstedt, SIAM J. Appl. Math. 42 (1982) 281). A unilateral constraint has one event function, which is
//! positive while it stays as it is. It switches where that falls through zero:
//!
//! | unilateral constraint | while it holds | while it is released |
//! |---|---|---|
//! | contact | λ: lifts off | Φ: impact, rebound or hold |
//! | stick–slip | the breakaway event: slips | ±(A q̇ + b) on the side to which it slips: sticks |
//!
//! Each constraint decides alone, by its own function at the reactions of those that hold. There is no joint
//! complementarity problem for all contacts: constraints that cannot stay as they are switch one after the
//! other, and the reactions are solved anew after each (`run/event_handling.rs`).

use alloc::boxed::Box;
use alloc::format;
use alloc::string::String;
use alloc::vec::Vec;

use crate::constrain::ConstrainedAccelerationsOf;
use crate::error::SolveError;
use crate::model::{ActiveSet, Constraint, ConstraintKind, ModelState, SimulationModel, StaticTraits};
use crate::simulate::events::action::{EventAction, find};
use crate::simulate::failure::OptionError;
use crate::simulate::options::contact::Contact;
use crate::simulate::stabilization::{ContactHistory, Stabilization};

/// The rule by which a unilateral constraint switches.
#[derive(Clone, Copy, Debug)]
enum ComplementarityRule {
    Contact(Contact),
    /// Index of the breakaway event among those of the model and of the simulation.
    Stick {
        breakaway: usize,
    },
}

/// A constraint that switches by a rule.
#[derive(Clone, Debug)]
pub(crate) struct UnilateralConstraint {
    pub(crate) name: String,
    pub(crate) constraint: &'static Constraint,
    /// Its index among the switched constraints.
    switch: usize,
    rule: ComplementarityRule,
    /// The reaction a little after the instant at which sticking breaks away, where the reaction may be zero.
    reaction_ahead: Option<f64>,
    /// The side to which it slipped last.
    last_side: f64,
    /// Time of the last release.
    lifted_at: Option<f64>,
    /// The time up to which a contact may pull that did not open after its release, as its reaction only
    /// grazed zero.
    grazes_until: Option<f64>,
}

impl UnilateralConstraint {
    pub(crate) fn contact<M: SimulationModel>(name: &str, contact: Contact) -> Result<Self, OptionError> {
        let Contact { restitution, rest_speed } = contact;
        let number = |option, value, good: bool, admissible| match good {
            true => Ok(()),
            false => Err(OptionError::Contact { constraint: name.into(), option, value, admissible }),
        };
        let coefficient = "a coefficient of restitution from 0 to 1";
        number("restitution", restitution, (0.0..=1.0).contains(&restitution), coefficient)?;
        let speed = rest_speed.unwrap_or(0.0);
        number("rest_speed", speed, speed >= 0.0 && speed.is_finite(), "a speed of 0 or more")?;
        Self::new::<M>(name, "contact", ConstraintKind::Holonomic, ComplementarityRule::Contact(contact))
    }

    /// An error of the constraint is reported before an error of its event.
    pub(crate) fn stick_slip<M: SimulationModel>(
        name: &str,
        breakaway: impl FnOnce() -> Result<usize, OptionError>,
    ) -> Result<Self, OptionError> {
        let unilateral = Self::new::<M>(
            name,
            "stick_slip",
            ConstraintKind::Nonholonomic,
            ComplementarityRule::Stick { breakaway: 0 },
        )?;
        Ok(Self { rule: ComplementarityRule::Stick { breakaway: breakaway()? }, ..unilateral })
    }

    fn new<M: SimulationModel>(
        name: &str,
        option: &'static str,
        kind: ConstraintKind,
        rule: ComplementarityRule,
    ) -> Result<Self, OptionError> {
        let constraint = find::<M>(name).map_err(|error| OptionError::Constraint(Box::new(error)))?;
        match constraint.switched {
            Some(switch) if constraint.kind == kind && constraint.rows == 1 => {
                let what = if matches!(rule, ComplementarityRule::Contact(_)) { "contact" } else { "slip" };
                Ok(Self {
                    name: format!("{name} {what}"),
                    constraint,
                    switch,
                    rule,
                    reaction_ahead: None,
                    last_side: 1.0,
                    lifted_at: None,
                    grazes_until: None,
                })
            }
            _ => Err(OptionError::NotForUnilateral {
                option,
                constraint: constraint.name,
                kind,
                found: constraint.kind,
            }),
        }
    }

    /// The event function of the constraint. `event` evaluates other events, `reactions` solves for λ.
    pub(crate) fn value<M: SimulationModel>(
        &self,
        model: &M,
        state: &M::State,
        mut event: impl FnMut(usize) -> Result<f64, SolveError>,
        reactions: impl FnOnce() -> Result<ConstrainedAccelerationsOf<M>, SolveError>,
    ) -> Result<f64, SolveError> {
        let row = self.constraint.first;
        let active_set = state.active_set();
        Ok(match self.rule {
            ComplementarityRule::Contact(_) if active_set.holds(self.switch) => reactions()?.multipliers[row],
            ComplementarityRule::Contact(_) => model.residual(state)[row],
            ComplementarityRule::Stick { breakaway } if active_set.holds(self.switch) => event(breakaway)?,
            ComplementarityRule::Stick { .. } => {
                model.velocity_residual(state)[row] * active_set.side(self.switch)
            }
        })
    }

    /// Whether its constraint holds.
    pub(crate) fn holds<S: ModelState>(&self, state: &S) -> bool {
        self.holds_in(state.active_set())
    }

    /// Whether its constraint holds in this active set.
    pub(crate) fn holds_in(&self, active_set: ActiveSet) -> bool {
        active_set.holds(self.switch)
    }

    /// The side to which its constraint was released.
    pub(crate) fn side_of<S: ModelState>(&self, state: &S) -> f64 {
        state.active_set().side(self.switch)
    }

    /// Releases its constraint to a side, at a corner.
    pub(crate) fn release<S: ModelState>(&self, state: &mut S, side: f64) {
        state.active_set_mut().release(self.switch, side);
    }

    /// Whether it is a contact. The others stick and slip.
    pub(crate) fn is_contact(&self) -> bool {
        matches!(self.rule, ComplementarityRule::Contact(_))
    }

    /// After an action, sets the side of a constraint that slipped before and slips still to the sign of its
    /// velocity.
    pub(crate) fn align_slip_side<M: SimulationModel>(
        &self,
        before: ActiveSet,
        model: &M,
        state: &mut M::State,
        stabilization: &mut Stabilization<M>,
    ) {
        if M::IS_UNSWITCHED {
            return;
        }
        let is_released = |active_set: ActiveSet| !active_set.holds(self.switch);
        if self.is_contact() || !is_released(before) || !is_released(state.active_set()) {
            return;
        }
        if let Some(side) = stabilization.slip_side(model, state, self.constraint) {
            state.active_set_mut().release(self.switch, side);
        }
    }

    /// A contact for the impacts of a run; `None` for stick–slip.
    pub(crate) fn contact_history<M: SimulationModel>(&self) -> Option<ContactHistory> {
        let ComplementarityRule::Contact(law) = self.rule else { return None };
        let constraint = M::CONSTRAINTS.iter().position(|known| known == self.constraint)?;
        Some(ContactHistory { constraint, law, fastest_hit: 0.0 })
    }

    /// Notes the reaction a little after the instant at which sticking is about to break away.
    pub(crate) fn note_reaction_ahead(&mut self, reaction: f64) {
        self.reaction_ahead = Some(reaction);
    }

    /// Notes that a contact released at `since` does not open, and closes again at `until`: its reaction
    /// grazes zero.
    pub(crate) fn note_grazing(&mut self, since: f64, until: f64) {
        if self.lifted_at == Some(since) {
            self.grazes_until = Some(until);
        }
    }

    /// The time up to which a closed contact may pull, see [`UnilateralConstraint::note_grazing`].
    pub(crate) fn grazes_until(&self) -> Option<f64> {
        self.grazes_until
    }

    /// Whether its reaction grazes zero at this instant.
    pub(crate) fn grazes_at(&self, t: f64) -> bool {
        self.grazes_until.is_some() && self.lifted_at == Some(t)
    }

    /// Resets it for another run.
    pub(crate) fn restart(&mut self) {
        (self.reaction_ahead, self.lifted_at, self.grazes_until, self.last_side) = (None, None, None, 1.0);
    }

    /// Switches where the function has fallen to zero, unless another action at the same instant has switched
    /// the constraint: contacts that close together are hit together. A contact that was to lift off stays
    /// closed if velocities have jumped; its new reaction decides.
    pub(crate) fn switch<M: SimulationModel>(&mut self, change: &mut EventAction<'_, M>) {
        if M::IS_UNSWITCHED {
            return;
        }
        let (name, reaction_ahead) = (self.constraint.name, self.reaction_ahead.take());
        // Another action at this instant has switched it.
        let holds = self.holds(change.state());
        if holds != self.holds(change.instant()) {
            return;
        }
        let jumped = change.state().u() != change.instant().u();
        if !holds && !self.is_contact() {
            self.last_side = change.state().active_set().side(self.switch);
        }
        match self.rule {
            ComplementarityRule::Contact(_) if holds && jumped => {}
            ComplementarityRule::Stick { .. }
                if holds && !jumped && reaction_ahead.is_some_and(|reaction| reaction != 0.0) =>
            {
                change.release_to(name, -reaction_ahead.unwrap_or_default());
            }
            ComplementarityRule::Stick { .. } if holds => match change.breakaway_side(self.constraint) {
                Some(side) => change.release_to(name, side),
                // It has neither a reaction nor friction, as where its contact lifts off at the same instant.
                None if change.slips_either_way(self.constraint) => change.release_to(name, self.last_side),
                None => {
                    (self.lifted_at, self.grazes_until) = (Some(change.state().t()), None);
                    change.release(name);
                }
            },
            ComplementarityRule::Contact(_) if holds => {
                (self.lifted_at, self.grazes_until) = (Some(change.state().t()), None);
                change.release(name);
            }
            ComplementarityRule::Contact(_) if self.grazes_at(change.state().t()) => {
                change.engage_without_impact(name)
            }
            // The belt's speed has jumped past the slip. Friction takes no impulse: it continues to slip.
            ComplementarityRule::Stick { .. } if change.slip_jumps_away(self.constraint, self.last_side) => {
                change.release_to(name, -self.last_side)
            }
            ComplementarityRule::Stick { .. } if jumped => change.engage(name),
            ComplementarityRule::Stick { .. } => change.engage_without_impact(name),
            ComplementarityRule::Contact(_) => {
                self.grazes_until = None;
                let rate = change.model().velocity_residual(change.state())[self.constraint.first];
                if rate < 0.0 || !jumped {
                    change.close_at_gap_zero(self.constraint);
                }
            }
        }
    }

    /// Whether a constraint that holds cannot stay so: a contact that would pull, sticking that would break
    /// away.
    pub(crate) fn is_untenable<M: SimulationModel>(&self, state: &M::State, value: f64) -> bool {
        self.holds(state) && value < 0.0 && !self.grazes_at(state.t())
    }
}

/// The unilateral constraints of a run in the order of their declaration.
pub(crate) type UnilateralConstraints = Vec<UnilateralConstraint>;
