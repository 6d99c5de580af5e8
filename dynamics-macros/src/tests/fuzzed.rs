//! What random tokens have found.

use proc_macro2::TokenStream;

use crate::expand;

/// One construct inside itself, very often: rustc's own parser is built for that depth, `syn`'s is not.
fn deep(before: &str, after: &str) -> TokenStream {
    let (before, after) = (before.repeat(4000), after.repeat(4000));
    let text = format!("impl A {{ fn f(&self, q: &Coordinates<Self>) -> Expr {{ {before} q.x {after} }} }}");
    text.parse().expect("balanced")
}

#[test]
fn an_impl_block_beyond_the_parser_is_refused_and_not_parsed() {
    for (before, after) in [
        ("return ", ""),
        ("yield ", ""),
        ("if ", ""),
        ("a = {} ", ""),
        ("{ ", "}"),
        ("0.0 as fn() -> ", ""),
        ("fn() -> ", ""),
    ] {
        let implementation = deep(before, after);
        assert!(
            expand::attribute(TokenStream::new(), implementation.clone(), [1, 1])
                .to_string()
                .contains("A ! {")
        );
        let both = quote::quote!({ #[coordinates(x)] struct A { m: f64 } } { #implementation });
        assert!(expand::model(both).to_string().contains("compile_error"), "{before}");
    }
}

#[test]
fn self_is_no_name_of_a_model() {
    let item = "impl Self::N { }".parse().expect("balanced");
    assert!(expand::attribute(TokenStream::new(), item, [1, 1]).to_string().contains("compile_error"));
}

#[test]
fn a_struct_beyond_the_parser_is_refused_and_not_parsed() {
    for (before, after) in [("fn() -> ", ""), ("&", ""), ("[", "; 2]"), ("(", ")")] {
        let text =
            format!("#[coordinates(x)] struct A {{ a: {} f64 {} }}", before.repeat(900), after.repeat(900));
        let item = text.parse().expect("balanced");
        assert!(expand::derive(item).to_string().contains("compile_error"), "{before}");
    }
}

#[test]
fn many_functions_one_after_the_other_are_not_deep() {
    let functions: String = (0..500)
        .map(|i| {
            format!(
                "#[output] fn f{i}(&self, q: &Coordinates<Self>) -> Expr \
                 {{ if q.x > 0.0 {{ -q.x }} else {{ q.x }} }} "
            )
        })
        .collect();
    let kinetic = "#[kinetic] fn t(&self, q: &Coordinates<Self>) -> Expr { self.m * q.x.dt() * q.x.dt() }";
    let both =
        format!("{{ #[coordinates(x)] struct A {{ m: f64 }} }} {{ impl A {{ {kinetic} {functions} }} }}");
    let expanded = expand::model(both.parse().expect("balanced")).to_string();
    let error = expanded.find("compile_error").map(|at| expanded[at..].chars().take(200).collect::<String>());
    assert_eq!(error, None);
}

#[test]
fn powers_of_powers_are_not_written_out() {
    // Exponents beyond 2³¹, too.
    let squares = ".powi(2)".repeat(40);
    let kinetic = "#[kinetic] fn t(&self, q: &Coordinates<Self>) -> Expr { 0.5 * self.m * q.x.dt().powi(2) }";
    let steep =
        format!("#[potential] fn v(&self, q: &Coordinates<Self>) -> Expr {{ self.k * q.x{squares} }}");
    let rod = format!("#[holonomic] fn rod(&self, q: &Coordinates<Self>) -> Expr {{ q.x - q.y{squares} }}");
    let both =
        format!("{{ #[coordinates(x)] struct A {{ m: f64, k: f64 }} }} {{ impl A {{ {kinetic} {steep} }} }}");
    let expanded = expand::model(both.parse().expect("balanced")).to_string();
    let error = expanded.find("compile_error").map(|at| expanded[at..].chars().take(200).collect::<String>());
    assert_eq!(error, None);
    let kinetic = kinetic.replace("powi(2)", "powi(2) + q.y.dt().powi(2)");
    let held = format!("{{ #[coordinates(x, y)] struct A {{ m: f64 }} }} {{ impl A {{ {kinetic} {rod} }} }}");
    assert!(!expand::model(held.parse().expect("balanced")).to_string().is_empty());
}

/// At some of the states in which the constraint holds the inertia is not a number: nothing is known of free
/// directions there.
#[test]
fn inertia_that_is_not_everywhere_a_number_is_no_panic() {
    let kinetic = "#[kinetic] fn t(&self, q: &Coordinates<Self>) -> Expr \
        { 0.5 * self.m * (q.x.sqrt() * q.x.dt().powi(2) + q.y.dt().powi(2)) }";
    let line = "#[holonomic] fn line(&self, q: &Coordinates<Self>) -> Expr { q.y - q.x }";
    let both =
        format!("{{ #[coordinates(x, y)] struct A {{ m: f64 }} }} {{ impl A {{ {kinetic} {line} }} }}");
    let expanded = expand::model(both.parse().expect("balanced")).to_string();
    let error = expanded.find("compile_error").map(|at| expanded[at..].chars().take(200).collect::<String>());
    assert_eq!(error, None);
}
