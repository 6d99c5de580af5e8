//! A method as a run calls it: one table of functions per model and method that the program names.

use alloc::boxed::Box;
use alloc::sync::Arc;
use alloc::vec::Vec;
use core::ops::Range;

use super::plant::Plant;
use super::query::{Motion, Sampler};
use super::record::Counts;
use super::run::{Ended, Halt, Plan, Sink, run};
use super::simulate::Simulate;
use crate::integrate::{Dense, Method, Phase, Scheme, Step, Stepper, Tolerances};
use crate::methods::{Choice, Suits};
use crate::model::Model;

/// The interpolant of one step, of whatever method.
pub(crate) type Interpolant<V> = Box<dyn Dense<V> + Send + Sync>;

pub(crate) trait Driver<M: Model>: Send + Sync {
    fn method(&self) -> Method;
    /// Whether it estimates its error, and so can choose its step.
    fn is_adaptive(&self) -> bool;
    /// Whether it needs the motion's Taylor series.
    fn needs_series(&self) -> bool;
    /// What models it is for.
    fn suits(&self) -> Suits;
    /// See [`Choice::option`].
    fn option(&self, constrained: bool) -> Option<(&'static str, f64, bool, &'static str)>;
    /// Runs a plan. What was computed before a failure is in the sink.
    fn run(&self, plan: &mut Plan<'_, '_, M>, sink: &mut dyn Sink<M>) -> (Counts, Result<Ended<M::State>, Halt>)
    where
        M: Simulate;
    /// What makes steps again.
    fn maker(&self) -> Box<dyn Maker<M>>
    where
        M: Simulate;
    /// Where the step with this start, size and upkeep ends; `None` where that fails.
    fn follow(
        &self,
        plant: &mut Plant<'_, '_, M>,
        step: &Step<M::Vector>,
        tolerances: &Tolerances,
    ) -> Option<Phase<M::Vector>>
    where
        M: Simulate;
    /// See [`Motion::halve`].
    fn halve(
        &self,
        motion: &Motion<'_, M>,
        part: Range<usize>,
        y: &mut Phase<M::Vector>,
        apart: &mut Vec<(f64, f64)>,
    ) -> Option<()>
    where
        M: Simulate;
    /// Adds the work done during the step that leaves a record; false where it cannot be made again. The sampler is of the same motion.
    fn meter(&self, sampler: &mut Sampler<'_, '_, M>, index: usize, work: &mut [f64]) -> bool
    where
        M: Simulate;
}

/// Makes steps of a motion again, one after the other: implicit methods remember their matrices from one to the next.
pub(crate) trait Maker<M: Simulate>: Send + Sync {
    /// The interpolant of a step, which is made again where its ends do not tell; `None` where that fails.
    fn interpolate(
        &mut self,
        plant: &mut Plant<'_, '_, M>,
        step: &Step<M::Vector>,
        tolerances: &Tolerances,
    ) -> Option<Interpolant<M::Vector>>;
}

struct Again<S>(S);

impl<M: Simulate, S: Scheme<M::Vector> + Send + Sync> Maker<M> for Again<S> {
    fn interpolate(
        &mut self,
        plant: &mut Plant<'_, '_, M>,
        step: &Step<M::Vector>,
        tolerances: &Tolerances,
    ) -> Option<Interpolant<M::Vector>> {
        let dense = Stepper::again(&mut self.0, plant, step, tolerances).ok()??;
        Some(Box::new(dense))
    }
}

/// Quarters, as where positions are solved: see `Motion::work`.
const PARTS_OF_LONG_STEPS: u32 = 4;

pub(crate) type AnyDriver<M> = Arc<dyn Driver<M>>;

impl<M: Model, C: Choice> Driver<M> for C {
    fn method(&self) -> Method {
        <C::Scheme<M::Vector> as Scheme<M::Vector>>::METHOD
    }

    fn is_adaptive(&self) -> bool {
        <C::Scheme<M::Vector> as Scheme<M::Vector>>::CONTROL.is_some()
    }

    fn needs_series(&self) -> bool {
        C::NEEDS_SERIES
    }

    fn suits(&self) -> Suits {
        C::SUITS
    }

    fn option(&self, constrained: bool) -> Option<(&'static str, f64, bool, &'static str)> {
        Choice::option(self, constrained)
    }

    fn run(&self, plan: &mut Plan<'_, '_, M>, sink: &mut dyn Sink<M>) -> (Counts, Result<Ended<M::State>, Halt>)
    where
        M: Simulate,
    {
        run(self.scheme::<M::Vector>(), plan, sink)
    }

    fn maker(&self) -> Box<dyn Maker<M>>
    where
        M: Simulate,
    {
        Box::new(Again(self.scheme::<M::Vector>()))
    }

    fn follow(
        &self,
        plant: &mut Plant<'_, '_, M>,
        step: &Step<M::Vector>,
        tolerances: &Tolerances,
    ) -> Option<Phase<M::Vector>>
    where
        M: Simulate,
    {
        Stepper::end_of(&mut self.scheme::<M::Vector>(), plant, step, tolerances).ok().flatten().map(|(end, _)| end)
    }

    fn halve(
        &self,
        motion: &Motion<'_, M>,
        part: Range<usize>,
        y: &mut Phase<M::Vector>,
        apart: &mut Vec<(f64, f64)>,
    ) -> Option<()>
    where
        M: Simulate,
    {
        motion.halve(self.scheme::<M::Vector>(), part, y, apart)
    }

    fn meter(&self, sampler: &mut Sampler<'_, '_, M>, index: usize, work: &mut [f64]) -> bool
    where
        M: Simulate,
    {
        let motion = sampler.motion();
        if <C::Scheme<M::Vector> as Scheme<M::Vector>>::WEIGHTS.is_empty() {
            // Five nodes are exact up to degree nine: enough for what the quintics of implicit methods make of powers. Series have higher orders, and longer steps.
            let long = <C::Scheme<M::Vector> as Scheme<M::Vector>>::SCAN > 8;
            sampler.meter_by_quadrature(index, if long { PARTS_OF_LONG_STEPS } else { 1 }, work)
        } else if motion.step(index).kept.between {
            // Its stages are off by what was taken back at its end, and so are their reactions; states between are settled.
            sampler.meter_by_quadrature(index, PARTS_OF_LONG_STEPS, work)
        } else {
            motion.meter_by_stages(self.scheme::<M::Vector>(), index, work)
        }
    }
}
