//! Linear algebra modulo 2⁶¹ − 31: null spaces of sampled matrices, and the rational numbers that their
//! entries stand for.

use std::collections::BTreeMap;

use crate::algebra::FreeColumns;
use crate::graph::Fingerprint;

const P: i128 = crate::graph::MODULUS as i128;

/// A basis of the vectors x of length n with `rows`·x = 0, one for every free column, that column's entry 1
/// and the other free ones 0. The coordinates declared first are the free ones: `x - 2 y`, not `y - x/2`.
pub(super) fn null_space(rows: Vec<Vec<Fingerprint>>, n: usize) -> Vec<Vec<Fingerprint>> {
    let sparse = |row: Vec<Fingerprint>| {
        row.into_iter().enumerate().filter(|(_, x)| *x != Fingerprint::ZERO).collect()
    };
    null_space_of(rows.into_iter().map(sparse).collect(), n)
}

/// The same of sparse rows.
pub(super) fn null_space_of(rows: Vec<BTreeMap<usize, Fingerprint>>, n: usize) -> Vec<Vec<Fingerprint>> {
    let basis = FreeColumns::new(rows, n);
    let dense = |(_, entries): (usize, &BTreeMap<usize, Fingerprint>)| {
        let mut x = vec![Fingerprint::ZERO; n];
        entries.iter().for_each(|(c, value)| x[*c] = *value);
        x
    };
    basis.vectors().map(dense).collect()
}

/// Largest numerator and denominator that a residue is read as. Fractions are unique up to
/// √(P/2) ≈ 2³⁰. The bound is far below that, so that other values are rarely read as fractions.
const LARGEST_FRACTION: i128 = 1 << 20;

/// The fraction n/d of small integers that a value stands for; `None` where there is none, or where it
/// differs from point to point.
fn fraction(value: Fingerprint) -> Option<(i128, i128)> {
    if value.residue(0) != value.residue(1) {
        return None;
    }
    let (mut r0, mut r1) = (P, i128::from(value.residue(0)));
    let (mut t0, mut t1) = (0i128, 1i128);
    while r1.abs() > LARGEST_FRACTION {
        let quotient = r0 / r1;
        (r0, r1) = (r1, r0 - quotient * r1);
        (t0, t1) = (t1, t0 - quotient * t1);
    }
    let (n, d) = if t1 < 0 { (-r1, -t1) } else { (r1, t1) };
    (d > 0 && d <= LARGEST_FRACTION).then_some((n, d))
}

fn gcd(mut a: i128, mut b: i128) -> i128 {
    while b != 0 {
        (a, b) = (b, a % b);
    }
    a.abs()
}

/// The integers without common factor, first one positive, that a vector is proportional to; `None` where its
/// entries are not rational constants.
pub(super) fn integers(vector: &[Fingerprint]) -> Option<Vec<i64>> {
    let fractions = vector.iter().map(|x| fraction(*x)).collect::<Option<Vec<_>>>()?;
    let mut common = 1i128;
    for (_, d) in &fractions {
        common = common / gcd(common, *d) * d;
        if common > LARGEST_FRACTION {
            return None;
        }
    }
    let scaled: Vec<i128> = fractions.iter().map(|(n, d)| n * (common / d)).collect();
    let divisor = scaled.iter().fold(0, |g, x| gcd(g, *x)).max(1);
    let sign = scaled.iter().find(|x| **x != 0).map_or(1, |x| x.signum());
    scaled.iter().map(|x| i64::try_from(sign * x / divisor).ok()).collect()
}

/// `x - 2 y` from coefficients and names.
pub(super) fn combination(coefficients: &[i64], names: &[&str]) -> String {
    let mut text = String::new();
    for (c, name) in coefficients.iter().zip(names).filter(|(c, _)| **c != 0) {
        match (text.is_empty(), *c < 0) {
            (true, false) => {}
            (true, true) => text.push('-'),
            (false, false) => text.push_str(" + "),
            (false, true) => text.push_str(" - "),
        }
        if c.unsigned_abs() != 1 {
            text.push_str(&format!("{} ", c.unsigned_abs()));
        }
        text.push_str(name);
    }
    text
}

#[cfg(test)]
mod tests {
    use super::{Fingerprint, combination, integers, null_space};

    fn small(n: i64) -> Fingerprint {
        let one = Fingerprint::ONE;
        let magnitude = (0..n.unsigned_abs()).fold(Fingerprint::ZERO, |s, _| s.add(one));
        if n < 0 { magnitude.neg() } else { magnitude }
    }

    #[test]
    fn null_vectors_are_found_and_read_as_integers() {
        let rows = [[1, 2, -3], [2, 4, -6], [0, 1, 1]].map(|r| r.map(small).to_vec()).to_vec();
        let basis = null_space(rows.clone(), 3);
        assert_eq!(basis.len(), 1);
        assert_eq!(integers(&basis[0]), Some(vec![5, -1, 1]));
        assert_eq!(null_space(rows[..1].to_vec(), 3).len(), 2);
        assert_eq!(null_space(Vec::new(), 2).len(), 2);
        assert!(null_space([[1, 0], [1, 1]].map(|r| r.map(small).to_vec()).to_vec(), 2).is_empty());
    }

    #[test]
    fn combinations_read_naturally() {
        let names = ["x", "y", "theta[2]"];
        assert_eq!(combination(&[1, -2, 0], &names), "x - 2 y");
        assert_eq!(combination(&[0, 0, 1], &names), "theta[2]");
        assert_eq!(combination(&[-1, 1, 3], &names), "-x + y + 3 theta[2]");
    }

    #[test]
    fn values_that_vary_are_no_numbers() {
        let third = Fingerprint::ONE.div(small(3));
        assert_eq!(integers(&[third, small(-2)]), Some(vec![1, -6]));
        assert_eq!(integers(&[third, Fingerprint::atom(1, 2)]), None);
    }
}
