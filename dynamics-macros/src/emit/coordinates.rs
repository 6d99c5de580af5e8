//! The coordinate struct: what the functions of a model take as `q`.

use proc_macro2::TokenStream;
use quote::quote;
use syn::Ident;

use super::{Slot, Surface, at_name, complete, docs, local, offsets, plain, quiet};

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
    let doc =
        format!("Time jets of the coordinates of [`{}`]: what its functions take as `q`.", surface.name);
    let complete = complete(surface);
    let multipliers = at_name(surface, quote!(#private::Reactions<#complete::Multipliers>));
    let (derived, reactions) = (derived(surface), reactions(surface));
    quote! {
        #[doc = #doc]
        #[allow(dead_code, clippy::exhaustive_structs)]
        #vis struct #name {
            #(#coordinates)*
            #(#inputs)*
            /// Time.
            #vis t: #expr,
            __reactions: #multipliers,
        }
        #derived
        #reactions
    }
}

/// `Clone` and `Debug` as derives would have them, but that the error of a missing impl block is seen at the
/// struct's name.
fn derived(surface: &Surface) -> TokenStream {
    let (name, private, quiet, f) = (surface.coordinates_type(), surface.private(), quiet(), local("f"));
    let fields: Vec<&Ident> =
        surface.coordinates.iter().chain(&surface.inputs).map(|slot| &slot.name).collect();
    let copies = fields.iter().map(|field| quote!(#field: self.#field,));
    let copy = at_name(surface, quote!(Self { #(#copies)* t: self.t, __reactions: self.__reactions }));
    let shown = fields.iter().map(|field| {
        let text = plain(field);
        quote!(.field(#text, &self.#field))
    });
    let text = name.to_string();
    quote! {
        #quiet
        #[automatically_derived]
        impl #private::Clone for #name {
            #[inline]
            fn clone(&self) -> Self { #copy }
        }
        #quiet
        #[automatically_derived]
        impl #private::Debug for #name {
            fn fmt(&self, #f: &mut #private::fmt::Formatter<'_>) -> #private::fmt::Result {
                #f.debug_struct(#text)#(#shown)*.field("t", &self.t).finish_non_exhaustive()
            }
        }
    }
}

/// `q.reaction(Self::rod)` and `q.slip(Self::stick)`: a constraint is named by its function.
fn reactions(surface: &Surface) -> TokenStream {
    let (name, vis, private, model) =
        (surface.coordinates_type(), &surface.vis, surface.private(), &surface.name);
    let (complete, c) = (complete(surface), local("constraint"));
    let reaction = at_name(surface, quote!(#complete::reaction(&self.__reactions, #c)));
    let slip = at_name(surface, quote!(#complete::slip(&self.__reactions, #c)));
    let (constraint, f, t, quiet) = (local("constraint"), local("F"), local("T"), quiet());
    quote! {
        #quiet
        impl #name {
            /// The multipliers λ of a constraint, named by its function as in `q.reaction(Self::rod)`, in the
            /// shape that the function returns: generalized forces that push toward growing values of the
            /// constraint. NaN where no solution is at hand, or where the function is no constraint.
            #[must_use]
            #vis fn reaction<#f, #t>(&self, #constraint: #f) -> #t
            where
                #f: #private::Fn(&#model, &#name) -> #t + 'static,
                #t: #private::Reaction,
            {
                #reaction
            }
            /// 0 while a switched constraint, named by its function, holds, else ±1: the side to which it was
            /// left. NaN where the function is no switched constraint.
            #[must_use]
            #vis fn slip<#f, #t>(&self, #constraint: #f) -> #private::Expr
            where
                #f: #private::Fn(&#model, &#name) -> #t + 'static,
            {
                #slip
            }
        }
    }
}

/// The documentation of the struct and its fields, as constants of `impl Described`.
pub(super) fn documentation(surface: &Surface) -> TokenStream {
    let private = surface.private();
    let text = &surface.documentation;
    let of_struct = (!text.is_empty()).then(|| quote!(const DOCUMENTATION: &'static #private::str = #text;));
    let fields = surface.field_documentation.iter().map(|(name, text)| quote!((#name, #text)));
    let of_fields = (!surface.field_documentation.is_empty()).then(|| {
        quote! {
            const FIELD_DOCUMENTATION: &'static [(&'static #private::str, &'static #private::str)] =
                &[#(#fields),*];
        }
    });
    quote!(#of_struct #of_fields)
}

/// `impl Model`: how the impl block, perhaps in another module, finds the types.
pub(super) fn model(surface: &Surface) -> TokenStream {
    let (model, private, quiet) = (&surface.name, surface.private(), quiet());
    let (state_type, coordinates_type, name) =
        (surface.state_type(), surface.coordinates_type(), plain(&surface.name));
    let (n, m, f64) = (surface.degrees(), surface.input_count(), quote!(#private::f64));
    let (state, accelerations, assembly) = (local("state"), local("accelerations"), assembly(surface));
    let multipliers = local("multipliers");
    let documentation = documentation(surface);
    quote! {
        #quiet
        #[automatically_derived]
        impl #private::Described for #model {
            type Coordinates = #coordinates_type;
            const NAME: &'static #private::str = #name;
            #documentation
        }
        #quiet
        #[automatically_derived]
        impl #private::Model for #model {
            type Vector = #private::SVector<#f64, #n>;
            type Matrix = #private::SMatrix<#f64, #n, #n>;
            type Inputs = #private::SVector<#f64, #m>;
            type State = #state_type;
            #[inline]
            fn coordinates_with(
                #state: &Self::State,
                #accelerations: &Self::Vector,
                #multipliers: &[#f64],
            ) -> Self::Coordinates {
                #assembly
            }
        }
    }
}

/// The body of `coordinates_with(state, accelerations, multipliers)`.
fn assembly(surface: &Surface) -> TokenStream {
    let private = surface.private();
    let (name, state, accelerations) = (surface.coordinates_type(), local("state"), local("accelerations"));
    let multipliers = local("multipliers");
    let jets = offsets(&surface.coordinates).map(|(at, slot)| {
        let jet =
            |i: usize| quote!(#private::Expr::coordinate(#state.q[#i], #state.u[#i], #accelerations[#i]));
        initializer(slot, at, &jet)
    });
    let inputs = offsets(&surface.inputs).map(|(at, slot)| {
        let jet = |i: usize| quote!(#private::Expr::input(#state.inputs[#i]));
        initializer(slot, at, &jet)
    });
    let values = quote! {
        #name {
            #(#jets,)* #(#inputs,)* t: #private::Expr::time(#state.t),
            __reactions: #private::Reactions::new(#multipliers, #state.active_set),
        }
    };
    at_name(surface, values)
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
