//! What must hold of the macros for any tokens.

use proc_macro2::{Delimiter, Group, TokenStream, TokenTree};

use crate::expand;

/// Runs the three entry points as rustc would on `struct` and `impl`.
///
/// # Errors
/// What is wrong with the output. A panic is for the caller to catch, a hang for a watchdog.
pub fn check(declaration: &TokenStream, implementation: &TokenStream) -> Result<Outcome, String> {
    let derived = twice("derive", || expand::derive(declaration.clone()))?;
    twice("attribute", || expand::attribute(TokenStream::new(), implementation.clone(), [0; 2]))?;
    let both: TokenStream = [declaration, implementation]
        .map(|s| TokenTree::from(Group::new(Delimiter::Brace, s.clone())))
        .into_iter()
        .collect();
    let model = twice("model", || expand::model(both.clone()))?;
    Ok(if derived || model { Outcome::Refused } else { Outcome::Accepted })
}

/// What became of an input.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Outcome {
    /// A model was derived.
    Accepted,
    /// Errors were reported.
    Refused,
}

/// Expands twice; `Ok(true)` where the output holds an error.
fn twice(entry: &str, expand: impl Fn() -> TokenStream) -> Result<bool, String> {
    let first = expand();
    let text = first.to_string();
    if text != expand().to_string() {
        return Err(format!("{entry}: the same tokens gave two outputs"));
    }
    if text.contains("please report it") {
        return Err(format!("{entry}: refused without a reason"));
    }
    let refused = text.contains("compile_error");
    if !refused && let Err(error) = syn::parse2::<syn::File>(first) {
        return Err(format!("{entry}: the output is no Rust: {error}"));
    }
    Ok(refused)
}

/// Any tokens at any entry point, arguments of the attribute and shapes of `__model!`'s input included.
///
/// # Errors
/// As [`check`].
pub fn check_raw(tokens: &TokenStream) -> Result<Outcome, String> {
    twice("attribute arguments", || expand::attribute(tokens.clone(), TokenStream::new(), [0; 2]))?;
    // Behind a struct with errors an impl block is handed back as it is, whatever it is: only that it ends
    // can be asked for.
    expand::model(tokens.clone());
    check(tokens, tokens)
}
