//! Angles near gimbal lock, and the digits that a motion loses there.

use alloc::format;
use alloc::string::String;

use crate::model::AngleSet;

/// Where three angles of a motion came nearest to locking.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct GimbalLock {
    /// The angles.
    pub set: AngleSet,
    /// Their names, in the order of the turns.
    pub names: [&'static str; 3],
    /// Distance of the middle angle from the value at which they lock, in rad.
    pub distance: f64,
    /// The middle angle there, in rad.
    pub middle: f64,
    /// When.
    pub time: f64,
    /// Conditioning of the mass matrix there, as of [`Conditioning`](crate::simulate::Conditioning): the
    /// angles' accelerations lose that much of their digits.
    pub conditioning: f64,
    /// Rounding takes more of the accelerations there than the errors that were permitted, or steps of a
    /// fixed length passed over it.
    pub doubtful: bool,
    /// Steps of a fixed length are too long for what the angles do there.
    pub passed_over: bool,
}

impl GimbalLock {
    /// A set of angles that locks at another middle angle.
    pub(crate) fn alternative_set(&self) -> &'static str {
        if self.set.axes[0] == self.set.axes[2] { "1-2-3" } else { "3-1-3" }
    }

    /// Why the result is doubtful.
    pub(crate) fn describe_loss(&self) -> String {
        match self.passed_over {
            true => "the fixed steps are too long for how fast the angles turn there".into(),
            false => {
                format!(
                    "rounding takes {:.1e} of the accelerations there",
                    (f64::EPSILON * self.conditioning).min(1.0)
                )
            }
        }
    }

    /// `theta` within 7e-7 of 0, the singular value of its 3-1-3 set.
    pub(crate) fn describe(&self) -> String {
        let Self { set, names: [_, name, _], distance, middle, .. } = self;
        format!(
            "`{name}` within {distance:.1e} of {}, the singular value of its {set} set",
            set.locks_at(*middle)
        )
    }
}
