//! What an engineer with time would write by hand, with all parameters folded into the code.

use super::real::Real;

/// Mass of link `i`.
pub(crate) const fn mass(i: usize) -> f64 {
    1.0 + 0.1 * ((i + 1) % 7) as f64
}

/// Length of link `i`.
pub(crate) const fn length(i: usize) -> f64 {
    1.0 - 0.02 * ((i + 1) % 9) as f64
}

const CART: f64 = 2.0;
const GRAVITY: f64 = 9.81;

/// The double pendulum with m = (1, 1.3), l = (1, 0.8), solved in closed form.
#[inline(always)]
pub(crate) fn double_pendulum<T: Real>(q: &[T; 2], u: &[T; 2]) -> [T; 2] {
    let (m1, m2, l2, g) = (T::of(1.0), T::of(1.3), T::of(0.8), T::of(GRAVITY));
    let (m11, m12, m22) = (m1 + m2, m2 * l2, m2 * l2 * l2);
    let [(s1, c1), (s2, c2)] = T::sin_cos(*q);
    let (cos, sin) = (c1 * c2 + s1 * s2, s1 * c2 - c1 * s2);
    let f1 = -(m12 * sin * (u[1] * u[1])) - m11 * g * s1;
    let f2 = m12 * sin * (u[0] * u[0]) - m12 * g * s2;
    let coupling = m12 * cos;
    let inverse = T::of(1.0) / (m11 * m22 - coupling * coupling);
    [(m22 * f1 - coupling * f2) * inverse, (m11 * f2 - coupling * f1) * inverse]
}

/// A chain of L links on a cart, N = L + 1: the dense mass matrix and its LDLᵀ factorization.
#[inline(always)]
pub(crate) fn chain_dense<T: Real, const L: usize, const N: usize>(q: &[T; N], u: &[T; N]) -> [T; N] {
    let zero = T::of(0.0);
    let pairs: [(T, T); L] = T::sin_cos(core::array::from_fn(|i| q[i + 1]));
    let mut outer = [zero; L];
    let mut sum = zero;
    for i in (0..L).rev() {
        sum = sum + T::of(mass(i));
        outer[i] = sum;
    }
    let (mut m, mut f) = ([[zero; N]; N], [zero; N]);
    m[0][0] = T::of(CART) + outer[0];
    for i in 0..L {
        let (s, c) = pairs[i];
        let first = outer[i] * T::of(length(i));
        let square = u[i + 1] * u[i + 1];
        m[i + 1][0] = first * c;
        m[i + 1][i + 1] = first * T::of(length(i));
        f[i + 1] = f[i + 1] - first * T::of(GRAVITY) * s;
        f[0] = f[0] + first * s * square;
        for j in 0..i {
            let (sj, cj) = pairs[j];
            m[i + 1][j + 1] = first * T::of(length(j)) * (c * cj + s * sj);
            let lever = first * T::of(length(j)) * (s * cj - c * sj);
            f[i + 1] = f[i + 1] - lever * (u[j + 1] * u[j + 1]);
            f[j + 1] = f[j + 1] + lever * square;
        }
    }
    solve(m, f)
}

/// x with M x = f, by LDLᵀ of the lower triangle.
#[inline(always)]
pub(crate) fn solve<T: Real, const N: usize>(mut m: [[T; N]; N], mut f: [T; N]) -> [T; N] {
    let zero = T::of(0.0);
    // In place, forward substitution on the way.
    let mut inverse = [zero; N];
    for j in 0..N {
        inverse[j] = T::of(1.0) / m[j][j];
        for i in j + 1..N {
            let factor = m[i][j] * inverse[j];
            #[expect(clippy::needless_range_loop)] // rows i and k are rows of the same matrix
            for k in j + 1..=i {
                m[i][k] = m[i][k] - factor * m[k][j];
            }
            f[i] = f[i] - factor * f[j];
        }
    }
    let mut a = [zero; N];
    for i in (0..N).rev() {
        let mut y = f[i];
        for k in i + 1..N {
            y = y - m[k][i] * a[k];
        }
        a[i] = y * inverse[i];
    }
    a
}

/// The same chain in maximal coordinates: a tridiagonal system for the tensions of the rods, O(L).
#[inline(always)]
pub(crate) fn chain_tensions<T: Real, const L: usize, const N: usize>(q: &[T; N], u: &[T; N]) -> [T; N] {
    let (zero, one, cart, g) = (T::of(0.0), T::of(1.0), T::of(CART), T::of(GRAVITY));
    let pairs: [(T, T); L] = T::sin_cos(core::array::from_fn(|i| q[i + 1]));
    let by_mass = |i: usize| one / T::of(mass(i));
    let (mut along, mut across) = ([zero; L], [zero; L]);
    for i in 0..L - 1 {
        let ((s, c), (sn, cn)) = (pairs[i], pairs[i + 1]);
        along[i] = (c * cn + s * sn) * by_mass(i);
        across[i] = (c * sn - s * cn) * by_mass(i);
    }
    let (mut d, mut r) = ([zero; L], [zero; L]);
    for i in 0..L {
        r[i] = T::of(length(i)) * u[i + 1] * u[i + 1];
        d[i] = by_mass(i) + if i > 0 { by_mass(i - 1) } else { zero };
    }
    d[0] = d[0] + pairs[0].0 * pairs[0].0 / cart;
    r[0] = r[0] + g * pairs[0].1;
    let mut inverse = [zero; L];
    for i in (0..L).rev() {
        inverse[i] = one / d[i];
        if i > 0 {
            let factor = along[i - 1] * inverse[i];
            d[i - 1] = d[i - 1] - factor * along[i - 1];
            r[i - 1] = r[i - 1] + factor * r[i];
        }
    }
    let mut tension = [zero; L];
    tension[0] = r[0] * inverse[0];
    for i in 1..L {
        tension[i] = (r[i] + along[i - 1] * tension[i - 1]) * inverse[i];
    }
    let mut a = [zero; N];
    a[0] = tension[0] * pairs[0].0 / cart;
    for i in 0..L {
        let (s, c) = pairs[i];
        let pulled = if i == 0 { -(g * s) - c * a[0] } else { -(tension[i - 1] * across[i - 1]) };
        let next = if i + 1 < L { tension[i + 1] * across[i] } else { zero };
        a[i + 1] = (pulled + next) * (one / T::of(length(i)));
    }
    a
}
