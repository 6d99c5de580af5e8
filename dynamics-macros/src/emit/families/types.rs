//! Coordinates, state and its builder, which need the struct alone.

use proc_macro2::TokenStream;
use quote::{format_ident, quote};
use syn::Ident;

use super::super::{Slot, Surface, coordinates, docs, local, plain, quiet};

/// The types that carry the names of a model with families.
pub(crate) fn family_types(surface: &Surface) -> TokenStream {
    let (coordinates, state, builder) = (coordinates(surface), state(surface), builder(surface));
    quote!(#coordinates #state #builder)
}

/// What follows a name in a sentence: ", node by node, in m".
fn described(slot: &Slot) -> String {
    let nodes = match (slot.family, slot.grid) {
        (_, true) => ", node by node, row after row",
        (true, _) => ", node by node",
        _ => "",
    };
    let unit = if slot.unit.is_empty() { String::new() } else { format!(", in {}", slot.unit) };
    format!("{nodes}{unit}")
}

/// The user's name, or that of the rate. A raw name is raw only where it stands alone.
fn name_of(slot: &Slot, suffix: &str) -> Ident {
    if suffix.is_empty() { slot.name.clone() } else { format_ident!("{}{suffix}", slot.name) }
}

fn coordinates(surface: &Surface) -> TokenStream {
    let (name, vis, private) = (surface.coordinates_type(), &surface.vis, surface.private());
    let documentation = coordinates::documentation(surface);
    let (model, text, quiet) = (&surface.name, plain(&surface.name), quiet());
    let derive = docs::derive(&private, &["Clone", "Debug"]);
    let field = |slot: &Slot| {
        let (field, doc) = (&slot.name, format!("`{}`{}.", slot.text(), described(slot)));
        let expr = quote!(#private::Expr);
        let vec = quote!(#private::families::Vec);
        let ty = match (slot.family, slot.grid) {
            (_, true) => quote!(#vec<#vec<#expr>>),
            (true, _) => quote!(#vec<#expr>),
            _ => expr,
        };
        quote!(#[doc = #doc] #vis #field: #ty,)
    };
    let fields: Vec<TokenStream> = surface.coordinates.iter().chain(&surface.inputs).map(field).collect();
    let doc = format!("Time jets of the coordinates of [`{text}`]: what its functions take as `q`.");
    let (f, t) = (local("F"), local("T"));
    quote! {
        #[doc = #doc]
        #derive
        #[allow(dead_code, clippy::exhaustive_structs)]
        #vis struct #name {
            #(#fields)*
            /// Time.
            #vis t: #private::Expr,
            __reactions: #private::families::Multipliers,
        }
        #quiet
        impl #name {
            /// The multipliers λ of a constraint, named by its function as in `q.reaction(Self::link)`, in
            /// the shape that the function returns: generalized forces that push toward growing values of the
            /// constraint. NaN where no solution is at hand, or where the function is no constraint.
            #[must_use]
            #vis fn reaction<#f, #t>(&self, _: #f) -> #t
            where
                #f: #private::Fn(&#model, &#name) -> #t + 'static,
                #t: #private::families::FamilyReaction,
            {
                self.__reactions.of::<#model, #f, #t>()
            }
        }
        #quiet
        #[automatically_derived]
        impl #private::Described for #model {
            type Coordinates = #name;
            const NAME: &'static #private::str = #text;
            #documentation
        }
    }
}

fn state(surface: &Surface) -> TokenStream {
    let (name, vis, private, quiet) = (surface.state_type(), &surface.vis, surface.private(), quiet());
    let derive = docs::derive(&private, &["Clone", "Debug", "PartialEq"]);
    let doc = docs::state(surface);
    let f64 = quote!(#private::f64);
    let values = quote!(#private::families::Vec<#f64>);
    let accessors = surface.coordinates.iter().enumerate().map(|(k, slot)| {
        let of = |suffix: &str, all: &str| {
            let (read, all) = (name_of(slot, suffix), format_ident!("{all}"));
            let what = if suffix.is_empty() { "" } else { "rate of " };
            let doc = format!("The {what}`{}`{}.", slot.text(), described(slot));
            if slot.family {
                let write = format_ident!("{}_mut", read);
                let write_doc = format!("The {what}`{}`, to be changed.", slot.text());
                let at = if slot.grid { node_of_grid(surface, slot, k, suffix, &all) } else { quote!() };
                return quote! {
                    #at
                    #[doc = #doc]
                    #[must_use]
                    #vis fn #read(&self) -> &[#f64] { &self.values.#all[self.values.range(#k)] }
                    #[doc = #write_doc]
                    #vis fn #write(&mut self) -> &mut [#f64] {
                        let range = self.values.range(#k);
                        &mut self.values.#all[range]
                    }
                };
            }
            let (write, value) = (format_ident!("set_{}", read), local("value"));
            let write_doc = format!("Sets the {what}`{}`.", slot.text());
            quote! {
                #[doc = #doc]
                #[must_use]
                #vis fn #read(&self) -> #f64 { self.values.#all[self.values.range(#k).start] }
                #[doc = #write_doc]
                #vis fn #write(&mut self, #value: #f64) {
                    let at = self.values.range(#k).start;
                    self.values.#all[at] = #value;
                }
            }
        };
        let (q, u) = (of("", "q"), of("_rate", "u"));
        quote!(#q #u)
    });
    let inputs = surface.inputs.iter().enumerate().map(|(k, slot)| {
        let (read, value, doc) = (&slot.name, local("value"), docs::input(slot));
        let (write, write_doc) = (format_ident!("set_{}", read), format!("Sets `{}`.", slot.text()));
        quote! {
            #[doc = #doc]
            #[must_use]
            #vis fn #read(&self) -> #f64 { self.values.inputs[#k] }
            #[doc = #write_doc]
            #vis fn #write(&mut self, #value: #f64) { self.values.inputs[#k] = #value; }
        }
    });
    quote! {
        #[doc = #doc]
        #derive
        #vis struct #name {
            values: #private::families::Values,
        }
        #quiet
        impl #name {
            /// Time.
            #[must_use]
            #vis fn t(&self) -> #f64 { self.values.t }
            /// All coordinates, in the order of the declaration.
            #[must_use]
            #vis fn q(&self) -> &[#f64] { &self.values.q }
            /// All velocities, in the order of the coordinates.
            #[must_use]
            #vis fn u(&self) -> &[#f64] { &self.values.u }
            #(#accessors)*
            #(#inputs)*
        }
        #quiet
        #[automatically_derived]
        impl #private::families::FamilyState for #name {
            fn new(
                t: #f64, q: #values, u: #values, inputs: #values, sizes: #private::families::Sizes,
            ) -> Self {
                Self { values: #private::families::Values { t, q, u, inputs, sizes } }
            }
            fn t(&self) -> #f64 { self.values.t }
            fn q(&self) -> &[#f64] { &self.values.q }
            fn u(&self) -> &[#f64] { &self.values.u }
            fn inputs(&self) -> &[#f64] { &self.values.inputs }
            fn ends(&self) -> &#private::families::Sizes { &self.values.sizes }
            fn parts_mut(&mut self) -> (&mut #f64, &mut [#f64], &mut [#f64], &mut [#f64]) {
                let values = &mut self.values;
                (&mut values.t, &mut values.q, &mut values.u, &mut values.inputs)
            }
        }
    }
}

/// `w_at` and `w_at_mut` of a grid.
fn node_of_grid(surface: &Surface, slot: &Slot, k: usize, suffix: &str, all: &Ident) -> TokenStream {
    let (vis, private, text) = (&surface.vis, surface.private(), slot.text());
    let (read, write) = (name_of(slot, &format!("{suffix}_at")), name_of(slot, &format!("{suffix}_at_mut")));
    let (f64, usize, option) = (quote!(#private::f64), quote!(#private::usize), quote!(#private::Option));
    let what = if suffix.is_empty() { "" } else { "rate of " };
    let doc = format!("The {what}`{text}[row][column]`; `None` where there is no such node.");
    let write_doc = format!("The {what}`{text}[row][column]`, to be changed; `None` likewise.");
    quote! {
        #[doc = #doc]
        #[must_use]
        #vis fn #read(&self, row: #usize, column: #usize) -> #option<#f64> {
            self.values.place(#k, row, column).map(|at| self.values.#all[at])
        }
        #[doc = #write_doc]
        #vis fn #write(&mut self, row: #usize, column: #usize) -> #option<&mut #f64> {
            self.values.place(#k, row, column).map(|at| &mut self.values.#all[at])
        }
    }
}

fn builder(surface: &Surface) -> TokenStream {
    let (name, vis, private, quiet) = (surface.builder_type(), &surface.vis, surface.private(), quiet());
    let (model, state, f64) = (&surface.name, surface.state_type(), quote!(#private::f64));
    let value = local("value");
    let setters = surface.coordinates.iter().enumerate().map(|(k, slot)| {
        let of = |suffix: &str, method: &str| {
            let (setter, method) = (name_of(slot, suffix), format_ident!("{method}"));
            let what = if suffix.is_empty() { "" } else { "the rate of " };
            let doc = format!("Sets {what}`{}`{}.", slot.text(), described(slot));
            let (ty, values) = if slot.family {
                (quote!(impl #private::families::IntoIterator<Item = #f64>), quote!(#value))
            } else {
                (f64.clone(), quote!([#value]))
            };
            quote! {
                #[doc = #doc]
                #vis fn #setter(mut self, #value: #ty) -> Self {
                    self.given.#method(#k, #values);
                    self
                }
            }
        };
        let (q, u) = (of("", "coordinates"), of("_rate", "velocities"));
        quote!(#q #u)
    });
    let inputs = surface.inputs.iter().enumerate().map(|(k, slot)| {
        let (setter, doc) = (&slot.name, format!("Sets `{}`. {}", slot.text(), docs::input(slot)));
        quote! {
            #[doc = #doc]
            #vis fn #setter(mut self, #value: #f64) -> Self {
                self.given.input(#k, #value);
                self
            }
        }
    });
    let doc = format!(
        "Assembles a [`{state}`] by name. What is not set is 0; an input that is not set is NaN. Families \
         take anything that iterates over numbers."
    );
    let (fields, count, text, f) =
        (surface.coordinates.len(), surface.inputs.len(), plain(&name), local("f"));
    quote! {
        #[doc = #doc]
        #[must_use]
        #vis struct #name<'m> {
            model: &'m #model,
            given: #private::families::GivenState,
        }
        impl #private::Debug for #name<'_> {
            fn fmt(&self, #f: &mut #private::fmt::Formatter<'_>) -> #private::fmt::Result {
                #f.debug_struct(#text).field("given", &self.given).finish_non_exhaustive()
            }
        }
        #quiet
        impl #name<'_> {
            #(#setters)*
            #(#inputs)*
            /// Sets the time, 0 where not set.
            #vis fn at_time(mut self, #value: #f64) -> Self {
                self.given.at_time(#value);
                self
            }
            /// The state as it was set.
            ///
            /// # Errors
            /// Where a count or a parameter's length does not suit the model, where a family got more or
            /// fewer values than it has nodes, or where a value is not finite.
            #vis fn build(self) -> #private::Result<#state, #private::families::FamilyStateError> {
                self.given.build(self.model)
            }
            /// The state as it was set, with positions and then velocities moved onto the constraints by the
            /// changes that are smallest by √Σ mᵢ xᵢ².
            ///
            /// # Errors
            /// As for `build`, and where no state on the constraints is found near this one.
            #vis fn assemble(self) -> #private::Result<#state, #private::families::FamilyStateError> {
                self.given.assemble(self.model)
            }
        }
        #quiet
        impl #model {
            /// Starts a state of this model: at rest at t = 0 with all coordinates 0, and what is then set by
            /// name.
            #vis fn state(&self) -> #name<'_> {
                #name { model: self, given: #private::families::GivenState::new(#fields, #count) }
            }
        }
    }
}
