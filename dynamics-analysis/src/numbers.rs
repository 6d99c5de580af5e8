//! Random numbers, the same for the same seed: splitmix64 (G. L. Steele, D. Lea & C. H. Flood, *Fast
//! Splittable Pseudorandom Number Generators*, OOPSLA 2014).

pub(super) struct Numbers(pub(super) u64);

impl Numbers {
    /// By which the state grows from one number to the next.
    pub(super) const STEP: u64 = 0x9e37_79b9_7f4a_7c15;

    fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(Self::STEP);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }

    pub(super) fn within(&mut self, [from, to]: [f64; 2]) -> f64 {
        from + (to - from) * ((self.next() >> 11) as f64 / (1_u64 << 53) as f64)
    }

    pub(super) fn below(&mut self, count: usize) -> usize {
        ((u128::from(self.next()) * count as u128) >> 64) as usize
    }
}
