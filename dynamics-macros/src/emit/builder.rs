//! The builder of states: `model.state().theta1(2.0).build()?`.

use proc_macro2::TokenStream;
use quote::{format_ident, quote};

use super::{Slot, Surface, at_name, complete, docs, local, offsets, plain, quiet};

/// `XStateBuilder` and `X::state()`.
pub(super) fn builder(surface: &Surface) -> TokenStream {
    let (name, vis, private) = (surface.builder_type(), &surface.vis, surface.private());
    let (model, state) = (&surface.name, surface.state_type());
    let derive = docs::derive(&private, &["Clone", "Copy"]);
    let doc =
        format!("Assembles a [`{state}`] by name. What is not set is 0; an input that is not set is NaN.");
    let coordinates = offsets(&surface.coordinates).map(|(at, slot)| {
        let q = setter(surface, slot, (at, ""), "q", Some(("given_q", true)), &docs::coordinate(slot));
        let guess = setter(surface, slot, (at, "_guess"), "q", Some(("given_q", false)), &docs::guess(slot));
        let u = setter(surface, slot, (at, "_rate"), "u", Some(("given_u", true)), &docs::rate(slot));
        quote!(#q #guess #u)
    });
    let inputs = offsets(&surface.inputs)
        .map(|(at, slot)| setter(surface, slot, (at, ""), "inputs", None, &docs::input(slot)));
    let speeds = offsets(&surface.speeds).map(|(at, slot)| speed(surface, slot, at));
    let (constructor, build, quiet) = (constructor(surface), build(surface), quiet());
    let count = surface.speed_count();
    let fields = (count > 0).then(|| {
        quote! {
            /// Generalized speeds, from which the velocities follow where some is given.
            speeds: [#private::f64; #count],
            by_speeds: #private::bool,
        }
    });
    let (n, bool, text, f) = (surface.degrees(), quote!(#private::bool), plain(&name), local("f"));
    quote! {
        #[doc = #doc]
        #derive
        #[allow(dead_code, clippy::exhaustive_structs)]
        #[must_use]
        #vis struct #name<'m> {
            model: &'m #model,
            state: #state,
            /// What must not be changed where the rest is assembled.
            given_q: [#bool; #n],
            given_u: [#bool; #n],
            #fields
            /// Released constraints whose side was given, by bits.
            sided: #private::u32,
            /// The first name that is no switched constraint.
            error: #private::Option<#private::StateError>,
        }
        // Models need not be `Debug`.
        impl #private::Debug for #name<'_> {
            fn fmt(&self, #f: &mut #private::fmt::Formatter<'_>) -> #private::fmt::Result {
                #f.debug_struct(#text).field("state", &self.state).finish_non_exhaustive()
            }
        }
        #quiet
        impl #name<'_> {
            #(#coordinates)*
            #(#inputs)*
            #(#speeds)*
            #build
        }
        #quiet
        impl #model {
            #constructor
        }
    }
}

/// `.theta(value)`, the whole array for arrays; `given`: the flags that say what must not be changed, and
/// whether it is given by this.
fn setter(
    surface: &Surface,
    slot: &Slot,
    (at, suffix): (usize, &str),
    field: &str,
    given: Option<(&str, bool)>,
    doc: &str,
) -> TokenStream {
    let (vis, private) = (&surface.vis, surface.private());
    let name = if suffix.is_empty() { slot.name.clone() } else { format_ident!("{}{suffix}", slot.name) };
    let (field, value) = (format_ident!("{field}"), local("value"));
    let doc = match suffix {
        "_guess" => doc.to_owned(),
        _ => format!("Sets `{}`. {doc}", plain(&name)),
    };
    let ty = slot.ty(&quote!(#private::f64));
    let assignments = (0..slot.width()).map(|i| {
        let to = at + i;
        let element = slot.len.map_or_else(|| quote!(#value), |_| quote!(#value[#i]));
        let given = given.map(|(flags, given)| {
            let flags = format_ident!("{flags}");
            quote!(self.#flags[#to] = #given;)
        });
        quote!(self.state.#field[#to] = #element; #given)
    });
    quote! {
        #[doc = #doc]
        #[inline]
        #vis fn #name(mut self, #value: #ty) -> Self {
            #(#assignments)*
            self
        }
    }
}

/// `.w(value)` of a generalized speed.
fn speed(surface: &Surface, slot: &Slot, at: usize) -> TokenStream {
    let (vis, private, name, value) = (&surface.vis, surface.private(), &slot.name, local("value"));
    let (ty, doc) = (slot.ty(&quote!(#private::f64)), docs::speed(slot));
    let assignments = (0..slot.width()).map(|i| {
        let (to, element) = (at + i, slot.len.map_or_else(|| quote!(#value), |_| quote!(#value[#i])));
        quote!(self.speeds[#to] = #element;)
    });
    quote! {
        #[doc = #doc]
        #[inline]
        #vis fn #name(mut self, #value: #ty) -> Self {
            #(#assignments)*
            self.by_speeds = true;
            self
        }
    }
}

fn build(surface: &Surface) -> TokenStream {
    let (vis, private) = (&surface.vis, surface.private());
    let (complete, state, t, error) = (complete(surface), surface.state_type(), local("t"), local("error"));
    let result = quote!(#private::Result<#state, #private::StateError>);
    let released = released(surface);
    let built = at_name(surface, quote!(#complete::built(self.model, self.state, self.sided)));
    let given = quote!([&self.given_q, &self.given_u]);
    let assembled =
        at_name(surface, quote!(#complete::assembled(self.model, self.state, #given, self.sided)));
    let by_speeds = |assembled: bool| {
        let given = quote!([&self.given_q, &self.given_u]);
        let moved = at_name(
            surface,
            quote!(#complete::moved(self.model, self.state, #given, &self.speeds, #assembled, self.sided)),
        );
        (!surface.speeds.is_empty()).then(|| quote!(if self.by_speeds { return #moved; }))
    };
    let (built_by_speeds, assembled_by_speeds) = (by_speeds(false), by_speeds(true));
    let check_names = quote! {
        if let #private::Option::Some(#error) = self.error {
            return #private::Err(#error);
        }
    };
    quote! {
        /// Sets the time, 0 where not set.
        #[inline]
        #vis fn at_time(mut self, #t: #private::f64) -> Self {
            self.state.t = #t;
            self
        }
        #released
        /// The state as it was set.
        ///
        /// # Errors
        /// Where a value is not finite, or where the state does not fulfil a constraint: with its name, its
        /// value and how far away it is fulfilled.
        #vis fn build(self) -> #result {
            #check_names
            #built_by_speeds
            #built
        }
        /// The state completed: what was set stays, positions that were not set are solved from their guesses
        /// (0 where there is none), then velocities that were not set, so that all constraints are fulfilled.
        ///
        /// # Errors
        /// Where a value is not finite, or where the constraints cannot be fulfilled: with the one that is
        /// missed, and by how much.
        #vis fn assemble(self) -> #result {
            #check_names
            #assembled_by_speeds
            #assembled
        }
    }
}

/// `.release(name)` and `.release_to(name, side)`.
fn released(surface: &Surface) -> TokenStream {
    let (vis, private, complete) = (&surface.vis, surface.private(), complete(surface));
    let (name, side, index, error) = (local("name"), local("side"), local("index"), local("error"));
    let found = at_name(surface, quote!(#complete::switched(#name)));
    quote! {
        /// Releases a switched constraint: the state need not fulfil it. A nonholonomic one of one row is
        /// released to the side to which the velocities slip, at rest to the side to which it is pushed;
        /// others, and what is not pushed, to that of growing values. That no switched constraint has this
        /// name is said by [`Self::build`] and [`Self::assemble`].
        #vis fn release(mut self, #name: &'static #private::str) -> Self {
            match #found {
                #private::Ok(#index) => {
                    self.state.active_set.release(#index, 1.0);
                    self.sided &= !(1 << #index);
                }
                #private::Err(#error) => self.error = self.error.or(#private::Option::Some(#error)),
            }
            self
        }
        /// Releases a switched constraint to a side: that of growing values where `side` is not negative.
        /// [`Self::build`] and [`Self::assemble`] refuse a side to which a nonholonomic constraint of one row
        /// does not slip.
        #vis fn release_to(mut self, #name: &'static #private::str, #side: #private::f64) -> Self {
            match #found {
                #private::Ok(#index) => {
                    self.state.active_set.release(#index, #side);
                    self.sided |= 1 << #index;
                }
                #private::Err(#error) => self.error = self.error.or(#private::Option::Some(#error)),
            }
            self
        }
    }
}

fn constructor(surface: &Surface) -> TokenStream {
    let (vis, private) = (&surface.vis, surface.private());
    let (state, builder, m, n) =
        (surface.state_type(), surface.builder_type(), surface.input_count(), surface.degrees());
    let count = surface.speed_count();
    let speeds = (count > 0).then(|| quote!(speeds: [0.0; #count], by_speeds: false,));
    let nan = vec![quote!(#private::f64::NAN); m];
    quote! {
        /// Starts a state of this model: at rest at t = 0 with all coordinates 0, and what is then set by
        /// name.
        #[inline]
        #vis fn state(&self) -> #builder<'_> {
            #builder {
                model: self,
                state: <#state as #private::ModelState>::new(
                    0.0,
                    #private::Vector::zeros(),
                    #private::Vector::zeros(),
                    #private::SVector::from_array_storage(#private::ArrayStorage([[#(#nan),*]])),
                ),
                given_q: [false; #n],
                given_u: [false; #n],
                #speeds
                sided: 0,
                error: #private::Option::None,
            }
        }
    }
}
