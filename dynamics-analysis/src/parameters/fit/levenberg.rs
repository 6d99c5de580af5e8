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

/// The search has settled where the foretold decrease is below this part of χ²: the squares of differences
/// that motions at their tolerance still show.
const GAIN: f64 = 1e-14;
/// There the undamped step gains no more than this part: it then ends within a thousandth of the standard
/// errors or little more (D. M. Bates & D. G. Watts, Technometrics 23 (1981) 179).
const OFFSET: f64 = 1e-6;
/// Damping that leaves all but directions without any influence alone, and that which leaves nothing of a
/// step.
const UNDAMPED: f64 = 1e-14;
const MOST_DAMPED: f64 = 1e12;
/// And where steps are below this part of the unknowns.
const MOVE: f64 = 1e-11;
/// Smallest residuals, as a part of the first: data without noise.
const EXACT: f64 = 1e-20;

/// Options of a search.
pub(super) struct Levenberg<'a> {
    pub(super) bounds: &'a [[f64; 2]],
    pub(super) most: usize,
    /// Gains below are those of errors of the motions, whose derivatives are not the Jacobian's.
    pub(super) blur: f64,
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
    /// # Errors
    /// Where residuals or Jacobian do not exist at the first values, or the Jacobian at some that were
    /// accepted.
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
        let (mut mu, mut growth) = (1e-3, 2.0);
        let mut settled = false;
        let mut iterations = 0;
        while iterations < self.most {
            iterations += 1;
            let free = self.free(&at, &(jacobian.tr_mul(&residuals)));
            let undamped = damped(&jacobian, &residuals, &norms, UNDAMPED, &free);
            let solve = |free: &[usize], held: &_| {
                damped(&jacobian, &(&residuals + &jacobian * held), &norms, mu, free)
            };
            let (step, cut) = self.within(&at, free, solve);
            let foretold = residuals.norm_squared() - (&residuals + &jacobian * &step).norm_squared();
            let sum = residuals.norm_squared();
            // A step that was cut at a bound says nothing of how far the least is.
            let stands = !cut && (foretold <= GAIN * sum || small(&step, &at));
            if stands || sum <= EXACT * begun || mu > MOST_DAMPED {
                // Short steps may be those of much damping, where motions beside do not exist: the least is
                // where the undamped one gains nothing.
                let gain = sum - (&residuals + &jacobian * &undamped).norm_squared();
                settled = sum <= EXACT * begun || gain <= self.blur.max(OFFSET * sum);
                break;
            }
            let next = DVector::from_fn(at.len(), |i, _| {
                (at[i] + step[i]).clamp(self.bounds[i][0], self.bounds[i][1])
            });
            // Where there is no motion the step was too long.
            let gain = match evaluate(&next, false) {
                Ok((there, _)) if foretold > 0.0 => (sum - there.norm_squared()) / foretold,
                _ => -1.0,
            };
            if gain > 1e-4 {
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

fn small(step: &DVector<f64>, at: &DVector<f64>) -> bool {
    step.iter().zip(at.iter()).all(|(d, x)| d.abs() <= MOVE * x.abs())
}

/// The damped step of the free unknowns, 0 of the others.
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
        Levenberg { bounds: &bounds, most: 500, blur: 0.0 }
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

    /// Where nothing exists beyond a place on the way, the search stops there, and has not settled.
    #[test]
    fn a_search_that_cannot_go_on_has_not_settled() {
        let evaluate = |at: &DVector<f64>, _| {
            if at[0] > -1.0 {
                return Err(SensitivityError::NotFinite { time: 0.0 });
            }
            let (r, j) = valley(at[0], at[1]);
            Ok((DVector::from_row_slice(&r), Some(DMatrix::from_row_slice(2, 2, &j))))
        };
        let search = Levenberg { bounds: &ANYWHERE, most: 500, blur: 0.0 };
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
