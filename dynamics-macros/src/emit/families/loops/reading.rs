//! Where a round finds what it reads.

use std::collections::BTreeMap;

use dynamics_symbolic::families::{Axis, Local, NodeIndex, Rounds, Source};
use dynamics_symbolic::graph::{Node, NodeId, Symbol};
use proc_macro2::TokenStream;
use quote::quote;

use super::Loops;
use crate::emit::families::field;
use crate::emit::function;

/// Where a round finds what it reads.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(in super::super) enum Reading {
    /// In slices of `__m` rounds from `__lo` on, at most `__MOST`, at `__j`: rounds along this index. Another
    /// index has its name.
    Lanes(Axis),
    /// By the indices of the round.
    Index,
}

impl Reading {
    /// Slices along the innermost index; `None` without rounds.
    pub(in super::super) fn of_lanes(rounds: Rounds) -> Option<Self> {
        match rounds {
            Rounds::Once => None,
            Rounds::Over(_) => Some(Self::Lanes(Axis::First)),
            Rounds::Nested(..) => Some(Self::Lanes(Axis::Second)),
        }
    }
}

/// The nodes of a block of rounds in memory.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(in super::super) enum Stretch {
    /// One and the same.
    Same,
    /// One after the other.
    Contiguous,
    /// Apart from one another.
    Apart,
}

/// The variable of an index.
pub(super) fn index_name(axis: Axis) -> syn::Ident {
    match axis {
        Axis::First => function("__i"),
        Axis::Second => function("__k"),
    }
}

impl Loops<'_> {
    /// An index of a node as an expression of type `isize`, given those of the round.
    fn index(&self, index: NodeIndex, of: &dyn Fn(Axis) -> TokenStream) -> TokenStream {
        match index {
            NodeIndex::Round(axis, k) => {
                let (index, k) = (of(axis), k as isize);
                if k == 0 { index } else { quote!((#index + #k)) }
            }
            NodeIndex::Fixed(anchor) => self.anchor(anchor),
        }
    }

    /// Where the node of a local is in q, of type `isize`, given the indices of the round.
    fn place_at(&self, local: Local, of: &dyn Fn(Axis) -> TokenStream) -> TokenStream {
        let offset = function(&format!("__o{}", local.field));
        let row = self.index(local.index, of);
        match local.column {
            None => quote!(#offset + #row),
            Some(column) => {
                let (columns, column) = (function(&format!("__c{}", local.field)), self.index(column, of));
                quote!(#offset + #row * #columns + #column)
            }
        }
    }

    /// Where the node of a local is in q, in the round of these indices.
    pub(in super::super) fn place(&self, local: Local) -> TokenStream {
        let place = self.place_at(local, &|axis| {
            let name = index_name(axis);
            quote!(#name)
        });
        quote!((#place) as usize)
    }

    /// Where the node of round `__j`, or of the first round of a block, is in q.
    pub(in super::super) fn place_in_lanes(&self, local: Local, lane: Axis, first: bool) -> TokenStream {
        let place = self.place_at(local, &|axis| match (axis == lane, first) {
            (true, true) => quote!(__lo),
            (true, false) => quote!((__lo + __j as isize)),
            (false, _) => {
                let name = index_name(axis);
                quote!(#name)
            }
        });
        quote!((#place) as usize)
    }

    /// How the nodes of a local lie in memory, in a block of rounds along an index.
    pub(in super::super) fn stretch(&self, local: Local, lane: Axis) -> Stretch {
        let moves = |index: NodeIndex| matches!(index, NodeIndex::Round(axis, _) if axis == lane);
        match (moves(local.index), local.column.map(moves)) {
            (false, None | Some(false)) => Stretch::Same,
            (true, None) | (false, Some(true)) => Stretch::Contiguous,
            (true, Some(_)) => Stretch::Apart,
        }
    }

    /// What stands before the rounds, and how symbols are written in one.
    pub(super) fn reading(
        &self,
        roots: &[NodeId],
        reading: Reading,
    ) -> (TokenStream, BTreeMap<Symbol, String>) {
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
        let ident = function(name);
        let moves = [Some(local.index), local.column].into_iter().flatten().any(|i| i.offset().is_some());
        match reading {
            Reading::Index if moves => {
                let place = self.place(local);
                quote!(#all[#place]).to_string()
            }
            Reading::Index => {
                let place = self.place(local);
                before.extend(quote!(let #ident = #all[#place];));
                name.to_owned()
            }
            Reading::Lanes(lane) => {
                let first = self.place_in_lanes(local, lane, true);
                match self.stretch(local, lane) {
                    Stretch::Same => {
                        before.extend(quote!(let #ident = #all[#first];));
                        return name.to_owned();
                    }
                    Stretch::Contiguous => before.extend(quote!(let #ident = &#all[#first..][..__m];)),
                    // Brought together first, so that what follows vectorises.
                    Stretch::Apart => {
                        let place = self.place_in_lanes(local, lane, false);
                        before.extend(quote! {
                            let mut #ident = [0.0; __MOST];
                            for __j in 0..__m { #ident[__j] = #all[#place]; }
                            let #ident = &#ident[..__m];
                        });
                    }
                }
                format!("{name}[__j]")
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
            Source::Round(axis) if reading == Reading::Lanes(axis) => {
                before.extend(quote!(let (__index, __numbers) = (__lo as f64, &__loops::NUMBERS[..__m]);));
                "(__index+__numbers[__j])".to_owned()
            }
            Source::Round(axis) => format!("({} as f64)", index_name(axis)),
            Source::Numbered { parameter, index } => {
                let field = field(&self.family.numbered[parameter as usize]);
                let (name, text) = (function(&format!("__p{p}")), format!("__p{p}"));
                match (index, reading) {
                    (NodeIndex::Round(axis, k), Reading::Lanes(lane)) if axis == lane => {
                        let k = k as isize;
                        before.extend(quote!(let #name = &__model.#field[(__lo + #k) as usize..][..__m];));
                        format!("__p{p}[__j]")
                    }
                    (NodeIndex::Round(axis, k), Reading::Lanes(_)) => {
                        let (index, k) = (index_name(axis), k as isize);
                        before.extend(quote!(let #name = __model.#field[(#index + #k) as usize];));
                        text
                    }
                    (NodeIndex::Round(axis, k), Reading::Index) => {
                        let (index, k) = (index_name(axis), k as isize);
                        quote!(__model.#field[(#index + #k) as usize]).to_string()
                    }
                    (NodeIndex::Fixed(anchor), _) => {
                        let anchor = self.anchor(anchor);
                        before.extend(quote!(let #name = __model.#field[#anchor as usize];));
                        text
                    }
                }
            }
        }
    }
}
