//! `impl Portable`, `impl PrintedInC` and `impl PrintedInWgsl`: the programs in other languages.

use dynamics_symbolic::text::{InC, InWgsl};
use proc_macro2::TokenStream;
use quote::quote;

use super::super::{local, plain};
use super::Emission;

impl Emission<'_> {
    /// `impl Portable`.
    pub(super) fn portable(&self) -> TokenStream {
        let (model, private) = (&self.surface.target, &self.private);
        let portability = &self.compiled.portability;
        let (javascript, obstacles) = (&portability.javascript, &portability.obstacles);
        let (mathml, symbols) = (&self.compiled.mathml, &portability.symbols);
        let (spatial, has_kinks, has_energies) =
            (portability.spatial, portability.has_kinks, portability.has_energies);
        let functions = &self.surface.functions;
        let (names, count) = (functions.iter().map(plain), functions.len());
        let all = local("functions");
        let texts = quote!(&'static [&'static #private::str]);
        quote! {
            #private::if_alloc! {
                impl #private::Portable for #model {
                    const JAVASCRIPT: &'static #private::str = #javascript;
                    const MATHML: &'static #private::str = #mathml;
                    const SYMBOLS: #texts = &[#(#symbols),*];
                    const NOT_PORTABLE: #texts = &[#(#obstacles),*];
                    const SPATIAL: #private::bool = #spatial;
                    const HAS_KINKS: #private::bool = #has_kinks;
                    const HAS_ENERGIES: #private::bool = #has_energies;
                    const FUNCTIONS: #texts = &[#(#names),*];
                    fn smooth_functions(&self) -> #private::Vec<&dyn #private::SmoothFunction> {
                        let #all: [&dyn #private::SmoothFunction; #count] = [#(&self.#functions),*];
                        #private::Vec::from(#all)
                    }
                }
            }
        }
    }

    /// `impl PrintedInC`, where it was asked for.
    pub(super) fn printed_in_c(&self) -> TokenStream {
        if self.surface.targets.c.is_none() {
            return TokenStream::new();
        }
        let (model, private, accurate) = (&self.surface.target, &self.private, self.surface.accurate);
        let InC { name, header, support, programs, constants, kink_functions, directional, obstacles } =
            self.compiled.in_c();
        let kink_functions = kink_functions.iter().map(|function| match function {
            Some(function) => quote!(#private::Option::Some(#function)),
            None => quote!(#private::Option::None),
        });
        quote! {
            #private::if_alloc! {
                impl #private::PrintedInC for #model {
                    const C: #private::ProgramsInC = #private::ProgramsInC {
                        name: #name,
                        header: #header,
                        support: #support,
                        programs: #programs,
                        constants: #constants,
                        kink_functions: &[#(#kink_functions),*],
                        directional: #directional,
                        accurate: #accurate,
                        obstacles: &[#(#obstacles),*],
                    };
                }
            }
        }
    }

    /// `impl PrintedInWgsl`, where it was asked for.
    pub(super) fn printed_in_wgsl(&self) -> TokenStream {
        if self.surface.targets.wgsl.is_none() {
            return TokenStream::new();
        }
        let (model, private) = (&self.surface.target, &self.private);
        let InWgsl { programs, constants, obstacles } = self.compiled.in_wgsl();
        quote! {
            #private::if_alloc! {
                impl #private::PrintedInWgsl for #model {
                    const WGSL: #private::ProgramsInWgsl = #private::ProgramsInWgsl {
                        programs: #programs,
                        constants: #constants,
                        obstacles: &[#(#obstacles),*],
                    };
                }
            }
        }
    }
}
