//! Events of two runs, matched with each other by name and order.

use alloc::vec::Vec;

use crate::model::{ModelState, SimulationModel};
use crate::simulate::trajectory::global_error::EventShift;
use crate::simulate::trajectory::record::{EventRecord, Trajectory};
use crate::simulate::verification::reference_run::ReferenceRun;

/// Events at one instant may differ by this part of their time, which is rounding.
const SAME_INSTANT: f64 = 1e-12;

/// The result of matching the events of two runs.
#[derive(Default)]
pub(crate) struct EventMatching {
    pub(crate) shift: Option<EventShift>,
    pub(crate) unmatched: Option<EventShift>,
    /// Intervals in which only one run has had an event that changes the state.
    pub(crate) between: Vec<[f64; 2]>,
}

impl EventMatching {
    /// Compares the events of two runs, name by name.
    pub(crate) fn of<M: SimulationModel>(first: &Trajectory<M>, second: &ReferenceRun<M>) -> Self {
        let direction = first.direction();
        let end = second.broken_off.as_ref().map_or(f64::INFINITY, |(t, _)| direction * t);
        let mut names: Vec<&str> = Vec::new();
        for event in first.events.iter().chain(&second.events) {
            if !names.contains(&&*event.name) {
                names.push(&event.name);
            }
        }
        let mut matched = Self::default();
        for name in names {
            let seen = |event: &&EventRecord<M::State>| event.name == name && direction * event.time() < end;
            let ours: Vec<_> = first.events.iter().filter(seen).collect();
            let theirs: Vec<_> = second.events.iter().filter(seen).collect();
            matched.pair(name, direction, &ours, &theirs);
        }
        matched
    }

    /// Pairs the events of one name in their order. Where one run has more of them, two events are a pair if
    /// their distance is at most half of that to the next event.
    fn pair<'e, S: ModelState>(
        &mut self,
        name: &str,
        direction: f64,
        mut ours: &'e [&'e EventRecord<S>],
        mut theirs: &'e [&'e EventRecord<S>],
    ) {
        let gap = |events: &[&EventRecord<S>]| match events {
            [a, b, ..] => (b.time() - a.time()).abs(),
            _ => f64::INFINITY,
        };
        let equal = ours.len() == theirs.len();
        loop {
            let (a, b) = match (ours.first(), theirs.first()) {
                (None, None) => return,
                (Some(only), None) => return self.record_unmatched(name, direction, only.time()),
                (None, Some(only)) => return self.record_unmatched(name, direction, only.time()),
                (Some(a), Some(b)) => (a, b),
            };
            let by = b.time() - a.time();
            if !equal && by.abs() > SAME_INSTANT * a.time().abs() + 0.5 * gap(ours).min(gap(theirs)) {
                let early = if direction * by > 0.0 { &mut ours } else { &mut theirs };
                self.record_unmatched(name, direction, early[0].time());
                *early = &early[1..];
                continue;
            }
            if self.shift.as_ref().is_none_or(|most| by.abs() > most.by.abs()) {
                self.shift = Some(EventShift { name: name.into(), time: a.time(), by });
            }
            if a.before != a.after || b.before != b.after {
                self.between.push([a.time().min(b.time()), a.time().max(b.time())]);
            }
            (ours, theirs) = (&ours[1..], &theirs[1..]);
        }
    }

    fn record_unmatched(&mut self, name: &str, direction: f64, time: f64) {
        if self.unmatched.as_ref().is_none_or(|found| direction * (found.time - time) > 0.0) {
            self.unmatched = Some(EventShift { name: name.into(), time, by: f64::NAN });
        }
    }
}
