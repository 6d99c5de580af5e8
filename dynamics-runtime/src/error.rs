//! Errors, with the values needed to act on them.

use core::fmt;

/// The mass matrix has no inverse at this state: a pivot of its factorization LDLᵀ vanished against its diagonal.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SingularMassMatrix {
    /// Index of the coordinate whose pivot vanished.
    pub coordinate: usize,
    /// Its name.
    pub name: &'static str,
    /// The pivot.
    pub pivot: f64,
}

impl fmt::Display for SingularMassMatrix {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(
            f,
            "the mass matrix is singular: coordinate `{}` has no inertia of its own at this state (pivot {:e})",
            self.name, self.pivot
        )
    }
}

impl core::error::Error for SingularMassMatrix {}
