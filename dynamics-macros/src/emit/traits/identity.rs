//! Names, sizes, types and texts.

use dynamics_symbolic::compile::Compiled;
use proc_macro2::TokenStream;
use quote::quote;

use super::super::{Surface, local, plain, quiet};

/// Names and units of the scalars of a model.
#[derive(Default)]
pub(in super::super) struct Names {
    coordinates: Vec<(String, String)>,
    inputs: Vec<(String, String)>,
    parameters: Vec<(String, String)>,
}

impl Names {
    /// As declared and inferred.
    pub(in super::super) fn of(model: &dynamics_symbolic::mechanics::Model) -> Self {
        Self {
            coordinates: model.coordinates.iter().map(|c| (c.name.clone(), c.unit.clone())).collect(),
            inputs: model.inputs.iter().map(|c| (c.name.clone(), c.unit.clone())).collect(),
            parameters: model.parameters.iter().map(|c| (c.name.clone(), c.unit.clone())).collect(),
        }
    }
}

/// A list of `Quantity`.
pub(super) fn quantities<'a>(private: &TokenStream, named: impl Iterator<Item = (&'a str, &'a str)>) -> TokenStream {
    let items = named.map(|(name, unit)| quote!(#private::Quantity { name: #name, unit: #unit }));
    quote!(&[#(#items),*])
}

/// `impl Model`.
pub(in super::super) fn model(surface: &Surface, names: &Names) -> TokenStream {
    let (model, private, quiet) = (&surface.target, surface.private(), quiet());
    let (n, m, f64) = (surface.degrees(), surface.input_count(), quote!(#private::f64));
    let list = |named: &[(String, String)]| quantities(&private, named.iter().map(|(n, u)| (n.as_str(), u.as_str())));
    let (coordinates, inputs, parameters) = (list(&names.coordinates), list(&names.inputs), list(&names.parameters));
    let name = plain(&surface.name);
    let (state, accelerations) = (local("state"), local("accelerations"));
    let quantity_list = quote!(&'static [#private::Quantity]);
    quote! {
        #quiet
        #[automatically_derived]
        impl #private::Model for #model {
            type Vector = #private::SVector<#f64, #n>;
            type Matrix = #private::SMatrix<#f64, #n, #n>;
            type Inputs = #private::SVector<#f64, #m>;
            type State = <Self as #private::Declared>::State;
            type Coordinates = <Self as #private::Declared>::Coordinates;
            const NAME: &'static #private::str = #name;
            const COORDINATES: #quantity_list = #coordinates;
            const INPUTS: #quantity_list = #inputs;
            const PARAMETERS: #quantity_list = #parameters;
            #[inline]
            fn coordinates_with(#state: &Self::State, #accelerations: &Self::Vector) -> Self::Coordinates {
                <Self as #private::Declared>::coordinates_with(#state, #accelerations)
            }
        }
    }
}

/// The inherent constants with texts.
pub(super) fn texts(surface: &Surface, compiled: &Compiled) -> TokenStream {
    let (model, vis, private, quiet) = (&surface.target, surface.impl_vis(), surface.private(), quiet());
    let Compiled { report, listing, equations_text, latex, .. } = compiled;
    let shown = format!("The equations of motion as readable text:\n\n```text\n{}\n```", equations_text.trim_end());
    let text = quote!(&'static #private::str);
    quote! {
        #quiet
        impl #model {
            /// What the model is: degrees of freedom, conserved quantities, structure, what was simplified, cost.
            #vis const REPORT: #text = #report;
            /// The derived program as stable text with operation counts, for snapshot tests.
            #vis const LISTING: #text = #listing;
            #[doc = #shown]
            #vis const EQUATIONS: #text = #equations_text;
            /// The equations of motion in LaTeX.
            #vis const LATEX: #text = #latex;
        }
    }
}

/// `impl Draw`: the `#[drawing]` function, or the points that helper functions return.
pub(super) fn draw(surface: &Surface) -> TokenStream {
    let (model, private, q) = (&surface.target, surface.private(), local("coordinates"));
    let drawing = match &surface.drawing {
        Some(function) => quote!(self.#function(#q)),
        None => {
            let points = surface.points.iter().map(|point| {
                let name = plain(point);
                quote!((#name, #private::Point::from(self.#point(#q))))
            });
            quote!(#private::Drawing::of_points(&[#(#points),*]))
        }
    };
    quote! {
        #private::if_alloc! {
            impl #private::Draw for #model {
                fn draw(&self, #q: &<Self as #private::Model>::Coordinates) -> #private::Drawing { #drawing }
            }
        }
    }
}
