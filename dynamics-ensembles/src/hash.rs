//! A hash that is the same on every machine and in every version: of plans, and as check sums of blocks.

/// FNV-1a (G. Fowler, L. C. Noll & K.-P. Vo) on words of 64 bits, each mixed as in splitmix64: eight bytes at
/// once, so that check sums cost little beside the runs.
pub(crate) struct Hash(u64);

impl Hash {
    /// The offset basis of FNV-1a.
    const BASIS: u64 = 0xcbf2_9ce4_8422_2325;
    /// The prime of FNV-1a.
    const PRIME: u64 = 0x0000_0100_0000_01b3;

    pub(crate) fn new() -> Self {
        Self(Self::BASIS)
    }

    /// Takes a word in.
    pub(crate) fn add(&mut self, word: u64) {
        let mixed = (self.0 ^ word).wrapping_mul(Self::PRIME);
        self.0 = mixed ^ (mixed >> 29);
    }

    /// Takes bytes in, and their number.
    pub(crate) fn add_bytes(&mut self, bytes: &[u8]) {
        let (words, rest) = bytes.as_chunks::<8>();
        words.iter().for_each(|word| self.add(u64::from_le_bytes(*word)));
        let mut last = [0; 8];
        last[..rest.len()].copy_from_slice(rest);
        self.add(u64::from_le_bytes(last));
        self.add(bytes.len() as u64);
    }

    pub(crate) fn value(&self) -> u64 {
        self.0
    }
}

/// The hash of bytes.
pub(crate) fn of_bytes(bytes: &[u8]) -> u64 {
    let mut hash = Hash::new();
    hash.add_bytes(bytes);
    hash.value()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_bit_of_a_block_counts() {
        let bytes: Vec<u8> = (0..100).map(|k| (k * 37 % 251) as u8).collect();
        let of_all = of_bytes(&bytes);
        for place in 0..bytes.len() * 8 {
            let mut changed = bytes.clone();
            changed[place / 8] ^= 1 << (place % 8);
            assert_ne!(of_bytes(&changed), of_all, "bit {place}");
        }
        assert_ne!(of_bytes(&bytes[..99]), of_all);
        assert_ne!(of_bytes(&[]), of_bytes(&[0]));
    }
}
