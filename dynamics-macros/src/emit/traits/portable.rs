//! `impl Portable`: the programs in other languages.

use proc_macro2::TokenStream;
use quote::quote;

use super::super::plain;
use super::Emission;

impl Emission<'_> {
    /// `impl Portable`.
    pub(super) fn portable(&self) -> TokenStream {
        let (model, private) = (&self.surface.target, &self.private);
        let portability = &self.compiled.portability;
        let (javascript, obstacles) = (&portability.javascript, &portability.obstacles);
        let (mathml, symbols) = (&self.compiled.mathml, &portability.symbols);
        let functions = &self.surface.functions;
        let names = functions.iter().map(plain);
        let texts = quote!(&'static [&'static #private::str]);
        quote! {
            #private::if_alloc! {
                impl #private::Portable for #model {
                    const JAVASCRIPT: &'static #private::str = #javascript;
                    const MATHML: &'static #private::str = #mathml;
                    const SYMBOLS: #texts = &[#(#symbols),*];
                    const NOT_PORTABLE: #texts = &[#(#obstacles),*];
                    const FUNCTIONS: #texts = &[#(#names),*];
                    fn pieces(&self) -> #private::Vec<#private::Option<#private::Pieces>> {
                        #private::Vec::from([#(#private::SmoothFunction::pieces(&self.#functions)),*])
                    }
                }
            }
        }
    }
}
