//! The result of a comparison: outputs, differences and costs.

use alloc::string::String;
use alloc::vec::Vec;
use core::time::Duration;

/// An output that is compared.
#[derive(Clone, Debug, PartialEq)]
pub struct Compared {
    /// Its name.
    pub name: String,
    /// Its unit; empty where no rung declares it.
    pub unit: String,
    /// The scale for relative differences: its largest value on the last rung, unless it was set.
    pub scale: f64,
}

/// How far an output of a rung is from that of the last one, in its unit.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Difference {
    /// The largest at any of the common times.
    pub largest: f64,
    /// Its time.
    pub at: f64,
    /// Root of the mean square over time.
    pub rms: f64,
    /// The difference at the start. If it is larger than the models explain, their starts do not correspond.
    pub at_start: f64,
    /// Numerical errors of the two rungs together; of the last one, its own.
    pub uncertainty: f64,
}

impl Difference {
    /// Whether it is larger than the numerical errors of the runs.
    #[must_use]
    pub fn is_believed(&self) -> bool {
        self.largest > self.uncertainty
    }

    /// An upper bound of the difference of the models: the numerical errors are added.
    #[must_use]
    pub fn bound(&self) -> f64 {
        self.largest + self.uncertainty
    }
}

/// A rung with its cost and its outputs.
#[derive(Clone, Debug, PartialEq)]
pub struct RungReport {
    /// Its name.
    pub name: String,
    /// Number of coordinates.
    pub coordinates: usize,
    /// Number of rows of constraints.
    pub constraints: usize,
    /// Operations of an evaluation of the accelerations, as the model's report counts them; `None` where no
    /// straight-line code was generated.
    pub operations: Option<usize>,
    /// Evaluations of the accelerations.
    pub evaluations: u64,
    /// Accepted steps.
    pub steps: u64,
    /// Median of the repeats.
    pub time: Duration,
    /// How many there were.
    pub repeats: usize,
    /// Outputs at [`Comparison::times`], in the order of [`Comparison::outputs`].
    pub values: Vec<Vec<f64>>,
    /// Differences from the last rung, in the order of [`Comparison::outputs`].
    pub differences: Vec<Difference>,
}

impl RungReport {
    /// Operations of all evaluations: a cost that does not depend on the machine.
    #[must_use]
    pub fn work(&self) -> Option<f64> {
        self.operations.map(|count| count as f64 * self.evaluations as f64)
    }
}

/// A comparison of models of one scene.
#[derive(Clone, Debug, PartialEq)]
pub struct Comparison {
    pub(super) scene: String,
    pub(super) interval: (f64, f64),
    pub(super) tolerance: f64,
    pub(super) times: Vec<f64>,
    pub(super) outputs: Vec<Compared>,
    pub(super) rungs: Vec<RungReport>,
}

impl Comparison {
    /// The name of the scene.
    #[must_use]
    pub fn scene(&self) -> &str {
        &self.scene
    }

    /// Start and end of the motions.
    #[must_use]
    pub fn interval(&self) -> (f64, f64) {
        self.interval
    }

    /// The common times, in the order of the motion.
    #[must_use]
    pub fn times(&self) -> &[f64] {
        &self.times
    }

    /// The outputs that are compared.
    #[must_use]
    pub fn outputs(&self) -> &[Compared] {
        &self.outputs
    }

    /// The rungs, from the plainest to the fullest.
    #[must_use]
    pub fn rungs(&self) -> &[RungReport] {
        &self.rungs
    }

    /// The rung of this name.
    #[must_use]
    pub fn rung(&self, name: &str) -> Option<&RungReport> {
        self.rungs.iter().find(|rung| rung.name == name)
    }

    /// How far an output of a rung is from that of the last one.
    #[must_use]
    pub fn difference(&self, rung: &str, output: &str) -> Option<&Difference> {
        self.rung(rung)?.differences.get(self.outputs.iter().position(|known| known.name == output)?)
    }

    /// The last rung.
    pub(super) fn full(&self) -> &RungReport {
        self.rungs.last().expect("a ladder has rungs")
    }
}
