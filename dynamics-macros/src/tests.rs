//! Tests of everything up to the engine, on token strings: outside of a macro `proc_macro2` keeps the source,
//! so that spans can be read.

mod constraints;
mod drawings;
mod errors;
mod expansion;
mod fuzzed;
mod inverse;
mod models;
mod names;
mod numbers;
mod robustness;
mod sizes;
mod units;
mod vocabulary;

use crate::compile::{Compiled, CompiledModel, compile};

/// Compiles two strings.
pub(crate) fn try_model(
    declaration: &str,
    implementation: &str,
) -> Result<CompiledModel, Vec<(String, String)>> {
    let parse = |text: &str| text.parse().expect("a test's tokens are tokens");
    match compile(parse(declaration), parse(implementation)) {
        Ok(Compiled::Model(model)) => Ok(*model),
        Ok(Compiled::Families(_)) => Err(vec![(String::new(), "the model has families".to_owned())]),
        Err(errors) => {
            let describe = |error: syn::Error| {
                let at = error.span().source_text().unwrap_or_default();
                (at, error.to_string())
            };
            Err(errors.into_iter().map(describe).collect())
        }
    }
}

/// Compiles two strings that make a model.
pub(crate) fn model(declaration: &str, implementation: &str) -> CompiledModel {
    try_model(declaration, implementation).unwrap_or_else(|errors| panic!("{errors:#?}"))
}
