//! The entries of the tangent stiffness, block by block of rounds.
//!
//! Every entry of an element that has a value of its own has a buffer for the rounds of a block, so that the
//! loop vectorises. What an entry of an element adds to the matrix, round by round, lies along a diagonal,
//! and is handed over in one piece.

use dynamics_symbolic::families::{Axis, Rounds};
use dynamics_symbolic::graph::NodeId;
use proc_macro2::TokenStream;
use quote::quote;

use super::super::function;
use super::loops::{Loops, Reading, Stretch};

impl Loops<'_> {
    /// Whether the matrices of all elements are symmetric.
    pub(super) fn is_symmetric(&self) -> bool {
        let graph = &self.family.model.graph;
        let both = |entries: &[(usize, usize, NodeId)]| {
            entries.iter().all(|(a, b, node)| {
                let mirrored = entries.iter().find(|(c, d, _)| (c, d) == (b, a));
                mirrored.is_some_and(|(.., other)| graph.fingerprint(*node) == graph.fingerprint(*other))
            })
        };
        let elements = &mut self.elements.iter();
        elements.all(|element| both(&element.mass) && both(&element.stiffness) && both(&element.damping))
    }

    /// `__Stiffness`, a pass that hands over the entries of −∂Q/∂q.
    pub(super) fn stiffness(&self) -> TokenStream {
        let (model, private) = (&self.surface.target, self.surface.private());
        let f64 = quote!(#private::f64);
        let (sizes, mut body) = (self.sizes(), TokenStream::new());
        for element in self.elements.iter().filter(|element| !element.stiffness.is_empty()) {
            let mut distinct: Vec<NodeId> = element.stiffness.iter().map(|(.., node)| *node).collect();
            distinct.sort_unstable();
            distinct.dedup();
            let Some(reading) = Reading::of_lanes(element.rounds) else {
                let (before, statements, values) = self.round(&distinct, Reading::Index);
                let added = element.stiffness.iter().map(|(a, b, node)| {
                    let [row, column] = [a, b].map(|a| self.place(self.family.locals[*a]));
                    let value = &values[distinct.iter().position(|known| known == node).unwrap_or(0)];
                    quote!(__add(#row, #column, &[#value]);)
                });
                body.extend(quote!({ #before #statements #(#added)* }));
                continue;
            };
            let rooms: Vec<_> = (0..distinct.len()).map(|k| function(&format!("__g{k}"))).collect();
            let (before, block) = self.block(&distinct, reading, &rooms);
            let lane = if matches!(element.rounds, Rounds::Nested(..)) { Axis::Second } else { Axis::First };
            let added = element.stiffness.iter().map(|(a, b, node)| {
                let locals = [a, b].map(|a| self.family.locals[*a]);
                let room = &rooms[distinct.iter().position(|known| known == node).unwrap_or(0)];
                let runs = locals.iter().all(|local| self.stretch(*local, lane) == Stretch::Contiguous);
                let [row, column] = locals.map(|local| self.place_in_lanes(local, lane, runs));
                match runs {
                    true => quote!(__add(#row, #column, &#room[..__m]);),
                    false => quote!(for __j in 0..__m { __add(#row, #column, &#room[__j..=__j]); }),
                }
            });
            let block = quote! {
                #before
                #(let mut #rooms = [0.0; __loops::MATRIX_BLOCK];)*
                {
                    #(let #rooms = &mut #rooms[..__m];)*
                    #block
                }
                #(#added)*
            };
            let (size, none) = (quote!(__loops::MATRIX_BLOCK), TokenStream::new());
            body.extend(self.in_blocks(element.rounds, &size, &block, &none, &none));
        }
        let families = quote!(#private::families);
        quote! {
            struct __Stiffness<'a, 'b> {
                model: &'a #model, t: #f64, q: &'a [#f64], u: &'a [#f64], w: &'a [#f64],
                add: &'a mut #families::Runs<'b>,
            }
            impl __loops::Pass for __Stiffness<'_, '_> {
                type Output = ();
                #[inline(always)]
                fn run(self) {
                    let Self { model: __model, t: __t, q: __q, u: __u, w: __w, add: __add } = self;
                    #sizes
                    #body
                }
            }
        }
    }
}
