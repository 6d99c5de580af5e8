//! What stands in for the traits of a model with errors, so that one mistake gives one error and not a
//! cascade of missing impls.

use proc_macro2::TokenStream;
use quote::quote;

use super::{Surface, only_one, quiet};

/// Stub impls of everything that [`traits`](super::traits) implements. They never run: the errors stop the
/// build.
pub(crate) fn fallback(surface: &Surface) -> TokenStream {
    let (model, private, quiet) = (&surface.target, surface.private(), quiet());
    let quantities = super::traits::named(surface, &super::traits::Names::default());
    let (vis, never) = (surface.impl_vis(), quote!(#private::unreachable!()));
    let f64 = quote!(#private::f64);
    let error = quote!(#private::SolveError);
    let (n, m) = (surface.degrees(), surface.input_count());
    let result = |value: &TokenStream| quote!(#private::Result<#value, #error>);
    let (matrix, to_vector) = (quote!(#private::SMatrix<#f64, #n, #n>), result(&quote!(Self::Vector)));
    let (unit, jacobian) = (result(&quote!(())), result(&quote!(#private::StateJacobian<Self>)));
    let (input, parameter) = (result(&quote!(Self::InputJacobian)), result(&quote!(Self::ParameterJacobian)));
    let names = quote!(&'static [#private::Quantity] = &[];);
    let only_one = only_one(surface);
    quote! {
        #only_one
        #quiet
        impl #model {
            #vis const REPORT: &'static #private::str = "";
            #vis const LISTING: &'static #private::str = "";
            #vis const EQUATIONS: &'static #private::str = "";
            #vis const LATEX: &'static #private::str = "";
        }
        #quiet
        const _: () = {
            impl #private::Dynamics for #model {
                type Constants = ();
                type Series = ();
                #quantities
                const CONSERVED: &'static [#private::ConservedQuantity] = &[];
                fn constants(&self) -> #private::Result<(), #private::SingularMassMatrix> { #never }
                fn accelerations_with(&self, _: &(), _: &Self::State) -> #to_vector { #never }
                fn mass_matrix(&self, _: &Self::State) -> #matrix { #never }
                fn generalized_force(&self, _: &Self::State) -> Self::Vector { #never }
                fn momenta(&self, _: &Self::State) -> Self::Vector { #never }
                fn energy_function(&self, _: &Self::State) -> #f64 { #never }
                fn conserved(&self, _: &Self::State, _: &mut [#f64]) { #never }
            }
            impl #private::Energies for #model {
                fn kinetic_energy(&self, _: &Self::State) -> #f64 { #never }
                fn potential_energy(&self, _: &Self::State) -> #f64 { #never }
            }
            impl #private::Linearize for #model {
                type InputJacobian = #private::SMatrix<#f64, #n, #m>;
                type ParameterJacobian = #private::SMatrix<#f64, #n, 0>;
                fn state_jacobian(&self, _: &Self::State) -> #jacobian { #never }
                fn input_jacobian(&self, _: &Self::State) -> #input { #never }
                fn parameter_jacobian(&self, _: &Self::State) -> #parameter { #never }
            }
            impl #private::Parameters for #model {
                fn set_parameter(&mut self, _: #private::usize, _: #f64) -> #private::bool { #never }
            }
            impl #private::Powers for #model {
                const POWERS: #names
                fn powers(&self, _: &Self::State, _: &mut [#f64]) { #never }
            }
            impl #private::Outputs for #model {
                const OUTPUTS: #names
                fn outputs(&self, _: &Self::State, _: &mut [#f64]) -> #unit { #never }
            }
            impl #private::Events for #model {
                const EVENTS: #names
                fn events(&self, _: &Self::State, _: &mut [#f64]) -> #unit { #never }
            }
            #private::unconstrained!(#model, #n);
            #private::if_alloc! {
                impl #private::Draw for #model {
                    fn draw(&self, _: &Self::Coordinates) -> #private::Drawing { #never }
                }
            }
        };
    }
}
