//! Forces of elements of one loop on nodes with one index.
//!
//! Forces go block by block of nodes. For every block the rounds that reach it are made: the forces of an
//! element go into a buffer each, which stays in the first-level cache, and are then gathered at the nodes.
//! Both loops run over exact slices and vectorise; a loop that scatters does not. Forces that are opposite
//! share a buffer. A block that all rounds cover, which all are but those at the ends, needs no sums in
//! memory: its nodes gather and are written in one loop. Where elements are cheap, such a block needs no
//! buffers either: every node makes its elements again. What an element gives to a node that is the same in
//! every round is a sum over its rounds; every round is counted in the block that holds its index.

use dynamics_symbolic::families::{self, Axis, Element, Gathering, Given, NodeIndex, Range};
use dynamics_symbolic::graph::{Node, NodeId, Symbol};
use proc_macro2::TokenStream;
use quote::quote;

use super::Loops;
use super::reading::Reading;
use crate::emit::function;

/// The loop over blocks of nodes.
pub(super) struct Line {
    /// The number of nodes, or of rounds where there are more.
    pub(super) top: TokenStream,
    /// The loop over the nodes from `__begin` to before `__end`; it has the totals of sums over the rounds.
    pub(super) body: TokenStream,
    /// Adds these totals, `__totals`, to what is written.
    pub(super) whole: Vec<TokenStream>,
    /// How many there are.
    pub(super) sums: usize,
}

impl Loops<'_> {
    /// Elements of one loop that give forces, with their numbers.
    fn with_rounds(&self) -> impl Iterator<Item = (usize, &Element, Range)> {
        self.elements_of(Gathering::Line).map(|(e, element, range, _)| (e, element, range))
    }

    fn gathered_in_line(&self, field: usize) -> Vec<Given> {
        self.gathered(field, Gathering::Line)
    }

    /// Whether nodes make the forces of their elements anew.
    fn is_cheap(&self) -> bool {
        families::is_cheap(self.family, self.elements, self.interior)
    }

    /// The nodes of all fields with one index.
    pub(super) fn line_forces(&self) -> Line {
        let mut tops: Vec<TokenStream> =
            self.lines().map(|k| function(&format!("__l{k}"))).map(|l| quote!(#l)).collect();
        tops.extend(self.with_rounds().map(|(.., range)| self.anchor(range.end)));
        let top = quote!(0isize #(.max(#tops))*);
        let (mut reductions, mut whole, mut totals) = (Vec::new(), Vec::new(), Vec::new());
        let (mut rounds, mut bounds, mut rooms) = (Vec::new(), Vec::new(), Vec::new());
        let (mut none_made, mut forgotten) = (Vec::new(), Vec::new());
        for (e, element, range) in self.with_rounds() {
            let [lo, hi, first] = ["lo", "hi", "first"].map(|name| function(&format!("__{name}{e}")));
            // A round is made for the block that holds its index, too.
            let (below, above) = element.reach(self.family, Axis::First).unwrap_or((0, 0));
            let (below, above) = (below.min(0) as isize, above.max(0) as isize);
            let (start, end) = (self.anchor(range.start), self.anchor(range.end));
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
            none_made.push(quote!(let (mut #lo, mut #hi) = (0isize, 0isize);));
            forgotten.push(quote!((#lo, #hi) = (0, 0);));
            rooms.extend(own);
            rounds.push(self.rounds(e, element, [&mut reductions, &mut whole, &mut totals]));
        }
        let covered = self.covered();
        let inside = quote!(__first_inside <= __from && __to <= __end_inside);
        let at_ends: Vec<TokenStream> = self.lines().map(|field| self.written_at_ends(field)).collect();
        let block = if self.is_cheap() {
            let nodes = self.written_by_nodes();
            quote!(if #inside { #(#forgotten)* #nodes } else { #(#rounds)* #(#at_ends)* })
        } else {
            let written = self.lines().map(|field| self.written_inside(field));
            quote!(#(#rounds)* if #inside { #(#written)* } else { #(#at_ends)* })
        };
        let body = quote! {
            const __MOST: usize = __loops::ROUNDS;
            let __top = #top;
            #(#reductions)*
            #(let mut #rooms = [0.0; __loops::ROUNDS];)*
            #covered
            #(#none_made)*
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
        };
        Line { top, body, sums: whole.len(), whole }
    }

    /// Whether forces at a node depend on nodes nearby and on ordinary coordinates alone, and no node has a
    /// sum over all rounds.
    pub(super) fn line_is_local(&self) -> bool {
        let graph = &self.family.model.graph;
        let far = |l: u32| {
            let local = self.family.locals[l as usize];
            let is_family = self.family.fields[local.field as usize].length.is_some();
            is_family && matches!(local.index, NodeIndex::Fixed(_))
        };
        let of_node = |id: NodeId| match graph.node(id) {
            Node::Symbol(Symbol::Coordinate(l) | Symbol::Rate(l)) => far(l),
            _ => false,
        };
        let summed = |a: usize| matches!(self.family.locals[a].index, NodeIndex::Fixed(_));
        !self
            .with_rounds()
            .flat_map(|(_, element, _)| &element.forces)
            .any(|(a, force)| summed(*a) || graph.cone(&[*force]).into_iter().any(of_node))
    }

    /// The nodes that all fields have, and that are reached by all rounds that reach such nodes.
    fn covered(&self) -> TokenStream {
        let (mut firsts, mut ends) = (Vec::new(), Vec::new());
        for field in self.lines() {
            let length = function(&format!("__l{field}"));
            ends.push(quote!(#length));
            for Given { element, offsets: [k, _], .. } in self.gathered_in_line(field) {
                let Some(range) = self.elements[element].rounds.range(Axis::First) else { continue };
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

    /// A block inside, from buffers.
    fn written_inside(&self, field: usize) -> TokenStream {
        let mut before = TokenStream::new();
        let given = self.gathered_in_line(field);
        for (s, Given { element, offsets: [k, _], buffer, .. }) in given.iter().enumerate() {
            let (lo, room) =
                (function(&format!("__lo{element}")), function(&format!("__g{element}_{buffer}")));
            let (name, k) = (function(&format!("__h{s}")), *k as isize);
            before.extend(quote!(let #name = &#room[(__from - #k - #lo) as usize..][..__m];));
        }
        let written = self.written(&[field], &before, &TokenStream::new(), &[Self::sum_of(&given)]);
        quote!({ let __m = (__to - __from) as usize; #written })
    }

    /// A block inside, all fields at once, every node by itself.
    fn written_by_nodes(&self) -> TokenStream {
        let fields: Vec<usize> = self.lines().collect();
        let roots: Vec<NodeId> = self.interior.iter().flatten().copied().collect();
        let (before, statements, values) = self.round(&roots, Reading::Lanes(Axis::First));
        let values: Vec<TokenStream> = values.iter().map(|value| quote!((#value))).collect();
        let written = self.written(&fields, &before, &statements, &values);
        quote!(let (__lo, __m) = (__from, (__to - __from) as usize); #written)
    }

    /// A block that some rounds do not cover.
    fn written_at_ends(&self, field: usize) -> TokenStream {
        let (length, sum) = (function(&format!("__l{field}")), function(&format!("__f{field}")));
        let gathered = self.gathered_in_line(field).into_iter().map(|given| {
            let Given { element, offsets: [k, _], buffer, opposite } = given;
            let [lo, hi] = ["lo", "hi"].map(|name| function(&format!("__{name}{element}")));
            let (room, k) = (function(&format!("__g{element}_{buffer}")), k as isize);
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
                let __m = (__to.min(#length) - __from) as usize;
                #written
            }
        }
    }

    /// The rounds of an element that reach a block, into buffers.
    fn rounds(
        &self,
        e: usize,
        element: &Element,
        [reductions, whole, totals]: [&mut Vec<TokenStream>; 3],
    ) -> TokenStream {
        let (buffers, used) = self.buffers(element);
        let [lo, hi, first] = ["lo", "hi", "first"].map(|name| function(&format!("__{name}{e}")));
        let rooms: Vec<_> = (0..buffers.len()).map(|k| function(&format!("__g{e}_{k}"))).collect();
        let (before, block) = self.block(&buffers, Reading::Lanes(Axis::First), &rooms);
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
}
