//! Uncontrollable and unobservable modes. They have no part in a response, and are removed if they would cost
//! digits.
//!
//! States that are not between input and output follow from the zeros of A, exactly. Coupled cases, such as a
//! mode that is pushed in its node, need numbers: the modes with eigenvalues near σ span an invariant
//! subspace X₁ of A, by inverse iteration with as many vectors, and W₁ one of Aᵀ. With bases X₂ of what is
//! orthogonal to W₁, Y₂ to X₁, the response falls into two,
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
use crate::linearize::general;

/// Distance of eigenvalues, in parts of A, within which they may belong to one defective one.
const DEFECTIVE_DISTANCE: f64 = 1e-5;
/// Least angle between the subspaces of A and Aᵀ: below it, as of a part of a defective block, they are not
/// apart from the others.
const APART: f64 = 1e-3;
/// Rounding of the subspaces beyond which nothing is told by them.
const TELLS: f64 = 1e-10;
/// Elements of A₁ below this part of A's rounding are none; up to the other they may be.
const NILPOTENT: [f64; 2] = [10.0, 1e6];
/// Shift of an inverse iteration beside its eigenvalues, in parts of the distance to the others, and its
/// steps: nearer than that the vectors of a defective one become too alike.
const INVERSE_ITERATION_SHIFT: f64 = 1e-2;
const STEPS: usize = 12;
/// What a subspace may miss of being invariant, in parts of A's rounding.
const MISSES: f64 = 1e3;

impl Channel {
    /// The same response without the modes at `at` and its conjugate; `None` where they have a part in it, or
    /// may have.
    pub(super) fn without(&self, at: Complex<f64>) -> Option<Self> {
        // A double 0 that is free to move is two values about it, the root of rounding away.
        let zero = Complex::new(0.0, 0.0);
        let or_zero = || {
            (at != zero && at.norm() <= DEFECTIVE_DISTANCE * self.a.norm())
                .then(|| self.taken_out(zero))
                .flatten()
        };
        self.taken_out(at).or_else(or_zero)
    }

    fn taken_out(&self, at: Complex<f64>) -> Option<Self> {
        let mut distances: Vec<f64> = general(self.a.clone()).ok()?.iter().map(|x| (x - at).norm()).collect();
        distances.sort_by(f64::total_cmp);
        let most =
            distances.iter().filter(|distance| **distance <= DEFECTIVE_DISTANCE * self.a.norm()).count();
        let next = |count: usize| distances.get(count).copied().unwrap_or(self.a.norm());
        let found =
            (1..=most.max(1)).find_map(|count| self.split(at, count, INVERSE_ITERATION_SHIFT * next(count)));
        found.and_then(|parts| parts.rest(self))
    }

    /// The `count` modes nearest to `at`, with their conjugates, and the others; `None` where these are not
    /// apart from each other.
    fn split(&self, at: Complex<f64>, count: usize, beside: f64) -> Option<Split> {
        let (n, a) = (self.a.nrows(), &self.a);
        let m = if at.im == 0.0 { count } else { 2 * count };
        if m > n {
            return None;
        }
        let (x, missed) = subspace(a, (at, beside), count, m)?;
        let (w, other) = subspace(&a.transpose(), (at, beside), count, m)?;
        let missed = missed.max(other);
        let one = Part::new(self, &x, &w)?;
        let other = Part::new(self, &complement(&w), &complement(&x))?;
        let rest = Self { a: other.a, b: other.b, c: other.c, d: self.d, off: [0.0; 3] };
        // What is near in frequency and in neither of the two would be seen here.
        let rounding =
            (8.0 * n as f64 * f64::EPSILON * (a.norm() + at.norm())).max(missed) / one.angle.min(other.angle);
        let tilt = rounding * rest.resolvent(at)?.max(1.0 / (a.norm() + at.norm()));
        (tilt <= TELLS).then_some(Split { one, rest, rounding, tilt })
    }

    /// ‖(s − A)⁻¹‖.
    fn resolvent(&self, s: Complex<f64>) -> Option<f64> {
        let mut shifted = self.a.map(|x| Complex::new(-x, 0.0));
        (0..self.a.nrows()).for_each(|i| shifted[(i, i)] += s);
        shifted.lu().try_inverse().map(|inverse| inverse.norm())
    }
}

/// A and what leads in and out, within an invariant subspace.
struct Part {
    a: DMatrix<f64>,
    b: [DVector<f64>; 3],
    c: DVector<f64>,
    /// The least cosine between the subspace and that of Aᵀ.
    angle: f64,
}

impl Part {
    fn new(of: &Channel, x: &DMatrix<f64>, w: &DMatrix<f64>) -> Option<Self> {
        let product = w.tr_mul(x);
        if product.is_empty() {
            let none = || DVector::zeros(0);
            return Some(Self { a: product, b: [none(), none(), none()], c: none(), angle: 1.0 });
        }
        let angle = product.singular_values().min();
        let factors = product.lu();
        let a = factors.solve(&w.tr_mul(&(&of.a * x)))?;
        let [Some(b0), Some(b1), Some(b2)] = of.b.each_ref().map(|b| factors.solve(&w.tr_mul(b))) else {
            return None;
        };
        (angle >= APART).then(|| Self { a, b: [b0, b1, b2], c: x.tr_mul(&of.c), angle })
    }
}

/// Modes that may have no part in a response, and the others.
struct Split {
    one: Part,
    rest: Channel,
    /// Errors of the elements of the parts of A.
    rounding: f64,
    /// By how much the subspaces may be turned.
    tilt: f64,
}

impl Split {
    /// The others, where the modes have no part.
    fn rest(self, of: &Channel) -> Option<Channel> {
        let is_zero = of.b.iter().zip(&self.one.b).all(|(whole, part)| self.is_zero(of, whole, part));
        let Self { mut rest, rounding, tilt, .. } = self;
        let into = of.b.iter().map(|b| b.norm()).fold(0.0, f64::max);
        rest.off = [of.off[0] + rounding, of.off[1] + tilt * into, of.off[2] + tilt * of.c.norm()];
        is_zero.then_some(rest)
    }

    /// Whether C₁ A₁ʲ B₁ is zero for all j, up to what turned subspaces and rounding of A₁ make of it.
    fn is_zero(&self, of: &Channel, whole: &DVector<f64>, part: &DVector<f64>) -> bool {
        let (a, c) = (&self.one.a, &self.one.c);
        let size = a.norm();
        // No block of eigenvalues 0 with one shape: A₁ is all rounding, and its powers are no more.
        let powers = if size <= NILPOTENT[0] * self.rounding { 1 } else { a.nrows() };
        if powers > 1 && size <= NILPOTENT[1] * self.rounding {
            return false;
        }
        let turned = self.tilt * (of.c.norm() * part.norm() + c.norm() * whole.norm() / self.one.angle);
        let (mut x, mut scale) = (part.clone(), 1.0);
        for j in 0..powers {
            let by_elements = j as f64 * self.rounding / size.max(f64::MIN_POSITIVE) * c.norm() * part.norm();
            if c.dot(&x).abs() > scale * (turned + by_elements) {
                return false;
            }
            x = a * x;
            scale *= size;
        }
        true
    }
}

/// An orthonormal basis, of `m` columns, of the `count` modes nearest to `at` and their conjugates, and what
/// it misses of being invariant.
fn subspace(
    a: &DMatrix<f64>,
    (at, beside): (Complex<f64>, f64),
    count: usize,
    m: usize,
) -> Option<(DMatrix<f64>, f64)> {
    let (n, rounding) = (a.nrows(), a.nrows() as f64 * f64::EPSILON * (a.norm() + at.norm()));
    let mut shifted = a.map(|x| Complex::new(x, 0.0));
    let shift = at + Complex::new(0.6, 0.8) * beside.max(rounding).max(f64::MIN_POSITIVE);
    (0..n).for_each(|i| shifted[(i, i)] -= shift);
    let factors = shifted.lu();
    let seed = |i: usize, j: usize| Complex::new((1.0 + 0.618 * (i * (j + 1)) as f64).sin() + 0.1, 0.0);
    let mut x = DMatrix::from_fn(n, count, seed);
    for _ in 0..STEPS {
        x = factors.solve(&x).filter(|x| x.iter().all(|x| x.re.is_finite() && x.im.is_finite()))?.qr().q();
    }
    let both =
        DMatrix::from_fn(n, 2 * count, |i, j| if j < count { x[(i, j)].re } else { x[(i, j - count)].im });
    let u = both.svd(true, false).u?.columns(0, m).into_owned();
    let of_u = a * &u;
    let missed = (&of_u - &u * u.tr_mul(&of_u)).norm();
    (missed <= MISSES * rounding).then_some((u, missed))
}

/// An orthonormal basis of all that is orthogonal to these orthonormal columns.
fn complement(of: &DMatrix<f64>) -> DMatrix<f64> {
    let (n, m) = of.shape();
    let mut joined = DMatrix::identity(n, n + m);
    joined.columns_mut(0, m).copy_from(of);
    joined.columns_mut(m, n).fill_with_identity();
    joined.qr().q().columns(m, n - m).into_owned()
}
