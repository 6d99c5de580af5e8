//! Stiffness of a motion whose steps do not show it.
//!
//! Hairer's test finds steps at the border of stability; runs that choose their method by themselves try implicit steps that pass over it (`run/stiffness.rs`). A method that was asked for, at small tolerances, does neither: its
//! error estimate, which grows as a high power of h λ, holds the steps inside the border, and takes a hundred times as many as the motion needs. So implicit steps are tried here, too, from some states of the motion. Where they
//! are permitted, and a step of the method itself of a fifth of their length is not, which tells from steps that were asked to be short, the motion is stiff for it. Lengths are those that steps have
//! on average thereabouts: where rounding decides what the error estimate says, as below 1e-12, one is nothing like the next.

use super::driver::Driver;
use super::query::Motion;
use super::run::longer;
use super::simulate::Simulate;
use crate::integrate::Step;
use crate::methods::Radau5;
use crate::model::{ModelState as _, Vector};

/// Shorter runs have nothing to gain: an implicit step takes as long as two or three of theirs.
const STEPS: usize = 120;
/// Places that are looked at, and in how many of them it has to be so.
const PLACES: usize = 5;
const IN_MOST: usize = 4;
/// Steps on either side of a place that tell how long they are there.
const BESIDE: usize = 25;
/// What the method itself cannot make, as a part of the implicit step: at four lengths stability has it fail that holds its steps at a half of the border.
const OWN: f64 = 0.2;
/// Implicit steps that are longer by these factors are tried, too: rounding may hold steps far inside the border.
const MORE: [f64; 3] = [1.0, 5.0, 25.0];
impl<M: Simulate> Motion<'_, M> {
    /// The first place at which implicit steps pass over what keeps those of its method short.
    pub(super) fn crawls(&self) -> Option<f64> {
        let records = &self.trajectory.records;
        if records.len() < STEPS {
            return None;
        }
        let longer = longer(M::Vector::LEN);
        let places = (1..=PLACES).map(|k| k * records.len() / (PLACES + 1));
        let found = places.filter(|&index| self.passes_over(index, longer)).map(|index| records[index].state.t());
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
                let own = self.trajectory.driver_of(index).map(|driver| driver.maker());
                let own = own.and_then(|mut own| own.end_of(&mut self.plant(index), &tried(OWN * h), tolerances));
                let mut implicit = Driver::<M>::maker(&Radau5);
                !keeps(own) && keeps(implicit.end_of(&mut self.plant(index), &tried(h), tolerances))
            })
    }

    /// How long steps are about a place, on average.
    fn usual(&self, index: usize) -> f64 {
        let records = &self.trajectory.records;
        let beside = &records[index.saturating_sub(BESIDE)..(index + BESIDE).min(records.len() - 1)];
        beside.iter().map(|record| record.h.abs()).sum::<f64>() / beside.len() as f64
    }
}
