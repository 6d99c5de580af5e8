//! Stiffness of a motion whose steps do not show it.
//!
//! Hairer's test finds steps at the border of stability; runs that choose their method by themselves try
//! implicit steps that pass over it (`run/stiffness_detection.rs`). A method that was asked for, at small
//! tolerances, does neither: its error estimate, which grows as a high power of h λ, holds the steps inside
//! the border, and takes a hundred times as many as the motion needs. So implicit steps are tried here, too,
//! from some states of the motion. Where they are permitted, and a step of the method itself of a fifth of
//! their length is not, which tells from steps that were asked to be short, the motion is stiff for it.
//! Lengths are those that steps have on average thereabouts: where rounding decides what the error estimate
//! says, as below 1e-12, one is nothing like the next.

use crate::integrate::choice::Radau5;
use crate::integrate::{Accelerations as _, Phase, Step, StepNode, zip};
use crate::model::{ModelState as _, SimulationModel, Vector};
use crate::simulate::erased_method::ErasedMethod;
use crate::simulate::run::monitors::stiffness_detection::worthwhile_factor;
use crate::simulate::trajectory::motion::Motion;

/// Shorter runs have nothing to gain: an implicit step takes as long as two or three of theirs.
const STEPS: usize = 120;
/// Places that are looked at, and in how many of them it has to be so.
const PLACES: usize = 5;
const IN_MOST: usize = 4;
/// Steps on either side of a place that tell how long they are there.
const BESIDE: usize = 25;
/// What the method itself cannot make, as a part of the implicit step: at four lengths stability has it fail
/// that holds its steps at a half of the border.
const OWN: f64 = 0.2;
/// Implicit steps that are longer by these factors are tried, too: rounding may hold steps far inside the
/// border.
const MORE: [f64; 3] = [1.0, 5.0, 25.0];
/// Permitted errors by which a motion has to change for steps to prove that they follow it.
const MOVES: f64 = 100.0;
/// Permitted errors by which an implicit step may miss the motion, whose own errors add up.
const FOLLOWS: f64 = 30.0;
/// What is left of a difference where it dies.
const DIES: f64 = 0.1;
/// How large that is at first, in parts of 1 + |value|, and how many steps it is followed for at most.
const NEAR: f64 = 1e-8;
const MOST: usize = 200;
/// An implicit step of n coordinates takes as long as so many evaluations of the accelerations for the square
/// of n: 18,000 of a chain of 45 masses.
const IMPLICIT: u64 = 9;
/// All trials take no longer than so many evaluations for each of the run, or than this many, which is a
/// tenth of a second at most.
const EFFORT: (u64, u64) = (3, 300_000);

impl<M: SimulationModel> Motion<'_, M> {
    /// Whether it has so many steps that fewer would be a gain.
    pub(crate) fn could_crawl(&self) -> bool {
        self.trajectory.records.len() >= STEPS
    }

    /// Whether implicit steps may be tried without taking much longer than the run did.
    pub(crate) fn affords_implicit_steps(&self) -> bool {
        let n = M::Vector::LEN as u64;
        let trials = (PLACES * MORE.len()) as u64;
        trials * IMPLICIT * n * n <= (EFFORT.0 * self.counts().evaluations).max(EFFORT.1)
    }

    /// The first place at which implicit steps pass over what keeps those of its method short.
    pub(crate) fn hidden_stiffness(&self) -> Option<f64> {
        if !self.could_crawl() {
            return None;
        }
        let records = &self.trajectory.records;
        let longer = worthwhile_factor(M::Vector::LEN);
        let places = (1..=PLACES).map(|k| k * records.len() / (PLACES + 1));
        let found =
            places.filter(|&index| self.passes_over(index, longer)).map(|index| records[index].state.t());
        let found: alloc::vec::Vec<f64> = found.collect();
        found.first().copied().filter(|_| found.len() >= IN_MOST)
    }

    fn passes_over(&self, index: usize, longer: f64) -> bool {
        let step = self.step(index);
        let left = (self.end_time() - step.start.t).abs();
        let tolerances = &self.trajectory.tolerances;
        let keeps = |end: Option<(_, f64)>| end.is_some_and(|(_, error)| error <= 1.0);
        let lengths = MORE.map(|more| more * longer * self.usual(index));
        step.h != 0.0
            && lengths.into_iter().filter(|h| *h <= left).any(|h| {
                let tried = |h: f64| Step { end: step.start, h: h.copysign(step.h), ..step };
                let own =
                    self.trajectory.erased_method_of(index).map(|erased_method| erased_method.step_replay());
                let own =
                    own.and_then(|mut own| own.end_of(&mut self.rhs(index), &tried(OWN * h), tolerances));
                let mut implicit = ErasedMethod::<M>::step_replay(&Radau5);
                !keeps(own)
                    && self.follows(index, h, implicit.end_of(&mut self.rhs(index), &tried(h), tolerances))
                    && (self.moves(index, h) || self.forgets(index, h))
            })
    }

    /// Whether an implicit step is permitted and ends where the motion goes, as far as its records tell: an
    /// error estimate that damps what is fast sees nothing of a swing that is stepped over.
    fn follows(&self, index: usize, h: f64, end: Option<(Phase<M::Vector>, f64)>) -> bool {
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
        error <= 1.0 && near[0].min(near[1]) <= FOLLOWS + within
    }

    /// Whether the motion moves by more than is permitted in that time: of what hardly moves any step keeps
    /// the tolerance.
    fn moves(&self, index: usize, h: f64) -> bool {
        let records = &self.trajectory.records;
        let here = records[index].knot();
        let within = records[index..].iter().take_while(|record| (record.state.t() - here.t).abs() <= h);
        within.map(|record| self.most_permitted_errors(&record.knot().y, &here.y)).fold(0.0, f64::max) > MOVES
    }

    /// Whether differences die within that time, as they do where a motion is stiff; in quarters of its
    /// steps, as whole ones may damp what swings.
    fn forgets(&self, index: usize, h: f64) -> bool {
        let (step, tolerances) = (self.step(index), &self.trajectory.tolerances);
        let Some(mut step_replay) =
            self.trajectory.erased_method_of(index).map(|erased_method| erased_method.step_replay())
        else {
            return false;
        };
        let (mut rhs, part) = (self.rhs(index), (0.25 * self.usual(index)).copysign(step.h));
        let mut next = |at: &StepNode<M::Vector>| {
            let step = Step { start: *at, end: *at, h: part, ..step };
            let (y, _) = step_replay.end_of(&mut rhs, &step, tolerances)?;
            Some(StepNode { t: at.t + part, y, a: rhs.accelerations(at.t + part, &y.q, &y.u).ok()? })
        };
        let (mut at, mut beside) = (step.start, step.start);
        for values in [&mut beside.y.q, &mut beside.y.u] {
            values.as_mut_slice().iter_mut().for_each(|x| *x += NEAR * (1.0 + x.abs()));
        }
        let apart = |at: &StepNode<M::Vector>, beside: &StepNode<M::Vector>| {
            tolerances.norm(&zip(&at.y, &beside.y, |a, b| a - b), &at.y, &at.y)
        };
        let before = apart(&at, &beside);
        for _ in 0..((h / part.abs()) as usize).min(MOST) {
            let (Some(one), Some(other)) = (next(&at), next(&beside)) else { return false };
            (at, beside) = (one, other);
            if apart(&at, &beside) < DIES * before {
                return true;
            }
        }
        false
    }

    /// How long steps are about a place, on average.
    fn usual(&self, index: usize) -> f64 {
        let records = &self.trajectory.records;
        let beside = &records[index.saturating_sub(BESIDE)..(index + BESIDE).min(records.len() - 1)];
        beside.iter().map(|record| record.h.abs()).sum::<f64>() / beside.len() as f64
    }
}
