//! What an event may do to a motion: change its state, hit, engage and release constraints.

use alloc::boxed::Box;
use alloc::string::String;
use alloc::vec::Vec;

use super::error::suggest;
use super::simulate::Simulate;
use super::upkeep::{PlaceError, Upkeep};
use crate::error::{SolveError, StateError};
use crate::model::{Constraint, ConstraintKind, ModelState, Vector};

/// An impact on a constraint: a jump of the velocities, M Δu = Φ_qᵀΛ, with the other constraints held.
#[derive(Clone, Debug, PartialEq)]
pub struct Impact {
    /// The constraint that was hit.
    pub constraint: &'static str,
    /// Φ̇ (or A q̇ + b) of its rows just before.
    pub approach: Vec<f64>,
    /// Λ of its rows: multiplier times time.
    pub impulse: Vec<f64>,
    /// Kinetic energy ½ q̇ᵀMq̇ before less that after; negative where a moving constraint strikes.
    pub energy_lost: f64,
}

/// Why a change cannot be made.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub enum ChangeError {
    /// There is no constraint of this name.
    UnknownConstraint {
        /// What was given.
        name: String,
        /// The nearest known name.
        suggestion: Option<String>,
    },
    /// The constraint is not one that can be switched.
    NotSwitched {
        /// Its name.
        constraint: &'static str,
    },
    /// A constraint is to engage at a place where it does not hold.
    EngagedApart {
        /// Its row that is missed most.
        row: &'static str,
        /// Φ there.
        residual: f64,
    },
    /// A coefficient of restitution outside 0 to 1.
    Restitution {
        /// What was given.
        value: f64,
    },
    /// The constraints have no common solution.
    Solve(SolveError),
    /// The state that was left does not fulfil the constraints that hold.
    State(Box<StateError>),
}

impl From<PlaceError> for ChangeError {
    fn from(error: PlaceError) -> Self {
        match error {
            PlaceError::State(error) => Self::State(Box::new(error)),
            PlaceError::Solve(error) => Self::Solve(error),
        }
    }
}

impl From<SolveError> for ChangeError {
    fn from(error: SolveError) -> Self {
        Self::Solve(error)
    }
}

impl core::fmt::Display for ChangeError {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        match self {
            Self::UnknownConstraint { name, suggestion: Some(near) } => {
                write!(f, "there is no constraint `{name}`; did you mean `{near}`?")
            }
            Self::UnknownConstraint { name, suggestion: None } => {
                write!(f, "there is no constraint `{name}`; declare it with `#[holonomic]` or `#[nonholonomic]`")
            }
            Self::NotSwitched { constraint } => {
                write!(f, "constraint `{constraint}` always holds; declare it with `(switched)`")
            }
            Self::EngagedApart { row, residual } => write!(
                f,
                "`{row}` is to engage where its residual is {residual:e}; engage it where it crosses zero, or move the state there first"
            ),
            Self::Restitution { value } => {
                write!(f, "a coefficient of restitution of {value} is not possible; give one from 0 to 1")
            }
            Self::Solve(error) => error.fmt(f),
            Self::State(error) => error.fmt(f),
        }
    }
}

impl core::error::Error for ChangeError {}

/// What an action at an event works on: the state, and the constraints that can be hit, engaged and released.
///
/// What cannot be done (a name that is not known, a constraint engaged where it does not hold) ends the simulation with an error at
/// this event; the changes after it are not made.
pub struct Change<'c, M: Simulate> {
    model: &'c M,
    constants: &'c M::Constants,
    state: &'c mut M::State,
    upkeep: &'c mut Upkeep<M>,
    impacts: Vec<Impact>,
    error: Option<ChangeError>,
}

impl<'c, M: Simulate> Change<'c, M> {
    pub(super) fn new(
        model: &'c M,
        constants: &'c M::Constants,
        state: &'c mut M::State,
        upkeep: &'c mut Upkeep<M>,
    ) -> Self {
        Self { model, constants, state, upkeep, impacts: Vec::new(), error: None }
    }

    /// The state at the event, with the changes so far.
    pub fn state(&self) -> &M::State {
        self.state
    }

    /// The state, to be changed as [`on_event`](super::Simulation::on_event) changes it.
    pub fn state_mut(&mut self) -> &mut M::State {
        self.state
    }

    /// The model that moves.
    pub fn model(&self) -> &'c M {
        self.model
    }

    /// The impacts so far.
    pub fn impacts(&self) -> &[Impact] {
        &self.impacts
    }

    /// Whether a switched constraint holds; `false` for a name that is not known, which ends the simulation.
    pub fn holds(&mut self, name: &str) -> bool {
        let modes = self.state.modes();
        self.attempt(|change| change.switched(name).map(|(_, index)| modes.holds(index))).unwrap_or(false)
    }

    /// λ of a constraint at the state as it is now, by rows; 0 where it does not hold. Empty where there is none: that ends the simulation.
    pub fn reaction(&mut self, name: &str) -> Vec<f64> {
        self.attempt(|change| {
            let constraint = find::<M>(name)?;
            let solved = change.upkeep.reactions(change.model, change.constants, change.state)?;
            Ok(rows_of(constraint, solved.as_slice()))
        })
        .unwrap_or_default()
    }

    /// An impact on a constraint, switched or not: its rows rebound, Φ̇⁺ = −e Φ̇⁻ with the coefficient of restitution e, while
    /// the constraints that hold go on holding. Source: Brogliato, *Nonsmooth Mechanics*, §4.3 (Newton's law of impact).
    pub fn impact(&mut self, name: &str, restitution: f64) {
        self.attempt(|change| change.hit(find::<M>(name)?, restitution));
    }

    /// Lets a switched constraint hold from here on, after a plastic impact that stops its rows.
    pub fn engage(&mut self, name: &str) {
        self.attempt(|change| {
            let (constraint, index) = change.switched(name)?;
            change.check_place(constraint)?;
            if !change.state.modes().holds(index) {
                change.hit(constraint, 0.0)?;
                change.state.modes_mut().engage(index);
            }
            Ok(())
        });
    }

    /// Releases a switched constraint: a holonomic one to the side where Φ grows, a nonholonomic one to the side to which its reaction
    /// held back, against the sign of λ.
    pub fn release(&mut self, name: &str) {
        self.attempt(|change| {
            let (constraint, index) = change.switched(name)?;
            let side = match constraint.kind {
                ConstraintKind::Holonomic => 1.0,
                ConstraintKind::Nonholonomic => {
                    let solved = change.upkeep.reactions(change.model, change.constants, change.state)?;
                    -solved[constraint.first].signum()
                }
            };
            change.state.modes_mut().release(index, side);
            Ok(())
        });
    }

    /// Releases a switched constraint to a side: that of growing Φ (or A q̇ + b) where `side` is not negative.
    pub fn release_to(&mut self, name: &str, side: f64) {
        self.attempt(|change| {
            let (_, index) = change.switched(name)?;
            change.state.modes_mut().release(index, side);
            Ok(())
        });
    }

    /// Does nothing after the first error, and keeps it.
    fn attempt<R>(&mut self, act: impl FnOnce(&mut Self) -> Result<R, ChangeError>) -> Option<R> {
        if self.error.is_some() {
            return None;
        }
        act(self).map_err(|error| self.error = Some(error)).ok()
    }

    fn switched(&self, name: &str) -> Result<(&'static Constraint, usize), ChangeError> {
        let constraint = find::<M>(name)?;
        match constraint.switched {
            Some(index) => Ok((constraint, index)),
            None => Err(ChangeError::NotSwitched { constraint: constraint.name }),
        }
    }

    fn hit(&mut self, constraint: &'static Constraint, restitution: f64) -> Result<(), ChangeError> {
        if !(0.0..=1.0).contains(&restitution) {
            return Err(ChangeError::Restitution { value: restitution });
        }
        let before = self.model.velocity_residual(self.state);
        let index = M::CONSTRAINTS.iter().position(|known| known == constraint).expect("found in this very list");
        let jump = self.upkeep.impact(self.model, self.state, index, restitution)?;
        self.impacts.push(Impact {
            constraint: constraint.name,
            approach: rows_of(constraint, before.as_slice()),
            impulse: rows_of(constraint, jump.impulses.as_slice()),
            energy_lost: jump.energy_lost,
        });
        Ok(())
    }

    /// A holonomic constraint can hold only where its Φ is 0.
    fn check_place(&mut self, constraint: &'static Constraint) -> Result<(), ChangeError> {
        if constraint.kind == ConstraintKind::Nonholonomic {
            return Ok(());
        }
        match self.upkeep.apart(self.model, self.state, constraint) {
            Some((row, residual)) => Err(ChangeError::EngagedApart { row, residual }),
            None => Ok(()),
        }
    }

    /// The impacts, or why the changes cannot be made.
    pub(super) fn finish(self) -> Result<Vec<Impact>, ChangeError> {
        self.error.map_or(Ok(self.impacts), Err)
    }
}

/// The constraint of a name.
pub(super) fn find<M: Simulate>(name: &str) -> Result<&'static Constraint, ChangeError> {
    M::CONSTRAINTS.iter().find(|constraint| constraint.name == name).ok_or_else(|| {
        let suggestion = suggest(name, M::CONSTRAINTS.iter().map(|constraint| constraint.name));
        ChangeError::UnknownConstraint { name: name.into(), suggestion }
    })
}

fn rows_of(constraint: &Constraint, rows: &[f64]) -> Vec<f64> {
    rows[constraint.first..constraint.first + constraint.rows].to_vec()
}
