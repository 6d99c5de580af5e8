//! Vectors and square matrices whose sizes are part of their types.

use core::fmt::Debug;
use core::ops::{Index, IndexMut};

use nalgebra::SVector;

use crate::lanes::{Lanes, Wide};

/// A vector whose length is part of its type: `SVector<f64, N>`.
pub trait Vector:
    Copy + PartialEq + Debug + Send + Sync + 'static + Index<usize, Output = f64> + IndexMut<usize>
{
    /// Number of elements.
    const LEN: usize;
    /// A square matrix of as many rows and columns.
    type Square: Square;
    /// As many elements, each of several numbers side by side.
    type Wide<L: Lanes>: Wide<L>;
    /// All elements zero.
    fn zeros() -> Self;
    /// The elements in order.
    fn as_slice(&self) -> &[f64];
    /// The elements in order, to be changed.
    fn as_mut_slice(&mut self) -> &mut [f64];
}

/// The values that an input law may return: the vector of inputs, an array of as many numbers, or, for one
/// input, a number.
#[diagnostic::on_unimplemented(
    message = "`{Self}` is not what the inputs of this model are set to",
    label = "return a number for each input, `[torque, force]`; for one input `[torque]` or `torque`"
)]
pub trait InputValues<V> {
    /// The values as a vector.
    fn values(self) -> V;
}

impl<V: Vector> InputValues<V> for V {
    #[inline(always)]
    fn values(self) -> V {
        self
    }
}

impl<const N: usize> InputValues<SVector<f64, N>> for [f64; N] {
    #[inline(always)]
    fn values(self) -> SVector<f64, N> {
        SVector::from_array_storage(nalgebra::ArrayStorage([self]))
    }
}

impl InputValues<SVector<f64, 1>> for f64 {
    #[inline(always)]
    fn values(self) -> SVector<f64, 1> {
        InputValues::values([self])
    }
}

/// Memory for a square matrix, by rows, whose size is part of its type.
pub trait Square: Copy + Debug + Send + Sync + 'static {
    /// All elements zero.
    fn zeros() -> Self;
    /// The elements row by row.
    fn as_slice(&self) -> &[f64];
    /// The elements row by row, to be changed.
    fn as_mut_slice(&mut self) -> &mut [f64];
    /// The elements of many, one matrix after the other.
    fn flatten(all: &mut [Self]) -> &mut [f64];
}

impl<const N: usize> Square for [[f64; N]; N] {
    #[inline(always)]
    fn zeros() -> Self {
        [[0.0; N]; N]
    }
    #[inline(always)]
    fn as_slice(&self) -> &[f64] {
        self.as_flattened()
    }
    #[inline(always)]
    fn as_mut_slice(&mut self) -> &mut [f64] {
        self.as_flattened_mut()
    }
    #[inline(always)]
    fn flatten(all: &mut [Self]) -> &mut [f64] {
        all.as_flattened_mut().as_flattened_mut()
    }
}

impl<const N: usize> Vector for SVector<f64, N> {
    const LEN: usize = N;
    type Square = [[f64; N]; N];
    type Wide<L: Lanes> = [L; N];
    #[inline(always)]
    fn zeros() -> Self {
        SVector::from_array_storage(nalgebra::ArrayStorage([[0.0; N]]))
    }
    #[inline(always)]
    fn as_slice(&self) -> &[f64] {
        &self.data.0[0]
    }
    #[inline(always)]
    fn as_mut_slice(&mut self) -> &mut [f64] {
        &mut self.data.0[0]
    }
}
