//! Taylor coefficients of a motion, order by order: what all generated series share.
//!
//! A value x has coefficients xₖ with x(t₀ + s τ) = Σ xₖ sᵏ. In units of a time τ that is about a step long they neither overflow nor
//! underflow, whatever the units of a model. Generated code says how coefficients of order k follow from lower ones; the Cauchy sums that
//! it needs, Σ aⱼ bₖ₋ⱼ over j = 1 … k−1, are formed here, for all products of a model side by side.

use nalgebra::SVector;

use crate::math::add_product;

/// Highest order of a series.
pub const MOST_ORDER: usize = 36;

/// Coefficients of one order k: q̈, then left and right factors of all lanes.
pub type Coefficients<const N: usize, const L: usize> = ([f64; N], [f64; L], [f64; L]);

/// Reciprocals of the orders.
const RECIPROCAL: [f64; MOST_ORDER + 1] = {
    let mut table = [0.0; MOST_ORDER + 1];
    let mut k = 1;
    while k <= MOST_ORDER {
        table[k] = 1.0 / k as f64;
        k += 1;
    }
    table
};

/// Coefficients of q and u of the orders 0 to `q.len() − 1` (at most [`MOST_ORDER`]) from q₀, u₀ in the first rows, q̈₀, and `next`:
/// (coefficients of t, q and u; k and 1/k; sums of the lanes) ↦ those of q̈ and of the lanes' factors.
#[inline(always)]
pub fn expand<const N: usize, const L: usize>(
    a: &[f64; N],
    scale: f64,
    q: &mut [SVector<f64, N>],
    u: &mut [SVector<f64, N>],
    mut next: impl FnMut(f64, &[f64; N], &[f64; N], &[f64; 2], &[f64; L]) -> Coefficients<N, L>,
) {
    let order = (q.len().min(u.len()) - 1).min(MOST_ORDER);
    let (mut left, mut right) = ([[0.0; L]; MOST_ORDER], [[0.0; L]; MOST_ORDER]);
    let advance = |q: &mut [SVector<f64, N>], u: &mut [SVector<f64, N>], k: usize, a: &[f64; N]| {
        let factor = scale * RECIPROCAL[k + 1];
        for i in 0..N {
            q[k + 1][i] = factor * u[k][i];
            u[k + 1][i] = factor * a[i];
        }
    };
    if order > 0 {
        advance(q, u, 0, a);
    }
    // The terms of the sums of order k in which no factor of order k − 1 occurs are formed while those are computed, and the two others from
    // registers: nothing waits for what has just been stored.
    let mut known = [0.0; L];
    let (mut last_left, mut last_right) = ([0.0; L], [0.0; L]);
    for k in 1..order {
        let mut sums = known;
        if k > 1 {
            let (first_left, first_right) = (&left[1], &right[1]);
            for i in 0..L {
                sums[i] = add_product(sums[i], first_left[i], last_right[i]);
            }
            if k > 2 {
                for i in 0..L {
                    sums[i] = add_product(sums[i], last_left[i], first_right[i]);
                }
            }
        }
        known = if k > 2 { cauchy(&left[2..k], &right[2..k]) } else { [0.0; L] };
        let t = if k == 1 { scale } else { 0.0 };
        let a;
        (a, last_left, last_right) = next(t, &q[k].data.0[0], &u[k].data.0[0], &[k as f64, RECIPROCAL[k]], &sums);
        (left[k], right[k]) = (last_left, last_right);
        advance(q, u, k, &a);
    }
}

/// Σⱼ left[j]·right[last − j], lane by lane.
#[inline(always)]
fn cauchy<const L: usize>(left: &[[f64; L]], right: &[[f64; L]]) -> [f64; L] {
    let mut sums = [0.0; L];
    for (a, b) in left.iter().zip(right.iter().rev()) {
        for i in 0..L {
            sums[i] = add_product(sums[i], a[i], b[i]);
        }
    }
    sums
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn products_of_series_are_cauchy_sums() {
        // q̈ = q² from q = 1, u = 1: a = q²; by hand a₀ = 1, a₁ = 2 u₀, a₂ = u₀² + 2·½ a₀, … in units of τ = ½.
        let (mut q, mut u) = ([SVector::<f64, 1>::zeros(); 4], [SVector::<f64, 1>::zeros(); 4]);
        (q[0][0], u[0][0]) = (1.0, 1.0);
        expand(&[1.0], 0.5, &mut q, &mut u, |_, q, _, _, sums| ([2.0 * q[0] + sums[0]], *q, *q));
        let found: [f64; 4] = core::array::from_fn(|k| u[k][0] * f64::powi(2.0, k as i32));
        assert_eq!(found, [1.0, 1.0, 1.0, 2.0 / 3.0]);
    }
}
