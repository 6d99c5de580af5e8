//! Pseudorandom numbers by splitmix64 (G. L. Steele, D. Lea & C. H. Flood, *Fast Splittable Pseudorandom
//! Number Generators*, OOPSLA 2014). The same seed gives the same numbers on every machine, so searches from
//! random starts and bootstraps can be repeated.

/// A generator; the field is its state, at first the seed.
pub struct RandomNumbers(pub u64);

impl RandomNumbers {
    /// Increment of the state per number: 2⁶⁴ divided by the golden ratio, made odd, as published. Seeds
    /// that differ by multiples of it give different sequences.
    pub const STATE_INCREMENT: u64 = 0x9e37_79b9_7f4a_7c15;

    /// 64 random bits.
    // Not an iterator: it has no end.
    #[allow(clippy::should_implement_trait)]
    pub fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(Self::STATE_INCREMENT);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }

    /// Uniform in an interval, with the 53 upper bits.
    pub fn within(&mut self, [from, to]: [f64; 2]) -> f64 {
        from + (to - from) * ((self.next() >> 11) as f64 / (1_u64 << 53) as f64)
    }

    /// A whole number from 0 to `count` − 1. The bias of the product method is at most count/2⁶⁴.
    pub fn below(&mut self, count: usize) -> usize {
        ((u128::from(self.next()) * count as u128) >> 64) as usize
    }
}
