//! Long programs as tables: what a model is rarely asked for, and would take long to compile as code.
//!
//! A compiler takes time in proportion to the operations of straight-line code, and more. A table costs it nothing: it is one literal, and what reads it is compiled once, with
//! this crate. Operations of one kind whose operands are known stand together as runs, so that reading costs a decision for every run, not for every operation. Values are those
//! of the code: the same operations on the same operands.

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

/// Computes the values of a table, in order, from place `known` of `x` on; those before are given. `code` holds numbers of 16 bits, the low byte first: for each run the index of its
/// operation, the number of its entries and their operands, which are places before the run.
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

/// Writes values of `x` to places of a matrix or list: `pairs` holds the places there and in `x`, numbers of 32 bits, the low byte first.
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
            Self::Less | Self::LessEqual | Self::Equal => (4, 1),
            _ => (1, 1),
        }
    }

    fn run(self, operands: &[u8], x: &[f64], to: &mut [f64]) {
        match self {
            Self::Add => binary(operands, x, to, |a, b| a + b),
            Self::Sub => binary(operands, x, to, |a, b| a - b),
            Self::Mul => binary(operands, x, to, |a, b| a * b),
            Self::Div => binary(operands, x, to, |a, b| a / b),
            Self::Atan2 => binary(operands, x, to, math::atan2),
            Self::Powf => binary(operands, x, to, math::powf),
            Self::Hypot => binary(operands, x, to, math::hypot),
            Self::Min => binary(operands, x, to, math::min),
            Self::Max => binary(operands, x, to, math::max),
            Self::SinCos => pairs(operands, x, to, sin_cos::fast),
            Self::SinCosAccurate => pairs(operands, x, to, math::sin_cos),
            Self::Less => choices(operands, x, to, |a, b| a < b),
            Self::LessEqual => choices(operands, x, to, |a, b| a <= b),
            Self::Equal => choices(operands, x, to, |a, b| a == b),
            Self::Neg => unary(operands, x, to, |a| -a),
            Self::Tan => unary(operands, x, to, math::tan),
            Self::Asin => unary(operands, x, to, math::asin),
            Self::Acos => unary(operands, x, to, math::acos),
            Self::Atan => unary(operands, x, to, math::atan),
            Self::Sinh => unary(operands, x, to, math::sinh),
            Self::Cosh => unary(operands, x, to, math::cosh),
            Self::Tanh => unary(operands, x, to, math::tanh),
            Self::Exp => unary(operands, x, to, math::exp),
            Self::Ln => unary(operands, x, to, math::ln),
            Self::Sqrt => unary(operands, x, to, math::sqrt),
            Self::Cbrt => unary(operands, x, to, math::cbrt),
            Self::Abs => unary(operands, x, to, math::abs),
            Self::Signum => unary(operands, x, to, math::signum),
        }
    }
}

#[inline(always)]
fn unary(operands: &[u8], x: &[f64], to: &mut [f64], function: impl Fn(f64) -> f64) {
    for (&a, to) in operands.as_chunks::<2>().0.iter().zip(to) {
        *to = function(x[place(a)]);
    }
}

#[inline(always)]
fn binary(operands: &[u8], x: &[f64], to: &mut [f64], function: impl Fn(f64, f64) -> f64) {
    for (&[a, b, c, d], to) in operands.as_chunks::<4>().0.iter().zip(to) {
        *to = function(x[place([a, b])], x[place([c, d])]);
    }
}

#[inline(always)]
fn pairs(operands: &[u8], x: &[f64], to: &mut [f64], function: impl Fn(f64) -> (f64, f64)) {
    for (&a, to) in operands.as_chunks::<2>().0.iter().zip(to.as_chunks_mut::<2>().0) {
        *to = function(x[place(a)]).into();
    }
}

#[inline(always)]
fn choices(operands: &[u8], x: &[f64], to: &mut [f64], condition: impl Fn(f64, f64) -> bool) {
    for (bytes, to) in operands.as_chunks::<8>().0.iter().zip(to) {
        let [left, right, then, otherwise] = [0, 2, 4, 6].map(|i| x[place([bytes[i], bytes[i + 1]])]);
        *to = if condition(left, right) { then } else { otherwise };
    }
}
