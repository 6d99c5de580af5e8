//! Error against cost: methods × tolerances on one motion, compared with a reference of known uncertainty.
//!
//! # What is measured
//!
//! *Error*: the largest |difference| of any coordinate (of any velocity, any multiplier; of the energy
//! function) from the reference at the end of the motion, in the unit of the coordinate: positions,
//! velocities, multipliers and energy apart, because their errors differ by orders of magnitude. *Time*: the
//! median of repeated runs that keep nothing ([`Simulation::run_with`]), in rounds over all runs, so that a
//! machine that changes its speed changes it for all of them. *Evaluations* of the accelerations: what does
//! not depend on the machine.
//!
//! # Which errors are significant
//!
//! The reference is the end of three runs: a method at a tolerance near rounding, the same method at ten
//! times that, and a second method of another family, none with steps longer than a five-hundredth of the
//! motion. Its uncertainty is twice the largest difference between any two of them, and no less than its
//! steps may round: three runs with the same steps round alike. Errors below it are not significant: their
//! markers are hollow, tables say `<`. The study returns an error if the uncertainty leaves fewer than three
//! digits, if a run of the reference fails, or if no run has a significant error. It also does so if two
//! methods agree on another end than the known one that was given. A run whose end differs when it is
//! repeated has failed.

mod advice;
mod error;
mod errors;
mod json_lines;
mod measure;
#[cfg(feature = "json")]
mod outside;
mod reference;
mod show;
mod study;
mod validity;

use alloc::boxed::Box;
use alloc::string::{String, ToString};
use alloc::vec::Vec;
use core::time::Duration;

pub use error::{OutsideError, WorkPrecisionError};
pub use errors::{ErrorOf, Errors};
pub use reference::Reference;
pub use study::{Cost, Point, RunMeasurement, Study, WorkPrecisionCurve};

use dynamics_runtime::methods::{Any, Dop853, Radau5, Tsit5, Verner9};
use dynamics_runtime::model::ModelState;
use dynamics_runtime::simulate::{Simulate, Simulation};

use crate::runs;

/// Options of simulations.
type StudyRunSetup<'m, M> = Box<dyn Fn(Simulation<'m, M>) -> Simulation<'m, M> + 'm>;

/// A method under a name.
struct Candidate<'m, M: Simulate> {
    name: String,
    /// `None`: the method that simulations choose by themselves.
    method: Option<Any<M>>,
    options: Option<StudyRunSetup<'m, M>>,
    /// Tolerances or steps of its own, instead of those of the study.
    settings: Option<Vec<f64>>,
}

impl<M: Simulate> Candidate<'_, M> {
    /// A method under its own name.
    fn named(method: Any<M>, settings: Option<Vec<f64>>) -> Self {
        Self { name: method.to_string(), method: Some(method), options: None, settings }
    }

    fn is_adaptive(&self) -> bool {
        self.method.as_ref().is_none_or(Any::is_adaptive)
    }
}

/// Name of the curve of the method that simulations choose.
const DEFAULT_METHOD: &str = "default method";

/// Negative decimal exponents of the tolerances unless they are set: from a sketch to all digits but one or
/// two.
const DEFAULT_TOLERANCE_DECADES: core::ops::RangeInclusive<i32> = 3..=13;

/// A study of methods on one motion, with its options, before it runs.
///
/// ```text
/// let study = model
///     .work_precision(start)
///     .until(10.0)
///     .methods([methods::Dop853.into(), methods::DormandPrince5.into()])
///     .tolerances([1e-4, 1e-6, 1e-8])
///     .run()?;
/// println!("{study}");
/// ```
#[must_use = "a study does nothing until `.run()`"]
pub struct WorkPrecision<'m, M: Simulate> {
    model: &'m M,
    start: M::State,
    end: Option<f64>,
    problem: String,
    candidates: Vec<Candidate<'m, M>>,
    /// An empty list of methods was given.
    empty_list: bool,
    tolerances: Option<Vec<f64>>,
    steps: Vec<f64>,
    options: Option<StudyRunSetup<'m, M>>,
    reference: Option<Reference<M>>,
    effort: Duration,
}

impl<'m, M: Simulate> WorkPrecision<'m, M> {
    pub(super) fn new(model: &'m M, start: M::State) -> Self {
        Self {
            model,
            start,
            end: None,
            problem: M::NAME.to_string(),
            candidates: Vec::new(),
            empty_list: false,
            tolerances: None,
            steps: Vec::new(),
            options: None,
            reference: None,
            effort: runs::DEFAULT_EFFORT,
        }
    }

    /// End time; may lie before the start.
    pub fn until(mut self, t: f64) -> Self {
        self.end = Some(t);
        self
    }

    /// What the problem is called in tables, charts and files of measurements; the model's name unless set.
    pub fn problem(mut self, name: impl Into<String>) -> Self {
        self.problem = name.into();
        self
    }

    /// Adds methods under their own names. Without this those that simulations choose by themselves: DOP853,
    /// Verner 9(8), Tsitouras 5(4) and Radau IIA.
    pub fn methods(self, methods: impl IntoIterator<Item = Any<M>>) -> Self {
        self.named(None, methods)
    }

    /// Adds methods under their own names that run at these tolerances, or with these steps if theirs are
    /// fixed, instead of the study's: a method of low order that would need millions of steps where others
    /// need hundreds.
    pub fn methods_at(
        self,
        settings: impl IntoIterator<Item = f64>,
        methods: impl IntoIterator<Item = Any<M>>,
    ) -> Self {
        self.named(Some(settings.into_iter().collect()), methods)
    }

    fn named(mut self, settings: Option<Vec<f64>>, methods: impl IntoIterator<Item = Any<M>>) -> Self {
        let before = self.candidates.len();
        let named = methods.into_iter().map(|method| Candidate::named(method, settings.clone()));
        self.candidates.extend(named);
        self.empty_list |= self.candidates.len() == before;
        self
    }

    /// Adds the curve `default method`: at each tolerance the method that simulations choose by themselves.
    /// It shows what a user gets who names no method.
    pub fn default_method(mut self) -> Self {
        let name = DEFAULT_METHOD.into();
        self.candidates.push(Candidate { name, method: None, options: None, settings: None });
        self
    }

    /// Adds a method with options of the simulation under a name of one's own: another formulation, a longest
    /// step.
    pub fn variant(
        mut self,
        name: impl Into<String>,
        method: impl Into<Any<M>>,
        options: impl Fn(Simulation<'m, M>) -> Simulation<'m, M> + 'm,
    ) -> Self {
        let options: Option<StudyRunSetup<'m, M>> = Some(Box::new(options));
        let method = Some(method.into());
        self.candidates.push(Candidate { name: name.into(), method, options, settings: None });
        self
    }

    /// Options for all simulations of the study, the reference included: input laws, actions at events.
    pub fn with(mut self, options: impl Fn(Simulation<'m, M>) -> Simulation<'m, M> + 'm) -> Self {
        self.options = Some(Box::new(options));
        self
    }

    /// Tolerances of the methods that choose their step. Without this: 1e-3 to 1e-13 by decades.
    pub fn tolerances(mut self, tolerances: impl IntoIterator<Item = f64>) -> Self {
        self.tolerances = Some(tolerances.into_iter().collect());
        self
    }

    /// Steps of the methods whose step is fixed.
    pub fn steps(mut self, steps: impl IntoIterator<Item = f64>) -> Self {
        self.steps = steps.into_iter().collect();
        self
    }

    /// The reference for errors. Without this, three runs near rounding: see [`Reference`].
    pub fn reference(mut self, reference: Reference<M>) -> Self {
        self.reference = Some(reference);
        self
    }

    /// Time that the repeats of each run may take, 60 ms unless set; zero: each is run three times.
    pub fn effort(mut self, time: Duration) -> Self {
        self.effort = time;
        self
    }

    /// Runs all methods at all tolerances.
    pub fn run(mut self) -> Result<Study<'m, M>, WorkPrecisionError> {
        let end = self.check()?;
        let reference = self.reference.take().unwrap_or_default().find(&self, end)?;
        let curves = measure::curves(&self, end, &reference);
        let interval = (self.start.t(), end);
        let problem = self.problem.clone();
        let study = Study { model: self.model, problem, start: self.start, interval, reference, curves };
        study.check(&self)?;
        Ok(study)
    }

    /// A simulation with the options for all. `reference` is the largest number of steps of a run of the
    /// reference, which has short steps, too. Options may change both.
    fn simulation(&self, end: f64, method: Option<&Any<M>>, reference: Option<u64>) -> Simulation<'m, M> {
        let simulation = self.model.simulate(self.start).until(end);
        let simulation = match method {
            Some(method) => simulation.method(method),
            None => simulation,
        };
        let simulation = match reference {
            Some(most) => runs::with_short_steps(simulation, (self.start.t(), end)).max_steps(most),
            None => simulation,
        };
        match &self.options {
            Some(options) => options(simulation),
            None => simulation,
        }
    }

    /// Adds default methods and tolerances, and rejects invalid options. Returns the end.
    fn check(&mut self) -> Result<f64, WorkPrecisionError> {
        let end = self.end.ok_or(WorkPrecisionError::NoEnd)?;
        if !end.is_finite() || end == self.start.t() {
            return Err(WorkPrecisionError::End { end });
        }
        if self.empty_list {
            return Err(WorkPrecisionError::NoMethods);
        }
        self.add_default_methods();
        for (i, candidate) in self.candidates.iter().enumerate() {
            if self.candidates[..i].iter().any(|other| other.name == candidate.name) {
                return Err(WorkPrecisionError::SameName { name: candidate.name.clone() });
            }
        }
        let unused = self.unused();
        let tolerances = self.tolerances.get_or_insert_with(|| {
            DEFAULT_TOLERANCE_DECADES.map(|k| libm::pow(10.0, f64::from(-k))).collect()
        });
        for (settings, what) in [(&*tolerances, "tolerances"), (&self.steps, "steps")] {
            if let Some(&value) = settings.iter().find(|value| !is_setting(**value)) {
                return Err(WorkPrecisionError::Setting { what, value });
            }
        }
        for candidate in &self.candidates {
            let what = if candidate.is_adaptive() { "tolerances" } else { "steps" };
            let settings = self.settings(candidate);
            if settings.is_empty() {
                return Err(WorkPrecisionError::NoSettings { what, method: candidate.name.clone() });
            }
            if let Some(&value) = settings.iter().find(|value| !is_setting(**value)) {
                return Err(WorkPrecisionError::Setting { what, value });
            }
        }
        match unused {
            Some(what) => Err(WorkPrecisionError::NoMethod { what }),
            None => Ok(end),
        }
    }

    /// Adds the methods that simulations choose by themselves, if none were named.
    fn add_default_methods(&mut self) {
        if self.candidates.iter().all(|candidate| candidate.method.is_none()) {
            let methods: [Any<M>; 4] = [Dop853.into(), Verner9.into(), Tsit5.into(), Radau5.into()];
            self.candidates.extend(methods.map(|method| Candidate::named(method, None)));
        }
    }

    /// Settings that were given and that no method uses.
    fn unused(&self) -> Option<&'static str> {
        let given =
            [("tolerances", self.tolerances.is_some(), true), ("steps", !self.steps.is_empty(), false)];
        let takes = |c: &Candidate<'m, M>, adaptive| c.settings.is_none() && c.is_adaptive() == adaptive;
        let unused = |(_, given, adaptive): &(_, bool, bool)| {
            *given && !self.candidates.iter().any(|c| takes(c, *adaptive))
        };
        given.into_iter().find(unused).map(|(what, ..)| what)
    }

    /// Tolerances or steps of a candidate, from coarse to fine.
    fn settings(&self, candidate: &Candidate<'m, M>) -> Vec<f64> {
        let shared = if candidate.is_adaptive() { self.tolerances.as_deref() } else { Some(&*self.steps) };
        let mut settings = candidate.settings.as_deref().or(shared).unwrap_or_default().to_vec();
        settings.sort_by(|a, b| b.total_cmp(a));
        settings.dedup();
        settings
    }
}

fn is_setting(value: f64) -> bool {
    value > 0.0 && value.is_finite()
}
