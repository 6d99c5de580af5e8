//! Sinks take the results of a run: records for a motion, or states for an observer.
//!
//! The pilot run and the reference run have sinks of their own, in `pilot_run.rs` and
//! `verification/reference_run.rs`.

use crate::model::{Model, ModelState};
use crate::simulate::events::rules::Flow;
use crate::simulate::failure::SimulationErrorKind as Kind;
use crate::simulate::trajectory::record::{EventRecord, Record};
use alloc::vec::Vec;

/// Takes the results of a run.
pub(crate) trait Sink<M: Model> {
    /// A step was accepted that starts at this record. `dense(θ)` interpolates, and fails where the model
    /// does.
    fn step(
        &mut self,
        from: Record<M>,
        to: &M::State,
        dense: &mut dyn FnMut(f64) -> Result<M::State, Kind>,
    ) -> Result<Flow, Kind>;
    /// The motion ends at this record, or continues from another state.
    fn end_segment(&mut self, _at: Record<M>) {}
    /// Records and events from this time on, in the direction of the motion, are not part of the motion.
    fn truncate(&mut self, _to: f64) {}
    /// An event happened in the last step.
    fn event(&mut self, _event: EventRecord<M::State>) {}
    /// The times of all records that were kept.
    fn times(&self) -> Vec<f64> {
        Vec::new()
    }
}

/// Keeps records for a [`crate::simulate::Motion`].
pub(crate) struct RecordingSink<M: Model> {
    pub(crate) records: Vec<Record<M>>,
    pub(crate) events: Vec<EventRecord<M::State>>,
}

impl<M: Model> Sink<M> for RecordingSink<M> {
    #[inline]
    fn step(
        &mut self,
        from: Record<M>,
        _: &M::State,
        _: &mut dyn FnMut(f64) -> Result<M::State, Kind>,
    ) -> Result<Flow, Kind> {
        self.records.push(from);
        Ok(Flow::Continue)
    }

    fn end_segment(&mut self, at: Record<M>) {
        self.records.push(at);
    }

    fn truncate(&mut self, to: f64) {
        let Some(first) = self.records.first().map(|record| record.state.t()) else { return };
        let direction = if to < first { -1.0 } else { 1.0 };
        let remains = |t: f64| (to - t) * direction > 0.0;
        self.records.truncate(self.records.iter().take_while(|record| remains(record.state.t())).count());
        self.events.retain(|event| remains(event.time()));
    }

    fn event(&mut self, event: EventRecord<M::State>) {
        self.events.push(event);
    }

    fn times(&self) -> Vec<f64> {
        self.records.iter().map(|record| record.state.t()).collect()
    }
}

/// Passes states to an observer and keeps the last record.
pub(crate) struct ObserverSink<'o, M: Model> {
    pub(crate) observer: &'o mut dyn FnMut(&M::State) -> Flow,
    /// Output times after `next`, in the order of the motion; all accepted steps where `None`.
    pub(crate) times: Option<alloc::vec::IntoIter<f64>>,
    pub(crate) next: Option<f64>,
    pub(crate) last: Option<Record<M>>,
}

impl<M: Model> Sink<M> for ObserverSink<'_, M> {
    fn step(
        &mut self,
        from: Record<M>,
        to: &M::State,
        dense: &mut dyn FnMut(f64) -> Result<M::State, Kind>,
    ) -> Result<Flow, Kind> {
        let Some(times) = &mut self.times else {
            return Ok((self.observer)(to));
        };
        while let Some(t) = self.next {
            let theta = (t - from.state.t()) / from.h;
            if theta > 1.0 {
                break;
            }
            self.next = times.next();
            if (self.observer)(&dense(theta)?) == Flow::Stop {
                return Ok(Flow::Stop);
            }
        }
        Ok(Flow::Continue)
    }

    fn end_segment(&mut self, at: Record<M>) {
        self.last = Some(at);
    }
}
