//! Assertions that constants, types and functions are for rustc what they were for the equations.
//!
//! The macro sees no names outside of the block. Where it took a path for a constant of std's, or for a type
//! or a function of the library's, the function or constant that holds the path asserts it, among the names
//! that are in scope there; and each constant of the block that the model uses is compared with the value
//! that was derived with.

use proc_macro2::{Group, Span, TokenStream, TokenTree};
use quote::{ToTokens, quote};
use syn::spanned::Spanned;
use syn::{ImplItem, ItemImpl, Stmt};

use super::Surface;
use crate::assertions::{Constants, Followed, FollowedConstant, TakenForLibrary, TakenForStd, Within};
use crate::messages;
use crate::syntax::Implementation;

/// Puts an assertion beside each path of the user's that was taken for a constant of std's, or a word of the
/// library's.
pub(crate) fn assert_paths(
    item: &mut ItemImpl,
    implementation: &Implementation,
    constants: &Constants,
    surface: &Surface,
) {
    let words = constants.words.iter().map(|word| (word.within, library_word(word, surface)));
    let taken = constants.taken.iter().map(|constant| (constant.within, std_constant(constant, surface)));
    for (within, asserted) in words.chain(taken) {
        let name = match within {
            Within::Function(index) => implementation.functions.get(index).map(|f| &f.name),
            Within::Constant(index) => implementation.constants.get(index).map(|c| &c.name),
        };
        for entry in &mut item.items {
            match entry {
                ImplItem::Fn(function) if Some(&function.sig.ident) == name => {
                    function.block.stmts.insert(0, Stmt::Item(syn::Item::Verbatim(asserted.clone())));
                }
                ImplItem::Const(constant) if Some(&constant.ident) == name => {
                    let value = &constant.expr;
                    constant.expr = syn::Expr::Verbatim(quote!({ #asserted #value }));
                }
                _ => {}
            }
        }
    }
}

/// `const _: () = expect_type::<path, Type>();`, or
/// `const _: () = the_name_vec2_is_the_librarys_choose_another(path);` at the path.
fn library_word(taken: &TakenForLibrary, surface: &Surface) -> TokenStream {
    let TakenForLibrary { path, name, .. } = taken;
    let (private, at, text) = (surface.private(), path.span(), name.to_string());
    let call = match text.as_str() {
        "vec2" | "vec3" => {
            let expect = super::function(&format!("the_name_{text}_is_the_librarys_choose_another"));
            let call = located(quote!(#private::#expect), at);
            let mut arguments = Group::new(proc_macro2::Delimiter::Parenthesis, path.to_token_stream());
            arguments.set_span(Span::call_site().located_at(at));
            quote!(#call #arguments)
        }
        _ => {
            let word = super::function(&text);
            let of_any = matches!(text.as_str(), "Vec2" | "Vec3" | "Mat3").then(|| quote!(<_>));
            let call = located(quote!(#private::expect_type), at);
            quote!(#call::<#path, #private::library::#word #of_any>())
        }
    };
    quote! {
        #[allow(unused, unused_qualifications, deprecated, clippy::all, clippy::pedantic, clippy::nursery)]
        const _: () = #call;
    }
}

/// `const _: () = expect_std(path, value, remedy);` at the path.
fn std_constant(constant: &TakenForStd, surface: &Surface) -> TokenStream {
    let TakenForStd { text, path, name, value, .. } = constant;
    let message = messages::not_the_constant_of_std(text, name).to_string();
    let (private, at) = (surface.private(), path.span());
    let call = located(quote!(#private::expect_std), at);
    let mut arguments = Group::new(proc_macro2::Delimiter::Parenthesis, quote!(#path, #value, #message));
    arguments.set_span(Span::call_site().located_at(at));
    quote! {
        #[allow(unused, unused_qualifications, deprecated, clippy::all, clippy::pedantic, clippy::nursery)]
        const _: () = #call #arguments;
    }
}

/// The constants of the block, each beside what the equations have for it.
pub(crate) fn followed(surface: &Surface, constants: &Constants) -> TokenStream {
    // One that holds a path of std's is what it was taken for, or an error already.
    let asserted_already =
        |index| constants.taken.iter().any(|taken| taken.within == Within::Constant(index));
    let (private, target, quiet) = (surface.private(), &surface.target, super::quiet());
    let mut asserted = TokenStream::new();
    for (index, FollowedConstant { name, parts }) in constants.followed.iter().enumerate() {
        if asserted_already(index) {
            continue;
        }
        let message = messages::constant_differs(name).to_string();
        for (access, number) in parts {
            let access = quote!(<#target>::#name #access);
            let call = match number {
                Followed::Real(value) => quote!(#private::expect_near(#access, #value, #message)),
                Followed::Integer(value) => {
                    let value = proc_macro2::Literal::i128_unsuffixed(*value);
                    quote!(#private::expect(#access == #value, #message))
                }
            };
            let call = located(call, name.span());
            asserted.extend(quote!(const _: () = #call;));
        }
    }
    if asserted.is_empty() { asserted } else { quote!(#quiet const _: () = { #asserted };) }
}

/// Tokens that are shown at the user's, and mean what they mean in generated code.
fn located(tokens: TokenStream, at: Span) -> TokenStream {
    let tokens = tokens.into_iter().map(|mut tree| {
        if let TokenTree::Group(group) = &mut tree {
            *group = Group::new(group.delimiter(), located(group.stream(), at));
        }
        tree.set_span(tree.span().located_at(at));
        tree
    });
    tokens.collect()
}
