//! The result of a study: curves of error against cost.

use alloc::string::String;
use alloc::vec::Vec;
use core::time::Duration;

use dynamics_runtime::simulate::Simulate;

use super::errors::{End, ErrorOf, Errors};
use super::reference::ReferenceSolution;

/// The measure of cost.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Cost {
    /// Time in seconds.
    Time,
    /// Evaluations of the accelerations.
    Evaluations,
}

/// The errors and the cost of one run.
#[derive(Clone, Debug, PartialEq)]
pub struct RunMeasurement {
    /// Differences from the reference at the end.
    pub errors: Errors,
    /// Median of the repeats.
    pub time: Duration,
    /// The number of repeats, if known.
    pub repeats: Option<usize>,
    /// Evaluations of the accelerations, where known, and where they are what a step costs: not of Taylor
    /// series.
    pub evaluations: Option<u64>,
    /// Accepted steps, where known.
    pub steps: Option<u64>,
    /// Rejected steps, where known.
    pub rejected: Option<u64>,
    /// The time at which the problem was found stiff for the method.
    pub stiff_at: Option<f64>,
    pub(super) end: Option<End>,
}

impl RunMeasurement {
    pub(super) fn cost(&self, cost: Cost) -> Option<f64> {
        match cost {
            Cost::Time => Some(self.time.as_secs_f64()),
            Cost::Evaluations => self.evaluations.map(|count| count as f64),
        }
    }
}

/// One run of a curve.
#[derive(Clone, Debug, PartialEq)]
pub struct Point {
    /// Its tolerance, or its step where that is fixed.
    pub setting: f64,
    /// What it reached, or why it failed.
    pub outcome: Result<RunMeasurement, String>,
}

/// The runs of one method, from coarse to fine.
#[derive(Clone, Debug, PartialEq)]
pub struct WorkPrecisionCurve {
    /// Its name.
    pub name: String,
    /// It was measured elsewhere and added.
    pub outside: bool,
    /// It is that of the methods that simulations choose by themselves.
    pub is_default: bool,
    /// Whether its settings are tolerances; else they are steps.
    pub adaptive: bool,
    /// Its runs.
    pub points: Vec<Point>,
}

/// What a study found: curves of error against cost, and how far the reference can be trusted.
#[derive(Clone, Debug)]
pub struct Study<'m, M: Simulate> {
    #[cfg_attr(not(feature = "json"), allow(dead_code, reason = "only ends that are read need it"))]
    pub(super) model: &'m M,
    pub(super) problem: String,
    #[cfg_attr(not(feature = "json"), allow(dead_code, reason = "only ends that are read need it"))]
    pub(super) start: M::State,
    pub(super) interval: (f64, f64),
    pub(super) reference: ReferenceSolution,
    pub(super) curves: Vec<WorkPrecisionCurve>,
}

impl<M: Simulate> Study<'_, M> {
    /// The name of the problem.
    #[must_use]
    pub fn problem(&self) -> &str {
        &self.problem
    }

    /// Start and end of the motion.
    #[must_use]
    pub fn interval(&self) -> (f64, f64) {
        self.interval
    }

    /// The uncertainty of the reference. Errors below it are not significant.
    #[must_use]
    pub fn uncertainty(&self) -> Errors {
        self.reference.uncertainty
    }

    /// The curves: own ones in the order in which methods were named, then those added.
    #[must_use]
    pub fn curves(&self) -> &[WorkPrecisionCurve] {
        &self.curves
    }

    /// The curve of this name.
    #[must_use]
    pub fn curve(&self, name: &str) -> Option<&WorkPrecisionCurve> {
        self.curves.iter().find(|curve| curve.name == name)
    }

    /// The least cost at which a curve gets an error down to `error`: between its runs on logarithmic scales,
    /// or at a run that is better. `None` where no run is so accurate, or where the reference is not.
    #[must_use]
    pub fn cost(&self, curve: &str, part: ErrorOf, error: f64, cost: Cost) -> Option<f64> {
        self.cost_of(self.curve(curve)?, part, error, cost)
    }

    /// All runs that succeeded.
    pub(super) fn runs(&self) -> impl Iterator<Item = &RunMeasurement> {
        let points = self.curves.iter().flat_map(|curve| &curve.points);
        points.filter_map(|point| point.outcome.as_ref().ok())
    }

    /// See [`Study::cost`].
    pub(super) fn cost_of(
        &self,
        curve: &WorkPrecisionCurve,
        part: ErrorOf,
        error: f64,
        cost: Cost,
    ) -> Option<f64> {
        let floor = self.reference.uncertainty.of(part)?;
        if error.is_nan() || error < floor {
            return None;
        }
        let measured: Vec<(f64, f64)> = curve
            .points
            .iter()
            .filter_map(|point| point.outcome.as_ref().ok())
            .filter_map(|run| Some((run.errors.of(part)?.max(floor), run.cost(cost)?)))
            .filter(|(error, _)| error.is_finite())
            .collect();
        let reached = measured.iter().filter(|(reached, _)| *reached <= error).map(|(_, cost)| *cost);
        let between =
            measured.windows(2).filter(|pair| pair[0].0 > error && pair[1].0 <= error).map(|pair| {
                let [(coarse, cheap), (fine, dear)] = [pair[0], pair[1]];
                let part = libm::log(coarse / error) / libm::log(coarse / fine);
                cheap * libm::pow(dear / cheap, part)
            });
        reached.chain(between).min_by(f64::total_cmp)
    }
}
