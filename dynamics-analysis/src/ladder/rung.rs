//! One model of a ladder: a rung with its start and its outputs.

use alloc::boxed::Box;
use alloc::string::{String, ToString};
use alloc::vec::Vec;
use core::time::Duration;

use dynamics_runtime::model::{ModelState, Vector};
use dynamics_runtime::simulate::{Counts, Motion, Simulate, Simulation};
use dynamics_view::suggest;

use super::error::LadderError;
use crate::runs::{self, check_end, first_line};

/// An output by a closure.
type Output<'m, M> = Box<dyn Fn(&Motion<'m, M>, &<M as dynamics_runtime::model::Model>::State) -> f64 + 'm>;
/// Options of a simulation.
type RungSetup<'m, M> = Box<dyn Fn(Simulation<'m, M>) -> Simulation<'m, M> + 'm>;

/// A model of a scene, with its start and its outputs.
#[must_use = "a rung does nothing until it is part of a ladder"]
pub struct Rung<'m, M: Simulate> {
    name: String,
    model: &'m M,
    start: M::State,
    outputs: Vec<(String, Output<'m, M>)>,
    options: Option<RungSetup<'m, M>>,
}

impl<'m, M: Simulate> Rung<'m, M> {
    /// A model with the start that corresponds to those of the others. Its outputs are those that it declares
    /// with `#[output]`.
    pub fn new(name: impl Into<String>, model: &'m M, start: M::State) -> Self {
        Self { name: name.into(), model, start, outputs: Vec::new(), options: None }
    }

    /// Adds an output as a function of motion and state, or replaces the one of this name: a coordinate (`|_,
    /// state| state.x()`), a multiplier (`|motion, state| motion.multipliers_of(state)[0]`).
    pub fn output(
        mut self,
        name: impl Into<String>,
        value: impl Fn(&Motion<'m, M>, &M::State) -> f64 + 'm,
    ) -> Self {
        self.outputs.push((name.into(), Box::new(value)));
        self
    }

    /// Options of its simulations: inputs, a method, a formulation, actions at events. The tolerance is that
    /// of the ladder.
    pub fn with(mut self, options: impl Fn(Simulation<'m, M>) -> Simulation<'m, M> + 'm) -> Self {
        self.options = Some(Box::new(options));
        self
    }

    fn simulation(&self, end: f64, tolerance: f64, short_steps: bool) -> Simulation<'m, M> {
        let simulation = self.model.simulate(self.start).until(end).tolerance(tolerance);
        let simulation =
            if short_steps { runs::with_short_steps(simulation, (self.start.t(), end)) } else { simulation };
        match &self.options {
            Some(options) => options(simulation),
            None => simulation,
        }
    }

    /// The closure of an output that was added; the last one of this name counts.
    fn closure(&self, output: &str) -> Option<&Output<'m, M>> {
        self.outputs.iter().rev().find(|(name, _)| name == output).map(|(_, value)| value)
    }
}

/// The size of a model.
pub(super) struct ModelSize {
    pub(super) coordinates: usize,
    pub(super) constraints: usize,
    pub(super) operations: Option<usize>,
}

/// A rung with its type of model erased.
pub(super) trait AnyRung {
    fn name(&self) -> &str;
    /// The time of its start.
    fn start(&self) -> f64;
    fn size(&self) -> ModelSize;
    /// The names of its outputs.
    fn outputs(&self) -> Vec<String>;
    /// The unit of an output; empty if it is not declared.
    fn unit(&self, output: &str) -> Result<&'static str, LadderError>;
    /// Runs it.
    fn run(
        &self,
        end: f64,
        tolerance: f64,
        short_steps: bool,
    ) -> Result<Box<dyn AnyMotion + '_>, LadderError>;
    /// The time of a run that keeps nothing.
    fn time(&self, end: f64, tolerance: f64) -> Option<Duration>;
}

/// The motion of a rung with its type of model erased.
pub(super) trait AnyMotion {
    fn counts(&self) -> Counts;
    /// The times of its steps.
    fn knots(&self) -> Vec<f64>;
    /// Values of outputs at times that follow each other; one list per output.
    fn sample(&self, times: &[f64], outputs: &[&str]) -> Result<Vec<Vec<f64>>, LadderError>;
}

/// The motion of a rung.
struct RungMotion<'a, 'm, M: Simulate> {
    rung: &'a Rung<'m, M>,
    motion: Motion<'m, M>,
}

impl<M: Simulate> AnyRung for Rung<'_, M> {
    fn name(&self) -> &str {
        &self.name
    }

    fn start(&self) -> f64 {
        self.start.t()
    }

    fn size(&self) -> ModelSize {
        ModelSize { coordinates: M::Vector::LEN, constraints: M::ROWS.len(), operations: M::OPERATIONS }
    }

    fn outputs(&self) -> Vec<String> {
        let mut names: Vec<String> = M::OUTPUTS.iter().map(|output| output.name.to_string()).collect();
        for (name, _) in &self.outputs {
            if !names.contains(name) {
                names.push(name.clone());
            }
        }
        names
    }

    fn unit(&self, output: &str) -> Result<&'static str, LadderError> {
        if self.closure(output).is_some() {
            return Ok("");
        }
        let declared = M::OUTPUTS.iter().find(|declared| declared.name == output);
        declared.map(|declared| declared.unit).ok_or_else(|| {
            let suggestion = suggest(output, self.outputs().iter().map(String::as_str));
            LadderError::UnknownOutput { rung: self.name.clone(), output: output.into(), suggestion }
        })
    }

    fn run(
        &self,
        end: f64,
        tolerance: f64,
        short_steps: bool,
    ) -> Result<Box<dyn AnyMotion + '_>, LadderError> {
        let failed = |reason: String| LadderError::Fails { rung: self.name.clone(), tolerance, reason };
        let motion =
            self.simulation(end, tolerance, short_steps).run().map_err(|error| failed(first_line(&error)))?;
        check_end(&motion.end(), end).map_err(failed)?;
        Ok(Box::new(RungMotion { rung: self, motion }))
    }

    fn time(&self, end: f64, tolerance: f64) -> Option<Duration> {
        runs::timed_run(self.simulation(end, tolerance, false)).map(|(time, _)| time)
    }
}

/// The source of the value of an output.
enum Source<'a, 'm, M: Simulate> {
    Closure(&'a Output<'m, M>),
    Declared(usize),
}

impl<M: Simulate> AnyMotion for RungMotion<'_, '_, M> {
    fn counts(&self) -> Counts {
        self.motion.counts()
    }

    fn knots(&self) -> Vec<f64> {
        self.motion.steps().map(|state| state.t()).collect()
    }

    fn sample(&self, times: &[f64], outputs: &[&str]) -> Result<Vec<Vec<f64>>, LadderError> {
        let source = |output: &&str| {
            let declared = || M::OUTPUTS.iter().position(|declared| declared.name == *output);
            let added = self.rung.closure(output).map(Source::Closure);
            added.or_else(|| declared().map(Source::Declared)).expect("every rung has every output")
        };
        let sources: Vec<Source<'_, '_, M>> = outputs.iter().map(source).collect();
        let asks_model = sources.iter().any(|source| matches!(source, Source::Declared(_)));
        let mut values = alloc::vec![Vec::with_capacity(times.len()); outputs.len()];
        let mut sampler = self.motion.sampler();
        for &t in times {
            let state = sampler.at(t);
            let declared = if asks_model { self.motion.outputs_of(&state) } else { Vec::new() };
            for ((source, values), output) in sources.iter().zip(&mut values).zip(outputs) {
                let value = match source {
                    Source::Closure(value) => value(&self.motion, &state),
                    Source::Declared(index) => declared[*index],
                };
                if !value.is_finite() {
                    let (rung, output) = (self.rung.name.clone(), (*output).to_string());
                    return Err(LadderError::NotFinite { rung, output, time: t, value });
                }
                values.push(value);
            }
        }
        Ok(values)
    }
}
