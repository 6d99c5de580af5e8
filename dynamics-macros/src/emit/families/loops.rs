//! Loops over elements.
//!
//! Forces go block by block of nodes. For every block the rounds that reach it are made: the forces of an
//! element go into a buffer each, which stays in the first-level cache, and are then gathered at the nodes.
//! Both loops run over exact slices and vectorise; a loop that scatters does not. Forces that are opposite
//! share a buffer. A block that all rounds cover, which all are but those at the ends, needs no sums in
//! memory: its nodes gather and are written in one loop. Where elements are cheap, such a block needs no
//! buffers either: every node makes its elements again. What an element gives to a node that is the same in
//! every round is a sum over its rounds; every round is counted in the block that holds its index. What has no rounds is added at the end.

use std::collections::BTreeMap;

use dynamics_symbolic::families::{Anchor, Element, FamilyModel, Local, NodeIndex, Range, RowElement, Source};
use dynamics_symbolic::graph::{Node, NodeId, Symbol};
use dynamics_symbolic::schedule::{Staging, schedule};
use proc_macro2::TokenStream;
use quote::quote;

use super::super::program::{Access, Block, straight};
use super::super::{Surface, function};
use super::field;
use crate::compile::CompiledFamilies;

/// What writes the loops of one model.
pub(super) struct Loops<'a> {
    pub(super) surface: &'a Surface,
    pub(super) family: &'a FamilyModel,
    pub(super) elements: &'a [Element],
    pub(super) rows: &'a [RowElement],
    interior: &'a [Option<NodeId>],
}

/// Most operations of the forces of a node far from all ends, for each force that is gathered there, up to
/// which they are made anew at every node.
const MOST_CHEAP: usize = 8;

/// Where a round finds what it reads.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(super) enum Reading {
    /// In slices, at `__j`.
    Slices,
    /// By the index `__i` of the round.
    Index,
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

    /// Counts, and where fields begin: `__n0`, `__l0` (length), `__o0` (offset).
    pub(super) fn sizes(&self) -> TokenStream {
        let counts = self.counts().map(|(name, field)| {
            let name = function(&name);
            quote!(let #name = __model.#field as isize;)
        });
        let mut fields = TokenStream::new();
        for (k, field) in self.family.fields.iter().enumerate() {
            let (length, offset) = (function(&format!("__l{k}")), function(&format!("__o{k}")));
            let value = field.length.map_or_else(|| quote!(1isize), |length| self.anchor(length));
            let start = match k {
                0 => quote!(0isize),
                k => {
                    let (o, l) = (function(&format!("__o{}", k - 1)), function(&format!("__l{}", k - 1)));
                    quote!(#o + #l)
                }
            };
            fields.extend(quote!(let #length = #value; let #offset = #start;));
        }
        quote!(#(#counts)* #fields)
    }

    /// Where the node of a local is in q, in round `__i`.
    pub(super) fn place(&self, local: Local) -> TokenStream {
        let offset = function(&format!("__o{}", local.field));
        match local.index {
            NodeIndex::Round(k) => {
                let k = k as isize;
                quote!((#offset + __i + #k) as usize)
            }
            NodeIndex::Fixed(anchor) => {
                let anchor = self.anchor(anchor);
                quote!((#offset + #anchor) as usize)
            }
        }
    }

    /// What stands before the rounds, and how symbols are written in one.
    fn reading(&self, roots: &[NodeId], reading: Reading) -> (TokenStream, BTreeMap<Symbol, String>) {
        let (mut before, mut names) = (TokenStream::new(), BTreeMap::new());
        let graph = &self.family.model.graph;
        for id in graph.cone(roots) {
            let Node::Symbol(symbol) = graph.node(id) else { continue };
            let name = match symbol {
                Symbol::Coordinate(l) => {
                    self.of_node(quote!(__q), &format!("__x{l}"), l, reading, &mut before)
                }
                Symbol::Rate(l) => self.of_node(quote!(__u), &format!("__r{l}"), l, reading, &mut before),
                Symbol::Parameter(p) => self.of_parameter(p, reading, &mut before),
                Symbol::Input(k) => format!("__w[{k}]"),
                Symbol::Time => "__t".to_owned(),
                _ => continue,
            };
            names.insert(symbol, name);
        }
        (before, names)
    }

    fn of_node(
        &self,
        all: TokenStream,
        name: &str,
        local: u32,
        reading: Reading,
        before: &mut TokenStream,
    ) -> String {
        let local = self.family.locals[local as usize];
        let (ident, place) = (function(name), self.place(local));
        match (local.index, reading) {
            (NodeIndex::Round(k), Reading::Slices) => {
                let (offset, k) = (function(&format!("__o{}", local.field)), k as isize);
                before.extend(quote!(let #ident = &#all[(#offset + __lo + #k) as usize..][..__m];));
                format!("{name}[__j]")
            }
            (NodeIndex::Round(_), Reading::Index) => quote!(#all[#place]).to_string(),
            (NodeIndex::Fixed(_), _) => {
                before.extend(quote!(let #ident = #all[#place];));
                name.to_owned()
            }
        }
    }

    fn of_parameter(&self, p: u32, reading: Reading, before: &mut TokenStream) -> String {
        match self.family.sources[p as usize] {
            Source::Scalar(k) => {
                let access = &self.surface.parameters[k as usize];
                quote!(__model #access).to_string()
            }
            Source::Count(c) => {
                let name = function(&format!("__n{c}"));
                quote!((#name as f64)).to_string()
            }
            Source::Round if reading == Reading::Slices => {
                before.extend(quote!(let (__index, __numbers) = (__lo as f64, &__loops::NUMBERS[..__m]);));
                "(__index+__numbers[__j])".to_owned()
            }
            Source::Round => "(__i as f64)".to_owned(),
            Source::Numbered { parameter, index } => {
                let field = field(&self.family.numbered[parameter as usize]);
                let name = function(&format!("__p{p}"));
                match (index, reading) {
                    (NodeIndex::Round(k), Reading::Slices) => {
                        let k = k as isize;
                        before.extend(quote!(let #name = &__model.#field[(__lo + #k) as usize..][..__m];));
                        format!("__p{p}[__j]")
                    }
                    (NodeIndex::Round(k), Reading::Index) => {
                        let k = k as isize;
                        quote!(__model.#field[(__i + #k) as usize]).to_string()
                    }
                    (NodeIndex::Fixed(anchor), _) => {
                        let anchor = self.anchor(anchor);
                        before.extend(quote!(let #name = __model.#field[#anchor as usize];));
                        format!("__p{p}")
                    }
                }
            }
        }
    }

    /// The code that computes `roots` of one round: what stands before the rounds, statements, values.
    pub(super) fn round(&self, roots: &[NodeId], reading: Reading) -> (TokenStream, TokenStream, Vec<TokenStream>) {
        let (before, names) = self.reading(roots, reading);
        let program = schedule(&self.family.model.graph, "element", roots, Staging::Inline);
        let access = Access::of_elements(self.surface, &self.family.model.graph, names);
        let (statements, values) = straight(&access, &program);
        (before, statements, values)
    }

    /// The loop over `__m` rounds of a block that writes `roots` to slices of these names, with what stands
    /// before it. Sines, cosines and reciprocal roots come without branches, so that it vectorises; where an
    /// argument is out of their range, the block is made anew.
    pub(super) fn block(&self, roots: &[NodeId], rooms: &[proc_macro2::Ident]) -> (TokenStream, TokenStream) {
        let (before, names) = self.reading(roots, Reading::Slices);
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

    /// Elements with rounds that give forces, with their numbers.
    fn with_rounds(&self) -> impl Iterator<Item = (usize, &Element, Range)> {
        let all = self.elements.iter().enumerate();
        all.filter(|(_, e)| !e.forces.is_empty()).filter_map(|(k, e)| e.range.map(|range| (k, e, range)))
    }

    /// Fields that are families.
    fn families(&self) -> impl Iterator<Item = usize> {
        (0..self.family.fields.len()).filter(|k| self.family.fields[*k].length.is_some())
    }

    /// What the rounds of elements give to the nodes of a field: element, offset, buffer, whether it is the
    /// opposite.
    fn gathered(&self, field: usize) -> Vec<(usize, i64, usize, bool)> {
        let mut all = Vec::new();
        for (e, element, _) in self.with_rounds() {
            let (_, used) = self.buffers(element);
            for ((a, _), (buffer, opposite)) in element.forces.iter().zip(used) {
                let local = self.family.locals[*a];
                if let (true, NodeIndex::Round(k)) = (local.field as usize == field, local.index) {
                    all.push((e, k, buffer, opposite));
                }
            }
        }
        all
    }

    /// Whether nodes make the forces of their elements anew: where that is cheap, and nothing else is made
    /// of the rounds.
    fn is_cheap(&self) -> bool {
        let fixed = |(a, _): &(usize, NodeId)| matches!(self.family.locals[*a].index, NodeIndex::Fixed(_));
        let roots: Vec<NodeId> = self.interior.iter().flatten().copied().collect();
        let cost = schedule(&self.family.model.graph, "node", &roots, Staging::Hoisted).cost;
        let gathered: usize = self.families().map(|field| self.gathered(field).len()).sum();
        cost.roots + cost.divisions + cost.sin_cos + cost.functions == 0
            && cost.total() <= MOST_CHEAP * gathered
            && !self.with_rounds().flat_map(|(_, element, _)| &element.forces).any(fixed)
    }

    /// `__Forces`, a pass that writes Q, Q times a scale, or adds it to velocities.
    pub(super) fn forces(&self) -> TokenStream {
        let (model, private) = (&self.surface.target, self.surface.private());
        let f64 = quote!(#private::f64);
        let sizes = self.sizes();
        let mut tops: Vec<TokenStream> =
            self.families().map(|k| function(&format!("__l{k}"))).map(|l| quote!(#l)).collect();
        tops.extend(self.with_rounds().map(|(.., range)| self.anchor(range.end)));
        let (mut reductions, mut whole, mut totals) = (Vec::new(), Vec::new(), Vec::new());
        let mut rooms = Vec::new();
        let (mut rounds, mut bounds, mut before_loop) = (Vec::new(), Vec::new(), Vec::new());
        let mut made_none = Vec::new();
        for (e, element, range) in self.with_rounds() {
            let (lo, hi) = (function(&format!("__lo{e}")), function(&format!("__hi{e}")));
            // A round is made for the block that holds its index, too.
            let (below, above) = element.reach(self.family).unwrap_or((0, 0));
            let (below, above) = (below.min(0) as isize, above.max(0) as isize);
            let (start, end) = (self.anchor(range.start), self.anchor(range.end));
            let first = function(&format!("__first{e}"));
            before_loop.push(quote!(let (mut #lo, mut #hi) = (0isize, 0isize);));
            let buffers = self.buffers(element).0.len();
            let own: Vec<_> = (0..buffers).map(|k| function(&format!("__g{e}_{k}"))).collect();
            // Rounds that the block before has made, too, are kept.
            bounds.push(quote! {
                let (__before, __made) = (#lo, #hi);
                #lo = (__from - #above).max(#start);
                #hi = (__to - #below).min(#end);
                let #first = __made.max(#lo);
                for __k in 0..(#first.min(__made) - #lo).max(0) as usize {
                    let __old = __k + (#lo - __before) as usize;
                    #(#own[__k] = #own[__old];)*
                }
            });
            made_none.push(quote!((#lo, #hi) = (0, 0);));
            rooms.extend(own);
            rounds.push(self.rounds(e, element, [&mut reductions, &mut whole, &mut totals]));
        }
        let once = self.elements.iter().filter(|element| element.range.is_none());
        let once: Vec<TokenStream> = once.map(|element| self.once(element)).collect();
        let ordinary = (0..self.family.fields.len()).filter(|k| self.family.fields[*k].length.is_none());
        let ordinary = ordinary.map(|k| {
            let offset = function(&format!("__o{k}"));
            quote!(if MODE != __loops::KICK { __out[#offset as usize] = 0.0; })
        });
        let covered = self.covered();
        let inside = quote!(__first_inside <= __from && __to <= __end_inside);
        let at_ends: Vec<TokenStream> = self.families().map(|field| self.written_at_ends(field)).collect();
        let block = if self.is_cheap() {
            let nodes = self.written_by_nodes();
            quote!(if #inside { #(#made_none)* #nodes } else { #(#rounds)* #(#at_ends)* })
        } else {
            let written = self.families().map(|field| self.written_inside(field));
            quote!(#(#rounds)* if #inside { #(#written)* } else { #(#at_ends)* })
        };
        let local = self.is_local() && whole.is_empty();
        let fields: Vec<usize> = (0..self.family.fields.len()).collect();
        let names = |of: &str| fields.iter().map(|k| function(&format!("__{of}{k}"))).collect::<Vec<_>>();
        let (pieces, offsets, lengths) = (names("out"), names("o"), names("l"));
        let (count, sums) = (fields.len(), whole.len());
        let top = quote! {
            let mut __top = 0isize;
            #(__top = __top.max(#tops);)*
        };
        quote! {
            /// The rounds that reach nodes from `begin` to before `end`. Every piece of `out` has those of
            /// one field.
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
                    #(#reductions)*
                    #top
                    #(let mut #rooms = [0.0; __loops::ROUNDS];)*
                    #covered
                    #(#before_loop)*
                    let mut __from = __begin;
                    while __from < __end {
                        let mut __to = (__from + __loops::BLOCK as isize).min(__end);
                        // Blocks inside hold no node of an end.
                        if __from < __first_inside {
                            __to = __to.min(__first_inside);
                        } else if __from < __end_inside {
                            __to = __to.min(__end_inside);
                        }
                        #(#bounds)*
                        #block
                        __from = __to;
                    }
                    [#(#totals),*]
                }
            }
            /// What comes after the rounds: sums over all of them, and what has none.
            struct __Rest<'a, const MODE: #private::u8> {
                model: &'a #model, t: #f64, q: &'a [#f64], u: &'a [#f64], w: &'a [#f64],
                scale: &'a [#f64], h: #f64, totals: [#f64; #sums], out: &'a mut [#f64],
            }
            impl<const MODE: #private::u8> __Rest<'_, MODE> {
                fn add(self) {
                    let Self {
                        model: __model, t: __t, q: __q, u: __u, w: __w, scale: __scale, h: __h,
                        totals: __totals, out: __out,
                    } = self;
                    #sizes
                    #(#ordinary)*
                    #(#whole)*
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
                #top
                let [__begin, __end] = __nodes.map(|__node| __node.min(__top));
                let __bounds = [#([#offsets + __begin.min(#lengths), #offsets + __end.min(#lengths)]),*];
                let __pieces = __loops::pieces(__out, __bounds);
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
                    __Rest::<MODE> {
                        model: __model, t: __t, q: __q, u: __u, w: __w, scale: __scale, h: __h,
                        totals: __totals, out: __out,
                    }.add();
                }
            }
        }
    }

    /// Whether forces at a node depend on nodes nearby and on ordinary coordinates alone.
    fn is_local(&self) -> bool {
        let graph = &self.family.model.graph;
        let far = |symbol: Symbol| match symbol {
            Symbol::Coordinate(l) | Symbol::Rate(l) => {
                let local = self.family.locals[l as usize];
                let is_family = self.family.fields[local.field as usize].length.is_some();
                is_family && matches!(local.index, NodeIndex::Fixed(_))
            }
            _ => false,
        };
        !self.with_rounds().flat_map(|(_, element, _)| &element.forces).any(|(_, force)| {
            graph.cone(&[*force]).into_iter().any(|id| match graph.node(id) {
                Node::Symbol(symbol) => far(symbol),
                _ => false,
            })
        })
    }

    /// The nodes that all fields have, and that are reached by all rounds that reach such nodes.
    fn covered(&self) -> TokenStream {
        let (mut firsts, mut ends) = (Vec::new(), Vec::new());
        for field in self.families() {
            let length = function(&format!("__l{field}"));
            ends.push(quote!(#length));
            for (e, k, ..) in self.gathered(field) {
                let Some(range) = self.elements[e].range else { continue };
                firsts.push(self.anchor(range.start.shifted(k)));
                ends.push(self.anchor(range.end.shifted(k)));
            }
        }
        quote! {
            let (mut __first_inside, mut __end_inside) = (0isize, __top);
            #(__first_inside = __first_inside.max(#firsts);)*
            #(__end_inside = __end_inside.min(#ends);)*
        }
    }

    /// Writes the values of nodes `__j`, with what stands before the loop.
    fn written(
        &self,
        fields: &[usize],
        before: &TokenStream,
        statements: &TokenStream,
        values: &[TokenStream],
    ) -> TokenStream {
        let outs: Vec<_> = fields.iter().map(|k| function(&format!("__y{k}"))).collect();
        let scales: Vec<_> = fields.iter().map(|k| function(&format!("__s{k}"))).collect();
        let places: Vec<_> = fields.iter().map(|k| function(&format!("__o{k}"))).collect();
        let pieces: Vec<_> = fields.iter().map(|k| function(&format!("__out{k}"))).collect();
        quote! {
            let __m = (__to - __from) as usize;
            #before
            #(let #outs = &mut #pieces[(__from - __begin) as usize..][..__m];)*
            if MODE == __loops::FORCES {
                for __j in 0..__m { #statements #(#outs[__j] = #values;)* }
            } else {
                #(let #scales = &__scale[(#places + __from) as usize..][..__m];)*
                if MODE == __loops::SCALED {
                    for __j in 0..__m { #statements #(#outs[__j] = #values * #scales[__j];)* }
                } else {
                    for __j in 0..__m { #statements #(#outs[__j] += __h * (#values * #scales[__j]);)* }
                }
            }
        }
    }

    /// A block inside, from buffers.
    fn written_inside(&self, field: usize) -> TokenStream {
        let (mut before, mut value) = (TokenStream::new(), quote!());
        for (s, (e, k, buffer, opposite)) in self.gathered(field).into_iter().enumerate() {
            let (lo, room) = (function(&format!("__lo{e}")), function(&format!("__g{e}_{buffer}")));
            let (name, k) = (function(&format!("__h{s}")), k as isize);
            before.extend(quote!(let #name = &#room[(__from - #k - #lo) as usize..][..__m];));
            value = match (s, opposite) {
                (0, false) => quote!(#name[__j]),
                (0, true) => quote!(-#name[__j]),
                (_, false) => quote!(#value + #name[__j]),
                (_, true) => quote!(#value - #name[__j]),
            };
        }
        let value = if value.is_empty() { quote!(0.0) } else { quote!((#value)) };
        let written = self.written(&[field], &before, &TokenStream::new(), &[value]);
        quote!({ #written })
    }

    /// A block inside, all fields at once, every node by itself.
    fn written_by_nodes(&self) -> TokenStream {
        let fields: Vec<usize> = self.families().collect();
        let roots: Vec<NodeId> = self.interior.iter().flatten().copied().collect();
        let (before, statements, values) = self.round(&roots, Reading::Slices);
        let values: Vec<TokenStream> = values.iter().map(|value| quote!((#value))).collect();
        let before = quote!(let __lo = __from; #before);
        self.written(&fields, &before, &statements, &values)
    }

    /// A block that some rounds do not cover.
    fn written_at_ends(&self, field: usize) -> TokenStream {
        let (length, sum) = (function(&format!("__l{field}")), function(&format!("__f{field}")));
        let gathered = self.gathered(field).into_iter().map(|(e, k, buffer, opposite)| {
            let (lo, hi) = (function(&format!("__lo{e}")), function(&format!("__hi{e}")));
            let (room, k) = (function(&format!("__g{e}_{buffer}")), k as isize);
            let sign = if opposite { quote!(-=) } else { quote!(+=) };
            quote! {
                let (__first, __last) = (__from.max(#lo + #k), __to.min(#hi + #k));
                if __first < __last {
                    let __m = (__last - __first) as usize;
                    let __y = &mut #sum[(__first - __from) as usize..][..__m];
                    let __g = &#room[(__first - #k - #lo) as usize..][..__m];
                    for __j in 0..__m { __y[__j] #sign __g[__j]; }
                }
            }
        });
        let written = self.written(&[field], &TokenStream::new(), &TokenStream::new(), &[quote!(#sum[__j])]);
        quote! {
            if __from < #length {
                let mut #sum = [0.0; __loops::BLOCK];
                #(#gathered)*
                let __to = __to.min(#length);
                #written
            }
        }
    }

    /// The forces that need a buffer each, and for every force its buffer and whether it is the opposite.
    fn buffers(&self, element: &Element) -> (Vec<NodeId>, Vec<(usize, bool)>) {
        let graph = &self.family.model.graph;
        let mut buffers: Vec<NodeId> = Vec::new();
        let used = element.forces.iter().map(|(_, node)| {
            for (k, known) in buffers.iter().enumerate() {
                if graph.fingerprint(*known) == graph.fingerprint(*node) {
                    return (k, false);
                }
                if graph.are_opposite(*known, *node) {
                    return (k, true);
                }
            }
            buffers.push(*node);
            (buffers.len() - 1, false)
        });
        let used = used.collect();
        (buffers, used)
    }

    /// The rounds of an element that reach a block, into buffers.
    fn rounds(
        &self,
        e: usize,
        element: &Element,
        [reductions, whole, totals]: [&mut Vec<TokenStream>; 3],
    ) -> TokenStream {
        let (buffers, used) = self.buffers(element);
        let (lo, hi) = (function(&format!("__lo{e}")), function(&format!("__hi{e}")));
        let first = function(&format!("__first{e}"));
        let rooms: Vec<_> = (0..buffers.len()).map(|k| function(&format!("__g{e}_{k}"))).collect();
        let (before, block) = self.block(&buffers, &rooms);
        let mut sums = TokenStream::new();
        for (s, ((a, _), (buffer, opposite))) in element.forces.iter().zip(used).enumerate() {
            let local = self.family.locals[*a];
            if !matches!(local.index, NodeIndex::Fixed(_)) {
                continue;
            }
            let (room, name, place) = (&rooms[buffer], function(&format!("__s{e}_{s}")), self.place(local));
            reductions.push(quote!(let mut #name = __loops::Sum::default();));
            let sign = if opposite { quote!(-) } else { quote!() };
            sums.extend(quote! {
                let (__first, __last) = (__from.max(#lo), __to.min(#hi));
                if __first < __last {
                    let __own = &#room[(__first - #lo) as usize..(__last - #lo) as usize];
                    #name.add(#sign __loops::block_sum(__own));
                }
            });
            let number = whole.len();
            whole.push(self.added(&quote!(__totals[#number]), &place));
            totals.push(quote!(#name.total()));
        }
        quote! {
            if #first < #hi {
                let (__lo, __m) = (#first, (#hi - #first) as usize);
                #before
                #(let #rooms = &mut #rooms[(#first - #lo) as usize..][..__m];)*
                #block
            }
            #sums
        }
    }

    /// Adds a force to what is written.
    fn added(&self, value: &TokenStream, place: &TokenStream) -> TokenStream {
        quote! {{
            let (__at, __value) = (#place, #value);
            __out[__at] += match MODE {
                __loops::FORCES => __value,
                __loops::SCALED => __value * __scale[__at],
                _ => __h * (__value * __scale[__at]),
            };
        }}
    }

    /// What has no rounds.
    fn once(&self, element: &Element) -> TokenStream {
        let roots: Vec<NodeId> = element.forces.iter().map(|(_, node)| *node).collect();
        let (before, statements, values) = self.round(&roots, Reading::Index);
        let added = element
            .forces
            .iter()
            .zip(values)
            .map(|((a, _), value)| self.added(&value, &self.place(self.family.locals[*a])));
        quote!({ #before #statements #(#added)* })
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
            let Some(range) = element.range else {
                let (before, statements, values) = self.round(&roots, Reading::Index);
                body.extend(quote!({ #before #statements #(#sums.add(#values);)* }));
                continue;
            };
            let (start, end) = (self.anchor(range.start), self.anchor(range.end));
            let rooms: Vec<_> = (0..roots.len()).map(|k| function(&format!("__g{k}"))).collect();
            let (before, block) = self.block(&roots, &rooms);
            body.extend(quote! {
                let (mut __lo, __hi) = (#start, #end);
                while __lo < __hi {
                    let __m = ((__hi - __lo) as usize).min(__loops::BLOCK);
                    #before
                    #(let mut #rooms = [0.0; __loops::BLOCK];)*
                    {
                        #(let #rooms = &mut #rooms[..__m];)*
                        #block
                    }
                    #(#sums.add(__loops::block_sum(&#rooms[..__m]));)*
                    __lo += __m as isize;
                }
            });
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
            body.extend(match element.range {
                None => quote!({ #before #statements #(#added)* }),
                Some(range) => {
                    let (start, end) = (self.anchor(range.start), self.anchor(range.end));
                    quote! {
                        if #start < #end { #before for __i in #start..#end { #statements #(#added)* } }
                    }
                }
            });
        }
        let sizes = self.sizes();
        if body.is_empty() { body } else { quote!(#sizes #body) }
    }
}
