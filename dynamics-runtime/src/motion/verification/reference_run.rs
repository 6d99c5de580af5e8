//! A second run of a simulation, more accurate than the first, looked at where the first made its steps.

use alloc::string::String;
use alloc::vec::Vec;

use crate::integrate::{Method, StepOptions, Tolerances};
use crate::model::{Model, ModelState};
use crate::motion::events::location::Flow;
use crate::motion::failure::SimulationErrorKind as Kind;
use crate::motion::run::Sink;
use crate::motion::trajectory::record::{Counts, EventRecord, Record};

/// How many times smaller the tolerance of the second run is.
const TIGHTER: f64 = 100.0;
/// A second run is worth its cost where its tolerance is smaller by this factor at least.
const WORTH: f64 = 3.0;
/// Where it cannot be smaller, it is larger by this factor: what is then found is mostly the error of the
/// second run.
const LOOSER: f64 = 10.0;

/// Steps in the middle of which the runs are compared, too: each of them costs the first one a step with
/// dense output.
const MIDDLES: usize = 256;

/// Where a second run is looked at: the times of the first one's records, with the middles of some of its
/// steps; and which they are.
pub(crate) fn places(times: &[f64], fixed: bool) -> (Vec<f64>, Vec<bool>) {
    let every = times.len().div_ceil(MIDDLES).max(1);
    let (mut places, mut middle) = (Vec::new(), Vec::new());
    for (i, t) in times.iter().enumerate() {
        places.push(*t);
        middle.push(false);
        let Some(next) = times.get(i + 1).filter(|next| *next != t && !fixed && i % every == 0) else {
            continue;
        };
        places.push(0.5 * (t + next));
        middle.push(true);
    }
    (places, middle)
}

/// What the second run did otherwise than the first.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum SecondRun {
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

impl SecondRun {
    pub(crate) fn of(first: &StepOptions, method: Method) -> Self {
        if let Some(h) = first.fixed {
            return Self::HalfStep(0.5 * h);
        }
        let Tolerances { absolute, relative } = first.tolerances;
        // Newton's iterations of an implicit method leave rounding errors of their own.
        let finest = if method.is_for_stiff() { 1e-13 } else { 1e-14 };
        let room = if relative > 0.0 { relative / finest } else { TIGHTER };
        if room < WORTH {
            return Self::Looser { absolute: LOOSER * absolute, relative: LOOSER * relative };
        }
        let factor = room.min(TIGHTER);
        Self::Tighter { absolute: absolute / factor, relative: relative / factor }
    }

    /// The options of the first run, with what is otherwise.
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

/// What the second run left.
pub(crate) struct Second<M: Model> {
    pub(crate) run: SecondRun,
    /// At the times of the first one's records, as far as it went.
    pub(crate) states: Vec<M::State>,
    /// In the middle of some of the first one's steps.
    pub(crate) middles: Vec<M::State>,
    pub(crate) events: Vec<EventRecord<M::State>>,
    pub(crate) counts: Counts,
    /// Where and why it broke off.
    pub(crate) broken_off: Option<(f64, String)>,
}

/// Keeps the states at given times, in the order of the motion, and the events.
pub(crate) struct Probe<M: Model> {
    times: Vec<f64>,
    pub(crate) states: Vec<M::State>,
    pub(crate) events: Vec<EventRecord<M::State>>,
    pub(crate) reached: f64,
}

impl<M: Model> Probe<M> {
    pub(crate) fn at(times: Vec<f64>) -> Self {
        let states = Vec::with_capacity(times.len());
        let reached = times.first().copied().unwrap_or(f64::NAN);
        Self { times, states, events: Vec::new(), reached }
    }
}

impl<M: Model> Sink<M> for Probe<M> {
    fn step(
        &mut self,
        from: Record<M>,
        to: &M::State,
        dense: &mut dyn FnMut(f64) -> Result<M::State, Kind>,
    ) -> Result<Flow, Kind> {
        while let Some(&t) = self.times.get(self.states.len()) {
            let theta = (t - from.state.t()) / from.h;
            let state = if theta <= 0.0 {
                from.state
            } else if t == to.t() {
                *to
            } else if theta < 1.0 {
                dense(theta)?
            } else {
                break;
            };
            self.states.push(state);
        }
        self.reached = to.t();
        Ok(Flow::Continue)
    }

    fn stand(&mut self, _: Record<M>) {}

    fn event(&mut self, event: EventRecord<M::State>) {
        self.events.push(event);
    }
}
