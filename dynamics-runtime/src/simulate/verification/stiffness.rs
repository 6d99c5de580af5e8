//! Stiffness of a motion whose steps do not show it.
//!
//! Hairer's test finds steps at the border of stability, and runs that choose their method try implicit steps
//! that pass over it (`run/monitors/stiffness_detection.rs`). A method that the user chose, at small
//! tolerances, does neither. Its error estimate, which grows as a high power of h λ, keeps the steps inside
//! the border, and takes a hundred times as many as the motion needs. So implicit steps are tried here from
//! some states of the motion. The motion is stiff for its method where such steps are permitted, and a step
//! of the method of a fifth of their length is not. The second condition excludes steps that were asked to be
//! short. Lengths are averages of the steps nearby, because below 1e-12 rounding determines the error
//! estimates.

use crate::integrate::choice::Radau5;
use crate::integrate::{Accelerations as _, Phase, Step, StepNode, zip};
use crate::model::{ModelState as _, SimulationModel, Vector};
use crate::simulate::erased_method::ErasedMethod;
use crate::simulate::run::monitors::stiffness_detection::worthwhile_factor;
use crate::simulate::trajectory::motion::Motion;

/// Runs with fewer steps have nothing to gain: an implicit step takes as long as two or three of theirs.
const MIN_STEPS: usize = 120;
/// Number of states that are examined, and of those that must be stiff.
const PLACES: usize = 5;
const REQUIRED_PLACES: usize = 4;
/// Steps on either side of a state over which lengths are averaged.
const AVERAGED_STEPS: usize = 25;
/// Part of the implicit step that the method itself must fail to make. Four times its own length makes a
/// method unstable that keeps its steps at half of the border.
const OWN_STEP_SHARE: f64 = 0.2;
/// Factors of the length of implicit steps that are tried: rounding may keep steps far inside the border.
const IMPLICIT_STEP_FACTORS: [f64; 3] = [1.0, 5.0, 25.0];
/// Permitted errors by which the motion must change within an implicit step, for that step to show that it
/// follows.
const MIN_MOTION: f64 = 100.0;
/// Permitted errors by which the end of an implicit step may differ from the motion, which has accumulated
/// errors.
const MAX_IMPLICIT_ERROR: f64 = 30.0;
/// A difference has decayed where it is below this part of its start.
const DECAYED_SHARE: f64 = 0.1;
/// Size of the difference at first, in parts of 1 + |value|, and most steps for which it is followed.
const PERTURBATION: f64 = 1e-8;
const MAX_DECAY_STEPS: usize = 200;
/// An implicit step of n coordinates takes as long as so many evaluations of the accelerations for the square
/// of n: 18,000 of a chain of 45 masses.
const EVALUATIONS_PER_IMPLICIT_STEP: u64 = 9;
/// All trials take no longer than so many evaluations for each of the run, or than this many, which is a
/// tenth of a second at most.
const MAX_EVALUATIONS: (u64, u64) = (3, 300_000);

impl<M: SimulationModel> Motion<'_, M> {
    /// Whether the run has so many steps that fewer would be a gain.
    pub(crate) fn has_many_steps(&self) -> bool {
        self.trajectory.records.len() >= MIN_STEPS
    }

    /// Whether trying implicit steps takes about as long as the run at most.
    pub(crate) fn affords_implicit_steps(&self) -> bool {
        let n = M::Vector::LEN as u64;
        let trials = (PLACES * IMPLICIT_STEP_FACTORS.len()) as u64;
        trials * EVALUATIONS_PER_IMPLICIT_STEP * n * n
            <= (MAX_EVALUATIONS.0 * self.counts().evaluations).max(MAX_EVALUATIONS.1)
    }

    /// The first time at which the motion is stiff for its method, if it is in most of the examined states.
    pub(crate) fn hidden_stiffness(&self) -> Option<f64> {
        if !self.has_many_steps() {
            return None;
        }
        let records = &self.trajectory.records;
        let longer = worthwhile_factor(M::Vector::LEN);
        let places = (1..=PLACES).map(|k| k * records.len() / (PLACES + 1));
        let found = places
            .filter(|&index| self.implicit_steps_pass(index, longer))
            .map(|index| records[index].state.t());
        let found: alloc::vec::Vec<f64> = found.collect();
        found.first().copied().filter(|_| found.len() >= REQUIRED_PLACES)
    }

    /// Whether an implicit step is permitted where the method's own steps have to be far shorter.
    fn implicit_steps_pass(&self, index: usize, longer: f64) -> bool {
        let step = self.step(index);
        let left = (self.end_time() - step.start.t).abs();
        let tolerances = &self.trajectory.tolerances;
        let is_permitted = |end: Option<(_, f64)>| end.is_some_and(|(_, error)| error <= 1.0);
        let lengths = IMPLICIT_STEP_FACTORS.map(|more| more * longer * self.average_step(index));
        step.h != 0.0
            && lengths.into_iter().filter(|h| *h <= left).any(|h| {
                let tried = |h: f64| Step { end: step.start, h: h.copysign(step.h), ..step };
                let own =
                    self.trajectory.erased_method_of(index).map(|erased_method| erased_method.step_replay());
                let own = own.and_then(|mut own| {
                    own.end_of(&mut self.rhs(index), &tried(OWN_STEP_SHARE * h), tolerances)
                });
                let mut implicit = ErasedMethod::<M>::step_replay(&Radau5);
                !is_permitted(own)
                    && self.ends_on_motion(
                        index,
                        h,
                        implicit.end_of(&mut self.rhs(index), &tried(h), tolerances),
                    )
                    && (self.moves_enough(index, h) || self.differences_decay(index, h))
            })
    }

    /// Whether an implicit step is permitted and ends where the motion goes, as far as its records tell: an
    /// error estimate that damps what is fast sees nothing of a swing that is stepped over.
    fn ends_on_motion(&self, index: usize, h: f64, end: Option<(Phase<M::Vector>, f64)>) -> bool {
        let Some((y, error)) = end else { return false };
        let (records, to) =
            (&self.trajectory.records, self.step(index).start.t + h.copysign(self.step(index).h));
        let direction = self.trajectory.direction();
        let next = records
            .partition_point(|record| (record.state.t() - to) * direction < 0.0)
            .clamp(1, records.len() - 1);
        // Between its ends, so that one of them is as near as any place of the step.
        let near = [next - 1, next].map(|k| self.most_permitted_errors(&y, &records[k].knot().y));
        let within = self.most_permitted_errors(&records[next - 1].knot().y, &records[next].knot().y);
        error <= 1.0 && near[0].min(near[1]) <= MAX_IMPLICIT_ERROR + within
    }

    /// Whether the motion changes enough in that time. Where it hardly moves any step keeps the tolerance.
    fn moves_enough(&self, index: usize, h: f64) -> bool {
        let records = &self.trajectory.records;
        let here = records[index].knot();
        let within = records[index..].iter().take_while(|record| (record.state.t() - here.t).abs() <= h);
        within.map(|record| self.most_permitted_errors(&record.knot().y, &here.y)).fold(0.0, f64::max)
            > MIN_MOTION
    }

    /// Whether differences decay within that time, as they do where a motion is stiff. They are followed in
    /// quarters of the steps, because whole ones may damp oscillations.
    fn differences_decay(&self, index: usize, h: f64) -> bool {
        let (step, tolerances) = (self.step(index), &self.trajectory.tolerances);
        let Some(mut step_replay) =
            self.trajectory.erased_method_of(index).map(|erased_method| erased_method.step_replay())
        else {
            return false;
        };
        let (mut rhs, part) = (self.rhs(index), (0.25 * self.average_step(index)).copysign(step.h));
        let mut next = |at: &StepNode<M::Vector>| {
            let step = Step { start: *at, end: *at, h: part, ..step };
            let (y, _) = step_replay.end_of(&mut rhs, &step, tolerances)?;
            Some(StepNode { t: at.t + part, y, a: rhs.accelerations(at.t + part, &y.q, &y.u).ok()? })
        };
        let (mut at, mut neighbour) = (step.start, step.start);
        for values in [&mut neighbour.y.q, &mut neighbour.y.u] {
            values.as_mut_slice().iter_mut().for_each(|x| *x += PERTURBATION * (1.0 + x.abs()));
        }
        let difference = |at: &StepNode<M::Vector>, neighbour: &StepNode<M::Vector>| {
            tolerances.norm(&zip(&at.y, &neighbour.y, |a, b| a - b), &at.y, &at.y)
        };
        let before = difference(&at, &neighbour);
        for _ in 0..((h / part.abs()) as usize).min(MAX_DECAY_STEPS) {
            let (Some(one), Some(other)) = (next(&at), next(&neighbour)) else { return false };
            (at, neighbour) = (one, other);
            if difference(&at, &neighbour) < DECAYED_SHARE * before {
                return true;
            }
        }
        false
    }

    /// Average length of the steps around a record.
    fn average_step(&self, index: usize) -> f64 {
        let records = &self.trajectory.records;
        let records_around =
            &records[index.saturating_sub(AVERAGED_STEPS)..(index + AVERAGED_STEPS).min(records.len() - 1)];
        records_around.iter().map(|record| record.h.abs()).sum::<f64>() / records_around.len() as f64
    }
}
