//! Models with families: types with the model's names, and loops over elements.

mod loops;
mod matrices;
mod portable;
mod rows;
mod traits;
mod types;

use proc_macro2::Span;
use syn::Ident;

pub(crate) use traits::{family_fallback, family_traits};
pub(crate) use types::family_types;

/// The user's field of this name.
fn field(name: &str) -> Ident {
    match name.strip_prefix("r#") {
        Some(keyword) => Ident::new_raw(keyword, Span::call_site()),
        None => Ident::new(name, Span::call_site()),
    }
}
