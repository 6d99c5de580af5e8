//! Loops over elements.
//!
//! Nodes gather the forces of the elements beside them: `line` for elements of one loop, `grid` for those of
//! two. What cannot be gathered so, as at the edges of a grid, is `added` to what these have written, and
//! so is what has no rounds. Loops run over exact slices, so that they vectorise.

mod added;
mod grid;
mod line;
mod reading;

use dynamics_symbolic::families::{
    self, Anchor, Axis, Element, FamilyModel, Gathering, Given, Range, Rounds, RowElement,
};
use dynamics_symbolic::graph::NodeId;
use dynamics_symbolic::schedule::{Staging, schedule};
use proc_macro2::TokenStream;
use quote::quote;

use super::super::program::{Access, Block, straight};
use super::super::{Surface, function};
use super::field;
use crate::compile::CompiledFamilies;
pub(super) use reading::{Reading, Stretch};

/// What writes the loops of one model.
pub(super) struct Loops<'a> {
    pub(super) surface: &'a Surface,
    pub(super) family: &'a FamilyModel,
    pub(super) elements: &'a [Element],
    pub(super) rows: &'a [RowElement],
    interior: &'a [Option<NodeId>],
}

/// Entries of a matrix of an element.
pub(super) type EntriesOf = dyn Fn(&Element) -> &Vec<(usize, usize, NodeId)>;

impl<'a> Loops<'a> {
    pub(super) fn new(surface: &'a Surface, compiled: &'a CompiledFamilies) -> Self {
        Self {
            surface,
            family: &compiled.family,
            elements: &compiled.derived.elements,
            rows: &compiled.derived.rows,
            interior: &compiled.interior,
        }
    }

    fn counts(&self) -> impl Iterator<Item = (String, syn::Ident)> {
        self.family.counts.iter().enumerate().map(|(k, name)| (format!("__n{k}"), field(name)))
    }

    /// An index as an expression of type `isize`.
    pub(super) fn anchor(&self, anchor: Anchor) -> TokenStream {
        match anchor {
            Anchor::Start(k) => {
                let k = k as isize;
                quote!(#k)
            }
            Anchor::End { count, plus } => {
                let (name, plus) = (function(&format!("__n{count}")), plus as isize);
                if plus == 0 { quote!(#name) } else { quote!((#name + #plus)) }
            }
        }
    }

    /// The ends of a range as expressions of type `isize`.
    pub(super) fn ends(&self, range: Range) -> (TokenStream, TokenStream) {
        (self.anchor(range.start), self.anchor(range.end))
    }

    /// Counts, and where fields begin: `__n0`, `__l0` (length, rows), `__c0` (columns), `__o0` (offset).
    pub(super) fn sizes(&self) -> TokenStream {
        let counts = self.counts().map(|(name, field)| {
            let name = function(&name);
            quote!(let #name = __model.#field as isize;)
        });
        let mut fields = TokenStream::new();
        let mut start = quote!(0isize);
        for (k, field) in self.family.fields.iter().enumerate() {
            let [length, columns, offset] = ["l", "c", "o"].map(|name| function(&format!("__{name}{k}")));
            let value = field.length.map_or_else(|| quote!(1isize), |length| self.anchor(length));
            fields.extend(quote!(let #length = #value; let #offset = #start;));
            start = quote!(#offset + #length);
            if let Some(width) = field.columns {
                let width = self.anchor(width);
                fields.extend(quote!(let #columns = #width;));
                start = quote!(#offset + #length * #columns);
            }
        }
        quote!(#(#counts)* #fields)
    }

    /// The code that computes `roots` of one round: what stands before the rounds, statements, values.
    pub(super) fn round(
        &self,
        roots: &[NodeId],
        reading: Reading,
    ) -> (TokenStream, TokenStream, Vec<TokenStream>) {
        let (before, names) = self.reading(roots, reading);
        let program = schedule(&self.family.model.graph, "element", roots, Staging::Inline);
        let access = Access::of_elements(self.surface, &self.family.model.graph, names);
        let (statements, values) = straight(&access, &program);
        (before, statements, values)
    }

    /// The loop over `__m` rounds of a block that writes `roots` to slices of these names, with what stands
    /// before it. Sines, cosines and reciprocal roots come without branches, so that it vectorises; where an
    /// argument is out of their range, the block is made anew.
    pub(super) fn block(
        &self,
        roots: &[NodeId],
        reading: Reading,
        rooms: &[syn::Ident],
    ) -> (TokenStream, TokenStream) {
        let (before, names) = self.reading(roots, reading);
        let graph = &self.family.model.graph;
        let program = schedule(graph, "element", roots, Staging::Inline);
        let printed = |block| {
            let access = Access::of_elements(self.surface, graph, names.clone()).in_block(block);
            let (statements, values) = straight(&access, &program);
            let rounds = quote!(for __j in 0..__m { #statements #(#rooms[__j] = #values;)* });
            (rounds, access.has_range.get())
        };
        let (near, has_range) = printed(Block::Near);
        if !has_range {
            return (before, near);
        }
        let (any, _) = printed(Block::Any);
        (before, quote!(let mut __far = false; #near if __far { #any }))
    }

    /// Elements whose forces come to the nodes in this way, with their numbers and ranges.
    fn elements_of(&self, way: Gathering) -> impl Iterator<Item = (usize, &Element, Range, Option<Range>)> {
        let all = self.elements.iter().enumerate();
        all.filter(move |(_, element)| element.gathering(self.family) == Some(way)).filter_map(
            |(e, element)| {
                let outer = element.rounds.range(Axis::First)?;
                Some((e, element, outer, element.rounds.range(Axis::Second)))
            },
        )
    }

    /// Fields that are families with one index.
    fn lines(&self) -> impl Iterator<Item = usize> {
        let all = self.family.fields.iter().enumerate();
        all.filter(|(_, field)| field.length.is_some() && field.columns.is_none()).map(|(k, _)| k)
    }

    /// Fields whose nodes have two indices.
    fn grids(&self) -> impl Iterator<Item = usize> {
        let all = self.family.fields.iter().enumerate();
        all.filter(|(_, field)| field.columns.is_some()).map(|(k, _)| k)
    }

    /// What the rounds of elements give to the nodes of a field, of elements whose forces come there in this
    /// way.
    fn gathered(&self, field: usize, way: Gathering) -> Vec<Given> {
        families::gathered(self.family, self.elements, field, way)
    }

    /// The forces that need a buffer each, and for every force its buffer and whether it is the opposite.
    fn buffers(&self, element: &Element) -> (Vec<NodeId>, Vec<(usize, bool)>) {
        families::buffers(self.family, element)
    }

    /// What a node gathers from slices `__h0`, `__h1`, ..
    fn sum_of(given: &[Given]) -> TokenStream {
        let mut sum = TokenStream::new();
        for (s, Given { opposite, .. }) in given.iter().enumerate() {
            let name = function(&format!("__h{s}"));
            sum = match (s, opposite) {
                (0, false) => quote!(#name[__j]),
                (0, true) => quote!(-#name[__j]),
                (_, false) => quote!(#sum + #name[__j]),
                (_, true) => quote!(#sum - #name[__j]),
            };
        }
        if sum.is_empty() { quote!(0.0) } else { quote!((#sum)) }
    }

    /// Writes values of `__m` nodes, `__j`, of these fields from node `__from` on, with what stands before
    /// the loop.
    fn written(
        &self,
        fields: &[usize],
        before: &TokenStream,
        statements: &TokenStream,
        values: &[TokenStream],
    ) -> TokenStream {
        let named =
            |name: &str| -> Vec<_> { fields.iter().map(|k| function(&format!("__{name}{k}"))).collect() };
        let (outs, scales, offsets, pieces) = (named("y"), named("s"), named("o"), named("out"));
        quote! {
            #before
            #(let #outs = &mut #pieces[(__from - __begin) as usize..][..__m];)*
            if MODE == __loops::FORCES {
                for __j in 0..__m { #statements #(#outs[__j] = #values;)* }
            } else {
                #(let #scales = &__scale[(#offsets + __from) as usize..][..__m];)*
                if MODE == __loops::SCALED {
                    for __j in 0..__m { #statements #(#outs[__j] = #values * #scales[__j];)* }
                } else {
                    for __j in 0..__m { #statements #(#outs[__j] += __h * (#values * #scales[__j]);)* }
                }
            }
        }
    }

    /// Passes that write Q, Q times a scale, or add it to velocities: `__Forces` for nodes with one index,
    /// part by part, and `__Rest` for all else; `__forces` calls both.
    pub(super) fn forces(&self) -> TokenStream {
        let (model, private) = (&self.surface.target, self.surface.private());
        let f64 = quote!(#private::f64);
        let sizes = self.sizes();
        let once = self.elements.iter().filter(|element| element.rounds == Rounds::Once);
        let once: Vec<TokenStream> = once.map(|element| self.once(element)).collect();
        let ordinary = (0..self.family.fields.len()).filter(|k| self.family.fields[*k].length.is_none());
        let ordinary = ordinary.map(|k| {
            let offset = function(&format!("__o{k}"));
            quote!(if MODE != __loops::KICK { __out[#offset as usize] = 0.0; })
        });
        let (line, grid) = (self.line_forces(), self.grid_forces());
        let added = self.elements_of(Gathering::Added);
        let added: Vec<TokenStream> = added.map(|(_, element, ..)| self.added_forces(element)).collect();
        let local = added.is_empty() && self.grids().next().is_none() && self.line_is_local();
        let line::Line { top, body, whole, sums } = line;
        let count = self.family.fields.len();
        let names = |of: &str| (0..count).map(|k| function(&format!("__{of}{k}"))).collect::<Vec<_>>();
        let pieces = names("out");
        let bounds = (0..count).map(|k| {
            let [offset, length] = ["o", "l"].map(|name| function(&format!("__{name}{k}")));
            match self.family.fields[k].columns {
                None => quote!([#offset + __begin.min(#length), #offset + __end.min(#length)]),
                Some(_) => quote!([#offset, #offset]),
            }
        });
        quote! {
            /// The nodes with one index from `begin` to before `end`. Every piece of `out` has those of one
            /// field.
            struct __Forces<'a, const MODE: #private::u8> {
                model: &'a #model, t: #f64, q: &'a [#f64], u: &'a [#f64], w: &'a [#f64],
                scale: &'a [#f64], h: #f64, begin: isize, end: isize, out: [&'a mut [#f64]; #count],
            }
            impl<const MODE: #private::u8> __loops::Pass for __Forces<'_, MODE> {
                type Output = [#f64; #sums];
                #[inline(always)]
                fn run(self) -> Self::Output {
                    let Self {
                        model: __model, t: __t, q: __q, u: __u, w: __w, scale: __scale, h: __h,
                        begin: __begin, end: __end, out: [#(#pieces),*],
                    } = self;
                    #sizes
                    #body
                }
            }
            /// All other nodes, sums over all rounds, and what has none.
            struct __Rest<'a, const MODE: #private::u8> {
                model: &'a #model, t: #f64, q: &'a [#f64], u: &'a [#f64], w: &'a [#f64],
                scale: &'a [#f64], h: #f64, totals: [#f64; #sums], out: &'a mut [#f64],
            }
            impl<const MODE: #private::u8> __loops::Pass for __Rest<'_, MODE> {
                type Output = ();
                #[inline(always)]
                fn run(self) {
                    let Self {
                        model: __model, t: __t, q: __q, u: __u, w: __w, scale: __scale, h: __h,
                        totals: __totals, out: __out,
                    } = self;
                    #sizes
                    #(#ordinary)*
                    #(#whole)*
                    #grid
                    #(#added)*
                    #(#once)*
                }
            }
            const __LOCAL: #private::bool = #local;
            /// Forces of a range of nodes, to `out`, which has all nodes of all fields.
            fn __forces<const MODE: #private::u8>(
                __threads: #private::usize, __nodes: [isize; 2], __model: &#model, __t: #f64,
                [__q, __u, __w, __scale]: [&[#f64]; 4], __h: #f64, __out: &mut [#f64],
            ) {
                #sizes
                let __top = #top;
                let [__begin, __end] = __nodes.map(|__node| __node.min(__top));
                let __pieces = __loops::pieces(__out, [#(#bounds),*]);
                let __threads = if __LOCAL { __threads } else { 1 };
                let __totals = __loops::in_parts(
                    __threads, [__begin, __end], __pieces, &|[__begin, __end]: [isize; 2], __pieces| {
                        __loops::in_wide_vectors(__Forces::<MODE> {
                            model: __model, t: __t, q: __q, u: __u, w: __w, scale: __scale, h: __h,
                            begin: __begin, end: __end, out: __pieces,
                        })
                    },
                );
                if __end == __top {
                    __loops::in_wide_vectors(__Rest::<MODE> {
                        model: __model, t: __t, q: __q, u: __u, w: __w, scale: __scale, h: __h,
                        totals: __totals, out: __out,
                    });
                }
            }
        }
    }

    /// `__Energies`, a pass that sums T and V.
    pub(super) fn energies(&self) -> TokenStream {
        let (model, private) = (&self.surface.target, self.surface.private());
        let f64 = quote!(#private::f64);
        let sizes = self.sizes();
        let mut body = TokenStream::new();
        for element in self.elements {
            let parts = [(element.kinetic, "__kinetic"), (element.potential, "__potential")];
            let parts: Vec<(NodeId, _)> =
                parts.iter().filter_map(|(node, name)| node.map(|node| (node, field(name)))).collect();
            if parts.is_empty() {
                continue;
            }
            let roots: Vec<NodeId> = parts.iter().map(|(node, _)| *node).collect();
            let sums: Vec<_> = parts.iter().map(|(_, name)| name).collect();
            let Some(lanes) = Reading::of_lanes(element.rounds) else {
                let (before, statements, values) = self.round(&roots, Reading::Index);
                body.extend(quote!({ #before #statements #(#sums.add(#values);)* }));
                continue;
            };
            let rooms: Vec<_> = (0..roots.len()).map(|k| function(&format!("__g{k}"))).collect();
            let (before, block) = self.block(&roots, lanes, &rooms);
            let block = quote! {
                #before
                #(let mut #rooms = [0.0; __loops::BLOCK];)*
                {
                    #(let #rooms = &mut #rooms[..__m];)*
                    #block
                }
                #(#sums.add(__loops::block_sum(&#rooms[..__m]));)*
            };
            body.extend(self.in_blocks(
                element.rounds,
                &quote!(__loops::BLOCK),
                &block,
                &quote!(),
                &quote!(),
            ));
        }
        quote! {
            struct __Energies<'a> {
                model: &'a #model, t: #f64, q: &'a [#f64], u: &'a [#f64], w: &'a [#f64],
            }
            impl __loops::Pass for __Energies<'_> {
                type Output = #private::families::EnergyParts;
                #[inline(always)]
                fn run(self) -> Self::Output {
                    let Self { model: __model, t: __t, q: __q, u: __u, w: __w } = self;
                    #sizes
                    let (mut __kinetic, mut __potential) =
                        (__loops::Sum::default(), __loops::Sum::default());
                    #body
                    #private::families::EnergyParts {
                        kinetic: __kinetic.total(), potential: __potential.total(),
                    }
                }
            }
        }
    }

    /// The entries of a matrix, element by element.
    pub(super) fn entries(&self, of: &EntriesOf) -> TokenStream {
        let mut body = TokenStream::new();
        for element in self.elements.iter().filter(|element| !of(element).is_empty()) {
            let entries = of(element);
            let roots: Vec<NodeId> = entries.iter().map(|(.., node)| *node).collect();
            let (before, statements, values) = self.round(&roots, Reading::Index);
            let added = entries.iter().zip(values).map(|((a, b, _), value)| {
                let [row, column] = [a, b].map(|a| self.place(self.family.locals[*a]));
                quote!(__add(#row, #column, #value);)
            });
            let loops =
                Axis::ALL.into_iter().rev().filter_map(|axis| Some((axis, element.rounds.range(axis)?)));
            let rounds = loops.fold(quote!(#statements #(#added)*), |body, (axis, range)| {
                let (index, (start, end)) = (reading::index_name(axis), self.ends(range));
                quote!(for #index in #start..#end { #body })
            });
            let ranges = element.rounds.ranges().map(|range| {
                let (start, end) = self.ends(range);
                quote!(#start < #end)
            });
            body.extend(quote!(if true #(&& #ranges)* { #before #rounds }));
        }
        let sizes = self.sizes();
        if body.is_empty() { body } else { quote!(#sizes #body) }
    }

    /// A block of rounds, `__m` of them from `__lo` on and at most `size`, repeated over all rounds; with
    /// what stands before and behind the blocks of one row.
    pub(super) fn in_blocks(
        &self,
        rounds: Rounds,
        size: &TokenStream,
        block: &TokenStream,
        before: &TokenStream,
        behind: &TokenStream,
    ) -> TokenStream {
        let blocks = |range: Range| {
            let (start, end) = self.ends(range);
            quote! {
                #before
                let (mut __lo, __hi) = (#start, #end);
                while __lo < __hi {
                    const __MOST: usize = #size;
                    let __m = ((__hi - __lo) as usize).min(__MOST);
                    #block
                    __lo += __m as isize;
                }
                #behind
            }
        };
        match rounds {
            Rounds::Once => TokenStream::new(),
            Rounds::Over(range) => blocks(range),
            Rounds::Nested(outer, inner) => {
                let (index, (start, end), blocks) =
                    (reading::index_name(Axis::First), self.ends(outer), blocks(inner));
                quote!(for #index in #start..#end { #blocks })
            }
        }
    }
}
