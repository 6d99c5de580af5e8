//! The channel from one input to one output, and its response at one frequency.
//!
//! ```text
//! H(s) = C (s − A)⁻¹ B + D at s = iω,        y = Re(H ŵ e^{iωt}) for w = Re(ŵ e^{iωt})
//! ```
//!
//! The motion of a base is one excitation with several inputs: position, rate and acceleration. B and D are
//! then polynomials in s. A is balanced first (Parlett & Reinsch, Numer. Math. 13 (1969) 293), so that the
//! conditioning does not depend on units. Each value comes with a bound of its rounding, n ε |C R| |s − A| |R
//! B| with R = (s − A)⁻¹ (N. J. Higham, *Accuracy and Stability of Numerical Algorithms*, §7.2).

use alloc::string::String;
use alloc::vec::Vec;

use nalgebra::linalg::balancing::balance_parlett_reinsch;
use nalgebra::{Complex, DMatrix, DVector};

use super::{StateSpace, VibrationError};
use crate::linearize::matrix_eigenvalues;

/// Largest condition number of s − A at which a response is computed: beyond it the inverse has fewer than
/// three correct digits. Such values are errors, unless modes without a part in the response cause them.
const MAX_CONDITION_NUMBER: f64 = 1e13;

/// An excitation: an input or a force along a coordinate, by its name (a `&str` converts), or the motion of a
/// base that enters by several inputs.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Excitation {
    /// Names of the inputs that are the cause itself, its rate, and its acceleration.
    pub(super) terms: [Option<String>; 3],
}

impl Excitation {
    /// A base whose position is one input of the model and whose rate is another, as for a spring and a
    /// damper on it.
    #[must_use]
    pub fn moved(place: impl Into<String>, rate: impl Into<String>) -> Self {
        Self { terms: [Some(place.into()), Some(rate.into()), None] }
    }

    /// Also with its acceleration as an input.
    #[must_use]
    pub fn with_acceleration(mut self, acceleration: impl Into<String>) -> Self {
        self.terms[2] = Some(acceleration.into());
        self
    }
}

impl From<&str> for Excitation {
    fn from(input: &str) -> Self {
        Self { terms: [Some(input.into()), None, None] }
    }
}

/// The states that the input influences and that influence the output, by the nonzero elements of A. The
/// others have no part in the response.
fn states_between(a: &DMatrix<f64>, b: &[DVector<f64>; 3], c: &DVector<f64>) -> Vec<usize> {
    let n = a.nrows();
    let closure = |first: &dyn Fn(usize) -> bool, leads: &dyn Fn(usize, usize) -> bool| {
        let mut found: Vec<bool> = (0..n).map(first).collect();
        let mut open: Vec<usize> = (0..n).filter(|i| found[*i]).collect();
        while let Some(j) = open.pop() {
            for (i, found) in found.iter_mut().enumerate() {
                if !*found && leads(j, i) {
                    *found = true;
                    open.push(i);
                }
            }
        }
        found
    };
    let influenced = closure(&|i| b.iter().any(|b| b[i] != 0.0), &|j, i| a[(i, j)] != 0.0);
    let influencing = closure(&|i| c[i] != 0.0, &|j, i| a[(j, i)] != 0.0);
    (0..n).filter(|i| influenced[*i] && influencing[*i]).collect()
}

/// The channel from one input to one output: the states between them, balanced.
pub(super) struct Channel {
    pub(super) a: DMatrix<f64>,
    /// Coefficients of the polynomial B(s) = b₀ + b₁ s + b₂ s².
    pub(super) b: [DVector<f64>; 3],
    pub(super) c: DVector<f64>,
    /// Coefficients of D(s).
    pub(super) d: [f64; 3],
    /// Bounds of the errors of `a`, `b` and `c` from the removal of modes.
    pub(super) reduction_errors: [f64; 3],
}

/// H at one frequency, with its slope and its error bound.
pub(super) struct TransferValue {
    pub(super) value: Complex<f64>,
    /// dH/dω.
    pub(super) slope: Complex<f64>,
    pub(super) uncertainty: f64,
}

impl TransferValue {
    /// d|H|²/dω.
    pub(super) fn rise(&self) -> f64 {
        2.0 * (self.value.conj() * self.slope).re
    }
}

impl Channel {
    pub(super) fn new(space: &StateSpace, input: &Excitation, output: usize) -> Result<Self, VibrationError> {
        let mut b = [(); 3].map(|()| DVector::zeros(space.a.nrows()));
        let mut d = [0.0; 3];
        for (k, name) in input.terms.iter().enumerate() {
            let Some(name) = name else { continue };
            let column = space.input(name)?;
            b[k].copy_from(&space.b.column(column));
            d[k] = space.d[(output, column)];
        }
        let c = space.c.row(output).transpose();
        let states = states_between(&space.a, &b, &c);
        let mut a = space.a.select_rows(&states).select_columns(&states);
        let scale = balance_parlett_reinsch(&mut a);
        let b = b.map(|b| b.select_rows(&states).component_div(&scale));
        let c = c.select_rows(&states).component_mul(&scale);
        Ok(Self { a, b, c, d, reduction_errors: [0.0; 3] })
    }

    /// The eigenvalues of A of the channel, by growing real part.
    pub(super) fn eigenvalues(&self) -> Result<Vec<Complex<f64>>, VibrationError> {
        let mut found = matrix_eigenvalues(self.a.clone())?;
        found.sort_by(|x, y| x.re.total_cmp(&y.re).then(x.im.total_cmp(&y.im)));
        Ok(found)
    }

    /// H at a frequency. The error is the condition number of iω − A, if its inverse is too inaccurate.
    pub(super) fn at(&self, frequency: f64) -> Result<TransferValue, f64> {
        let n = self.a.nrows();
        let s = Complex::new(0.0, frequency);
        let mut shifted = self.a.map(|x| Complex::new(-x, 0.0));
        (0..n).for_each(|i| shifted[(i, i)] += s);
        let sizes = shifted.map(|x| x.norm());
        // By elimination. For up to four rows `try_inverse` of the matrix itself uses closed forms, which
        // return numbers for a matrix of rank n − 2.
        let inverse = shifted.lu().try_inverse().ok_or(f64::INFINITY)?;
        // ‖ |A⁻¹| |A| ‖ by rows: the sums of the rows of |A| first, so that no matrices are multiplied.
        let row_sums = DVector::from_iterator(n, sizes.row_iter().map(|row| row.sum()));
        let conditioning = (inverse.map(|x| x.norm()) * row_sums).iter().copied().fold(0.0, f64::max);
        if conditioning.is_nan() || conditioning > MAX_CONDITION_NUMBER {
            return Err(conditioning);
        }
        let polynomial = |of: &dyn Fn(usize) -> Complex<f64>| of(0) + s * (of(1) + s * of(2));
        let derivative = |of: &dyn Fn(usize) -> Complex<f64>| of(1) + s * of(2) * 2.0;
        let complex = |x: f64| Complex::new(x, 0.0);
        let b = DVector::from_fn(n, |i, _| polynomial(&|k| complex(self.b[k][i])));
        let b_slope = DVector::from_fn(n, |i, _| derivative(&|k| complex(self.b[k][i])));
        let (x, left) = (&inverse * &b, inverse.tr_mul(&self.c.map(complex)));
        let c = self.c.map(complex);
        let value = c.dot(&x) + polynomial(&|k| complex(self.d[k]));
        let by_s = left.dot(&b_slope) - left.dot(&x) + derivative(&|k| complex(self.d[k]));
        let rounding = left.map(|x| x.norm()).dot(&(sizes * x.map(|x| x.norm()))) + value.norm();
        let [of_a, of_b, of_c] = self.reduction_errors;
        let reduction = of_a * left.norm() * x.norm() + of_b * left.norm() + of_c * x.norm();
        let uncertainty = n.max(1) as f64 * f64::EPSILON * rounding + reduction;
        Ok(TransferValue { value, slope: Complex::new(0.0, 1.0) * by_s, uncertainty })
    }
}
