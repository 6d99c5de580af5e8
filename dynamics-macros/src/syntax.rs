//! Tokens → spanned declarations. Nothing is interpreted here beyond names, lengths and roles.

mod attributes;
mod conditions;
mod declaration;
mod impls;
mod limits;
mod roles;
mod structs;

pub(crate) use attributes::ATTRIBUTES;
pub(crate) use conditions::conditions;
pub(crate) use declaration::{
    Declaration, FamilyLength, FieldKind, MOST_OFFSET, Quantity, Shape, Targets, UnitText,
};
pub(crate) use impls::{Function, Implementation, path as path_text};
pub(crate) use limits::check_nesting;
pub(crate) use roles::{ConstraintOptions, Role};
pub(crate) use structs::is_always_named;

use proc_macro2::TokenStream;

use crate::diagnostics::Diagnostics;

/// Parses the annotated struct. `None` where too little is there to go on; the reasons are in `diagnostics`
/// either way.
pub(crate) fn parse_struct(tokens: TokenStream, diagnostics: &mut Diagnostics) -> Option<Declaration> {
    limits::check_nesting(&tokens, diagnostics)?;
    match syn::parse2(tokens.clone()) {
        Ok(item) => Some(structs::declaration(item, diagnostics)),
        Err(error) => match syn::parse2::<syn::DeriveInput>(tokens) {
            Ok(other) => Some(structs::not_a_struct(other, diagnostics)),
            Err(_) => {
                diagnostics.syntax(error);
                None
            }
        },
    }
}

/// Parses the annotated impl block.
pub(crate) fn parse_impl(tokens: TokenStream, diagnostics: &mut Diagnostics) -> Option<Implementation> {
    limits::check_nesting(&tokens, diagnostics)?;
    match syn::parse2(tokens) {
        Ok(item) => impls::implementation(item, diagnostics),
        Err(error) => {
            diagnostics.syntax(error);
            None
        }
    }
}
