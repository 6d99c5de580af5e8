//! A workspace that a caller lends, divided into slices, and indices stored in it.

/// The unused rest of a workspace.
pub(crate) struct WorkspaceSlices<'w>(&'w mut [f64]);

impl<'w> WorkspaceSlices<'w> {
    /// All of a workspace. The caller has to provide enough.
    pub(crate) fn new(workspace: &'w mut [f64]) -> Self {
        Self(workspace)
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

/// Indices in a workspace, which is for numbers: exact up to 2⁵³.
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
