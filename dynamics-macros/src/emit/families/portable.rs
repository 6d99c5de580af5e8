//! `impl PortableFamily`: the loops in other languages.

use dynamics_symbolic::families::Source;
use proc_macro2::TokenStream;
use quote::quote;

use super::super::traits::quantities;
use super::super::{Surface, plain};
use super::field;
use crate::compile::CompiledFamilies;

/// `impl PortableFamily`.
pub(super) fn portable(surface: &Surface, compiled: &CompiledFamilies) -> TokenStream {
    let (model, private) = (&surface.target, surface.private());
    let families = quote!(#private::families);
    let (family, portability) = (&compiled.family, &compiled.portability);
    let (javascript, obstacles) = (&portability.javascript, &portability.obstacles);
    let (symbols, spatial, mathml) = (&portability.symbols, portability.spatial, &compiled.mathml);
    let scalars = family.model.parameters.iter().zip(&family.sources);
    let scalars = scalars.filter(|(_, source)| matches!(source, Source::Scalar(_)));
    let parameters = quantities(&private, scalars.map(|(p, _)| (p.name.as_str(), p.unit.as_str())));
    let values = &surface.parameters;
    let (counts, numbered) = (&family.counts, &family.numbered);
    let (count_fields, numbered_fields) =
        (counts.iter().map(|name| field(name)), numbered.iter().map(|name| field(name)));
    let shown = family
        .shown
        .iter()
        .filter(|shown| !shown.is_place)
        .flat_map(|shown| shown.suffixes.iter().map(move |suffix| (&shown.function, suffix)))
        .map(|(function, suffix)| format!("{}{suffix}", function.trim_start_matches("r#")));
    let functions = &surface.functions;
    let (names, count) = (functions.iter().map(plain), functions.len());
    let texts = quote!(&'static [&'static #private::str]);
    let (vec, f64, usize) = (quote!(#families::Vec), quote!(#private::f64), quote!(#private::usize));
    quote! {
        impl #families::PortableFamily for #model {
            const JAVASCRIPT: &'static #private::str = #javascript;
            const MATHML: &'static #private::str = #mathml;
            const SYMBOLS: #texts = &[#(#symbols),*];
            const NOT_PORTABLE: #texts = &[#(#obstacles),*];
            const SHOWN: #texts = &[#(#shown),*];
            const SPATIAL: #private::bool = #spatial;
            const PARAMETERS: &'static [#private::Quantity] = #parameters;
            const COUNTS: #texts = &[#(#counts),*];
            const NUMBERED: #texts = &[#(#numbered),*];
            const FUNCTIONS: #texts = &[#(#names),*];
            fn parameters(&self) -> #vec<#f64> {
                #vec::from([#(self #values),*])
            }
            fn counts(&self) -> #vec<#usize> {
                #vec::from([#(self.#count_fields),*])
            }
            fn numbered(&self) -> #vec<&[#f64]> {
                #vec::from([#(&self.#numbered_fields[..]),*])
            }
            fn smooth_functions(&self) -> #vec<&dyn #private::SmoothFunction> {
                let __functions: [&dyn #private::SmoothFunction; #count] = [#(&self.#functions),*];
                #vec::from(__functions)
            }
        }
    }
}
