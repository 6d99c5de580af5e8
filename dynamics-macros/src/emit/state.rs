//! The state struct with the model's own names.

use proc_macro2::TokenStream;
use quote::{format_ident, quote};

use super::{Slot, Surface, at_name, complete, docs, local, offsets, quiet};

/// `XState` with its accessors, and `ModelState` for it.
pub(super) fn state(surface: &Surface) -> TokenStream {
    let (name, vis, private) = (surface.state_type(), &surface.vis, surface.private());
    let (n, m) = (surface.degrees(), surface.input_count());
    let derive = docs::derive(&private, &["Clone", "Copy", "Debug", "PartialEq"]);
    let doc = docs::state(surface);
    let (q_doc, inputs_doc) = (
        format!("Generalized coordinates in this order: {}.", docs::order(&surface.coordinates)),
        format!("Inputs in this order: {}; NaN where not set.", docs::order(&surface.inputs)),
    );
    let accessors = offsets(&surface.coordinates).map(|(at, slot)| {
        let q = accessor(surface, slot, "", "q", at, &docs::coordinate(slot));
        let u = accessor(surface, slot, "_rate", "u", at, &docs::rate(slot));
        quote!(#q #u)
    });
    let inputs = offsets(&surface.inputs)
        .map(|(at, slot)| accessor(surface, slot, "", "inputs", at, &docs::input(slot)));
    let (implementation, modes) = (model_state(surface), modes(surface));
    let quiet = quiet();
    quote! {
        #[doc = #doc]
        #derive
        #[allow(dead_code, clippy::exhaustive_structs)]
        #vis struct #name {
            /// Time.
            #vis t: #private::f64,
            #[doc = #q_doc]
            #vis q: #private::SVector<#private::f64, #n>,
            /// Generalized velocities q̇, in the order of q.
            #vis u: #private::SVector<#private::f64, #n>,
            #[doc = #inputs_doc]
            #vis inputs: #private::SVector<#private::f64, #m>,
            /// Which switched constraints hold.
            #vis active_set: #private::ActiveSet,
            /// Which choices of the model are held by the step in progress: none, outside of one.
            #[doc(hidden)]
            #vis branches: #private::Branches,
        }
        #quiet
        impl #name {
            #(#accessors)*
            #(#inputs)*
            #modes
        }
        #implementation
    }
}

/// Whether switched constraints hold, by their names.
fn modes(surface: &Surface) -> TokenStream {
    let (vis, private, complete) = (&surface.vis, surface.private(), complete(surface));
    let (name, str) = (local("name"), quote!(#private::str));
    let result = |ty: TokenStream| quote!(#private::Result<#ty, #private::StateError>);
    let (changed, held) = (result(quote!(())), result(quote!(#private::bool)));
    let side = local("side");
    let found = at_name(surface, quote!(#complete::switched(#name)));
    quote! {
        /// Whether a switched constraint holds.
        ///
        /// # Errors
        /// Where no switched constraint has this name.
        #vis fn is_engaged(&self, #name: &'static #str) -> #held {
            #private::Ok(self.active_set.holds(#found?))
        }
        /// Lets a switched constraint hold. No velocity changes: where the state does not fulfil the
        /// constraint, the motion begins with an error.
        ///
        /// # Errors
        /// Where no switched constraint has this name.
        #vis fn engage(&mut self, #name: &'static #str) -> #changed {
            self.active_set.engage(#found?);
            #private::Ok(())
        }
        /// Releases a switched constraint, to the side of growing values: one that slips to the other side is
        /// refused where a motion starts, see [`Self::release_to`].
        ///
        /// # Errors
        /// Where no switched constraint has this name.
        #vis fn release(&mut self, #name: &'static #str) -> #changed {
            self.active_set.release(#found?, 1.0);
            #private::Ok(())
        }
        /// Releases a switched constraint to a side: that of growing values where `side` is not negative.
        ///
        /// # Errors
        /// Where no switched constraint has this name.
        #vis fn release_to(&mut self, #name: &'static #str, #side: #private::f64) -> #changed {
            self.active_set.release(#found?, #side);
            #private::Ok(())
        }
    }
}

/// `theta()` and `set_theta(value)`, with an index for arrays.
fn accessor(surface: &Surface, slot: &Slot, suffix: &str, field: &str, at: usize, doc: &str) -> TokenStream {
    let (vis, private) = (&surface.vis, surface.private());
    let name = if suffix.is_empty() { slot.name.clone() } else { format_ident!("{}{suffix}", slot.name) };
    let setter = format_ident!("set_{}", name);
    let setter_doc = format!("Sets `{}`.", super::plain(&name));
    let (field, this, value, i) = (format_ident!("{field}"), quote!(self), local("value"), local("i"));
    let Some(len) = slot.len else {
        return quote! {
            #[doc = #doc]
            #[inline]
            #[must_use]
            #vis fn #name(&#this) -> #private::f64 { #this.#field[#at] }
            #[doc = #setter_doc]
            #[inline]
            #vis fn #setter(&mut #this, #value: #private::f64) { #this.#field[#at] = #value; }
        };
    };
    let panics = format!("\n\n# Panics\nWhere `i` is not less than {len}.");
    let (doc, setter_doc) = (
        format!("{} Element `i`.{panics}", doc),
        format!("Sets element `i` of `{}`.{panics}", super::plain(&name)),
    );
    quote! {
        #[doc = #doc]
        #[inline]
        #[must_use]
        #vis fn #name(&#this, #i: #private::usize) -> #private::f64 {
            #private::assert!(#i < #len);
            #this.#field[#at + #i]
        }
        #[doc = #setter_doc]
        #[inline]
        #vis fn #setter(&mut #this, #i: #private::usize, #value: #private::f64) {
            #private::assert!(#i < #len);
            #this.#field[#at + #i] = #value;
        }
    }
}

fn model_state(surface: &Surface) -> TokenStream {
    let (name, private) = (surface.state_type(), surface.private());
    let (n, m) = (surface.degrees(), surface.input_count());
    let (f64, vector) = (quote!(#private::f64), quote!(#private::SVector));
    let (t, q, u, inputs) = (local("t"), local("q"), local("u"), local("inputs"));
    let branches = local("branches");
    quote! {
        #[automatically_derived]
        impl #private::ModelState for #name {
            type Vector = #vector<#f64, #n>;
            type Inputs = #vector<#f64, #m>;
            #[inline]
            fn new(#t: #f64, #q: Self::Vector, #u: Self::Vector, #inputs: Self::Inputs) -> Self {
                Self {
                    t: #t, q: #q, u: #u, inputs: #inputs,
                    active_set: #private::ActiveSet::ALL_HOLD, branches: #private::Branches::FREE
                }
            }
            #[inline]
            fn t(&self) -> #f64 { self.t }
            #[inline]
            fn q(&self) -> &Self::Vector { &self.q }
            #[inline]
            fn u(&self) -> &Self::Vector { &self.u }
            #[inline]
            fn inputs(&self) -> &Self::Inputs { &self.inputs }
            #[inline]
            fn q_mut(&mut self) -> &mut Self::Vector { &mut self.q }
            #[inline]
            fn u_mut(&mut self) -> &mut Self::Vector { &mut self.u }
            #[inline]
            fn inputs_mut(&mut self) -> &mut Self::Inputs { &mut self.inputs }
            #[inline]
            fn active_set(&self) -> #private::ActiveSet { self.active_set }
            #[inline]
            fn active_set_mut(&mut self) -> &mut #private::ActiveSet { &mut self.active_set }
            #[inline]
            fn hold(&mut self, #branches: #private::Branches) { self.branches = #branches; }
        }
    }
}
