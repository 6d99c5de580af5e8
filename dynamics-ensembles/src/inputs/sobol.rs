//! The Sobol sequence (I. M. Sobol', 1967), in the order of Antonov and Saleev (Gray code), with random
//! access: points fill the unit cube evenly, each power of two of them in every elementary interval.
//!
//! x_n = ⊕ V_k over the bits k of n ⊕ ⌊n/2⌋. V_k = m_k 2^−k, and with the primitive polynomial
//! x^s + a₁ x^{s−1} + … + a_{s−1} x + 1 m_k = 2 a₁ m_{k−1} ⊕ 2² a₂ m_{k−2} ⊕ … ⊕ 2^s
//! m_{k−s} ⊕ m_{k−s}.
//!
//! A seed scrambles the digits (A. B. Owen, 1995), by the hash of N. Vegdahl after S. Laine & T. Karras (B.
//! Burley, *Practical hash-based Owen scrambling*, JCGT 9, 2020) for the upper 32 digits. The points stay as
//! even, and means over them have no bias.

use dynamics_analysis::shared::RandomNumbers;

use super::sobol_table::DIRECTIONS;

/// Binary digits of a coordinate: as many as a half added to them leaves exact.
pub(super) const DIGITS: u32 = 52;
/// Dimensions of the sequence.
pub(super) const MAX_DIMENSIONS: usize = DIRECTIONS.len() + 1;
/// Digits below those that are scrambled by the hash.
const LOWER_DIGITS: u32 = DIGITS - 32;

/// The sequence in some dimensions.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Sobol {
    /// V_k of each dimension, as multiples of 2^−52.
    directions: Vec<[u64; DIGITS as usize]>,
    /// Seeds of the scrambling of each dimension; none: not scrambled.
    seeds: Option<Vec<u64>>,
}

impl Sobol {
    /// At most [`MAX_DIMENSIONS`] dimensions.
    pub(super) fn new(dimensions: usize, seed: Option<u64>) -> Self {
        let directions = (0..dimensions.min(MAX_DIMENSIONS)).map(directions).collect();
        let seeds = seed.map(|seed| {
            let mut numbers = RandomNumbers(seed);
            (0..dimensions).map(|_| numbers.next()).collect()
        });
        Self { directions, seeds }
    }

    /// The coordinate of a point, as a multiple of 2^−52.
    fn digits(&self, index: usize, dimension: usize) -> u64 {
        let (mut gray, mut x) = (index as u64 ^ (index as u64 >> 1), 0);
        while gray != 0 {
            x ^= self.directions[dimension][gray.trailing_zeros() as usize];
            gray &= gray - 1;
        }
        match &self.seeds {
            Some(seeds) => scrambled(x, seeds[dimension]),
            None => x,
        }
    }

    /// The coordinate of a point: the middle of its interval of length 2^−52, so that it is neither 0 nor
    /// 1.
    pub(super) fn at(&self, index: usize, dimension: usize) -> f64 {
        (self.digits(index, dimension) as f64 + 0.5) / (1_u64 << DIGITS) as f64
    }
}

/// V_1 to V_52 of a dimension.
fn directions(dimension: usize) -> [u64; DIGITS as usize] {
    let mut m = [1_u64; DIGITS as usize];
    if let Some([polynomial, first @ ..]) = dimension.checked_sub(1).map(|row| DIRECTIONS[row]) {
        let degree = first.len();
        for k in 0..m.len() {
            m[k] = match first.get(k) {
                Some(given) => u64::from(*given),
                None => {
                    let mut next = m[k - degree] ^ (m[k - degree] << degree);
                    for i in 1..degree {
                        if polynomial >> (degree - i) & 1 == 1 {
                            next ^= m[k - i] << i;
                        }
                    }
                    next
                }
            };
        }
    }
    core::array::from_fn(|k| m[k] << (DIGITS as usize - 1 - k))
}

/// The digits in nested random order: each digit is changed or not as the higher ones and the seed say.
fn scrambled(x: u64, seed: u64) -> u64 {
    let upper = (x >> LOWER_DIGITS) as u32;
    let mut hashed = upper.reverse_bits();
    hashed ^= hashed.wrapping_mul(0x3d20_adea);
    hashed = hashed.wrapping_add(seed as u32);
    hashed = hashed.wrapping_mul((seed >> 32) as u32 | 1);
    hashed ^= hashed.wrapping_mul(0x0552_6c56);
    hashed ^= hashed.wrapping_mul(0x53a2_2864);
    let upper = u64::from(hashed.reverse_bits());
    // Of the lower digits it matters only that they are evenly distributed.
    let lower = x ^ RandomNumbers(seed ^ (upper << LOWER_DIGITS)).next();
    upper << LOWER_DIGITS | lower & ((1 << LOWER_DIGITS) - 1)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn plain(dimensions: usize) -> impl Fn(usize, usize) -> f64 {
        let sobol = Sobol::new(dimensions, None);
        move |index, dimension| sobol.digits(index, dimension) as f64 / (1_u64 << DIGITS) as f64
    }

    /// The first points in three dimensions as Joe and Kuo publish them with their program.
    #[test]
    fn the_first_points_are_those_that_are_published() {
        let published = [
            [0.0, 0.0, 0.0],
            [0.5, 0.5, 0.5],
            [0.75, 0.25, 0.25],
            [0.25, 0.75, 0.75],
            [0.375, 0.375, 0.625],
            [0.875, 0.875, 0.125],
            [0.625, 0.125, 0.875],
            [0.125, 0.625, 0.375],
            [0.1875, 0.3125, 0.9375],
            [0.6875, 0.8125, 0.4375],
        ];
        let x = plain(3);
        for (index, point) in published.iter().enumerate() {
            assert_eq!([0, 1, 2].map(|dimension| x(index, dimension)), *point, "{index}");
        }
    }

    /// Points far on, in high dimensions, as SciPy 1.17 has them (`scipy.stats.qmc.Sobol(256, scramble=False,
    /// bits=52)`): multiples of 2^−52.
    #[test]
    fn later_points_are_those_of_another_program() {
        let dimensions = [0, 1, 5, 37, 100, 200, 255];
        let known = [
            (
                777,
                [
                    3118214976372736,
                    4217726604148736,
                    1605286976552960,
                    1578898697486336,
                    3795514139082752,
                    4464017208770560,
                    2863128278728704,
                ],
            ),
            (
                1000,
                [
                    989560464998400,
                    435406604599296,
                    4085785208815616,
                    3742737580949504,
                    3461262604238848,
                    3390893860061184,
                    1121501860331520,
                ],
            ),
        ];
        let sobol = Sobol::new(MAX_DIMENSIONS, None);
        for (index, point) in known {
            assert_eq!(dimensions.map(|dimension| sobol.digits(index, dimension)), point, "{index}");
        }
    }

    /// One-dimensional projections: each of the first 2^k points in its own interval of length 2^−k.
    fn fills_intervals(sobol: &Sobol, dimensions: usize) {
        for dimension in 0..dimensions {
            let mut found: Vec<u64> =
                (0..1024).map(|index| sobol.digits(index, dimension) >> (DIGITS - 10)).collect();
            found.sort_unstable();
            assert!(found.iter().copied().eq(0..1024), "{dimension}");
        }
    }

    #[test]
    fn every_interval_has_its_point_scrambled_or_not() {
        fills_intervals(&Sobol::new(MAX_DIMENSIONS, None), MAX_DIMENSIONS);
        fills_intervals(&Sobol::new(40, Some(7)), 40);
    }

    /// The first two dimensions are a (0,2)-sequence: every elementary rectangle of area 2^−8 has one of
    /// the first 256 points. Scrambling keeps that, and seeds differ.
    #[test]
    fn scrambling_keeps_the_net() {
        for seed in [None, Some(1), Some(2), Some(u64::MAX)] {
            let sobol = Sobol::new(2, seed);
            for wide in 0..=8_u32 {
                let cell = |index| {
                    let x = sobol.digits(index, 0) >> (DIGITS - wide).min(63);
                    let y = sobol.digits(index, 1) >> (DIGITS - (8 - wide)).min(63);
                    let x = if wide == 0 { 0 } else { x };
                    let y = if wide == 8 { 0 } else { y };
                    x << (8 - wide) | y
                };
                let mut cells: Vec<u64> = (0..256).map(cell).collect();
                cells.sort_unstable();
                assert!(cells.iter().copied().eq(0..256), "{seed:?} {wide}");
            }
        }
        let [a, b] = [1, 2].map(|seed| Sobol::new(1, Some(seed)));
        assert!((0..100).any(|index| a.digits(index, 0) != b.digits(index, 0)));
    }
}
