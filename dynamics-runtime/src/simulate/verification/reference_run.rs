//! The reference run: a second, more accurate run, compared at the times of the first one's steps.

use alloc::string::String;
use alloc::vec::Vec;

use crate::model::{Model, ModelState};
use crate::simulate::events::rules::Flow;
use crate::simulate::failure::SimulationErrorKind as Kind;
use crate::simulate::run::sinks::Sink;
use crate::simulate::trajectory::global_error::ReferenceSettings;
use crate::simulate::trajectory::record::{Counts, EventRecord, Record};

/// The runs are compared in the middle of up to so many steps, too. Each costs a step with dense output of
/// the first run.
const MAX_MIDDLES: usize = 256;

/// Times at which the runs are compared: those of the first one's records and the middles of some of its
/// steps, with a flag for the middles.
pub(crate) fn comparison_times(times: &[f64], fixed: bool) -> (Vec<f64>, Vec<bool>) {
    let every = times.len().div_ceil(MAX_MIDDLES).max(1);
    let (mut comparison_times, mut middle) = (Vec::new(), Vec::new());
    for (i, t) in times.iter().enumerate() {
        comparison_times.push(*t);
        middle.push(false);
        let Some(next) = times.get(i + 1).filter(|next| *next != t && !fixed && i % every == 0) else {
            continue;
        };
        comparison_times.push(0.5 * (t + next));
        middle.push(true);
    }
    (comparison_times, middle)
}

/// The result of the reference run.
pub(crate) struct ReferenceRun<M: Model> {
    pub(crate) run: ReferenceSettings,
    /// States at the times of the first run's records, as far as the reference run went.
    pub(crate) states: Vec<M::State>,
    /// States in the middle of some of the first run's steps.
    pub(crate) middles: Vec<M::State>,
    pub(crate) events: Vec<EventRecord<M::State>>,
    pub(crate) counts: Counts,
    /// Where and why it broke off.
    pub(crate) broken_off: Option<(f64, String)>,
}

/// Keeps the states at given times, in the order of the motion, and the events.
pub(crate) struct ReferenceSink<M: Model> {
    times: Vec<f64>,
    pub(crate) states: Vec<M::State>,
    pub(crate) events: Vec<EventRecord<M::State>>,
    pub(crate) reached: f64,
}

impl<M: Model> ReferenceSink<M> {
    pub(crate) fn at(times: Vec<f64>) -> Self {
        let states = Vec::with_capacity(times.len());
        let reached = times.first().copied().unwrap_or(f64::NAN);
        Self { times, states, events: Vec::new(), reached }
    }
}

impl<M: Model> Sink<M> for ReferenceSink<M> {
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

    fn event(&mut self, event: EventRecord<M::State>) {
        self.events.push(event);
    }
}
