//! What an engineer with time would write by hand, with all parameters folded into the code.

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
pub(crate) fn double_pendulum(q: &[f64; 2], u: &[f64; 2]) -> [f64; 2] {
    const M11: f64 = 2.3;
    const M12: f64 = 1.3 * 0.8;
    const M22: f64 = 1.3 * 0.64;
    let ((s1, c1), (s2, c2)) = (q[0].sin_cos(), q[1].sin_cos());
    let (cos, sin) = (c1 * c2 + s1 * s2, s1 * c2 - c1 * s2);
    let f1 = -M12 * sin * (u[1] * u[1]) - M11 * GRAVITY * s1;
    let f2 = M12 * sin * (u[0] * u[0]) - M12 * GRAVITY * s2;
    let coupling = M12 * cos;
    let inverse = 1.0 / (M11 * M22 - coupling * coupling);
    [(M22 * f1 - coupling * f2) * inverse, (M11 * f2 - coupling * f1) * inverse]
}

/// A chain of L links on a cart, N = L + 1: the dense mass matrix and its LDLᵀ factorization.
#[inline(always)]
pub(crate) fn chain_dense<const L: usize, const N: usize>(q: &[f64; N], u: &[f64; N]) -> [f64; N] {
    let pairs: [(f64, f64); L] = core::array::from_fn(|i| q[i + 1].sin_cos());
    let mut outer = [0.0; L];
    let mut sum = 0.0;
    for i in (0..L).rev() {
        sum += mass(i);
        outer[i] = sum;
    }
    let (mut m, mut f) = ([[0.0; N]; N], [0.0; N]);
    m[0][0] = CART + outer[0];
    for i in 0..L {
        let (s, c) = pairs[i];
        let first = outer[i] * length(i);
        let square = u[i + 1] * u[i + 1];
        m[i + 1][0] = first * c;
        m[i + 1][i + 1] = first * length(i);
        f[i + 1] -= first * GRAVITY * s;
        f[0] += first * s * square;
        for j in 0..i {
            let (sj, cj) = pairs[j];
            m[i + 1][j + 1] = first * length(j) * (c * cj + s * sj);
            let lever = first * length(j) * (s * cj - c * sj);
            f[i + 1] -= lever * (u[j + 1] * u[j + 1]);
            f[j + 1] += lever * square;
        }
    }
    // LDLᵀ in place, forward substitution on the way.
    let mut inverse = [0.0; N];
    for j in 0..N {
        inverse[j] = 1.0 / m[j][j];
        for i in j + 1..N {
            let factor = m[i][j] * inverse[j];
            #[expect(clippy::needless_range_loop)] // rows i and k are rows of the same matrix
            for k in j + 1..=i {
                m[i][k] -= factor * m[k][j];
            }
            f[i] -= factor * f[j];
        }
    }
    let mut a = [0.0; N];
    for i in (0..N).rev() {
        let mut y = f[i];
        for k in i + 1..N {
            y -= m[k][i] * a[k];
        }
        a[i] = y * inverse[i];
    }
    a
}

/// The same chain in maximal coordinates: a tridiagonal system for the tensions of the rods, O(L).
#[inline(always)]
pub(crate) fn chain_tensions<const L: usize, const N: usize>(q: &[f64; N], u: &[f64; N]) -> [f64; N] {
    let pairs: [(f64, f64); L] = core::array::from_fn(|i| q[i + 1].sin_cos());
    let (mut along, mut across) = ([0.0; L], [0.0; L]);
    for i in 0..L - 1 {
        let ((s, c), (sn, cn)) = (pairs[i], pairs[i + 1]);
        along[i] = (c * cn + s * sn) / mass(i);
        across[i] = (c * sn - s * cn) / mass(i);
    }
    let (mut d, mut r) = ([0.0; L], [0.0; L]);
    for i in 0..L {
        r[i] = length(i) * u[i + 1] * u[i + 1];
        d[i] = 1.0 / mass(i) + if i > 0 { 1.0 / mass(i - 1) } else { 0.0 };
    }
    d[0] += pairs[0].0 * pairs[0].0 / CART;
    r[0] += GRAVITY * pairs[0].1;
    let mut inverse = [0.0; L];
    for i in (0..L).rev() {
        inverse[i] = 1.0 / d[i];
        if i > 0 {
            let factor = along[i - 1] * inverse[i];
            d[i - 1] -= factor * along[i - 1];
            r[i - 1] += factor * r[i];
        }
    }
    let mut tension = [0.0; L];
    tension[0] = r[0] * inverse[0];
    for i in 1..L {
        tension[i] = (r[i] + along[i - 1] * tension[i - 1]) * inverse[i];
    }
    let mut a = [0.0; N];
    a[0] = tension[0] * pairs[0].0 / CART;
    for i in 0..L {
        let (s, c) = pairs[i];
        let pulled = if i == 0 { -(GRAVITY * s) - c * a[0] } else { -tension[i - 1] * across[i - 1] };
        let next = if i + 1 < L { tension[i + 1] * across[i] } else { 0.0 };
        a[i + 1] = (pulled + next) / length(i);
    }
    a
}
