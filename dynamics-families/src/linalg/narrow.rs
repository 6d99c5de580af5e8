//! L D Lᵀ of narrow bands: their half width B is known to the compiler, so that rows stay in registers.
//!
//! Operations and their order are those of bands of any width (`banded.rs`), and so are the bits.

/// The last B rows of L and pivots, the oldest first.
pub(super) struct Window<const B: usize> {
    rows: [[f64; B]; B],
    inverse: [f64; B],
}

/// What a row of the matrix becomes.
pub(super) struct Row<const B: usize> {
    pub(super) lower: [f64; B],
    pub(super) pivot: f64,
}

impl<const B: usize> Window<B> {
    pub(super) fn new() -> Self {
        Self { rows: [[0.0; B]; B], inverse: [0.0; B] }
    }

    /// Eliminates a row: its entries left of the diagonal, and the one on it.
    #[inline(always)]
    pub(super) fn eliminate(&self, entries: &[f64; B], diagonal: f64) -> Row<B> {
        let (mut row, mut lower, mut pivot) = (*entries, [0.0; B], diagonal);
        for j in 0..B {
            let mut value = row[j];
            for (known, l) in row[..j].iter().zip(&self.rows[j][B - j..]) {
                value -= known * l;
            }
            row[j] = value;
            lower[j] = value * self.inverse[j];
            pivot -= value * lower[j];
        }
        Row { lower, pivot }
    }

    /// Takes a row with the inverse of its pivot.
    #[inline(always)]
    pub(super) fn push(&mut self, lower: [f64; B], inverse: f64) {
        // Moves from register to register; `rotate_left` is a call.
        for k in 1..B {
            (self.rows[k - 1], self.inverse[k - 1]) = (self.rows[k], self.inverse[k]);
        }
        (self.rows[B - 1], self.inverse[B - 1]) = (lower, inverse);
    }
}

/// Replaces x by the solution of L D Lᵀ.
pub(super) fn solve<const B: usize>(lower: &[f64], inverse: &[f64], x: &mut [f64]) {
    let (rows, _) = lower.as_chunks::<B>();
    let mut before = [0.0; B];
    for (x, row) in x.iter_mut().zip(rows) {
        let mut value = *x;
        for (l, before) in row.iter().zip(&before) {
            value -= l * before;
        }
        for k in 1..B {
            before[k - 1] = before[k];
        }
        before[B - 1] = value;
        *x = value;
    }
    // What the rows behind a place subtract from it, the furthest first.
    let mut behind = [(0.0, [0.0; B]); B];
    for ((x, inverse), row) in x.iter_mut().zip(inverse).zip(rows).rev() {
        let mut value = *x * inverse;
        for k in (0..B).rev() {
            let (z, row) = &behind[k];
            value -= row[B - 1 - k] * z;
        }
        for k in (1..B).rev() {
            behind[k] = behind[k - 1];
        }
        behind[0] = (value, *row);
        *x = value;
    }
}

/// How many stretches of a recurrence run side by side.
const STRETCHES: usize = 8;
/// Bits after which a stretch has forgotten where it began.
const FORGOTTEN_BITS: f64 = 62.0;
/// Longest way that a stretch may need for it.
const LONGEST_WAY: usize = 400;

/// Places after which a recurrence xᵢ − lᵢ xᵢ₋₁ has forgotten its start; none where that takes too long. The
/// inverse of a mass matrix decays from its diagonal, by 2 − √3 a node for linear elements.
pub(super) fn way(lower: &[f64]) -> Option<usize> {
    let largest = lower.iter().fold(0.0f64, |most, l| most.max(l.abs()));
    let way = (FORGOTTEN_BITS / -largest.log2()).ceil();
    (largest < 1.0 && way <= LONGEST_WAY as f64).then_some(way.max(1.0) as usize)
}

/// Replaces x by the solution of a tridiagonal L D Lᵀ, in stretches that begin `way` places early. Exact to
/// rounding; the bits depend on the matrix alone. Short ones in one piece.
pub(super) fn solve_tridiagonal(lower: &[f64], inverse: &[f64], x: &mut [f64], way: Option<usize>) {
    let length = x.len() / STRETCHES;
    let Some(way) = way.filter(|way| length > 2 * way) else {
        forward(lower, x, 0.0);
        backward(lower, inverse, x, [0.0; 2]);
        return;
    };
    let whole = length * STRETCHES;
    // What each stretch begins with, before others have changed what it comes from.
    let mut carried: [f64; STRETCHES] = core::array::from_fn(|k| {
        let begin = k * length;
        let early = begin - way.min(begin);
        let both = x[early..begin].iter().zip(&lower[early..begin]);
        both.fold(0.0, |before, (x, l)| x - l * before)
    });
    {
        let mut pieces = x[..whole].chunks_exact_mut(length);
        let pieces: [&mut [f64]; STRETCHES] = core::array::from_fn(|_| pieces.next().unwrap_or_default());
        let rows: [&[f64]; STRETCHES] = core::array::from_fn(|k| &lower[k * length..(k + 1) * length]);
        for i in 0..length {
            for k in 0..STRETCHES {
                carried[k] = pieces[k][i] - rows[k][i] * carried[k];
                pieces[k][i] = carried[k];
            }
        }
    }
    forward(&lower[whole..], &mut x[whole..], carried[STRETCHES - 1]);
    let last = backward(&lower[whole..], &inverse[whole..], &mut x[whole..], [0.0; 2]);
    // [solution, l] of the place behind each stretch.
    let mut carried: [[f64; 2]; STRETCHES] = core::array::from_fn(|k| {
        let end = (k + 1) * length;
        if end == whole {
            return last;
        }
        let late = end + way;
        let all = x[end..late].iter().zip(&inverse[end..late]).zip(&lower[end..late]);
        all.rev().fold([0.0; 2], |[after, l_after], ((x, inverse), l)| [x * inverse - l_after * after, *l])
    });
    let mut pieces = x[..whole].chunks_exact_mut(length);
    let pieces: [&mut [f64]; STRETCHES] = core::array::from_fn(|_| pieces.next().unwrap_or_default());
    let [rows, pivots] = [lower, inverse]
        .map(|all| -> [&[f64]; STRETCHES] { core::array::from_fn(|k| &all[k * length..(k + 1) * length]) });
    for i in (0..length).rev() {
        for k in 0..STRETCHES {
            let [after, l_after] = carried[k];
            let value = pieces[k][i] * pivots[k][i] - l_after * after;
            pieces[k][i] = value;
            carried[k] = [value, rows[k][i]];
        }
    }
}

fn forward(lower: &[f64], x: &mut [f64], mut before: f64) {
    for (x, l) in x.iter_mut().zip(lower) {
        before = *x - l * before;
        *x = before;
    }
}

/// The solution from the end; [solution, l] of the first place.
fn backward(lower: &[f64], inverse: &[f64], x: &mut [f64], mut behind: [f64; 2]) -> [f64; 2] {
    for ((x, inverse), l) in x.iter_mut().zip(inverse).zip(lower).rev() {
        let [after, l_after] = behind;
        *x = *x * inverse - l_after * after;
        behind = [*x, *l];
    }
    behind
}
