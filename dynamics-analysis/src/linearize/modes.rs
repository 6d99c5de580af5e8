//! Eigenvalues with their mode shapes.

use alloc::vec::Vec;
use core::fmt;

use dynamics_runtime::model::Quantity;
use nalgebra::linalg::balancing::balance_parlett_reinsch;
use nalgebra::{Complex, DMatrix, DVector};

use super::{Linearization, LinearizeError, spectrum};

/// A free motion of the system: every coordinate is Re(shape e^{σt}).
#[derive(Clone, Debug, PartialEq)]
pub struct Mode {
    /// σ, in 1/s; of a pair of complex conjugates the one with positive imaginary part.
    pub eigenvalue: Complex<f64>,
    /// The shape in all coordinates, dependent ones included; the largest element is 1.
    pub shape: DVector<Complex<f64>>,
    /// The relative change of the eigenvalue per relative change of the elements of the state matrix: 1 at
    /// best, without bound toward a defective matrix. It is infinite for undamped rigid-body motion: its
    /// eigenvalue 0 is double with one shape (x = c and x = c t), and changes by the square root of a
    /// perturbation.
    pub conditioning: f64,
    /// The coordinates.
    pub coordinates: &'static [Quantity],
}

impl Mode {
    /// |σ|, in rad/s: the natural frequency.
    #[must_use]
    pub fn frequency(&self) -> f64 {
        self.eigenvalue.norm()
    }

    /// −Re σ/|σ|: 0 without damping, 1 at critical damping, negative if the mode grows; NaN for σ = 0.
    #[must_use]
    pub fn damping_ratio(&self) -> f64 {
        -self.eigenvalue.re / self.eigenvalue.norm()
    }

    /// The element of the shape for the coordinate of this name.
    #[must_use]
    pub fn of(&self, coordinate: &str) -> Option<Complex<f64>> {
        self.coordinates.iter().position(|q| q.name == coordinate).map(|i| self.shape[i])
    }
}

/// One line: eigenvalue, frequency, damping ratio, and the coordinates that move most.
impl fmt::Display for Mode {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Complex { re, im } = self.eigenvalue;
        if im == 0.0 {
            write!(f, "{re:>14.6e}/s")?;
        } else {
            write!(f, "{re:>14.6e} ± {im:.6e}i/s, damping ratio {:.4}", self.damping_ratio() + 0.0)?;
        }
        let mut order: Vec<usize> = (0..self.shape.len()).collect();
        order.sort_by(|i, j| self.shape[*j].norm().total_cmp(&self.shape[*i].norm()));
        for (k, i) in order.into_iter().take(4).filter(|i| self.shape[*i].norm() > 1e-6).enumerate() {
            let (size, phase) = self.shape[i].to_polar();
            write!(f, "{} {} {size:.4}", if k == 0 { ":" } else { "," }, self.coordinates[i].name)?;
            if phase.abs() > 1e-6 {
                write!(f, " at {:.1}°", phase.to_degrees())?;
            }
        }
        Ok(())
    }
}

pub(super) fn modes(linear: &Linearization) -> Result<Vec<Mode>, LinearizeError> {
    if let Some(reason) = &linear.unsteady {
        return Err(reason.clone());
    }
    let mut found = match spectrum::symmetric(linear)? {
        Some((squares, vectors)) => undamped(linear, &squares, &vectors),
        None => general(linear)?,
    };
    found.sort_by(|a, b| {
        a.frequency().total_cmp(&b.frequency()).then(a.eigenvalue.re.total_cmp(&b.eigenvalue.re))
    });
    Ok(found)
}

fn undamped(linear: &Linearization, squares: &DVector<f64>, vectors: &DMatrix<f64>) -> Vec<Mode> {
    let mut modes = Vec::new();
    for (square, vector) in squares.iter().zip(vectors.column_iter()) {
        let shape = scaled(linear, vector.map(|x| Complex::new(x, 0.0)));
        let conditioning = if *square == 0.0 { f64::INFINITY } else { 1.0 };
        let mode =
            |eigenvalue| Mode { eigenvalue, shape: shape.clone(), conditioning, coordinates: linear.all };
        let root = square.abs().sqrt();
        if *square < 0.0 {
            modes.extend([-root, root].map(|re| mode(Complex::new(re, 0.0))));
        } else {
            modes.push(mode(Complex::new(0.0, root)));
        }
    }
    modes
}

/// All coordinates from the independent ones, the largest 1.
fn scaled(linear: &Linearization, independent: DVector<Complex<f64>>) -> DVector<Complex<f64>> {
    let shape = linear.shape.map(|x| Complex::new(x, 0.0)) * independent;
    let largest =
        shape.iter().copied().fold(Complex::new(0.0, 0.0), |m, x| if x.norm() > m.norm() { x } else { m });
    if largest.norm() > 0.0 { shape.map(|x| x / largest) } else { shape }
}

fn general(linear: &Linearization) -> Result<Vec<Mode>, LinearizeError> {
    let a = linear.state_matrix()?;
    let eigenvalues = spectrum::eigenvalues(linear)?;
    let c = linear.coordinates.len();
    let mut modes: Vec<Mode> = Vec::new();
    for (k, eigenvalue) in eigenvalues.into_iter().enumerate().filter(|(_, x)| x.im >= 0.0) {
        let right = eigenvector(&a, eigenvalue, k)?;
        let left = eigenvector(&a.transpose(), eigenvalue.conj(), k)?;
        let shape = scaled(linear, right.rows(0, c).into_owned());
        let sizes = |x: &DVector<Complex<f64>>| x.map(|x| x.norm());
        let by_elements = sizes(&left).dot(&(a.abs() * sizes(&right)));
        let eigenvalue = refined(&a, eigenvalue, (&left, &right), by_elements);
        let conditioning = by_elements / (left.dotc(&right).norm() * eigenvalue.norm());
        modes.push(Mode { eigenvalue, shape, conditioning, coordinates: linear.all });
    }
    Ok(modes)
}

/// yᴴA x/yᴴx, whose error is that of the vectors squared, and of its own sums: the QR iteration is off by
/// rounding of what is largest in the matrix, which beside something stiff is more than a soft mode's
/// damping. Taken where it lies within what that may have done, and the vectors are not nearly orthogonal to
/// each other.
fn refined(
    a: &DMatrix<f64>,
    eigenvalue: Complex<f64>,
    (left, right): (&DVector<Complex<f64>>, &DVector<Complex<f64>>),
    by_elements: f64,
) -> Complex<f64> {
    let along = left.dotc(right);
    if along.norm() == 0.0 {
        return eigenvalue;
    }
    let found = left.dotc(&(a.map(|x| Complex::new(x, 0.0)) * right)) / along;
    let mut balanced = a.clone();
    balance_parlett_reinsch(&mut balanced);
    let within = 100.0 * a.nrows() as f64 * f64::EPSILON * balanced.norm();
    // Of its own sums, in parts of the eigenvalue: where they cancel, as of vectors that are nearly
    // orthogonal, it is no better.
    let own = f64::EPSILON * by_elements / along.norm();
    let is_real = eigenvalue.im == 0.0;
    let found = if is_real { Complex::new(found.re, 0.0) } else { found };
    // One that swings goes on doing so.
    let alike = is_real || found.im > 0.0;
    if alike && (found - eigenvalue).norm() <= within && own <= within { found } else { eigenvalue }
}

/// By inverse iteration from a start of its own for every eigenvalue, so that equal ones find different
/// vectors where there are.
pub(crate) fn eigenvector(
    a: &DMatrix<f64>,
    at: Complex<f64>,
    which: usize,
) -> Result<DVector<Complex<f64>>, LinearizeError> {
    // Balanced: the shift is measured by the matrix, which beside something stiff is otherwise far larger
    // than any of its eigenvalues.
    let mut balanced = a.clone();
    let scale = balance_parlett_reinsch(&mut balanced);
    // A little beside the eigenvalue the matrix has an inverse; where it is defective, by chance not there.
    let beside = [4.0, 13.0, 41.0]
        .into_iter()
        .find_map(|by| inverse_iteration(&balanced, at, by * f64::EPSILON, which));
    let found = beside.ok_or(LinearizeError::NoConvergence { size: a.nrows() })?;
    let found = found.zip_map(&scale, |x, scale| x * scale);
    let size = found.norm();
    Ok(found.unscale(size))
}

fn inverse_iteration(
    a: &DMatrix<f64>,
    at: Complex<f64>,
    by: f64,
    which: usize,
) -> Option<DVector<Complex<f64>>> {
    let n = a.nrows();
    let mut shifted = a.map(|x| Complex::new(x, 0.0));
    // Of nothing a little, too, has an inverse.
    let size = if a.norm() > 0.0 { a.norm() } else { 1.0 };
    let shift = at + Complex::new(1.0, 1.0) * (by * size);
    (0..n).for_each(|i| shifted[(i, i)] -= shift);
    let factors = shifted.lu();
    let seed = |i: usize| (1.0 + 0.618 * (i * (which + 1)) as f64).sin() + 0.1;
    let mut x = DVector::from_fn(n, |i, _| Complex::new(seed(i), 0.0));
    for _ in 0..3 {
        let next = factors.solve(&x).filter(|x| x.iter().all(|x| x.re.is_finite() && x.im.is_finite()))?;
        let size = next.norm();
        x = next.unscale(size);
    }
    Some(x)
}
