//! Sums of cosines with rational coefficients: their greatest quotient and its series.

use crate::graph::{Fingerprint, Graph, NodeId, Number, Unary};

/// Largest numerator and denominator of a ratio that is recognised.
const LARGEST_RATIO: i128 = 1_000_000;
/// Samples of the phase at which a quotient is compared with its value at π.
const SAMPLES: u32 = 256;
/// Terms of a series: enough to find its order, and the coefficient of its first error.
const TERMS: usize = 6;

/// factor · Σ_d integers\[d\] cos(d κ).
pub(super) struct Cosines {
    pub(super) factor: NodeId,
    pub(super) integers: Vec<i128>,
}

impl Cosines {
    /// Writes Σ coefficients\[d\] cos(d κ) so, the first integer that is not zero positive; `None` where the
    /// ratios are not rational, and where all are zero.
    pub(super) fn of(g: &mut Graph, coefficients: &[NodeId]) -> Option<Self> {
        let first = coefficients.iter().position(|c| !g.is_zero(*c))?;
        let base = g.fingerprint(coefficients[first]);
        let ratios = coefficients.iter().map(|c| match g.is_zero(*c) {
            true => Some((0, 1)),
            false => rational(g.fingerprint(*c).div(base)),
        });
        let ratios: Vec<(i128, i128)> = ratios.collect::<Option<_>>()?;
        let common = ratios.iter().try_fold(1i128, |all, (_, d)| {
            let all = all / gcd(all, *d) * d;
            (all <= LARGEST_RATIO).then_some(all)
        })?;
        let whole: Vec<i128> = ratios.iter().map(|(n, d)| n * (common / d)).collect();
        let divisor = whole.iter().fold(0, |all, n| gcd(all, n.abs())).max(1);
        let integers: Vec<i128> = whole.iter().map(|n| n / divisor).collect();
        let number = g.number(Number::ratio(1, integers[first]));
        let factor = g.mul(number, coefficients[first]);
        Some(Self { factor, integers })
    }

    /// Σ integers\[d\] cos(d κ).
    pub(super) fn shape(&self, g: &mut Graph, kappa: NodeId) -> NodeId {
        let coefficients: Vec<NodeId> =
            self.integers.iter().map(|n| g.number(Number::ratio(*n, 1))).collect();
        sum(g, &coefficients, kappa)
    }

    fn at(&self, phase: f64) -> f64 {
        self.integers.iter().enumerate().map(|(d, n)| *n as f64 * (d as f64 * phase).cos()).sum()
    }

    /// The value at κ = π.
    fn at_pi(&self) -> i128 {
        self.integers.iter().enumerate().map(|(d, n)| if d % 2 == 0 { *n } else { -n }).sum()
    }

    /// The greatest of Σ own/Σ other, where it is at κ = π.
    pub(super) fn greatest_over(&self, other: &Self) -> Option<Number> {
        let (above, below) = (self.at_pi(), other.at_pi());
        if below <= 0 {
            return None;
        }
        let greatest = above as f64 / below as f64;
        let phases = (0..=SAMPLES).map(|k| core::f64::consts::PI * f64::from(k) / f64::from(SAMPLES));
        let within = |phase: f64| self.at(phase) <= greatest * other.at(phase) + 1e-12 * greatest.abs();
        phases.into_iter().all(within).then(|| Number::ratio(above, below))
    }

    /// The power series of Σ integers\[d\] cos(d κ) in κ².
    fn series(&self) -> Option<Vec<Number>> {
        let mut terms = Vec::with_capacity(TERMS);
        let mut factorial = 1i128;
        for j in 0..TERMS as u32 {
            if j > 0 {
                factorial *= i128::from(2 * j * (2 * j - 1));
            }
            let power = |d: usize| i128::try_from(d).ok().and_then(|d| d.checked_pow(2 * j));
            let mut sum = 0i128;
            for (d, n) in self.integers.iter().enumerate() {
                sum = sum.checked_add(n.checked_mul(power(d)?)?)?;
            }
            terms.push(Number::ratio(if j % 2 == 0 { sum } else { -sum }, factorial));
        }
        Some(terms)
    }

    /// Σ own/Σ other for long waves.
    pub(super) fn long_waves_over(&self, other: &Self) -> Option<LongWaves> {
        let (above, below) = (self.series()?, other.series()?);
        let first = above.iter().position(|term| !term.is(0))?;
        let mut quotient: Vec<Number> = Vec::new();
        for k in 0..TERMS - first {
            let mut rest = above[first + k];
            for (j, known) in quotient.iter().enumerate() {
                rest = rest.plus(known.times(below[k - j])?.opposite())?;
            }
            quotient.push(rest.over(below[0])?);
        }
        let relative = |term: &Number| term.over(quotient[0]);
        let error = quotient.iter().skip(1).position(|term| !term.is(0));
        let error = match error {
            Some(k) => Some((2 * (k + 1), relative(&quotient[k + 1])?)),
            None => None,
        };
        Some(LongWaves { power: 2 * first, leading: quotient[0], error })
    }
}

/// leading κ^power (1 + error κ^order + ..).
pub(super) struct LongWaves {
    pub(super) power: usize,
    pub(super) leading: Number,
    /// Order and coefficient.
    pub(super) error: Option<(usize, Number)>,
}

/// Σ coefficients\[d\] cos(d κ).
pub(super) fn sum(g: &mut Graph, coefficients: &[NodeId], kappa: NodeId) -> NodeId {
    let mut sum = g.zero();
    for (d, coefficient) in coefficients.iter().enumerate() {
        if g.is_zero(*coefficient) {
            continue;
        }
        let multiple = g.integer(d as i64);
        let angle = g.mul(multiple, kappa);
        let cosine = g.unary(Unary::Cos, angle);
        let term = g.mul(*coefficient, cosine);
        sum = g.add(sum, term);
    }
    sum
}

fn gcd(mut a: i128, mut b: i128) -> i128 {
    while b != 0 {
        (a, b) = (b, a % b);
    }
    a
}

/// The rational number with a small numerator and denominator that has this fingerprint, by the extended
/// Euclidean algorithm. Source: Knuth, *The Art of Computer Programming*, vol. 2, §4.5.3, exercise 51.
fn rational(fingerprint: Fingerprint) -> Option<(i128, i128)> {
    let (mut r, mut t) =
        ((i128::from(Fingerprint::MODULUS), i128::from(fingerprint.residue(0))), (0i128, 1i128));
    while r.1 > LARGEST_RATIO {
        let quotient = r.0 / r.1;
        r = (r.1, r.0 - quotient * r.1);
        t = (t.1, t.0 - quotient * t.1);
    }
    let (n, d) = if t.1 < 0 { (-r.1, -t.1) } else { (r.1, t.1) };
    let found = (1..=LARGEST_RATIO).contains(&d) && Fingerprint::number(Number::ratio(n, d)) == fingerprint;
    found.then_some((n, d))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn cosines(integers: &[i128]) -> Cosines {
        let mut g = Graph::new();
        Cosines { factor: g.integer(1), integers: integers.to_vec() }
    }

    #[test]
    fn ratios_are_found_by_their_fingerprints() {
        for (n, d) in [(1, 3), (-7, 12), (0, 1), (999_983, 720)] {
            assert_eq!(rational(Fingerprint::number(Number::ratio(n, d))), Some((n, d)));
        }
        assert_eq!(rational(Fingerprint::atom(1, 2)), None);
    }

    /// Lumped masses are late by κ²/12, consistent ones early by as much, averaged ones by κ⁴/240.
    #[test]
    fn the_orders_of_the_three_mass_matrices() {
        let stiffness = cosines(&[1, -1]);
        for (mass, order, coefficient) in
            [(&[1][..], 2, (-1, 12)), (&[2, 1], 2, (1, 12)), (&[5, 1], 4, (-1, 240))]
        {
            let long = stiffness.long_waves_over(&cosines(mass)).expect("a series");
            assert_eq!(long.power, 2);
            let (own, error) = long.error.expect("an error");
            let exact = Number::ratio(coefficient.0, coefficient.1);
            assert!(own == order && error.plus(exact.opposite()).is_some_and(|rest| rest.is(0)), "{error:?}");
        }
    }

    /// (3 − 4 cos κ + cos 2κ) is greatest at π; 2 − cos κ − cos 2κ is so before.
    #[test]
    fn the_greatest_value_is_named_only_at_the_end() {
        let one = cosines(&[1]);
        assert!(cosines(&[3, -4, 1]).greatest_over(&one).is_some_and(|number| number.is(8)));
        assert!(cosines(&[2, -1, -1]).greatest_over(&one).is_none());
    }
}
