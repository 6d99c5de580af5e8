//! Errors of nonlinear modes, with the part of the family that was computed.

use alloc::boxed::Box;
use core::fmt;

use dynamics_runtime::model::ModelState;
use nalgebra::Complex;

use super::BackboneCurve;
use crate::{EquilibriumError, PeriodicError};

/// Why a nonlinear mode was not followed to its end. What was computed up to there is in the error.
#[derive(Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum BackboneError<S: ModelState> {
    /// The energy is not positive and finite, or less than four motions are asked for.
    #[error(
        "`.until({energy})` with `.points({points})` makes no sense; give a positive energy above that of \
         the equilibrium, and four motions or more"
    )]
    Option {
        /// The energy.
        energy: f64,
        /// How many motions.
        points: usize,
    },
    /// Energy is not known to be conserved. Closed motions are then isolated, and there is no family.
    #[error(
        "energy is not known to be conserved, so that closed motions form no family; take dampers, forces \
         and inputs out, write dead loads as potentials, and look at single motions with `.periodic(..)`"
    )]
    NotConserved,
    /// The state is no equilibrium, or has no modes.
    #[error("there is no equilibrium with modes to begin with: {0}")]
    Rest(EquilibriumError),
    /// There is no such mode.
    #[error("there is no mode {mode}; they are counted from 0, and there are {count}")]
    NoMode {
        /// Which was asked for.
        mode: usize,
        /// How many there are.
        count: usize,
    },
    /// The mode does not swing: it is free to move, damped, or leaves the equilibrium.
    #[error(
        "the mode does not swing (its eigenvalue is {:.3e} + {:.3e}i per second), so that no closed motions \
         begin with it; choose another one",
        .eigenvalue.re,
        .eigenvalue.im
    )]
    DoesNotSwing {
        /// σ, in 1/s.
        eigenvalue: Complex<f64>,
    },
    /// The mode has no positive energy, as in systems that gyroscopic forces stabilise.
    #[error(
        "a small motion in the mode has {energy:.3e} of energy above rest, which does not order a family; \
         the equilibrium is stable by gyroscopic forces alone, or unstable"
    )]
    NoEnergy {
        /// That of a small motion in it.
        energy: f64,
    },
    /// No closed motion of the family was found beyond an energy.
    #[error(fmt = stopped)]
    Stopped {
        /// The last energy above that of the equilibrium.
        energy: f64,
        /// What shooting said of the next one; `None` where it found one of another family.
        reason: Option<Box<PeriodicError>>,
        /// The family up to there.
        curve: Box<BackboneCurve<S>>,
    },
}

fn stopped<S: ModelState>(
    energy: &f64,
    reason: &Option<Box<PeriodicError>>,
    _curve: &BackboneCurve<S>,
    f: &mut fmt::Formatter<'_>,
) -> fmt::Result {
    match reason {
        Some(reason) if matches!(**reason, PeriodicError::NotIsolated { .. }) => write!(
            f,
            "the family was followed up to {energy:.6e} of energy; beyond it closed motions of one \
             energy lie side by side, as where a momentum is conserved, too, or two directions are \
             alike: hold what moves freely by a constraint or in other coordinates, or look at single \
             motions with `.periodic(..)`"
        ),
        Some(reason) => write!(
            f,
            "the family was followed up to {energy:.6e} of energy, where it ends or turns: {reason}"
        ),
        None => write!(
            f,
            "the family was followed up to {energy:.6e} of energy; what is found beyond is a motion of \
             another family, as where two frequencies come into resonance; take more points, or look at \
             what `.periodic(..)` finds there"
        ),
    }
}

dynamics_runtime::sentence_for_debugging!(BackboneError<S: ModelState>);

impl<S: ModelState> BackboneError<S> {
    /// What was computed before it failed, if anything was.
    #[must_use]
    pub fn curve(&self) -> Option<&BackboneCurve<S>> {
        match self {
            Self::Stopped { curve, .. } => Some(curve),
            _ => None,
        }
    }
}
