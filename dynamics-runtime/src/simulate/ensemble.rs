//! Many simulations of a model, of which only the ends are wanted: made side by side where that is possible.
//!
//! Each lane of the processor's vectors has its own run, with its own parameters, inputs, steps and end. When
//! one ends the next takes its lane. Where a run needs more than steps it is made alone, as
//! [`Simulation::run_with`] makes it:
//!
//! * from its start, if the model has constraints, choices or no code for several states, if an option asks
//!   for what lanes do not have (`simulation/side_by_side.rs` has the list), if the steps meet something
//!   unusual (`integrate/side_by_side.rs`), or if it is stiff: every [`TRIAL_INTERVAL`] attempts an implicit
//!   step is tried, as in a run alone;
//! * from the step before an event that acts. The functions of such events are compared at nine places of
//!   each step; what only comes near zero there is looked at closely, too. The tolerances stay those of the
//!   run; its limit of steps begins anew. Events that do not act are not evaluated: a run does not fail
//!   because such a function has no value.
//!
//! Whether a run is made alone depends on that run, so results do not depend on the number of lanes.

use alloc::vec;
use alloc::vec::Vec;

use crate::integrate::Stages;
use crate::integrate::side_by_side::{AccelerationsSideBySide, Entry, LaneOutcomes, Positions, SideBySide};
use crate::integrate::{Phase, StepOptions};
use crate::lanes::{Lanes, Task, Wide as _, in_fused_lanes};
use crate::model::{LaneEvaluation, ModelState, OwnValues, SimulationModel, StaticTraits, WideOf};
use crate::simulate::SimulationError;
use crate::simulate::simulation::Simulation;
use crate::simulate::simulation::side_by_side::{LanePlan, WatchedEvents};

/// Attempts between two trials of an implicit step.
const TRIAL_INTERVAL: u64 = 1_000;

/// The ends of simulations of one model, in their order: many starts, many values of parameters, random
/// samples. Where the model has no constraints and no choices, as many run side by side as the vectors of the
/// processor have lanes, by Verner 9(8), with tolerances as in [`Simulation`]. All others are run one by one.
/// A run that fails is its error; what it computed is not kept. It takes one core: for several call it in
/// several threads, or use a sweep.
///
/// The simulations may differ in their models, starts, ends and tolerances.
///
/// ```
/// # use dynamics_runtime as dynamics;
/// use dynamics::simulate::{Simulate, ends};
///
/// /// The share of starts from which a motion reaches the time 10.
/// fn reach<M: Simulate>(model: &M, starts: &[M::State]) -> f64 {
///     let ends = ends(starts.iter().map(|start| model.simulate(*start).until(10.0)));
///     ends.iter().filter(|end| end.is_ok()).count() as f64 / starts.len() as f64
/// }
/// ```
pub fn ends<'m, M: SimulationModel + 'm>(
    simulations: impl IntoIterator<Item = Simulation<'m, M>>,
) -> Vec<Result<M::State, SimulationError<M>>> {
    let simulations = simulations.into_iter();
    let mut queue = Queue { ends: Vec::with_capacity(simulations.size_hint().0), simulations };
    if M::HAS_LANES && M::IS_UNCONSTRAINED {
        in_fused_lanes(Ensemble(&mut queue));
    } else {
        while let Some((index, simulation)) = queue.next() {
            queue.ends[index] = Some(alone(simulation));
        }
    }
    // Every simulation that left the queue has ended: the loops above go on until no lane has one.
    queue.ends.into_iter().flatten().collect()
}

/// The end of a run that is made alone.
#[cold]
#[inline(never)]
pub(crate) fn alone<M: SimulationModel>(
    simulation: Simulation<'_, M>,
) -> Result<M::State, SimulationError<M>> {
    simulation.run_with(|_| ())
}

/// Simulations that have not begun, and the ends of the others.
struct Queue<M: SimulationModel, I> {
    simulations: I,
    ends: Vec<Option<Result<M::State, SimulationError<M>>>>,
}

impl<'m, M: SimulationModel + 'm, I: Iterator<Item = Simulation<'m, M>>> Queue<M, I> {
    fn next(&mut self) -> Option<(usize, Simulation<'m, M>)> {
        let simulation = self.simulations.next()?;
        self.ends.push(None);
        Some((self.ends.len() - 1, simulation))
    }
}

/// All runs of a queue.
struct Ensemble<'q, M: SimulationModel, I>(&'q mut Queue<M, I>);

impl<'m, M: SimulationModel + 'm, I: Iterator<Item = Simulation<'m, M>>> Task for Ensemble<'_, M, I> {
    type Output = ();

    #[inline(always)]
    fn run<L: Lanes>(self) {
        let mut runs = Runs::<M, L>::new();
        let mut stepper = SideBySide::new();
        runs.fill(&mut stepper, self.0);
        while !runs.is_empty() {
            let attempt = stepper.attempt(&mut runs);
            runs.note(&mut stepper, attempt, self.0);
        }
    }
}

/// The runs in the lanes.
struct Runs<'m, M: SimulationModel, L: Lanes> {
    lanes: Vec<Option<Run<'m, M>>>,
    /// Lanes that have a run, by bits; those whose run has events that act.
    occupied: u32,
    watched: u32,
    /// What the accelerations read of each model.
    values: Vec<L>,
    /// Memory for the values of one model.
    own: Vec<f64>,
    /// Where the runs stand after the last attempt that was looked at.
    places: Positions<M::Vector, L>,
    /// One of the models, with its constants and a state, for the code that reads the values instead.
    sample_model: Option<(&'m M, M::Constants, M::State)>,
}

/// A run in a lane.
struct Run<'m, M: SimulationModel> {
    index: usize,
    simulation: Simulation<'m, M>,
    constants: M::Constants,
    options: StepOptions,
    /// The events that act.
    events: WatchedEvents,
    trials: Trials,
}

/// When a run pauses, to see whether it is stiff or too long.
pub(crate) struct Trials {
    /// Attempts and time at the last pause.
    last: (u64, f64),
    /// Attempts from there to the next pause.
    pause: u64,
}

impl<'m, M: SimulationModel, L: Lanes> Runs<'m, M, L> {
    fn new() -> Self {
        let lanes = (0..L::COUNT).map(|_| None).collect();
        let values = vec![L::zero(); M::LANE_VALUES];
        Self {
            lanes,
            occupied: 0,
            watched: 0,
            values,
            own: vec![0.0; M::LANE_VALUES],
            places: Positions::new(),
            sample_model: None,
        }
    }

    fn is_empty(&self) -> bool {
        self.occupied == 0
    }

    /// Fills all lanes for the first time. Lanes for which there is no run stand where the first one does.
    #[cold]
    #[inline(never)]
    fn fill<I: Iterator<Item = Simulation<'m, M>>>(
        &mut self,
        stepper: &mut SideBySide<M::Vector, L>,
        queue: &mut Queue<M, I>,
    ) {
        for lane in 0..L::COUNT {
            self.begin(stepper, lane, queue);
            if self.lanes[lane].is_none() && lane > 0 {
                stepper.write(&mut self.places);
                let (t, y) = self.places.now(0);
                self.values.iter_mut().for_each(|value| *value = value.with_lane(lane, value.lane(0)));
                stepper.rest_at(lane, t, &y);
            }
        }
    }

    /// Begins the next run that can be made in a lane, after those before it that cannot.
    #[cold]
    #[inline(never)]
    fn begin<I: Iterator<Item = Simulation<'m, M>>>(
        &mut self,
        stepper: &mut SideBySide<M::Vector, L>,
        lane: usize,
        queue: &mut Queue<M, I>,
    ) {
        while let Some((index, simulation)) = queue.next() {
            let Some(plan) = simulation.side_by_side() else {
                queue.ends[index] = Some(alone(simulation));
                continue;
            };
            let LanePlan { constants, options, end, first, events } = plan;
            let start = *simulation.start();
            simulation.model().lane_values(&constants, &start, &mut self.own);
            for (value, own) in self.values.iter_mut().zip(&self.own) {
                *value = value.with_lane(lane, *own);
            }
            let y = Phase { q: *start.q(), u: *start.u() };
            let trials = Trials::new(&simulation);
            let pause = trials.pause();
            stepper.enter(lane, &Entry { t: start.t(), y: &y, end, h: first, options: &options, pause });
            if !events.is_empty() {
                self.watched |= 1 << lane;
            }
            self.occupied |= 1 << lane;
            self.sample_model = Some((simulation.model(), constants, start));
            self.lanes[lane] = Some(Run { index, simulation, constants, options, events, trials });
            return;
        }
    }

    /// Ends runs and begins others, as the last attempt says.
    #[inline(always)]
    fn note<I: Iterator<Item = Simulation<'m, M>>>(
        &mut self,
        stepper: &mut SideBySide<M::Vector, L>,
        attempt: LaneOutcomes,
        queue: &mut Queue<M, I>,
    ) {
        let LaneOutcomes { accepted, ended, unusual, paused } = attempt;
        let rare = self.occupied & (ended | unusual | paused | accepted & self.watched);
        if rare != 0 {
            stepper.write(&mut self.places);
            self.finish_or_leave(stepper, rare, attempt, queue);
        }
    }

    #[inline(never)]
    fn finish_or_leave<I: Iterator<Item = Simulation<'m, M>>>(
        &mut self,
        stepper: &mut SideBySide<M::Vector, L>,
        lanes: u32,
        LaneOutcomes { accepted, ended, unusual, paused }: LaneOutcomes,
        queue: &mut Queue<M, I>,
    ) {
        for lane in (0..L::COUNT).filter(|lane| lanes >> lane & 1 == 1) {
            let is = |bits: u32| bits >> lane & 1 == 1;
            let Some(run) = &mut self.lanes[lane] else { continue };
            let (t, y) = self.places.now(lane);
            let state = run.simulation.state_at(t, &y);
            // Where it goes on alone, if it does.
            let must_leave = is(unusual) || is(paused & !ended) && run.is_stiff_or_long(t, &y);
            let from = if is(accepted & self.watched) && !must_leave {
                let (t, y) = self.places.from(lane);
                let from = run.simulation.state_at(t, &y);
                run.simulation.may_act(&mut run.events, &from, &state).then_some(from)
            } else {
                None
            };
            if from.is_none() && !must_leave && !is(ended) {
                if is(paused) {
                    stepper.go_on(lane, run.trials.pause());
                }
                continue;
            }
            let Some(Run { index, simulation, options, .. }) = self.lanes[lane].take() else { continue };
            self.occupied &= !(1 << lane);
            self.watched &= !(1 << lane);
            queue.ends[index] = Some(match from {
                Some(from) => alone(simulation.going_on_from(from, options.tolerances)),
                None if must_leave => alone(simulation),
                None => Ok(state),
            });
            self.begin(stepper, lane, queue);
            if self.lanes[lane].is_none() {
                stepper.rest(lane);
            }
        }
    }

    /// The accelerations where some states have none: each state in all lanes, so that the others have the
    /// bits that they have without it. NaN where there are none.
    #[cold]
    #[inline(never)]
    fn one_by_one(&mut self, t: &L, y: &Stages<M::Vector, L>, a: &mut WideOf<M, L>) {
        let Some((model, constants, state)) = &self.sample_model else { return };
        let mut values = vec![L::zero(); self.values.len()];
        let (mut same, mut found) = (Stages::<M::Vector, L>::zeros(), Stages::<M::Vector, L>::zeros());
        for lane in 0..L::COUNT {
            let all = |x: &L| L::splat(x.lane(lane));
            values.iter_mut().zip(&self.values).for_each(|(to, of)| *to = all(of));
            for (to, of) in [(&mut same.q, &y.q), (&mut same.u, &y.u)] {
                to.as_mut_slice().iter_mut().zip(of.as_slice()).for_each(|(to, of)| *to = all(of));
            }
            let exists = L::call(LaneEvaluation {
                model: *model,
                constants,
                state,
                values: OwnValues(&values),
                t: all(t),
                states: [&same.q, &same.u],
                accelerations: &mut found.u,
            });
            for (a, found) in a.as_mut_slice().iter_mut().zip(found.u.as_slice()) {
                *a = a.with_lane(lane, if exists { found.lane(0) } else { f64::NAN });
            }
        }
    }
}

impl Trials {
    pub(crate) fn new<M: SimulationModel>(simulation: &Simulation<'_, M>) -> Self {
        Self { last: (0, simulation.start().t()), pause: TRIAL_INTERVAL.min(simulation.step_limit()) }
    }

    /// Attempts up to the next pause.
    pub(crate) fn pause(&self) -> u64 {
        self.pause
    }

    /// At a pause: whether the run has made all the steps that it may, or implicit steps of a worthwhile
    /// length are as accurate. If not, the next pause is set.
    #[cold]
    pub(crate) fn is_stiff_or_long<M: SimulationModel>(
        &mut self,
        simulation: &Simulation<'_, M>,
        (constants, options): (&M::Constants, &StepOptions),
        t: f64,
        y: &Phase<M::Vector>,
    ) -> bool {
        let (attempts, since) = (self.last.0 + self.pause, self.last.1);
        let left = simulation.step_limit() - attempts;
        let mean_step = (t - since).abs() / self.pause as f64;
        (self.last, self.pause) = ((attempts, t), TRIAL_INTERVAL.min(left));
        left == 0 || simulation.is_stiff(constants, options, (t, y), mean_step)
    }
}

impl<M: SimulationModel> Run<'_, M> {
    /// See [`Trials::is_stiff_or_long`].
    fn is_stiff_or_long(&mut self, t: f64, y: &Phase<M::Vector>) -> bool {
        self.trials.is_stiff_or_long(&self.simulation, (&self.constants, &self.options), t, y)
    }
}

impl<M: SimulationModel, L: Lanes> AccelerationsSideBySide<M::Vector, L> for Runs<'_, M, L> {
    #[inline(always)]
    fn accelerations(&mut self, t: L, y: &Stages<M::Vector, L>, a: &mut WideOf<M, L>) {
        let Some((model, constants, state)) = &self.sample_model else { return };
        let values = OwnValues(&self.values);
        let states = [&y.q, &y.u];
        if !L::call(LaneEvaluation { model: *model, constants, state, values, t, states, accelerations: a }) {
            self.one_by_one(&t, y, a);
        }
    }
}
