//! The method of Levenberg and Marquardt, within bounds.
//!
//! Steps d minimise ‖r + J d‖² + μ ‖D d‖². D has the largest norms of the columns of J so far, which makes
//! steps independent of units (J. J. Moré, Lecture Notes in Mathematics 630 (1978) 105). μ follows the gain,
//! the ratio of the decrease to that of the linear model (H. B. Nielsen, IMM-REP-1999-05). The least-squares
//! problem is solved by QR, never by JᵀJ. Unknowns on a bound stay there if the gradient pushes against it,
//! and steps end at the bounds (projected steps: C. Kanzow, N. Yamashita & M. Fukushima, J. Comput. Appl.
//! Math. 172 (2004) 375). Our own, as the crate `levenberg-marquardt` 0.15, a port of MINPACK, takes no
//! bounds, asks for nalgebra 0.34 where 0.35 is used here, and gives no covariance; `argmin` 0.11 has the
//! method of Gauss and Newton for least squares, with no damping and no bounds. On certified regressions
//! (`levenberg/certified.rs`) both find the same, also where that is a plateau.

use alloc::vec::Vec;

use nalgebra::{DMatrix, DVector};

use super::super::sensitivity_error::SensitivityError;

/// Predicted decrease, relative to χ², at which the iteration ends: the square of the differences that
/// motions at their tolerance still show.
const MIN_PREDICTED_DECREASE: f64 = 1e-14;
/// Step, relative to each unknown, at which the iteration ends. Below it unknowns change by rounding only.
const MIN_RELATIVE_STEP: f64 = 1e-11;
/// Largest decrease of χ² by the undamped step, relative to χ², at a minimum. The iteration then ended
/// within about a thousandth of the standard errors (D. M. Bates & D. G. Watts, Technometrics 23 (1981) 179).
const MAX_UNDAMPED_DECREASE: f64 = 1e-6;
/// Damping of the undamped step: it only stops directions without any influence.
const MIN_DAMPING: f64 = 1e-14;
/// Damping at which the iteration ends, because nothing is left of a step.
const MAX_DAMPING: f64 = 1e12;
/// First damping. A larger one shortens the first steps, a smaller one makes them steps of Gauss and Newton.
const FIRST_DAMPING: f64 = 1e-3;
/// χ², relative to the first one, at which the residuals are 0 up to rounding, as of data without noise.
const EXACT_FIT: f64 = 1e-20;
/// Least ratio of the decrease to the predicted decrease of an accepted step. It only excludes steps without
/// a real decrease (J. J. Moré, the same value).
const MIN_GAIN_RATIO: f64 = 1e-4;

/// Options of a search.
pub(super) struct Levenberg<'a> {
    pub(super) bounds: &'a [[f64; 2]],
    pub(super) max_iterations: usize,
    /// Decreases of χ² below this one are errors of the motions.
    pub(super) least_gain: f64,
}

/// Where a search ended.
pub(super) struct Outcome {
    pub(super) at: DVector<f64>,
    pub(super) residuals: DVector<f64>,
    pub(super) jacobian: DMatrix<f64>,
    pub(super) iterations: usize,
    pub(super) settled: bool,
}

/// Residuals, and their Jacobian where it is asked for.
pub(super) type ResidualEvaluation = Result<(DVector<f64>, Option<DMatrix<f64>>), SensitivityError>;

impl Levenberg<'_> {
    /// Minimises ‖r‖² from the first values.
    ///
    /// # Errors
    /// Residuals or a Jacobian that do not exist at the first values, or a Jacobian that does not exist at
    /// accepted ones.
    pub(super) fn minimize(
        &self,
        first: &DVector<f64>,
        evaluate: impl Fn(&DVector<f64>, bool) -> ResidualEvaluation,
    ) -> Result<Outcome, SensitivityError> {
        let with_jacobian = |at: &DVector<f64>| {
            let (residuals, jacobian) = evaluate(at, true)?;
            Ok::<_, SensitivityError>((residuals, jacobian.unwrap_or_else(|| DMatrix::zeros(0, 0))))
        };
        let mut at = first.clone();
        let (mut residuals, mut jacobian) = with_jacobian(&at)?;
        let begun = residuals.norm_squared();
        let mut norms = column_norms(&jacobian);
        let (mut mu, mut growth) = (FIRST_DAMPING, 2.0);
        let mut settled = false;
        let mut iterations = 0;
        while iterations < self.max_iterations {
            iterations += 1;
            let free = self.free(&at, &(jacobian.tr_mul(&residuals)));
            let undamped = damped(&jacobian, &residuals, &norms, MIN_DAMPING, &free);
            let solve = |free: &[usize], held: &_| {
                damped(&jacobian, &(&residuals + &jacobian * held), &norms, mu, free)
            };
            let (step, cut) = self.within(&at, free, solve);
            let predicted = residuals.norm_squared() - (&residuals + &jacobian * &step).norm_squared();
            let sum = residuals.norm_squared();
            // The end: a step that was not shortened at a bound would gain nothing, or the fit is exact, or
            // damping stopped the iteration.
            let stands = !cut && (predicted <= MIN_PREDICTED_DECREASE * sum || small(&step, &at));
            if stands || sum <= EXACT_FIT * begun || mu > MAX_DAMPING {
                // Steps may be short because of damping, where motions nearby do not exist. It is a minimum
                // if the undamped step gains nothing, either.
                let gain = sum - (&residuals + &jacobian * &undamped).norm_squared();
                settled =
                    sum <= EXACT_FIT * begun || gain <= self.least_gain.max(MAX_UNDAMPED_DECREASE * sum);
                break;
            }
            let next = DVector::from_fn(at.len(), |i, _| {
                (at[i] + step[i]).clamp(self.bounds[i][0], self.bounds[i][1])
            });
            // If there is no motion at the new values, the step was too long.
            let gain = match evaluate(&next, false) {
                Ok((there, _)) if predicted > 0.0 => (sum - there.norm_squared()) / predicted,
                _ => -1.0,
            };
            if gain > MIN_GAIN_RATIO {
                at = next;
                (residuals, jacobian) = with_jacobian(&at)?;
                norms = norms.zip_map(&column_norms(&jacobian), f64::max);
                mu *= (1.0 - (2.0 * gain - 1.0).powi(3)).max(1.0 / 3.0);
                growth = 2.0;
            } else {
                mu *= growth;
                growth *= 2.0;
            }
        }
        Ok(Outcome { at, residuals, jacobian, iterations, settled })
    }

    /// Unknowns that are not pushed against a bound on which they lie.
    fn free(&self, at: &DVector<f64>, gradient: &DVector<f64>) -> Vec<usize> {
        let stands = |i: &usize| {
            let [low, high] = self.bounds[*i];
            (at[*i] <= low && gradient[*i] > 0.0) || (at[*i] >= high && gradient[*i] < 0.0)
        };
        (0..at.len()).filter(|i| !stands(i)).collect()
    }

    /// A step within the bounds: unknowns that would cross a bound stop there, and the others are solved
    /// again. Also returns whether that happened.
    fn within(
        &self,
        at: &DVector<f64>,
        mut free: Vec<usize>,
        solve: impl Fn(&[usize], &DVector<f64>) -> DVector<f64>,
    ) -> (DVector<f64>, bool) {
        let (mut held, mut cut) = (DVector::zeros(at.len()), false);
        loop {
            let step = solve(&free, &held) + &held;
            let crosses =
                |i: &usize| !(self.bounds[*i][0]..=self.bounds[*i][1]).contains(&(at[*i] + step[*i]));
            let crossing: Vec<usize> = free.iter().copied().filter(crosses).collect();
            if crossing.is_empty() {
                return (step, cut);
            }
            cut = true;
            for i in &crossing {
                held[*i] = (at[*i] + step[*i]).clamp(self.bounds[*i][0], self.bounds[*i][1]) - at[*i];
            }
            free.retain(|i| !crossing.contains(i));
        }
    }
}

fn column_norms(jacobian: &DMatrix<f64>) -> DVector<f64> {
    DVector::from_iterator(jacobian.ncols(), jacobian.column_iter().map(|column| column.norm()))
}

/// Whether a step hardly changes any unknown.
fn small(step: &DVector<f64>, at: &DVector<f64>) -> bool {
    step.iter().zip(at.iter()).all(|(d, x)| d.abs() <= MIN_RELATIVE_STEP * x.abs())
}

/// The damped step of the free unknowns, 0 for the others, by QR of [J D⁻¹; √μ].
fn damped(
    jacobian: &DMatrix<f64>,
    residuals: &DVector<f64>,
    norms: &DVector<f64>,
    mu: f64,
    free: &[usize],
) -> DVector<f64> {
    let (rows, columns) = (jacobian.nrows(), free.len());
    let mut step = DVector::zeros(jacobian.ncols());
    if free.is_empty() {
        return step;
    }
    let scale = |k: usize| if norms[free[k]] > 0.0 { 1.0 / norms[free[k]] } else { 1.0 };
    let mut system = DMatrix::zeros(rows + columns, columns);
    for k in 0..columns {
        system.view_mut((0, k), (rows, 1)).copy_from(&(jacobian.column(free[k]) * scale(k)));
        system[(rows + k, k)] = mu.sqrt();
    }
    let mut right = DVector::zeros(rows + columns);
    right.rows_mut(0, rows).copy_from(&-residuals);
    let qr = system.qr();
    if let Some(found) = qr.r().solve_upper_triangular(&qr.q().tr_mul(&right)) {
        found.iter().enumerate().for_each(|(k, d)| step[free[k]] = d * scale(k));
    }
    step
}

#[cfg(test)]
mod certified;

#[cfg(test)]
mod tests {
    use super::*;

    fn minimize(
        first: [f64; 2],
        bounds: [[f64; 2]; 2],
        f: impl Fn(f64, f64) -> ([f64; 2], [f64; 4]),
    ) -> Outcome {
        let evaluate = |at: &DVector<f64>, _| {
            let (r, j) = f(at[0], at[1]);
            Ok((DVector::from_row_slice(&r), Some(DMatrix::from_row_slice(2, 2, &j))))
        };
        Levenberg { bounds: &bounds, max_iterations: 500, least_gain: 0.0 }
            .minimize(&DVector::from_row_slice(&first), evaluate)
            .unwrap()
    }

    const ANYWHERE: [[f64; 2]; 2] = [[f64::NEG_INFINITY, f64::INFINITY]; 2];

    /// Rosenbrock's valley, which bends.
    fn valley(x: f64, y: f64) -> ([f64; 2], [f64; 4]) {
        ([10.0 * (y - x * x), 1.0 - x], [-20.0 * x, 10.0, -1.0, 0.0])
    }

    #[test]
    fn the_valley_of_rosenbrock_ends_at_one_and_one() {
        let found = minimize([-1.2, 1.0], ANYWHERE, valley);
        assert!(
            found.settled && (found.at[0] - 1.0).abs() < 1e-9 && (found.at[1] - 1.0).abs() < 1e-9,
            "{}",
            found.at
        );
    }

    /// If there are no residuals beyond a point on the way, the search stops there and has not settled.
    #[test]
    fn a_search_that_cannot_go_on_has_not_settled() {
        let evaluate = |at: &DVector<f64>, _| {
            if at[0] > -1.0 {
                return Err(SensitivityError::NotFinite { time: 0.0 });
            }
            let (r, j) = valley(at[0], at[1]);
            Ok((DVector::from_row_slice(&r), Some(DMatrix::from_row_slice(2, 2, &j))))
        };
        let search = Levenberg { bounds: &ANYWHERE, max_iterations: 500, least_gain: 0.0 };
        let found = search.minimize(&DVector::from_row_slice(&[-1.2, 1.0]), evaluate).unwrap();
        assert!(!found.settled && found.at[0] <= -1.0, "{}", found.at);
    }

    /// On x ≤ 0.5 the least is where y = x², on the bound.
    #[test]
    fn a_bound_holds_what_is_pushed_against_it() {
        let found = minimize([-1.2, 1.0], [[-2.0, 0.5], [-2.0, 2.0]], valley);
        assert!(found.settled && found.at[0] == 0.5 && (found.at[1] - 0.25).abs() < 1e-9, "{}", found.at);
    }
}
