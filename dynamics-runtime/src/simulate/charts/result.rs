//! A motion in several charts, queried like one.

use alloc::vec;
use alloc::vec::Vec;
use core::fmt;
use core::time::Duration;

use dynamics_view::suggest;

use crate::model::AngleSet;
use crate::simulate::charts::{CHART_CHANGE, ChartSwitching};
use crate::simulate::failure::MotionError;
use crate::simulate::simulation::Simulate;
use crate::simulate::summary::Summary;
use crate::simulate::summary::display::NOT_VERIFIED;
use crate::simulate::trajectory::motion::Motion;
use crate::simulate::trajectory::record::EventRecord;
use crate::wording::{Grouped, Rounded};

/// A part of a motion, in one chart.
#[derive(Debug)]
pub struct Segment<'a, M: Simulate> {
    /// The chart: an index of [`ChartSwitching::charts`].
    pub chart: usize,
    /// The motion of the model in that chart.
    pub motion: Motion<'a, M>,
}

/// A motion that changed its charts on the way. Angles and their rates belong to the chart of their time;
/// what the model says by the frames of its bodies, outputs, drawings and energies, goes on as if there were
/// none.
#[derive(Debug)]
pub struct ChartSwitchingMotion<'a, M: Simulate> {
    pub(crate) switching: &'a ChartSwitching<M>,
    /// The chart of the start as it was given.
    pub(crate) first: usize,
    /// In the order of the motion; never empty.
    pub(crate) segments: Vec<Segment<'a, M>>,
}

/// A state with the model in whose chart it is one.
#[derive(Clone, Copy, Debug)]
pub struct ChartState<'a, M: Simulate> {
    /// The model in the chart.
    pub model: &'a M,
    /// The chart: an index of [`ChartSwitching::charts`].
    pub chart: usize,
    /// The state.
    pub state: M::State,
}

/// When which angles began to be measured from their other reference.
#[derive(Clone, Debug, PartialEq)]
pub struct ChartChange {
    /// When.
    pub time: f64,
    /// The sets, each with the name of its second angle.
    pub sets: Vec<(AngleSet, &'static str)>,
}

impl<'a, M: Simulate> ChartSwitchingMotion<'a, M> {
    /// The parts, each a motion of the model in one chart.
    #[must_use]
    pub fn segments(&self) -> &[Segment<'a, M>] {
        &self.segments
    }

    /// Time of the start.
    #[must_use]
    pub fn start_time(&self) -> f64 {
        self.segments[0].motion.start_time()
    }

    /// Time of the end.
    #[must_use]
    pub fn end_time(&self) -> f64 {
        self.segments[self.segments.len() - 1].motion.end_time()
    }

    /// The part that a time belongs to; after a change where it is the time of one. The last one for times
    /// outside.
    pub(crate) fn segment_at(&self, t: f64) -> &Segment<'a, M> {
        let forward = self.end_time() >= self.start_time();
        let begun = |segment: &&Segment<'a, M>| {
            let start = segment.motion.start_time();
            if forward { start <= t } else { start >= t }
        };
        self.segments.iter().rev().find(begun).unwrap_or(&self.segments[0])
    }

    /// The state at time t with the model in its chart, after a change where t is the time of one; NaN
    /// outside the motion, as of [`Motion::at`].
    #[must_use]
    pub fn at(&self, t: f64) -> ChartState<'a, M> {
        let Segment { chart, motion } = self.segment_at(t);
        ChartState { model: motion.model(), chart: *chart, state: motion.at(t) }
    }

    /// The state at the end with the model in its chart: [`ChartSwitching::resume`] goes on from there.
    #[must_use]
    pub fn end(&self) -> ChartState<'a, M> {
        let Segment { chart, motion } = &self.segments[self.segments.len() - 1];
        ChartState { model: motion.model(), chart: *chart, state: motion.end() }
    }

    /// Time jets of the coordinates at time t, for helper functions of `at(t).model`.
    #[must_use]
    pub fn coordinates_at(&self, t: f64) -> M::Coordinates {
        self.segment_at(t).motion.coordinates_at(t)
    }

    /// Energy function at time t; NaN outside the motion.
    #[must_use]
    pub fn energy_at(&self, t: f64) -> f64 {
        self.segment_at(t).motion.energy_at(t)
    }

    /// A named output at time t.
    ///
    /// # Errors
    /// Where there is no such output, or the motion does not reach t.
    pub fn output(&self, name: &str, t: f64) -> Result<f64, MotionError> {
        if !M::OUTPUTS.iter().any(|output| output.name == name) {
            let suggestion = suggest(name, M::OUTPUTS.iter().map(|output| output.name));
            return Err(MotionError::UnknownOutput { name: name.into(), suggestion });
        }
        self.segment_at(t).motion.output(name, t).map_err(|error| match error {
            MotionError::OutOfRange { time, .. } => {
                MotionError::OutOfRange { time, start: self.start_time(), end: self.end_time() }
            }
            other => other,
        })
    }

    /// All outputs at time t in the order of the model; NaN outside the motion.
    #[must_use]
    pub fn outputs_at(&self, t: f64) -> Vec<f64> {
        self.segment_at(t).motion.outputs_at(t)
    }

    /// The events that happened, without the changes of charts; states are those of their charts.
    pub fn events(&self) -> impl Iterator<Item = &EventRecord<M::State>> {
        self.segments
            .iter()
            .flat_map(|segment| segment.motion.events())
            .filter(|event| event.name != CHART_CHANGE)
    }

    /// When charts changed, those changed before the first step included.
    #[must_use]
    pub fn changes(&self) -> Vec<ChartChange> {
        let mut before = self.first;
        let mut changes = Vec::new();
        for Segment { chart, motion } in &self.segments {
            let first_change =
                self.switching.references.iter().enumerate().filter(|(k, _)| (chart ^ before) >> k & 1 == 1);
            let sets: Vec<_> = first_change.map(|(_, at)| (at.set, at.names[1])).collect();
            if !sets.is_empty() {
                changes.push(ChartChange { time: motion.start_time(), sets });
            }
            before = *chart;
        }
        changes
    }

    /// Costs and drift of all parts: their summaries.
    #[must_use]
    pub fn summary(&self) -> ChartSwitchingSummary {
        self.summary_of(self.segments.iter().map(|segment| segment.motion.summary()).collect())
    }

    /// The same with what repeating the motion tells of its accuracy: see [`Motion::verify`].
    #[must_use]
    pub fn verify(&self) -> ChartSwitchingSummary {
        self.summary_of(self.segments.iter().map(|segment| segment.motion.verify()).collect())
    }

    fn summary_of(&self, segments: Vec<Summary>) -> ChartSwitchingSummary {
        let scale = segments.iter().map(|segment| segment.energy_scale).fold(0.0, larger);
        let mut drift: f64 = segments.iter().map(|segment| segment.energy_drift * segment.energy_scale).sum();
        for pair in self.segments.windows(2) {
            let [before, after] = [pair[0].motion.end(), pair[1].motion.start()];
            let [before, after] = [
                pair[0].motion.model().energy_function(&before),
                pair[1].motion.model().energy_function(&after),
            ];
            drift += (after - before).abs();
        }
        let sum = |of: fn(&Summary) -> u64| segments.iter().map(of).sum();
        ChartSwitchingSummary {
            model: M::NAME,
            interval: (self.start_time(), self.end_time()),
            changes: self.changes(),
            steps: sum(|segment| segment.steps),
            rejected: sum(|segment| segment.rejected),
            evaluations: sum(|segment| segment.evaluations),
            wall_time: segments.iter().map(|segment| segment.wall_time).sum(),
            energy_drift: if drift == 0.0 { 0.0 } else { drift / scale },
            segments,
        }
    }
}

/// Its summary.
impl<M: Simulate> fmt::Display for ChartSwitchingMotion<'_, M> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.summary().fmt(f)
    }
}

/// The larger one; NaN where either is.
fn larger(a: f64, b: f64) -> f64 {
    if a.is_nan() || a > b { a } else { b }
}

/// The summary of a motion in several charts.
#[derive(Clone, Debug, PartialEq)]
pub struct ChartSwitchingSummary {
    /// Name of the model.
    pub model: &'static str,
    /// The simulated interval.
    pub interval: (f64, f64),
    /// When charts changed.
    pub changes: Vec<ChartChange>,
    /// Accepted steps.
    pub steps: u64,
    /// Rejected steps.
    pub rejected: u64,
    /// Evaluations of the accelerations.
    pub evaluations: u64,
    /// Time the run took; `None` without the standard library.
    pub wall_time: Option<Duration>,
    /// Bound of the drift of the energy over all parts, relative to the largest energy met: the largest drift
    /// of each, and what the changes added.
    pub energy_drift: f64,
    /// The summary of each part.
    pub segments: Vec<Summary>,
}

impl fmt::Display for ChartSwitchingSummary {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (start, end) = self.interval;
        writeln!(f, "{} from t = {} to {}", self.model, Rounded(start), Rounded(end))?;
        write!(f, "  charts       ")?;
        match self.changes.as_slice() {
            [] => f.write_str("not changed")?,
            [only] => write!(f, "changed once, at t = {}", Rounded(only.time))?,
            [first, .., last] => {
                let times = Grouped(self.changes.len() as u64);
                write!(
                    f,
                    "changed {times} times, first at t = {}, last at t = {}",
                    Rounded(first.time),
                    Rounded(last.time)
                )?;
            }
        }
        for (set, name) in self.sets() {
            write!(f, "\n               the {set} set of `{name}`")?;
        }
        if let Some(segment) = self.segments.first() {
            write!(f, "\n  method       {}, {}", segment.method, segment.reason)?;
        }
        let [steps, rejected, evaluations] = [self.steps, self.rejected, self.evaluations].map(Grouped);
        write!(
            f,
            "\n  steps        {steps} accepted, {rejected} rejected, {evaluations} evaluations of the \
             accelerations"
        )?;
        if let Some(time) = self.wall_time {
            write!(f, "\n  wall time    {time:.3?}")?;
        }
        let unverified = self.segments.iter().any(|segment| !segment.verified);
        if unverified && self.segments.iter().any(|segment| segment.has_work) {
            write!(f, "\n  drift        energy less work: ask `.verify()`")?;
        } else if self.energy_drift.is_nan() {
            write!(
                f,
                "\n  drift        energy cannot be accounted for: inputs or their rates are not known"
            )?;
        } else {
            write!(f, "\n  drift        energy at most {:.1e}, all parts together", self.energy_drift)?;
        }
        for segment in &self.segments {
            for warning in segment.warnings() {
                write!(
                    f,
                    "\n  warning      {warning} (in the part from t = {} on)",
                    Rounded(segment.interval.0)
                )?;
            }
        }
        if unverified {
            write!(f, "\n{NOT_VERIFIED}")?;
        }
        Ok(())
    }
}

impl ChartSwitchingSummary {
    /// Every set that changed its chart, once.
    fn sets(&self) -> Vec<(AngleSet, &'static str)> {
        let mut sets = vec![];
        for set in self.changes.iter().flat_map(|change| &change.sets) {
            if !sets.contains(set) {
                sets.push(*set);
            }
        }
        sets
    }
}
