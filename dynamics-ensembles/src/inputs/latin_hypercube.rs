//! Latin hypercubes (M. D. McKay, R. J. Beckman & W. J. Conover, 1979): of n points each n-th part of each
//! input has exactly one.
//!
//! The parts of an input are permuted by a Feistel network with four rounds on the smallest power of four
//! that holds n; places beyond n are permuted on until one is below n. So the part of a point is known
//! without those of the others.

use dynamics_analysis::shared::RandomNumbers;

/// Rounds of the network: four give a permutation that passes for random (M. Luby & C. Rackoff, 1988).
const ROUNDS: usize = 4;

/// A Latin hypercube of `count` points.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct LatinHypercube {
    count: usize,
    /// Keys of the rounds, and a seed of the places within parts, for each input.
    keys: Vec<([u64; ROUNDS], u64)>,
    /// Bits of half a place.
    half: u32,
}

impl LatinHypercube {
    pub(super) fn new(count: usize, dimensions: usize, seed: u64) -> Self {
        let mut numbers = RandomNumbers(seed);
        let keys = (0..dimensions).map(|_| (core::array::from_fn(|_| numbers.next()), numbers.next()));
        let bits = usize::BITS - count.saturating_sub(1).leading_zeros();
        Self { count, keys: keys.collect(), half: bits.div_ceil(2).max(1) }
    }

    /// The part of an input in which a point lies, from 0 to count − 1.
    fn part(&self, index: usize, dimension: usize) -> u64 {
        let (keys, mask) = (&self.keys[dimension].0, (1_u64 << self.half) - 1);
        let mut place = index as u64;
        loop {
            let (mut left, mut right) = (place >> self.half, place & mask);
            for key in keys {
                (left, right) = (right, left ^ (RandomNumbers(key ^ right).next() & mask));
            }
            place = left << self.half | right;
            if place < self.count as u64 {
                return place;
            }
        }
    }

    /// The coordinate of a point, between 0 and 1: anywhere in its part.
    pub(super) fn at(&self, index: usize, dimension: usize) -> f64 {
        let within = unit(self.keys[dimension].1, index as u64);
        let place = (self.part(index, dimension) as f64 + within) / self.count as f64;
        // With many points the last part rounds up to 1, where a normal distribution ends.
        place.min(1.0_f64.next_down())
    }
}

/// The number of this index of a random sequence, between 0 and 1, neither of them.
pub(super) fn unit(seed: u64, index: u64) -> f64 {
    let state = seed.wrapping_add(index.wrapping_mul(RandomNumbers::STATE_INCREMENT));
    // The middle of one of 2⁵² intervals.
    ((RandomNumbers(state).next() >> 12) as f64 + 0.5) / (1_u64 << 52) as f64
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_part_of_every_input_has_one_point() {
        for count in [1, 2, 3, 4, 5, 16, 17, 100, 1000, 4097] {
            let cube = LatinHypercube::new(count, 3, 11);
            for dimension in 0..3 {
                let part = |index| (cube.at(index, dimension) * count as f64).floor() as usize;
                let mut parts: Vec<usize> = (0..count).map(part).collect();
                parts.sort_unstable();
                assert!(parts.into_iter().eq(0..count), "{count} {dimension}");
            }
        }
    }

    /// Of so many points the last place within the last part rounds to 1.
    #[test]
    fn the_last_part_ends_below_one() {
        let count = 1_usize << 52;
        let cube = LatinHypercube::new(count, 1, 3);
        // The place of the last part, by the inverse of the network: rounds in reverse.
        let (keys, mask) = (cube.keys[0].0, (1_u64 << cube.half) - 1);
        let mut place = count as u64 - 1;
        let index = loop {
            let (mut left, mut right) = (place >> cube.half, place & mask);
            for key in keys.iter().rev() {
                (left, right) = (right ^ (RandomNumbers(key ^ left).next() & mask), left);
            }
            place = left << cube.half | right;
            if place < count as u64 {
                break place as usize;
            }
        };
        assert_eq!(cube.part(index, 0), count as u64 - 1);
        let at_end = (0..64).map(|seed| {
            let keys = vec![(keys, seed)];
            LatinHypercube { keys, ..cube.clone() }.at(index, 0)
        });
        assert!(at_end.into_iter().all(|x| x > 0.99 && x < 1.0));
    }

    /// Inputs are not correlated, nor are they with the number of the run: each correlation has the standard
    /// deviation 1/√n.
    #[test]
    fn parts_are_in_random_order() {
        let count = 10_000;
        for seed in 0..5 {
            let cube = LatinHypercube::new(count, 2, seed);
            let of = |dimension: usize| {
                let cube = &cube;
                move |index: usize| cube.at(index, dimension) - 0.5
            };
            let in_order = |index: usize| index as f64 / count as f64 - 0.5;
            let correlation = |a: &dyn Fn(usize) -> f64, b: &dyn Fn(usize) -> f64| {
                (0..count).map(|k| a(k) * b(k)).sum::<f64>() * 12.0 / count as f64
            };
            let found = [
                correlation(&of(0), &of(1)),
                correlation(&of(0), &in_order),
                correlation(&of(1), &in_order),
                // Neighbours.
                correlation(&of(0), &|k| cube.at((k + 1) % count, 0) - 0.5),
            ];
            assert!(found.iter().all(|r| r.abs() < 4.0 / (count as f64).sqrt()), "{seed} {found:?}");
        }
    }
}
