//! Guards before `syn` sees the tokens: its parser recurses, so depth must be bounded first.

use proc_macro2::{TokenStream, TokenTree};

use crate::diagnostics::Diagnostics;
use crate::messages;

/// Deepest nesting of delimiters. rustc stops at 128 levels of macro recursion; models use about ten.
const MOST_NESTED_DELIMITERS: usize = 64;
/// Most tokens between two separators (`;` or `,`) of one level. They bound the depth of a chain of
/// operators.
const LONGEST_CHAIN: usize = 4000;
/// Most tokens of one stretch that make a parser recurse to the right: prefix operators, assignments,
/// closures, generics.
const MOST_RECURSING: usize = 200;

/// Keywords after which an expression, a type or an item goes on inside itself.
const ENTERING: &[&str] = &[
    "return", "break", "yield", "else", "if", "while", "match", "for", "in", "let", "loop", "move", "static",
    "async", "unsafe", "const", "fn", "dyn", "impl", "mut", "ref",
];

/// Refuses streams that a recursive parser should not see. `None` after an error.
pub(crate) fn check_nesting(tokens: &TokenStream, diagnostics: &mut Diagnostics) -> Option<()> {
    let mut left = vec![(tokens.clone(), 0)];
    while let Some((stream, depth)) = left.pop() {
        let (mut chain, mut right) = (0usize, 0usize);
        let (mut arrow, mut block) = (false, false);
        for tree in stream {
            chain += 1;
            // A `{ .. }` ends a statement or item, unless `else` or an operator goes on.
            if block && !goes_on(&tree) {
                right = 0;
            }
            (block, chain) = if is_block(&tree) { (true, 0) } else { (false, chain) };
            match &tree {
                TokenTree::Punct(p) if matches!(p.as_char(), ';' | ',') => (chain, right) = (0, 0),
                TokenTree::Punct(p) if "!&=|<-*#".contains(p.as_char()) => right += 1,
                TokenTree::Ident(i) if ENTERING.iter().any(|keyword| i == keyword) => right += 1,
                TokenTree::Group(g) => left.push((g.stream(), depth + 1)),
                // `fn() -> fn() -> ..` nests; a lone `>` closes or compares.
                TokenTree::Punct(p) if p.as_char() == '>' && arrow => {}
                TokenTree::Punct(p) if "+/%>".contains(p.as_char()) => right = right.saturating_sub(1),
                _ => {}
            }
            arrow = matches!(&tree, TokenTree::Punct(p) if p.as_char() == '-');
            if depth > MOST_NESTED_DELIMITERS || chain > LONGEST_CHAIN || right > MOST_RECURSING {
                diagnostics.error(tree.span(), &messages::nested_too_deeply());
                return None;
            }
        }
    }
    Some(())
}

fn is_block(tree: &TokenTree) -> bool {
    matches!(tree, TokenTree::Group(g) if g.delimiter() == proc_macro2::Delimiter::Brace)
}

/// Whether what stands after a block belongs to the same expression.
fn goes_on(tree: &TokenTree) -> bool {
    match tree {
        TokenTree::Ident(i) => i == "else",
        TokenTree::Punct(p) => p.as_char() != '#',
        _ => false,
    }
}
