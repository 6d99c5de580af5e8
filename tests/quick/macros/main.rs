//! The tests of the macros, on token strings. The macros' modules are compiled into it, since a proc-macro
//! crate cannot be linked.

/// The modules of `dynamics-macros`, which find each other at the root of their crate.
#[allow(dead_code, unreachable_pub, reason = "the macros' own crate says what it needs not")]
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
    pub(crate) mod tests;
}
use macros::{assertions, compile, diagnostics, elaborate, emit, expand, library, messages, suggest, syntax};
