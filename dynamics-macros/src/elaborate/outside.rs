//! Functions that no role reaches: they are not elaborated, but what they read is read.
//!
//! A function that looks like a role, that nothing calls, and that alone reads some parameter, is a role that was forgotten: a spring
//! without its `#[potential]` would otherwise be left out of the motion without a word.

use std::collections::BTreeSet;

use proc_macro2::{TokenStream, TokenTree};
use quote::ToTokens;

use super::Elaborator;
use crate::messages;
use crate::syntax::{Function, Role};

/// Names after `self.` and `Self::` in the body of a function: fields and functions alike.
fn names_used(function: &Function) -> BTreeSet<String> {
    fn collect(tokens: TokenStream, names: &mut BTreeSet<String>) {
        let mut before = [String::new(), String::new(), String::new()];
        for tree in tokens {
            if let TokenTree::Group(group) = &tree {
                collect(group.stream(), names);
            }
            let text = match &tree {
                TokenTree::Group(_) => String::new(),
                tree => tree.to_string(),
            };
            if before[1..] == ["self", "."] || before == ["Self", ":", ":"] {
                names.insert(text.clone());
            }
            before.rotate_left(1);
            before[2] = text;
        }
    }
    let mut names = BTreeSet::new();
    collect(function.item.block.to_token_stream(), &mut names);
    names
}

/// Whether a function could have a role by its signature.
fn looks_like_a_role(function: &Function) -> bool {
    function.role == Role::Helper
        && function.takes_coordinates_only()
        && matches!(function.returns().as_deref(), Some("Expr" | "Force"))
}

impl Elaborator<'_> {
    /// Notes which parameters are read by functions that are not elaborated, and reports forgotten roles.
    pub(super) fn readers_outside(&mut self) {
        let implementation = self.implementation;
        let functions: Vec<(bool, &Function, BTreeSet<String>)> = implementation
            .functions
            .iter()
            .enumerate()
            .map(|(i, function)| (self.reached.contains(&i), function, names_used(function)))
            .collect();
        for (i, (reached, function, names)) in functions.iter().enumerate() {
            if *reached {
                continue;
            }
            self.model.read_elsewhere.extend(names.iter().cloned());
            let name = function.name.to_string();
            let others = || functions.iter().enumerate().filter(|(j, _)| *j != i).map(|(_, (_, _, names))| names);
            if !looks_like_a_role(function) || others().any(|names| names.contains(&name)) {
                continue;
            }
            let fields = self.declaration.fields.iter().map(|field| field.name.to_string());
            let own = fields.filter(|field| names.contains(field) && !others().any(|names| names.contains(field)));
            if let Some(field) = own.into_iter().next() {
                self.diagnostics.error(function.name.span(), &messages::forgotten_role(&name, field));
            }
        }
    }
}
