//! Correlated normal inputs: x = mean + L z, with L Lᵀ the covariance and z independent standard normal.

use dynamics_view::text::exact;

use super::InputError;

/// Differences between C_ij and C_ji that are taken for rounding, in parts of √(C_ii C_jj).
const ASYMMETRY: f64 = 1e-12;

/// Inputs with a joint normal distribution.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Correlated {
    mean: Vec<f64>,
    covariance: Vec<Vec<f64>>,
    /// L by rows; the error where there is none.
    factor: Result<Vec<Vec<f64>>, InputError>,
}

impl Correlated {
    pub(super) fn new(names: &[String], mean: Vec<f64>, covariance: Vec<Vec<f64>>) -> Self {
        let factor = cholesky(&covariance, names, mean.len())
            .map_err(|problem| InputError::Covariance { names: quoted(names), problem });
        Self { mean, covariance, factor }
    }

    /// Turns independent standard normal numbers into values, in place.
    pub(super) fn mix(&self, z: &mut [f64]) {
        let Ok(factor) = &self.factor else { return };
        // From the last row up: each needs the numbers before it only.
        for i in (0..z.len()).rev() {
            z[i] = self.mean[i] + factor[i].iter().zip(&*z).map(|(l, z)| l * z).sum::<f64>();
        }
    }

    pub(super) fn check(&self, names: &[String]) -> Result<(), InputError> {
        if let Some((name, value)) = names.iter().zip(&self.mean).find(|(_, mean)| !mean.is_finite()) {
            return Err(InputError::NotFinite { name: name.clone(), value: *value });
        }
        self.factor.as_ref().map(|_| ()).map_err(Clone::clone)
    }

    /// What identifies the input of a row.
    pub(super) fn in_words(&self, row: usize) -> String {
        let numbers = |list: &[f64]| list.iter().map(|x| exact(*x)).collect::<Vec<_>>().join(" ");
        let covariance = self.covariance.get(row).map_or(String::new(), |row| numbers(row));
        format!("normal, mean {}, covariance {covariance}", exact(self.mean[row]))
    }
}

/// Names in a sentence.
pub(super) fn quoted(names: &[String]) -> String {
    names.iter().map(|name| format!("`{name}`")).collect::<Vec<_>>().join(", ")
}

/// L by rows, the lower triangle.
fn cholesky(c: &[Vec<f64>], names: &[String], means: usize) -> Result<Vec<Vec<f64>>, String> {
    let n = names.len();
    if means != n || c.len() != n || c.iter().any(|row| row.len() != n) {
        let sizes = format!("{} rows of {}", c.len(), c.first().map_or(0, Vec::len));
        return Err(format!("has {sizes}, and there are {means} means; give {n} means and {n} rows of {n}"));
    }
    let mut l = vec![vec![0.0; n]; n];
    for i in 0..n {
        for j in 0..=i {
            let scale = (c[i][i] * c[j][j]).abs().sqrt();
            if (c[i][j] - c[j][i]).abs() > ASYMMETRY * scale {
                let (a, b) = (&names[i], &names[j]);
                return Err(format!(
                    "is not symmetric: {} of `{a}` with `{b}`, {} of `{b}` with `{a}`; give both the same",
                    c[i][j], c[j][i]
                ));
            }
            let dot: f64 = (0..j).map(|k| l[i][k] * l[j][k]).sum();
            let rest = c[i][j] - dot;
            if i != j {
                l[i][j] = rest / l[j][j];
                continue;
            }
            // Below this it is the rounding of the differences.
            let is_positive = rest > n as f64 * f64::EPSILON * c[i][i].abs();
            if !is_positive || !rest.is_finite() {
                return Err(format!(
                    "is not positive definite: `{}` has no variance of its own, {rest:e}; check its signs, \
                     or leave out inputs that the others determine",
                    names[i]
                ));
            }
            l[i][i] = libm::sqrt(rest);
        }
    }
    Ok(l)
}
