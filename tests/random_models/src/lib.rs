//! The engine's interpreter, for models as text.

#![allow(missing_docs)]

/// The modules of `dynamics-macros` that come before emission, which find each other at the root of their
/// crate.
#[allow(dead_code, unused_imports)]
#[path = "../../../dynamics-macros/src"]
mod macros {
    pub(crate) mod assertions;
    pub(crate) mod diagnostics;
    pub(crate) mod elaborate;
    pub(crate) mod library;
    pub(crate) mod messages;
    pub(crate) mod suggest;
    pub(crate) mod syntax;
}
use macros::{assertions, diagnostics, elaborate, library, messages, suggest, syntax};

pub mod interpret;
