//! How the two macros meet: the derive leaves a macro of the struct's own name that carries the struct's
//! tokens; `#[dynamics] impl` calls it with the impl's tokens, and it hands both to `__model!`.
//!
//! The macro has a second use: `Name! { @fields path::of::a_macro { arguments } }` hands the struct's tokens
//! to that macro, before the arguments. So `dynamics_python::module!` reads the names and types of the
//! fields.
//!
//! Types and macros live in different namespaces, so the macro may have the struct's name and is imported
//! wherever the struct is: struct and impl may be in different modules. Only the compiler can report that
//! there is no such macro, or that two blocks call it. The names in its messages are chosen so that they say
//! what to do.

use proc_macro2::{Span, TokenStream};
use quote::{ToTokens, format_ident, quote};
use syn::{Ident, Path, Visibility};

use super::Surface;
use crate::messages;

/// The macro that carries `item`, the struct without attributes of other macros.
pub(crate) fn bridge(surface: &Surface, item: &TokenStream) -> TokenStream {
    let private = surface.private();
    let body = quote!(#private::__model! { { #item } { $($implementation)* } });
    define(&surface.name, &surface.vis, &body, item)
}

/// The macro of a struct that cannot be read: it drops the impl block.
pub(crate) fn dead_bridge(name: &Ident, vis: &Visibility) -> TokenStream {
    define(name, vis, &TokenStream::new(), &TokenStream::new())
}

/// Visible where the struct is, and no further: an import of a private struct is an error, instead of an
/// import of the macro alone. (A macro without `#[macro_export]` cannot be public.)
fn define(name: &Ident, vis: &Visibility, body: &TokenStream, item: &TokenStream) -> TokenStream {
    let vis = if matches!(vis, Visibility::Public(_)) { quote!(pub(crate)) } else { vis.to_token_stream() };
    let hidden = format_ident!("__dynamics_model_{}", name);
    quote! {
        #[doc(hidden)]
        #[allow(unused_macros)]
        macro_rules! #hidden {
            (@fields $macro:path { $($arguments:tt)* }) => { $macro! { { #item } $($arguments)* } };
            ($($implementation:tt)*) => { #body };
        }
        #[doc(hidden)]
        #[allow(unused_imports)]
        #vis use #hidden as #name;
    }
}

/// The macro of a struct with errors of its own: the impl block is not looked into, since its errors would
/// only repeat the struct's.
pub(crate) fn broken_bridge(surface: &Surface) -> TokenStream {
    bridge(surface, &TokenStream::new())
}

/// What rustc says is not found for a struct without the derive.
const MARK: &str = "derive_Dynamics";

/// The sign that a struct has the derive: without it rustc misses a macro, which says nothing to who did not
/// write one.
pub(crate) fn mark(name: &Ident, generics: &syn::Generics) -> TokenStream {
    let (quiet, mark, (generics, arguments, conditions)) =
        (super::quiet(), super::function(MARK), generics.split_for_impl());
    quote! {
        #quiet
        #[automatically_derived]
        impl #generics #name #arguments #conditions {
            #[doc(hidden)]
            #[allow(non_upper_case_globals)]
            pub(crate) const #mark: () = ();
        }
    }
}

/// Calls the bridge of the struct with this path with the impl block `item`, unless another block of the
/// module has done so.
///
/// Each block defines a module of the same name with a macro that lets pass what has the block's key, made of
/// its tokens and the `place` where it stands, and answers others with their error. `marked`: asks for the
/// [`mark()`] of the derive. Of two modules of one name the first counts: the second is an error of rustc's,
/// and its block meets the first block's macro. Two blocks for one struct in different modules meet only in
/// the impls that both would have, where `OnlyOneDynamicsImplPerModel` names the cause.
pub(crate) fn once(path: &Path, item: &TokenStream, marked: bool, place: [usize; 2]) -> TokenStream {
    let segments: Vec<String> = path.segments.iter().map(|s| super::plain(&s.ident)).collect();
    let (name, at) =
        (segments.join("_"), path.segments.last().map_or_else(Span::call_site, |s| s.ident.span()));
    let only = Ident::new(&format!("only_one_dynamics_impl_for_{name}"), at);
    let marked = marked.then(|| {
        let mark = Ident::new(MARK, at);
        quote!(const _: () = #path::#mark;)
    });
    let key = format_ident!("key_{:016x}", fingerprint(&format!("{place:?} {item}")));
    let error = syn::Error::new(at, messages::two_impls(segments.join("::"))).to_compile_error();
    quote! {
        #[doc(hidden)]
        #[allow(non_snake_case)]
        mod #only {
            macro_rules! this {
                (#key $error:tt { $($implementation:tt)* }) => { $($implementation)* };
                ($key:ident { $($error:tt)* } $implementation:tt) => { $($error)* };
            }
            pub(super) use this;
        }
        #only::this! {
            #key { #error } {
                #path! { #item }
                #marked
            }
        }
    }
}

/// What is `derived` of the struct with this name, `item`, unless another struct of the name and module came
/// first: as [`once`] for blocks.
pub(crate) fn once_per_name(
    name: &Ident,
    derived: &TokenStream,
    item: &TokenStream,
    place: [usize; 2],
) -> TokenStream {
    let only = Ident::new(&format!("only_one_dynamics_model_called_{}", super::plain(name)), name.span());
    let key = format_ident!("key_{:016x}", fingerprint(&format!("{place:?} {item}")));
    quote! {
        #[doc(hidden)]
        #[allow(non_snake_case)]
        mod #only {
            macro_rules! this {
                (#key { $($derived:tt)* }) => { $($derived)* };
                ($key:ident $derived:tt) => {};
            }
            pub(super) use this;
        }
        #only::this! { #key { #derived } }
    }
}

/// FNV-1a: the same in every build.
fn fingerprint(text: &str) -> u64 {
    text.bytes().fold(0xcbf2_9ce4_8422_2325, |hash, byte| {
        (hash ^ u64::from(byte)).wrapping_mul(0x0000_0100_0000_01b3)
    })
}
