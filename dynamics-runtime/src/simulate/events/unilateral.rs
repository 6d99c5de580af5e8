//! Constraints that switch by rules of their own: contacts that push and never pull, and sticking that breaks
//! away.
//!
//! A unilateral constraint has one function, which is positive where nothing happens, and acts where it
//! falls through zero:
//!
//! | unilateral constraint | while it holds | while it is released |
//! |---|---|---|
//! | contact | λ: lifts off | Φ: impact, rebound or hold |
//! | stick–slip | the breakaway event: slips | ±(A q̇ + b) on the side to which it slips: sticks |

use alloc::boxed::Box;
use alloc::format;
use alloc::string::String;
use alloc::vec::Vec;

use crate::constrain::ConstrainedAccelerationsOf;
use crate::error::SolveError;
use crate::model::{Constraint, ConstraintKind, Known, ModelState, Modes, SimulationModel};
use crate::simulate::events::action::{EventAction, find};
use crate::simulate::failure::OptionError;
use crate::simulate::options::contact::Contact;
use crate::simulate::stabilization::{ContactHistory, Stabilization};

/// What a unilateral constraint watches.
#[derive(Clone, Copy, Debug)]
enum ComplementarityRule {
    Contact(Contact),
    /// Index of the breakaway event among those of the model and of the simulation.
    Stick {
        breakaway: usize,
    },
}

/// A constraint that switches by a rule of its own.
#[derive(Clone, Debug)]
pub(crate) struct UnilateralConstraint {
    pub(crate) name: String,
    pub(crate) constraint: &'static Constraint,
    /// Its index among the switched constraints.
    switch: usize,
    law: ComplementarityRule,
    /// What the reaction has become a little after the instant at which sticking breaks away, where it may be
    /// zero.
    later: Option<f64>,
    /// The side to which it slipped last.
    side: f64,
    /// When a contact lifted off last.
    lifted: Option<f64>,
    /// Where it did not open then, for its reaction only grazed zero: the time up to which it may go on
    /// pulling.
    grazes: Option<f64>,
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

    /// What is wrong with the constraint is said before what is wrong with the event.
    pub(crate) fn stick<M: SimulationModel>(
        name: &str,
        breakaway: impl FnOnce() -> Result<usize, OptionError>,
    ) -> Result<Self, OptionError> {
        let unilateral = Self::new::<M>(
            name,
            "stick_slip",
            ConstraintKind::Nonholonomic,
            ComplementarityRule::Stick { breakaway: 0 },
        )?;
        Ok(Self { law: ComplementarityRule::Stick { breakaway: breakaway()? }, ..unilateral })
    }

    fn new<M: SimulationModel>(
        name: &str,
        option: &'static str,
        kind: ConstraintKind,
        law: ComplementarityRule,
    ) -> Result<Self, OptionError> {
        let constraint = find::<M>(name).map_err(|error| OptionError::Constraint(Box::new(error)))?;
        match constraint.switched {
            Some(switch) if constraint.kind == kind && constraint.rows == 1 => {
                let what = if matches!(law, ComplementarityRule::Contact(_)) { "contact" } else { "slip" };
                Ok(Self {
                    name: format!("{name} {what}"),
                    constraint,
                    switch,
                    law,
                    later: None,
                    side: 1.0,
                    lifted: None,
                    grazes: None,
                })
            }
            _ => Err(OptionError::NotForGuard {
                option,
                constraint: constraint.name,
                kind,
                found: constraint.kind,
            }),
        }
    }

    /// The function of the unilateral constraint; `event` gives the values of other events there,
    /// `reactions` solves for λ.
    pub(crate) fn value<M: SimulationModel>(
        &self,
        model: &M,
        state: &M::State,
        mut event: impl FnMut(usize) -> Result<f64, SolveError>,
        reactions: impl FnOnce() -> Result<ConstrainedAccelerationsOf<M>, SolveError>,
    ) -> Result<f64, SolveError> {
        let row = self.constraint.first;
        let modes = state.modes();
        Ok(match self.law {
            ComplementarityRule::Contact(_) if modes.holds(self.switch) => reactions()?.multipliers[row],
            ComplementarityRule::Contact(_) => model.residual(state)[row],
            ComplementarityRule::Stick { breakaway } if modes.holds(self.switch) => event(breakaway)?,
            ComplementarityRule::Stick { .. } => {
                model.velocity_residual(state)[row] * modes.side(self.switch)
            }
        })
    }

    /// Whether its constraint holds.
    pub(crate) fn holds<S: ModelState>(&self, state: &S) -> bool {
        self.holds_in(state.modes())
    }

    /// Whether its constraint is one of those that hold.
    pub(crate) fn holds_in(&self, modes: Modes) -> bool {
        modes.holds(self.switch)
    }

    /// The side to which its constraint was released.
    pub(crate) fn side_of<S: ModelState>(&self, state: &S) -> f64 {
        state.modes().side(self.switch)
    }

    /// Lets its constraint go to a side, where it has a corner.
    pub(crate) fn let_go<S: ModelState>(&self, state: &mut S, side: f64) {
        state.modes_mut().release(self.switch, side);
    }

    /// Whether it is a contact, which has to be open where it is released.
    pub(crate) fn is_contact(&self) -> bool {
        matches!(self.law, ComplementarityRule::Contact(_))
    }

    /// What slipped before a change and slips after it slips to the side of its velocity, to which the change
    /// may have turned it.
    pub(crate) fn turn<M: SimulationModel>(
        &self,
        before: Modes,
        model: &M,
        state: &mut M::State,
        stabilization: &mut Stabilization<M>,
    ) {
        if M::IS_UNSWITCHED {
            return;
        }
        let is_released = |modes: Modes| !modes.holds(self.switch);
        if self.is_contact() || !is_released(before) || !is_released(state.modes()) {
            return;
        }
        if let Some(side) = stabilization.slip_side(model, state, self.constraint) {
            state.modes_mut().release(self.switch, side);
        }
    }

    /// A contact with its law, for the impacts of a run.
    pub(crate) fn closing<M: SimulationModel>(&self) -> Option<ContactHistory> {
        let ComplementarityRule::Contact(law) = self.law else { return None };
        let constraint = M::CONSTRAINTS.iter().position(|known| known == self.constraint)?;
        Some(ContactHistory { constraint, law, hardest: 0.0 })
    }

    /// Notes the reaction a little after the instant at which the unilateral constraint is about to act.
    pub(crate) fn look_ahead(&mut self, reaction: f64) {
        self.later = Some(reaction);
    }

    /// Notes that a contact that has just lifted off would not be seen to open, and be back at a time: its
    /// reaction grazes zero.
    pub(crate) fn graze(&mut self, since: f64, until: f64) {
        if self.lifted == Some(since) {
            self.grazes = Some(until);
        }
    }

    /// Up to when a contact that holds may pull, see [`UnilateralConstraint::graze`].
    pub(crate) fn grazes_until(&self) -> Option<f64> {
        self.grazes
    }

    /// Whether its reaction grazes zero at this very instant.
    pub(crate) fn grazes_at(&self, t: f64) -> bool {
        self.grazes.is_some() && self.lifted == Some(t)
    }

    /// Forgets a run.
    pub(crate) fn restart(&mut self) {
        (self.later, self.lifted, self.grazes, self.side) = (None, None, None, 1.0);
    }

    /// Does what is due where the function has fallen to zero, unless an action at the same instant has dealt
    /// with it: contacts that close together are hit together, and whether one that was to lift off still
    /// does when velocities have jumped is for its new reaction to say.
    pub(crate) fn act<M: SimulationModel>(&mut self, change: &mut EventAction<'_, M>) {
        if M::IS_UNSWITCHED {
            return;
        }
        let (name, later) = (self.constraint.name, self.later.take());
        let holds = self.holds(change.state());
        if holds != self.holds(change.instant()) {
            return;
        }
        let jumped = change.state().u() != change.instant().u();
        if !holds && !self.is_contact() {
            self.side = change.state().modes().side(self.switch);
        }
        match self.law {
            ComplementarityRule::Contact(_) if holds && jumped => {}
            ComplementarityRule::Stick { .. }
                if holds && !jumped && later.is_some_and(|reaction| reaction != 0.0) =>
            {
                change.release_to(name, -later.unwrap_or_default());
            }
            ComplementarityRule::Stick { .. } if holds => match change.side_ahead(self.constraint) {
                Some(side) => change.release_to(name, side),
                // Nothing held it, and nothing will brake it: as where the contact that bears it lifts off.
                None if change.slips_either_way(self.constraint) => change.release_to(name, self.side),
                None => {
                    (self.lifted, self.grazes) = (Some(change.state().t()), None);
                    change.release(name);
                }
            },
            ComplementarityRule::Contact(_) if holds => {
                (self.lifted, self.grazes) = (Some(change.state().t()), None);
                change.release(name);
            }
            ComplementarityRule::Contact(_) if self.grazes_at(change.state().t()) => change.catch(name),
            // Friction takes no impulse: it goes on slipping.
            ComplementarityRule::Stick { .. } if change.leaps_from(self.constraint, self.side) => {
                change.release_to(name, -self.side)
            }
            ComplementarityRule::Stick { .. } if jumped => change.engage(name),
            ComplementarityRule::Stick { .. } => change.catch(name),
            ComplementarityRule::Contact(_) => {
                self.grazes = None;
                let rate = change.model().velocity_residual(change.state())[self.constraint.first];
                if rate < 0.0 || !jumped {
                    change.meet(self.constraint);
                }
            }
        }
    }

    /// Whether a constraint that has just been switched cannot stay as it is: a contact that would pull,
    /// sticking that would break at once.
    pub(crate) fn is_untenable<M: SimulationModel>(&self, state: &M::State, value: f64) -> bool {
        self.holds(state) && value < 0.0 && !self.grazes_at(state.t())
    }
}

/// The unilateral constraints of a run in the order of their declaration.
pub(crate) type UnilateralConstraints = Vec<UnilateralConstraint>;
