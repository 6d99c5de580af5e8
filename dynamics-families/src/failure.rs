//! Kinds of failure, and errors of queries to a motion.

use core::fmt;

use dynamics_runtime::sentence_for_debugging;
use dynamics_runtime::simulate::OptionError;
use dynamics_runtime::wording::{Grouped, Readable};

use crate::mass::{MassProblem, coordinate_name};
use crate::methods::FamilyMethod;
use crate::model::{FamilyModel, FamilyState, SizeError, Sizes};

/// The kinds of failure, with the values needed to act.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum FamilyErrorKind {
    /// A count, or the length of a numbered parameter, does not suit the model.
    #[error(transparent)]
    Size(#[from] SizeError),
    /// An option makes no sense; nothing was computed.
    #[error(transparent)]
    Option(#[from] OptionError),
    /// The state belongs to another model, or to other counts.
    #[error(
        "the state has {given} coordinates and the model {needed}; build the state with `model.state()` of \
         this model"
    )]
    StateLength {
        /// Coordinates of the state.
        given: usize,
        /// Coordinates of the model.
        needed: usize,
    },
    /// A value of the start is infinite or not a number.
    #[error("the start is not finite: {}`{coordinate}`", if *.rate { "the velocity of " } else { "" })]
    StartNotFinite {
        /// The coordinate, `s[7]`; `t` for time.
        coordinate: String,
        /// Whether it is the coordinate's velocity.
        rate: bool,
    },
    /// The inputs closure returned another number of values than the model has inputs.
    #[error("the inputs closure gave {given} values; the model has {needed} inputs")]
    InputCount {
        /// What it returned.
        given: usize,
        /// What is needed.
        needed: usize,
    },
    /// The inputs closure returned an infinite value or not a number.
    #[error("the inputs closure gave no finite value for `{input}`")]
    InputNotFinite {
        /// The input.
        input: &'static str,
    },
    /// The mass matrix is not positive definite.
    #[error(
        "the mass matrix is not positive definite at `{coordinate}`: that moves without inertia, or with a \
         negative one; give each node a positive mass"
    )]
    MassNotPositive {
        /// The coordinate, `s[7]`.
        coordinate: String,
    },
    /// A matrix couples too many distant unknowns.
    #[error(
        "the {matrix} couples more than 256 coordinates that are far apart, so it is no banded matrix with a \
         border; choose an explicit method, or a grid whose shorter side is at most 250 coordinates"
    )]
    NotBanded {
        /// `mass matrix`, `tangent stiffness`.
        matrix: &'static str,
    },
    /// A matrix has to be symmetric here.
    #[error("the {matrix} is not symmetric, as with forces that follow the motion; {remedy}")]
    NotSymmetric {
        /// `tangent stiffness`.
        matrix: &'static str,
        /// What to do.
        remedy: &'static str,
    },
    /// A matrix has no inverse.
    #[error("the {matrix} is singular at `{coordinate}`; {remedy}")]
    Singular {
        /// `tangent stiffness`.
        matrix: &'static str,
        /// The coordinate at which that was found.
        coordinate: String,
        /// What to do.
        remedy: &'static str,
    },
    /// The start is not on the constraints.
    #[error(
        "the start violates `{row}`{}; build it with `.assemble()`, which moves it onto the constraints, or \
         place it there", if *.rate { " by its velocities" } else { "" }
    )]
    StartViolates {
        /// The row, `link[7]`.
        row: String,
        /// Whether its rate is violated, and not its value.
        rate: bool,
    },
    /// Rows of constraints depend on one another.
    #[error(
        "`{row}` follows from other constraints here, or restricts nothing, so that its reaction is not \
         determined; leave it out, or keep the motion away from such positions"
    )]
    DependentRows {
        /// The row, `link[7]`.
        row: String,
    },
    /// The derivative of a row is infinite or not a number.
    #[error(
        "the derivative of `{row}` is not finite; write lengths as squares, or keep the motion away from where \
         they vanish"
    )]
    RowNotFinite {
        /// The row, `link[7]`.
        row: String,
    },
    /// No state on the constraints was found near this one.
    #[error(
        "no position near this one fulfils `{row}`; begin nearer to the constraints, or check that they do \
         not contradict one another"
    )]
    NotProjected {
        /// The row, `link[7]`.
        row: String,
    },
    /// The fixed step is longer than the stability of an explicit method permits.
    #[error(
        "a fixed step of {} is too long for {method}: waves grow without bounds above {:.6e}, the bound by \
         `longest_step`; shorten the step, or choose an implicit method", Readable(*.step), .longest
    )]
    StepTooLong {
        /// The method.
        method: FamilyMethod,
        /// What was given.
        step: f64,
        /// The longest step at the start.
        longest: f64,
    },
    /// The method has no error estimate.
    #[error("{method} has no error estimate; give `.fixed_step(h)` or choose an adaptive method")]
    NeedsFixedStep {
        /// The method.
        method: FamilyMethod,
    },
    /// The method is not made for this model.
    #[error("{method} is not made for this model: {reason}; {remedy}")]
    Unsuited {
        /// The method.
        method: FamilyMethod,
        /// Why, in words.
        reason: &'static str,
        /// What to do instead.
        remedy: &'static str,
    },
    /// An acceleration is infinite or not a number.
    #[error(
        "the acceleration of `{coordinate}` is not finite; keep the motion away from where a force or a \
         length has no finite value, or, if it does not come there, shorten the step or tighten the tolerance"
    )]
    AccelerationNotFinite {
        /// The coordinate, `s[7]`.
        coordinate: String,
    },
    /// The tolerance asks for steps below the resolution of time.
    #[error(
        "the step size collapsed, the error of `{coordinate}` stays above the tolerance: a value or a force \
         becomes infinite here, or something jumps; end the motion before, smooth the jump, or loosen the \
         tolerance"
    )]
    StepSizeTooSmall {
        /// The coordinate with the largest error.
        coordinate: String,
    },
    /// The equations of an implicit step, or of an equilibrium, were not solved.
    #[error(
        "the equations do not converge, least of all for `{coordinate}`; make the step shorter, begin nearer \
         to the solution, or smooth a force that jumps"
    )]
    NotSolved {
        /// The coordinate that is corrected most.
        coordinate: String,
    },
    /// No input has this name.
    #[error(fmt = unknown_input)]
    UnknownInput {
        /// What was asked for.
        name: String,
        /// The nearest known name.
        suggestion: Option<String>,
    },
    /// Not made for models with constraints.
    #[error(
        "{what} of a model with constraints is not supported; follow it by `equilibrium` at one value after \
         the other"
    )]
    NotWithConstraints {
        /// What was asked for.
        what: &'static str,
    },
    /// A branch has as many points as were asked for before its input has the last value.
    #[error("the branch has {limit} points, and its input does not have the last value yet; ask for more")]
    TooManyPoints {
        /// The limit.
        limit: usize,
    },
    /// Modes were not found, or not all below the highest of them.
    #[error("{found} of {wanted} modes converged; ask for fewer")]
    ModesMissing {
        /// How many were found.
        found: usize,
        /// How many were asked for.
        wanted: usize,
    },
    /// Waves were asked for of a model with constraints or with two indices.
    #[error("waves of models with {of} are not supported; ask `modes`")]
    WavesUnsupported {
        /// `constraints`, `grids`.
        of: &'static str,
    },
    /// Another number of phases than of indices.
    #[error("{given} phases are given; the model has {needed} index, so give {needed}: `[phase]`")]
    PhaseCount {
        /// How many were given.
        given: usize,
        /// What is needed.
        needed: usize,
    },
    /// A family has no node between its ends.
    #[error("a family has fewer than three nodes, so none lies between the ends; give larger counts")]
    NoInterior,
    /// Nodes between the ends do not have the same equations.
    #[error(
        "the equation of `{coordinate}` differs from that of the node in the middle, so there are no waves \
         of one phase per node; give all nodes equal parameters and a uniform state, or more nodes"
    )]
    NodesDiffer {
        /// The coordinate, `s[7]`.
        coordinate: String,
    },
    /// A wave grows without bounds at this state.
    #[error(
        "the state is not stable: a wave of phase {} per node grows as e^(rate t) with rate {rate:.6e}; ask \
         at a stable state", Readable(*.phase)
    )]
    WaveGrows {
        /// Radians per node.
        phase: f64,
        /// Per unit of time.
        rate: f64,
    },
    /// More steps than `.max_steps(..)` permits.
    #[error(fmt = too_many_steps)]
    TooManySteps {
        /// The limit.
        limit: u64,
        /// The stability bound at the start, where the last steps were near it.
        longest: Option<f64>,
    },
    /// The flag given to `.cancel(..)` was raised.
    #[error("cancelled")]
    Cancelled,
    /// Frames could not be written to their files.
    #[error("{message}")]
    File {
        /// What was tried, where, and why it failed.
        message: String,
    },
}

fn too_many_steps(limit: &u64, longest: &Option<f64>, f: &mut fmt::Formatter<'_>) -> fmt::Result {
    write!(f, "more than {} steps", Grouped(*limit))?;
    match longest {
        None => f.write_str("; give a larger `.max_steps(..)`, a longer step, or a looser tolerance"),
        Some(longest) => write!(
            f,
            "; stability and not accuracy bounds them, near {longest:.3e}: choose an implicit method, or \
             give a larger `.max_steps(..)`"
        ),
    }
}

impl FamilyErrorKind {
    pub(crate) fn of_mass<M: FamilyModel>(problem: MassProblem, ends: &Sizes) -> Self {
        match problem {
            MassProblem::NotPositive(unknown) => {
                Self::MassNotPositive { coordinate: coordinate_name::<M>(ends, unknown) }
            }
            MassProblem::NotBanded => Self::NotBanded { matrix: "mass matrix" },
        }
    }

    /// Whether constraints could not be solved or fulfilled at a state that was tried.
    pub(crate) fn is_of_constraints(&self) -> bool {
        matches!(self, Self::DependentRows { .. } | Self::RowNotFinite { .. } | Self::NotProjected { .. })
    }

    /// Whether nothing was computed.
    pub(crate) fn is_of_options(&self) -> bool {
        matches!(
            self,
            Self::Size(_)
                | Self::Option(_)
                | Self::StateLength { .. }
                | Self::StartNotFinite { .. }
                | Self::StartViolates { .. }
                | Self::StepTooLong { .. }
                | Self::NeedsFixedStep { .. }
                | Self::Unsuited { .. }
                | Self::MassNotPositive { .. }
        )
    }
}

/// Why a motion has no answer to a question.
#[derive(Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum FamilyMotionError {
    /// The time lies outside the motion.
    #[error(
        "t = {} lies outside the motion, which goes from {} to {}",
        Readable(*.time), Readable(*.start), Readable(*.end)
    )]
    OutOfRange {
        /// What was asked.
        time: f64,
        /// Start of the motion.
        start: f64,
        /// End of the motion.
        end: f64,
    },
    /// No state is kept at this time.
    #[error(
        "no state is kept at t = {}; the nearest are at {} and {}; record more with \
         `.record(Every::time(dt))` or every step with `.record(Every::steps(1))`",
        Readable(*.time), Readable(*.before), Readable(*.after)
    )]
    NotRecorded {
        /// What was asked.
        time: f64,
        /// The time of the nearest state before.
        before: f64,
        /// The time of the nearest state after.
        after: f64,
    },
    /// There is no output of this name.
    #[error(fmt = unknown_output)]
    UnknownOutput {
        /// What was asked.
        name: String,
        /// The nearest known name.
        suggestion: Option<String>,
    },
    /// The output has a value for every index, or only one.
    #[error(
        "output `{name}` {}",
        if *.numbered {
            "has a value for every index; ask `numbered_output`"
        } else {
            "has one value; ask `output`"
        }
    )]
    OtherOutput {
        /// The output.
        name: &'static str,
        /// Whether it is numbered.
        numbered: bool,
    },
    /// There is no coordinate of this name.
    #[error("there is no coordinate or numbered output `{name}`")]
    UnknownField {
        /// What was asked.
        name: String,
    },
}

fn unknown_output(name: &str, suggestion: &Option<String>, f: &mut fmt::Formatter<'_>) -> fmt::Result {
    unknown(["output", "#[output]"], name, suggestion.as_deref(), f)
}

fn unknown_input(name: &str, suggestion: &Option<String>, f: &mut fmt::Formatter<'_>) -> fmt::Result {
    unknown(["input", "#[inputs(..)]"], name, suggestion.as_deref(), f)
}

fn unknown(
    [what, declared]: [&str; 2],
    name: &str,
    near: Option<&str>,
    f: &mut fmt::Formatter<'_>,
) -> fmt::Result {
    match near {
        Some(near) => write!(f, "there is no {what} `{name}`; did you mean `{near}`?"),
        None => write!(f, "there is no {what} `{name}`; declare it with `{declared}`"),
    }
}

sentence_for_debugging!(FamilyMotionError);

/// A state has the model's lengths and its start is finite.
pub(crate) fn check_state<M: FamilyModel>(state: &M::State, ends: &Sizes) -> Result<(), FamilyErrorKind> {
    let needed = ends.last().copied().unwrap_or(0);
    if state.q().len() != needed || state.u().len() != needed || state.ends() != ends {
        return Err(FamilyErrorKind::StateLength { given: state.q().len(), needed });
    }
    if !state.t().is_finite() {
        return Err(FamilyErrorKind::StartNotFinite { coordinate: String::from("t"), rate: false });
    }
    for (values, rate) in [(state.q(), false), (state.u(), true)] {
        if let Some(unknown) = values.iter().position(|value| !value.is_finite()) {
            return Err(FamilyErrorKind::StartNotFinite {
                coordinate: coordinate_name::<M>(ends, unknown),
                rate,
            });
        }
    }
    Ok(())
}
