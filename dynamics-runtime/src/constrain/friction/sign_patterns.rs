//! Sign patterns of reactions, and the test whether a friction law is linear for each of them.

use super::{DERIVATIVE_TOLERANCE, FrictionProblem, MAX_EXHAUSTIVE_REACTIONS};
use crate::linalg::max_abs;
use crate::model::{Constraints, Vector};

/// Factors of the reactions, for even and odd ones, at which linearity is tested. They span six orders of
/// magnitude, so that thresholds and saturations show.
const LINEARITY_SIZES: [(f64, f64); 3] = [(0.37, 2.3), (1e-3, 4e-3), (7e2, 1e3)];

impl<M: Constraints> FrictionProblem<'_, '_, M> {
    /// Whether Q is linear in the reactions for each pattern of their signs, as Coulomb's law is, tested at
    /// sizes far apart. Newton's method from each pattern then ends in its only candidate.
    #[cold]
    pub(super) fn is_linear_in_patterns(&mut self, frictionless_reactions: &M::Rows) -> bool {
        (0..pattern_count(self.k)).all(|pattern| {
            let start = self.start(frictionless_reactions, pattern);
            LINEARITY_SIZES.iter().all(|sizes| self.is_linear_between(&start, *sizes))
        })
    }

    /// Whether the derivatives at a start are those at reactions of other sizes, and give the force there.
    fn is_linear_between(&mut self, start: &M::Rows, sizes: (f64, f64)) -> bool {
        let (n, r) = (M::Vector::LEN, M::Rows::LEN);
        let mut scaled = *start;
        for i in 0..self.k {
            scaled[self.rows_read.get(i)] *= if i % 2 == 0 { sizes.0 } else { sizes.1 };
        }
        let Some(force) = self.evaluate_force(&scaled) else { return false };
        if self.evaluate_force(start).is_none() {
            return false;
        }
        (0..n).all(|j| {
            let (mut change, mut size) = (0.0, force[j].abs().max(self.force[j].abs()));
            for i in 0..self.k {
                let row = self.rows_read.get(i);
                let part = self.by_multipliers[j * r + row] * (scaled[row] - start[row]);
                change += part;
                size += part.abs();
            }
            // Also false where a derivative is NaN.
            (self.force[j] + change - force[j]).abs() <= DERIVATIVE_TOLERANCE * size
        })
    }

    /// Reactions of the frictionless size with the signs of a pattern.
    pub(super) fn start(&self, frictionless_reactions: &M::Rows, pattern: u64) -> M::Rows {
        let largest = max_abs(frictionless_reactions.as_slice());
        let mut lambda = *frictionless_reactions;
        for i in 0..self.k {
            let row = self.rows_read.get(i);
            let size = lambda[row].abs().max(1e-3 * largest).max(f64::MIN_POSITIVE);
            lambda[row] = if is_positive(pattern, i, self.k) { size } else { -size };
        }
        lambda
    }
}

/// Number of sign patterns that are tried for k reactions.
pub(super) fn pattern_count(k: usize) -> u64 {
    1 << k.min(MAX_EXHAUSTIVE_REACTIONS)
}

/// Sign i of a pattern. Above 2⁶ patterns: all positive, all negative, and a fixed scatter of the others.
fn is_positive(pattern: u64, i: usize, k: usize) -> bool {
    if k <= MAX_EXHAUSTIVE_REACTIONS {
        return pattern >> i & 1 == 0;
    }
    match pattern {
        0 => true,
        1 => false,
        _ => {
            (pattern.wrapping_mul(0x9E37_79B9_7F4A_7C15) ^ (i as u64 + 1).wrapping_mul(0xD134_2543_DE82_EF95))
                .wrapping_mul(0x2545_F491_4F6C_DD1D)
                >> 63
                == 0
        }
    }
}
