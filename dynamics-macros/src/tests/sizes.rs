//! Families of models at many sizes: what is emitted binds every name that it reads, whatever the size, with
//! and without damping, with constant and moving inertia, constrained and free.
//!
//! The sizes are below and above the thresholds of emission: matrices of 400 elements, blocks of 256 steps,
//! functions above 4,000. `SIZES=all cargo test --release -p dynamics-tests --test macros sizes` asks for
//! all, which takes minutes.

mod families;

use quote::quote;
use syn::Item;

use super::names::mistakes;
use crate::compile::compile;
use crate::expand;

use families::{FAMILIES, Family, SIZES};

/// What is wrong with the emitted code of one model; a model that is refused, as too large, has one error.
fn faults(family: &Family, n: usize, damped: bool) -> Vec<String> {
    let [declaration, implementation] = family.source(n, damped);
    let tokens = |text: &str| -> proc_macro2::TokenStream { text.parse().expect("tokens") };
    let (item, block) = (tokens(&declaration), tokens(&implementation));
    let emitted = expand::model(quote!({ #item } { #block }));
    let items: Vec<Item> = syn::parse2::<syn::File>(emitted).expect("what is emitted is Rust").items;
    if items.iter().any(|item| {
        matches!(item, Item::Macro(call)
            if call.mac.path.segments.last().is_some_and(|s| s.ident == "compile_error"))
    }) {
        let errors = compile(item, block).map_or_else(|errors| errors, |_| Vec::new());
        let texts: Vec<String> = errors.iter().map(syn::Error::to_string).collect();
        let too_large = texts.len() == 1 && texts[0].contains("the limit is");
        return if too_large { Vec::new() } else { texts };
    }
    mistakes(&items)
}

/// Beyond the sizes above: the mass matrix is left out, and computed by a product with q̈.
#[test]
fn a_chain_that_does_without_its_mass_matrix_binds_its_names() {
    let family = FAMILIES.iter().find(|family| family.name == "chains").expect("there is one");
    let [declaration, implementation] = family.source(100, true);
    let tokens = |text: &str| -> proc_macro2::TokenStream { text.parse().expect("tokens") };
    let (item, block) = (tokens(&declaration), tokens(&implementation));
    let emitted = expand::model(quote!({ #item } { #block }));
    assert!(emitted.to_string().contains("__mass_matrix_columns"));
    let items = syn::parse2::<syn::File>(emitted).expect("what is emitted is Rust").items;
    assert_eq!(mistakes(&items), Vec::<String>::new());
}

#[test]
fn every_size_of_every_family_binds_its_names() {
    let all = std::env::var("SIZES").is_ok_and(|wanted| wanted == "all");
    let mut found = Vec::new();
    for family in FAMILIES {
        for n in SIZES.into_iter().filter(|n| all || *n <= family.usual) {
            for damped in [false, true] {
                let mut faults = faults(family, n, damped);
                faults.dedup();
                faults.truncate(3);
                found.extend(
                    faults.into_iter().map(|fault| format!("{}, {n}, damped {damped}: {fault}", family.name)),
                );
            }
        }
    }
    assert!(found.is_empty(), "{}", found.join("\n"));
}
