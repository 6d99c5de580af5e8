//! The collector of errors: all of a phase at once, one per place, and never dropped unread.

use std::collections::BTreeSet;

use proc_macro2::{Span, TokenStream, TokenTree};
use quote::ToTokens;

use crate::messages::Message;

/// A stretch of the user's tokens.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Place {
    start: Span,
    end: Span,
}

impl Place {
    /// From the first to the last token of `tokens`; the macro call where there are none.
    pub(crate) fn of(tokens: impl ToTokens) -> Self {
        let mut tokens = tokens.into_token_stream().into_iter();
        let start = tokens.next().map_or_else(Span::call_site, |t| first(&t));
        let end = tokens.last().map_or(start, |t| t.span());
        Self { start, end }
    }

    /// From the first to the last of two places.
    pub(crate) fn joined(first: Self, last: Self) -> Self {
        Self { start: first.start, end: last.end }
    }

    /// From one span to another.
    pub(crate) fn between(start: Span, end: Span) -> Self {
        Self { start, end }
    }

    /// The error at this place.
    pub(crate) fn error(self, message: &Message) -> syn::Error {
        let mark = |span| TokenTree::Ident(proc_macro2::Ident::new("x", span));
        syn::Error::new_spanned(TokenStream::from_iter([mark(self.start), mark(self.end)]), message)
    }
}

impl From<Span> for Place {
    fn from(span: Span) -> Self {
        Self { start: span, end: span }
    }
}

/// Span of a tree's first token; invisible groups have none of their own that would be worth showing.
fn first(tree: &TokenTree) -> Span {
    match tree {
        TokenTree::Group(g) if g.delimiter() == proc_macro2::Delimiter::None => {
            g.stream().into_iter().next().map_or_else(|| g.span(), |t| first(&t))
        }
        tree => tree.span(),
    }
}

/// Collects errors; must be drained with [`Diagnostics::finish`].
#[derive(Debug)]
pub(crate) struct Diagnostics {
    errors: Option<Vec<syn::Error>>,
    seen: BTreeSet<String>,
    /// How often an error was added, known ones included.
    raised: usize,
    /// The call of a library function that is being elaborated, and the function's name.
    inside: Option<(Place, String)>,
}

/// Whether [`Diagnostics::enter`] was the outermost; to be given back.
#[derive(Debug)]
#[must_use]
pub(crate) struct Entered(bool);

impl Diagnostics {
    pub(crate) fn new() -> Self {
        Self { errors: Some(Vec::new()), seen: BTreeSet::new(), raised: 0, inside: None }
    }

    /// From here on errors are about tokens that are not the user's: they stand at `call`, the outermost of
    /// them.
    pub(crate) fn enter(&mut self, call: Place, name: impl FnOnce() -> String) -> Entered {
        let outermost = self.inside.is_none();
        if outermost {
            self.inside = Some((call, name()));
        }
        Entered(outermost)
    }

    /// Back from where [`enter`](Self::enter) led.
    pub(crate) fn leave(&mut self, entered: Entered) {
        if entered.0 {
            self.inside = None;
        }
    }

    /// Where an error at `place` is shown.
    pub(crate) fn shown_at(&self, place: Place) -> Place {
        self.inside.as_ref().map_or(place, |(call, _)| *call)
    }

    /// Adds an error, unless there is one at this very place: a loop's body or a helper is elaborated many
    /// times, its mistake is one.
    pub(crate) fn error(&mut self, place: impl Into<Place>, message: &Message) {
        self.raised += 1;
        let place = self.shown_at(place.into());
        let known = !self.seen.insert(format!("{:?}{:?}", place.start, place.end));
        if !known && let Some(errors) = &mut self.errors {
            errors.push(match &self.inside {
                Some((_, function)) => place.error(&message.inside(function)),
                None => place.error(message),
            });
        }
    }

    /// Adds what a parser of `syn` found.
    pub(crate) fn syntax(&mut self, error: syn::Error) {
        if let Some(errors) = &mut self.errors {
            errors.extend(error);
        }
    }

    /// How often an error was added so far, also where it was known: grows while a function with a mistake is
    /// elaborated, however often its helpers were.
    pub(crate) fn raised(&self) -> usize {
        self.raised
    }

    /// Number of errors so far.
    pub(crate) fn len(&self) -> usize {
        self.errors.as_ref().map_or(0, Vec::len)
    }

    /// The errors, if there are any; the collector goes on empty.
    pub(crate) fn checkpoint(&mut self) -> Result<(), Vec<syn::Error>> {
        match &mut self.errors {
            Some(errors) if !errors.is_empty() => Err(std::mem::take(errors)),
            _ => Ok(()),
        }
    }

    /// Ends the collection.
    pub(crate) fn finish(mut self) -> Result<(), Vec<syn::Error>> {
        match self.errors.take() {
            Some(errors) if !errors.is_empty() => Err(errors),
            _ => Ok(()),
        }
    }
}

impl Drop for Diagnostics {
    fn drop(&mut self) {
        // Whoever forgets to look would turn a user's mistake into silence.
        debug_assert!(
            std::thread::panicking() || self.errors.as_ref().is_none_or(Vec::is_empty),
            "errors were collected and dropped unread"
        );
    }
}
