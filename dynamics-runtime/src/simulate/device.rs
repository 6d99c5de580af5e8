//! The ends of many simulations, made side by side by a device beside the processor: a graphics card.
//!
//! A [`Device`] steps all runs of a [`Batch`] by the method of `integrate/side_by_side.rs`, as the lanes of
//! the processor do. It decides nothing else: which runs are made so, which go on alone, and what is an
//! error, is decided here, for all devices alike.

use alloc::vec;
use alloc::vec::Vec;

use crate::integrate::{Phase, StepOptions};
use crate::model::{ModelState, SimulationModel, Vector};
use crate::simulate::SimulationError;
use crate::simulate::ensemble::{Trials, alone, ends};
use crate::simulate::simulation::Simulation;
use crate::simulate::simulation::side_by_side::LanePlan;

/// What steps the runs of a batch.
pub trait Device {
    /// Why it cannot.
    type Error;

    /// Makes attempts at steps of every run whose outcome is [`Outcome::GOES_ON`], until each has another
    /// one, and writes where the runs then stand.
    ///
    /// # Errors
    /// The device fails; the batch is not looked at again.
    fn advance(&mut self, batch: &mut Batch) -> Result<(), Self::Error>;

    /// Whether the device can hold the numbers of a run: one of single precision cannot hold all. The
    /// processor makes the others.
    fn holds(&self, _run: &RunNumbers<'_>) -> bool {
        true
    }
}

/// The numbers of a run.
#[derive(Clone, Copy, Debug)]
pub struct RunNumbers<'a> {
    /// The times of start and end.
    pub times: [f64; 2],
    /// Parameters, inputs, coordinates and rates, and what is computed from the parameters.
    pub values: &'a [f64],
    /// The permitted relative error of a step.
    pub relative_tolerance: f64,
}

/// What became of a run: bits, as the device writes them.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Outcome(pub i32);

impl Outcome {
    /// It is to be continued.
    pub const GOES_ON: Self = Self(0);
    /// It has reached its end.
    pub const ENDED: Self = Self(1);
    /// Steps cannot do it: it is made alone.
    pub const UNUSUAL: Self = Self(2);
    /// It has made the attempts up to its next pause.
    pub const PAUSED: Self = Self(4);

    fn has(self, bit: Self) -> bool {
        self.0 & bit.0 != 0
    }
}

/// Runs of one model, in numbers. Element e of run r is number e · [`runs`](Self::runs) + r of an array, so
/// that neighbouring threads read neighbouring numbers.
#[derive(Clone, Debug, PartialEq)]
pub struct Batch {
    runs: usize,
    coordinates: usize,
    given: Vec<f64>,
    moving: Vec<f64>,
    outcomes: Vec<i32>,
}

impl Batch {
    /// Numbers of options in [`given`](Self::given), for each run.
    pub const OPTIONS: usize = 4;
    /// Numbers of the step control in [`moving`](Self::moving), for each run.
    pub const CONTROL: usize = 4;

    fn new<M: SimulationModel>(runs: usize) -> Self {
        let (n, given) = (M::Vector::LEN, M::PARAMETERS.len() + M::INPUTS.len() + Self::OPTIONS);
        let moving = 2 * (1 + 2 * n) + Self::CONTROL;
        Self {
            runs,
            coordinates: n,
            given: vec![0.0; given * runs],
            moving: vec![0.0; moving * runs],
            outcomes: vec![Outcome::GOES_ON.0; runs],
        }
    }

    /// How many runs there are.
    #[must_use]
    pub fn runs(&self) -> usize {
        self.runs
    }

    /// What does not change: the parameters, the inputs, then [`OPTIONS`](Self::OPTIONS) numbers: the end,
    /// the largest step, and the absolute and the relative tolerance.
    #[must_use]
    pub fn given(&self) -> &[f64] {
        &self.given
    }

    /// Where the runs stand, and what became of them.
    ///
    /// The numbers are t, q, q̇, then t, q, q̇ where the last accepted step began, then
    /// [`CONTROL`](Self::CONTROL) numbers: the signed size of the next attempt, the attempts up to the next
    /// pause, the rejections in a row, and the steps beyond the border of stability less those within it.
    /// For what became of a run see [`Outcome`].
    #[must_use]
    pub fn moving(&mut self) -> (&mut [f64], &mut [i32]) {
        (&mut self.moving, &mut self.outcomes)
    }

    /// When a run ends.
    fn end<M: SimulationModel>(&self, run: usize) -> f64 {
        self.given[(M::PARAMETERS.len() + M::INPUTS.len()) * self.runs + run]
    }

    /// Where a run stands.
    fn place<V: Vector>(&self, run: usize) -> (f64, Phase<V>) {
        let at = |element: usize| self.moving[element * self.runs + run];
        let mut y = Phase::<V>::zeros();
        for i in 0..V::LEN {
            (y.q[i], y.u[i]) = (at(1 + i), at(1 + V::LEN + i));
        }
        (at(0), y)
    }

    /// Writes the elements of a run, from one of them on.
    fn put(array: &mut [f64], runs: usize, run: usize, first: usize, values: &[f64]) {
        for (element, value) in (first..).zip(values) {
            array[element * runs + run] = *value;
        }
    }

    /// The attempts up to the next pause.
    fn set_pause(&mut self, run: usize, attempts: u64) {
        let left = 2 * (1 + 2 * self.coordinates) + 1;
        self.moving[left * self.runs + run] = attempts as f64;
    }
}

/// A run of a batch.
struct DeviceRun<'m, M: SimulationModel> {
    index: usize,
    simulation: Simulation<'m, M>,
    constants: M::Constants,
    options: StepOptions,
    trials: Trials,
}

/// The ends of many simulations, and which of them the device made.
#[derive(Debug)]
pub struct DeviceEnds<M: SimulationModel> {
    /// The ends in the order of the simulations, as [`ends`] has them.
    pub ends: Vec<Result<M::State, SimulationError<M>>>,
    /// Which of them the device has made to their end; the processor made the others.
    pub by_device: Vec<bool>,
}

impl<M: SimulationModel> DeviceEnds<M> {
    /// All by the processor.
    #[must_use]
    pub fn by_processor(ends: Vec<Result<M::State, SimulationError<M>>>) -> Self {
        Self { by_device: vec![false; ends.len()], ends }
    }

    /// How many of them the device has made.
    #[must_use]
    pub fn on_device(&self) -> usize {
        self.by_device.iter().filter(|by_device| **by_device).count()
    }
}

/// The ends of simulations of one model, in their order: [`ends`] with a device in place of the lanes of the
/// processor. Runs with constraints, choices, events that act, and those that a lane would give up, are made
/// by the processor. At most `at_once` runs are on the device at the same time.
///
/// # Errors
/// The device fails.
pub fn ends_on<'m, M, D>(
    device: &mut D,
    simulations: impl IntoIterator<Item = Simulation<'m, M>>,
    at_once: usize,
) -> Result<DeviceEnds<M>, D::Error>
where
    M: SimulationModel + 'm,
    D: Device,
{
    let mut simulations = simulations.into_iter().enumerate();
    let mut found = Found { ends: Vec::new(), by_device: Vec::new() };
    let mut others = Vec::new();
    loop {
        let mut runs = Vec::new();
        for (index, simulation) in simulations.by_ref() {
            found.ends.push(None);
            found.by_device.push(false);
            match planned(&simulation, device) {
                Some(plan) => {
                    runs.push((index, simulation, plan));
                    if runs.len() >= at_once.max(1) {
                        break;
                    }
                }
                None => others.push((index, simulation)),
            }
        }
        if runs.is_empty() {
            break;
        }
        advance(device, runs, &mut found)?;
    }
    let (indices, rest): (Vec<usize>, Vec<Simulation<'m, M>>) = others.into_iter().unzip();
    for (index, end) in indices.into_iter().zip(ends(rest)) {
        found.ends[index] = Some(end);
    }
    Ok(DeviceEnds { ends: found.ends.into_iter().flatten().collect(), by_device: found.by_device })
}

/// What has been found of all runs.
struct Found<M: SimulationModel> {
    ends: Vec<Option<Result<M::State, SimulationError<M>>>>,
    by_device: Vec<bool>,
}

/// Whether a device can make runs of a model: those that lanes can make.
#[must_use]
pub fn can_be_on_device<M: SimulationModel>() -> bool {
    M::HAS_LANES && M::ROWS.is_empty()
}

/// What the device needs of a run; `None` where the processor makes it.
fn planned<M: SimulationModel, D: Device>(simulation: &Simulation<'_, M>, device: &D) -> Option<LanePlan<M>> {
    if !can_be_on_device::<M>() {
        return None;
    }
    let (model, start) = (simulation.model(), *simulation.start());
    let plan = simulation.side_by_side().filter(|plan| plan.events.is_empty())?;
    let parameters = (0..M::PARAMETERS.len()).map(|i| model.parameter(i));
    let mut values = parameters.collect::<Option<Vec<f64>>>()?;
    values.extend_from_slice(start.inputs().as_slice());
    values.extend_from_slice(start.q().as_slice());
    values.extend_from_slice(start.u().as_slice());
    let read = values.len();
    values.resize(read + M::LANE_VALUES, 0.0);
    model.lane_values(&plan.constants, &start, &mut values[read..]);
    let relative_tolerance = plan.options.tolerances.relative;
    let numbers = RunNumbers { times: [start.t(), plan.end], values: &values, relative_tolerance };
    device.holds(&numbers).then_some(plan)
}

/// Runs of a batch to their ends.
fn advance<'m, M: SimulationModel, D: Device>(
    device: &mut D,
    planned: Vec<(usize, Simulation<'m, M>, LanePlan<M>)>,
    found: &mut Found<M>,
) -> Result<(), D::Error> {
    let mut batch = Batch::new::<M>(planned.len());
    let mut runs: Vec<Option<DeviceRun<'m, M>>> = Vec::with_capacity(planned.len());
    for (number, (index, simulation, plan)) in planned.into_iter().enumerate() {
        runs.push(Some(entered(&mut batch, number, index, simulation, plan)));
    }
    while runs.iter().any(Option::is_some) {
        device.advance(&mut batch)?;
        for (number, place) in runs.iter_mut().enumerate() {
            let Some(run) = place else { continue };
            let (outcome, (t, y)) = (Outcome(batch.outcomes[number]), batch.place::<M::Vector>(number));
            let is_unusual = outcome.has(Outcome::UNUSUAL);
            let has_ended = outcome.has(Outcome::ENDED);
            let DeviceRun { simulation, constants, options, trials, .. } = run;
            let goes_on = !is_unusual && !has_ended;
            if goes_on && !trials.is_stiff_or_long(simulation, (&*constants, &*options), t, &y) {
                batch.set_pause(number, trials.pause());
                batch.outcomes[number] = Outcome::GOES_ON.0;
                continue;
            }
            let Some(DeviceRun { index, simulation, .. }) = place.take() else { continue };
            // A device need not see that a number is none.
            let is_finite = y.q.as_slice().iter().chain(y.u.as_slice()).all(|x| x.is_finite());
            let is_made = has_ended && !is_unusual && is_finite;
            found.by_device[index] = is_made;
            // A device of single precision does not hold the time.
            let end = batch.end::<M>(number);
            found.ends[index] =
                Some(if is_made { Ok(simulation.state_at(end, &y)) } else { alone(simulation) });
        }
    }
    Ok(())
}

/// Puts a run into a batch.
fn entered<'m, M: SimulationModel>(
    batch: &mut Batch,
    number: usize,
    index: usize,
    simulation: Simulation<'m, M>,
    LanePlan { constants, options, end, first, .. }: LanePlan<M>,
) -> DeviceRun<'m, M> {
    let (start, runs) = (*simulation.start(), batch.runs);
    let model = simulation.model();
    let mut given: Vec<f64> = (0..M::PARAMETERS.len()).filter_map(|i| model.parameter(i)).collect();
    given.extend_from_slice(start.inputs().as_slice());
    given.extend([end, options.most, options.tolerances.absolute, options.tolerances.relative]);
    Batch::put(&mut batch.given, runs, number, 0, &given);
    let trials = Trials::new(&simulation);
    let mut moving = Vec::with_capacity(2 * (1 + 2 * batch.coordinates) + Batch::CONTROL);
    for _ in 0..2 {
        moving.push(start.t());
        moving.extend_from_slice(start.q().as_slice());
        moving.extend_from_slice(start.u().as_slice());
    }
    moving.extend([first.copysign(end - start.t()), trials.pause() as f64, 0.0, 0.0]);
    Batch::put(&mut batch.moving, runs, number, 0, &moving);
    DeviceRun { index, simulation, constants, options, trials }
}
