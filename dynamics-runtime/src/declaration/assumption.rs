//! Assumptions of a model's equations about its bodies and frames, their checks and their messages.

use core::fmt;

use crate::attitude::NotARotation;
use crate::mass_properties::{MassProperties, UnphysicalInertia};
use crate::math::{atan2, sqrt};
use crate::matrix::Mat3;

/// An assumption of the equations. If it does not hold, they are not those of a body.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Assumption {
    /// What.
    pub kind: AssumptionKind,
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
pub enum AssumptionKind {
    /// One value: a mass, not negative.
    Mass,
    /// One value: a moment of inertia about the normal of a plane, not negative.
    Moment,
    /// Nine values by rows: an inertia matrix that some body has, see [`MassProperties::check`].
    Inertia,
    /// Nine values by rows: a matrix that turns or mirrors, RᵀR = 1, to 1e-9 where parameters alone decide
    /// it, else to 1e-5: starts fulfil their constraints to seven digits.
    Rotation,
    /// Three values: an axis divided by its length, to 1e-9 of 1; squares of lengths above 1e154 overflow,
    /// those below 1e-154 vanish.
    Axis,
    /// Twice nine values by rows: rotations of two frames that are one, to 1e-3 rad. The rows of a weld are
    /// zero at one other attitude.
    Weld,
}

/// Why an assumption does not hold.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum AssumptionViolation {
    /// No body has such a mass or inertia.
    Body(UnphysicalInertia),
    /// The matrix is no rotation.
    Rotation(NotARotation),
    /// The axis divided by its length has this length.
    Axis(f64),
    /// Frames that should be one are turned against one another by this angle in rad.
    Turned(f64),
}

/// Largest defect of a rotation or an axis from parameters alone. Energies have a relative error of this size
/// then.
const PARAMETER_DEFECT: f64 = 1e-9;
/// Largest defect of a rotation that depends on the state: starts fulfil their constraints to seven digits.
const STATE_DEFECT: f64 = 1e-5;
/// Largest angle between welded frames, in rad: starts fulfil its rows to seven digits, and the other
/// attitude is 1.66 rad away.
const WELD_ANGLE: f64 = 1e-3;

impl Assumption {
    /// Whether it holds for these values.
    ///
    /// # Errors
    /// Why it does not.
    pub fn check(&self, values: &[f64]) -> Result<(), AssumptionViolation> {
        let not_negative = |x: f64| x >= 0.0 && x.is_finite();
        match (self.kind, values) {
            (AssumptionKind::Mass, &[mass]) if !not_negative(mass) => {
                Err(AssumptionViolation::Body(UnphysicalInertia::Mass(mass)))
            }
            (AssumptionKind::Moment, &[moment]) if !not_negative(moment) => {
                Err(AssumptionViolation::Body(UnphysicalInertia::Moment(moment)))
            }
            (AssumptionKind::Inertia, _) => {
                let body = MassProperties::new(1.0, matrix(values));
                body.check().map_err(AssumptionViolation::Body)
            }
            (AssumptionKind::Rotation, _) => {
                let defect = matrix(values).orthonormal_defect();
                let admissible = if self.constant { PARAMETER_DEFECT } else { STATE_DEFECT };
                // NaN is not admissible.
                if defect <= admissible {
                    Ok(())
                } else {
                    Err(AssumptionViolation::Rotation(NotARotation::NotOrthonormal(defect)))
                }
            }
            (AssumptionKind::Axis, &[x, y, z]) => {
                let length = sqrt(x * x + y * y + z * z);
                if (length - 1.0).abs() <= PARAMETER_DEFECT {
                    Ok(())
                } else {
                    Err(AssumptionViolation::Axis(length))
                }
            }
            (AssumptionKind::Weld, _) => {
                let (a, b) = values.split_at(values.len().min(9));
                let (a, b) = (matrix(a), matrix(b));
                // |R − 1| is √8 |sin θ/2| for a rotation by θ.
                let apart =
                    (a.transpose() * b - Mat3::diagonal(1.0, 1.0, 1.0)).to_array().into_iter().flatten();
                let half = sqrt(apart.map(|x| x * x).sum::<f64>() / 8.0).min(1.0);
                let angle = 2.0 * atan2(half, sqrt(1.0 - half * half));
                if angle <= WELD_ANGLE { Ok(()) } else { Err(AssumptionViolation::Turned(angle)) }
            }
            _ => Ok(()),
        }
    }
}

fn matrix(values: &[f64]) -> Mat3<f64> {
    let row = |i: usize| [0, 1, 2].map(|j| values.get(3 * i + j).copied().unwrap_or(f64::NAN));
    Mat3::from([row(0), row(1), row(2)])
}

/// `the inertia of a body in `kinetic`, made of `inertia``.
impl fmt::Display for Assumption {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let what = match self.kind {
            AssumptionKind::Mass => "the mass of a body",
            AssumptionKind::Moment => "the moment of inertia of a body",
            AssumptionKind::Inertia => "the inertia of a body",
            AssumptionKind::Rotation => "the rotation of a frame",
            AssumptionKind::Axis => "the axis of a turn",
            AssumptionKind::Weld => "the weld of two frames",
        };
        write!(f, "{what} in `{}`", self.within)?;
        for (i, name) in self.of.iter().enumerate() {
            write!(f, "{} `{name}`", if i == 0 { ", given by" } else { "," })?;
        }
        Ok(())
    }
}

impl fmt::Display for AssumptionViolation {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Body(why) => write!(f, "{why}"),
            Self::Rotation(why) => write!(f, "{why}"),
            Self::Axis(length) => write!(
                f,
                "divided by its length it has the length {length}, as the square of that is none that a \
                 number can hold; give a length near 1"
            ),
            Self::Turned(angle) => write!(
                f,
                "its rows hold, and yet the frames are turned against one another by {angle:.3} rad; give a \
                 start in which they are one"
            ),
        }
    }
}
