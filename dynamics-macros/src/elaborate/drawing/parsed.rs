//! Expressions that are parsed while a drawing is followed, from the tokens of macros.

use std::cell::OnceCell;

use syn::Expr;

/// A list of expressions that only grows, so that they can be borrowed as long as it lives.
#[derive(Default)]
pub(in super::super) struct Parsed(OnceCell<Box<(Expr, Parsed)>>);

impl Parsed {
    /// Keeps one more expression.
    pub(super) fn keep(&self, expr: Expr) -> &Expr {
        let mut end = self;
        while let Some(entry) = end.0.get() {
            end = &entry.1;
        }
        &end.0.get_or_init(|| Box::new((expr, Self::default()))).0
    }
}
