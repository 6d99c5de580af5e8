//! Chart switching: three angles whose reference is turned before they reach gimbal lock.
//!
//! No three angles are regular coordinates of all orientations (J. Stuelpnagel, SIAM Review 6 (1964) 422).
//! Each set locks where its first axis i and its last axis k coincide. Measured from a reference that is a
//! quarter turn C about the second axis j away, R = C·E(θ) instead of E(θ), the same set locks where k
//! coincides with C·i, at a right angle to i. Of the two charts one is always 45° or more from locking.
//!
//! The reference is a parameter of the model, so that both charts run on the same generated code, and each
//! part of a motion is the motion of a model that does not change. From one part to the next the angles are
//! read from the same rotation, θ′ with E(θ′) = C′ᵀ C E(θ), and the rates from the same angular
//! velocity. That both charts describe one model is verified: accelerations, energy, outputs and events have
//! to agree where a part begins (`agreement.rs`) and at the end of every step (`step_agreement.rs`). What
//! acts only within a step is not seen.

pub(crate) mod agreement;
pub(crate) mod error;
pub(crate) mod reference;
pub(crate) mod result;
pub(crate) mod step_agreement;

use alloc::boxed::Box;
use alloc::string::String;
use alloc::vec::Vec;

pub use crate::simulate::charts::error::{
    ChartError, ChartSwitchingError, ChartSwitchingErrorKind, Compared,
};
use crate::simulate::charts::reference::AngleReference;
pub use crate::simulate::charts::result::{
    ChartChange, ChartState, ChartSwitchingMotion, ChartSwitchingSummary, Segment,
};

use crate::integrate::Direction;
use crate::model::ModelState;
use crate::simulate::simulation::{Simulate, Simulation};
use crate::simulate::trajectory::motion::Motion;

/// Name of the event that ends a part of a motion.
const CHART_CHANGE: &str = "change of chart";
/// Angles nearer to locking than this, in rad, are measured from the other reference. There sin ϑ = 0.48.
/// The other chart is then at least π/2 − 0.5 from locking, and the motion has to turn by half a radian
/// before it can switch back.
const LOCK_DISTANCE: f64 = 0.5;
/// Most sets of angles: each doubles the number of charts.
const MAX_ANGLE_SETS: usize = 6;

/// A model in all charts of its angles: those as it was made, and those with turned references.
///
/// The model measures a set of three angles from a reference that is a parameter, a turn about the set's
/// second axis, 0 in the model that is given: `Mat3::rotation_x(self.reference) *
/// Mat3::euler(EulerSequence::Zxz, q.angles)`. Everything else says what it says by the body's frame, not by
/// the angles themselves.
///
/// ```
/// # use dynamics_runtime as dynamics;
/// use dynamics::simulate::{ChartSwitching, ChartSwitchingError, ChartSwitchingMotion, Simulate};
///
/// trait Turned {
///     fn set_reference(&mut self, turn: f64);
/// }
/// fn tumble<M: Simulate + Turned + Clone>(
///     switching: &ChartSwitching<M>,
///     start: M::State,
/// ) -> Result<ChartSwitchingMotion<'_, M>, ChartSwitchingError<M>> {
///     switching.simulate(start).until(200.0).with(|run, _| run.tolerance(1e-10)).run()
/// }
/// fn charts<M: Simulate + Turned + Clone>(
///     model: M,
/// ) -> Result<ChartSwitching<M>, dynamics::simulate::ChartError> {
///     ChartSwitching::new(model).turning("angles[1]", |model, turn| model.set_reference(turn))
/// }
/// ```
#[derive(Clone, Debug)]
pub struct ChartSwitching<M> {
    /// Bit k of the index: the reference of set k is turned.
    charts: Vec<M>,
    references: Vec<AngleReference>,
}

impl<M: Simulate + Clone> ChartSwitching<M> {
    /// Of one chart, the model as it is.
    #[must_use]
    pub fn new(model: M) -> Self {
        Self { charts: [model].to_vec(), references: Vec::new() }
    }

    /// Has the reference of a set turned when it comes near to locking. The set is named by its second angle;
    /// `turn` sets the parameter that is the turn of its reference about the set's second axis, in rad, to
    /// what it is given.
    ///
    /// That the reference turns that way round, and about that axis, is seen from forces and outputs. A body
    /// that is free in all directions moves alike whichever way it is turned: of that one declare an output
    /// that points somewhere, `self.body(q).frame.x()`.
    ///
    /// # Errors
    /// Where no set has this second angle, there are too many, the model's reference is not 0, or `turn`
    /// changes nothing, or sets a number to something else.
    pub fn turning(mut self, middle: &str, turn: impl Fn(&mut M, f64)) -> Result<Self, ChartError> {
        let reference = AngleReference::of::<M>(middle)?;
        if self.references.len() == MAX_ANGLE_SETS {
            return Err(ChartError::TooMany { most: MAX_ANGLE_SETS });
        }
        if self.references.iter().any(|known| known.set.angles[1] == reference.set.angles[1]) {
            return Err(ChartError::Twice { name: reference.names[1] });
        }
        let mut turned = Vec::with_capacity(2 * self.charts.len());
        for (by, expected) in [(0.0, false), (reference::QUARTER_TURN, true)] {
            for model in &self.charts {
                let mut chart = model.clone();
                turn(&mut chart, by);
                let first_change = first_change(model, &chart);
                if let Some((parameter, value)) = only_change(model, &chart).filter(|(_, value)| *value != by)
                {
                    return Err(ChartError::NotTheTurn { parameter, value, turn: by });
                }
                match (expected, first_change) {
                    (false, Some((parameter, value))) => {
                        return Err(ChartError::NotAtZero { parameter, value });
                    }
                    (true, None) => return Err(ChartError::Unturned { name: reference.names[1] }),
                    _ => {}
                }
                turned.push(chart);
            }
        }
        self.charts = turned;
        self.references.push(reference);
        Ok(self)
    }

    /// The models, one for each chart; the first is the one that was given.
    #[must_use]
    pub fn charts(&self) -> &[M] {
        &self.charts
    }

    /// Opens a simulation from a state of the model as it was given. A state of a motion may be one of
    /// another chart: [`ChartSwitching::resume`] goes on from it.
    pub fn simulate(&self, start: M::State) -> ChartSwitchingSimulation<'_, M> {
        ChartSwitchingSimulation {
            switching: self,
            chart: 0,
            start,
            end: None,
            options: Box::new(|run, _| run),
        }
    }

    /// Opens a simulation from a place of a motion of this chart switching, in the chart of that place.
    pub fn resume(&self, from: &ChartState<'_, M>) -> ChartSwitchingSimulation<'_, M> {
        ChartSwitchingSimulation { chart: from.chart, ..self.simulate(from.state) }
    }

    /// The distance from locking of the nearest set, less [`LOCK_DISTANCE`]: a change is due where it is
    /// negative.
    fn margin(references: &[AngleReference], state: &M::State) -> f64 {
        references.iter().map(|at| at.distance(state)).fold(f64::INFINITY, f64::min) - LOCK_DISTANCE
    }

    /// The chart in which every set is far from locking, and the state in it. Where a change is `due` at
    /// least one set changes.
    fn change(&self, chart: usize, state: &M::State, due: bool) -> Result<(usize, M::State), ChartError> {
        let (mut to, mut there) = (chart, *state);
        let least = Self::margin(&self.references, state) + LOCK_DISTANCE;
        for (k, reference) in self.references.iter().enumerate() {
            // At a located change the distance is the bound up to the rounding of time.
            let distance = reference.distance(state);
            if distance < LOCK_DISTANCE * (1.0 + 1e-6) || due && distance <= least * (1.0 + 1e-6) {
                let turned = chart >> k & 1 == 1;
                reference.re_express(&mut there, turned, !turned)?;
                to ^= 1 << k;
            }
        }
        Ok((to, there))
    }
}

/// The first parameter that has changed, with its value before; `None` for models that do not expose
/// parameters.
fn first_change<M: Simulate>(from: &M, to: &M) -> Option<(&'static str, f64)> {
    M::PARAMETERS.iter().enumerate().find_map(|(k, quantity)| {
        let (before, after) = (from.parameter(k)?, to.parameter(k)?);
        // NaN counts as unchanged: runs report it by its name.
        (before != after && !before.is_nan()).then_some((quantity.name, before))
    })
}

/// The parameter that has changed, with its new value, if it is the only one.
fn only_change<M: Simulate>(from: &M, to: &M) -> Option<(&'static str, f64)> {
    let mut changes = M::PARAMETERS.iter().enumerate().filter_map(|(k, quantity)| {
        let (before, after) = (from.parameter(k)?, to.parameter(k)?);
        (before != after && !before.is_nan()).then_some((quantity.name, after))
    });
    changes.next().filter(|_| changes.next().is_none())
}

/// Options of one part of a motion: of a simulation of the model in one chart.
type Options<'a, M> = Box<dyn Fn(Simulation<'a, M>, &'a M) -> Simulation<'a, M> + 'a>;

/// A simulation that changes its chart where that is due, before it runs.
#[must_use = "a simulation does nothing until `.run()`"]
pub struct ChartSwitchingSimulation<'a, M: Simulate> {
    switching: &'a ChartSwitching<M>,
    /// That of the start.
    chart: usize,
    start: M::State,
    end: Option<f64>,
    options: Options<'a, M>,
}

impl<'a, M: Simulate + Clone> ChartSwitchingSimulation<'a, M> {
    /// End time; may lie before the start.
    pub fn until(mut self, t: f64) -> Self {
        self.end = Some(t);
        self
    }

    /// Options of every part of the motion: tolerance, method, inputs, events. Called for each part, and
    /// where charts are compared, with a simulation and the model in the chart of that part, which closures
    /// should ask where things are: the angles of a state mean something in its chart only. Inputs and the
    /// functions of events are compared between charts; what actions do to a state is not, and is to be said
    /// by the body's frame, or by [`EventAction`](crate::simulate::EventAction)'s impacts. Step limits are
    /// those of one part.
    pub fn with(mut self, options: impl Fn(Simulation<'a, M>, &'a M) -> Simulation<'a, M> + 'a) -> Self {
        self.options = Box::new(options);
        self
    }

    /// Runs the simulation, part by part, and keeps its motion.
    ///
    /// At the end of every step of a part both charts of each set are compared, in what acts there and then:
    /// accelerations, energy, inputs, outputs, events. For each set that costs two evaluations of all these,
    /// and of the condition of the mass matrix, a step. Steps where the other chart is within 0.02 rad of
    /// locking are left out, and what comes and goes within one step is not seen.
    ///
    /// # Errors
    /// Where a part does not come to its end, or charts do not describe the same motion; what was computed up
    /// to there is in the error.
    pub fn run(self) -> Result<ChartSwitchingMotion<'a, M>, ChartSwitchingError<M>> {
        let (switching, chart, start) = (self.switching, self.chart, self.start);
        let mut segments: Vec<Segment<'a, M>> = Vec::new();
        let end = self.end.unwrap_or(f64::NAN);
        let result = if end.is_nan() {
            Err(ChartError::NoEnd.into())
        } else if chart >= switching.charts.len() {
            Err(ChartError::NoSuchChart { chart, charts: switching.charts.len() }.into())
        } else {
            let compared_quantities = 0..switching.references.len();
            let compared =
                compared_quantities.into_iter().try_for_each(|k| self.compare(chart, chart ^ 1 << k, &start));
            compared.map_err(Into::into).and_then(|()| self.run_segments(end, &mut segments))
        };
        match result {
            Ok(()) => Ok(ChartSwitchingMotion { switching, first: chart, segments }),
            Err(kind) => Err(ChartSwitchingError::new(kind, chart, &start, segments)),
        }
    }

    fn run_segments(
        &self,
        end: f64,
        segments: &mut Vec<Segment<'a, M>>,
    ) -> Result<(), ChartSwitchingErrorKind<M>> {
        let (mut chart, mut state) = self.switching.change(self.chart, &self.start, false)?;
        loop {
            let motion = self.run_segment(chart, state, end)?;
            self.check_junction(&motion, segments)?;
            let changes =
                motion.events().last().is_some_and(|event| event.stopped && event.name == CHART_CHANGE);
            let last = motion.trajectory.last().state;
            segments.push(Segment { chart, motion });
            self.compare_along(chart, segments)?;
            if !changes || last.t() == end {
                return Ok(());
            }
            let (to, there) = self.switching.change(chart, &last, true)?;
            // With the inputs that were in force.
            let complete = segments.last().map_or(last, |segment| segment.motion.end());
            self.compare(chart, to, &complete)?;
            (chart, state) = (to, there);
        }
    }

    /// Compares two charts near a state of the first one: the models, and the functions of the events that
    /// were given.
    fn compare(&self, from: usize, to: usize, state: &M::State) -> Result<(), ChartError> {
        let Some(states) = self.switching.compare_near(from, to, state)? else { return Ok(()) };
        let functions = [0, 1].map(|k| {
            let model = &self.switching.charts[[from, to][k]];
            (self.options)(model.simulate(states[k]), model).added_events_at(&states[k])
        });
        agreement::same_functions(&functions, state.t())
    }

    /// Compares the chart of the last part with each chart that differs in one set, at the end of every step.
    fn compare_along(&self, chart: usize, segments: &[Segment<'a, M>]) -> Result<(), ChartError> {
        let Some(Segment { motion, .. }) = segments.last() else { return Ok(()) };
        (0..self.switching.references.len()).try_for_each(|k| {
            let charts = [chart, chart ^ 1 << k];
            let model = &self.switching.charts[charts[1]];
            let other = (self.options)(model.simulate(motion.start()), model);
            step_agreement::StepComparison { switching: self.switching, motion, charts, other }.compare_near()
        })
    }

    /// The motion in one chart up to the end or to where another is due.
    fn run_segment(
        &self,
        chart: usize,
        state: M::State,
        end: f64,
    ) -> Result<Motion<'a, M>, ChartSwitchingErrorKind<M>> {
        let (switching, model) = (self.switching, &self.switching.charts[chart]);
        let run = (self.options)(model.simulate(state), model).until(end);
        let run = if switching.references.is_empty() {
            run
        } else {
            run.event(CHART_CHANGE, |state: &M::State| {
                ChartSwitching::<M>::margin(&switching.references, state)
            })
            .stop_at(CHART_CHANGE, Direction::Falling)
        };
        let motion =
            run.run().map_err(|error| ChartSwitchingErrorKind::Run { chart, error: Box::new(error) })?;
        let refused = |option| Err(ChartError::NotByParts { option }.into());
        if motion.trajectory.output_times.is_some() {
            return refused("output times");
        }
        if motion.global_error().is_some() {
            return refused("estimate_error");
        }
        Ok(motion)
    }

    /// Checks the junction of two parts: inputs must not jump with the chart, and no event may be found in
    /// both.
    fn check_junction(&self, motion: &Motion<'a, M>, segments: &[Segment<'a, M>]) -> Result<(), ChartError> {
        let Some(before) = segments.last() else { return Ok(()) };
        let time = motion.start_time();
        agreement::same_inputs(&before.motion, motion)?;
        let at_the_start = motion.events().iter().take_while(|event| event.time() == time);
        for event in at_the_start {
            let ended = |other: &&crate::simulate::EventRecord<M::State>| {
                other.time() == time && other.name == event.name
            };
            if before.motion.events().iter().rev().find(ended).is_some() && event.name != CHART_CHANGE {
                return Err(ChartError::Coincident { event: String::from(&*event.name), time });
            }
        }
        Ok(())
    }
}
