//! The lowest modes of vibration about a state: K φ = ω² M φ.
//!
//! Subspace iteration: vectors X are replaced by (K − σ M)⁻¹ M X, and those by the Ritz vectors of the pencil
//! within their span. Modes that belong to one frequency are found together. The number of eigenvalues below
//! a shift between two Ritz values is that of the negative pivots of K − σ M (Sturm): it certifies that none
//! is missed. Source: Bathe, Wilson, Int. J. Num. Meth. Eng. 6 (1973) 213; Parlett, *The Symmetric Eigenvalue
//! Problem*, §3.3, §14.

use crate::constraints::{Rows, rows_at};
use crate::error::FamilyError;
use crate::failure::{FamilyErrorKind, check_state};
use crate::linalg::bordered::Bordered;
use crate::linalg::dense::symmetric_eigen;
use crate::linalg::order::Layout;
use crate::model::{FamilyModel, FamilyState};
use crate::tangent::{Coefficients, Tangent};

/// Most iterations with one subspace.
const MOST_ITERATIONS: usize = 400;
/// Relative change of the eigenvalues at which they have converged. Vectors have half of their digits then:
/// as many iterations again give them the others.
const ACCURACY: f64 = 1e-12;
/// Subspaces that are tried, each larger than the one before.
const MOST_SUBSPACES: usize = 3;
/// Relative distance of eigenvalues between which a shift can be placed.
const GAP: f64 = 1e-9;
/// Shifts that are tried, each a hundred times the one before.
const MOST_SHIFTS: usize = 3;
/// First shift below zero, in parts of the largest kᵢᵢ/mᵢᵢ, where K is not positive definite.
const FIRST_SHIFT: f64 = 1e-8;

/// A mode of vibration.
#[derive(Clone, Debug, PartialEq)]
pub struct FamilyMode {
    /// ω², negative for a motion that grows.
    pub omega_squared: f64,
    /// Displacements, one field after the other, with Σ φᵢ mᵢⱼ φⱼ = 1; the largest of them is positive.
    pub shape: Vec<f64>,
}

impl FamilyMode {
    /// ω in radians per unit of time; NaN for a motion that grows.
    #[must_use]
    pub fn frequency(&self) -> f64 {
        self.omega_squared.sqrt()
    }
}

/// The `count` lowest modes, rising.
pub(crate) fn modes<M: FamilyModel>(
    model: &M,
    state: &M::State,
    count: usize,
) -> Result<Vec<FamilyMode>, FamilyError<M>> {
    let failed = |kind: FamilyErrorKind| FamilyError::before(kind, state.t());
    let ends = model.ends().map_err(|error| failed(error.into()))?;
    check_state::<M>(state, &ends).map_err(failed)?;
    let n = state.q().len();
    let rows = rows_at(model, state, &vec![0.0; n], &ends).map_err(failed)?;
    let tangent = Tangent::new(model, state.view(), &ends, rows.as_ref()).map_err(failed)?;
    let free = n.saturating_sub(tangent.rows);
    let count = count.min(free);
    let mut pencil = Pencil { model, state, tangent, rows };
    let mode = |layout: &Layout, square: f64, vector: &mut dyn Iterator<Item = f64>| {
        let mut shape = vec![0.0; n];
        // Behind the coordinates there are multipliers.
        let placed = layout.unknown.iter().zip(vector).filter(|&(&unknown, _)| unknown < n);
        placed.for_each(|(&unknown, value)| shape[unknown] = value);
        let largest = shape.iter().fold(0.0f64, |most, x| if x.abs() > most.abs() { *x } else { most });
        if largest < 0.0 {
            shape.iter_mut().for_each(|x| *x = -*x);
        }
        FamilyMode { omega_squared: square, shape }
    };
    if smallest_subspace(count) >= n && pencil.rows.is_none() {
        // The subspace would be the whole space, and dense matrices miss nothing.
        let (squares, vectors) = pencil.whole().map_err(failed)?;
        let layout = &pencil.tangent.layout;
        let column = |k: usize| (0..n).map(move |i| i * n + k);
        let all = (0..count).map(|k| mode(layout, squares[k], &mut column(k).map(|at| vectors[at])));
        return Ok(all.collect());
    }
    let mut shift = pencil.shift_below_all().map_err(failed)?;
    let (mut found, mut round, mut shifts) = (0, 0, 0);
    while round < MOST_SUBSPACES {
        let size = (smallest_subspace(count) << round).min(free);
        pencil.factor(shift).map_err(failed)?;
        let (squares, vectors) = match pencil.iterate(shift, count, size) {
            Ok(iterated) => iterated,
            Err(NoRitzValues::Dependent) if shifts < MOST_SHIFTS => {
                // A shift that is close to the lowest eigenvalue leaves that mode alone of all vectors.
                shift = if shift == 0.0 { -FIRST_SHIFT * pencil.scale() } else { 100.0 * shift };
                shifts += 1;
                continue;
            }
            Err(_) => {
                round += 1;
                continue;
            }
        };
        round += 1;
        found = count;
        if pencil.certify(&squares, count).map_err(failed)? {
            let layout = &pencil.tangent.layout;
            let all = (0..count).map(|k| mode(layout, squares[k], &mut vectors[k].iter().copied()));
            return Ok(all.collect());
        }
    }
    Err(failed(FamilyErrorKind::ModesMissing { found, wanted: count }))
}

/// Vectors of the first subspace.
fn smallest_subspace(count: usize) -> usize {
    2 * count + 8
}

/// Why an iteration has no result.
enum NoRitzValues {
    /// Vectors that are not independent to rounding.
    Dependent,
    /// It does not converge.
    Slow,
}

struct Pencil<'a, M: FamilyModel> {
    model: &'a M,
    state: &'a M::State,
    tangent: Tangent,
    rows: Option<Rows>,
}

impl<M: FamilyModel> Pencil<'_, M> {
    /// Factors K − shift M, and counts its eigenvalues below zero and whether one is zero.
    fn factor(&mut self, shift: f64) -> Result<(usize, bool), FamilyErrorKind> {
        let weights = Coefficients { mass: -shift, damping: 0.0, stiffness: 1.0 };
        self.tangent.assemble(self.model, self.state.view(), weights, self.rows.as_ref())?;
        self.tangent.inertia().ok_or(FamilyErrorKind::NotSymmetric {
            matrix: "tangent stiffness",
            remedy: "so its modes are not real; simulate a small disturbance instead",
        })
    }

    /// All eigenvalues, rising, and eigenvectors by columns, in the order of places, from dense matrices.
    fn whole(&mut self) -> Result<(Vec<f64>, Vec<f64>), FamilyErrorKind> {
        let weights = Coefficients { mass: 0.0, damping: 0.0, stiffness: 1.0 };
        self.tangent.assemble(self.model, self.state.view(), weights, self.rows.as_ref())?;
        let n = self.tangent.diagonal.len();
        let dense = |matrix: &Bordered| {
            let mut all = vec![0.0; n * n];
            matrix.for_each_row(|i, diagonal, others| {
                all[i * n + i] = diagonal;
                others.for_each(|(j, entry)| all[i * n + j] = entry);
            });
            all
        };
        let (stiffness, mass) = (dense(&self.tangent.matrix), dense(&self.tangent.mass));
        // Says that the matrix is not symmetric.
        self.factor(0.0)?;
        small_pencil(stiffness, mass, n).ok_or(FamilyErrorKind::Singular {
            matrix: "mass matrix",
            coordinate: String::new(),
            remedy: "give each node a positive mass",
        })
    }

    /// The largest kᵢᵢ/mᵢᵢ of the last matrix: eigenvalues are known to the rounding of this.
    fn scale(&self) -> f64 {
        let mut scale = 0.0f64;
        let (layout, diagonal) = (&self.tangent.layout, &self.tangent.diagonal);
        self.tangent.matrix.for_each_row(|place, entry, _| {
            let mass = diagonal[layout.unknown[place]];
            if mass > 0.0 {
                scale = scale.max(entry.abs() / mass);
            }
        });
        scale
    }

    /// A shift below all eigenvalues: 0 where K is positive definite.
    fn shift_below_all(&mut self) -> Result<f64, FamilyErrorKind> {
        if self.factor(0.0)? == (0, false) {
            return Ok(0.0);
        }
        let scale = self.scale();
        let mut shift = -FIRST_SHIFT * if scale > 0.0 { scale } else { 1.0 };
        for _ in 0..24 {
            if self.factor(shift)? == (0, false) {
                return Ok(shift);
            }
            shift *= 10.0;
        }
        Err(FamilyErrorKind::Singular {
            matrix: "mass matrix",
            coordinate: String::new(),
            remedy: "give each node a positive mass",
        })
    }

    /// Ritz values, rising, and vectors in the order of places, from factors of K − shift M.
    fn iterate(
        &mut self,
        shift: f64,
        count: usize,
        size: usize,
    ) -> Result<(Vec<f64>, Vec<Vec<f64>>), NoRitzValues> {
        let n = self.tangent.diagonal.len();
        let rounding = f64::EPSILON * self.scale();
        // Numbers without a pattern: no mode is orthogonal to them.
        let mut seed = 0x9e37_79b9_7f4a_7c15u64;
        let mut random = || {
            seed ^= seed << 13;
            seed ^= seed >> 7;
            seed ^= seed << 17;
            (seed >> 11) as f64 / (1u64 << 53) as f64 - 0.5
        };
        let mut x: Vec<Vec<f64>> = (0..size).map(|_| (0..n).map(|_| random()).collect()).collect();
        let mut of_mass = vec![vec![0.0; n]; size];
        let mut values = vec![f64::INFINITY; size];
        let mut last = MOST_ITERATIONS;
        let mut iteration = 0;
        while iteration < last {
            iteration += 1;
            for (x, mx) in x.iter_mut().zip(&mut of_mass) {
                self.tangent.mass.multiply(x, mx);
                x.copy_from_slice(mx);
                self.tangent.solve_ordered(x);
            }
            // With Y = (K − σM)⁻¹ M X: Yᵀ (K − σM) Y = Yᵀ M X.
            let stiffness = products(&x, &of_mass);
            for (x, mx) in x.iter().zip(&mut of_mass) {
                self.tangent.mass.multiply(x, mx);
            }
            let mass = products(&x, &of_mass);
            let (ritz, combination) = small_pencil(stiffness, mass, size).ok_or(NoRitzValues::Dependent)?;
            x = combine(&x, &combination);
            let settled = ritz[..count]
                .iter()
                .zip(&values)
                .all(|(new, old)| (new - old).abs() <= ACCURACY * new.abs() + rounding);
            values = ritz;
            if settled && last == MOST_ITERATIONS {
                last = (2 * iteration).min(MOST_ITERATIONS - 1);
            }
        }
        if last == MOST_ITERATIONS {
            return Err(NoRitzValues::Slow);
        }
        Ok((values.into_iter().map(|value| value + shift).collect(), x))
    }

    /// Whether as many eigenvalues as Ritz values lie below a shift at or behind the last that is asked for.
    fn certify(&mut self, squares: &[f64], count: usize) -> Result<bool, FamilyErrorKind> {
        if count == squares.len() {
            return Ok(true);
        }
        // Eigenvalues that are alike are counted together.
        let gap =
            |k: &usize| squares[*k] - squares[k - 1] > GAP * squares[*k].abs().max(squares[k - 1].abs());
        let Some(below) = (count..squares.len()).find(gap) else { return Ok(false) };
        // Ritz values behind those that converged are too large: the shift stays near the one before.
        let (low, high) = (squares[below - 1], squares[below]);
        let shift = if below == count { low + 0.1 * (high - low) } else { 0.5 * (low + high) };
        Ok(self.factor(shift)?.0 == below)
    }
}

/// All inner products.
fn products(x: &[Vec<f64>], y: &[Vec<f64>]) -> Vec<f64> {
    let size = x.len();
    let mut all = vec![0.0; size * size];
    for i in 0..size {
        for j in 0..=i {
            let product = crate::generated::sum(0..x[i].len(), |k| x[i][k] * y[j][k]);
            all[i * size + j] = product;
            all[j * size + i] = product;
        }
    }
    all
}

/// Eigenvalues and eigenvectors (by columns) of a small pencil, by the root of its mass matrix.
fn small_pencil(stiffness: Vec<f64>, mass: Vec<f64>, n: usize) -> Option<(Vec<f64>, Vec<f64>)> {
    // Scaled to a diagonal of ones, so that vectors of any length are equally independent.
    let scale: Vec<f64> = (0..n).map(|i| 1.0 / mass[i * n + i].sqrt()).collect();
    let mut scaled: Vec<f64> = (0..n * n).map(|k| mass[k] * scale[k / n] * scale[k % n]).collect();
    let (sizes, axes) = symmetric_eigen(&mut scaled, n);
    if !sizes.first().is_some_and(|&least| least > 0.0) {
        return None;
    }
    // W with Wᵀ M W = 1.
    let w: Vec<f64> = (0..n * n).map(|k| scale[k / n] * axes[k] / sizes[k % n].sqrt()).collect();
    let half = multiply(&stiffness, &w, n);
    let mut reduced = multiply(&transposed(&w, n), &half, n);
    let (values, vectors) = symmetric_eigen(&mut reduced, n);
    Some((values, multiply(&w, &vectors, n)))
}

fn transposed(a: &[f64], n: usize) -> Vec<f64> {
    (0..n * n).map(|k| a[(k % n) * n + k / n]).collect()
}

fn multiply(a: &[f64], b: &[f64], n: usize) -> Vec<f64> {
    let entry = |k: usize| (0..n).map(|l| a[(k / n) * n + l] * b[l * n + k % n]).sum();
    (0..n * n).map(entry).collect()
}

/// The vectors X V.
fn combine(x: &[Vec<f64>], v: &[f64]) -> Vec<Vec<f64>> {
    let size = x.len();
    let column = |k: usize| {
        let mut sum = vec![0.0; x[0].len()];
        for (l, x) in x.iter().enumerate() {
            let weight = v[l * size + k];
            sum.iter_mut().zip(x).for_each(|(sum, x)| *sum += weight * x);
        }
        sum
    };
    (0..size).map(column).collect()
}
