//! Taylor coefficients of motions: part of `impl Dynamics`.

use dynamics_symbolic::series::{Series, Unexpandable};
use proc_macro2::TokenStream;
use quote::quote;

use super::super::local;
use super::super::program::{Access, Body, WIDTH};
use super::Emission;

impl Emission<'_> {
    /// `const SERIES` and `fn series`.
    pub(super) fn series(&self) -> TokenStream {
        let private = &self.private;
        match &self.compiled.programs.series {
            Ok(series) => self.expanding(series),
            Err(reason) => {
                let reason = self.no_series(*reason);
                quote! {
                    const SERIES: #private::Expansion = #private::Expansion::None { reason: #reason };
                }
            }
        }
    }

    fn no_series(&self, reason: Unexpandable) -> String {
        match reason {
            Unexpandable::Constrained => "it has constraints".to_owned(),
            Unexpandable::Singular(_) => "its mass matrix is singular".to_owned(),
            Unexpandable::TooLarge(operations) => format!("each coefficient takes {operations} operations"),
            Unexpandable::Smooth(function) => {
                let function = self.compiled.model.functions.get(function.0 as usize);
                let name = function.map_or("a function", |f| &f.name);
                format!("`{name}` is known by its value and three derivatives only")
            }
        }
    }

    fn expanding(&self, series: &Series) -> TokenStream {
        let (private, f64, state) = (&self.private, self.float(), local("state"));
        let (chooses, n, lanes) = (series.chooses, self.degrees(), series.lanes);
        let start = self.body(&[]).whole(&series.start);
        let (kept, count) = (&start.results, start.results.len());
        let access = Access::of_coefficients(self.private.clone(), &series.graph, count);
        // The signature of parts never matters: the program is one function.
        let next =
            Body { access: &access, surface: self.surface, constants: &[], constraints: None }.whole(&series.next);
        let (coefficients, factors) = next.results.split_at(n);
        let (left, right) = factors.split_at(lanes);
        let blocks = lanes.div_ceil(WIDTH);
        let [left, right] = [left, right].map(|factors| in_blocks(factors, &quote!(0.0)));
        let (t, q, u, w, a, z) = (local("t"), local("q"), local("u"), local("w"), local("a"), local("z"));
        let (lambda, scale) = (local("lambda"), local("scale"));
        let (rows_q, rows_u) = (local("rows_of_q"), local("rows_of_u"));
        let (before, of_start, after, of_next) =
            (&start.functions, &start.statements, &next.functions, &next.statements);
        let prologue = self.prologue();
        quote! {
            const SERIES: #private::Expansion = #private::Expansion::Generated { chooses: #chooses };
            #[inline]
            fn series(
                &self,
                #state: &<Self as Model>::State,
                #a: &<Self as Model>::Vector,
                #scale: #f64,
                #rows_q: &mut [<Self as Model>::Vector],
                #rows_u: &mut [<Self as Model>::Vector],
            ) {
                #before #after
                #prologue
                let #a = &#a.data.0[0];
                #of_start
                let #z: [#f64; #count] = [#(#kept),*];
                #private::expand::<#n, #blocks>(#a, #scale, #rows_q, #rows_u, |#t, #q, #u, #w, #lambda| {
                    #of_next
                    ([#(#coefficients),*], #left, #right)
                })
            }
        }
    }
}

/// An array of arrays of [`WIDTH`], the last one filled up.
fn in_blocks(values: &[TokenStream], filler: &TokenStream) -> TokenStream {
    let blocks = values.chunks(WIDTH).map(|block| {
        let values = block.iter().chain(core::iter::repeat_n(filler, WIDTH - block.len()));
        quote!([#(#values),*])
    });
    quote!([#(#blocks),*])
}
