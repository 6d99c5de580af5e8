//! The builder of states: `model.state().theta1(2.0).build()?`.

use proc_macro2::TokenStream;
use quote::{format_ident, quote};

use super::{Slot, Surface, docs, local, offsets, plain, quiet};

/// `XStateBuilder` and `X::state()`.
pub(super) fn builder(surface: &Surface) -> TokenStream {
    let (name, vis, private) = (surface.builder_type(), &surface.vis, surface.private());
    let (model, state) = (&surface.name, surface.state_type());
    let derive = docs::derive(&private, &["Clone", "Copy", "Debug"]);
    let doc = format!("Assembles a [`{state}`] by name. What is not set is 0; an input that is not set is NaN.");
    let coordinates = offsets(&surface.coordinates).map(|(at, slot)| {
        let q = setter(surface, slot, "", "q", at, &docs::coordinate(slot));
        let u = setter(surface, slot, "_rate", "u", at, &docs::rate(slot));
        quote!(#q #u)
    });
    let inputs = offsets(&surface.inputs).map(|(at, slot)| setter(surface, slot, "", "inputs", at, &docs::input(slot)));
    let (constructor, build, quiet) = (constructor(surface), build(surface), quiet());
    quote! {
        #[doc = #doc]
        #derive
        #[allow(dead_code, clippy::exhaustive_structs)]
        #[must_use]
        #vis struct #name {
            state: #state,
        }
        #quiet
        impl #name {
            #(#coordinates)*
            #(#inputs)*
            #build
        }
        #quiet
        impl #model {
            #constructor
        }
    }
}

/// `.theta(value)`, the whole array for arrays.
fn setter(surface: &Surface, slot: &Slot, suffix: &str, field: &str, at: usize, doc: &str) -> TokenStream {
    let (vis, private) = (&surface.vis, surface.private());
    let name = if suffix.is_empty() { slot.name.clone() } else { format_ident!("{}{suffix}", slot.name) };
    let (field, value) = (format_ident!("{field}"), local("value"));
    let doc = format!("Sets `{}`. {doc}", plain(&name));
    let ty = slot.ty(&quote!(#private::f64));
    let assignments = match slot.len {
        None => quote!(self.state.#field[#at] = #value;),
        Some(n) => (0..n)
            .map(|i| {
                let to = at + i;
                quote!(self.state.#field[#to] = #value[#i];)
            })
            .collect(),
    };
    quote! {
        #[doc = #doc]
        #[inline]
        #vis fn #name(mut self, #value: #ty) -> Self {
            #assignments
            self
        }
    }
}

fn build(surface: &Surface) -> TokenStream {
    let (vis, private) = (&surface.vis, surface.private());
    let (model, state, t) = (&surface.name, surface.state_type(), local("t"));
    quote! {
        /// Sets the time, 0 where not set.
        #[inline]
        #vis fn at_time(mut self, #t: #private::f64) -> Self {
            self.state.t = #t;
            self
        }
        /// The state.
        ///
        /// # Errors
        /// Where a value is not finite.
        #vis fn build(self) -> #private::Result<#state, #private::StateError> {
            #private::StateError::check::<#model>(&self.state)?;
            #private::Ok(self.state)
        }
    }
}

fn constructor(surface: &Surface) -> TokenStream {
    let (vis, private) = (&surface.vis, surface.private());
    let (state, builder, m) = (surface.state_type(), surface.builder_type(), surface.input_count());
    let nan = vec![quote!(#private::f64::NAN); m];
    quote! {
        /// Starts a state of this model: at rest at t = 0 with all coordinates 0, and what is then set by name.
        #[inline]
        #vis fn state(&self) -> #builder {
            #builder {
                state: <#state as #private::ModelState>::new(
                    0.0,
                    #private::Vector::zeros(),
                    #private::Vector::zeros(),
                    #private::SVector::from_array_storage(#private::ArrayStorage([[#(#nan),*]])),
                ),
            }
        }
    }
}
