//! Coefficients of motions with constraints: Φ = 0 in every one of them.
//!
//! Coefficient k of the equations of motion and coefficient K = k + 2 of Φ = 0 are solved together for q̈ₖ
//! and λₖ, as q_K = τ²/(K(K−1)) q̈ₖ. The expressions of Φ are expanded two orders ahead of all others, in
//! lanes of their own; values that the equations of motion share with them are stored until those orders.

use core::array;

use nalgebra::SVector;

use super::{CauchySums, MAX_ORDER, RECIPROCAL, Rows, WIDTH, with_reciprocal};

/// Lanes by blocks.
type Blocks<const B: usize> = [[f64; WIDTH]; B];

/// Left and right factors of B blocks of lanes.
pub type Factors<const B: usize> = ([[f64; WIDTH]; B], [[f64; WIDTH]; B]);

/// The memory of series of motions with constraints: factors of B blocks of lanes, of A blocks ahead, and S
/// shared values.
#[derive(Clone, Debug)]
pub struct ConstrainedMemory<const B: usize, const A: usize, const S: usize> {
    rows: Rows<B>,
    ahead: Rows<A>,
    shared: [[f64; S]; MAX_ORDER + 1],
}

impl<const B: usize, const A: usize, const S: usize> Default for ConstrainedMemory<B, A, S> {
    fn default() -> Self {
        Self { rows: Rows::default(), ahead: Rows::default(), shared: [[0.0; S]; MAX_ORDER + 1] }
    }
}

/// How coefficients of one order follow from lower ones. N coordinates, R rows, the first H of them holonomic
/// and K others; order and its reciprocal are the first of the slices.
#[derive(Debug)]
pub struct Recurrences<Residue, Right, Solve, Next, Ahead> {
    /// (K and 1/K, sums ahead) ↦ coefficient K of Φ with q_K = 0.
    pub residue: Residue,
    /// (t, q, u, k and 1/k, shared, sums) ↦ right-hand sides of the equations of motion (N) and of
    /// nonholonomic rows (K).
    pub right: Right,
    /// Right-hand sides (N + R) ↦ q̈ and λ.
    pub solve: Solve,
    /// (t, q, u, k and 1/k, q̈ and λ, shared, sums) ↦ factors.
    pub next: Next,
    /// (t, q, K and 1/K, sums ahead) ↦ factors ahead, shared.
    pub ahead: Ahead,
}

/// Coefficients of q and u of the orders 0 to `q.len() − 1` (at most [`MAX_ORDER`]) from q₀, u₀ in the first
/// rows and q̈₀; `NR` is N + R.
#[inline(always)]
pub fn expand_constrained<
    const N: usize,
    const H: usize,
    const K: usize,
    const NR: usize,
    const B: usize,
    const A: usize,
    const S: usize,
>(
    a: &[f64; N],
    scale: f64,
    [q, u]: [&mut [SVector<f64, N>]; 2],
    ConstrainedMemory { rows, ahead, shared }: &mut ConstrainedMemory<B, A, S>,
    mut recurrences: Recurrences<
        impl FnMut(&[f64; 2], &[[f64; WIDTH]; A]) -> [f64; H],
        impl FnMut(f64, &[f64; N], &[f64; N], &[f64; 2], &[f64; S], &Blocks<B>) -> ([f64; N], [f64; K]),
        impl FnMut(&[f64; NR]) -> [f64; NR],
        impl FnMut(f64, &[f64; N], &[f64; N], &[f64; 2], &[f64; NR], &[f64; S], &Blocks<B>) -> Factors<B>,
        impl FnMut(f64, &[f64; N], &[f64; 2], &[[f64; WIDTH]; A]) -> (Factors<A>, [f64; S]),
    >,
) {
    let order = (q.len().min(u.len()) - 1).min(MAX_ORDER);
    let (mut lanes, mut ahead) = (CauchySums::new(rows), CauchySums::new(ahead));
    let time = |k: usize| if k == 1 { scale } else { 0.0 };
    // q_K from u of the order before, as values: see `CauchySums`.
    let position = |of_u: &[f64; N], late: usize| SVector::from(of_u.map(|x| scale * RECIPROCAL[late] * x));
    if order > 0 {
        q[1] = position(&u[0].data.0[0], 1);
        u[1] = SVector::from(a.map(|a| scale * a));
    }
    if order > 1 {
        q[2] = position(&u[1].data.0[0], 2);
    }
    for late in 1..=order + 1 {
        let (sums_ahead, of_late) = (ahead.sums(late), with_reciprocal(late));
        if late > 2 {
            let k = late - 2;
            let (t, sums, of_k) = (time(k), lanes.sums(k), with_reciprocal(k));
            let (of_q, of_u, of_shared) = (q[k].data.0[0], u[k].data.0[0], shared[k]);
            let residue = (recurrences.residue)(&of_late, &sums_ahead.values());
            let (motion, slip) = (recurrences.right)(t, &of_q, &of_u, &of_k, &of_shared, &sums.values());
            let mut right = [0.0; NR];
            right[..N].copy_from_slice(&motion);
            let per_square = -((late * (late - 1)) as f64 / (scale * scale));
            (0..H).for_each(|i| right[N + i] = per_square * residue[i]);
            right[N + H..].copy_from_slice(&slip);
            let solved = (recurrences.solve)(&right);
            let (left, right) =
                (recurrences.next)(t, &of_q, &of_u, &of_k, &solved, &of_shared, &sums.values());
            lanes.store(k, left, right);
            let factor = scale * RECIPROCAL[k + 1];
            let of_u: [f64; N] = array::from_fn(|i| factor * solved[i]);
            u[k + 1] = SVector::from(of_u);
            if late <= order {
                q[late] = position(&of_u, late);
            }
        }
        if late <= order {
            let ((left, right), of_shared) =
                (recurrences.ahead)(time(late), &q[late].data.0[0], &of_late, &sums_ahead.values());
            ahead.store(late, left, right);
            shared[late] = of_shared;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_pendulum_stays_on_its_circle_in_every_coefficient() {
        // A unit mass on the unit circle, Φ = x² + y² − 1, gravity −1 along y: q̈ = (0, −1) + 2 λ q.
        const ORDER: usize = 14;
        let rows = [SVector::<f64, 2>::zeros(); ORDER + 1];
        let (mut q, mut u) = (rows, rows);
        let (place, velocity) = ([0.6, -0.8], [0.4, 0.3]);
        (q[0], u[0]) = (place.into(), velocity.into());
        // 2 λ = −(u² − y) from q·q̈ = −u².
        let twice = -(0.25 - place[1]);
        let lambda = 0.5 * twice;
        let a = [twice * place[0], -1.0 + twice * place[1]];
        let scale = 0.5;
        let ([x0, y0], l0) = (place, lambda);
        let lanes = |a: f64, b: f64| [[a, b, 0.0, 0.0]];
        let recurrences = Recurrences {
            residue: |_: &[f64; 2], s: &[[f64; WIDTH]; 1]| [s[0][0] + s[0][1]],
            right: |_: f64, q: &[f64; 2], _: &[f64; 2], _: &[f64; 2], _: &[f64; 0], s: &[[f64; WIDTH]; 1]| {
                ([2.0 * (s[0][0] + q[0] * l0), 2.0 * (s[0][1] + q[1] * l0)], [])
            },
            // a − 2 q₀ λ = f, 2 q₀·a = g with |q₀| = 1.
            solve: |r: &[f64; 3]| {
                let l = 0.25 * (r[2] - 2.0 * (x0 * r[0] + y0 * r[1]));
                [r[0] + 2.0 * x0 * l, r[1] + 2.0 * y0 * l, l]
            },
            next: |_: f64,
                   q: &[f64; 2],
                   _: &[f64; 2],
                   _: &[f64; 2],
                   s: &[f64; 3],
                   _: &[f64; 0],
                   _: &[[f64; WIDTH]; 1]| { (lanes(q[0], q[1]), lanes(s[2], s[2])) },
            ahead: |_: f64, q: &[f64; 2], _: &[f64; 2], _: &[[f64; WIDTH]; 1]| {
                ((lanes(q[0], q[1]), lanes(q[0], q[1])), [])
            },
        };
        expand_constrained(&a, scale, [&mut q, &mut u], &mut ConstrainedMemory::default(), recurrences);
        for k in 1..=ORDER {
            let circle: f64 = (0..=k).map(|j| q[j].dot(&q[k - j])).sum();
            assert!(circle.abs() < 1e-16, "order {k}: {circle:e}");
            // Energy: ½ u·u + y.
            let energy: f64 = (0..=k).map(|j| 0.5 * u[j].dot(&u[k - j])).sum::<f64>() + q[k][1];
            assert!(energy.abs() < 1e-16, "order {k}: {energy:e}");
        }
        assert!(q[ORDER].norm() > 1e-12);
    }
}
