//! How the two macros meet: the derive leaves a macro of the struct's own name that carries the struct's tokens; `#[dynamics] impl`
//! calls it with the impl's tokens, and it hands both to `__model!`.
//!
//! Types and macros live in different namespaces, so the macro may have the struct's name and is imported wherever the struct is:
//! struct and impl may stand in different modules.

use proc_macro2::TokenStream;
use quote::{format_ident, quote};
use syn::Ident;

use super::Surface;

/// The macro that carries `item`, the struct without attributes of other macros.
pub(crate) fn bridge(surface: &Surface, item: &TokenStream) -> TokenStream {
    let private = surface.private();
    define(&surface.name, &quote!(#private::__model! { { #item } { $($implementation)* } }))
}

/// The macro of a struct that cannot be read: it drops the impl block.
pub(crate) fn dead_bridge(name: &Ident) -> TokenStream {
    define(name, &TokenStream::new())
}

fn define(name: &Ident, body: &TokenStream) -> TokenStream {
    let hidden = format_ident!("__dynamics_model_{}", name);
    quote! {
        #[doc(hidden)]
        #[allow(unused_macros)]
        macro_rules! #hidden {
            ($($implementation:tt)*) => { #body };
        }
        #[doc(hidden)]
        #[allow(unused_imports)]
        pub(crate) use #hidden as #name;
    }
}

/// The macro of a struct with errors of its own: the impl block is not looked into, since its errors would only repeat the struct's.
pub(crate) fn broken_bridge(surface: &Surface) -> TokenStream {
    bridge(surface, &TokenStream::new())
}
