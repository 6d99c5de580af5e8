//! Forces that are added to what is written: of what has no rounds, and of elements at the edges of a grid.
//!
//! The forces of a block of rounds go into a buffer each. Where their nodes follow one another, they are
//! added in a loop that vectorises.

use dynamics_symbolic::families::{Axis, Element, NodeIndex, Rounds};
use dynamics_symbolic::graph::NodeId;
use proc_macro2::TokenStream;
use quote::quote;

use super::Loops;
use super::reading::{Reading, Stretch};
use crate::emit::function;

impl Loops<'_> {
    /// Adds a force to what is written.
    pub(super) fn added(&self, value: &TokenStream, place: &TokenStream) -> TokenStream {
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
    pub(super) fn once(&self, element: &Element) -> TokenStream {
        let roots: Vec<NodeId> = element.forces.iter().map(|(_, node)| *node).collect();
        let (before, statements, values) = self.round(&roots, Reading::Index);
        let added = element
            .forces
            .iter()
            .zip(values)
            .map(|((a, _), value)| self.added(&value, &self.place(self.family.locals[*a])));
        quote!({ #before #statements #(#added)* })
    }

    /// The forces of an element with rounds, every round of which adds to its nodes.
    pub(super) fn added_forces(&self, element: &Element) -> TokenStream {
        let lane = match element.rounds {
            Rounds::Nested(..) => Axis::Second,
            _ => Axis::First,
        };
        let (buffers, used) = self.buffers(element);
        let rooms: Vec<_> = (0..buffers.len()).map(|k| function(&format!("__g{k}"))).collect();
        let (before, rounds) = self.block(&buffers, Reading::Lanes(lane), &rooms);
        let (mut sums, mut whole) = (TokenStream::new(), TokenStream::new());
        let (mut row_sums, mut row_whole) = (TokenStream::new(), TokenStream::new());
        let mut adds = TokenStream::new();
        for (s, ((a, _), (buffer, opposite))) in element.forces.iter().zip(used).enumerate() {
            let (local, room, name) = (self.family.locals[*a], &rooms[buffer], function(&format!("__s{s}")));
            let sign = if opposite { quote!(-) } else { quote!() };
            let first = self.place_in_lanes(local, lane, true);
            match self.stretch(local, lane) {
                Stretch::Same => {
                    adds.extend(quote!(#name.add(#sign __loops::block_sum(&#room[..__m]));));
                    let (sum, total) =
                        (quote!(let mut #name = __loops::Sum::default();), quote!(#name.total()));
                    let fixed = |index: NodeIndex| index.offset().is_none();
                    // The same node in all rows, or one in every row.
                    let (sums, whole) = match fixed(local.index) && local.column.is_none_or(fixed) {
                        true => (&mut sums, &mut whole),
                        false => (&mut row_sums, &mut row_whole),
                    };
                    sums.extend(sum);
                    whole.extend(self.added(&total, &first));
                }
                Stretch::Contiguous => adds.extend(quote! {{
                    let (__at, __room) = (#first, &#room[..__m]);
                    let __y = &mut __out[__at..][..__m];
                    if MODE == __loops::FORCES {
                        for __j in 0..__m { __y[__j] += #sign __room[__j]; }
                    } else {
                        let __s = &__scale[__at..][..__m];
                        if MODE == __loops::SCALED {
                            for __j in 0..__m { __y[__j] += #sign __room[__j] * __s[__j]; }
                        } else {
                            for __j in 0..__m { __y[__j] += __h * (#sign __room[__j] * __s[__j]); }
                        }
                    }
                }}),
                Stretch::Apart => {
                    let place = self.place_in_lanes(local, lane, false);
                    let added = self.added(&quote!(#sign #room[__j]), &place);
                    adds.extend(quote!(for __j in 0..__m #added));
                }
            }
        }
        let block = quote! {
            #before
            #(let mut #rooms = [0.0; __loops::EDGE];)*
            {
                #(let #rooms = &mut #rooms[..__m];)*
                #rounds
            }
            #adds
        };
        let blocks = self.in_blocks(element.rounds, &quote!(__loops::EDGE), &block, &row_sums, &row_whole);
        quote!({ #sums #blocks #whole })
    }
}
