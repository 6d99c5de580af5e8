//! The coordinate struct: what the functions of a model take as `q`.

use proc_macro2::TokenStream;
use quote::quote;

use super::{Slot, Surface, docs, local, offsets};

/// `XCoordinates`, one time jet per coordinate and input, and time.
pub(super) fn coordinates(surface: &Surface) -> TokenStream {
    let (name, vis, private) = (surface.coordinates_type(), &surface.vis, surface.private());
    let expr = quote!(#private::Expr);
    let fields = |slots: &[Slot], doc: fn(&Slot) -> String| -> Vec<TokenStream> {
        slots
            .iter()
            .map(|slot| {
                let (field, ty, doc) = (&slot.name, slot.ty(&expr), doc(slot));
                quote!(#[doc = #doc] #vis #field: #ty,)
            })
            .collect()
    };
    let coordinates = fields(&surface.coordinates, docs::coordinate);
    let inputs = fields(&surface.inputs, docs::input);
    let doc = format!("Time jets of the coordinates of [`{}`]: what its functions take as `q`.", surface.name);
    let derive = docs::derive(&private, &["Clone", "Debug"]);
    quote! {
        #[doc = #doc]
        #derive
        #[allow(dead_code)]
        #vis struct #name {
            #(#coordinates)*
            #(#inputs)*
            /// Time.
            #vis t: #expr,
        }
    }
}

/// The body of `coordinates_with(state, accelerations)`.
pub(super) fn assembly(surface: &Surface) -> TokenStream {
    let private = surface.private();
    let (name, state, accelerations) = (surface.coordinates_type(), local("state"), local("accelerations"));
    let jets = offsets(&surface.coordinates).map(|(at, slot)| {
        let jet = |i: usize| quote!(#private::Expr::coordinate(#state.q[#i], #state.u[#i], #accelerations[#i]));
        initializer(slot, at, &jet)
    });
    let inputs = offsets(&surface.inputs).map(|(at, slot)| {
        let jet = |i: usize| quote!(#private::Expr::input(#state.inputs[#i]));
        initializer(slot, at, &jet)
    });
    quote! {
        #name { #(#jets,)* #(#inputs,)* t: #private::Expr::time(#state.t) }
    }
}

fn initializer(slot: &Slot, at: usize, jet: &dyn Fn(usize) -> TokenStream) -> TokenStream {
    let name = &slot.name;
    match slot.len {
        None => {
            let value = jet(at);
            quote!(#name: #value)
        }
        Some(n) => {
            let values = (at..at + n).map(jet);
            quote!(#name: [#(#values),*])
        }
    }
}
