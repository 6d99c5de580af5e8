//! Options of a simulation that make no sense.

use crate::model::{
    Assumption, AssumptionViolation, ConstraintKind, Dynamics, parameter_not_finite, violated_assumption,
};
use crate::simulate::failure::event_action::EventActionError;
use crate::wording::Readable;
use alloc::boxed::Box;
use alloc::string::String;
use core::fmt;

/// An option of a simulation that makes no sense.
#[derive(Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum OptionError {
    /// `.until(..)` is missing.
    #[error("the end is not given; add `.until(t)`")]
    NoEnd,
    /// A number is not admissible.
    #[error("`.{option}({})` is not possible; give {admissible}", Readable(*.value))]
    Number {
        /// The option.
        option: &'static str,
        /// What was given.
        value: f64,
        /// What is admissible.
        admissible: &'static str,
    },
    /// `.tolerances(absolute, relative)` are not admissible.
    #[error(
        "`.tolerances({}, {})` is not possible; give {admissible}",
        Readable(*.absolute),
        Readable(*.relative)
    )]
    Tolerances {
        /// The absolute one.
        absolute: f64,
        /// The relative one.
        relative: f64,
        /// What is admissible.
        admissible: &'static str,
    },
    /// A number among the options of a method is not admissible.
    #[error("`{option}: {value}` of {method} is not possible; give {admissible}")]
    MethodNumber {
        /// The method.
        method: crate::simulate::Method,
        /// The option.
        option: &'static str,
        /// What was given.
        value: f64,
        /// What is admissible.
        admissible: &'static str,
    },
    /// An output time lies outside the simulated interval.
    #[error("output time {time} lies outside the simulated interval from {start} to {end}")]
    OutputTime {
        /// What was given.
        time: f64,
        /// Start of the interval.
        start: f64,
        /// End of the interval.
        end: f64,
    },
    /// Two output times that follow one another are not in the order of the motion.
    #[error(fmt = output_order)]
    OutputOrder {
        /// The two.
        pair: [f64; 2],
        /// The motion runs back in time.
        backwards: bool,
    },
    /// There is no event of this name.
    #[error(fmt = unknown_event)]
    UnknownEvent {
        /// What was given.
        name: String,
        /// The nearest known name.
        suggestion: Option<String>,
    },
    /// Two ad-hoc events, or an ad-hoc event and one of the model, have the same name.
    #[error("there are two events `{name}`; rename one")]
    DuplicateEvent {
        /// The name.
        name: String,
    },
    /// Two laws are given for the same unilateral constraint.
    #[error("`.{option}(\"{constraint}\", ..)` is given twice; drop one of them")]
    UnilateralTwice {
        /// `contact` or `stick_slip`.
        option: &'static str,
        /// The constraint.
        constraint: String,
    },
    /// An input has no value: neither in the start state nor by `.inputs(..)`.
    #[error("input `{input}` has no value; set it in the start state or give `.inputs(|t, state| ..)`")]
    InputWithoutValue {
        /// The input.
        input: &'static str,
    },
    /// A value of the start state is infinite or not a number.
    #[error(fmt = start_not_finite)]
    StartNotFinite {
        /// The coordinate; `t` for time.
        name: &'static str,
        /// Whether it is the coordinate's velocity.
        rate: bool,
    },
    /// A parameter of the model is infinite or not a number.
    #[error("parameter `{name}` of the model is {value}; give a finite number")]
    ParameterNotFinite {
        /// Its name, `m1`, `mass[3]`.
        name: &'static str,
        /// Its value.
        value: f64,
    },
    /// A mass, an inertia or a rotation of the model is none, by its parameters or in the start state.
    #[error("{assumption}: {why}")]
    Unphysical {
        /// What it should be, and of which parameters and coordinates it is made.
        assumption: &'static Assumption,
        /// What it is instead.
        why: AssumptionViolation,
    },
    /// A contact or sticking constraint cannot be what was asked for.
    #[error(transparent)]
    Constraint(Box<EventActionError>),
    /// A number of a contact's law is not admissible.
    #[error("`.contact(\"{constraint}\", ..)` with {option} {value} is not possible; give {admissible}")]
    Contact {
        /// The constraint.
        constraint: String,
        /// `restitution` or `rest_speed`.
        option: &'static str,
        /// What was given.
        value: f64,
        /// What is admissible.
        admissible: &'static str,
    },
    /// A contact needs a switched holonomic constraint of one row, sticking a switched nonholonomic one.
    #[error(fmt = not_for_unilateral)]
    NotForUnilateral {
        /// `contact` or `stick_slip`.
        option: &'static str,
        /// The constraint.
        constraint: &'static str,
        /// What it would have to be.
        kind: ConstraintKind,
        /// What it is.
        found: ConstraintKind,
    },
    /// A contact or sticking constraint in a simulation that runs back in time: from which impact a state
    /// came cannot be told.
    #[error(
        "`.{option}(\"{constraint}\", ..)` cannot run back in time: what was lost in an impact or by \
         sticking is not known; give an end after the start, or drop it"
    )]
    Backwards {
        /// `contact` or `stick_slip`.
        option: &'static str,
        /// The constraint.
        constraint: String,
    },
    /// A formulation was chosen for a model without constraints.
    #[error("`.formulation(..)` says how constraints are kept, and the model has none; drop it")]
    NothingToHold,
    /// A gain of Baumgarte's stabilization is negative, infinite or not a number.
    #[error(
        "gain {name} = {value} of Baumgarte's stabilization is not possible; give a finite number, 0 or more"
    )]
    Gain {
        /// `alpha` or `beta`.
        name: &'static str,
        /// What was given.
        value: f64,
    },
    /// A method without error estimate needs `.fixed_step(..)`.
    #[error("{method} has no error estimate; give `.fixed_step(h)` or choose an adaptive method")]
    NeedsFixedStep {
        /// Which one.
        method: crate::simulate::Method,
    },
    /// The motions of the model have no Taylor series.
    #[error("{method} is not possible for this model: {reason}; choose another method")]
    NoSeries {
        /// The method that needs one.
        method: crate::simulate::Method,
        /// Why there is none, in words: `its forces depend on reactions`.
        reason: &'static str,
    },
    /// The method expands motions into Taylor series, and this formulation adds what is no part of them.
    #[error(
        "{method} satisfy the constraints in every coefficient, and what the formulation `{formulation}` \
         adds is no part of them; drop `.formulation(..)`, or choose another method"
    )]
    SeriesExcludes {
        /// The method.
        method: crate::simulate::Method,
        /// The formulation.
        formulation: crate::simulate::Formulation,
    },
    /// `.estimate_error()` compares two motions, and `run_with` keeps none.
    #[error("`.estimate_error()` compares two motions, and `run_with` keeps none; use `.run()`")]
    NothingToCompare,
    /// The method would run with this model and not keep what it is chosen for.
    #[error("{method} is not made for this model: {reason}; {remedy}")]
    Unsuited {
        /// The method.
        method: crate::simulate::Method,
        /// Why, in words: `it has constraints`.
        reason: &'static str,
        /// What to do instead.
        remedy: &'static str,
    },
    /// Rounding would reject every step of extrapolation with constraints.
    #[error(
        "{method} resolves tolerances down to {finest:e} where there are constraints, not {tolerance:e}: \
         below, rounding rejects every step; give a larger tolerance, methods::Dop853 or methods::Taylor::default()"
    )]
    ToleranceTooFine {
        /// The method.
        method: crate::simulate::Method,
        /// The tolerance that was given.
        tolerance: f64,
        /// The smallest for this method.
        finest: f64,
    },
    /// `.fixed_step(..)` leaves nothing for another step option to say.
    #[error("`.{option}(..)` says nothing beside `.fixed_step(..)`; drop one of them")]
    FixedStepExcludes {
        /// The other option.
        option: &'static str,
    },
}

impl OptionError {
    /// A model whose parameters are not finite is not run: what it would fail at first says nothing of them.
    pub(crate) fn check_parameters<M: Dynamics>(model: &M) -> Result<(), Self> {
        if let Some((name, value)) = parameter_not_finite(model) {
            return Err(Self::ParameterNotFinite { name, value });
        }
        violated_assumption(model, None)
            .map_or(Ok(()), |(assumption, why)| Err(Self::Unphysical { assumption, why }))
    }

    /// Neither is one whose bodies or frames are none at the start.
    pub(crate) fn check_bodies<M: Dynamics>(model: &M, state: &M::State) -> Result<(), Self> {
        violated_assumption(model, Some(state))
            .map_or(Ok(()), |(assumption, why)| Err(Self::Unphysical { assumption, why }))
    }
}

fn output_order(pair: &[f64; 2], backwards: &bool, f: &mut fmt::Formatter<'_>) -> fmt::Result {
    let [first, second] = pair;
    let order = if *backwards { "descending order, as the motion runs" } else { "ascending order" };
    write!(f, "output time {} is followed by {}; give them in {order}", Readable(*first), Readable(*second))
}

fn unknown_event(name: &str, suggestion: &Option<String>, f: &mut fmt::Formatter<'_>) -> fmt::Result {
    match suggestion {
        Some(near) => write!(f, "there is no event `{name}`; did you mean `{near}`?"),
        None => {
            write!(f, "there is no event `{name}`; declare it with `#[event]` or `.event(\"{name}\", ..)`")
        }
    }
}

fn start_not_finite(name: &str, rate: &bool, f: &mut fmt::Formatter<'_>) -> fmt::Result {
    let what = if *rate { "the velocity of " } else { "" };
    write!(f, "the start is not finite: {what}`{name}`")
}

fn not_for_unilateral(
    option: &str,
    constraint: &str,
    kind: &ConstraintKind,
    found: &ConstraintKind,
    f: &mut fmt::Formatter<'_>,
) -> fmt::Result {
    write!(f, "`.{option}(..)` is not possible for `{constraint}`")?;
    let (role, is, other) = match found {
        ConstraintKind::Holonomic => ("holonomic", "positions", "contact"),
        ConstraintKind::Nonholonomic => ("nonholonomic", "velocities", "stick_slip"),
    };
    if kind == found {
        return write!(f, "; declare it with `#[{role}(switched)]` and let it return one `Expr`");
    }
    write!(
        f,
        ", a constraint on {is} (`#[{role}]`); `.{other}(..)` is for those that are switched and have one row"
    )
}

crate::error::sentence_for_debugging!(OptionError);
