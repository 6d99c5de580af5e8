//! Memory that a caller lends, cut into pieces; indices kept in it; operations on rows of numbers.

/// What is left of the memory that a caller lends.
pub(crate) struct Memory<'w>(&'w mut [f64]);

impl<'w> Memory<'w> {
    /// # Panics
    /// Where the memory is shorter than [`super::workspace_len`] says: a fault of the program, not of its
    /// input.
    pub(crate) fn new(workspace: &'w mut [f64], n: usize, r: usize) -> Self {
        let (needed, given) = (super::workspace_len(n, r), workspace.len());
        assert!(
            given >= needed,
            "a workspace of {given} numbers for {n} coordinates and {r} rows; give {needed}"
        );
        Self(workspace)
    }

    /// Memory of a length that the caller answers for.
    pub(crate) fn rest(memory: &'w mut [f64]) -> Self {
        Self(memory)
    }

    /// The next `len` numbers, as they are.
    pub(crate) fn take(&mut self, len: usize) -> &'w mut [f64] {
        let (piece, rest) = core::mem::take(&mut self.0).split_at_mut(len);
        self.0 = rest;
        piece
    }

    /// The next `len` numbers, set to zero.
    pub(crate) fn zeros(&mut self, len: usize) -> &'w mut [f64] {
        let piece = self.take(len);
        piece.fill(0.0);
        piece
    }

    /// The next `len` numbers as indices 0, 1, ….
    pub(crate) fn indices(&mut self, len: usize) -> Indices<'w> {
        let mut indices = Indices(self.take(len));
        (0..len).for_each(|i| indices.set(i, i));
        indices
    }
}

/// Indices in memory for numbers: exact up to 2⁵³.
pub(crate) struct Indices<'w>(&'w mut [f64]);

impl Indices<'_> {
    #[inline(always)]
    pub(crate) fn get(&self, i: usize) -> usize {
        self.0[i] as usize
    }
    #[inline(always)]
    pub(crate) fn set(&mut self, i: usize, index: usize) {
        self.0[i] = index as f64;
    }
    #[inline(always)]
    pub(crate) fn swap(&mut self, i: usize, j: usize) {
        self.0.swap(i, j);
    }
}

/// Σ aᵢ bᵢ.
#[inline]
pub(crate) fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

/// y + x, in place.
#[inline]
pub(crate) fn add(y: &mut [f64], x: &[f64]) {
    y.iter_mut().zip(x).for_each(|(y, x)| *y += x);
}

/// y + c x, in place.
#[inline]
pub(crate) fn add_scaled(y: &mut [f64], c: f64, x: &[f64]) {
    y.iter_mut().zip(x).for_each(|(y, x)| *y += c * x);
}

/// The greatest absolute value; NaN where an element is.
#[inline]
pub(crate) fn max_abs(x: &[f64]) -> f64 {
    x.iter().fold(0.0, |most, x| if x.abs() > most || x.is_nan() { x.abs() } else { most })
}

/// Euclidean norm without overflow.
#[inline]
pub(crate) fn norm(x: &[f64]) -> f64 {
    let square = dot(x, x);
    // As a rule nothing over- or underflows.
    if (1e-250..1e250).contains(&square) {
        return crate::math::sqrt(square);
    }
    let size = max_abs(x);
    if size == 0.0 || !size.is_finite() {
        return size;
    }
    size * crate::math::sqrt(x.iter().map(|x| (x / size) * (x / size)).sum())
}

/// Two different rows of a matrix with `n` columns, the first before the second.
#[inline]
pub(crate) fn two_rows(a: &mut [f64], n: usize, first: usize, second: usize) -> (&mut [f64], &mut [f64]) {
    let (head, tail) = a.split_at_mut(second * n);
    (&mut head[first * n..(first + 1) * n], &mut tail[..n])
}

/// Exchanges two rows of a matrix with `n` columns.
pub(crate) fn swap_rows(a: &mut [f64], n: usize, i: usize, j: usize) {
    if i != j {
        let (a, b) = two_rows(a, n, i.min(j), i.max(j));
        a.swap_with_slice(b);
    }
}
