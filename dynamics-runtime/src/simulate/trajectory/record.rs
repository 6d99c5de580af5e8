//! The record of a run: accepted steps, events and counts.

use alloc::string::String;
use alloc::sync::Arc;
use alloc::vec::Vec;
use core::time::Duration;

use crate::integrate::{Direction, Phase, Step, StepFlags, StepNode, Tolerances};
use crate::model::{ActiveSet, Model, ModelState, Vector};
use crate::simulate::erased_method::SharedMethod;
use crate::simulate::events::action::Impact;
use crate::simulate::options::formulation::Formulation;
use crate::simulate::stabilization::StabilizationCounts;
use crate::simulate::trajectory::global_error::GlobalError;

/// An accepted state and the step that leaves it.
pub(crate) struct Record<M: Model> {
    /// With the inputs that are held there. Those of a closure are computed again on demand.
    pub(crate) state: M::State,
    pub(crate) accelerations: M::Vector,
    /// Size of the step from here to the next record; 0 where none leaves: at a reset and at the end.
    pub(crate) h: f64,
    /// How that step was projected and on which branches, so that it can be made again.
    pub(crate) flags: StepFlags,
    /// Mean sensitivity of the projections before this step. It determines which states of the step were
    /// projected, and are projected when it is made again.
    pub(crate) mean_sensitivity: Option<f64>,
    /// Time constant in which adaptive Baumgarte gains took back drift; 0 with other formulations.
    pub(crate) correction_time: f64,
}

// By hand, because a derive would ask the same of the model.
impl<M: Model> Clone for Record<M> {
    fn clone(&self) -> Self {
        *self
    }
}

impl<M: Model> Copy for Record<M> {}

impl<M: Model> Record<M> {
    pub(crate) fn new(knot: &StepNode<M::Vector>, held: M::Inputs, active_set: ActiveSet) -> Self {
        let mut state = M::State::new(knot.t, knot.y.q, knot.y.u, held);
        *state.active_set_mut() = active_set;
        Self {
            state,
            accelerations: knot.a,
            h: 0.0,
            flags: StepFlags::default(),
            mean_sensitivity: None,
            correction_time: 0.0,
        }
    }

    /// Where a step starts.
    pub(crate) fn of(
        step: &Step<M::Vector>,
        held: M::Inputs,
        active_set: ActiveSet,
        (mean_sensitivity, correction_time): (Option<f64>, f64),
    ) -> Self {
        Self {
            h: step.h,
            flags: step.flags,
            mean_sensitivity,
            correction_time,
            ..Self::new(&step.start, held, active_set)
        }
    }

    /// A start where nothing could be evaluated.
    pub(crate) fn unmoved(start: M::State) -> Self {
        let mut unknown = M::Vector::zeros();
        unknown.as_mut_slice().fill(f64::NAN);
        Self {
            state: start,
            accelerations: unknown,
            h: 0.0,
            flags: StepFlags::default(),
            mean_sensitivity: None,
            correction_time: 0.0,
        }
    }

    pub(crate) fn knot(&self) -> StepNode<M::Vector> {
        StepNode {
            t: self.state.t(),
            y: Phase { q: *self.state.q(), u: *self.state.u() },
            a: self.accelerations,
        }
    }
}

/// A located event.
#[derive(Clone, Debug, PartialEq)]
pub struct EventRecord<S> {
    /// The event's name.
    pub name: String,
    /// Index of the event: the model's own in their order, then those declared with `.event(..)`.
    pub index: usize,
    /// Rising or falling along the motion.
    pub direction: Direction,
    /// The state just before.
    pub before: S,
    /// The state just after; differs where a reset changed it.
    pub after: S,
    /// Impacts on constraints; those that are hit at the same instant are hit together and listed at the
    /// first of their events.
    pub impacts: Vec<Impact>,
    /// Whether the simulation ended here.
    pub stopped: bool,
}

impl<S: ModelState> EventRecord<S> {
    /// When it happened.
    #[must_use]
    pub fn time(&self) -> f64 {
        self.before.t()
    }

    /// Energy that the moving bodies lost in impacts: energy function before less after. What a moving
    /// constraint gives to them while it strikes is subtracted, so that this is not ½(1 − e²) of the
    /// relative motion there.
    #[must_use]
    pub fn energy_lost(&self) -> f64 {
        // Of no impacts the standard library's sum is -0.
        self.impacts.iter().fold(0.0, |lost, impact| lost + impact.energy_lost)
    }
}

/// What a run cost.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Counts {
    /// Accepted steps.
    pub steps: u64,
    /// Rejected steps.
    pub rejected: u64,
    /// Evaluations of the accelerations.
    pub evaluations: u64,
    /// Time the run took; `None` without the standard library.
    pub wall_time: Option<Duration>,
    /// When the problem was first found stiff for the method.
    pub stiff_at: Option<f64>,
    /// When the motion was first found to slide along a place where accelerations jump: they lead to it from
    /// both sides.
    pub slides_at: Option<f64>,
    /// How many fixed steps were made in parts, to go round positions where constraints nearly lose rank, and
    /// when the first began.
    pub subdivided_steps: (u64, Option<f64>),
}

/// A run without its model: everything that an error can carry.
pub(crate) struct Trajectory<M: Model> {
    /// `None` where positions were solved instead of integrated.
    pub(crate) erased_method: Option<SharedMethod<M>>,
    /// The method that went on from a time at which the motion was stiff for the first one.
    pub(crate) relay: Option<(f64, SharedMethod<M>)>,
    pub(crate) reason: String,
    pub(crate) tolerances: Tolerances,
    /// Its steps were as long as was asked for, and not as long as the tolerances permit.
    pub(crate) fixed: bool,
    /// In the order of the motion; never empty.
    pub(crate) records: Vec<Record<M>>,
    pub(crate) output_times: Option<Vec<f64>>,
    pub(crate) events: Vec<EventRecord<M::State>>,
    pub(crate) counts: Counts,
    pub(crate) has_law: bool,
    /// How constraints were kept, and why so.
    pub(crate) formulation: Option<(Formulation, String)>,
    pub(crate) stabilization: StabilizationCounts,
    /// Events whose functions constraints held at zero.
    pub(crate) masked_events: Vec<String>,
    /// States between steps are put onto the constraints.
    pub(crate) consistent: bool,
    /// Its error, where a second run estimated it.
    pub(crate) error: Option<Arc<GlobalError>>,
}

impl<M: Model> Clone for Trajectory<M> {
    fn clone(&self) -> Self {
        Self {
            erased_method: self.erased_method.clone(),
            relay: self.relay.clone(),
            reason: self.reason.clone(),
            masked_events: self.masked_events.clone(),
            formulation: self.formulation.clone(),
            records: self.records.clone(),
            output_times: self.output_times.clone(),
            events: self.events.clone(),
            error: self.error.clone(),
            ..*self
        }
    }
}

impl<M: Model> Trajectory<M> {
    pub(crate) fn first(&self) -> &Record<M> {
        &self.records[0]
    }

    pub(crate) fn last(&self) -> &Record<M> {
        &self.records[self.records.len() - 1]
    }

    /// The method that made the step which leaves a record; `None` where positions were solved instead of
    /// integrated.
    pub(crate) fn erased_method_of(&self, index: usize) -> Option<&SharedMethod<M>> {
        let after = |(from, _): &&(f64, SharedMethod<M>)| {
            (self.records[index].state.t() - from) * self.direction() >= 0.0
        };
        self.relay
            .as_ref()
            .filter(after)
            .map(|(_, erased_method)| erased_method)
            .or(self.erased_method.as_ref())
    }

    /// +1 forwards, −1 backwards in time.
    pub(crate) fn direction(&self) -> f64 {
        if self.last().state.t() < self.first().state.t() { -1.0 } else { 1.0 }
    }

    /// Index of the last record at or before t along the motion, `None` outside. A time that misses an end by
    /// rounding alone (8 units in the last place) belongs to the end.
    pub(crate) fn find(&self, t: f64) -> Option<usize> {
        let direction = self.direction();
        let (start, end) = (self.first().state.t(), self.last().state.t());
        let slack = 8.0 * f64::EPSILON * start.abs().max(end.abs());
        let inside = direction * (t - start) >= -slack && direction * (end - t) >= -slack;
        inside.then(|| {
            let after = self.records.partition_point(|r| direction * (r.state.t() - t) <= 0.0);
            after.saturating_sub(1)
        })
    }
}
