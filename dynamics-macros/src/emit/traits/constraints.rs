//! `impl Constraints`.

use proc_macro2::TokenStream;
use quote::quote;

use super::Emission;

impl Emission<'_> {
    /// `impl Constraints`; a model without any says so.
    pub(super) fn constraints(&self) -> TokenStream {
        let (model, private, n) = (&self.surface.target, &self.private, self.degrees());
        quote!(#private::unconstrained!(#model, #n);)
    }
}
