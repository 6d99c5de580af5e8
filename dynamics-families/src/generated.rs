//! What loops over elements share: blocks, and sums whose bits depend on nothing but their terms.

/// How many elements are handled together. A buffer of so many numbers stays in the first-level cache.
pub const BLOCK: usize = 256;

/// Sums side by side within a block. Their number is fixed, so that the width of vectors changes no bit.
const LANES: usize = 8;

/// The sum of at most a block: eight sums side by side, then those pairwise.
#[inline(always)]
#[must_use]
pub fn block_sum(values: &[f64]) -> f64 {
    let mut lanes = [0.0; LANES];
    let mut whole = values.chunks_exact(LANES);
    for values in &mut whole {
        for (lane, value) in lanes.iter_mut().zip(values) {
            *lane += value;
        }
    }
    for (lane, value) in lanes.iter_mut().zip(whole.remainder()) {
        *lane += value;
    }
    let [a, b, c, d, e, f, g, h] = lanes;
    ((a + e) + (c + g)) + ((b + f) + (d + h))
}

/// A sum of the sums of blocks, pairwise: its rounding error grows with the logarithm of their number.
///
/// Blocks have to come in order. Levels of the tree are kept as in a binary counter.
#[derive(Clone, Debug)]
pub struct Sum {
    levels: [f64; 64],
    blocks: u64,
}

impl Default for Sum {
    fn default() -> Self {
        Self::new()
    }
}

impl Sum {
    /// The empty sum.
    #[must_use]
    pub const fn new() -> Self {
        Self { levels: [0.0; 64], blocks: 0 }
    }

    /// Adds the sum of the next block.
    #[inline(always)]
    pub fn add(&mut self, block: f64) {
        let mut carried = block;
        let level = self.blocks.trailing_ones() as usize;
        for full in &self.levels[..level] {
            carried += full;
        }
        self.levels[level] = carried;
        self.blocks += 1;
    }

    /// The sum of all blocks.
    #[must_use]
    pub fn total(&self) -> f64 {
        let mut sum = 0.0;
        for (level, value) in self.levels.iter().enumerate() {
            if self.blocks >> level & 1 == 1 {
                sum += value;
            }
        }
        sum
    }
}

/// The sum of `term(i)` over a range, in blocks, then pairwise.
#[inline(always)]
pub fn sum(range: core::ops::Range<usize>, term: impl Fn(usize) -> f64) -> f64 {
    let mut total = Sum::new();
    let mut buffer = [0.0; BLOCK];
    let mut from = range.start;
    while from < range.end {
        let to = range.end.min(from + BLOCK);
        for (place, i) in buffer.iter_mut().zip(from..to) {
            *place = term(i);
        }
        total.add(block_sum(&buffer[..to - from]));
        from = to;
    }
    total.total()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sums_of_whole_numbers_are_exact() {
        for n in [0usize, 1, 7, 8, 255, 256, 257, 1000, 100_000] {
            assert_eq!(sum(0..n, |i| i as f64), (n * n.saturating_sub(1) / 2) as f64, "{n}");
        }
    }

    /// A running sum of a million tenths is off by 1.3e-6.
    #[test]
    fn rounding_grows_with_the_logarithm() {
        assert!((sum(0..1_000_000, |_| 0.1) - 1e5).abs() < 1e-10);
    }
}
