//! Banded matrices with a border: what neighbours that couple to neighbours leave, and a few unknowns that
//! couple to all.

pub(crate) mod banded;
pub(crate) mod bordered;
pub(crate) mod dense;
pub(crate) mod hermitian;
mod narrow;
pub(crate) mod order;
pub(crate) mod tridiagonal;
