//! What is taken for granted of bodies and frames, for starts to ask.

use dynamics_symbolic::mechanics::Claim;
use proc_macro2::TokenStream;
use quote::quote;

use super::super::local;
use super::super::program::Printed;
use super::Emission;

impl Emission<'_> {
    /// `const PREMISES` and `fn premises`, where there are some, and the functions it calls.
    pub(super) fn premises(&self) -> (TokenStream, TokenStream) {
        let (premises, private) = (&self.compiled.model.premises, &self.private);
        if premises.is_empty() {
            return (TokenStream::new(), TokenStream::new());
        }
        let Printed { functions, statements, results } = self.print(&self.compiled.programs.premises);
        let (at_state, prologue, visit, f64) =
            (self.at_state(), self.prologue(), local("visit"), self.float());
        let (mut listed, mut visits, mut rest) = (Vec::new(), Vec::new(), results.as_slice());
        for premise in premises {
            let claim = match premise.claim {
                Claim::Mass => quote!(Mass),
                Claim::Moment => quote!(Moment),
                Claim::Inertia => quote!(Inertia),
                Claim::Rotation => quote!(Rotation),
                Claim::Axis => quote!(Axis),
                Claim::Weld => quote!(Weld),
            };
            let (of, within, constant) = (&premise.of, &premise.within, premise.constant);
            listed.push(quote! {
                #private::Premise {
                    claim: #private::Claim::#claim,
                    of: &[#(#of),*], within: #within, constant: #constant
                }
            });
            let (values, further) = rest.split_at(premise.nodes.len());
            visits.push(quote!(#visit(&[#(#values),*]);));
            rest = further;
        }
        let method = quote! {
            const PREMISES: &'static [#private::Premise] = &[#(#listed),*];
            #[inline(never)]
            fn premises(#at_state, #visit: &mut dyn #private::FnMut(&[#f64])) {
                #prologue #statements
                #(#visits)*
            }
        };
        (functions, method)
    }
}
