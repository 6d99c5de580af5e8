//! Many simulations of a model, of which only the ends are wanted: made side by side where that is possible.
//!
//! Each lane of the processor's vectors has its own run, with its own parameters, inputs, steps and end. When
//! one ends the next takes its lane. Where a run needs more than steps it is made alone, as
//! [`Simulation::run_with`] makes it:
//!
//! * from its start, if the model has constraints, choices or no code for several states, if an option asks
//!   for what lanes do not have (`simulation/side_by_side.rs` has the list), or if the steps meet something
//!   unusual (`integrate/side_by_side.rs`);
//! * from the step before an event that acts. The event functions are compared at the ends and in the middle
//!   of each step, so that few crossings are missed; what only comes near one is looked at closely, too.
//!
//! Whether a run is made alone depends on that run, so results do not depend on the number of lanes.

use alloc::vec;
use alloc::vec::Vec;

use crate::integrate::Phase;
use crate::integrate::Stages;
use crate::integrate::side_by_side::{AccelerationsSideBySide, Entry, LaneOutcomes, Positions, SideBySide};
use crate::lanes::{Lanes, Task, Wide as _, in_fused_lanes};
use crate::model::{LaneEvaluation, ModelState, OwnValues, SimulationModel, StaticTraits, WideOf};
use crate::simulate::SimulationError;
use crate::simulate::simulation::Simulation;
use crate::simulate::simulation::side_by_side::{LanePlan, WatchedEvents};

/// The ends of simulations of one model, in their order: many starts, many values of parameters, random
/// samples. Where the model has no constraints and no choices, as many run side by side as the vectors of the
/// processor have lanes, by Verner 9(8), with tolerances as in [`Simulation`]. All others are run one by one.
/// A run that fails is its error; what it computed is not kept.
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
    queue.ends.into_iter().flatten().collect()
}

/// The end of a run that is made alone.
#[cold]
#[inline(never)]
fn alone<M: SimulationModel>(simulation: Simulation<'_, M>) -> Result<M::State, SimulationError<M>> {
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
    /// Where the runs stand after the last attempt that was looked at.
    places: Positions<M::Vector, L>,
    /// One of the models, with its constants and a state, for the code that reads the values instead.
    any: Option<(&'m M, M::Constants, M::State)>,
}

/// A run in a lane.
struct Run<'m, M: SimulationModel> {
    index: usize,
    simulation: Simulation<'m, M>,
    constants: M::Constants,
    /// The events that act.
    events: WatchedEvents,
}

impl<'m, M: SimulationModel, L: Lanes> Runs<'m, M, L> {
    fn new() -> Self {
        let lanes = (0..L::COUNT).map(|_| None).collect();
        let values = vec![L::zero(); M::LANE_VALUES];
        Self { lanes, occupied: 0, watched: 0, values, places: Positions::new(), any: None }
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
            let LanePlan { constants, options, max_steps, end, first, events } = plan;
            let start = *simulation.start();
            let mut own = vec![0.0; M::LANE_VALUES];
            simulation.model().lane_values(&constants, &start, &mut own);
            for (value, own) in self.values.iter_mut().zip(own) {
                *value = value.with_lane(lane, own);
            }
            let y = Phase { q: *start.q(), u: *start.u() };
            stepper.enter(
                lane,
                &Entry { t: start.t(), y: &y, end, h: first, options: &options, max_steps: max_steps as f64 },
            );
            if !events.is_empty() {
                self.watched |= 1 << lane;
            }
            self.occupied |= 1 << lane;
            self.any = Some((simulation.model(), constants, start));
            self.lanes[lane] = Some(Run { index, simulation, constants, events });
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
        let LaneOutcomes { accepted, ended, unusual } = attempt;
        let rare = self.occupied & (ended | unusual | accepted & self.watched);
        if rare != 0 {
            stepper.write(&mut self.places);
            self.look_at(stepper, rare, attempt, queue);
        }
    }

    #[inline(never)]
    fn look_at<I: Iterator<Item = Simulation<'m, M>>>(
        &mut self,
        stepper: &mut SideBySide<M::Vector, L>,
        lanes: u32,
        LaneOutcomes { accepted, ended, unusual }: LaneOutcomes,
        queue: &mut Queue<M, I>,
    ) {
        for lane in (0..L::COUNT).filter(|lane| lanes >> lane & 1 == 1) {
            let is = |bits: u32| bits >> lane & 1 == 1;
            let Some(run) = &mut self.lanes[lane] else { continue };
            let (t, y) = self.places.now(lane);
            let state = run.simulation.state_at(t, &y);
            // Where it goes on alone, if it does.
            let from = if is(unusual) {
                Some(*run.simulation.start())
            } else if is(accepted & self.watched) {
                let (t, y) = self.places.from(lane);
                let from = run.simulation.state_at(t, &y);
                run.simulation.may_act(&mut run.events, &from, &state).then_some(from)
            } else {
                None
            };
            if from.is_none() && !is(ended) {
                continue;
            }
            let Some(Run { index, simulation, .. }) = self.lanes[lane].take() else { continue };
            self.occupied &= !(1 << lane);
            self.watched &= !(1 << lane);
            queue.ends[index] = Some(match from {
                Some(from) => alone(simulation.starting_at(from)),
                None => Ok(state),
            });
            self.begin(stepper, lane, queue);
            if self.lanes[lane].is_none() {
                stepper.rest(lane);
            }
        }
    }

    /// The accelerations of each state alone, where some have none.
    #[cold]
    #[inline(never)]
    fn one_by_one(&mut self, t: &L, y: &Stages<M::Vector, L>, a: &mut WideOf<M, L>) {
        for lane in 0..L::COUNT {
            let found = self.lanes[lane].as_ref().and_then(|run| {
                let state = run.simulation.state_at(t.lane(lane), &y.of(lane));
                run.simulation.model().accelerations_with(&run.constants, &state).ok()
            });
            for (i, a) in a.as_mut_slice().iter_mut().enumerate() {
                *a = a.with_lane(lane, found.as_ref().map_or(f64::NAN, |found| found[i]));
            }
        }
    }
}

impl<M: SimulationModel, L: Lanes> AccelerationsSideBySide<M::Vector, L> for Runs<'_, M, L> {
    #[inline(always)]
    fn accelerations(&mut self, t: L, y: &Stages<M::Vector, L>, a: &mut WideOf<M, L>) {
        let Some((model, constants, state)) = &self.any else { return };
        let values = OwnValues(&self.values);
        let states = [&y.q, &y.u];
        if !L::call(LaneEvaluation { model: *model, constants, state, values, t, states, accelerations: a }) {
            self.one_by_one(&t, y, a);
        }
    }
}
