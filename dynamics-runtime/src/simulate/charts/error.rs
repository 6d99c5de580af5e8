//! Errors of chart switching: invalid charts, and motions that did not reach their end.

use alloc::boxed::Box;
use alloc::string::String;
use alloc::sync::Arc;
use alloc::vec::Vec;
use core::fmt;

use crate::attitude::NotARotation;
use crate::model::{Dynamics, Model, ModelState};
use crate::simulate::charts::ChartSwitching;
use crate::simulate::charts::result::{ChartSwitchingMotion, Segment};
use crate::simulate::simulation::Simulate;
use crate::simulate::trajectory::error::SimulationError;
use crate::simulate::trajectory::motion::Motion;
use crate::simulate::trajectory::record::Trajectory;
use crate::wording::names;

/// What has to be the same in all charts.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Compared {
    /// ω̇ of what a set of angles turns, by the second angle of the set.
    AngularAcceleration,
    /// q̈ of another coordinate.
    Acceleration,
    /// The energy function.
    Energy,
    /// An output.
    Output,
    /// A function of an event.
    Event,
    /// An input.
    Input,
}

/// Why charts are not those of one model, or cannot be changed on the way.
#[derive(Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum ChartError {
    /// No set of three angles has a second one of this name.
    #[error(fmt = unknown_set)]
    UnknownSet {
        /// What was asked.
        name: String,
        /// The second angles of the sets that there are.
        known: Vec<&'static str>,
        /// The model.
        model: &'static str,
    },
    /// The set was named before.
    #[error("the set of `{name}` has two references; name it once")]
    Twice {
        /// Its second angle.
        name: &'static str,
    },
    /// More sets than charts are made for.
    #[error("more than {most} sets change their charts; use Euler parameters, which need none")]
    TooMany {
        /// How many there may be.
        most: usize,
    },
    /// The reference of the model as it is given is turned already.
    #[error(
        "parameter `{parameter}` is {value} in the model, and not 0; give the model with its references not \
         turned, and the start in that chart"
    )]
    NotAtZero {
        /// The parameter.
        parameter: &'static str,
        /// Its value.
        value: f64,
    },
    /// No parameter changed when the reference was to be turned.
    #[error(
        "turning the reference of `{name}` changes no parameter; set the angle of a turn that stands before \
         the set, as in `Mat3::rotation_x(self.reference) * Mat3::euler(EulerSequence::Zxz, q.angles)`"
    )]
    Unturned {
        /// The second angle of the set.
        name: &'static str,
    },
    /// A parameter was set to something else than the turn of the reference.
    #[error(
        "parameter `{parameter}` is set to {value} where the turn of the reference is {turn}; set it to the \
         turn as it is given, in rad, and have the model turn by it about the axis of the second angle"
    )]
    NotTheTurn {
        /// The parameter.
        parameter: &'static str,
        /// What it was set to.
        value: f64,
        /// What was given, in rad.
        turn: f64,
    },
    /// A place of a motion of another chart switching.
    #[error(
        "there is no chart {chart} among the {charts} of this chart switching; resume a motion with the \
         chart switching that made it"
    )]
    NoSuchChart {
        /// Its chart.
        chart: usize,
        /// How many there are here.
        charts: usize,
    },
    /// The function of an event, given with the simulation, that is not the same in both charts.
    #[error(fmt = event_disagrees)]
    EventDisagrees {
        /// The event.
        event: String,
        /// Its values in both charts.
        values: [f64; 2],
        /// When.
        time: f64,
    },
    /// Angles that are no numbers.
    #[error("the set of `{name}` cannot be measured from another reference: {error}")]
    NoRotation {
        /// The second angle of the set.
        name: &'static str,
        /// What the matrix is.
        error: NotARotation,
    },
    /// The charts describe different motions.
    #[error(fmt = disagree)]
    Disagree {
        /// What differs.
        what: Compared,
        /// Its name; of an angular acceleration the second angle of its set.
        name: &'static str,
        /// Its values in both charts.
        values: [f64; 2],
        /// When.
        time: f64,
    },
    /// An option that makes sense for a whole motion only.
    #[error(
        "`{option}` asks for the whole motion, which comes in parts; ask the motion itself with \
         `sample(..)`, or a second run of other tolerance"
    )]
    NotByParts {
        /// The option.
        option: &'static str,
    },
    /// An event happened at the very instant of a change, and would be met twice.
    #[error(
        "`{event}` happens at t = {time}, at the very instant of a change of chart, and would be met twice; \
         start a little later, or end it there"
    )]
    Coincident {
        /// The event.
        event: String,
        /// When.
        time: f64,
    },
    /// No end time was given, or it is not a number.
    #[error("the simulation has no end; add `.until(t)`")]
    NoEnd,
}

fn unknown_set(name: &str, known: &[&'static str], model: &str, f: &mut fmt::Formatter<'_>) -> fmt::Result {
    if known.is_empty() {
        return write!(
            f,
            "`{name}` is not the second angle of a set: no three coordinates of `{model}` turn something \
             one after the other; write them as `Mat3::euler(..)`"
        );
    }
    write!(f, "`{name}` is not the second angle of a set; those of this model are ")?;
    names(f, known)
}

fn event_disagrees(event: &str, values: &[f64; 2], time: &f64, f: &mut fmt::Formatter<'_>) -> fmt::Result {
    let [a, b] = values;
    write!(
        f,
        "event `{event}` is {a:.6e} in one chart and {b:.6e} in another at t = {time}: its function \
         reads the angles; have it ask the model that `with` gives where the body is"
    )
}

fn disagree(
    what: &Compared,
    name: &str,
    values: &[f64; 2],
    time: &f64,
    f: &mut fmt::Formatter<'_>,
) -> fmt::Result {
    disagreement(f, *what, name, *values, *time)
}

fn disagreement(
    f: &mut fmt::Formatter<'_>,
    what: Compared,
    name: &str,
    [a, b]: [f64; 2],
    time: f64,
) -> fmt::Result {
    let remedy = "say it by the frame of the body, not by the angles, and put the reference right before the \
                  three turns about coordinate axes, as a turn about the axis of the second";
    match what {
        Compared::AngularAcceleration => write!(f, "the angular acceleration of what `{name}` turns")?,
        Compared::Acceleration => write!(f, "the acceleration of `{name}`")?,
        Compared::Energy => f.write_str("the energy")?,
        Compared::Output => write!(f, "output `{name}`")?,
        Compared::Event => write!(f, "event `{name}`")?,
        Compared::Input => write!(f, "input `{name}`")?,
    }
    let remedy = if what == Compared::Input {
        "have the law ask the model that `with` gives where the body is"
    } else {
        remedy
    };
    write!(
        f,
        " is {a:.6e} in one chart and {b:.6e} in another at t = {time}: they do not describe the same; \
         {remedy}"
    )
}

crate::error::sentence_for_debugging!(ChartError);

/// What ended a motion before its end.
#[non_exhaustive]
pub enum ChartSwitchingErrorKind<M: Model> {
    /// The charts.
    Chart(ChartError),
    /// The run in one chart.
    Run {
        /// The chart.
        chart: usize,
        /// What happened; the state is one of that chart.
        error: Box<SimulationError<M>>,
    },
}

impl<M: Model> From<ChartError> for ChartSwitchingErrorKind<M> {
    fn from(error: ChartError) -> Self {
        Self::Chart(error)
    }
}

/// A motion in several charts that stopped before its end. What was computed up to there is still in hand:
/// [`ChartSwitchingError::motion`].
pub struct ChartSwitchingError<M: Model> {
    /// What happened.
    pub kind: ChartSwitchingErrorKind<M>,
    /// Time of the last good state; the start's where nothing has moved. Where charts disagree it is when
    /// they are first seen to: what the motion says after that is said in one chart only.
    pub time: f64,
    first: usize,
    segments: Vec<(usize, Arc<Trajectory<M>>)>,
}

impl<M: Simulate> ChartSwitchingError<M> {
    pub(crate) fn new(
        kind: ChartSwitchingErrorKind<M>,
        first: usize,
        start: &M::State,
        segments: Vec<Segment<'_, M>>,
    ) -> Self {
        let mut segments: Vec<_> =
            segments.into_iter().map(|segment| (segment.chart, segment.motion.trajectory)).collect();
        if let ChartSwitchingErrorKind::Run { chart, error } = &kind
            && let Some(trajectory) = &error.trajectory
        {
            segments.push((*chart, Arc::clone(trajectory)));
        }
        let reached = segments.last().map_or(start.t(), |(_, trajectory)| trajectory.last().state.t());
        let time = match &kind {
            // The part continued, but from there on it describes the motion of one chart only.
            ChartSwitchingErrorKind::Chart(ChartError::Disagree { time, .. }) => *time,
            _ => reached,
        };
        Self { kind, time, first, segments }
    }

    /// What was computed, in the charts of the chart switching that it was computed with. Inputs closures are
    /// gone with the simulation, as of [`SimulationError::motion`]. `None` where nothing was computed.
    #[must_use]
    pub fn motion<'a>(&self, switching: &'a ChartSwitching<M>) -> Option<ChartSwitchingMotion<'a, M>> {
        let mut segments = Vec::new();
        for (chart, trajectory) in &self.segments {
            let model = switching.charts.get(*chart)?;
            let motion = Motion::new(model, model.constants().ok()?, None, Arc::clone(trajectory));
            segments.push(Segment { chart: *chart, motion });
        }
        (!segments.is_empty()).then_some(ChartSwitchingMotion { switching, first: self.first, segments })
    }
}

impl<M: Dynamics> fmt::Display for ChartSwitchingError<M> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match &self.kind {
            ChartSwitchingErrorKind::Chart(error) => error.fmt(f),
            ChartSwitchingErrorKind::Run { error, .. } => error.fmt(f),
        }
    }
}

crate::error::sentence_for_debugging!(ChartSwitchingError<M: Dynamics>);
impl<M: Dynamics> core::error::Error for ChartSwitchingError<M> {}
