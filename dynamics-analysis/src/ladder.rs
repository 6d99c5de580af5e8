//! The model ladder: compares models of one scene, from the plainest to the fullest, and says which of them
//! suffices.
//!
//! # What is compared
//!
//! Every *rung* is a model with an equivalent start. The last rung is the fullest model, the reference for
//! the others. Chosen *outputs* (a force, a position) are evaluated on all rungs at common times: equal
//! intervals and the steps of all runs, so that no peak falls between them. The *difference* from the last
//! rung is given by its maximum and its root mean square over time. The cost of a rung is given as well: its
//! coordinates, operations of an evaluation, evaluations, and time (the median of repeats that keep nothing).
//!
//! # Which differences are significant
//!
//! Every rung runs twice, the second time at a hundredth of the tolerance and in steps of a five-hundredth of
//! the motion at most. The difference of its outputs is its numerical error. The sum of the errors of two
//! rungs is the *uncertainty* of their difference. A difference below the uncertainty only shows that the
//! models agree to that accuracy (as minimal and redundant coordinates of one model do): tables say `<`,
//! markers are hollow. If a difference is uncertain by more than a thousandth of the output and by more than
//! half of itself, as in chaotic motions, the result is an error.
//!
//! The comparison does not show effects that the last rung leaves out. It says which model suffices in place
//! of the fullest, not that the fullest is right.

mod comparison;
mod error;
mod run;
mod rung;
mod show;
mod verdict;

use alloc::boxed::Box;
use alloc::string::{String, ToString};
use alloc::vec::Vec;
use core::time::Duration;

pub use comparison::{Compared, Comparison, Difference, RungReport};
pub use error::LadderError;
pub use rung::Rung;
pub use verdict::Verdict;

use dynamics_runtime::simulate::Simulate;

use rung::AnyRung;

/// Tolerance of the runs unless it is set: the default of simulations.
const DEFAULT_TOLERANCE: f64 = 1e-9;
/// The tightest tolerance of a comparison: a hundredth of it, 10⁻¹⁴, is still a tolerance that methods
/// keep.
const MIN_TOLERANCE: f64 = 1e-12;
/// Number of equal intervals of the common times unless it is set: a chart shows no more points. The steps of
/// all runs join them, so that no peak is missed.
const DEFAULT_INTERVALS: usize = 1000;

/// Opens a comparison of models of one scene; rungs follow from the plainest to the fullest, [`Ladder::run`]
/// runs them.
///
/// ```text
/// let comparison = compare("crane load")
///     .rung(Rung::new("mathematical pendulum", &point, point_start))
///     .rung(Rung::new("elastic rope", &elastic, elastic_start))
///     .until(20.0)
///     .run()?;
/// println!("{comparison}");
/// println!("{}", comparison.sufficient(0.01)?);
/// comparison.write_html("crane_load.html")?;
/// ```
pub fn compare<'m>(scene: impl Into<String>) -> Ladder<'m> {
    Ladder {
        scene: scene.into(),
        rungs: Vec::new(),
        wanted: Vec::new(),
        scales: Vec::new(),
        end: None,
        tolerance: DEFAULT_TOLERANCE,
        intervals: DEFAULT_INTERVALS,
        effort: crate::runs::DEFAULT_EFFORT,
    }
}

/// Models of one scene with the options of their comparison, before it runs.
#[must_use = "models are not compared until `.run()`"]
pub struct Ladder<'m> {
    scene: String,
    rungs: Vec<Box<dyn AnyRung + 'm>>,
    wanted: Vec<String>,
    scales: Vec<(String, f64)>,
    end: Option<f64>,
    tolerance: f64,
    intervals: usize,
    effort: Duration,
}

impl<'m> Ladder<'m> {
    /// Adds a model above the others: the last one is the fullest.
    pub fn rung<M: Simulate + 'm>(mut self, rung: Rung<'m, M>) -> Self {
        self.rungs.push(Box::new(rung));
        self
    }

    /// Compares these outputs. Without this: all that every rung has.
    pub fn outputs<S: Into<String>>(mut self, names: impl IntoIterator<Item = S>) -> Self {
        self.wanted = names.into_iter().map(Into::into).collect();
        self
    }

    /// The scale of an output for relative differences, in its unit. Without this: its largest value on the
    /// last rung.
    pub fn scale(mut self, output: impl Into<String>, scale: f64) -> Self {
        self.scales.push((output.into(), scale));
        self
    }

    /// End time; may lie before the start.
    pub fn until(mut self, t: f64) -> Self {
        self.end = Some(t);
        self
    }

    /// Tolerance of all runs, 1e-9 unless set. The runs that measure errors use a hundredth of it.
    pub fn tolerance(mut self, tolerance: f64) -> Self {
        self.tolerance = tolerance;
        self
    }

    /// Equal intervals between common times, 1,000 unless set; the steps of all runs join them.
    pub fn intervals(mut self, count: usize) -> Self {
        self.intervals = count;
        self
    }

    /// Time that the repeats of each rung may take, 60 ms unless set; zero: each is run three times.
    pub fn effort(mut self, time: Duration) -> Self {
        self.effort = time;
        self
    }

    /// Runs all rungs and compares them.
    pub fn run(self) -> Result<Comparison, LadderError> {
        let (start, end) = self.check()?;
        let outputs = self.compared()?;
        run::run(&self, outputs, (start, end))
    }

    /// Rejects invalid options. Returns start and end.
    fn check(&self) -> Result<(f64, f64), LadderError> {
        let end = self.end.ok_or(LadderError::NoEnd)?;
        let [first, .., _] = &*self.rungs else {
            return Err(LadderError::TooFew { rungs: self.rungs.len() });
        };
        let start = first.start();
        for (i, rung) in self.rungs.iter().enumerate() {
            if self.rungs[..i].iter().any(|other| other.name() == rung.name()) {
                return Err(LadderError::SameName { name: rung.name().to_string() });
            }
            if rung.start() != start {
                let (first, other) = (first.name().to_string(), rung.name().to_string());
                return Err(LadderError::Starts { first, start, other, other_start: rung.start() });
            }
        }
        if !end.is_finite() || end == start {
            return Err(LadderError::End { end });
        }
        if !(MIN_TOLERANCE..1.0).contains(&self.tolerance) {
            return Err(LadderError::Tolerance { tolerance: self.tolerance });
        }
        if !(1..=10_000_000).contains(&self.intervals) {
            return Err(LadderError::Intervals { intervals: self.intervals });
        }
        match self.scales.iter().find(|(_, scale)| !(*scale > 0.0 && scale.is_finite())) {
            Some((output, scale)) => Err(LadderError::Scale { output: output.clone(), scale: *scale }),
            None => Ok((start, end)),
        }
    }

    /// The outputs with their units; every rung has each of them.
    fn compared(&self) -> Result<Vec<Compared>, LadderError> {
        let names = if self.wanted.is_empty() { self.common() } else { self.wanted.clone() };
        if names.is_empty() {
            return Err(LadderError::NoOutputs);
        }
        let known = |name: &String| names.contains(name);
        if let Some((output, _)) = self.scales.iter().find(|(output, _)| !known(output)) {
            return Err(LadderError::ScaleOfNothing { output: output.clone() });
        }
        let mut outputs: Vec<Compared> = Vec::new();
        for name in names {
            if outputs.iter().any(|output| output.name == name) {
                continue;
            }
            let unit = self.unit(&name)?;
            // NaN: the largest value on the last rung, which is known after the runs.
            let scale =
                self.scales.iter().rev().find(|(output, _)| *output == name).map_or(f64::NAN, |(_, s)| *s);
            outputs.push(Compared { name, unit, scale });
        }
        Ok(outputs)
    }

    /// Names that all rungs have, in the order of the first.
    fn common(&self) -> Vec<String> {
        let has = |rung: &dyn AnyRung, name: &str| rung.outputs().iter().any(|output| output == name);
        let Some((first, others)) = self.rungs.split_first() else { return Vec::new() };
        first.outputs().into_iter().filter(|name| others.iter().all(|rung| has(&**rung, name))).collect()
    }

    /// The unit of an output; empty if no rung declares it. Rungs that declare it must agree.
    fn unit(&self, output: &str) -> Result<String, LadderError> {
        let mut found: Option<(&str, &str)> = None;
        for rung in &self.rungs {
            match (rung.unit(output)?, found) {
                ("", _) => {}
                (unit, Some((other, known))) if unit != known => {
                    return Err(LadderError::Units {
                        output: output.into(),
                        units: [known.into(), unit.into()],
                        rungs: [other.into(), rung.name().into()],
                    });
                }
                (unit, _) => found = Some((rung.name(), unit)),
            }
        }
        Ok(found.map(|(_, unit)| unit.to_string()).unwrap_or_default())
    }
}
