//! The lowest modes of large banded K x = ω² M x.
//!
//! Subspace iteration (K.-J. Bathe, *Finite Element Procedures*, §11.6): K Y = M X is solved for a few more
//! vectors than are asked for, and the small problem in their span has the next X. Eigenvalue k converges by
//! (ω_k/ω_{q+1})⁴ a step. Ritz values come from Yᵀ(M X) and Yᵀ M Y, never from K Y again, so that those far
//! below ‖K‖ keep their digits. If K is singular (rigid-body modes), the iteration works with K + s M. A
//! count of the negative pivots of K − μ M with μ just above the last mode proves that none was missed
//! (Sylvester's law of inertia, §11.4 there); where one was, more vectors are taken.

use alloc::vec::Vec;

use nalgebra::{DMatrix, SymmetricEigen};

use super::VibrationError;
use super::banded::{Banded, BandedLdlt};

/// Most subspace iterations. Only modes whose frequencies hardly differ from that of the first mode outside
/// of the subspace need as many.
const MAX_SUBSPACE_ITERATIONS: usize = 200;
/// Relative change of a Ritz value at which it has converged: about 18 roundings.
const CONVERGED_RITZ_CHANGE: f64 = 4e-15;
/// Relative change from which on an iteration that no longer reduces it has reached rounding.
const STALLED_RITZ_CHANGE: f64 = 1e-11;
/// Iterations after convergence of the values. The error of the vectors is the root of that of the values.
const ITERATIONS_FOR_VECTORS: usize = 8;
/// Fewest iterations: the first Ritz values may agree by chance.
const MIN_SUBSPACE_ITERATIONS: usize = 3;
/// Vectors beyond the requested modes: as many again, up to this number (K.-J. Bathe).
const MAX_GUARD_VECTORS: usize = 8;
/// Fewest vectors that are added after a mode was missed.
const MIN_ADDED_VECTORS: usize = 4;
/// Shift of a singular K, relative to the largest ratio k_ii/m_ii. It costs digits of modes whose squared
/// frequency is far below it; a smaller shift leaves K + s M nearly singular.
const RELATIVE_SHIFT: f64 = 1e-6;
/// Shift that shows whether K is singular, relative to the largest ratio k_ii/m_ii: 45 roundings ε. A
/// larger shift treats weakly supported models as singular, which costs digits.
const SINGULARITY_SHIFT: f64 = 1e-14;
/// Most negative eigenvalue, relative to the shift, that counts as rounding of 0. K is refused if it has a
/// lower one, since the shift would otherwise hide an unstable mode.
const MAX_ROUNDING_OF_ZERO: f64 = 1e-7;
/// Relative distance above the last eigenvalue at which the eigenvalues below are counted. It exceeds the
/// error of the eigenvalue; modes within the gap count as one cluster.
const COUNTING_GAP: f64 = 1e-9;
/// Most places at which the count is tried: at an eigenvalue of K − μ M the factors do not exist.
const MAX_COUNTING_ATTEMPTS: usize = 8;
/// Distance of these places, relative to the gap.
const COUNTING_STEP: f64 = 0.1;
/// QR iterations per row of the small eigenvalue problem; only a limit.
const MAX_QR_ITERATIONS_PER_ROW: usize = 100;

/// The lowest modes.
#[derive(Clone, Debug, PartialEq)]
pub struct LowestModes {
    /// ω, ascending, in rad/s if M and K are in coherent units. Rigid-body modes have the square root of
    /// rounding.
    pub frequencies: Vec<f64>,
    /// Shapes, a column for each, normalised so that φᵀM φ = 1.
    pub shapes: DMatrix<f64>,
    /// ‖K φ − ω² M φ‖ relative to ‖|K| |φ|‖ + ω² ‖M φ‖, for each mode. Rounding is
    /// 1e-16.
    pub residuals: Vec<f64>,
    /// The number of eigenvalues up to the last of these, from a count of negative pivots. It proves that no
    /// mode was missed.
    pub counted: usize,
    /// Iterations made.
    pub iterations: usize,
}

/// The `count` lowest modes of K x = ω² M x; M positive definite, K positive semidefinite.
///
/// # Errors
/// Sizes that differ, fewer rows than modes, matrices that are not definite, modes that did not converge, or
/// that the count shows to be missing.
pub fn lowest_modes(mass: &Banded, stiffness: &Banded, count: usize) -> Result<LowestModes, VibrationError> {
    let n = mass.len();
    if n != stiffness.len() {
        let shapes = [(n, n), (stiffness.len(), stiffness.len())].into();
        return Err(VibrationError::Shapes { shapes });
    }
    if count == 0 {
        return Err(VibrationError::TooFew { what: "modes asked for", count, needed: 1 });
    }
    if n < count {
        return Err(VibrationError::TooFew { what: "rows of the matrices", count: n, needed: count });
    }
    if !mass.is_finite() || !stiffness.is_finite() {
        return Err(crate::LinearizeError::NotFinite.into());
    }
    let of_mass = mass.clone().factor().map_err(|row| VibrationError::NotDefinite { matrix: "mass", row })?;
    if let Some(row) = of_mass.first_negative() {
        return Err(VibrationError::NotDefinite { matrix: "mass", row });
    }
    let (factors, shift) = shifted(mass, stiffness)?;
    let mut vectors = (2 * count).min(count + MAX_GUARD_VECTORS).min(n);
    loop {
        let found = iterate(mass, stiffness, (&factors, shift), vectors, count)?;
        if found.counted == count {
            return Ok(found);
        }
        if vectors == n || found.counted < count {
            let residual = found.counted as f64 - count as f64;
            return Err(VibrationError::NoConvergence {
                what: "the set of lowest modes",
                iterations: found.iterations,
                residual,
            });
        }
        vectors = vectors.saturating_add(found.counted.saturating_sub(count).max(MIN_ADDED_VECTORS)).min(n);
    }
}

/// Factors of K + s M, and s; s = 0 if K is not nearly singular.
fn shifted(mass: &Banded, stiffness: &Banded) -> Result<(BandedLdlt, f64), VibrationError> {
    let n = mass.len();
    let stiffest = (0..n).map(|i| (stiffness.get(i, i) / mass.get(i, i)).abs()).fold(0.0, f64::max);
    let pivots = |factors: &BandedLdlt| factors.first_negative();
    if let Ok(factors) = stiffness.clone().factor() {
        // A shift by rounding makes a pivot negative that is only rounding.
        let least = stiffness.minus(SINGULARITY_SHIFT * stiffest, mass).factor();
        if pivots(&factors).is_none() && least.is_ok_and(|least| least.negative() == 0) {
            return Ok((factors, 0.0));
        }
    }
    let shift = if stiffness.is_zero() { 1.0 } else { RELATIVE_SHIFT * stiffest };
    let indefinite = |row| VibrationError::NotDefinite { matrix: "stiffness", row };
    // An unstable mode is refused: with the shift it would look like a rigid-body mode.
    let definite = |by: f64| {
        let factors = stiffness.minus(-by, mass).factor().map_err(indefinite)?;
        pivots(&factors).map_or(Ok(factors), |row| Err(indefinite(row)))
    };
    definite(MAX_ROUNDING_OF_ZERO * shift)?;
    Ok((definite(shift)?, shift))
}

/// Subspace iteration with `vectors` vectors until the lowest `count` Ritz values have converged.
fn iterate(
    mass: &Banded,
    stiffness: &Banded,
    (factors, shift): (&BandedLdlt, f64),
    vectors: usize,
    count: usize,
) -> Result<LowestModes, VibrationError> {
    let n = mass.len();
    // Each start vector is another mixture of all coordinates, so that none is orthogonal to a mode except by
    // chance.
    let seed = |i: usize, j: usize| {
        ((i + 1) as f64 * 1.324_717_957_2 * (j + 1) as f64).sin() + if i % vectors == j { 1.0 } else { 0.0 }
    };
    let mut x = DMatrix::from_fn(n, vectors, seed);
    let mut values = alloc::vec![f64::INFINITY; vectors];
    let mut change = f64::INFINITY;
    for iterations in 1..=MAX_SUBSPACE_ITERATIONS {
        let (then, ritz) = step(mass, factors, &x).ok_or(VibrationError::NoConvergence {
            what: "the subspace of the lowest modes",
            iterations,
            residual: change,
        })?;
        x = then;
        let changes = (0..count).map(|k| ((ritz[k] - values[k]) / ritz[k]).abs());
        let now = changes.fold(0.0, f64::max);
        values = ritz;
        let settled = now <= CONVERGED_RITZ_CHANGE || (now < STALLED_RITZ_CHANGE && now >= change);
        change = now;
        if settled && iterations >= MIN_SUBSPACE_ITERATIONS {
            for _ in 0..ITERATIONS_FOR_VECTORS {
                if let Some((then, ritz)) = step(mass, factors, &x) {
                    (x, values) = (then, ritz);
                }
            }
            return Ok(finish(mass, stiffness, (x, &values, shift), count, iterations));
        }
    }
    Err(VibrationError::NoConvergence {
        what: "the lowest modes",
        iterations: MAX_SUBSPACE_ITERATIONS,
        residual: change,
    })
}

/// X by one step, M-orthonormal, with the Ritz values of K + s M, ascending.
fn step(mass: &Banded, factors: &BandedLdlt, x: &DMatrix<f64>) -> Option<(DMatrix<f64>, Vec<f64>)> {
    let (n, q) = x.shape();
    let (mut y, mut right, mut of_y) = (DMatrix::zeros(n, q), DMatrix::zeros(n, q), DMatrix::zeros(n, q));
    for j in 0..q {
        let mut column = mass.times(x.column(j).as_slice());
        right.column_mut(j).copy_from_slice(&column);
        factors.solve(&mut column);
        // Scale to yᵀM y = 1, so that the small problem is well scaled.
        let product = mass.times(&column);
        let size = column.iter().zip(&product).map(|(a, b)| a * b).sum::<f64>().sqrt();
        right.column_mut(j).unscale_mut(size);
        y.column_mut(j).copy_from_slice(&column);
        y.column_mut(j).unscale_mut(size);
        of_y.column_mut(j).copy_from_slice(&product);
        of_y.column_mut(j).unscale_mut(size);
    }
    let (k, m) = (y.tr_mul(&right), y.tr_mul(&of_y));
    // M y = θ K y with θ = 1/λ: the lowest λ are the largest θ.
    let lower = (0.5 * (&m + m.transpose())).cholesky()?.unpack();
    let half = lower.solve_lower_triangular(&(0.5 * (&k + k.transpose())))?;
    let reduced = lower.solve_lower_triangular(&half.transpose())?;
    let eigen = SymmetricEigen::try_new(
        0.5 * (&reduced + reduced.transpose()),
        f64::EPSILON,
        MAX_QR_ITERATIONS_PER_ROW * q,
    )?;
    let mut order: Vec<usize> = (0..q).collect();
    order.sort_by(|i, j| eigen.eigenvalues[*i].total_cmp(&eigen.eigenvalues[*j]));
    let turned = lower.tr_solve_lower_triangular(&eigen.eigenvectors.select_columns(&order))?;
    let values: Vec<f64> = order.iter().map(|k| eigen.eigenvalues[*k]).collect();
    (values.iter().all(|value| value.is_finite())).then(|| (y * turned, values))
}

/// The modes from the vectors and the shifted Ritz values, with residuals and the count.
fn finish(
    mass: &Banded,
    stiffness: &Banded,
    (x, values, shift): (DMatrix<f64>, &[f64], f64),
    count: usize,
    iterations: usize,
) -> LowestModes {
    let squares: Vec<f64> = values.iter().take(count).map(|value| value - shift).collect();
    let sizes = absolute(stiffness);
    let residual = |k: usize| {
        let x = x.column(k);
        let (of_k, of_m) = (stiffness.times(x.as_slice()), mass.times(x.as_slice()));
        let left: f64 = of_k.iter().zip(&of_m).map(|(a, b)| (a - squares[k] * b).powi(2)).sum();
        let of_sizes = sizes.times(&x.iter().map(|x| x.abs()).collect::<Vec<_>>());
        let norm = |v: &[f64]| v.iter().map(|x| x * x).sum::<f64>().sqrt();
        left.sqrt() / (norm(&of_sizes) + squares[k].abs() * norm(&of_m))
    };
    LowestModes {
        residuals: (0..count).map(residual).collect(),
        counted: counted(mass, stiffness, values, shift, count),
        frequencies: squares.iter().map(|square| square.max(0.0).sqrt()).collect(),
        shapes: x.columns(0, count).into_owned(),
        iterations,
    }
}

/// The number of eigenvalues up to the last requested one, by the negative pivots of K − μ M with μ just
/// above it.
fn counted(mass: &Banded, stiffness: &Banded, values: &[f64], shift: f64, count: usize) -> usize {
    let last = values[count - 1];
    let gap = COUNTING_GAP * last;
    // Members of a cluster that goes on beyond the last requested mode were found and not requested.
    let beyond = values[count..].iter().filter(|value| **value <= last + 2.0 * gap).count();
    let mut above = last + gap;
    for _ in 0..MAX_COUNTING_ATTEMPTS {
        if let Ok(factors) = stiffness.minus(above - shift, mass).factor() {
            return factors.negative() - beyond.min(factors.negative());
        }
        above += COUNTING_STEP * gap;
    }
    usize::MAX
}

/// The matrix of absolute values.
fn absolute(of: &Banded) -> Banded {
    let mut found = Banded::zeros(of.len(), of.width());
    for i in 0..of.len() {
        for j in i.saturating_sub(of.width())..=i {
            // Cannot fail: the band is that of the matrix itself.
            let _ = found.add(i, j, of.get(i, j).abs());
        }
    }
    found
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The count shows that a mode is missing, and accepts a last mode that belongs to a pair.
    #[test]
    fn what_was_missed_is_counted() {
        let n = 12;
        let (mass, mut stiffness) = (Banded::diagonal(&[1.0; 12]), Banded::zeros(n, 1));
        for i in 0..n {
            stiffness.add(i, i, 2.0).expect("within the band");
            if i > 0 {
                stiffness.add(i, i - 1, -1.0).expect("within the band");
            }
        }
        let square = |k: usize| (2.0 * (k as f64 * core::f64::consts::PI / 26.0).sin()).powi(2);
        let all: Vec<f64> = (1..=n).map(square).collect();
        assert_eq!(counted(&mass, &stiffness, &all, 0.0, 4), 4);
        let missed = [&all[..2], &all[3..]].concat();
        assert_eq!(counted(&mass, &stiffness, &missed, 0.0, 4), 5);
        // Further members of a cluster are not missing.
        let pairs = Banded::diagonal(&[1.0, 1.0, 2.0, 2.0, 5.0]);
        assert_eq!(counted(&Banded::diagonal(&[1.0; 5]), &pairs, &[1.0, 1.0, 2.0, 2.0], 0.0, 3), 3);
    }
}
