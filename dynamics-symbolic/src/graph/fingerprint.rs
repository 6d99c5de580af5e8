//! Arithmetic modulo the prime 2⁶¹ − 31, and rational points of the circle for sines and cosines.

use super::{Comparison, number::Number};

/// The largest prime below 2⁶¹ − 1. That one would be quicker to reduce by, but 2⁶¹ is 1 there: a product of
/// literals such as 2³¹ · 2³⁰ · x would be taken for x. Modulo this one the powers of 2 return after 2.9·10¹⁷
/// steps, those of 3, 5, 7 and 10 after more than 10¹⁴.
pub(crate) const P: u64 = (1 << 61) - 31;

/// Value of an expression at two random points, modulo 2⁶¹ − 31.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Fingerprint(pub(super) [u64; 2]);

fn add(a: u64, b: u64) -> u64 {
    let s = a + b;
    if s >= P { s - P } else { s }
}

fn mul(a: u64, b: u64) -> u64 {
    // 2⁶¹ is 31: the high part is folded down twice, the second time it has at most six bits.
    const LOW: u128 = (1 << 61) - 1;
    let wide = u128::from(a) * u128::from(b);
    let once = (wide & LOW) + 31 * (wide >> 61);
    let twice = ((once & LOW) + 31 * (once >> 61)) as u64;
    if twice >= P { twice - P } else { twice }
}

fn power(mut base: u64, mut exponent: u64) -> u64 {
    let mut result = 1;
    while exponent > 0 {
        if exponent & 1 == 1 {
            result = mul(result, base);
        }
        base = mul(base, base);
        exponent >>= 1;
    }
    result
}

fn inverse(a: u64) -> u64 {
    power(a, P - 2)
}

fn reduce(n: i128) -> u64 {
    n.rem_euclid(i128::from(P)) as u64
}

/// A fixed mixing function (splitmix64), so that fingerprints are the same in every run.
fn mix(mut x: u64) -> u64 {
    x = x.wrapping_add(0x9e37_79b9_7f4a_7c15);
    x = (x ^ (x >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    x = (x ^ (x >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    x ^ (x >> 31)
}

impl Fingerprint {
    /// What residues are taken by.
    pub(crate) const MODULUS: u64 = P;
    pub(crate) const ZERO: Self = Self([0, 0]);
    pub(crate) const ONE: Self = Self([1, 1]);

    pub(crate) fn number(n: Number) -> Self {
        match n {
            Number::Rational(n, d) => {
                let value = if d == 1 { reduce(n) } else { mul(reduce(n), inverse(reduce(d))) };
                Self([value, value])
            }
            // Odd in x, so that −x is recognised.
            Number::Float(x) => {
                let f = Self::atom(0xf10a7, x.abs().to_bits());
                if x < 0.0 { f.neg() } else { f }
            }
        }
    }

    /// A random value for an opaque atom.
    pub(crate) fn atom(kind: u64, index: u64) -> Self {
        let seed = mix(kind ^ mix(index));
        Self([mix(seed) % P, mix(seed ^ 0x5555_5555_5555_5555) % P])
    }

    /// A random value that depends on `kind` and the arguments' values, each point by itself.
    pub(super) fn opaque(kind: u64, arguments: &[Self]) -> Self {
        Self([0, 1].map(|i| arguments.iter().fold(mix(kind), |h, a| mix(h ^ mix(a.0[i]))) % P))
    }

    /// w a + (1 − w) b for a choice between a and b: w is random, and depends on what decides alone. What is
    /// so for every w is so for 1 and 0, which are the two branches; so −(a or b) is −a or −b, and what a
    /// spring between two bodies that comes and goes does to one it is known to do to the other.
    pub(super) fn chosen(comparison: Comparison, [left, right, then, otherwise]: [Self; 4]) -> Self {
        let w = Self::opaque(0x300 + comparison as u64, &[left, right]);
        w.mul(then.sub(otherwise)).add(otherwise)
    }

    pub(crate) fn add(self, o: Self) -> Self {
        Self([add(self.0[0], o.0[0]), add(self.0[1], o.0[1])])
    }
    pub(crate) fn neg(self) -> Self {
        Self(self.0.map(|a| if a == 0 { 0 } else { P - a }))
    }
    pub(crate) fn sub(self, o: Self) -> Self {
        self.add(o.neg())
    }
    pub(crate) fn mul(self, o: Self) -> Self {
        Self([mul(self.0[0], o.0[0]), mul(self.0[1], o.0[1])])
    }
    /// `self / o`; zero where `o` is zero, which the builder excludes.
    pub(crate) fn div(self, o: Self) -> Self {
        Self([mul(self.0[0], inverse(o.0[0])), mul(self.0[1], inverse(o.0[1]))])
    }

    /// Whether it can be divided by: zero at neither point.
    pub(crate) fn is_unit(self) -> bool {
        self.0[0] != 0 && self.0[1] != 0
    }

    /// Residues for numeric work modulo p (rank computations): one of the two points.
    #[must_use]
    pub fn residue(self, point: usize) -> u64 {
        self.0[point]
    }
}

/// (cos, sin) of an angle as a rational point of the circle at both random points.
#[derive(Clone, Copy, Debug)]
pub(super) struct Circle {
    pub(super) cos: Fingerprint,
    pub(super) sin: Fingerprint,
}

impl Circle {
    pub(super) const ZERO_ANGLE: Self = Self { cos: Fingerprint::ONE, sin: Fingerprint::ZERO };

    /// The point of an angle that nothing is known about but its value.
    pub(super) fn opaque(angle: Fingerprint) -> Self {
        let t = Fingerprint::opaque(0xc17c1e, &[angle]);
        let t2 = t.mul(t);
        let d = Fingerprint::ONE.add(t2);
        Self { cos: Fingerprint::ONE.sub(t2).div(d), sin: t.add(t).div(d) }
    }
    pub(super) fn add(self, o: Self) -> Self {
        Self {
            cos: self.cos.mul(o.cos).sub(self.sin.mul(o.sin)),
            sin: self.sin.mul(o.cos).add(self.cos.mul(o.sin)),
        }
    }
    pub(super) fn neg(self) -> Self {
        Self { cos: self.cos, sin: self.sin.neg() }
    }
    pub(super) fn times(self, n: i64) -> Self {
        let mut base = if n < 0 { self.neg() } else { self };
        let mut left = n.unsigned_abs();
        let mut result = Self::ZERO_ANGLE;
        while left > 0 {
            if left & 1 == 1 {
                result = result.add(base);
            }
            base = base.add(base);
            left >>= 1;
        }
        result
    }
}
