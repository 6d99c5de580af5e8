//! What the loops of generated code are made of.
//!
//! Loops run over blocks of [`BLOCK`] nodes, whose values stay in the first-level cache. Sums go through
//! [`block_sum`] in an order that the width of vectors does not change, so that results have the same bits on
//! every processor.

use dynamics_runtime::{Expr, Vec2, Vec3};
use dynamics_simd::{Lanes, Task, in_widest_lanes};

pub use crate::generated::{BLOCK, Sum, block_sum};
use crate::model::SizeError;
pub use dynamics_simd::reciprocal_root as roots;

/// Rounds of a block: elements reach beyond its nodes, by at most 16 on either side.
pub const ROUNDS: usize = BLOCK + 32;

/// Rounds whose entries of a matrix are made together: an element has many.
pub const MATRIX_BLOCK: usize = 64;

/// Most rounds of a block, along lines or grids.
const MOST_NUMBERS: usize = 512;

/// 0, 1, 2, …: numbers of rounds within a block. Reading them is quicker than to convert them.
pub static NUMBERS: [f64; MOST_NUMBERS] = {
    let (mut numbers, mut i) = ([0.0; MOST_NUMBERS], 0);
    while i < MOST_NUMBERS {
        numbers[i] = i as f64;
        i += 1;
    }
    numbers
};

/// Rounds of a block at the edges of grids: edges are short, and buffers are filled with zeros first.
pub const EDGE: usize = 64;

/// What a pass over the model writes.
pub const FORCES: u8 = 0;
/// Forces times a scale.
pub const SCALED: u8 = 1;
/// Adds h times forces times a scale.
pub const KICK: u8 = 2;

/// A pass over the model: generated code, to be compiled for the widest vectors that the processor has.
pub trait Pass {
    /// What it returns.
    type Output;
    /// The code, which has to be inlined.
    fn run(self) -> Self::Output;
}

struct Wide<P>(P);

impl<P: Pass> Task for Wide<P> {
    type Output = P::Output;
    #[inline(always)]
    fn run<L: Lanes>(self) -> P::Output {
        self.0.run()
    }
}

/// Runs a pass with the widest vectors that the processor has. The bits do not depend on them: loops add in
/// the order in which they are written, and no product is fused.
#[inline(always)]
pub fn in_wide_vectors<P: Pass>(pass: P) -> P::Output {
    in_widest_lanes(Wide(pass))
}

/// The parts of a slice between bounds, which rise.
#[inline]
pub fn pieces<const F: usize>(all: &mut [f64], bounds: [[isize; 2]; F]) -> [&mut [f64]; F] {
    let (mut rest, mut taken) = (all, 0);
    bounds.map(|bounds| {
        let [begin, end] = bounds.map(|bound| bound.max(0) as usize);
        let (_, behind) = core::mem::take(&mut rest).split_at_mut(begin - taken);
        let (piece, behind) = behind.split_at_mut(end - begin);
        (rest, taken) = (behind, end);
        piece
    })
}

/// Fewest nodes that a thread of its own is worth: about ten microseconds of work.
const LEAST_PART: isize = 8192;

/// Runs `run` on parts of a range of nodes, by several threads. Every piece has the nodes of one field, from
/// the first on. What one part returns is returned; only whole ranges return something that counts.
#[inline]
pub fn in_parts<const F: usize, T: Send>(
    threads: usize,
    nodes: [isize; 2],
    pieces: [&mut [f64]; F],
    run: &(impl Fn([isize; 2], [&mut [f64]; F]) -> T + Sync),
) -> T {
    let [begin, end] = nodes;
    if threads < 2 || end - begin < 2 * LEAST_PART {
        return run(nodes, pieces);
    }
    let left = threads / 2;
    let block = BLOCK as isize;
    let middle = begin + (end - begin) / threads as isize * left as isize / block * block;
    let mut behind = [const { None }; F];
    let mut before = [const { None }; F];
    for (k, piece) in pieces.into_iter().enumerate() {
        let (first, second) = piece.split_at_mut(piece.len().min((middle - begin) as usize));
        (before[k], behind[k]) = (Some(first), Some(second));
    }
    let [before, behind] = [before, behind].map(|pieces| pieces.map(Option::unwrap_or_default));
    let both = join(
        || in_parts(left, [begin, middle], before, run),
        || in_parts(threads - left, [middle, end], behind, run),
    );
    both.0
}

/// Runs both, at the same time where the crate has threads.
pub(crate) fn join<A: Send, B: Send>(a: impl FnOnce() -> A + Send, b: impl FnOnce() -> B + Send) -> (A, B) {
    #[cfg(feature = "parallel")]
    {
        rayon::join(a, b)
    }
    #[cfg(not(feature = "parallel"))]
    {
        (a(), b())
    }
}

/// Checks a count.
///
/// # Errors
/// Where it is smaller than `least`, or larger than what memory holds.
pub fn check_count(count: &'static str, value: usize, least: usize) -> Result<(), SizeError> {
    // Twelve vectors of this length take less than half of the address space.
    const MOST: usize = usize::MAX / 256;
    match value {
        value if value < least => Err(SizeError::TooFew { count, value, least }),
        value if value > MOST => Err(SizeError::TooMany { count, value }),
        _ => Ok(()),
    }
}

/// Checks the length of a numbered parameter, of which elements before `end` are read.
///
/// # Errors
/// Where it has fewer.
pub fn check_length(parameter: &'static str, length: usize, end: isize) -> Result<(), SizeError> {
    match usize::try_from(end) {
        Ok(end) if length < end => Err(SizeError::TooShort { parameter, length, last: end - 1 }),
        _ => Ok(()),
    }
}

/// A length as `usize`.
///
/// Counts are checked before, so that no length is below 0.
#[must_use]
pub fn length(value: isize) -> usize {
    usize::try_from(value).unwrap_or(0)
}

/// Values of an output: of a scalar, a vector or a list of them, or of lists, row by row.
pub trait OutputValues {
    /// Adds its values.
    fn add_to(&self, values: &mut Vec<f64>);
}

impl OutputValues for Expr {
    fn add_to(&self, values: &mut Vec<f64>) {
        values.push(self.value());
    }
}

impl OutputValues for Vec2 {
    fn add_to(&self, values: &mut Vec<f64>) {
        values.extend([self.x.value(), self.y.value()]);
    }
}

impl OutputValues for Vec3 {
    fn add_to(&self, values: &mut Vec<f64>) {
        values.extend([self.x.value(), self.y.value(), self.z.value()]);
    }
}

impl<T: OutputValues> OutputValues for Vec<T> {
    fn add_to(&self, values: &mut Vec<f64>) {
        self.iter().for_each(|value| value.add_to(values));
    }
}

impl<T: OutputValues, const N: usize> OutputValues for [T; N] {
    fn add_to(&self, values: &mut Vec<f64>) {
        self.iter().for_each(|value| value.add_to(values));
    }
}

/// The values of an output.
#[must_use]
pub fn output_values(of: &impl OutputValues) -> Vec<f64> {
    let mut values = Vec::new();
    of.add_to(&mut values);
    values
}

/// A place as (x, y, z).
pub trait Place {
    /// Its coordinates; 0 for z in the plane.
    fn place(&self) -> [f64; 3];
}

impl Place for Vec2 {
    fn place(&self) -> [f64; 3] {
        [self.x.value(), self.y.value(), 0.0]
    }
}

impl Place for Vec3 {
    fn place(&self) -> [f64; 3] {
        [self.x.value(), self.y.value(), self.z.value()]
    }
}
