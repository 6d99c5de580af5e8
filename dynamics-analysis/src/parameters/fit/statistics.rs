//! Statistics of a fit: covariance, correlations and residuals.

use alloc::vec::Vec;

use dynamics_runtime::model::Parameters;
use dynamics_runtime::simulate::Simulate;
use nalgebra::{DMatrix, DVector};

use super::super::equations::size;
use super::result::{Fit, Fitted, Outlier, Residuals};
use super::robust::{FitWeights, Loss};
use super::{FitError, FitProblem, RANK_TOLERANCE_OF_JACOBIAN};

/// Least change of the modelled values by an unknown (column of J times its size), relative to them. The
/// influence of unknowns below it is only the error of the derivatives, and counts as 0.
const MIN_INFLUENCE: f64 = 1e-9;
/// Least coefficient with which a dependent column contains another one, for both to be named in one group.
/// Smaller coefficients are errors of the derivatives, divided by the pivots.
const MIN_DEPENDENCE: f64 = 1e-3;

impl Fit {
    /// The fit at the end of a search: covariance and correlations of the unknowns that lie on no bound, and
    /// residuals.
    pub(super) fn of<M: Simulate + Parameters + Clone>(
        problem: &FitProblem<'_, M>,
        at: &DVector<f64>,
        (residuals, weighed): (DVector<f64>, FitWeights),
        jacobian: &DMatrix<f64>,
        iterations: usize,
    ) -> Result<Self, FitError> {
        let count = at.len();
        let on_bound = |i: usize| problem.unknowns[i].bounds.contains(&at[i]);
        let free: Vec<usize> = (0..count).filter(|i| !on_bound(*i)).collect();
        let names =
            |of: &[usize]| of.iter().map(|k| problem.unknowns[free[*k]].name.clone()).collect::<Vec<_>>();
        let mut of_free = jacobian.select_columns(&free);
        let modelled = problem.modelled(&residuals);
        for (k, i) in free.iter().enumerate() {
            // The size of an unknown that ends near zero is its first value.
            let size = at[*i].abs().max(size(problem.unknowns[*i].first));
            if of_free.column(k).norm() * size < MIN_INFLUENCE * modelled {
                of_free.column_mut(k).fill(0.0);
            }
        }
        // χ², then (JᵀJ)⁻¹, or the groups of unknowns that cannot be identified.
        let chi_squared: f64 = residuals.iter().zip(&weighed.weights).map(|(r, w)| w * r * r).sum();
        let freedom = residuals.len() - free.len();
        let factored = match factor(&of_free) {
            Ok(factored) => factored,
            Err(groups) => {
                let groups = groups.iter().map(|group| names(group)).collect();
                let values =
                    problem.unknowns.iter().zip(at.iter()).map(|(u, x)| (u.name.clone(), *x)).collect();
                return Err(FitError::Indistinguishable { groups, values, chi_squared });
            }
        };
        // Covariance, standard errors and correlations.
        let variance = match weighed.loss {
            Loss::Squares if problem.absolute => 1.0,
            Loss::Squares => chi_squared / freedom as f64,
            _ => weighed.variance(&residuals, free.len()).unwrap_or(f64::INFINITY),
        };
        let mut covariance = DMatrix::zeros(count, count);
        for (a, i) in free.iter().enumerate() {
            for (b, j) in free.iter().enumerate() {
                covariance[(*i, *j)] = variance * factored.inverse[(a, b)];
            }
        }
        let error = |i: usize| covariance[(i, i)].sqrt();
        let correlation = DMatrix::from_fn(count, count, |i, j| {
            let size = error(i) * error(j);
            if i == j && error(i) > 0.0 {
                1.0
            } else if size > 0.0 {
                covariance[(i, j)] / size
            } else {
                0.0
            }
        });
        let fitted = |i: usize| Fitted {
            name: problem.unknowns[i].name.clone(),
            unit: problem.unknowns[i].variable.unit::<M>(),
            value: at[i],
            standard_error: (!on_bound(i)).then(|| error(i)),
        };
        Ok(Self {
            found: (0..count).map(fitted).collect(),
            correlation,
            covariance,
            chi_squared,
            freedom,
            absolute: problem.absolute,
            rank: free.len(),
            independence: factored.least,
            residuals: by_quantity(problem, &residuals, &weighed.weights),
            loss: weighed.loss,
            scale: weighed.scale,
            iterations,
        })
    }
}

/// The outlier at some values of the unknowns, if its measured value is larger than its modelled one.
pub(super) fn outlier_at<M: Simulate + Parameters + Clone>(
    problem: &FitProblem<'_, M>,
    at: &DVector<f64>,
) -> Option<Outlier> {
    let (residuals, _) = problem.evaluate(at, false).ok()?;
    let left = by_quantity(problem, &residuals, &alloc::vec![1.0; residuals.len()]);
    let (index, outlier) = Outlier::among(&left)?;
    let (_, measured) = problem.series().nth(index)?.points[outlier.row];
    let modelled = outlier.residual + measured;
    (modelled.abs() < measured.abs()).then_some(outlier)
}

/// The residuals of each measured series, with their statistics.
fn by_quantity<M: Simulate + Parameters + Clone>(
    problem: &FitProblem<'_, M>,
    residuals: &DVector<f64>,
    weights: &[f64],
) -> Vec<Residuals> {
    let mut rest = residuals.as_slice();
    let mut rest_of_weights = weights;
    let of_series = |series: &super::Series| {
        let (own, after) = rest.split_at(series.points.len());
        let (weights, weights_after) = rest_of_weights.split_at(series.points.len());
        (rest, rest_of_weights) = (after, weights_after);
        let points: Vec<_> =
            series.points.iter().zip(own).map(|((t, _), r)| (*t, r * series.sigma)).collect();
        let count = points.len() as f64;
        let squares: f64 = points.iter().map(|(_, r)| r * r).sum();
        let mean = series.points.iter().map(|(_, y)| y).sum::<f64>() / count;
        let scatter: f64 = series.points.iter().map(|(_, y)| (y - mean).powi(2)).sum();
        let mut ordered = points.clone();
        ordered.sort_by(|a, b| a.0.total_cmp(&b.0));
        let neighbour_products: f64 = ordered.windows(2).map(|pair| pair[0].1 * pair[1].1).sum();
        Residuals {
            name: series.name.clone(),
            unit: series.unit.clone(),
            points,
            weights: weights.to_vec(),
            rms: (squares / count).sqrt(),
            explained: if scatter > 0.0 { 1.0 - squares / scatter } else { f64::NAN },
            neighbours: if squares > 0.0 { neighbour_products / squares } else { 0.0 },
        }
    };
    problem.series().map(of_series).collect()
}

/// J, factored.
struct Factored {
    /// (JᵀJ)⁻¹.
    inverse: DMatrix<f64>,
    /// The smallest pivot.
    least: f64,
}

/// (JᵀJ)⁻¹ by QR with column pivoting of J with normalised columns, or the groups of dependent columns.
fn factor(jacobian: &DMatrix<f64>) -> Result<Factored, Vec<Vec<usize>>> {
    let count = jacobian.ncols();
    let norms: Vec<f64> = jacobian.column_iter().map(|column| column.norm()).collect();
    let mut rest = jacobian.clone();
    (0..count).filter(|k| norms[*k] > 0.0).for_each(|k| rest.column_mut(k).unscale_mut(norms[k]));
    let mut order: Vec<usize> = (0..count).collect();
    let mut r = DMatrix::zeros(count, count);
    let mut rank = count;
    for k in 0..count {
        // The longest remaining column. Columns are made orthogonal twice, since once is not accurate enough
        // if they are nearly equal.
        let longest =
            (k..count).max_by(|a, b| rest.column(*a).norm().total_cmp(&rest.column(*b).norm())).unwrap_or(k);
        rest.swap_columns(k, longest);
        r.swap_columns(k, longest);
        order.swap(k, longest);
        let norm = rest.column(k).norm();
        if norm.is_nan() || norm <= RANK_TOLERANCE_OF_JACOBIAN {
            rank = k;
            break;
        }
        r[(k, k)] = norm;
        rest.column_mut(k).unscale_mut(norm);
        let direction = rest.column(k).into_owned();
        for j in k + 1..count {
            for _ in 0..2 {
                let part = direction.dot(&rest.column(j));
                r[(k, j)] += part;
                rest.column_mut(j).axpy(-part, &direction, 1.0);
            }
        }
    }
    let independent = r.view((0, 0), (rank, rank)).into_owned();
    if rank < count {
        let dependent = r.view((0, rank), (rank, count - rank)).into_owned();
        let by = independent.solve_upper_triangular(&dependent).unwrap_or(dependent);
        let group = |j: usize| {
            let with = (0..rank).filter(|i| by[(*i, j)].abs() > MIN_DEPENDENCE).map(|i| order[i]);
            let mut group: Vec<usize> = with.chain([order[rank + j]]).collect();
            group.sort_unstable();
            group
        };
        return Err((0..count - rank).map(group).collect());
    }
    let least = (0..count).map(|k| r[(k, k)]).fold(1.0, f64::min);
    let unit = DMatrix::identity(count, count);
    let Some(root) = independent.solve_upper_triangular(&unit) else { return Err(alloc::vec![order]) };
    let product = &root * root.transpose();
    let mut inverse = DMatrix::zeros(count, count);
    for (a, i) in order.iter().enumerate() {
        for (b, j) in order.iter().enumerate() {
            inverse[(*i, *j)] = product[(a, b)] / (norms[*i] * norms[*j]);
        }
    }
    Ok(Factored { inverse, least })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_inverse_is_that_of_the_normal_equations_and_what_depends_is_named() {
        let j = DMatrix::from_fn(7, 3, |i, k| ((i + 1) as f64).powi(k as i32) * [1.0, 1e6, 1e-3][k]);
        let factored = factor(&j).unwrap_or_else(|groups| panic!("{groups:?}"));
        let unit = factored.inverse * (j.tr_mul(&j));
        assert!((unit - DMatrix::identity(3, 3)).map(f64::abs).column(0).amax() < 1e-3, "{}", j.tr_mul(&j));
        let twice = DMatrix::from_columns(&[
            j.column(0) * 2.0,
            j.column(1).into(),
            j.column(0) * -3.0,
            j.column(2).into(),
        ]);
        let groups = factor(&twice).err().expect("two columns are one");
        assert_eq!(groups, [[0, 2]]);
        let nothing = DMatrix::from_columns(&[j.column(0).into(), j.column(1) * 0.0]);
        assert_eq!(factor(&nothing).err().expect("a column is zero"), [[1]]);
    }
}
