//! What a model's equations take for granted of its bodies and frames, and what is said where it is not so.

use core::fmt;

use super::{Dynamics, ModelState, Vector};
use crate::attitude::NotARotation;
use crate::mass_properties::{MassProperties, UnphysicalInertia};
use crate::matrix::Mat3;

/// Something that is taken for granted: without it the equations are those of no body.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Premise {
    /// What.
    pub claim: Claim,
    /// The fields of the struct and the coordinates that the values are made of.
    pub of: &'static [&'static str],
    /// The function of the model in which.
    pub within: &'static str,
    /// Whether the parameters alone decide it: then it is looked at before any state is.
    pub constant: bool,
}

/// What is taken for granted of some values.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum Claim {
    /// One value: a mass, not negative.
    Mass,
    /// One value: a moment of inertia about the normal of a plane, not negative.
    Moment,
    /// Nine values by rows: an inertia matrix that some body has, to 1e-9 of its largest element.
    Inertia,
    /// Nine values by rows: a matrix that turns or mirrors, RᵀR = 1, to 1e-9 where parameters alone decide it, else to 1e-5: starts fulfil their constraints to seven digits.
    Rotation,
}

/// Why a premise does not hold.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Refuted {
    /// No body has such a mass or inertia.
    Body(UnphysicalInertia),
    /// The matrix is no rotation.
    Rotation(NotARotation),
}

/// Largest defect of a rotation that parameters alone decide: as much as energies may then be off.
const GIVEN: f64 = 1e-9;
/// Largest defect of one that a state decides.
const OF_STATES: f64 = 1e-5;

impl Premise {
    /// Whether it holds for these values.
    ///
    /// # Errors
    /// Why it does not.
    pub fn check(&self, values: &[f64]) -> Result<(), Refuted> {
        let not_negative = |x: f64| x >= 0.0 && x.is_finite();
        match (self.claim, values) {
            (Claim::Mass, &[mass]) if !not_negative(mass) => Err(Refuted::Body(UnphysicalInertia::Mass(mass))),
            (Claim::Moment, &[moment]) if !not_negative(moment) => {
                Err(Refuted::Body(UnphysicalInertia::Moment(moment)))
            }
            (Claim::Inertia, _) => {
                let body = MassProperties::new(1.0, matrix(values));
                body.check().map_err(Refuted::Body)
            }
            (Claim::Rotation, _) => {
                let defect = matrix(values).orthonormal_defect();
                let admissible = if self.constant { GIVEN } else { OF_STATES };
                // Not a number is no small one.
                if defect <= admissible { Ok(()) } else { Err(Refuted::Rotation(NotARotation::NotOrthonormal(defect))) }
            }
            _ => Ok(()),
        }
    }
}

fn matrix(values: &[f64]) -> Mat3<f64> {
    let row = |i: usize| [0, 1, 2].map(|j| values.get(3 * i + j).copied().unwrap_or(f64::NAN));
    Mat3::from([row(0), row(1), row(2)])
}

/// The first premise of a model that does not hold: of those that parameters decide, or, with a state, of the others.
pub(crate) fn refuted<M: Dynamics>(model: &M, state: Option<&M::State>) -> Option<(&'static Premise, Refuted)> {
    if !M::PREMISES.iter().any(|premise| premise.constant != state.is_some()) {
        return None;
    }
    let nowhere = || M::State::new(f64::NAN, M::Vector::zeros(), M::Vector::zeros(), M::Inputs::zeros());
    let (mut premises, mut first) = (M::PREMISES.iter(), None);
    model.premises(&state.copied().unwrap_or_else(nowhere), &mut |values| {
        let premise = premises.next().filter(|premise| first.is_none() && premise.constant != state.is_some());
        first = first.or_else(|| premise.and_then(|premise| Some((premise, premise.check(values).err()?))));
    });
    first
}

/// `the inertia of a body in `kinetic`, made of `inertia``.
impl fmt::Display for Premise {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let what = match self.claim {
            Claim::Mass => "the mass of a body",
            Claim::Moment => "the moment of inertia of a body",
            Claim::Inertia => "the inertia of a body",
            Claim::Rotation => "the rotation of a frame",
        };
        write!(f, "{what} in `{}`", self.within)?;
        for (i, name) in self.of.iter().enumerate() {
            write!(f, "{} `{name}`", if i == 0 { ", given by" } else { "," })?;
        }
        Ok(())
    }
}

impl fmt::Display for Refuted {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Body(why) => write!(f, "{why}"),
            Self::Rotation(why) => write!(f, "{why}"),
        }
    }
}
