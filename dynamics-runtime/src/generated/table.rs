//! Long programs as tables: for functions of a model that are called rarely and would take long to compile.
//!
//! The compile time of straight-line code grows faster than its number of operations. A table costs none: it
//! is one literal, and its interpreter is compiled once, with this crate. Operations of one kind whose
//! operands are available stand together as runs, so that there is one branch per run, not per operation. The
//! values are those of straight-line code: the same operations on the same operands.

use crate::{math, sin_cos};

/// What all entries of a run do.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[allow(missing_docs)]
pub enum Operation {
    Add,
    Sub,
    Mul,
    Div,
    Neg,
    /// a + b c, with two roundings.
    AddProduct,
    /// a − b c, with two roundings.
    SubProduct,
    /// b c − a, with two roundings.
    ProductSub,
    /// a b + c d, with three roundings.
    AddProducts,
    /// a b − c d, with three roundings.
    SubProducts,
    /// Sine and cosine: two values of one angle.
    SinCos,
    /// The same by the platform.
    SinCosAccurate,
    Tan,
    Asin,
    Acos,
    Atan,
    Sinh,
    Cosh,
    Tanh,
    Exp,
    Ln,
    Sqrt,
    Cbrt,
    Abs,
    Signum,
    Atan2,
    Powf,
    Hypot,
    Min,
    Max,
    /// `if a < b {c} else {d}`.
    Less,
    /// `if a <= b {c} else {d}`.
    LessEqual,
    /// `if a == b {c} else {d}`.
    Equal,
}

/// Computes the values of a table, in order, from place `known` of `x` on; those before are given. `code`
/// holds numbers of 16 bits, the low byte first: for each run the index of its operation, the number of its
/// entries and their operands, which are places before the run.
///
/// # Panics
/// Where `code` is no such table, or `x` is shorter than its values. Generated tables are.
#[inline(never)]
pub fn evaluate(operations: &[Operation], code: &[u8], known: usize, x: &mut [f64]) {
    let (mut code, mut known) = (code, known);
    while let [operation, operation_high, count, count_high, rest @ ..] = code {
        let operation = operations[place([*operation, *operation_high])];
        let count = place([*count, *count_high]);
        let (operands, values) = operation.sizes();
        let (operands, rest) = rest.split_at(2 * operands * count);
        let (given, to) = x.split_at_mut(known);
        operation.run(operands, given, &mut to[..values * count]);
        known += values * count;
        code = rest;
    }
}

/// Writes values of `x` to places of a matrix or list: `pairs` holds the places there and in `x`, numbers of
/// 32 bits, the low byte first.
///
/// # Panics
/// Where a place is not there. Those of generated tables are.
#[inline(never)]
pub fn scatter(pairs: &[u8], x: &[f64], to: &mut [f64]) {
    let place = |bytes| u32::from_le_bytes(bytes) as usize;
    for &[a, b, c, d, e, f, g, h] in pairs.as_chunks::<8>().0 {
        to[place([a, b, c, d])] = x[place([e, f, g, h])];
    }
}

#[inline(always)]
fn place(bytes: [u8; 2]) -> usize {
    u16::from_le_bytes(bytes).into()
}

impl Operation {
    /// Operands and values of one entry.
    fn sizes(self) -> (usize, usize) {
        match self {
            Self::Add | Self::Sub | Self::Mul | Self::Div => (2, 1),
            Self::Atan2 | Self::Powf | Self::Hypot | Self::Min | Self::Max => (2, 1),
            Self::SinCos | Self::SinCosAccurate => (1, 2),
            Self::AddProduct | Self::SubProduct | Self::ProductSub => (3, 1),
            Self::AddProducts | Self::SubProducts => (4, 1),
            Self::Less | Self::LessEqual | Self::Equal => (4, 1),
            _ => (1, 1),
        }
    }

    fn run(self, operands: &[u8], x: &[f64], to: &mut [f64]) {
        match self {
            Self::Add => each(operands, x, to, |[a, b]| a + b),
            Self::Sub => each(operands, x, to, |[a, b]| a - b),
            Self::Mul => each(operands, x, to, |[a, b]| a * b),
            Self::Div => each(operands, x, to, |[a, b]| a / b),
            Self::Neg => each(operands, x, to, |[a]| -a),
            Self::AddProduct => each(operands, x, to, |[a, b, c]| a + b * c),
            Self::SubProduct => each(operands, x, to, |[a, b, c]| a - b * c),
            Self::ProductSub => each(operands, x, to, |[a, b, c]| b * c - a),
            Self::AddProducts => each(operands, x, to, |[a, b, c, d]| a * b + c * d),
            Self::SubProducts => each(operands, x, to, |[a, b, c, d]| a * b - c * d),
            Self::SinCos => pairs(operands, x, to, sin_cos::fast),
            Self::SinCosAccurate => pairs(operands, x, to, math::sin_cos),
            Self::Tan => each(operands, x, to, |[a]| math::tan(a)),
            Self::Asin => each(operands, x, to, |[a]| math::asin(a)),
            Self::Acos => each(operands, x, to, |[a]| math::acos(a)),
            Self::Atan => each(operands, x, to, |[a]| math::atan(a)),
            Self::Sinh => each(operands, x, to, |[a]| math::sinh(a)),
            Self::Cosh => each(operands, x, to, |[a]| math::cosh(a)),
            Self::Tanh => each(operands, x, to, |[a]| math::tanh(a)),
            Self::Exp => each(operands, x, to, |[a]| math::exp(a)),
            Self::Ln => each(operands, x, to, |[a]| math::ln(a)),
            Self::Sqrt => each(operands, x, to, |[a]| math::sqrt(a)),
            Self::Cbrt => each(operands, x, to, |[a]| math::cbrt(a)),
            Self::Abs => each(operands, x, to, |[a]| math::abs(a)),
            Self::Signum => each(operands, x, to, |[a]| math::signum(a)),
            Self::Atan2 => each(operands, x, to, |[a, b]| math::atan2(a, b)),
            Self::Powf => each(operands, x, to, |[a, b]| math::powf(a, b)),
            Self::Hypot => each(operands, x, to, |[a, b]| math::hypot(a, b)),
            Self::Min => each(operands, x, to, |[a, b]| math::min(a, b)),
            Self::Max => each(operands, x, to, |[a, b]| math::max(a, b)),
            Self::Less => each(operands, x, to, |[a, b, c, d]| if a < b { c } else { d }),
            Self::LessEqual => each(operands, x, to, |[a, b, c, d]| if a <= b { c } else { d }),
            Self::Equal => each(operands, x, to, |[a, b, c, d]| if a == b { c } else { d }),
        }
    }
}

/// One value from K operands, entry by entry.
#[inline(always)]
fn each<const K: usize>(operands: &[u8], x: &[f64], to: &mut [f64], function: impl Fn([f64; K]) -> f64) {
    for (places, to) in operands.as_chunks::<2>().0.as_chunks::<K>().0.iter().zip(to) {
        *to = function(places.map(|bytes| x[place(bytes)]));
    }
}

/// Two values from one operand, entry by entry.
#[inline(always)]
fn pairs(operands: &[u8], x: &[f64], to: &mut [f64], function: impl Fn(f64) -> (f64, f64)) {
    for (bytes, to) in operands.as_chunks::<2>().0.iter().zip(to.as_chunks_mut::<2>().0) {
        *to = function(x[place(*bytes)]).into();
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const GIVEN: [f64; 4] = [0.75, 2.5, -0.5, 0.75];

    /// The values of a table of one run over these places of `GIVEN`, beside those of what stands between.
    fn run(operation: Operation, entries: &[&[u16]], values: usize) -> Vec<f64> {
        let numbers = [&[1, entries.len() as u16][..], &entries.concat()].concat();
        let code: Vec<u8> = numbers.into_iter().flat_map(u16::to_le_bytes).collect();
        let mut x = [&GIVEN[..], &vec![f64::NAN; entries.len() * values + 1]].concat();
        evaluate(&[Operation::Neg, operation], &code, GIVEN.len(), &mut x);
        assert_eq!(x[..GIVEN.len()], GIVEN);
        assert!(x.pop().is_some_and(f64::is_nan), "nothing is written behind the values");
        x.split_off(GIVEN.len())
    }

    #[test]
    fn every_operation_is_the_one_of_its_name() {
        let [a, b, c, d] = GIVEN;
        type One = fn(f64) -> f64;
        type Two = fn(f64, f64) -> f64;
        let one: [(Operation, One); 16] = [
            (Operation::Neg, |x| -x),
            (Operation::Tan, f64::tan),
            (Operation::Asin, f64::asin),
            (Operation::Acos, f64::acos),
            (Operation::Atan, f64::atan),
            (Operation::Sinh, f64::sinh),
            (Operation::Cosh, f64::cosh),
            (Operation::Tanh, f64::tanh),
            (Operation::Exp, f64::exp),
            (Operation::Ln, f64::ln),
            (Operation::Sqrt, f64::sqrt),
            (Operation::Cbrt, f64::cbrt),
            (Operation::Abs, f64::abs),
            (Operation::Signum, f64::signum),
            (Operation::SinCos, f64::sin),
            (Operation::SinCosAccurate, f64::sin),
        ];
        for (operation, function) in one {
            let is_pair = operation.sizes().1 == 2;
            let found = run(operation, &[&[2], &[0]], if is_pair { 2 } else { 1 });
            let pair = |x: f64| if is_pair { vec![function(x), x.cos()] } else { vec![function(x)] };
            for (found, expected) in found.iter().zip([pair(c), pair(a)].concat()) {
                let same = found == &expected || (found.is_nan() && expected.is_nan());
                assert!(
                    same || (found - expected).abs() <= 2.0 * f64::EPSILON,
                    "{operation:?}: {found} {expected}"
                );
            }
        }
        let two: [(Operation, Two); 9] = [
            (Operation::Add, |x, y| x + y),
            (Operation::Sub, |x, y| x - y),
            (Operation::Mul, |x, y| x * y),
            (Operation::Div, |x, y| x / y),
            (Operation::Atan2, f64::atan2),
            (Operation::Powf, f64::powf),
            (Operation::Hypot, f64::hypot),
            (Operation::Min, f64::min),
            (Operation::Max, f64::max),
        ];
        for (operation, function) in two {
            assert_eq!(run(operation, &[&[0, 1], &[1, 2]], 1)[0], function(a, b), "{operation:?}");
            assert_eq!(run(operation, &[&[1, 0]], 1), [function(b, a)], "{operation:?}");
        }
        for (operation, expected) in [
            (Operation::AddProduct, a + b * c),
            (Operation::SubProduct, a - b * c),
            (Operation::ProductSub, b * c - a),
            (Operation::AddProducts, a * b + c * d),
            (Operation::SubProducts, a * b - c * d),
        ] {
            let places: &[u16] = if operation.sizes().0 == 3 { &[0, 1, 2] } else { &[0, 1, 2, 3] };
            assert_eq!(run(operation, &[places], 1), [expected], "{operation:?}");
        }
        // Places 0 and 3 hold the same number: left less, equal, greater.
        for (operation, chosen) in [
            (Operation::Less, [true, false, false]),
            (Operation::LessEqual, [true, true, false]),
            (Operation::Equal, [false, true, false]),
        ] {
            let expected = chosen.map(|first| if first { b } else { c });
            assert_eq!(
                run(operation, &[&[2, 0, 1, 2], &[0, 3, 1, 2], &[1, 0, 1, 2]], 1),
                expected,
                "{operation:?}"
            );
        }
    }

    #[test]
    fn runs_read_what_runs_before_them_made() {
        // −b, −a; then (−b) a + b (−a).
        let numbers: [u16; 10] = [1, 2, 1, 0, 0, 1, 4, 0, 1, 5];
        let code: Vec<u8> = numbers.into_iter().flat_map(u16::to_le_bytes).collect();
        let mut x = [3.0, 5.0, 0.0, 0.0, 0.0, 0.0, 0.0];
        evaluate(&[Operation::AddProducts, Operation::Neg], &code, 4, &mut x);
        assert_eq!(x, [3.0, 5.0, 0.0, 0.0, -5.0, -3.0, -30.0]);
    }

    #[test]
    fn values_come_to_their_places() {
        let pairs: Vec<u8> = [70_000u32, 1, 0, 2].into_iter().flat_map(u32::to_le_bytes).collect();
        let mut matrix = vec![0.0; 70_001];
        scatter(&pairs, &[1.0, 2.0, 3.0], &mut matrix);
        assert_eq!((matrix[70_000], matrix[0], matrix.iter().sum::<f64>()), (2.0, 3.0, 5.0));
    }
}
