//! Warnings about a motion, as data, and their texts.

use alloc::string::String;
use core::fmt;

use crate::simulate::failure::gimbal_lock::GimbalLock;
use crate::simulate::stabilization::near_singular::DriftInfluence;
use crate::simulate::trajectory::global_error::ErrorFinding;
use crate::simulate::verification::accuracy_diagnostics::BelowRounding;
use crate::simulate::verification::missed_instability::MissedInstability;
use crate::simulate::verification::undersampled_force::UndersampledForce;
use crate::wording::{Part, Rounded, Times};

/// Why a motion may be less accurate than its tolerance suggests, or not the one that was meant. Its
/// [`Display`](fmt::Display) is a sentence with a remedy.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub enum Warning {
    /// What the second run of [`estimate_error`](crate::simulate::Simulation::estimate_error) showed.
    GlobalError(ErrorFinding),
    /// A constraint of friction held in an impact, whatever its impulse was.
    StuckInImpact {
        /// The constraint.
        constraint: &'static str,
        /// When first.
        time: f64,
    },
    /// A constraint holds the function of an event at zero: crossings are rounding, and were not counted.
    MaskedEvent {
        /// The event.
        event: String,
    },
    /// Stability, not accuracy, bounded the steps of an explicit method.
    Stiff {
        /// From when on.
        from: f64,
    },
    /// The motion slides along a jump of the accelerations.
    SlidingMode {
        /// From when on.
        from: f64,
    },
    /// Drift of the constraints turned the motion.
    DriftInfluence(DriftInfluence),
    /// Angles came so near to gimbal lock that the accelerations lost more digits than was permitted.
    GimbalLock(GimbalLock),
    /// Whether the motion goes on or turns round at a singular position is not told by its steps.
    SingularPositionMissed {
        /// By how much the constraints miss it, in lengths of coordinates.
        by: f64,
        /// When.
        time: f64,
        /// The steps were as long as was asked for.
        fixed: bool,
    },
    /// A tolerance is finer than the rounding of a value it is kept for.
    BelowRounding(BelowRounding),
    /// A force is over between the stages of a step.
    UndersampledForce(UndersampledForce),
    /// The motion is stiff, which the steps of its method do not show.
    HiddenStiffness {
        /// When first.
        time: f64,
    },
    /// Long steps pass over an instability.
    MissedInstability {
        /// Where, and how much.
        growth: MissedInstability,
        /// The steps were as long as was asked for.
        fixed: bool,
    },
    /// The energy, less all work, drifts by more than errors of steps explain.
    EnergyBeyondTolerance {
        /// By how many times what the tolerance permits in a step.
        times: f64,
    },
    /// The energy, less all work, drifts by much.
    EnergyDrift {
        /// In parts of its scale; infinite where it has grown beyond all numbers.
        part: f64,
        /// The steps were as long as was asked for.
        fixed: bool,
    },
    /// The motion in half steps differs by many tolerances.
    StepDoubling {
        /// By how many, where that lasts or at the end.
        tolerances: f64,
        /// The method has stages of too low an order for a stiff direction that turns.
        low_stages: bool,
    },
    /// The motion in half steps differs by many tolerances for a moment.
    ErrorPeak {
        /// By how many.
        tolerances: f64,
        /// The method has stages of too low an order for a stiff direction that turns.
        low_stages: bool,
    },
}

/// The remedy for an error that step doubling shows; the field: whether the method has stages of low order.
struct ErrorRemedy(bool);

impl fmt::Display for ErrorRemedy {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let instead = if self.0 { "use methods::Radau5" } else { "give a smaller tolerance" };
        write!(f, "; `.estimate_error()` measures it, or {instead}")
    }
}

// Without a wildcard, so that the compiler asks for the text of a new warning.
impl fmt::Display for Warning {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let how = "(estimated by step doubling)";
        match self {
            Self::GlobalError(finding) => fmt::Display::fmt(finding, f),
            Self::StuckInImpact { constraint, time } => write!(
                f,
                "`{constraint}` stuck in an impact at t = {}, however large its impulse is; where friction \
                 would let go, release it in the event's action with `.release_to(..)`",
                Rounded(*time)
            ),
            Self::MaskedEvent { event } => write!(
                f,
                "event {event} is what a constraint holds at zero: while it holds, crossings are rounding, \
                 and do not count"
            ),
            Self::Stiff { from } => write!(
                f,
                "stiff from t = {}: stability, not accuracy, bounds the step of this explicit method; use \
                 methods::Radau5",
                Rounded(*from)
            ),
            Self::SlidingMode { from } => write!(
                f,
                "slides from t = {} along a jump of the accelerations: short steps there, to and fro; let \
                 what sticks be a switched constraint",
                Rounded(*from)
            ),
            Self::DriftInfluence(DriftInfluence { part, time }) => write!(
                f,
                "drift of the constraints turned the motion by up to {} at t = {}; use \
                 Formulation::Projected",
                Part(*part),
                Rounded(*time)
            ),
            Self::GimbalLock(locking) => write_gimbal_lock(f, locking),
            Self::SingularPositionMissed { by, time, fixed } => {
                write_singular_position(f, *by, *time, *fixed)
            }
            Self::BelowRounding(value) => write_below_rounding(f, value),
            Self::UndersampledForce(force) => force.write(f),
            Self::HiddenStiffness { time } => write!(
                f,
                "stiff at t = {}: steps that are more than twenty times as long keep the tolerance with \
                 methods::Radau5",
                Rounded(*time)
            ),
            Self::MissedInstability { growth, fixed } => growth.write(f, *fixed),
            Self::EnergyBeyondTolerance { times } => write!(
                f,
                "energy drifts by {} times what the tolerance permits in a step; give a smaller one",
                Times(*times)
            ),
            Self::EnergyDrift { part, fixed } => write_energy_drift(f, *part, *fixed),
            Self::StepDoubling { tolerances, low_stages } => {
                let remedy = ErrorRemedy(*low_stages);
                write!(f, "global error about {} tolerances {how}{remedy}", Times(*tolerances))
            }
            Self::ErrorPeak { tolerances, low_stages } => write!(
                f,
                "errors peak and pass, as where something fast comes early or late: global error about {} \
                 tolerances {how} for less than a hundredth of the time{}",
                Times(*tolerances),
                ErrorRemedy(*low_stages)
            ),
        }
    }
}

fn write_gimbal_lock(f: &mut fmt::Formatter<'_>, locking: &GimbalLock) -> fmt::Result {
    write!(
        f,
        "gimbal lock at t = {}: {}; use Euler parameters (`#[coordinates(e: [_; 4])]`, \
         `EulerParameters::new(q.e).rotation()` and its `norm_constraint()` under `#[holonomic]`), change \
         charts (`ChartSwitching`), or take a set whose middle angle stays away from its singular values, \
         such as {}",
        Rounded(locking.time),
        locking.describe_loss(),
        locking.alternative_set()
    )
}

fn write_singular_position(f: &mut fmt::Formatter<'_>, by: f64, time: f64, fixed: bool) -> fmt::Result {
    let remedy = match fixed {
        true => "with this fixed step; give a tolerance well below that in its place",
        false => "at this tolerance; give one well below that",
    };
    write!(
        f,
        "the constraints miss the singular position at t = {} by {by:.1e}: whether a motion goes on or turns \
         round there is not told {remedy}",
        Rounded(time)
    )
}

fn write_below_rounding(f: &mut fmt::Formatter<'_>, below: &BelowRounding) -> fmt::Result {
    let BelowRounding { name, rate, value, time, permitted } = below;
    let what = if *rate { "the velocity of " } else { "" };
    let (time, value) = (Rounded(*time), Rounded(*value));
    write!(
        f,
        "tolerance below rounding: {permitted:.1e} permitted of {what}{name} = {value} at t = {time}; give a \
         larger relative one"
    )
}

fn write_energy_drift(f: &mut fmt::Formatter<'_>, part: f64, fixed: bool) -> fmt::Result {
    let remedy = if fixed { "shorten the fixed step" } else { "give a smaller tolerance" };
    match part.is_finite() {
        true => write!(f, "energy drifts by {} of its scale; {remedy}", Part(part)),
        false => write!(f, "energy grows beyond all numbers; {remedy}, or end the motion before that"),
    }
}
