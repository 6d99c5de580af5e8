//! Conditional compilation inside a model: rustc removes what is switched off after the macro has derived
//! equations from it.

use proc_macro2::{Delimiter, TokenStream, TokenTree};
use quote::ToTokens;
use syn::{Attribute, ImplItem, ItemImpl};

use super::roles::is_drawing;
use crate::diagnostics::{Diagnostics, Place};
use crate::messages;

/// A macro cannot ask what is switched on, so that a condition within its input has no meaning that it could
/// follow. Conditions on the block as a whole and on the struct's fields are settled before the macros run;
/// what is left of them is not.
pub(crate) fn check(item: &ItemImpl, d: &mut Diagnostics) {
    item.attrs.iter().for_each(|attribute| report(attribute.to_token_stream(), d));
    for inner in &item.items {
        match inner {
            // A picture's body stays rustc's own, and is not followed where it has conditions; only whether
            // there is one has to be known.
            ImplItem::Fn(function) if function.attrs.iter().any(is_drawing) => {
                let attributes = function.attrs.iter().filter(|attribute| !is_drawing(attribute));
                attributes.for_each(|attribute: &Attribute| report(attribute.to_token_stream(), d));
                report(function.sig.to_token_stream(), d);
            }
            // That it cannot be followed is reported already.
            ImplItem::Macro(_) => {}
            inner => report(inner.to_token_stream(), d),
        }
    }
}

fn report(tokens: TokenStream, d: &mut Diagnostics) {
    for (name, attribute) in conditions(tokens) {
        d.error(Place::of(attribute), &messages::cfg_in_model(&name));
    }
}

/// Every `#[cfg(..)]`, `#[cfg_attr(..)]` and `#![..]` of them, at any depth: its name and what is in its
/// brackets. Tokens hold attributes wherever the language allows them.
pub(crate) fn conditions(tokens: TokenStream) -> Vec<(String, TokenStream)> {
    let mut found = Vec::new();
    let mut left = vec![tokens];
    while let Some(stream) = left.pop() {
        let mut hash = false;
        let mut groups = Vec::new();
        for tree in stream {
            match tree {
                TokenTree::Group(group) => {
                    let conditional = hash && group.delimiter() == Delimiter::Bracket;
                    match condition(&group.stream()).filter(|_| conditional) {
                        Some(name) => found.push((name, group.stream())),
                        None => groups.push(group.stream()),
                    }
                    hash = false;
                }
                TokenTree::Punct(sign) => hash = sign.as_char() == '#' || hash && sign.as_char() == '!',
                _ => hash = false,
            }
        }
        // The last one pushed is looked at first: errors come in the order of the source within a level.
        left.extend(groups.into_iter().rev());
    }
    found
}

/// `cfg` or `cfg_attr`, where an attribute begins with it.
fn condition(attribute: &TokenStream) -> Option<String> {
    match attribute.clone().into_iter().next() {
        Some(TokenTree::Ident(name)) if name == "cfg" || name == "cfg_attr" => Some(name.to_string()),
        _ => None,
    }
}
