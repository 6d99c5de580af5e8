//! Gradients of the constraints at a state, rows that vanish, and distances from the constraints.
//!
//! A row of Φ_q may be zero at a change point, where the branches of a mechanism cross. In floating point it
//! is then rounding noise, which must not be scaled to unit length. So a short row is compared with its
//! *usual length*: how much it grows per unit of the coordinates' size, measured at a [`nearby_state`]. The
//! distance of a state from a constraint is |Φ|/‖Φ_q‖ to first order.

use super::nearby::{NEARBY_DISTANCE, nearby_state};
#[cfg(feature = "alloc")]
use crate::linalg::dot;
use crate::linalg::{max_abs, norm};
#[cfg(feature = "alloc")]
use crate::math;
use crate::model::{Constraints, Terms, Vector};

/// Φ_q by rows, in a workspace that the caller lends, because by value it may be too large for a stack. Rows
/// that have vanished are zero.
pub(crate) struct Gradients<'w> {
    /// Row by row.
    pub(crate) rows: &'w [f64],
    /// The usual length of each row: see [`terms`].
    pub(crate) usual_lengths: &'w [f64],
    n: usize,
}

/// Most numbers of a matrix that is returned by value, on the stack: 8 kB.
const MAX_NUMBERS_ON_STACK: usize = 1024;

/// Length of the workspace of [`Gradients`].
pub(crate) const fn workspace_len(n: usize, r: usize) -> usize {
    n * n + n + r * n + 2 * r
}

impl<'w> Gradients<'w> {
    /// Φ_q of all rows at a state, active or not.
    pub(crate) fn of<M: Constraints>(model: &M, state: &M::State, workspace: &'w mut [f64]) -> Self {
        let (n, r) = (M::Vector::LEN, M::Rows::LEN);
        let (mass, remaining) = workspace.split_at_mut(n * n);
        let (force, remaining) = remaining.split_at_mut(n);
        let (jacobian, remaining) = remaining.split_at_mut(r * n);
        let (gamma, remaining) = remaining.split_at_mut(r);
        let usual_lengths = &mut remaining[..r];
        // The model does not write entries that are always zero.
        jacobian.fill(0.0);
        terms(model, state, &mut Terms { mass, force, jacobian, gamma }, usual_lengths);
        Self { rows: jacobian, usual_lengths, n }
    }

    /// The same, without M, Q and γ where the model is small enough: for callers that evaluate it often.
    pub(crate) fn alone<M: Constraints>(model: &M, state: &M::State, workspace: &'w mut [f64]) -> Self {
        // A function of its own, so that only its call needs stack for the matrix.
        #[inline(never)]
        fn by_value<M: Constraints>(model: &M, state: &M::State, rows: &mut [f64]) {
            let jacobian = model.jacobian(state);
            for (i, row) in rows.chunks_exact_mut(M::Vector::LEN).enumerate() {
                row.iter_mut().enumerate().for_each(|(j, x)| *x = jacobian[(i, j)]);
            }
        }
        let (n, r) = (M::Vector::LEN, M::Rows::LEN);
        if n * r > MAX_NUMBERS_ON_STACK {
            return Self::of(model, state, workspace);
        }
        let (rows, remaining) = workspace.split_at_mut(r * n);
        let usual_lengths = &mut remaining[..r];
        by_value(model, state, rows);
        if has_short_row(rows, n) {
            let nearby_state = nearby_state::<M>(state);
            let mut lengths_here = M::Rows::zeros();
            measure_lengths(rows, n, lengths_here.as_mut_slice());
            by_value(model, &nearby_state, rows);
            measure_lengths(rows, n, usual_lengths);
            by_value(model, state, rows);
            clear_vanished_rows(rows, n, lengths_here.as_slice(), usual_lengths);
        } else {
            usual_lengths.fill(0.0);
        }
        Self { rows, usual_lengths, n }
    }

    /// The gradient of a row.
    pub(crate) fn row(&self, row: usize) -> &[f64] {
        &self.rows[row * self.n..][..self.n]
    }

    /// [`distance`] of a row.
    pub(crate) fn distance(&self, row: usize, residual: f64) -> f64 {
        distance(residual, self.row(row), self.usual_lengths[row])
    }
}

/// A row has vanished where its length is below this part of its usual length. At a distance d from the place
/// where a row vanishes, velocities along the direction that it leaves open are known to ε/d and
/// accelerations to ε/d²: to no digit at d = 10⁻⁸. What is left of the row there is rounding, for
/// example that of sin π. Scaled to unit length it would count as a constraint.
const VANISHED_LENGTH_RATIO: f64 = 1e-8;

/// A row is tested for that only where it is shorter than this part of the longest row, or of 1. Otherwise
/// every evaluation would need a second one for the usual lengths. A larger value costs such evaluations, a
/// smaller one would miss vanished rows in models whose rows differ in units.
const SHORT_LENGTH_RATIO: f64 = 1e-6;

/// Evaluates M, Q, Φ_q and γ at a state, and sets rows of Φ_q to zero where they have vanished.
/// `usual_lengths` receives the length of each row per unit of the coordinates' size, as [`nearby_state`]
/// shows it; 0 where no row is short. Entries of `terms` that the model does not write must be zero.
pub(crate) fn terms<M: Constraints>(
    model: &M,
    state: &M::State,
    terms: &mut Terms<'_>,
    usual_lengths: &mut [f64],
) {
    model.terms(state, terms);
    let n = M::Vector::LEN;
    if !has_short_row(terms.jacobian, n) {
        usual_lengths.fill(0.0);
        return;
    }
    let mut lengths_here = M::Rows::zeros();
    measure_lengths(terms.jacobian, n, lengths_here.as_mut_slice());
    model.terms(&nearby_state::<M>(state), terms);
    measure_lengths(terms.jacobian, n, usual_lengths);
    model.terms(state, terms);
    clear_vanished_rows(terms.jacobian, n, lengths_here.as_slice(), usual_lengths);
}

/// Whether a row may have vanished.
fn has_short_row(rows: &[f64], n: usize) -> bool {
    let sizes = rows.chunks_exact(n.max(1)).map(max_abs);
    let (least, most) = sizes.fold((f64::INFINITY, 1.0_f64), |(least, most), x| (least.min(x), most.max(x)));
    least < SHORT_LENGTH_RATIO * most
}

fn measure_lengths(rows: &[f64], n: usize, lengths: &mut [f64]) {
    lengths.iter_mut().zip(rows.chunks_exact(n)).for_each(|(length, row)| *length = norm(row));
}

/// Sets vanished rows to zero. `usual_lengths`: the lengths at the nearby state, which are converted to usual
/// lengths.
fn clear_vanished_rows(rows: &mut [f64], n: usize, lengths_here: &[f64], usual_lengths: &mut [f64]) {
    for ((row, length_here), usual_length) in rows.chunks_exact_mut(n).zip(lengths_here).zip(usual_lengths) {
        // Near the place where a row vanishes it grows with the distance.
        *usual_length /= NEARBY_DISTANCE;
        if length_here.is_finite() && *length_here <= VANISHED_LENGTH_RATIO * *usual_length {
            row.fill(0.0);
        }
    }
}

/// M at a state by rows, in a workspace that the caller lends. Without Q, Φ_q and γ where the model is
/// small enough.
#[cfg(feature = "alloc")]
pub(crate) fn mass<'w, M: Constraints>(model: &M, state: &M::State, workspace: &'w mut [f64]) -> &'w [f64] {
    #[inline(never)]
    fn by_value<M: Constraints>(model: &M, state: &M::State, rows: &mut [f64]) {
        let mass = model.mass_matrix(state);
        for (i, row) in rows.chunks_exact_mut(M::Vector::LEN).enumerate() {
            row.iter_mut().enumerate().for_each(|(j, x)| *x = mass[(i, j)]);
        }
    }
    let n = M::Vector::LEN;
    if n * n <= MAX_NUMBERS_ON_STACK {
        by_value(model, state, &mut workspace[..n * n]);
    } else {
        workspace[..n * n].fill(0.0);
        Gradients::of(model, state, workspace);
    }
    &workspace[..n * n]
}

/// A pivot of M counts as positive above this part of its diagonal element. The rounding of the elimination
/// is of the order of n ε, far smaller.
#[cfg(feature = "alloc")]
const POSITIVE_PIVOT_RATIO: f64 = 1e-8;

/// Whether M is certainly positive definite at a state, and so along every direction that constraints leave
/// free. Cholesky's elimination of M alone takes a thirtieth of the time of the general solver on Andrews'
/// mechanism.
#[cfg(feature = "alloc")]
pub(crate) fn is_positive<M: Constraints>(model: &M, state: &M::State, workspace: &mut [f64]) -> bool {
    let n = M::Vector::LEN;
    mass(model, state, workspace);
    has_positive_pivots(&mut workspace[..n * n], n)
}

/// Cholesky's elimination of a symmetric matrix, row by row, of which only the lower triangle is read and
/// overwritten. What is left of the first entry of a row stays zero, so that a diagonal matrix takes n²
/// operations.
#[cfg(feature = "alloc")]
fn has_positive_pivots(matrix: &mut [f64], n: usize) -> bool {
    for i in 0..n {
        let (above, row) = matrix.split_at_mut(i * n);
        let first = row[..i].iter().position(|entry| *entry != 0.0).unwrap_or(i);
        for j in first..i {
            let other = &above[j * n..][..n];
            row[j] = (row[j] - dot(&row[first..j], &other[first..j])) / other[j];
        }
        let pivot = row[i] - dot(&row[first..i], &row[first..i]);
        if pivot > POSITIVE_PIVOT_RATIO * row[i] {
            row[i] = math::sqrt(pivot);
        } else {
            return false;
        }
    }
    true
}

/// Length of a vanished row, in parts of its usual length, in the distance from its constraint. The rounding
/// of a residual then gives a small distance, and a residual that no state on the constraint has gives a
/// large one. A smaller value would report rounding as a distance, a larger one would accept such residuals.
const VANISHED_ROW_LENGTH: f64 = 1e-4;

/// |residual|/‖gradient‖, the distance of a state from a row's constraint. It is 0 where the residual is
/// 0, and infinite where the gradient vanishes here and at the nearby state. `usual_length`: that of the
/// row, see [`terms`].
pub(crate) fn distance(residual: f64, gradient: &[f64], usual_length: f64) -> f64 {
    let length = norm(gradient);
    if residual == 0.0 {
        0.0
    } else if length == 0.0 {
        residual.abs() / (VANISHED_ROW_LENGTH * usual_length)
    } else {
        residual.abs() / length
    }
}

#[cfg(all(test, feature = "alloc"))]
mod tests {
    use nalgebra::DMatrix;

    use super::has_positive_pivots;

    /// By rows, as the workspace has them.
    fn verdict(matrix: &DMatrix<f64>) -> bool {
        has_positive_pivots(&mut matrix.transpose().as_slice().to_vec(), matrix.nrows())
    }

    /// Diagonal, banded, arrow and full matrices, as they are and with one pivot that is zero or negative,
    /// against the smallest eigenvalue.
    #[test]
    fn pivots_are_positive_where_all_eigenvalues_are() {
        let shapes: [fn(usize, usize) -> bool; 4] =
            [|i, j| i == j, |i, j| i.abs_diff(j) <= 1, |i, j| i == j || i.max(j) == 8, |_, _| true];
        let (mut positive, mut others) = (0, 0);
        for shape in shapes {
            for shift in [3.0, 1.5, 1.0, 0.6, 0.2, 0.0, -0.4] {
                let entry = |i: usize, j: usize| 0.5 * ((3 * i * j + i + j) as f64).sin();
                let plain = |i, j| if shape(i, j) { entry(i, j) } else { 0.0 };
                let matrix = DMatrix::from_fn(9, 9, |i, j| plain(i, j) + if i == j { shift } else { 0.0 });
                let smallest = matrix.clone().symmetric_eigenvalues().min();
                assert!(smallest.abs() > 1e-6, "{smallest} decides nothing");
                assert_eq!(verdict(&matrix), smallest > 0.0, "{shift}: {matrix}");
                if smallest > 0.0 { positive += 1 } else { others += 1 }
            }
        }
        assert!(positive >= 8 && others >= 8, "{positive} and {others}");
    }

    #[test]
    fn singular_matrices_and_nan_are_not_positive() {
        for n in 1..6 {
            let ones = DMatrix::from_element(n, n, 1.0);
            assert_eq!(verdict(&ones), n == 1);
            for at in 0..n {
                let mut matrix = DMatrix::identity(n, n);
                matrix[(n - 1, at)] = f64::NAN;
                assert!(!verdict(&matrix), "{at} of {n}");
            }
        }
        assert!(has_positive_pivots(&mut [], 0));
    }
}
