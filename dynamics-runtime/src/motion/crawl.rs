//! Stiffness of a motion whose steps do not show it.
//!
//! Hairer's test finds steps at the border of stability; runs that choose their method by themselves try implicit steps that pass over it (`run/stiffness.rs`). A method that was asked for, at small tolerances, does neither: its
//! error estimate, which grows as a high power of h λ, holds the steps inside the border, and takes a hundred times as many as the motion needs. So implicit steps are tried here, too, from some states of the motion. Where they
//! are permitted, and one step of the method itself of twice the length is not, which tells from steps that were asked to be short, the motion is stiff for it.

use super::driver::Driver;
use super::query::Motion;
use super::simulate::Simulate;
use crate::integrate::Step;
use crate::methods::Radau5;
use crate::model::{ModelState as _, Vector};

/// Shorter runs have nothing to gain.
const STEPS: usize = 500;
/// Places that are looked at, and in how many of them it has to be so.
const PLACES: usize = 5;
const IN_MOST: usize = 4;
/// Implicit steps so many times as long are worth their while, as in `run/stiffness.rs`.
const LONGER: (f64, f64) = (20.0, 0.02);

impl<M: Simulate> Motion<'_, M> {
    /// The first place at which implicit steps pass over what keeps those of its method short.
    pub(super) fn crawls(&self) -> Option<f64> {
        let records = &self.trajectory.records;
        if records.len() < STEPS {
            return None;
        }
        let n = M::Vector::LEN as f64;
        let longer = LONGER.0 + LONGER.1 * n * n;
        let places = (1..=PLACES).map(|k| k * records.len() / (PLACES + 1));
        let found = places.filter(|&index| self.passes_over(index, longer)).map(|index| records[index].state.t());
        let found: alloc::vec::Vec<f64> = found.collect();
        found.first().copied().filter(|_| found.len() >= IN_MOST)
    }

    fn passes_over(&self, index: usize, longer: f64) -> bool {
        let step = self.step(index);
        let left = (self.end_time() - step.start.t).abs();
        if step.h == 0.0 || longer * step.h.abs() > left {
            return false;
        }
        let tolerances = &self.trajectory.tolerances;
        let tried = |times: f64| Step { end: step.start, h: times * step.h, ..step };
        let own = self.trajectory.driver_of(index).map(|driver| driver.maker());
        let own = own.and_then(|mut own| own.end_of(&mut self.plant(index), &tried(2.0), tolerances));
        let keeps = |end: Option<(_, f64)>| end.is_some_and(|(_, error)| error <= 1.0);
        let mut implicit = Driver::<M>::maker(&Radau5);
        !keeps(own) && keeps(implicit.end_of(&mut self.plant(index), &tried(longer), tolerances))
    }
}
