//! `FamilyModel`: names and texts, and the passes over the model.

use dynamics_symbolic::families::{Anchor, Range};
use proc_macro2::TokenStream;
use quote::quote;

use super::super::traits::quantities;
use super::super::{Surface, only_one, plain, quiet};
use super::field;
use super::loops::Loops;
use super::portable::portable;
use crate::compile::CompiledFamilies;

/// Everything that is derived of a model with families.
pub(crate) fn family_traits(surface: &Surface, compiled: &CompiledFamilies) -> TokenStream {
    let (model, private, quiet) = (&surface.target, surface.private(), quiet());
    let (state, vis, only_one) = (surface.state_type(), surface.impl_vis(), only_one(surface));
    let families = quote!(#private::families);
    let (f64, str, usize) = (quote!(#private::f64), quote!(#private::str), quote!(#private::usize));
    let family = &compiled.family;
    let fields = family.fields.iter().map(|field| {
        let (name, unit) = (&field.name, &field.unit);
        let count = |anchor: Option<Anchor>| match anchor {
            Some(Anchor::End { count, plus }) => Some((family.counts[count as usize].as_str(), plus)),
            _ => None,
        };
        let length = match (count(field.length), count(field.columns)) {
            (Some((rows, more)), Some((columns, plus))) => quote! {
                #families::Length::Grid { rows: (#rows, #more), columns: (#columns, #plus) }
            },
            (Some((count, plus)), None) => quote!(#families::Length::Count { count: #count, plus: #plus }),
            _ => quote!(#families::Length::One),
        };
        quote!(#families::Field { name: #name, unit: #unit, length: #length })
    });
    let inputs = quantities(&private, family.model.inputs.iter().map(|i| (i.name.as_str(), i.unit.as_str())));
    let outputs = compiled.outputs.iter().map(|(name, unit, numbered)| {
        let name = plain(name);
        quote!(#families::OutputDeclaration { name: #name, unit: #unit, numbered: #numbered })
    });
    let values = compiled
        .outputs
        .iter()
        .enumerate()
        .map(|(k, (name, ..))| quote!(#k => #families::output_values(&self.#name(__q)),));
    let loops = Loops::new(surface, compiled);
    let (forces, energies, runs) = (loops.forces(), loops.energies(), loops.stiffness());
    let (row_pass, of_constraints) = (loops.row_pass(), loops.of_constraints());
    let matrix = |of| loops.entries(of);
    let (mass, stiffness, damping) = (
        matrix(&|element| &element.mass),
        matrix(&|element| &element.stiffness),
        matrix(&|element| &element.damping),
    );
    let (ends, coordinates, places) = (ends(surface, compiled), jets(surface), places(surface, compiled));
    let derived = &compiled.derived;
    let (conservative, velocity_forces, diagonal) =
        (derived.conservative, derived.velocity_forces, derived.diagonal);
    let symmetric = loops.is_symmetric();
    let operations = dynamics_symbolic::families::operations(family, derived);
    let (report, equations) = (&compiled.report, &compiled.equations);
    let name = surface.coordinates_type();
    let portable = portable(surface, compiled);
    quote! {
        #only_one
        #quiet
        impl #model {
            /// What the model is: families, elements, structure, conserved quantities, cost.
            #vis const REPORT: &'static #str = #report;
            /// The equations of motion, a row for every range of indices.
            #vis const EQUATIONS: &'static #str = #equations;
        }
        #quiet
        const _: () = {
            use #private::families::loops as __loops;
            // Whatever the user calls by these names.
            use #private::{f64, isize, usize};
            #forces
            #energies
            #runs
            #row_pass
            impl #families::FamilyModel for #model {
                type State = #state;
                const FIELDS: &'static [#families::Field] = &[#(#fields),*];
                const INPUTS: &'static [#private::Quantity] = #inputs;
                const OUTPUTS: &'static [#families::OutputDeclaration] = &[#(#outputs),*];
                const CONSERVATIVE: #private::bool = #conservative;
                const VELOCITY_FORCES: #private::bool = #velocity_forces;
                const DIAGONAL: #private::bool = #diagonal;
                const SYMMETRIC: #private::bool = #symmetric;
                const OPERATIONS: #usize = #operations;
                const REPORT: &'static #str = #report;
                const EQUATIONS: &'static #str = #equations;
                fn ends(&self) -> #private::Result<#families::Sizes, #families::SizeError> { #ends }
                const LOCAL: #private::bool = __LOCAL;
                fn forces(&self, __at: #families::View<'_>, __out: &mut [#f64]) {
                    self.forces_by(1, __at, __out);
                }
                fn scaled_forces(&self, __at: #families::View<'_>, __scale: &[#f64], __out: &mut [#f64]) {
                    self.scaled_forces_by(1, __at, __scale, __out);
                }
                fn kick(
                    &self, __t: #f64, __q: &[#f64], __w: &[#f64], __scale: &[#f64], __h: #f64,
                    __u: &mut [#f64],
                ) {
                    self.kick_by(1, [0, #usize::MAX], __t, [__q, __w, __scale], __h, __u);
                }
                fn forces_by(&self, __threads: #usize, __at: #families::View<'_>, __out: &mut [#f64]) {
                    __forces::<{ __loops::FORCES }>(
                        __threads, [0, isize::MAX], self, __at.t, [__at.q, __at.u, __at.inputs, &[]], 0.0,
                        __out,
                    );
                }
                fn scaled_forces_by(
                    &self, __threads: #usize, __at: #families::View<'_>, __scale: &[#f64],
                    __out: &mut [#f64],
                ) {
                    __forces::<{ __loops::SCALED }>(
                        __threads, [0, isize::MAX], self, __at.t, [__at.q, __at.u, __at.inputs, __scale],
                        0.0, __out,
                    );
                }
                fn kick_by(
                    &self, __threads: #usize, __nodes: [#usize; 2], __t: #f64,
                    [__q, __w, __scale]: [&[#f64]; 3], __h: #f64, __u: &mut [#f64],
                ) {
                    let __nodes = __nodes.map(|__node| isize::try_from(__node).unwrap_or(isize::MAX));
                    __forces::<{ __loops::KICK }>(
                        __threads, __nodes, self, __t, [__q, &[], __w, __scale], __h, __u,
                    );
                }
                fn energies(&self, __at: #families::View<'_>) -> #families::EnergyParts {
                    __loops::in_wide_vectors(__Energies {
                        model: self, t: __at.t, q: __at.q, u: __at.u, w: __at.inputs,
                    })
                }
                fn mass(&self, __add: &mut #families::Entries<'_>) {
                    let (__model, __t) = (self, 0.0);
                    let (__q, __u, __w): (&[#f64], &[#f64], &[#f64]) = (&[], &[], &[]);
                    #mass
                }
                fn stiffness(&self, __at: #families::View<'_>, __add: &mut #families::Entries<'_>) {
                    let (__model, __t, __q, __u, __w) = (self, __at.t, __at.q, __at.u, __at.inputs);
                    #stiffness
                }
                fn stiffness_runs(&self, __at: #families::View<'_>, __add: &mut #families::Runs<'_>) {
                    __loops::in_wide_vectors(__Stiffness {
                        model: self, t: __at.t, q: __at.q, u: __at.u, w: __at.inputs, add: __add,
                    });
                }
                fn damping(&self, __at: #families::View<'_>, __add: &mut #families::Entries<'_>) {
                    let (__model, __t, __q, __u, __w) = (self, __at.t, __at.q, __at.u, __at.inputs);
                    #damping
                }
                fn coordinates(
                    __state: &Self::State, __a: &[#f64], __multipliers: #families::Multipliers,
                ) -> #name {
                    #coordinates
                }
                fn output(&self, __index: #usize, __q: &#name) -> #families::Vec<#f64> {
                    match __index {
                        #(#values)*
                        _ => #families::Vec::new(),
                    }
                }
                #of_constraints
                #places
            }
            #portable
        };
    }
}

/// The body of `ends`.
fn ends(surface: &Surface, compiled: &CompiledFamilies) -> TokenStream {
    let private = surface.private();
    let families = quote!(#private::families);
    let family = &compiled.family;
    let counts = family.counts.iter().zip(&family.least).map(|(count, least)| {
        let (name, least) = (field(count), usize::try_from(*least).unwrap_or_default());
        quote!(__loops::check_count(#count, self.#name, #least)?;)
    });
    let anchor = |anchor: Anchor| match anchor {
        Anchor::Start(k) => {
            let k = k as isize;
            quote!(#k)
        }
        Anchor::End { count, plus } => {
            let (name, plus) = (field(&family.counts[count as usize]), plus as isize);
            quote!((self.#name as isize + #plus))
        }
    };
    // All reads of a parameter at once: an error names the last element that has to be there.
    let reads = family.numbered.iter().enumerate().map(|(parameter, text)| {
        let own = family.reads.iter().filter(|(read, _)| *read as usize == parameter);
        let (name, own) = (field(text), own.map(|(_, end)| anchor(*end)));
        quote!(__loops::check_length(#text, self.#name.len(), 0isize #(.max(#own))*)?;)
    });
    let lengths = family.fields.iter().map(|field| {
        let length = field.length.map_or_else(|| quote!(1isize), anchor);
        let (name, columns) = (&field.name, field.columns.map_or_else(|| quote!(1isize), anchor));
        quote!(__sizes.push(#name, __loops::length(#length), __loops::length(#columns))?;)
    });
    quote! {
        #(#counts)*
        #(#reads)*
        let mut __sizes = #families::Sizes::new();
        #(#lengths)*
        #private::Ok(__sizes)
    }
}

/// The body of `coordinates`.
fn jets(surface: &Surface) -> TokenStream {
    let private = surface.private();
    let families = quote!(#private::families);
    let name = surface.coordinates_type();
    let jet = quote!(#private::Expr::coordinate(__state.q()[__k], __state.u()[__k], __a[__k]));
    let fields = surface.coordinates.iter().enumerate().map(|(k, slot)| {
        let field = &slot.name;
        if slot.grid {
            quote! {
                #field: {
                    let (__nodes, __columns) = (__ends.range(#k), __ends.columns(#k));
                    let __rows = __nodes.clone().step_by(__columns.max(1));
                    __rows.map(|__row| (__row..__row + __columns).map(|__k| #jet).collect()).collect()
                },
            }
        } else if slot.family {
            quote!(#field: __ends.range(#k).map(|__k| #jet).collect(),)
        } else {
            quote!(#field: { let __k = __ends.range(#k).start; #jet },)
        }
    });
    let inputs = surface.inputs.iter().enumerate().map(|(k, slot)| {
        let field = &slot.name;
        quote!(#field: #private::Expr::input(__state.values.inputs[#k]),)
    });
    quote! {
        let __ends = #families::FamilyState::ends(__state);
        #name {
            #(#fields)* #(#inputs)* t: #private::Expr::time(__state.t()), __reactions: __multipliers,
        }
    }
}

/// `places`, where helpers say where nodes are.
fn places(surface: &Surface, compiled: &CompiledFamilies) -> TokenStream {
    if compiled.places.is_empty() {
        return TokenStream::new();
    }
    let private = surface.private();
    let families = quote!(#private::families);
    let name = surface.coordinates_type();
    let anchor = |anchor: Anchor| match anchor {
        Anchor::Start(k) => {
            let k = k as isize;
            quote!(#k)
        }
        Anchor::End { count, plus } => {
            let count = field(&compiled.family.counts[count as usize]);
            let plus = plus as isize;
            quote!((self.#count as isize + #plus))
        }
    };
    let ends = |range: &Range| (anchor(range.start), anchor(range.end));
    let lines = compiled.places.iter().map(|(function, ranges)| {
        let text = plain(function);
        let place = |arguments: TokenStream| quote!(__loops::Place::place(&self.#function(__q, #arguments)));
        let (points, columns) = match &ranges[..] {
            [rows, columns] => {
                let ((first, last), (start, end)) = (ends(rows), ends(columns));
                let place = place(quote!(__i as usize, __k as usize));
                (
                    quote!((#first..#last).flat_map(|__i| (#start..#end).map(move |__k| #place)).collect()),
                    quote!(#private::Option::Some(__loops::length(#end - #start))),
                )
            }
            nodes => {
                let all = nodes.first().map(ends).into_iter().map(|(start, end)| {
                    let place = place(quote!(__i as usize));
                    quote!((#start..#end).map(|__i| #place).collect())
                });
                (quote!(#(#all)*), quote!(#private::Option::None))
            }
        };
        quote!(#families::Places { function: #text, points: #points, columns: #columns })
    });
    quote! {
        fn places(&self, __q: &#name) -> #families::Vec<#families::Places> {
            #families::Vec::from([#(#lines),*])
        }
    }
}

/// What stands in for the trait of a model with errors.
pub(crate) fn family_fallback(surface: &Surface) -> TokenStream {
    let (model, private, quiet) = (&surface.target, surface.private(), quiet());
    let (vis, never, only_one) = (surface.impl_vis(), quote!(#private::unreachable!()), only_one(surface));
    let families = quote!(#private::families);
    let (f64, str) = (quote!(#private::f64), quote!(#private::str));
    let (state, name) = (surface.state_type(), surface.coordinates_type());
    quote! {
        #only_one
        #quiet
        impl #model {
            #vis const REPORT: &'static #str = "";
            #vis const EQUATIONS: &'static #str = "";
        }
        #quiet
        const _: () = {
            impl #families::FamilyModel for #model {
                type State = #state;
                const FIELDS: &'static [#families::Field] = &[];
                const INPUTS: &'static [#private::Quantity] = &[];
                const OUTPUTS: &'static [#families::OutputDeclaration] = &[];
                const CONSERVATIVE: #private::bool = false;
                const VELOCITY_FORCES: #private::bool = false;
                const DIAGONAL: #private::bool = false;
                const OPERATIONS: #private::usize = 0;
                const REPORT: &'static #str = "";
                const EQUATIONS: &'static #str = "";
                fn ends(&self) -> #private::Result<#families::Sizes, #families::SizeError> {
                    #never
                }
                fn forces(&self, _: #families::View<'_>, _: &mut [#f64]) { #never }
                fn scaled_forces(&self, _: #families::View<'_>, _: &[#f64], _: &mut [#f64]) { #never }
                fn kick(&self, _: #f64, _: &[#f64], _: &[#f64], _: &[#f64], _: #f64, _: &mut [#f64]) {
                    #never
                }
                fn energies(&self, _: #families::View<'_>) -> #families::EnergyParts { #never }
                fn mass(&self, _: &mut #families::Entries<'_>) { #never }
                fn stiffness(&self, _: #families::View<'_>, _: &mut #families::Entries<'_>) { #never }
                fn damping(&self, _: #families::View<'_>, _: &mut #families::Entries<'_>) { #never }
                fn coordinates(_: &Self::State, _: &[#f64], _: #families::Multipliers) -> #name { #never }
                fn output(&self, _: #private::usize, _: &#name) -> #families::Vec<#f64> { #never }
            }
            impl #families::PortableFamily for #model {
                const JAVASCRIPT: &'static #str = "";
                const MATHML: &'static #str = "";
                const SYMBOLS: &'static [&'static #str] = &[];
                const NOT_PORTABLE: &'static [&'static #str] = &[];
                const SHOWN: &'static [&'static #str] = &[];
                const SPATIAL: #private::bool = false;
                const PARAMETERS: &'static [#private::Quantity] = &[];
                const COUNTS: &'static [&'static #str] = &[];
                const NUMBERED: &'static [&'static #str] = &[];
                const FUNCTIONS: &'static [&'static #str] = &[];
                fn parameters(&self) -> #families::Vec<#f64> { #never }
                fn counts(&self) -> #families::Vec<#private::usize> { #never }
                fn numbered(&self) -> #families::Vec<&[#f64]> { #never }
                fn smooth_functions(&self) -> #families::Vec<&dyn #private::SmoothFunction> { #never }
            }
        };
    }
}
