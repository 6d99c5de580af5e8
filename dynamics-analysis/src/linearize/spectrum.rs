//! Eigenvalues of small motions.
//!
//! An undamped conservative system has the real eigenvalues of a symmetric problem, solved by Cholesky and
//! Jacobi or QR; pairs ±iω are then exact. Any other state matrix is balanced, and split by its block
//! triangular form. So a cyclic coordinate, such as the place of a vehicle on a plane, has the eigenvalue 0
//! exactly, not the square root of rounding that a defective double 0 gives (Duff, Erisman & Reid, *Direct
//! Methods for Sparse Matrices*, chapter 6). Elements below n ε of the matrix count as zero, which changes it
//! no more than the QR iteration does that follows.

use alloc::vec::Vec;

use nalgebra::linalg::{Schur, SymmetricEigen, balancing};
use nalgebra::{Complex, DMatrix, DVector};

use super::{Linearization, LinearizeError};

/// Most QR iterations per row of a matrix. A row takes two or three as a rule; the limit only ends iterations
/// that would not end.
const MAX_QR_ITERATIONS_PER_ROW: usize = 300;
/// Relative distance, in parts of the largest eigenvalue, up to which real parts count as equal for the order
/// of the eigenvalues.
const EQUAL_REAL_PARTS: f64 = 1e-12;

/// The eigenvalues, by growing real part, then imaginary part.
pub(super) fn eigenvalues(linear: &Linearization) -> Result<Vec<Complex<f64>>, LinearizeError> {
    let mut found = match undamped_modes(linear)? {
        Some((squares, _)) => squares.iter().flat_map(|square| pair(*square)).collect(),
        None => matrix_eigenvalues(linear.state_matrix()?)?,
    };
    // Real parts that are equal up to rounding count as equal, so that conjugates are neighbours.
    let size = found.iter().map(|x: &Complex<f64>| x.norm()).fold(0.0, f64::max);
    let key = |x: f64| if size > 0.0 { (x / (EQUAL_REAL_PARTS * size)).round() } else { 0.0 };
    found.sort_by(|a, b| key(a.re).total_cmp(&key(b.re)).then(a.im.total_cmp(&b.im)));
    Ok(found)
}

/// The two eigenvalues of ẍ + `square` x = 0.
fn pair(square: f64) -> [Complex<f64>; 2] {
    let root = square.abs().sqrt();
    let one = if square < 0.0 { Complex::new(root, 0.0) } else { Complex::new(0.0, root) };
    // Never −0.
    [one, Complex::new(0.0 - one.re, 0.0 - one.im)]
}

/// ω², ascending, and the vectors of K x = ω² M x, orthonormal in M.
pub(crate) type Undamped = (DVector<f64>, DMatrix<f64>);

/// The stiffness matrix if it is the second derivative of a potential: symmetric up to rounding, and without
/// nonholonomic rows.
pub(crate) fn potential_stiffness(linear: &Linearization) -> Option<DMatrix<f64>> {
    let (stiffness, circulatory) = (linear.conservative()?, linear.circulatory()?);
    let n = stiffness.nrows();
    let rounding = n as f64 * 4.0 * f64::EPSILON;
    let skew = |i: usize, j: usize| {
        circulatory[(i, j)].abs()
            > rounding * (stiffness[(i, i)] * stiffness[(j, j)]).abs().sqrt().max(stiffness[(i, j)].abs())
    };
    let rolls = linear.rates_by_coordinates.iter().any(|x| *x != 0.0);
    let none = n == 0 || rolls || (0..n).any(|i| (0..n).any(|j| skew(i, j)));
    (!none).then_some(stiffness)
}

/// The squared frequencies and modes of an undamped conservative system; `None` of any other system.
pub(crate) fn undamped_modes(linear: &Linearization) -> Result<Option<Undamped>, LinearizeError> {
    let Some(stiffness) = potential_stiffness(linear).filter(|_| linear.damping.iter().all(|x| *x == 0.0))
    else {
        return Ok(None);
    };
    let n = stiffness.nrows();
    let rounding = n as f64 * 4.0 * f64::EPSILON;
    // M = L Lᵀ reduces the problem to the symmetric matrix L⁻¹ K L⁻ᵀ.
    let lower = linear.mass.clone().cholesky().ok_or(LinearizeError::Inertia)?.unpack();
    let half = lower.solve_lower_triangular(&stiffness).ok_or(LinearizeError::Inertia)?;
    let reduced = lower.solve_lower_triangular(&half.transpose()).ok_or(LinearizeError::Inertia)?;
    let reduced = 0.5 * (&reduced + reduced.transpose());
    let sizes = reduced.abs();
    let (values, vectors) = symmetric_eigen_by_blocks(&reduced)?;
    let mut order: Vec<usize> = (0..n).collect();
    order.sort_by(|i, j| values[*i].total_cmp(&values[*j]));
    // The square of a rigid-body mode is 0, not rounding. The rounding is that of the terms of vᵀKv, not
    // that of the stiffest mode.
    let square = |i: usize| {
        let v = vectors.column(i).abs();
        if values[i].abs() <= rounding * v.dot(&(&sizes * &v)) { 0.0 } else { values[i] }
    };
    let squares = DVector::from_fn(n, |k, _| square(order[k]));
    let vectors = vectors.select_columns(&order);
    let vectors = lower.tr_solve_lower_triangular(&vectors).ok_or(LinearizeError::Inertia)?;
    Ok(Some((squares, vectors)))
}

/// Eigenvalues and vectors of a symmetric matrix, each uncoupled block by itself. In one matrix with a part
/// that is 1/ε times as stiff, the QR iteration would drop the coupling of soft parts and mix their vectors.
fn symmetric_eigen_by_blocks(of: &DMatrix<f64>) -> Result<Undamped, LinearizeError> {
    let n = of.nrows();
    let (mut values, mut vectors) = (DVector::zeros(n), DMatrix::zeros(n, n));
    let mut k = 0;
    for block in blocks(of) {
        let part = of.select_rows(&block).select_columns(&block);
        let eigen = SymmetricEigen::try_new(part, f64::EPSILON, MAX_QR_ITERATIONS_PER_ROW * block.len());
        let eigen = eigen.ok_or(LinearizeError::NoConvergence { size: block.len() })?;
        for (value, vector) in eigen.eigenvalues.iter().zip(eigen.eigenvectors.column_iter()) {
            values[k] = *value;
            block.iter().zip(vector.iter()).for_each(|(i, x)| vectors[(*i, k)] = *x);
            k += 1;
        }
    }
    Ok((values, vectors))
}

/// The eigenvalues of any matrix, in no particular order. Uncoupled blocks are separated first, so that soft
/// parts are not compared with stiff ones. Balancing uses the whole matrix, because balancing a block that is
/// only rounding would make it as large as the rest.
pub(crate) fn matrix_eigenvalues(mut a: DMatrix<f64>) -> Result<Vec<Complex<f64>>, LinearizeError> {
    if a.is_empty() {
        return Ok(Vec::new());
    }
    balancing::balance_parlett_reinsch(&mut a);
    let mut found = Vec::with_capacity(a.nrows());
    for block in blocks(&a) {
        let part = DMatrix::from_fn(block.len(), block.len(), |i, j| a[(block[i], block[j])]);
        found.extend(block_eigenvalues(part)?);
    }
    Ok(found)
}

/// The eigenvalues of a block of a balanced matrix. Its rows may be coupled only by rounding, so it is split
/// again after rounding is dropped.
fn block_eigenvalues(mut a: DMatrix<f64>) -> Result<Vec<Complex<f64>>, LinearizeError> {
    drop_rounding(&mut a);
    let mut found = Vec::with_capacity(a.nrows());
    for block in blocks(&a) {
        if let [i] = block[..] {
            found.push(Complex::new(a[(i, i)], 0.0));
            continue;
        }
        let part = DMatrix::from_fn(block.len(), block.len(), |i, j| a[(block[i], block[j])]);
        let schur = Schur::try_new(part, f64::EPSILON, MAX_QR_ITERATIONS_PER_ROW * block.len());
        let schur = schur.ok_or(LinearizeError::NoConvergence { size: block.len() })?;
        found.extend(schur.complex_eigenvalues().iter());
    }
    Ok(found)
}

/// Sets elements to zero that are rounding, up to n ε ‖A‖: the QR iteration changes the matrix by as
/// much.
pub(crate) fn drop_rounding(a: &mut DMatrix<f64>) {
    let least = a.nrows() as f64 * f64::EPSILON * a.norm();
    a.iter_mut().filter(|x| x.abs() <= least).for_each(|x| *x = 0.0);
}

/// The strongly connected components of the graph of a matrix (j → i where a_ij ≠ 0): the blocks of its
/// block triangular form. By Warshall's transitive closure, O(n³) like the eigenvalues themselves.
pub(super) fn blocks(a: &DMatrix<f64>) -> Vec<Vec<usize>> {
    let n = a.nrows();
    let mut reaches = DMatrix::from_fn(n, n, |i, j| i == j || a[(i, j)] != 0.0);
    for k in 0..n {
        for i in 0..n {
            if reaches[(i, k)] {
                for j in 0..n {
                    reaches[(i, j)] |= reaches[(k, j)];
                }
            }
        }
    }
    let together = |i: usize, j: usize| reaches[(i, j)] && reaches[(j, i)];
    let first = |i: &usize| (0..*i).all(|j| !together(*i, j));
    (0..n).filter(first).map(|i| (i..n).filter(|j| together(i, *j)).collect()).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sorted(mut values: Vec<Complex<f64>>) -> Vec<Complex<f64>> {
        values.sort_by(|a, b| a.re.total_cmp(&b.re).then(a.im.total_cmp(&b.im)));
        values
    }

    #[test]
    fn defective_matrices_come_to_an_end() {
        // A Jordan block of four zeros, triangular: exact. A similar one that is full: the fourth root of
        // rounding, and an end.
        let jordan = DMatrix::from_fn(4, 4, |i, j| if j == i + 1 { 1.0 } else { 0.0 });
        assert!(
            matrix_eigenvalues(jordan.clone())
                .expect("blocks of one")
                .iter()
                .all(|x| *x == Complex::new(0.0, 0.0))
        );
        let q = DMatrix::from_fn(4, 4, |i, j| 1.0 / (1.0 + i as f64 + j as f64)).qr().q();
        let full = &q * jordan * q.transpose();
        let found = matrix_eigenvalues(full).expect("it settles");
        assert_eq!(found.len(), 4);
        assert!(found.iter().all(|x| x.norm() < 1e-3), "{found:?}");
    }

    #[test]
    fn blocks_are_solved_apart() {
        // Two oscillators, the first drives the second; and a coordinate on which nothing depends.
        let mut a = DMatrix::zeros(5, 5);
        (a[(0, 1)], a[(1, 0)], a[(2, 3)], a[(3, 2)], a[(3, 0)], a[(4, 2)]) = (1.0, -4.0, 1.0, -9.0, 0.5, 7.0);
        assert_eq!(blocks(&a), [vec![0, 1], vec![2, 3], vec![4]]);
        let found = sorted(
            matrix_eigenvalues(a)
                .expect("small blocks")
                .into_iter()
                .map(|x| Complex::new(x.im, x.re))
                .collect(),
        );
        for (x, wanted) in found.iter().zip([-3.0, -2.0, 0.0, 2.0, 3.0]) {
            assert!((x - Complex::new(wanted, 0.0)).norm() < 1e-14, "{found:?}");
        }
    }
}
