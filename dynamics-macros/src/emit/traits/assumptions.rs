//! What is taken for granted of bodies and frames, for starts to ask.

use dynamics_symbolic::mechanics::AssumptionKind;
use proc_macro2::TokenStream;
use quote::quote;

use super::super::local;
use super::super::program::Printed;
use super::Emission;

impl Emission<'_> {
    /// `const ASSUMPTIONS` and `fn assumptions`, where there are some, and the functions it calls.
    pub(super) fn assumptions(&self) -> (TokenStream, TokenStream) {
        let (assumptions, private) = (&self.compiled.model.assumptions, &self.private);
        if assumptions.is_empty() {
            return (TokenStream::new(), TokenStream::new());
        }
        let Printed { functions, statements, results } = self.print(&self.compiled.programs.assumptions);
        let (at_state, prologue, visit, f64) =
            (self.at_state(), self.prologue(), local("visit"), self.float());
        let (mut listed, mut visits, mut rest) = (Vec::new(), Vec::new(), results.as_slice());
        for assumption in assumptions {
            let kind = match assumption.kind {
                AssumptionKind::Mass => quote!(Mass),
                AssumptionKind::Moment => quote!(Moment),
                AssumptionKind::Inertia => quote!(Inertia),
                AssumptionKind::Rotation => quote!(Rotation),
                AssumptionKind::Axis => quote!(Axis),
                AssumptionKind::Weld => quote!(Weld),
            };
            let (of, within, constant) = (&assumption.of, &assumption.within, assumption.constant);
            listed.push(quote! {
                #private::Assumption {
                    kind: #private::AssumptionKind::#kind,
                    of: &[#(#of),*], within: #within, constant: #constant
                }
            });
            let (values, further) = rest.split_at(assumption.nodes.len());
            visits.push(quote!(#visit(&[#(#values),*]);));
            rest = further;
        }
        let method = quote! {
            const ASSUMPTIONS: &'static [#private::Assumption] = &[#(#listed),*];
            #[inline(never)]
            fn assumptions(#at_state, #visit: &mut dyn #private::FnMut(&[#f64])) {
                #prologue #statements
                #(#visits)*
            }
        };
        (functions, method)
    }
}
