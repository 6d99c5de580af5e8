//! The global error of a motion as estimated by a second run: data, and settings of that run.

pub(crate) mod display;

use alloc::string::String;
use alloc::vec::Vec;

use crate::integrate::{Method, StepOptions, Tolerances};

/// The largest difference between two runs.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LargestDifference {
    /// The coordinate, or that whose velocity it is.
    pub name: &'static str,
    /// In the unit of the coordinate or velocity.
    pub error: f64,
    /// When.
    pub time: f64,
}

/// An event whose time differs between two runs.
#[derive(Clone, Debug, PartialEq)]
pub struct EventShift {
    /// The event.
    pub name: String,
    /// When it happened in the first run.
    pub time: f64,
    /// How much later it happened in the second run; NaN where it did not, or only there.
    pub by: f64,
}

/// The error of a motion, estimated by a second run:
/// [`Simulation::estimate_error`](crate::simulate::Simulation::estimate_error). It is that at the ends of the
/// steps, and in the middle of up to 256 of them; at instants where events change the state the shift of the
/// event is looked at instead.
#[derive(Clone, Debug, PartialEq)]
pub struct GlobalError {
    /// How the settings of the second run differ.
    pub reference: ReferenceSettings,
    /// Largest error of a coordinate.
    pub coordinates: LargestDifference,
    /// Largest error of a velocity.
    pub velocities: LargestDifference,
    /// Largest error in tolerances, absolute + relative·|value|; `None` with a fixed step.
    pub ratio: Option<f64>,
    /// The same in the middle of steps, as far as it was looked at: what dense output adds. `None` with a
    /// fixed step.
    pub between: Option<f64>,
    /// From when on errors are a tenth of the range of a coordinate or velocity, or more: nothing later can
    /// be trusted.
    pub lost_at: Option<f64>,
    /// Time in which errors double, where they grow exponentially: in chaotic and unstable motions.
    pub doubling_time: Option<f64>,
    /// Largest shift of an event.
    pub shift: Option<EventShift>,
    /// The first event that only one of the runs has.
    pub unmatched: Option<EventShift>,
    /// (t, largest error of a coordinate or velocity in parts of its range) at the steps.
    pub history: Vec<(f64, f64)>,
    /// Evaluations of the accelerations in the second run.
    pub evaluations: u64,
    /// Where and why the second run broke off: what comes after is not estimated.
    pub broken_off: Option<(f64, String)>,
}

/// Findings in an estimated error that make a motion doubtful.
#[derive(Clone, Debug, PartialEq)]
pub enum ErrorFinding {
    /// The second run broke off: later errors are not known.
    ReferenceBrokeOff {
        /// When.
        time: f64,
        /// Why.
        reason: String,
    },
    /// An event happens in one of the two runs alone.
    EventUnmatched {
        /// Its name.
        name: String,
        /// When.
        time: f64,
    },
    /// Errors are as large as the motion.
    AsLargeAsTheMotion {
        /// From when on.
        from: f64,
    },
    /// States between steps are off by more than a thousand permitted errors.
    LargeBetweenSteps,
    /// Errors are more than a thousand permitted ones.
    Amplified {
        /// The error in tolerances; NaN where a value is not a number.
        ratio: f64,
    },
}

/// Errors above this many permitted ones are a warning, by a second run as by step doubling and by the drift
/// of the energy. A smaller value warns of motions that only amplify their errors, a larger one is silent
/// where digits are lost. `docs/warnings-judged.md` counts how often warnings at these bounds are right.
pub(crate) const LARGE_ERROR: f64 = 1e3;

/// Factor by which the tolerance of the second run is smaller: its own error is then a hundredth of that of
/// the first.
const TIGHTER_FACTOR: f64 = 100.0;

/// Least factor by which rounding must permit a smaller tolerance; otherwise the second run has a larger one.
const MIN_TIGHTER_FACTOR: f64 = 3.0;

/// Factor by which it is then larger. The difference is mostly the error of the second run, and so an upper
/// bound for the first.
const LOOSER_FACTOR: f64 = 10.0;

/// How the settings of the second run differ from those of the first.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum ReferenceSettings {
    /// It kept smaller tolerances, 100 times where rounding permits. The difference is the error of the first
    /// run.
    Tighter {
        /// In the unit of each coordinate and velocity.
        absolute: f64,
        /// Dimensionless.
        relative: f64,
    },
    /// It kept ten times the tolerances, because rounding leaves no room below those of the first: the
    /// difference is mostly the error of the second run, so that of the first is smaller.
    Looser {
        /// In the unit of each coordinate and velocity.
        absolute: f64,
        /// Dimensionless.
        relative: f64,
    },
    /// Its fixed step was half as long. The difference is divided by 1 − 2⁻ᵖ for a method of order p.
    HalfStep(f64),
}

impl ReferenceSettings {
    pub(crate) fn of(first: &StepOptions, method: Method) -> Self {
        if let Some(h) = first.fixed {
            return Self::HalfStep(0.5 * h);
        }
        let Tolerances { absolute, relative } = first.tolerances;
        let finest = method.finest_tolerance();
        let available_factor = if relative > 0.0 { relative / finest } else { TIGHTER_FACTOR };
        if available_factor < MIN_TIGHTER_FACTOR {
            return Self::Looser { absolute: LOOSER_FACTOR * absolute, relative: LOOSER_FACTOR * relative };
        }
        let factor = available_factor.min(TIGHTER_FACTOR);
        Self::Tighter { absolute: absolute / factor, relative: relative / factor }
    }

    /// The options of the first run with these settings.
    pub(crate) fn options(self, first: StepOptions) -> StepOptions {
        match self {
            Self::HalfStep(h) => StepOptions { fixed: Some(h), ..first },
            Self::Tighter { absolute, relative } | Self::Looser { absolute, relative } => {
                StepOptions { tolerances: Tolerances { absolute, relative }, ..first }
            }
        }
    }

    /// How many times as many steps it may make.
    pub(crate) const MORE_STEPS: u64 = 100;
}
