//! Constraints: rows with their Jacobian, in loops over rounds.
//!
//! Values of the Jacobian lie entry by entry: for every entry of an element the values of all its rounds, one
//! after the other. `row_pattern` visits them in the same order.

use dynamics_symbolic::families::{Axis, RowElement, RowTerm};
use dynamics_symbolic::graph::NodeId;
use proc_macro2::TokenStream;
use quote::quote;

use super::super::function;
use super::loops::{Loops, Reading};

impl Loops<'_> {
    /// Where the rows of every component of every constraint begin: `__r0`; and `__r` where the last ends.
    fn row_starts(&self) -> TokenStream {
        let mut lines = quote!(let mut __r = 0isize;);
        for (c, declared) in self.family.constraints.iter().enumerate() {
            let length = match declared.numbered {
                false => quote!(1isize),
                true => {
                    let of = self.rows.iter().filter(|row| row.constraint == c);
                    let lengths = of.map(|row| match row.range {
                        None => quote!(1isize),
                        Some(range) => {
                            let (start, end) = (self.anchor(range.start), self.anchor(range.end));
                            quote!((#end - #start).max(0))
                        }
                    });
                    quote!((0isize #(+ #lengths)*))
                }
            };
            for component in 0..declared.components.len() {
                let name = function(&format!("__r{c}_{component}"));
                lines.extend(quote!(let #name = __r; __r += #length;));
            }
        }
        lines
    }

    /// The body of `row_ends`.
    pub(super) fn row_ends(&self) -> TokenStream {
        let (sizes, starts) = (self.sizes(), self.row_starts());
        let mut names = Vec::new();
        for (c, declared) in self.family.constraints.iter().enumerate() {
            names.extend((0..declared.components.len()).map(|k| function(&format!("__r{c}_{k}"))));
        }
        let ends = names.iter().skip(1).map(|name| quote!(#name));
        let ends: Vec<TokenStream> = ends.chain([quote!(__r)]).collect();
        quote!(#sizes #starts [#(#ends as usize),*].into())
    }

    /// The first row of an element's component, before its round `__start`.
    fn first_row(&self, element: &RowElement, component: usize) -> TokenStream {
        let name = function(&format!("__r{}_{component}", element.constraint));
        let before = element.before.iter().map(|range| {
            let (start, end) = (self.anchor(range.start), self.anchor(range.end));
            quote!((#end - #start).max(0))
        });
        let alone = element.alone_before as isize;
        quote!((#name + #alone #(+ #before)*))
    }

    /// The rounds of an element, as `__start` and `__end`.
    fn rounds_of(&self, element: &RowElement) -> TokenStream {
        let (start, end) = match element.range {
            None => (quote!(0isize), quote!(1isize)),
            Some(range) => (self.anchor(range.start), self.anchor(range.end)),
        };
        quote!(let (__start, __end) = (#start, #end);)
    }

    /// The row of round `__i`.
    fn row_of_round(&self, element: &RowElement, component: usize) -> TokenStream {
        let first = self.first_row(element, component);
        match self.family.constraints[element.constraint].numbered {
            true => quote!((#first + (__i - __start)) as usize),
            false => quote!(#first as usize),
        }
    }

    /// The body of `row_pattern`.
    pub(super) fn row_pattern(&self) -> TokenStream {
        let mut body = TokenStream::new();
        for element in self.rows {
            let rounds = self.rounds_of(element);
            for (component, term) in element.components.iter().enumerate() {
                let row = self.row_of_round(element, component);
                for (a, _) in &term.jacobian {
                    let place = self.place(self.family.locals[*a]);
                    body.extend(quote!({ #rounds for __i in __start..__end { __visit(#row, #place); } }));
                }
            }
        }
        let (sizes, starts) = (self.sizes(), self.row_starts());
        quote!(#sizes #starts #body)
    }

    /// `__Rows`, a pass that writes Φ, Φ̇, γ and the Jacobian.
    pub(super) fn row_pass(&self) -> TokenStream {
        if self.rows.is_empty() {
            return TokenStream::new();
        }
        let (model, private) = (&self.surface.target, self.surface.private());
        let f64 = quote!(#private::f64);
        let (sizes, starts) = (self.sizes(), self.row_starts());
        let blocks = self.rows.iter().map(|element| self.row_block(element));
        let sums = self.family.constraints.iter().enumerate().filter(|(_, declared)| !declared.numbered);
        let sums: Vec<_> = sums
            .flat_map(|(c, declared)| {
                (0..declared.components.len()).map(move |k| function(&format!("__r{c}_{k}")))
            })
            .collect();
        let count = sums.len();
        let parts = ["residual", "velocity_residual", "gamma"].map(function);
        quote! {
            struct __Rows<'a, 'b> {
                model: &'a #model, t: #f64, q: &'a [#f64], u: &'a [#f64], w: &'a [#f64],
                into: #private::families::RowValues<'b>,
            }
            impl __loops::Pass for __Rows<'_, '_> {
                type Output = ();
                #[inline(always)]
                fn run(self) {
                    let Self { model: __model, t: __t, q: __q, u: __u, w: __w, into: __into } = self;
                    #sizes
                    #starts
                    let mut __base = 0usize;
                    // To these rows several loops may add.
                    for __row in [#(#sums),*] as [isize; #count] {
                        #(if let #private::Option::Some(__value) = __into.#parts.get_mut(__row as usize) {
                            *__value = 0.0;
                        })*
                    }
                    #(#blocks)*
                }
            }
        }
    }

    /// The rounds of an element, block by block: values go to buffers and from there to their places.
    fn row_block(&self, element: &RowElement) -> TokenStream {
        let numbered = self.family.constraints[element.constraint].numbered;
        let of = |term: &RowTerm| -> Vec<NodeId> {
            let parts = [term.residual, term.velocity_residual, term.gamma];
            parts.into_iter().chain(term.jacobian.iter().map(|(_, node)| *node)).collect()
        };
        let roots: Vec<NodeId> = element.components.iter().flat_map(of).collect();
        let reading = if element.range.is_some() { Reading::Lanes(Axis::First) } else { Reading::Index };
        let (before, statements, values) = self.round(&roots, reading);
        let rooms: Vec<_> = (0..roots.len()).map(|k| function(&format!("__g{k}"))).collect();
        let (mut written, mut sums, mut totals) =
            (TokenStream::new(), TokenStream::new(), TokenStream::new());
        let (mut room, mut entry) = (rooms.iter(), 0usize);
        for (component, term) in element.components.iter().enumerate() {
            let first = self.first_row(element, component);
            for part in ["residual", "velocity_residual", "gamma"] {
                let (Some(room), part) = (room.next(), function(part)) else { continue };
                if numbered {
                    written.extend(quote! {
                        if !__into.#part.is_empty() {
                            __into.#part[(#first + (__lo - __start)) as usize..][..__m]
                                .copy_from_slice(&#room[..__m]);
                        }
                    });
                } else {
                    let sum = function(&format!("__{part}{component}"));
                    sums.extend(quote!(let mut #sum = __loops::Sum::default();));
                    written.extend(quote!(#sum.add(__loops::block_sum(&#room[..__m]));));
                    totals.extend(quote! {
                        if !__into.#part.is_empty() {
                            __into.#part[#first as usize] += #sum.total();
                        }
                    });
                }
            }
            for _ in &term.jacobian {
                let Some(room) = room.next() else { continue };
                written.extend(quote! {
                    __into.jacobian[__base + #entry * __rounds + (__lo - __start) as usize..][..__m]
                        .copy_from_slice(&#room[..__m]);
                });
                entry += 1;
            }
        }
        let rounds = self.rounds_of(element);
        quote! {{
            const __MOST: usize = __loops::BLOCK;
            #rounds
            let __rounds = (__end - __start).max(0) as usize;
            #sums
            #(let mut #rooms = [0.0; __loops::BLOCK];)*
            let mut __lo = __start;
            while __lo < __end {
                let __m = ((__end - __lo) as usize).min(__loops::BLOCK);
                #before
                {
                    #(let #rooms = &mut #rooms[..__m];)*
                    for __j in 0..__m {
                        #statements
                        #(#rooms[__j] = #values;)*
                    }
                }
                #written
                __lo += __m as isize;
            }
            #totals
            __base += #entry * __rounds;
        }}
    }

    /// The body of `row_stiffness`.
    pub(super) fn row_stiffness(&self) -> TokenStream {
        let mut body = TokenStream::new();
        for element in self.rows {
            let rounds = self.rounds_of(element);
            for (component, term) in element.components.iter().enumerate() {
                if term.stiffness.is_empty() {
                    continue;
                }
                let roots: Vec<NodeId> = term.stiffness.iter().map(|(.., node)| *node).collect();
                let (before, statements, values) = self.round(&roots, Reading::Index);
                let row = self.row_of_round(element, component);
                let added = term.stiffness.iter().zip(values).map(|((a, b, _), value)| {
                    let [a, b] = [a, b].map(|a| self.place(self.family.locals[*a]));
                    quote!(__add(#a, #b, __multiplier * #value);)
                });
                body.extend(quote! {{
                    #rounds
                    if __start < __end {
                        #before
                        for __i in __start..__end {
                            let __multiplier = __multipliers[#row];
                            #statements
                            #(#added)*
                        }
                    }
                }});
            }
        }
        let (sizes, starts) = (self.sizes(), self.row_starts());
        if body.is_empty() { body } else { quote!(#sizes #starts #body) }
    }

    /// What the trait has of constraints; nothing where there are none.
    pub(super) fn of_constraints(&self) -> TokenStream {
        if self.rows.is_empty() {
            return TokenStream::new();
        }
        let private = self.surface.private();
        let (families, f64, usize) =
            (quote!(#private::families), quote!(#private::f64), quote!(#private::usize));
        let declared = self.family.constraints.iter().enumerate().flat_map(|(c, declared)| {
            let families = families.clone();
            declared.components.iter().zip(&declared.units).map(move |(suffix, unit)| {
                let name = &declared.name;
                let (numbered, holonomic) = (declared.numbered, declared.is_holonomic());
                quote!(#families::RowField {
                    name: #name, component: #suffix, unit: #unit, constraint: #c, numbered: #numbered,
                    holonomic: #holonomic,
                })
            })
        });
        let model = &self.surface.target;
        let functions = self.family.constraints.iter().enumerate().map(|(c, declared)| {
            let function = super::field(&declared.name);
            quote! {
                if __function == #private::type_of(&<#model>::#function) {
                    return #private::Option::Some(#c);
                }
            }
        });
        let (ends, pattern, stiffness) = (self.row_ends(), self.row_pattern(), self.row_stiffness());
        quote! {
            const ROWS: &'static [#families::RowField] = &[#(#declared),*];
            fn row_ends(&self) -> #families::Vec<#usize> {
                let __model = self;
                #ends
            }
            fn row_pattern(&self, __visit: &mut #families::Pairs<'_>) {
                let __model = self;
                #pattern
            }
            fn rows(&self, __at: #families::View<'_>, __into: #families::RowValues<'_>) {
                __loops::in_wide_vectors(__Rows {
                    model: self, t: __at.t, q: __at.q, u: __at.u, w: __at.inputs, into: __into,
                });
            }
            fn row_stiffness(
                &self, __at: #families::View<'_>, __multipliers: &[#f64], __add: &mut #families::Entries<'_>,
            ) {
                let (__model, __t, __q, __u, __w) = (self, __at.t, __at.q, __at.u, __at.inputs);
                #stiffness
            }
            fn constraint_of(__function: #private::TypeId) -> #private::Option<#usize> {
                #(#functions)*
                #private::Option::None
            }
        }
    }
}
