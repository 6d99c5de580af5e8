//! What random tokens have found.

use proc_macro2::TokenStream;

use crate::expand;

/// `return return .. q.x` and an impl block of it: rustc's own parser is built for that depth, `syn`'s is not.
fn deep() -> TokenStream {
    let body = "return ".repeat(20_000);
    let text = format!("impl A {{ fn f(&self, q: &Coordinates<Self>) -> Expr {{ {body} q.x }} }}");
    text.parse().expect("balanced")
}

#[test]
fn an_impl_block_beyond_the_parser_is_refused_and_not_parsed() {
    assert!(expand::attribute(TokenStream::new(), deep()).to_string().starts_with("A ! {"));
    let implementation = deep();
    let both = quote::quote!({ #[coordinates(x)] struct A { m: f64 } } { #implementation });
    assert!(expand::model(both).to_string().contains("compile_error"));
}

#[test]
fn self_is_no_name_of_a_model() {
    let item = "impl Self::N { }".parse().expect("balanced");
    assert!(expand::attribute(TokenStream::new(), item).to_string().contains("compile_error"));
}
