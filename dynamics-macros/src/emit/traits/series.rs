//! Taylor coefficients of motions: part of `impl Dynamics`.

use dynamics_symbolic::schedule::Program;
use dynamics_symbolic::series::{ConstrainedSeries, Series};
use dynamics_symbolic::text::unexpandable;
use proc_macro2::TokenStream;
use quote::quote;

use super::super::local;
use super::super::program::{Access, Body, LANES_OF_BLOCK, Printed};
use super::Emission;
use super::solves::{Solved, Staged};

impl Emission<'_> {
    /// `const SERIES` and `fn series`.
    pub(super) fn series(&self, staged: &Staged) -> TokenStream {
        let private = &self.private;
        match &self.compiled.programs.series {
            Ok(series) => match &series.constrained {
                None => self.expanding(series, staged),
                Some(constrained) => self.expanding_constrained(series, constrained),
            },
            Err(reason) => {
                let reason = unexpandable(&self.compiled.model, *reason);
                quote! {
                    const SERIES: #private::Expansion = #private::Expansion::None { reason: #reason };
                    type Series = ();
                }
            }
        }
    }

    fn expanding(&self, series: &Series, staged: &Staged) -> TokenStream {
        let private = &self.private;
        let (chooses, n, lanes) = (series.chooses, self.degrees(), series.lanes);
        let count = series.start.results.len();
        let begin = self.beginning(series, staged);
        let access = Access::of_coefficients(self.surface, &series.graph, count);
        let next = self.coefficients(&access, &series.next);
        let (coefficients, factors) = next.results.split_at(n);
        let (left, right) = factors.split_at(lanes);
        let blocks = lanes.div_ceil(LANES_OF_BLOCK);
        let [left, right] = [left, right].map(|factors| in_blocks(factors, &quote!(0.0)));
        let (t, q, u, w, z, k, state) =
            (local("t"), local("q"), local("u"), local("w"), local("z"), local("k"), local("state"));
        let (lambda, scale, rows, memory) = (local("lambda"), local("scale"), local("rows"), local("memory"));
        let (head, given) = (self.series_head(), local("accelerations"));
        let Printed { functions, statements, .. } = &next;
        quote! {
            const SERIES: #private::Expansion = #private::Expansion::Generated { chooses: #chooses };
            type Series = #private::series::Memory<<Self as #private::Model>::State, #count, #blocks>;
            #begin
            #head {
                #functions
                if !#private::series::Memory::<<Self as #private::Model>::State, #count, #blocks>::begins_at(
                    #memory, #state
                ) && #private::Dynamics::begin_series(self, #k, #state, #memory).is_err()
                {
                    return false;
                }
                let (#z, #memory) =
                    #private::series::Memory::<<Self as #private::Model>::State, #count, #blocks>::parts(
                        #memory
                    );
                // A copy stays in registers: nothing that is written can change it.
                let #z = *#z;
                #private::expand::<#n, #blocks>(
                    &#given.data.0[0], #scale, #rows, #memory,
                    |#t, #q, #u, #w, #lambda| {
                        #statements
                        ([#(#coefficients),*], #left, #right)
                    }
                );
                true
            }
        }
    }

    /// `fn begin_series`: accelerations, and what series need of order 0.
    fn beginning(&self, series: &Series, staged: &Staged) -> TokenStream {
        let Some(begin) = &series.begin else { return TokenStream::new() };
        let (kept, private) = (begin.results.len() - series.start.results.len(), &self.private);
        let (count, blocks) = (series.start.results.len(), series.lanes.div_ceil(LANES_OF_BLOCK));
        let Solved { functions, statements, check, vector, more } =
            self.solved(staged, begin, &begin.results[kept..]);
        let (k, state, memory, prologue) = (local("k"), local("state"), local("memory"), self.prologue());
        let inlining = self.inlining(begin.body.len());
        quote! {
            #inlining
            fn begin_series(
                &self,
                #k: &Self::Constants,
                #state: &<Self as #private::Model>::State,
                #memory: &mut Self::Series,
            ) -> #private::Result<<Self as #private::Model>::Vector, #private::SolveError> {
                #functions #prologue #statements #check
                // By path: where the impl stands twice, methods of the type would be errors of their own.
                #private::series::Memory::<<Self as #private::Model>::State, #count, #blocks>::begin(
                    #memory, *#state, [#(#more),*]
                );
                #private::Ok(#vector)
            }
        }
    }

    /// `fn series(&self, ..) -> bool`.
    fn series_head(&self) -> TokenStream {
        let (private, f64, k, state) = (&self.private, self.float(), local("k"), local("state"));
        let (given, scale) = (local("accelerations"), local("scale"));
        let (rows, memory) = (local("rows"), local("memory"));
        quote! {
            #[inline]
            fn series(
                &self,
                #k: &Self::Constants,
                #state: &<Self as #private::Model>::State,
                #given: &<Self as #private::Model>::Vector,
                #scale: #f64,
                #rows: [&mut [<Self as #private::Model>::Vector]; 2],
                #memory: &mut Self::Series,
            ) -> #private::bool
        }
    }

    /// A program of one order. The signature of parts never matters: it is one function.
    fn coefficients(&self, access: &Access<'_>, program: &Program) -> Printed {
        Body { access, surface: self.surface, constants: &[], constraints: None, seldom: false, fuses: true }
            .whole(program)
    }

    fn expanding_constrained(&self, series: &Series, constrained: &ConstrainedSeries) -> TokenStream {
        let (private, chooses, head, prologue) =
            (&self.private, series.chooses, self.series_head(), self.prologue());
        let (n, rows, lanes) = (self.degrees(), self.rows(), series.lanes);
        let Printed { statements: of_start, results, .. } = self.body(&[]).whole(&series.start);
        let guards = constrained.solve.as_ref().map_or(&[][..], |solve| &solve.guards);
        let (kept, guarded) = results.split_at(results.len() - 2 * guards.len());
        let count = kept.len();
        let unguarded = self.unguarded(guards, guarded);
        let of_motion = Access::of_coefficients(self.surface, &series.graph, count);
        let of_places = Access::of_coefficients(self.surface, &constrained.graph, count);
        let closures = Closures { emission: self, n, rows, shared: constrained.shared };
        let residue = closures.residue(&self.coefficients(&of_places, &constrained.residue));
        let right = closures.right(&self.coefficients(&of_motion, &constrained.right));
        let solve = constrained.solve.as_ref().map(|solve| self.coefficients(&of_motion, &solve.program));
        let solve = closures.solve(solve.as_ref());
        let next = closures.next(&self.coefficients(&of_motion, &series.next), lanes);
        let ahead = closures.ahead(&self.coefficients(&of_places, &constrained.ahead), constrained.lanes);
        let (k, state, a, z, scale) = (local("k"), local("state"), local("a"), local("z"), local("scale"));
        let (lambda, general, solved) = (local("lambda"), local("general"), local("solved"));
        let given = local("accelerations");
        let (coefficients, memory, f64, all) = (local("rows"), local("memory"), self.float(), n + rows);
        let (blocks, ahead_blocks, shared) =
            (lanes.div_ceil(LANES_OF_BLOCK), constrained.lanes.div_ceil(LANES_OF_BLOCK), constrained.shared);
        let (some, none, recurrences) = (self.some(), self.none(), local("recurrences"));
        let released = (self.switched() > 0).then(|| quote!(|| !#state.active_set.all_hold()));
        let applies_not = match (&constrained.solve, unguarded) {
            (None, _) => quote!(true),
            (Some(_), Some(unguarded)) => quote!((#unguarded) #released),
            (Some(_), None) => quote!(false #released),
        };
        quote! {
            const SERIES: #private::Expansion = #private::Expansion::Generated { chooses: #chooses };
            type Series = #private::series::ConstrainedMemory<#blocks, #ahead_blocks, #shared>;
            #head {
                #prologue
                let #some(#solved) = #private::series::multipliers(self, #k, #state) else { return false };
                let (#a, #lambda) = (&#given.data.0[0], &#solved.data.0[0]);
                #of_start
                let #z: [#f64; #count] = [#(#kept),*];
                let #general = if #applies_not {
                    match #private::series::Equations::<#all>::new::<Self, #n, #rows>(self, #state) {
                        #none => return false,
                        #general => #general,
                    }
                } else {
                    #none
                };
                let #general = &#general;
                let #recurrences = #private::series::Recurrences {
                    residue: #residue,
                    right: #right,
                    solve: #solve,
                    next: #next,
                    ahead: #ahead,
                };
                #private::expand_constrained(#a, #scale, #coefficients, #memory, #recurrences);
                true
            }
        }
    }
}

/// What [`Recurrences`](dynamics_symbolic::series::ConstrainedSeries) are called with.
struct Closures<'a> {
    emission: &'a Emission<'a>,
    n: usize,
    rows: usize,
    shared: usize,
}

impl Closures<'_> {
    /// A closure with the names by which programs read what they get: `(name, type)`.
    fn closure(
        &self,
        arguments: &[(&str, TokenStream)],
        printed: &Printed,
        value: &TokenStream,
    ) -> TokenStream {
        let names = arguments.iter().map(|(name, _)| local(name));
        let types = arguments.iter().map(|(_, of)| of);
        let statements = &printed.statements;
        quote!(|#(#names: #types),*| { #statements #value })
    }

    fn array(&self, length: usize) -> TokenStream {
        let f64 = self.emission.float();
        quote!(&[#f64; #length])
    }

    fn blocks(&self) -> TokenStream {
        let f64 = self.emission.float();
        quote!(&[[#f64; #LANES_OF_BLOCK]; _])
    }

    fn residue(&self, printed: &Printed) -> TokenStream {
        let results = &printed.results;
        self.closure(&[("w", self.array(2)), ("lambda", self.blocks())], printed, &quote!([#(#results),*]))
    }

    fn right(&self, printed: &Printed) -> TokenStream {
        let (motion, slip) = printed.results.split_at(self.n);
        let value = quote!(([#(#motion),*], [#(#slip),*]));
        self.closure(&self.of_order(&[("modes", self.array(self.shared))]), printed, &value)
    }

    fn solve(&self, printed: Option<&Printed>) -> TokenStream {
        let (a, general, some, all) =
            (local("a"), local("general"), self.emission.some(), self.n + self.rows);
        let of_right = self.array(all);
        let otherwise = match printed {
            Some(Printed { statements, results, .. }) => quote!(_ => { #statements [#(#results),*] }),
            None => {
                let nan = quote!(::core::primitive::f64::NAN);
                quote!(_ => [#nan; #all])
            }
        };
        quote!(|#a: #of_right| match #general { #some(#general) => #general.solve(#a), #otherwise })
    }

    fn next(&self, printed: &Printed, lanes: usize) -> TokenStream {
        let (left, right) = printed.results.split_at(lanes);
        let [left, right] = [left, right].map(|factors| in_blocks(factors, &quote!(0.0)));
        let given = [("a", self.array(self.n + self.rows)), ("modes", self.array(self.shared))];
        self.closure(&self.of_order(&given), printed, &quote!((#left, #right)))
    }

    fn ahead(&self, printed: &Printed, lanes: usize) -> TokenStream {
        let (factors, shared) = printed.results.split_at(2 * lanes);
        let (left, right) = factors.split_at(lanes);
        let [left, right] = [left, right].map(|factors| in_blocks(factors, &quote!(0.0)));
        let f64 = self.emission.float();
        let given = [("t", f64), ("q", self.array(self.n)), ("w", self.array(2)), ("lambda", self.blocks())];
        self.closure(&given, printed, &quote!(((#left, #right), [#(#shared),*])))
    }

    /// t, q, u, k and 1/k, what else is given, sums.
    fn of_order<'s>(&self, more: &[(&'s str, TokenStream)]) -> Vec<(&'s str, TokenStream)> {
        let first = [
            ("t", self.emission.float()),
            ("q", self.array(self.n)),
            ("u", self.array(self.n)),
            ("w", self.array(2)),
        ];
        first.into_iter().chain(more.iter().cloned()).chain([("lambda", self.blocks())]).collect()
    }
}

/// An array of arrays of [`LANES_OF_BLOCK`], the last one filled up.
fn in_blocks(values: &[TokenStream], filler: &TokenStream) -> TokenStream {
    let blocks = values.chunks(LANES_OF_BLOCK).map(|block| {
        let values = block.iter().chain(core::iter::repeat_n(filler, LANES_OF_BLOCK - block.len()));
        quote!([#(#values),*])
    });
    quote!([#(#blocks),*])
}
