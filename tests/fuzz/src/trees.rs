//! Token trees that can be changed in place.

use proc_macro2::{Delimiter, Group, Span, TokenStream, TokenTree};

use crate::random::Random;

/// A token or a delimited group.
#[derive(Clone, Debug)]
pub enum Tree {
    Leaf(TokenTree),
    Group(Delimiter, Vec<Tree>),
}

/// Trees of a stream, without spans: those of an earlier case are invalid in a later one.
#[must_use]
pub fn trees(stream: TokenStream) -> Vec<Tree> {
    let tree = |tree| match tree {
        TokenTree::Group(g) => Tree::Group(g.delimiter(), trees(g.stream())),
        mut leaf => {
            leaf.set_span(Span::call_site());
            Tree::Leaf(leaf)
        }
    };
    stream.into_iter().map(tree).collect()
}

/// The stream of trees.
#[must_use]
pub fn stream(trees: &[Tree]) -> TokenStream {
    let token = |tree: &Tree| match tree {
        Tree::Leaf(leaf) => leaf.clone(),
        Tree::Group(delimiter, inner) => TokenTree::Group(Group::new(*delimiter, stream(inner))),
    };
    trees.iter().map(token).collect()
}

/// The stream of trees, by way of its text: every token has a place of its own, but invisible groups are
/// gone.
#[must_use]
pub fn placed(trees: &[Tree]) -> TokenStream {
    let stream = stream(trees);
    stream.to_string().parse().unwrap_or(stream)
}

/// Trees of a text; none where it is not one.
#[must_use]
pub fn parsed(text: &str) -> Option<Vec<Tree>> {
    text.parse().ok().map(trees)
}

/// Number of trees, groups included.
#[must_use]
pub fn size(list: &[Tree]) -> usize {
    let of = |tree: &Tree| match tree {
        Tree::Leaf(_) => 1,
        Tree::Group(_, inner) => 1 + size(inner),
    };
    list.iter().map(of).sum()
}

/// A random list of trees inside `list`, every tree equally likely to be next to the chosen place, and an
/// index into it.
pub fn place<'a>(list: &'a mut Vec<Tree>, random: &mut Random) -> (&'a mut Vec<Tree>, usize) {
    let mut wanted = random.below(size(list).max(1));
    let mut at = list;
    loop {
        let mut index = 0;
        let mut inside = None;
        for (i, tree) in at.iter().enumerate() {
            index = i;
            let Tree::Group(_, inner) = tree else {
                if wanted == 0 {
                    break;
                }
                wanted -= 1;
                continue;
            };
            let weight = size(inner);
            if wanted == 0 {
                break;
            }
            wanted -= 1;
            if wanted < weight {
                inside = Some(i);
                break;
            }
            wanted -= weight;
        }
        let Some(i) = inside else { return (at, index) };
        let Tree::Group(_, inner) = &mut at[i] else { unreachable!("only groups are entered") };
        at = inner;
    }
}
