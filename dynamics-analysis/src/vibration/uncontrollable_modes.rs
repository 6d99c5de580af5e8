//! Removal of uncontrollable and unobservable modes. They have no part in a response. They are removed at
//! frequencies at which the response would otherwise have too few digits.
//!
//! `channel.rs` removes states that are not between input and output by the zeros of A, exactly. Coupled
//! cases, such as a force in the node of a mode, need numerics: the modes with eigenvalues near σ span an
//! invariant subspace X₁ of A, by inverse iteration with as many vectors, and W₁ one of Aᵀ. With bases
//! X₂ of what is orthogonal to W₁, Y₂ to X₁, the response falls into two,
//!
//! ```text
//! H = C₁ (s − A₁)⁻¹ B₁ + C₂ (s − A₂)⁻¹ B₂ + D
//! A₁ = (W₁ᵀX₁)⁻¹ W₁ᵀA X₁,  B₁ = (W₁ᵀX₁)⁻¹ W₁ᵀB,  C₁ = C X₁,  likewise A₂, B₂, C₂
//! ```
//!
//! and the first is zero at all frequencies if C₁ A₁ʲ B₁ is for every j below the size of A₁ (T. Kailath,
//! *Linear Systems*, §2.4, §6.2): if these modes are uncontrollable, unobservable, or the controllable part
//! of a repeated mode is not its observable part. Zero means at most rounding of the subspaces. If rounding
//! could hide a contribution, nothing is removed.

use alloc::vec::Vec;

use nalgebra::{Complex, DMatrix, DVector};

use super::channel::Channel;
use crate::linearize::matrix_eigenvalues;

/// Distance of eigenvalues, relative to ‖A‖, within which they may be one defective eigenvalue that
/// rounding has split. A double one splits by √ε, one of multiplicity three by ε^⅓ = 6e-6. Larger
/// values try more modes together.
const DEFECTIVE_DISTANCE: f64 = 1e-5;
/// Least cosine of the angle between the invariant subspaces of A and Aᵀ. Below it, as for a part of a
/// defective block, the modes cannot be separated from the others, and nothing is removed.
const MIN_SUBSPACE_COSINE: f64 = 1e-3;
/// Largest error of the subspaces, as an angle in rad, with which modes are removed. A contribution to the
/// response of about this part of ‖B‖ ‖C‖ could be hidden by it. With larger errors nothing is
/// removed.
const MAX_SUBSPACE_TILT: f64 = 1e-10;
/// Size of A₁, in roundings of A, up to which it counts as zero: its eigenvalues are then 0 and not
/// defective.
const ZERO_BLOCK_ROUNDINGS: f64 = 10.0;
/// Size of A₁, in roundings of A, from which on it counts as not zero. In between it is undecided, and
/// nothing is removed.
const NONZERO_BLOCK_ROUNDINGS: f64 = 1e6;
/// Shift of the inverse iteration off its eigenvalues, relative to the distance to the others. With a smaller
/// shift the vectors of a defective eigenvalue become too parallel; with a larger one convergence is slower.
const INVERSE_ITERATION_SHIFT: f64 = 1e-2;
/// Steps of the inverse iteration: with the shift above each gains two digits.
const INVERSE_ITERATION_STEPS: usize = 12;
/// Largest ‖A U − U Uᵀ A U‖ of an accepted subspace U, in roundings of A. A larger error makes the
/// tilt of the subspace too large anyway.
const MAX_INVARIANCE_ERROR: f64 = 1e3;

impl Channel {
    /// The channel without the modes at `at` and its conjugate; `None` if they have a part in the response,
    /// or if rounding may hide one.
    pub(super) fn without(&self, at: Complex<f64>) -> Option<Self> {
        // The double eigenvalue 0 of a rigid-body mode may have been split by the root of rounding.
        let zero = Complex::new(0.0, 0.0);
        let or_zero = || {
            (at != zero && at.norm() <= DEFECTIVE_DISTANCE * self.a.norm())
                .then(|| self.removed(zero))
                .flatten()
        };
        self.removed(at).or_else(or_zero)
    }

    /// Tries one mode at `at`, then two, up to all within the distance of a defective eigenvalue.
    fn removed(&self, at: Complex<f64>) -> Option<Self> {
        let mut distances: Vec<f64> =
            matrix_eigenvalues(self.a.clone()).ok()?.iter().map(|x| (x - at).norm()).collect();
        distances.sort_by(f64::total_cmp);
        let largest_count =
            distances.iter().filter(|distance| **distance <= DEFECTIVE_DISTANCE * self.a.norm()).count();
        let next = |count: usize| distances.get(count).copied().unwrap_or(self.a.norm());
        let found = (1..=largest_count.max(1))
            .find_map(|count| self.split(at, count, INVERSE_ITERATION_SHIFT * next(count)));
        found.and_then(|parts| parts.into_rest(self))
    }

    /// The `count` modes nearest to `at`, with their conjugates, and the others; `None` if both cannot be
    /// separated.
    fn split(&self, at: Complex<f64>, count: usize, shift: f64) -> Option<Split> {
        let (n, a) = (self.a.nrows(), &self.a);
        let m = if at.im == 0.0 { count } else { 2 * count };
        if m > n {
            return None;
        }
        let (x, missed) = subspace(a, (at, shift), count, m)?;
        let (w, other) = subspace(&a.transpose(), (at, shift), count, m)?;
        let missed = missed.max(other);
        let one = Part::new(self, &x, &w)?;
        let other = Part::new(self, &complement(&w), &complement(&x))?;
        let rest = Self { a: other.a, b: other.b, c: other.c, d: self.d, reduction_errors: [0.0; 3] };
        // A mode near `at` that is in neither part makes the resolvent of the rest large.
        let rounding = (8.0 * n as f64 * f64::EPSILON * (a.norm() + at.norm())).max(missed)
            / one.cosine.min(other.cosine);
        let tilt = rounding * rest.resolvent(at)?.max(1.0 / (a.norm() + at.norm()));
        (tilt <= MAX_SUBSPACE_TILT).then_some(Split { one, rest, rounding, tilt })
    }

    /// ‖(s − A)⁻¹‖.
    fn resolvent(&self, s: Complex<f64>) -> Option<f64> {
        let mut shifted = self.a.map(|x| Complex::new(-x, 0.0));
        (0..self.a.nrows()).for_each(|i| shifted[(i, i)] += s);
        shifted.lu().try_inverse().map(|inverse| inverse.norm())
    }
}

/// A, B and C within an invariant subspace.
struct Part {
    a: DMatrix<f64>,
    b: [DVector<f64>; 3],
    c: DVector<f64>,
    /// The least cosine of the angles between the subspace and that of Aᵀ.
    cosine: f64,
}

impl Part {
    fn new(of: &Channel, x: &DMatrix<f64>, w: &DMatrix<f64>) -> Option<Self> {
        let product = w.tr_mul(x);
        if product.is_empty() {
            let none = || DVector::zeros(0);
            return Some(Self { a: product, b: [none(), none(), none()], c: none(), cosine: 1.0 });
        }
        let cosine = product.singular_values().min();
        let factors = product.lu();
        let a = factors.solve(&w.tr_mul(&(&of.a * x)))?;
        let [Some(b0), Some(b1), Some(b2)] = of.b.each_ref().map(|b| factors.solve(&w.tr_mul(b))) else {
            return None;
        };
        (cosine >= MIN_SUBSPACE_COSINE).then(|| Self { a, b: [b0, b1, b2], c: x.tr_mul(&of.c), cosine })
    }
}

/// Modes that may have no part in a response, and the others.
struct Split {
    one: Part,
    rest: Channel,
    /// Error bound of the elements of A₁ and A₂.
    rounding: f64,
    /// Error bound of the subspaces, as an angle.
    tilt: f64,
}

impl Split {
    /// The other modes, with their error bounds, if these modes have no part in the response.
    fn into_rest(self, of: &Channel) -> Option<Channel> {
        let is_zero = of.b.iter().zip(&self.one.b).all(|(whole, part)| self.is_zero(of, whole, part));
        let Self { mut rest, rounding, tilt, .. } = self;
        let into = of.b.iter().map(|b| b.norm()).fold(0.0, f64::max);
        let [of_a, of_b, of_c] = of.reduction_errors;
        rest.reduction_errors = [of_a + rounding, of_b + tilt * into, of_c + tilt * of.c.norm()];
        is_zero.then_some(rest)
    }

    /// Whether C₁ A₁ʲ B₁ is zero for all j, within the errors of the subspaces and of A₁.
    fn is_zero(&self, of: &Channel, whole: &DVector<f64>, part: &DVector<f64>) -> bool {
        let (a, c) = (&self.one.a, &self.one.c);
        let size = a.norm();
        // If A₁ is only rounding, so are its powers.
        let powers = if size <= ZERO_BLOCK_ROUNDINGS * self.rounding { 1 } else { a.nrows() };
        if powers > 1 && size <= NONZERO_BLOCK_ROUNDINGS * self.rounding {
            return false;
        }
        let by_tilt = self.tilt * (of.c.norm() * part.norm() + c.norm() * whole.norm() / self.one.cosine);
        let (mut x, mut scale) = (part.clone(), 1.0);
        for j in 0..powers {
            let by_elements = j as f64 * self.rounding / size.max(f64::MIN_POSITIVE) * c.norm() * part.norm();
            if c.dot(&x).abs() > scale * (by_tilt + by_elements) {
                return false;
            }
            x = a * x;
            scale *= size;
        }
        true
    }
}

/// An orthonormal basis, of `m` columns, of the `count` modes nearest to `at` and their conjugates, and its
/// invariance error ‖A U − U Uᵀ A U‖. By inverse iteration with `count` vectors, shifted by
/// `distance`.
fn subspace(
    a: &DMatrix<f64>,
    (at, distance): (Complex<f64>, f64),
    count: usize,
    m: usize,
) -> Option<(DMatrix<f64>, f64)> {
    let (n, rounding) = (a.nrows(), a.nrows() as f64 * f64::EPSILON * (a.norm() + at.norm()));
    let mut shifted = a.map(|x| Complex::new(x, 0.0));
    let shift = at + Complex::new(0.6, 0.8) * distance.max(rounding).max(f64::MIN_POSITIVE);
    (0..n).for_each(|i| shifted[(i, i)] -= shift);
    let factors = shifted.lu();
    let seed = |i: usize, j: usize| Complex::new((1.0 + 0.618 * (i * (j + 1)) as f64).sin() + 0.1, 0.0);
    let mut x = DMatrix::from_fn(n, count, seed);
    for _ in 0..INVERSE_ITERATION_STEPS {
        x = factors.solve(&x).filter(|x| x.iter().all(|x| x.re.is_finite() && x.im.is_finite()))?.qr().q();
    }
    let both =
        DMatrix::from_fn(n, 2 * count, |i, j| if j < count { x[(i, j)].re } else { x[(i, j - count)].im });
    let u = both.svd(true, false).u?.columns(0, m).into_owned();
    let of_u = a * &u;
    let missed = (&of_u - &u * u.tr_mul(&of_u)).norm();
    (missed <= MAX_INVARIANCE_ERROR * rounding).then_some((u, missed))
}

/// An orthonormal basis of the orthogonal complement of these orthonormal columns.
fn complement(of: &DMatrix<f64>) -> DMatrix<f64> {
    let (n, m) = of.shape();
    let mut joined = DMatrix::identity(n, n + m);
    joined.columns_mut(0, m).copy_from(of);
    joined.columns_mut(m, n).fill_with_identity();
    joined.qr().q().columns(m, n - m).into_owned()
}
