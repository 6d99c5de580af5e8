//! The procedural macros of `dynamics`; use them through that crate.

mod compile;
mod diagnostics;
mod elaborate;
mod emit;
mod expand;
mod messages;
mod suggest;
mod syntax;

use proc_macro::TokenStream;

/// Declares a mechanical model: the struct's fields are its parameters, `#[coordinates(..)]` names its generalized coordinates.
#[proc_macro_derive(Dynamics, attributes(coordinates, inputs, units, nominal, model))]
pub fn derive_dynamics(item: TokenStream) -> TokenStream {
    expand::derive(item.into()).into()
}

/// Describes a model by the energies, forces and outputs in its impl block, and derives its equations of motion.
#[proc_macro_attribute]
pub fn dynamics(arguments: TokenStream, item: TokenStream) -> TokenStream {
    let here = proc_macro::Span::call_site();
    expand::attribute(arguments.into(), item.into(), [here.line(), here.column()]).into()
}

/// Where the struct's tokens and the impl's meet; called by generated code alone.
#[doc(hidden)]
#[proc_macro]
pub fn __model(input: TokenStream) -> TokenStream {
    expand::model(input.into()).into()
}

#[cfg(test)]
mod tests;
