//! All combinations of values on axes.

use dynamics_analysis::shared::grid_indices;

use super::{InputError, Inputs, list};

/// A grid: a run for each combination of values, the last axis fastest.
///
/// ```
/// # mod dynamics { pub use dynamics_ensembles as ensembles; }
/// use dynamics::ensembles::{Grid, Inputs};
///
/// let grid = Grid::new().over("theta1", [0.1, 0.2]).over("m1", (1..=3).map(f64::from));
/// assert_eq!(grid.count(), 6);
/// let mut values = [0.0; 2];
/// grid.point(4, &mut values);
/// assert_eq!(values, [0.2, 2.0]);
/// ```
#[derive(Clone, Debug, Default, PartialEq)]
#[must_use]
pub struct Grid {
    axes: Vec<(String, Vec<f64>)>,
    lengths: Vec<usize>,
}

impl Grid {
    /// A grid without axes.
    pub fn new() -> Self {
        Self::default()
    }

    /// Adds an axis: values of a parameter (`m1`, `stiffness[2]`), of a coordinate at the start (`theta1`) or
    /// of its velocity (`theta1_rate`).
    pub fn over(mut self, name: &str, values: impl IntoIterator<Item = f64>) -> Self {
        let values: Vec<f64> = values.into_iter().collect();
        self.lengths.push(values.len());
        self.axes.push((name.into(), values));
        self
    }

    /// The values of each axis, in the order in which the axes were added.
    pub fn axes(&self) -> impl Iterator<Item = (&str, &[f64])> {
        self.axes.iter().map(|(name, values)| (name.as_str(), values.as_slice()))
    }
}

impl Inputs for Grid {
    fn names(&self) -> Vec<String> {
        self.axes.iter().map(|(name, _)| name.clone()).collect()
    }

    fn count(&self) -> usize {
        self.lengths.iter().try_fold(1_usize, |product, n| product.checked_mul(*n)).unwrap_or(usize::MAX)
    }

    fn point(&self, run: usize, values: &mut [f64]) {
        let places = grid_indices(&self.lengths, run);
        for ((value, (_, axis)), i) in values.iter_mut().zip(&self.axes).zip(places) {
            *value = axis[i];
        }
    }

    fn plan(&self) -> Vec<(String, String)> {
        let axis = |(name, values): &(String, Vec<f64>)| (format!("varies {name}"), list(values));
        let mut plan = vec![("inputs".into(), "grid".into())];
        plan.extend(self.axes.iter().map(axis));
        plan
    }

    fn check(&self) -> Result<(), InputError> {
        if self.axes.is_empty() {
            return Err(InputError::NothingVaries);
        }
        for (name, values) in &self.axes {
            if values.is_empty() {
                return Err(InputError::Empty { name: name.clone() });
            }
            if let Some(value) = values.iter().find(|value| !value.is_finite()) {
                return Err(InputError::NotFinite { name: name.clone(), value: *value });
            }
        }
        Ok(())
    }
}
