//! Results as vectors, matrices and slices.
//!
//! A large matrix is mostly zeros: of one with more than [`MOST_WRITTEN_DENSE`] elements only the others are
//! written, and of a symmetric one half of them.

use proc_macro2::{Literal, TokenStream, TokenTree};
use quote::quote;

use super::super::local;
use super::Emission;

/// Most elements of a matrix that are all written, zero or not. Of a larger one only the others are written.
const MOST_WRITTEN_DENSE: usize = 400;
/// Statements of one block. A long chain of them in one block takes rustc long to compile.
const STATEMENTS_OF_BLOCK: usize = 256;

impl Emission<'_> {
    /// `SVector` of expressions.
    pub(super) fn vector(&self, elements: &[TokenStream]) -> TokenStream {
        let private = &self.private;
        quote!(#private::vector([#(#elements),*]))
    }

    /// `SMatrix` of expressions given by rows.
    pub(super) fn matrix(&self, elements: &[TokenStream], columns: usize) -> TokenStream {
        let private = &self.private;
        if elements.len() > MOST_WRITTEN_DENSE {
            let (matrix, rows) = (local("matrix"), elements.len() / columns);
            let places = nonzero(elements).map(|(i, element)| (i / columns, i % columns, element));
            let symmetric = is_symmetric(elements, columns);
            let places = places.filter(|(i, j, _)| !symmetric || j <= i);
            let places: Vec<_> = places.map(|(i, j, element)| (j * rows + i, element)).collect();
            let flat = quote!(#matrix.as_flattened_mut());
            let assignments = self.scattered(&flat, &places).unwrap_or_else(|| {
                let assignment = |(at, element): (usize, &TokenStream)| {
                    let (j, i) = (at / rows, at % rows);
                    quote!(#matrix[#j][#i] = #element;)
                };
                blocks(places.into_iter().map(assignment).collect())
            });
            let (i, j) = (local("i"), local("j"));
            let mirrored = symmetric.then(
                || quote!(for #i in 0..#rows { for #j in 0..#i { #matrix[#i][#j] = #matrix[#j][#i]; } }),
            );
            return quote!({
                let mut #matrix = [[0.0; #rows]; #columns];
                #assignments
                #mirrored
                #private::matrix(#matrix)
            });
        }
        let columns = (0..columns).map(|j| {
            let column = elements.iter().skip(j).step_by(columns);
            quote!([#(#column),*])
        });
        quote!(#private::matrix([#(#columns),*]))
    }

    /// Writes expressions to a slice that is at least as long.
    pub(super) fn write(&self, slice: &TokenStream, elements: &[TokenStream]) -> TokenStream {
        let count = elements.len();
        if count <= MOST_WRITTEN_DENSE {
            return quote!(#slice[..#count].copy_from_slice(&[#(#elements),*]););
        }
        let places: Vec<_> = nonzero(elements).collect();
        let assignments = self.scattered(slice, &places).unwrap_or_else(|| {
            blocks(places.into_iter().map(|(i, element)| quote!(#slice[#i] = #element;)).collect())
        });
        quote!(#slice[..#count].fill(0.0); #assignments)
    }

    /// Writes expressions to their places in a slice by a table, where all of them stand in the array of
    /// values.
    fn scattered(&self, slice: &TokenStream, elements: &[(usize, &TokenStream)]) -> Option<TokenStream> {
        if elements.is_empty() {
            // All are zero: there need not be an array of values.
            return None;
        }
        let pair = |(to, element): &(usize, &TokenStream)| Some([u32::try_from(*to).ok()?, place(element)?]);
        let pairs = elements.iter().map(pair).collect::<Option<Vec<_>>>()?;
        let bytes: Vec<u8> = pairs.into_iter().flatten().flat_map(u32::to_le_bytes).collect();
        let (private, pairs, x) = (&self.private, Literal::byte_string(&bytes), local("x"));
        Some(quote!(#private::table::scatter(#pairs, #x, &mut #slice[..]);))
    }
}

/// The place in the array of values that an expression reads, if it does nothing else: `__x[7]`.
fn place(element: &TokenStream) -> Option<u32> {
    let mut trees = element.clone().into_iter();
    let (Some(TokenTree::Ident(array)), Some(TokenTree::Group(index)), None) =
        (trees.next(), trees.next(), trees.next())
    else {
        return None;
    };
    if array != local("x") { None } else { index.stream().to_string().parse().ok() }
}

/// Whether a matrix of expressions by rows is its transpose, word for word.
fn is_symmetric(elements: &[TokenStream], columns: usize) -> bool {
    let texts: Vec<String> = elements.iter().map(TokenStream::to_string).collect();
    let same = |i: usize, j: usize| texts[i * columns + j] == texts[j * columns + i];
    elements.len() == columns * columns && (0..columns).all(|i| (0..i).all(|j| same(i, j)))
}

/// The expressions that are not the literal 0, with their places.
fn nonzero(elements: &[TokenStream]) -> impl Iterator<Item = (usize, &TokenStream)> {
    elements.iter().enumerate().filter(|(_, element)| element.to_string() != "0.0")
}

/// Statements in nested blocks: a long chain of them in one block is hard on the compiler.
fn blocks(statements: Vec<TokenStream>) -> TokenStream {
    statements.chunks(STATEMENTS_OF_BLOCK).map(|block| quote!({ #(#block)* })).collect()
}
