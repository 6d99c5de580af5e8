//! Patterns of `let`, `for` and function arguments.

use std::rc::Rc;

use quote::ToTokens;
use syn::{Member, Pat};

use super::Elaborator;
use super::values::Value;
use crate::diagnostics::Place;
use crate::messages;

impl<'a> Elaborator<'a> {
    /// Declares the variables of a pattern.
    pub(super) fn bind(&mut self, pattern: &'a Pat, value: Value) {
        match pattern {
            Pat::Wild(_) => {}
            Pat::Ident(ident) if ident.subpat.is_none() => {
                if let (Some(_), Some(mutability)) = (&ident.by_ref, &ident.mutability) {
                    self.diagnostics.error(mutability.span, &messages::mutable_reference());
                }
                self.frame().declare(ident.ident.to_string(), value);
            }
            Pat::Type(typed) => {
                self.declared_as(&value, &typed.ty);
                self.bind(&typed.pat, value);
            }
            Pat::Paren(inner) => self.bind(&inner.pat, value),
            Pat::Reference(inner) => self.bind(&inner.pat, value),
            Pat::Tuple(tuple) => self.bind_parts(tuple.elems.iter(), value, pattern),
            Pat::Slice(slice) => self.bind_parts(slice.elems.iter(), value, pattern),
            Pat::Struct(fields) => self.bind_components(fields, value),
            other => {
                let message = messages::unsupported("this kind of pattern", "bind names, tuples and arrays");
                self.diagnostics.error(Place::of(other), &message);
                // What it would have bound is not known; uses of it are silenced by declaring nothing twice.
                self.bind_names(other);
            }
        }
    }

    /// `(a, b, ..)` and `[a, .., b]`.
    fn bind_parts(&mut self, parts: impl ExactSizeIterator<Item = &'a Pat>, value: Value, pattern: &'a Pat) {
        let parts: Vec<&Pat> = parts.collect();
        let rest = parts.iter().position(|p| matches!(p, Pat::Rest(_)));
        let fixed = parts.len() - usize::from(rest.is_some());
        let items = match value {
            Value::Tuple(items) | Value::Array(items)
                if items.len() == fixed || rest.is_some() && items.len() > fixed =>
            {
                items
            }
            Value::Vector(v) if v.len() == fixed => Rc::new(v.into_iter().map(Value::Scalar).collect()),
            other => {
                if !other.is_poison() {
                    self.diagnostics.error(Place::of(pattern), &messages::pattern_mismatch(other.shape()));
                }
                Rc::new(vec![Value::Poison; fixed])
            }
        };
        let skipped = items.len() - fixed;
        for (i, part) in parts.into_iter().enumerate() {
            match rest {
                Some(at) if i == at => {}
                Some(at) if i > at => self.bind(part, items[i - 1 + skipped].clone()),
                _ => self.bind(part, items[i].clone()),
            }
        }
    }

    /// `Vec3 { x, y, .. }`.
    fn bind_components(&mut self, pattern: &'a syn::PatStruct, value: Value) {
        for field in &pattern.fields {
            let part =
                if value.is_poison() { Value::Poison } else { self.field(value.clone(), &field.member) };
            if field.colon_token.is_none()
                && let Member::Named(name) = &field.member
            {
                self.frame().declare(name.to_string(), part);
            } else {
                self.bind(&field.pat, part);
            }
        }
    }

    /// All identifiers of a pattern that is not understood, as poison.
    pub(super) fn bind_names(&mut self, pattern: &Pat) {
        let mut left = vec![pattern.to_token_stream()];
        while let Some(tokens) = left.pop() {
            for tree in tokens {
                match tree {
                    proc_macro2::TokenTree::Ident(name) => {
                        self.frame().declare(name.to_string(), Value::Poison)
                    }
                    proc_macro2::TokenTree::Group(group) => left.push(group.stream()),
                    _ => {}
                }
            }
        }
    }
}
