//! What of a drawing is not followed, in words.

use dynamics_symbolic::mechanics::NotFollowed;
use proc_macro2::{Delimiter, Spacing, Span, TokenStream, TokenTree};
use quote::ToTokens;
use syn::{Expr, Stmt};

use super::super::Elaborator;
use crate::syntax::Function;

/// Longest text of an expression, in characters. Longer ones are cut.
const LONGEST: usize = 60;

impl Elaborator<'_> {
    /// Notes the innermost expression that has no value here, the first time. The library's own words are
    /// not the user's: of these the call is noted.
    pub(in super::super) fn note_not_followed(&mut self, expr: &Expr) {
        if self.stops_here() {
            let tokens = match expr {
                // What it is a method of stands before, and has a value.
                Expr::MethodCall(e) => {
                    let (name, arguments) = (&e.method, &e.args);
                    quote::quote!(.#name(#arguments))
                }
                Expr::Field(e) => {
                    let member = &e.member;
                    quote::quote!(.#member)
                }
                other => other.to_token_stream(),
            };
            self.stop(tokens);
        }
    }

    /// The same of a statement with a mistake outside of its expressions.
    pub(in super::super) fn note_statement_not_followed(&mut self, statement: &Stmt) {
        if self.diagnostics.raised() > 0 && self.stops_here() {
            self.stop(statement.to_token_stream());
        }
    }

    fn stops_here(&mut self) -> bool {
        let frame = self.frame();
        let left = frame.flow.is_some() || frame.of.is_some();
        !left && self.picture.as_ref().is_some_and(|followed| followed.stopped.is_none())
    }

    fn stop(&mut self, tokens: TokenStream) {
        let reason = of_tokens(tokens);
        if let Some(followed) = &mut self.picture {
            followed.stopped = Some(reason);
        }
        // Nothing behind it is looked at.
        self.exhausted = true;
    }
}

/// For a function of which no expression is to blame.
pub(super) fn of_function(function: &Function) -> NotFollowed {
    of_tokens(function.name.to_token_stream())
}

pub(super) fn of_tokens(tokens: TokenStream) -> NotFollowed {
    let line = tokens.clone().into_iter().next().and_then(|first| line(first.span()));
    let mut expression = String::new();
    write(tokens, &mut expression);
    if expression.chars().count() > LONGEST {
        expression = expression.chars().take(LONGEST).collect::<String>() + "..";
    }
    NotFollowed { expression, line }
}

/// The line of a token; unknown where no compiler runs.
fn line(span: Span) -> Option<usize> {
    extern crate proc_macro;
    proc_macro::is_available().then(|| span.unwrap().line())
}

/// Tokens as one writes them. (Their own text has a space between all of them.)
fn write(tokens: TokenStream, text: &mut String) {
    // Whether a value stands before, and whether nothing may stand between it and what follows.
    let (mut after_value, mut tight) = (false, true);
    for tree in tokens {
        let (glued, tight_behind, is_value) = match &tree {
            TokenTree::Group(group) => (after_value && group.delimiter() != Delimiter::Brace, false, true),
            TokenTree::Punct(punct) => {
                let joint = punct.spacing() == Spacing::Joint;
                match punct.as_char() {
                    '.' => (true, true, false),
                    ':' => (true, joint || text.ends_with(':'), false),
                    ',' | ';' | '?' => (true, false, punct.as_char() == '?'),
                    '|' => (after_value, !after_value, false),
                    // A macro.
                    '!' if after_value && !joint => (true, true, true),
                    '-' | '*' | '&' | '!' if !after_value => (false, true, false),
                    _ => (false, joint, false),
                }
            }
            TokenTree::Ident(_) | TokenTree::Literal(_) => (false, false, true),
        };
        if !glued && !tight {
            text.push(' ');
        }
        match tree {
            TokenTree::Group(group) if group.stream().is_empty() => text.push_str(match group.delimiter() {
                Delimiter::Parenthesis => "()",
                Delimiter::Bracket => "[]",
                Delimiter::Brace => "{}",
                Delimiter::None => "",
            }),
            TokenTree::Group(group) => {
                let (open, close) = match group.delimiter() {
                    Delimiter::Parenthesis => ("(", ")"),
                    Delimiter::Bracket => ("[", "]"),
                    Delimiter::Brace => ("{ ", " }"),
                    Delimiter::None => ("", ""),
                };
                text.push_str(open);
                write(group.stream(), text);
                text.push_str(close);
            }
            other => text.push_str(&other.to_string()),
        }
        (after_value, tight) = (is_value, tight_behind);
    }
}

#[cfg(test)]
mod tests {
    use super::of_tokens;

    #[test]
    fn expressions_read_as_they_were_written() {
        for text in [
            "self.table.get(&q.x)[0]",
            "-a * (b + c[1]) >= 2.0",
            "|x| [x, self.f(x)?]",
            "std::iter::once(a)",
            "Some(!b)",
            "a != vec![b, -c]",
        ] {
            assert_eq!(of_tokens(text.parse().expect("tokens")).expression, text);
        }
        let long = "a + ".repeat(40) + "a";
        assert_eq!(of_tokens(long.parse().expect("tokens")).expression, long[..60].to_owned() + "..");
    }
}
