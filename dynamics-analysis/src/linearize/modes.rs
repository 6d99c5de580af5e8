//! Eigenvalues with their mode shapes: A x = σ x, and yᴴ A = σ yᴴ for the conditioning.
//!
//! The modes of undamped conservative systems come from the symmetric problem (`spectrum.rs`). Those of other
//! systems by inverse iteration beside the eigenvalue (G. H. Golub & C. F. Van Loan, *Matrix Computations*,
//! §7.6); the eigenvalue is then refined by the generalized Rayleigh quotient yᴴA x/yᴴx.

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

/// Elements of a mode shape, and phases in rad, below this are not printed; the largest element is 1.
const MIN_PRINTED: f64 = 1e-6;
/// Number of coordinates of a mode that are printed.
const PRINTED_COORDINATES: usize = 4;

/// One line: eigenvalue, damping ratio, and the coordinates that move most.
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
        let moves = |i: &usize| self.shape[*i].norm() > MIN_PRINTED;
        for (k, i) in order.into_iter().take(PRINTED_COORDINATES).filter(moves).enumerate() {
            let (size, phase) = self.shape[i].to_polar();
            write!(f, "{} {} {size:.4}", if k == 0 { ":" } else { "," }, self.coordinates[i].name)?;
            if phase.abs() > MIN_PRINTED {
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
    let mut found = match spectrum::undamped_modes(linear)? {
        Some((squares, vectors)) => of_symmetric_problem(linear, &squares, &vectors),
        None => of_state_matrix(linear)?,
    };
    found.sort_by(|a, b| {
        a.frequency().total_cmp(&b.frequency()).then(a.eigenvalue.re.total_cmp(&b.eigenvalue.re))
    });
    Ok(found)
}

/// The modes of an undamped conservative system: one with ω = √square, or two with ±√−square.
fn of_symmetric_problem(linear: &Linearization, squares: &DVector<f64>, vectors: &DMatrix<f64>) -> Vec<Mode> {
    let mut modes = Vec::new();
    for (square, vector) in squares.iter().zip(vectors.column_iter()) {
        let shape = normalized_shape(linear, vector.map(|x| Complex::new(x, 0.0)));
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

/// The shape in all coordinates from the independent ones; its largest element is 1.
fn normalized_shape(linear: &Linearization, independent: DVector<Complex<f64>>) -> DVector<Complex<f64>> {
    let shape = linear.shape.map(|x| Complex::new(x, 0.0)) * independent;
    let largest =
        shape.iter().copied().fold(Complex::new(0.0, 0.0), |m, x| if x.norm() > m.norm() { x } else { m });
    if largest.norm() > 0.0 { shape.map(|x| x / largest) } else { shape }
}

/// The modes of any other system, from the state matrix.
fn of_state_matrix(linear: &Linearization) -> Result<Vec<Mode>, LinearizeError> {
    let a = linear.state_matrix()?;
    let eigenvalues = spectrum::eigenvalues(linear)?;
    let c = linear.coordinates.len();
    let mut modes: Vec<Mode> = Vec::new();
    for (k, eigenvalue) in eigenvalues.into_iter().enumerate().filter(|(_, x)| x.im >= 0.0) {
        let right = eigenvector(&a, eigenvalue, k)?;
        let left = eigenvector(&a.transpose(), eigenvalue.conj(), k)?;
        let shape = normalized_shape(linear, right.rows(0, c).into_owned());
        let sizes = |x: &DVector<Complex<f64>>| x.map(|x| x.norm());
        let by_elements = sizes(&left).dot(&(a.abs() * sizes(&right)));
        let eigenvalue = rayleigh_quotient(&a, eigenvalue, (&left, &right), by_elements);
        let conditioning = by_elements / (left.dotc(&right).norm() * eigenvalue.norm());
        modes.push(Mode { eigenvalue, shape, conditioning, coordinates: linear.all });
    }
    Ok(modes)
}

/// Factor on n ε ‖A‖, the error bound of the QR iteration, within which the Rayleigh quotient is
/// accepted. A smaller factor leaves soft modes unrefined, a larger one could accept a neighbouring
/// eigenvalue.
const QR_ERROR_FACTOR: f64 = 100.0;

/// The eigenvalue by the generalized Rayleigh quotient yᴴA x/yᴴx. Its error is the square of the error of
/// the vectors, plus rounding of its own sums. The error of the QR iteration is relative to the largest
/// elements of the matrix; if a part is stiff, that is more than the damping of a soft mode. The quotient is
/// accepted if it lies within the error of the QR iteration, and if x and y are not nearly orthogonal.
fn rayleigh_quotient(
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
    let within = QR_ERROR_FACTOR * a.nrows() as f64 * f64::EPSILON * balanced.norm();
    // Rounding of its own sums: large if they cancel, as those of nearly orthogonal vectors do.
    let own_rounding = f64::EPSILON * by_elements / along.norm();
    let is_real = eigenvalue.im == 0.0;
    let found = if is_real { Complex::new(found.re, 0.0) } else { found };
    // A complex eigenvalue stays complex.
    let same_kind = is_real || found.im > 0.0;
    if same_kind && (found - eigenvalue).norm() <= within && own_rounding <= within {
        found
    } else {
        eigenvalue
    }
}

/// Shifts of inverse iteration off the eigenvalue, in ε ‖A‖, tried in turn. On the eigenvalue itself the
/// matrix has no inverse; of a defective matrix the first shift may hit another eigenvalue by chance.
const INVERSE_ITERATION_SHIFTS: [f64; 3] = [4.0, 13.0, 41.0];
/// Steps of inverse iteration. One suffices for a simple eigenvalue, since it is known to rounding.
const INVERSE_ITERATION_STEPS: usize = 3;

/// The eigenvector of length 1 of an eigenvalue. `index` is the index of the eigenvalue: each has another
/// start vector, so that equal eigenvalues get different vectors if these exist.
pub(crate) fn eigenvector(
    a: &DMatrix<f64>,
    eigenvalue: Complex<f64>,
    index: usize,
) -> Result<DVector<Complex<f64>>, LinearizeError> {
    // Balanced, because the shift is relative to ‖A‖, which may otherwise be far larger than any
    // eigenvalue.
    let mut balanced = a.clone();
    let scale = balance_parlett_reinsch(&mut balanced);
    let found = INVERSE_ITERATION_SHIFTS
        .into_iter()
        .find_map(|shift| inverse_iteration(&balanced, eigenvalue, shift * f64::EPSILON, index));
    let found = found.ok_or(LinearizeError::NoConvergence { size: a.nrows() })?;
    let found = found.zip_map(&scale, |x, scale| x * scale);
    let size = found.norm();
    Ok(found.unscale(size))
}

/// Inverse iteration with a shift relative to ‖A‖; `None` if the shifted matrix has no inverse.
fn inverse_iteration(
    a: &DMatrix<f64>,
    eigenvalue: Complex<f64>,
    relative_shift: f64,
    index: usize,
) -> Option<DVector<Complex<f64>>> {
    let n = a.nrows();
    let mut shifted = a.map(|x| Complex::new(x, 0.0));
    let size = if a.norm() > 0.0 { a.norm() } else { 1.0 };
    let shift = eigenvalue + Complex::new(1.0, 1.0) * (relative_shift * size);
    (0..n).for_each(|i| shifted[(i, i)] -= shift);
    let factors = shifted.lu();
    let seed = |i: usize| (1.0 + 0.618 * (i * (index + 1)) as f64).sin() + 0.1;
    let mut x = DVector::from_fn(n, |i, _| Complex::new(seed(i), 0.0));
    for _ in 0..INVERSE_ITERATION_STEPS {
        let next = factors.solve(&x).filter(|x| x.iter().all(|x| x.re.is_finite() && x.im.is_finite()))?;
        let size = next.norm();
        x = next.unscale(size);
    }
    Some(x)
}
