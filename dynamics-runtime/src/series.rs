//! Taylor coefficients of a motion, order by order: what all generated series share.
//!
//! A value x has coefficients xₖ with x(t₀ + s τ) = Σ xₖ sᵏ. In units of a time τ that is about a step long
//! they neither overflow nor underflow, whatever the units of a model. Generated code says how coefficients
//! of order k follow from lower ones; the Cauchy sums that it needs, Σ aⱼ bₖ₋ⱼ over j = 1 … k−1, are formed
//! here, for all products of a model side by side.

mod constrained;
mod equations;

use nalgebra::SVector;
use wide::f64x4;

pub use constrained::{ConstrainedMemory, Factors, Recurrences, expand_constrained};
pub use equations::{Equations, multipliers};

pub use crate::model::MAX_SERIES_ORDER as MAX_ORDER;

/// Sums of a block: one vector register, or two. With twice as many a double pendulum has two lanes of
/// zeros, and takes 3 % longer.
pub const WIDTH: usize = 4;

/// Values of B·[`WIDTH`] lanes, as vectors. Without explicit vectors the compiler also vectorises the scalar
/// code around them; packing and unpacking then takes a fifth of the time of a double pendulum.
#[derive(Clone, Copy, Debug)]
struct Row<const B: usize>([f64x4; B]);

impl<const B: usize> Row<B> {
    const ZERO: Self = Self([f64x4::ZERO; B]);

    #[inline(always)]
    fn new(values: [[f64; WIDTH]; B]) -> Self {
        Self(values.map(f64x4::from))
    }

    #[inline(always)]
    fn values(self) -> [[f64; WIDTH]; B] {
        self.0.map(f64x4::to_array)
    }
}

/// Coefficients of one order k: q̈, then left and right factors of all lanes.
pub type Coefficients<const N: usize, const B: usize> = ([f64; N], [[f64; WIDTH]; B], [[f64; WIDTH]; B]);

/// Reciprocals of the orders, and of the one after them.
const RECIPROCAL: [f64; MAX_ORDER + 2] = {
    let mut table = [0.0; MAX_ORDER + 2];
    let mut k = 1;
    while k < table.len() {
        table[k] = 1.0 / k as f64;
        k += 1;
    }
    table
};

/// k and 1/k.
#[inline(always)]
fn with_reciprocal(k: usize) -> [f64; 2] {
    [k as f64, RECIPROCAL[k]]
}

/// Factors of all lanes, order by order.
#[derive(Clone, Debug)]
pub struct Rows<const B: usize> {
    left: [Row<B>; MAX_ORDER + 1],
    right: [Row<B>; MAX_ORDER + 1],
}

impl<const B: usize> Default for Rows<B> {
    fn default() -> Self {
        Self { left: [Row::ZERO; MAX_ORDER + 1], right: [Row::ZERO; MAX_ORDER + 1] }
    }
}

/// The memory of the series of a model: Z values at their start, and the factors of lanes. It belongs to one
/// model and its constants.
///
/// Clearing the rows for every series took a twentieth of the time of a double pendulum, evaluating its sines
/// twice a tenth.
#[derive(Clone, Debug)]
pub struct Memory<S, const Z: usize, const B: usize> {
    /// The state of the values.
    start: Option<S>,
    values: [f64; Z],
    rows: Rows<B>,
}

impl<S, const Z: usize, const B: usize> Default for Memory<S, Z, B> {
    fn default() -> Self {
        Self { start: None, values: [0.0; Z], rows: Rows::default() }
    }
}

impl<S: PartialEq, const Z: usize, const B: usize> Memory<S, Z, B> {
    /// Keeps the values at a state.
    #[inline(always)]
    pub fn begin(&mut self, state: S, values: [f64; Z]) {
        (self.start, self.values) = (Some(state), values);
    }

    /// Whether the values are those at this state.
    #[inline(always)]
    #[must_use]
    pub fn begins_at(&self, state: &S) -> bool {
        self.start.as_ref() == Some(state)
    }

    /// The values, and room for factors.
    #[inline(always)]
    pub fn parts(&mut self) -> (&[f64; Z], &mut Rows<B>) {
        (&self.values, &mut self.rows)
    }
}

/// Coefficients of q and u of the orders 0 to `q.len() − 1` (at most [`MAX_ORDER`]) from q₀, u₀ in the first
/// rows, q̈₀, and `next`: (coefficients of t, q and u; k and 1/k; sums of the lanes) ↦ those of q̈ and of the
/// lanes' factors.
#[inline(always)]
pub fn expand<const N: usize, const B: usize>(
    a: &[f64; N],
    scale: f64,
    [q, u]: [&mut [SVector<f64, N>]; 2],
    rows: &mut Rows<B>,
    mut next: impl FnMut(f64, &[f64; N], &[f64; N], &[f64; 2], &[[f64; WIDTH]; B]) -> Coefficients<N, B>,
) {
    let order = (q.len().min(u.len()) - 1).min(MAX_ORDER);
    // Coefficients of order k are kept as values: rows that have just been stored element by element cannot
    // be loaded as vectors for some cycles.
    let (mut of_q, mut of_u) = (q[0].data.0[0], u[0].data.0[0]);
    let mut advance = |of_q: &mut [f64; N], of_u: &mut [f64; N], k: usize, a: &[f64; N]| {
        let factor = scale * RECIPROCAL[k + 1];
        for i in 0..N {
            (of_q[i], of_u[i]) = (factor * of_u[i], factor * a[i]);
            (q[k + 1][i], u[k + 1][i]) = (of_q[i], of_u[i]);
        }
    };
    if order > 0 {
        advance(&mut of_q, &mut of_u, 0, a);
    }
    let mut lanes = CauchySums::new(rows);
    for k in 1..order {
        let sums = lanes.sums(k);
        let t = if k == 1 { scale } else { 0.0 };
        let (a, left, right) = next(t, &of_q, &of_u, &with_reciprocal(k), &sums.values());
        lanes.store(k, left, right);
        advance(&mut of_q, &mut of_u, k, &a);
    }
}

/// Cauchy sums of all lanes, order by order.
///
/// Rows that have just been stored element by element cannot be loaded as vectors for some cycles. So the
/// terms of order k + 1 are summed while order k is computed: those of rows before the last from memory,
/// those of the last row (k − 1) from `last`. Terms with row k are added when it is computed.
struct CauchySums<'m, const B: usize> {
    rows: &'m mut Rows<B>,
    known: Row<B>,
    last: (Row<B>, Row<B>),
}

impl<'m, const B: usize> CauchySums<'m, B> {
    fn new(rows: &'m mut Rows<B>) -> Self {
        Self { rows, known: Row::ZERO, last: (Row::ZERO, Row::ZERO) }
    }

    /// Sums of order k, and what is known of those of order k + 1. Called for every order k ≥ 1, before its
    /// factors are stored.
    #[inline(always)]
    fn sums(&mut self, k: usize) -> Row<B> {
        let Self { rows: Rows { left, right }, known, last } = self;
        let mut sums = *known;
        match k {
            1 => {}
            2 => add(&mut sums, &last.0, &last.1),
            _ => {
                add(&mut sums, &left[1], &last.1);
                add(&mut sums, &last.0, &right[1]);
            }
        }
        *known = if k > 4 { cauchy(&left[3..k - 1], &right[3..k - 1]) } else { Row::ZERO };
        match k {
            1 | 2 => {}
            3 => add(known, &last.0, &last.1),
            _ => {
                add(known, &left[2], &last.1);
                add(known, &last.0, &right[2]);
            }
        }
        sums
    }

    /// Stores the factors of order k.
    #[inline(always)]
    fn store(&mut self, k: usize, left: [[f64; WIDTH]; B], right: [[f64; WIDTH]; B]) {
        self.last = (Row::new(left), Row::new(right));
        (self.rows.left[k], self.rows.right[k]) = self.last;
    }
}

/// sum + a·b, as [`crate::math::add_product`].
#[inline(always)]
fn add_products(sum: f64x4, a: f64x4, b: f64x4) -> f64x4 {
    #[cfg(feature = "std")]
    if crate::sin_cos::FUSED {
        return a.mul_add(b, sum);
    }
    sum + a * b
}

/// sum + left·right, lane by lane.
#[inline(always)]
fn add<const B: usize>(sum: &mut Row<B>, left: &Row<B>, right: &Row<B>) {
    for b in 0..B {
        sum.0[b] = add_products(sum.0[b], left.0[b], right.0[b]);
    }
}

/// Blocks of lanes whose even and odd sums fit into the registers together.
const BLOCKS_IN_REGISTERS: usize = 4;

/// Σⱼ left[j]·right[last − j], lane by lane.
#[inline(always)]
fn cauchy<const B: usize>(left: &[Row<B>], right: &[Row<B>]) -> Row<B> {
    if B <= BLOCKS_IN_REGISTERS {
        return Row(blocks::<B, B>(left, right, 0));
    }
    let mut sums = Row::<B>::ZERO;
    for b in (0..B).step_by(2) {
        if b + 1 < B {
            [sums.0[b], sums.0[b + 1]] = blocks::<B, 2>(left, right, b);
        } else {
            [sums.0[b]] = blocks::<B, 1>(left, right, b);
        }
    }
    sums
}

/// [`cauchy`] of W blocks from block `first` on, even and odd terms separately: an addition has to wait for
/// the one before it.
#[inline(always)]
fn blocks<const B: usize, const W: usize>(left: &[Row<B>], right: &[Row<B>], first: usize) -> [f64x4; W] {
    let (mut even, mut odd) = ([f64x4::ZERO; W], [f64x4::ZERO; W]);
    let (pairs, single) = left.as_chunks::<2>();
    let (other, turned) = right.as_rchunks::<2>();
    let add = |sums: &mut [f64x4; W], x: &Row<B>, y: &Row<B>| {
        for (b, sum) in sums.iter_mut().enumerate() {
            *sum = add_products(*sum, x.0[first + b], y.0[first + b]);
        }
    };
    for ([x, y], [y_right, x_right]) in pairs.iter().zip(turned.iter().rev()) {
        add(&mut even, x, x_right);
        add(&mut odd, y, y_right);
    }
    if let ([x], [x_right]) = (single, other) {
        add(&mut even, x, x_right);
    }
    core::array::from_fn(|b| even[b] + odd[b])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn products_of_series_are_cauchy_sums() {
        // q̈ = q², q(0) = u(0) = 1, in units of τ = ½, against sums as they are defined.
        const ORDER: usize = 12;
        let rows = [SVector::<f64, 1>::zeros(); ORDER + 1];
        let (mut q, mut u) = (rows, rows);
        (q[0][0], u[0][0]) = (1.0, 1.0);
        expand::<1, 1>(&[1.0], 0.5, [&mut q, &mut u], &mut Rows::default(), |_, q, _, _, sums| {
            let factors = [[q[0], 0.0, 0.0, 0.0]];
            ([2.0 * q[0] + sums[0][0]], factors, factors)
        });
        for k in 0..ORDER {
            let square: f64 = (0..=k).map(|j| q[j][0] * q[k - j][0]).sum();
            let next = 0.5 * square / (k + 1) as f64;
            assert!((u[k + 1][0] - next).abs() < 1e-15 * next, "order {k}: {} and {next}", u[k + 1][0]);
            assert_eq!(q[k + 1][0], 0.5 / (k + 1) as f64 * u[k][0]);
        }
    }
}
