//! The runs for Sobol indices: A. Saltelli et al., *Variance based sensitivity analysis of model output*,
//! Comput. Phys. Commun. 181, 2010.
//!
//! Two independent samples A and B, and for each input i the sample A_B⁽ⁱ⁾, which is A with input i
//! from B. The runs of one sample are a group: A, B, A_B⁽¹⁾, …, A_B⁽ᵈ⁾.

use super::samples::UnitPoints;
use super::{InputError, Inputs, Samples};

/// The line of a plan with the number of runs in a group.
pub(crate) const RUNS_OF_GROUP: &str = "runs of a group";

/// Groups of runs from which the importance of each input follows. [`Samples::for_importance`] makes it.
#[derive(Clone, Debug)]
#[must_use]
pub struct ImportanceDesign {
    samples: Samples,
    /// In twice as many dimensions as there are inputs: A and B.
    points: UnitPoints,
}

impl Samples {
    /// The runs from which the importance of each input follows, [`EnsembleTable::importance`]: for each of
    /// these samples, which have to be independent, a group of d + 2 runs with d inputs.
    ///
    /// [`EnsembleTable::importance`]: crate::EnsembleTable::importance
    pub fn for_importance(self) -> ImportanceDesign {
        let points = self.unit_points(2 * self.names().len());
        ImportanceDesign { samples: self, points }
    }
}

impl ImportanceDesign {
    fn runs_of_group(&self) -> usize {
        self.samples.names().len() + 2
    }
}

impl Inputs for ImportanceDesign {
    fn names(&self) -> Vec<String> {
        self.samples.names()
    }

    fn count(&self) -> usize {
        self.samples.count().saturating_mul(self.runs_of_group())
    }

    fn point(&self, run: usize, values: &mut [f64]) {
        let (index, kind) = (run / self.runs_of_group(), run % self.runs_of_group());
        let d = values.len();
        for (i, value) in values.iter_mut().enumerate() {
            let from_b = kind == 1 || kind == i + 2;
            *value = self.points.at(index, if from_b { d + i } else { i });
        }
        self.samples.values_at(values);
    }

    fn plan(&self) -> Vec<(String, String)> {
        let samples = format!("importance by {}", self.samples.points_in_words());
        let mut plan = vec![("inputs".into(), samples)];
        plan.push((RUNS_OF_GROUP.into(), self.runs_of_group().to_string()));
        plan.extend(self.samples.inputs_in_words());
        plan
    }

    fn check(&self) -> Result<(), InputError> {
        if let Some(names) = self.samples.correlated_names() {
            return Err(InputError::Correlated { names });
        }
        self.samples.check_inputs(2 * self.samples.names().len())
    }
}
