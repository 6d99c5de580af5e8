//! What elaboration assumed of paths and constants that it cannot see. Emission makes rustc assert it.

use proc_macro2::{Ident, TokenStream};

/// What emitted code asserts of constants, types and functions.
#[derive(Clone, Debug, Default)]
pub(crate) struct Constants {
    /// Paths that were taken for constants of std's.
    pub(crate) taken: Vec<TakenForStd>,
    /// Paths that were taken for types and functions of the library.
    pub(crate) words: Vec<TakenForLibrary>,
    /// The constants of the block that the model uses.
    pub(crate) followed: Vec<FollowedConstant>,
}

/// A path that was taken for a constant of std's.
#[derive(Clone, Debug)]
pub(crate) struct TakenForStd {
    pub(crate) within: Within,
    /// The path without spaces.
    pub(crate) text: String,
    pub(crate) path: syn::Path,
    /// The constant's name.
    pub(crate) name: String,
    pub(crate) value: f64,
}

/// A path that was taken for a type or a function of the library.
#[derive(Clone, Debug)]
pub(crate) struct TakenForLibrary {
    pub(crate) within: Within,
    pub(crate) path: syn::Path,
    /// The path's last name.
    pub(crate) name: Ident,
}

/// Where a path stands, by index.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Within {
    Function(usize),
    Constant(usize),
}

/// A constant of the block, with how its numbers are reached from it.
#[derive(Clone, Debug)]
pub(crate) struct FollowedConstant {
    pub(crate) name: Ident,
    pub(crate) parts: Vec<(TokenStream, Followed)>,
}

/// The value of a constant in the equations.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Followed {
    Integer(i128),
    Real(f64),
}
