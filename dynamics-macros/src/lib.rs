//! The procedural macros of `dynamics`.
#![allow(dead_code, unused_imports)] // until the emitter reads all of it

mod compile;
mod diagnostics;
mod elaborate;
mod messages;
mod syntax;
