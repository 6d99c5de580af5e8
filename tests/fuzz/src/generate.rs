//! The inputs of a campaign: one for every number.

use proc_macro2::{Delimiter, TokenStream};

use crate::corpus::Seed;
use crate::mutate::{LITERALS, WORDS, mutate};
use crate::random::Random;
use crate::trees::{Tree, parsed, placed, stream};

/// What a case throws at the macros or the engine.
#[derive(Clone, Debug)]
pub enum Input {
    /// A struct and an impl block.
    Model(TokenStream, TokenStream),
    /// Any tokens.
    Tokens(TokenStream),
    /// A random model for the engine alone.
    Engine(u64),
}

/// The input of a case.
#[must_use]
pub fn input(case: u64, seeds: &[Seed]) -> Input {
    let mut random = Random::new(case);
    let r = &mut random;
    match r.below(20) {
        0 => Input::Tokens(stream(&soup(r, 4))),
        1 | 2 => deep(r),
        3..6 => Input::Engine(r.draw()),
        _ => mutated(r, seeds),
    }
}

/// A model of the corpus with a few changes.
fn mutated(r: &mut Random, seeds: &[Seed]) -> Input {
    let (a, b) = (&seeds[r.below(seeds.len())], &seeds[r.below(seeds.len())]);
    let mut declaration = a.declaration.clone();
    let mut implementation = if r.one_in(20) { b.implementation.clone() } else { a.implementation.clone() };
    let changes = 1 + r.scale(4);
    for _ in 0..changes {
        let list = if r.one_in(4) { &mut declaration } else { &mut implementation };
        mutate(list, r, seeds);
    }
    let whole = if r.one_in(8) { stream } else { placed };
    Input::Model(whole(&declaration), whole(&implementation))
}

/// Words of the language in any order.
fn soup(r: &mut Random, depth: usize) -> Vec<Tree> {
    let mut list = Vec::new();
    for _ in 0..r.below(30) {
        if depth > 0 && r.one_in(6) {
            let delimiters = [Delimiter::Parenthesis, Delimiter::Brace, Delimiter::Bracket, Delimiter::None];
            list.push(Tree::Group(delimiters[r.below(4)], soup(r, depth - 1)));
        } else {
            let words = if r.one_in(4) { LITERALS } else { WORDS };
            list.extend(parsed(r.pick(words)).unwrap_or_default());
        }
    }
    list
}

/// Constructs that nest or chain: what stands before, in the middle, and after.
const NESTS: &[(&str, &str, &str)] = &[
    ("(", "q.x", ")"),
    ("{", "q.x", "}"),
    ("-", "q.x", ""),
    ("!", "true", ""),
    ("*", "q.x", ""),
    ("&", "q.x", ""),
    ("& mut", "q.x", ""),
    ("", "q.x", ".sin()"),
    ("", "q.x", ".powi(2)"),
    ("", "q.x", ".dt()"),
    ("", "q.x", "+ q.x * self.m"),
    ("", "q.x", "- 0.1"),
    ("", "q.x", "/ q.x"),
    ("", "q.x", "[0]"),
    ("", "q.x", "(q.x)"),
    ("", "q.x", "?"),
    ("", "q.x", "as f64"),
    ("", "q.x", ".x"),
    ("q.x + (", "q.x", ").sin()"),
    ("q.x * (q.x.sin() +", "q.x", ")"),
    ("(q.x / (1.0 +", "q.x", "))"),
    ("if q.x > 0.0 {", "q.x", "} else { -q.x }"),
    ("if q.x > 0.0 { q.x } else ", "{ q.x }", ""),
    ("if", "q.x > 0.0", "{ true } else { false } "),
    ("{ let a = ", "q.x", "; a }"),
    ("{ let a = q.x; ", "q.x", "}"),
    ("{ let mut a = q.x; a += a * a; a + ", "q.x", "}"),
    ("for i in 0..2 {", "", "}"),
    ("{ let mut a = q.x; for i in 0..9 { a +=", "q.x", "; } a }"),
    ("match 1 { 1 =>", "q.x", ", _ => 0.0 }"),
    ("|a|", "q.x", ""),
    ("move || ", "q.x", ""),
    ("[", "q.x", "]"),
    ("[", "q.x", "; 9]"),
    ("(", "q.x", ",)"),
    ("return", "q.x", ""),
    ("a =", "q.x", ""),
    ("a +=", "q.x", ""),
    ("..", "q.x", ""),
    ("..=", "q.x", ""),
    ("", "q.x", ".."),
    ("q.x <", "q.x", ""),
    ("true &&", "q.x > 0.0", ""),
    ("true ||", "q.x > 0.0", ""),
    ("f::<", "f64", ">()"),
    ("0.0 as Vec<", "f64", ">"),
    ("0.0 as &", "f64", ""),
    ("0.0 as fn(", "f64", ")"),
    ("0.0 as fn() ->", "f64", ""),
    ("unsafe {", "q.x", "}"),
    ("'a: loop {", "q.x", "}"),
    ("self.f(", "q.x", ")"),
    ("q.x.min(", "q.x", ")"),
    ("q.x.atan2(", "q.x", ")"),
    ("Force::along(q.x, ", "q.x", ")"),
    ("vec2(q.x, ", "q.x", ")"),
    ("yield", "q.x", ""),
    ("break", "q.x", ""),
    ("let a =", "q.x", ""),
    ("#[a]", "q.x", ""),
    ("fn f() {", "", "}"),
    ("struct A; impl A { fn f() {", "", "} }"),
    ("const {", "q.x", "}"),
    ("S { a:", "q.x", "}"),
    ("q.x.powf(", "q.x", ")"),
    ("{ let (a, b) = (q.x, ", "q.x", "); a * b }"),
    ("(q.x, ", "q.x", ").1"),
    ("self.at(self.m.max(", "q.x", "))"),
];

/// Types, patterns, units and items that nest.
const OTHER_NESTS: &[(&str, &str, &str, &str, &str)] = &[
    ("struct A { a: ", "[", "f64", "; 2]", "}"),
    ("struct A { a: ", "Vec<", "f64", ">", "}"),
    ("struct A { a: ", "(", "f64", ")", "}"),
    ("struct A { a: ", "&", "f64", "", "}"),
    ("struct A { a: ", "*const ", "f64", "", "}"),
    ("struct A { a: ", "fn() -> ", "f64", "", "}"),
    ("struct A { a: ", "a::", "f64", "", "}"),
    ("struct A { a: ", "<", "f64", ">::X", "}"),
    ("struct A { a: [f64; ", "(", "3", ")", "] }"),
    ("struct A { a: [f64; ", "1 +", "3", "", "] }"),
    ("#[coordinates(x)] #[units(a: ", "(", "m", ")", ")] struct A { a: f64 }"),
    ("#[coordinates(x)] #[units(a: ", "m *", "m", "", ")] struct A { a: f64 }"),
    ("#[coordinates(x)] #[units(a: ", "", "m", "^2", ")] struct A { a: f64 }"),
    ("#[coordinates(x: ", "[", "m", "; 2]", ")] struct A { a: f64 }"),
    ("#[coordinates(", "x,", "y", "", ")] struct A { a: f64 }"),
    ("#[coordinates(x)] #[nominal(a = ", "-", "1.0", "", ")] struct A { a: f64 }"),
    ("#[coordinates(x)] #[nominal(a = ", "(", "1.0", ")", ")] struct A { a: f64 }"),
    ("#[coordinates(x)] #[nominal(a = ", "[", "1.0", "]", ")] struct A { a: f64 }"),
    ("", "#[coordinates(x)]", "", "", "struct A { a: f64 }"),
    (
        "impl A { #[kinetic] fn f(&self, q: &Coordinates<Self>) -> Expr { let ",
        "(",
        "a",
        ",)",
        " = q.x; a } }",
    ),
    ("impl A { #[kinetic] fn f(&self, q: &Coordinates<Self>) -> Expr { let ", "&", "a", "", " = q.x; a } }"),
    (
        "impl A { #[kinetic] fn f(&self, q: &Coordinates<Self>) -> Expr { match 1 { ",
        "1 |",
        "2",
        "",
        " => q.x, _ => 0.0 } } }",
    ),
    ("impl A { #[kinetic] fn f(&self, q: &Coordinates<Self>) -> ", "(", "Expr", ",)", " { q.x } }"),
    ("impl A { const N: usize = ", "(", "1", ")", "; }"),
    ("impl A { const N: usize = ", "1 *", "1", "", "; }"),
    ("impl A { const N: f64 = ", "-", "1.0", "", "; }"),
    ("impl ", "(", "A", ")", "{ }"),
    ("impl ", "a::", "A", "", "{ }"),
    ("impl A ", "where A: ", "A", "", "{ }"),
    ("impl", "<A:", "A", ">", "{ }"),
];

const DECLARATION: &str = "#[coordinates(x)] struct A { m: f64 }";
const ENERGIES: &str =
    "#[kinetic] fn kinetic(&self, q: &Coordinates<Self>) -> Expr { 0.5 * self.m * q.x.dt().norm_squared() }";

/// One construct inside itself, up to thousands of times, in an otherwise good model.
fn deep(r: &mut Random) -> Input {
    let times = 1 + r.scale(13);
    let nested = |before: &str, middle: &str, after: &str| {
        [before.repeat(times + 1).as_str(), middle, " ", after.repeat(times).as_str()].concat()
    };
    let (declaration, implementation) = if r.one_in(4) {
        let (open, before, middle, after, close) = OTHER_NESTS[r.below(OTHER_NESTS.len())];
        let before = format!("{before} ");
        let text = format!("{open} {} {middle} {} {close}", before.repeat(times), after.repeat(times));
        match text.contains("impl ") {
            true => (DECLARATION.to_owned(), text),
            false => (text, format!("impl A {{ {ENERGIES} }}")),
        }
    } else {
        let (before, middle, after) = NESTS[r.below(NESTS.len())];
        let spaced = format!("{before} ");
        let body = match r.below(3) {
            // Two constructs around each other.
            0 => {
                let (b, m, a) = NESTS[r.below(NESTS.len())];
                nested(&format!("{spaced} {b} "), m, &format!("{a} {after}"))
            }
            _ => nested(&spaced, middle, after).replacen(&spaced, "", 1),
        };
        let energies =
            "#[kinetic] fn kinetic(&self, q: &Coordinates<Self>) -> Expr { 0.5 * self.m * q.x.dt().powi(2) }";
        let role = r.pick(&[
            "kinetic",
            "potential",
            "output",
            "event",
            "force",
            "dissipation",
            "lagrangian",
            "holonomic",
            "nonholonomic",
            "nonholonomic(switched)",
        ]);
        (
            DECLARATION.to_owned(),
            format!(
                "impl A {{ {energies} #[{role}] fn v(&self, q: &Coordinates<Self>) -> Expr {{ {body} }} }}"
            ),
        )
    };
    match (declaration.parse(), implementation.parse()) {
        (Ok(a), Ok(b)) => Input::Model(a, b),
        // Unbalanced: the pieces do not close each other.
        _ => Input::Tokens(TokenStream::new()),
    }
}
