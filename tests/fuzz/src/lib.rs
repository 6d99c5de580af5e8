//! Fuzzing of the macros and of the engine behind them.
//!
//! `corpus` reads every model of this repository, `trees` and `mutate` change them, `generate` makes inputs
//! that no model resembles, `target` says what must hold of the macros for any tokens, `engine` what must
//! hold of the engine for any graph.

#![allow(missing_docs)]

/// The modules of `dynamics-macros`, which find each other at the root of their crate.
#[allow(dead_code)]
#[path = "../../../dynamics-macros/src"]
mod macros {
    pub(crate) mod assertions;
    pub(crate) mod compile;
    pub(crate) mod diagnostics;
    pub(crate) mod elaborate;
    pub(crate) mod emit;
    pub(crate) mod expand;
    pub(crate) mod library;
    pub(crate) mod messages;
    pub(crate) mod suggest;
    pub(crate) mod syntax;
}
use macros::{assertions, compile, diagnostics, elaborate, emit, expand, library, messages, suggest, syntax};

pub mod corpus;
pub mod engine;
pub mod generate;
pub mod mutate;
pub mod random;
pub mod target;
pub mod trees;
