//! Points that are given one by one.

use super::{InputError, Inputs, digest};

/// A list of points: measured starts, results of another program, samples of one's own.
///
/// ```
/// # mod dynamics { pub use dynamics_ensembles as ensembles; }
/// use dynamics::ensembles::{Inputs, Points};
///
/// let points = Points::new(["theta1", "m1"], [[0.1, 1.0], [0.7, 1.5], [0.3, 2.0]]);
/// assert_eq!(points.count(), 3);
/// ```
#[derive(Clone, Debug, PartialEq)]
#[must_use]
pub struct Points {
    names: Vec<String>,
    values: Vec<f64>,
    count: usize,
    /// A point whose number of values is wrong, and that number.
    wrong: Option<(usize, usize)>,
}

impl Points {
    /// Names of parameters and elements of the start, and their values: one list of values for each run.
    pub fn new<N: AsRef<str>, P: AsRef<[f64]>>(
        names: impl IntoIterator<Item = N>,
        points: impl IntoIterator<Item = P>,
    ) -> Self {
        let names: Vec<String> = names.into_iter().map(|name| name.as_ref().to_owned()).collect();
        let mut found = Self { names, values: Vec::new(), count: 0, wrong: None };
        for point in points {
            let point = point.as_ref();
            if point.len() != found.names.len() && found.wrong.is_none() {
                found.wrong = Some((found.count, point.len()));
            }
            found.values.extend_from_slice(point);
            found.count += 1;
        }
        found
    }
}

impl Inputs for Points {
    fn names(&self) -> Vec<String> {
        self.names.clone()
    }

    fn count(&self) -> usize {
        self.count
    }

    fn point(&self, run: usize, values: &mut [f64]) {
        let n = self.names.len();
        values.copy_from_slice(&self.values[run * n..(run + 1) * n]);
    }

    fn plan(&self) -> Vec<(String, String)> {
        let digest = digest(self.values.iter().copied());
        let mut plan = vec![("inputs".into(), format!("{} points, digest {digest}", self.count))];
        plan.extend(self.names.iter().map(|name| (format!("varies {name}"), "as given".into())));
        plan
    }

    fn check(&self) -> Result<(), InputError> {
        let names = self.names.len();
        if let Some((point, found)) = self.wrong {
            return Err(InputError::Length { point, found, names });
        }
        if names == 0 {
            return Err(InputError::NothingVaries);
        }
        if self.count == 0 {
            return Err(InputError::TooFew { least: 1 });
        }
        match self.values.iter().position(|value| !value.is_finite()) {
            Some(k) => {
                Err(InputError::NotFinite { name: self.names[k % names].clone(), value: self.values[k] })
            }
            None => Ok(()),
        }
    }
}
