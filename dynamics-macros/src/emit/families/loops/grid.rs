//! Forces of elements of two loops on grids.
//!
//! Nodes go row by row, in blocks of columns. When the forces at a row are gathered, the forces of the rows
//! of elements that reach it are in buffers, which stay in the first-level cache: as many rows of them as an
//! element reaches, the newest in the place of the oldest. Where there is no element, buffers hold zeros, so
//! that nodes at the edges gather as all others. Every element is made once for each block of columns, and
//! both loops run over exact slices along the columns.

use dynamics_symbolic::families::{Axis, Element, Gathering, Given, Range};
use proc_macro2::TokenStream;
use quote::quote;

use super::Loops;
use super::reading::Reading;
use crate::emit::function;

/// Numbers in buffers that stay in the first-level cache.
const MOST_KEPT: usize = 3072;

/// How an element is kept.
struct Kept {
    /// How far below and above the row of the element its nodes are.
    rows: (i64, i64),
    /// Likewise along the columns.
    columns: (i64, i64),
    buffers: usize,
}

impl Kept {
    /// How many rows of the element are kept.
    fn depth(&self) -> i64 {
        self.rows.1 - self.rows.0 + 1
    }

    /// In which of them a row of elements is.
    fn slot(&self, row: &TokenStream) -> TokenStream {
        match self.depth() as isize {
            1 => quote!(0usize),
            depth => quote!(((#row).rem_euclid(#depth) as usize)),
        }
    }
}

impl Loops<'_> {
    fn with_two_loops(&self) -> impl Iterator<Item = (usize, &Element, Range, Range)> {
        let all = self.elements_of(Gathering::Grid);
        all.filter_map(|(e, element, outer, inner)| Some((e, element, outer, inner?)))
    }

    fn kept(&self, element: &Element) -> Kept {
        let [rows, columns] = Axis::ALL.map(|axis| element.reach(self.family, axis).unwrap_or((0, 0)));
        Kept { rows, columns, buffers: self.buffers(element).0.len() }
    }

    /// The nodes of all grids.
    pub(super) fn grid_forces(&self) -> TokenStream {
        if self.grids().next().is_none() {
            return TokenStream::new();
        }
        let (mut rooms, mut depths, mut bounds, mut rounds) =
            (Vec::new(), Vec::new(), Vec::new(), Vec::new());
        let mut deepest = 1;
        for (e, element, outer, inner) in self.with_two_loops() {
            let kept = self.kept(element);
            deepest = deepest.max(kept.depth());
            rooms.extend((0..kept.buffers).map(|k| function(&format!("__g{e}_{k}"))));
            depths.extend((0..kept.buffers).map(|_| kept.depth() as usize));
            let [lo, hi] = ["lo", "hi"].map(|name| function(&format!("__{name}{e}")));
            let (below, above) = (kept.columns.0 as isize, kept.columns.1 as isize);
            let (start, end) = self.ends(inner);
            bounds.push(quote! {
                let #lo = (__from - #above).max(#start);
                let #hi = (__to - #below).min(#end);
            });
            rounds.push(self.row_of_elements(e, element, outer, &kept));
        }
        // Smaller blocks where many rows are kept.
        let kept: usize = depths.iter().sum();
        let width = (MOST_KEPT / kept.max(1) / 64 * 64).clamp(64, 320);
        let (first, width) = (1 - deepest as isize, width as isize);
        let (room, gathered) = (width as usize + 32, self.grids().map(|field| self.gathered_row(field)));
        let named =
            |name: &str| -> Vec<_> { self.grids().map(|k| function(&format!("__{name}{k}"))).collect() };
        let (lengths, columns) = (named("l"), named("c"));
        quote! {{
            const __MOST: usize = #room;
            let (mut __rows, mut __columns) = (0isize, 0isize);
            #(__rows = __rows.max(#lengths); __columns = __columns.max(#columns);)*
            #(let mut #rooms = [[0.0; __MOST]; #depths];)*
            let mut __from = 0isize;
            while __from < __columns {
                let __to = (__from + #width).min(__columns);
                #(#bounds)*
                if __from > 0 {
                    #(for __room in &mut #rooms { __room.fill(0.0); })*
                }
                let mut __row = #first;
                while __row < __rows {
                    #(#rounds)*
                    #(#gathered)*
                    __row += 1;
                }
                __from = __to;
            }
        }}
    }

    /// The row of elements that is the last to reach row `__row` of nodes, into buffers.
    fn row_of_elements(&self, e: usize, element: &Element, outer: Range, kept: &Kept) -> TokenStream {
        let (buffers, _) = self.buffers(element);
        let [lo, hi] = ["lo", "hi"].map(|name| function(&format!("__{name}{e}")));
        let rooms: Vec<_> = (0..buffers.len()).map(|k| function(&format!("__g{e}_{k}"))).collect();
        let (before, block) = self.block(&buffers, Reading::Lanes(Axis::Second), &rooms);
        let (start, end) = self.ends(outer);
        let (below, above) = (kept.rows.0 as isize, kept.columns.1 as isize);
        let slot = kept.slot(&quote!(__i));
        quote! {{
            let __i = __row - #below;
            if #start <= __i && __i < #end && #lo < #hi {
                let (__lo, __m) = (#lo, (#hi - #lo) as usize);
                let (__slot, __begin) = (#slot, (#lo + #above - __from) as usize);
                #before
                #(let #rooms = &mut #rooms[__slot][__begin..][..__m];)*
                #block
            } else if __i >= #end {
                let __slot = #slot;
                #(#rooms[__slot].fill(0.0);)*
            }
        }}
    }

    /// The nodes of row `__row` of a field.
    fn gathered_row(&self, field: usize) -> TokenStream {
        let [length, columns, offset] = ["l", "c", "o"].map(|name| function(&format!("__{name}{field}")));
        let given = self.gathered(field, Gathering::Grid);
        let (mut names, mut reads) = (Vec::new(), Vec::new());
        for (s, Given { element, offsets: [row, column], buffer, .. }) in given.iter().enumerate() {
            let kept = self.kept(&self.elements[*element]);
            let room = function(&format!("__g{element}_{buffer}"));
            let row = *row as isize;
            let (slot, begin) = (kept.slot(&quote!(__row - #row)), (kept.columns.1 - column) as usize);
            names.push(function(&format!("__h{s}")));
            reads.push(quote!(&#room[#slot][#begin..][..__m]));
        }
        let (name, value) = (function(&format!("__gather{field}")), Self::sum_of(&given));
        let private = self.surface.private();
        // Arguments of a function do not overlap, so that its loops need no checks of that to vectorise.
        quote! {
            #[inline(always)]
            fn #name<const MODE: #private::u8>(__y: &mut [f64], __s: &[f64], __h: f64 #(, #names: &[f64])*) {
                let __m = __y.len();
                #(let #names = &#names[..__m];)*
                if MODE == __loops::FORCES {
                    for __j in 0..__m { __y[__j] = #value; }
                    return;
                }
                let __s = &__s[..__m];
                if MODE == __loops::SCALED {
                    for __j in 0..__m { __y[__j] = #value * __s[__j]; }
                } else {
                    for __j in 0..__m { __y[__j] += __h * (#value * __s[__j]); }
                }
            }
            if 0 <= __row && __row < #length && __from < #columns {
                let __m = (__to.min(#columns) - __from) as usize;
                let __at = (#offset + __row * #columns + __from) as usize;
                let __s: &[f64] = if MODE == __loops::FORCES { &[] } else { &__scale[__at..][..__m] };
                #name::<MODE>(&mut __out[__at..][..__m], __s, __h #(, #reads)*);
            }
        }
    }
}
