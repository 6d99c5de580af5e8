//! Names, sizes, types and texts.

use dynamics_symbolic::check::units::Unit;
use dynamics_symbolic::compile::Compiled;
use proc_macro2::{Ident, Span, TokenStream};
use quote::quote;

use super::super::{Slot, Surface, local, plain, quiet};

/// Names and units of the scalars of a model.
#[derive(Default)]
pub(in super::super) struct Names {
    coordinates: Vec<(String, String)>,
    speeds: Vec<(String, String)>,
    inputs: Vec<(String, String)>,
    parameters: Vec<(String, String)>,
}

impl Names {
    /// As declared and inferred.
    pub(in super::super) fn of(model: &dynamics_symbolic::mechanics::Model) -> Self {
        Self {
            coordinates: model.coordinates.iter().map(|c| (c.name.clone(), c.unit.clone())).collect(),
            speeds: model.speeds.iter().map(|c| (c.name.clone(), c.unit.clone())).collect(),
            inputs: model.inputs.iter().map(|c| (c.name.clone(), c.unit.clone())).collect(),
            parameters: model.parameters.iter().map(|c| (c.name.clone(), c.unit.clone())).collect(),
        }
    }
}

/// A list of `Quantity`.
pub(in super::super) fn quantities<'a>(
    private: &TokenStream,
    named: impl Iterator<Item = (&'a str, &'a str)>,
) -> TokenStream {
    let items = named.map(|(name, unit)| {
        let dimension = dimension(private, unit);
        quote!(#private::Quantity { name: #name, unit: #unit, dimension: #dimension })
    });
    quote!(&[#(#items),*])
}

/// The `UnitDimension` of a unit.
fn dimension(private: &TokenStream, unit: &str) -> TokenStream {
    let kind = quote!(#private::UnitDimension);
    let parsed = Unit::parse(unit).ok().flatten();
    match parsed.and_then(|parsed| parsed.dimension.mechanical_exponents()) {
        Some(_) if unit == "rad" => quote!(#kind::Angle),
        Some([0, 0, 0]) | None => quote!(#kind::Other),
        Some([length, mass, time]) => {
            quote!(#kind::Mechanical { length: #length, mass: #mass, time: #time })
        }
    }
}

/// The names of a model's quantities, as constants of `impl Dynamics`.
pub(in super::super) fn named(surface: &Surface, names: &Names) -> TokenStream {
    let private = surface.private();
    let list = |named: &[(String, String)]| {
        quantities(&private, named.iter().map(|(n, u)| (n.as_str(), u.as_str())))
    };
    let (coordinates, inputs, parameters) =
        (list(&names.coordinates), list(&names.inputs), list(&names.parameters));
    let quantity_list = quote!(&'static [#private::Quantity]);
    // Most models have none, and the trait says so.
    let speeds = (!names.speeds.is_empty()).then(|| list(&names.speeds));
    let lengths = surface.speeds.iter().map(Slot::width);
    let speeds = speeds.map(|speeds| {
        quote! {
            const SPEEDS: #quantity_list = #speeds;
            const SPEED_LENGTHS: &'static [#private::usize] = &[#(#lengths),*];
        }
    });
    quote! {
        #speeds
        const COORDINATES: #quantity_list = #coordinates;
        const INPUTS: #quantity_list = #inputs;
        const PARAMETERS: #quantity_list = #parameters;
    }
}

/// The inherent constants with texts.
pub(super) fn texts(surface: &Surface, compiled: &Compiled) -> TokenStream {
    let (model, vis, private, quiet) = (&surface.target, surface.impl_vis(), surface.private(), quiet());
    let Compiled { report, listing, equations_text, latex, .. } = compiled;
    let shown =
        format!("The equations of motion as readable text:\n\n```text\n{}\n```", equations_text.trim_end());
    let at = surface.block.map_or_else(Span::call_site, |[keyword, _]| Span::call_site().located_at(keyword));
    let text = |name: &str, value: &str| -> TokenStream {
        let name = Ident::new(name, at);
        let constant = quote!(#vis const #name: &'static #private::str = #value;);
        let respanned = constant.into_iter().map(|mut tree| {
            tree.set_span(at);
            tree
        });
        respanned.collect()
    };
    let (report, listing) = (text("REPORT", report), text("LISTING", listing));
    let (equations, latex) = (text("EQUATIONS", equations_text), text("LATEX", latex));
    quote! {
        #quiet
        impl #model {
            /// What the model is: degrees of freedom, conserved quantities, structure, what was simplified,
            /// cost.
            #report
            /// The derived program as stable text with operation counts, for snapshot tests.
            #listing
            #[doc = #shown]
            #equations
            /// The equations of motion in LaTeX.
            #latex
        }
    }
}

/// `impl Draw`: the `#[drawing]` function, or the places that helper functions return.
pub(super) fn draw(surface: &Surface) -> TokenStream {
    let (model, private, q) = (&surface.target, surface.private(), local("coordinates"));
    let drawing = match &surface.drawing {
        Some(function) => quote!(self.#function(#q)),
        None if surface.points.is_empty() && !places(surface).is_empty() => {
            let places = places(surface);
            quote!(#private::Drawing::of_places(&[#(#places),*]))
        }
        None => {
            let points = surface.points.iter().map(|point| {
                let name = plain(point);
                quote!((#name, #private::Places::places(self.#point(#q))))
            });
            quote!(#private::Drawing::of_helpers(&[#(#points),*]))
        }
    };
    quote! {
        #private::if_alloc! {
            impl #private::Draw for #model {
                fn draw(&self, #q: &<Self as #private::Described>::Coordinates) -> #private::Drawing {
                    #drawing
                }
            }
        }
    }
}

/// Coordinates that are places by their names, `x` and `y`, `x1`, `y1` and `z1`, with their names as text;
/// lengths, or of no declared unit.
fn places(surface: &Surface) -> Vec<TokenStream> {
    let (private, q) = (surface.private(), local("coordinates"));
    let all = &surface.coordinates;
    let mut found = Vec::new();
    for x in all {
        let text = plain(&x.name);
        let Some(rest) = text.strip_prefix('x').filter(|_| matches!(x.unit.as_str(), "" | "m" | "ft")) else {
            continue;
        };
        let beside = |axis: &str| {
            all.iter()
                .find(|c| plain(&c.name) == format!("{axis}{rest}") && c.len == x.len && c.unit == x.unit)
        };
        let Some(y) = beside("y") else { continue };
        let axes: Vec<_> = [x, y].into_iter().chain(beside("z")).collect();
        let elements: Vec<Option<usize>> = x.len.map_or_else(|| vec![None], |n| (0..n).map(Some).collect());
        for i in elements {
            let names: Vec<String> = axes.iter().map(|a| element_name(&plain(&a.name), i)).collect();
            let name = names.join(", ");
            let values = axes.iter().map(|a| {
                let (field, index) = (&a.name, i.map(|i| quote!([#i])));
                quote!(#q.#field #index)
            });
            found.push(quote!((#name, #private::Point::from([#(#values),*]))));
        }
    }
    found
}

fn element_name(name: &str, index: Option<usize>) -> String {
    index.map_or_else(|| name.to_owned(), |i| format!("{name}[{i}]"))
}

#[cfg(test)]
mod tests {
    use super::{TokenStream, dimension, quote};

    #[test]
    fn dimensions_of_units() {
        let of = |unit| dimension(&TokenStream::new(), unit).to_string();
        let kind = |variant: TokenStream| quote!(::UnitDimension::#variant).to_string();
        assert_eq!(of("rad"), kind(quote!(Angle)));
        assert_eq!(of("kg*m^2"), kind(quote!(Mechanical { length: 2i8, mass: 1i8, time: 0i8 })));
        assert_eq!(of("m/s^2"), kind(quote!(Mechanical { length: 1i8, mass: 0i8, time: -2i8 })));
        for unit in ["", "1", "m/m", "rad^2", "V", "m^(1/2)"] {
            assert_eq!(of(unit), kind(quote!(Other)), "{unit}");
        }
    }
}
