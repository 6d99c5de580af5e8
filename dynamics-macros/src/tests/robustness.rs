//! No token stream makes the macro panic, hang or overflow the stack.

use proc_macro2::{Delimiter, Group, Ident, Literal, Punct, Spacing, Span, TokenStream, TokenTree};
use proptest::prelude::*;

use super::models::{ARRAYS, CONSTRAINED, DOUBLE_PENDULUM};
use crate::compile::compile;

/// Words of the language and some strangers, to be thrown in.
const WORDS: &[&str] = &[
    "self",
    "q",
    "x",
    "theta1",
    "m1",
    "let",
    "mut",
    "for",
    "in",
    "if",
    "else",
    "match",
    "return",
    "break",
    "fn",
    "while",
    "loop",
    "as",
    "f64",
    "usize",
    "Expr",
    "Vec2",
    "Vec3",
    "Mat3",
    "vec2",
    "dt",
    "sin",
    "powi",
    "at",
    "Self",
    "kinetic",
    "force",
    "holonomic",
    "nonholonomic",
    "redundant",
    "switched",
    "integrable",
    "reaction",
    "slip",
    "impl",
    "struct",
    "const",
    "_",
    "move",
    "unsafe",
    "async",
    "dyn",
    "where",
    "ref",
];
const SIGNS: &str = "+-*/%^&|!<>=.,;:#?@$";

fn token() -> impl Strategy<Value = TokenTree> {
    let word = (0..WORDS.len()).prop_map(|i| TokenTree::Ident(Ident::new(WORDS[i], Span::call_site())));
    let sign = (0..SIGNS.len(), any::<bool>()).prop_map(|(i, joint)| {
        let spacing = if joint { Spacing::Joint } else { Spacing::Alone };
        TokenTree::Punct(Punct::new(SIGNS.as_bytes()[i] as char, spacing))
    });
    let number = prop_oneof![
        (0..20u32).prop_map(|n| TokenTree::Literal(Literal::u32_unsuffixed(n))),
        (-1e300..1e300f64).prop_map(|x| TokenTree::Literal(Literal::f64_unsuffixed(x.abs()))),
        Just(TokenTree::Literal(Literal::i128_unsuffixed(i128::MAX))),
        Just(TokenTree::Literal(Literal::string("text"))),
    ];
    let group = (0..4u8).prop_map(|d| {
        let delimiters = [Delimiter::Brace, Delimiter::Bracket, Delimiter::Parenthesis, Delimiter::None];
        TokenTree::Group(Group::new(delimiters[d as usize], TokenStream::new()))
    });
    prop_oneof![4 => word, 4 => sign, 2 => number, 1 => group]
}

/// A change at the n-th token, counted through all groups.
#[derive(Clone, Debug)]
enum Change {
    Remove,
    Insert(TokenTree),
    Replace(TokenTree),
    Double,
    Swap,
}

fn change() -> impl Strategy<Value = (usize, Change)> {
    let change = prop_oneof![
        Just(Change::Remove),
        Just(Change::Double),
        Just(Change::Swap),
        token().prop_map(Change::Insert),
        token().prop_map(Change::Replace),
    ];
    (0..400usize, change)
}

/// The stream with one change; counts `left` down to it.
fn changed(stream: TokenStream, left: &mut usize, change: &Change) -> TokenStream {
    let mut out: Vec<TokenTree> = Vec::new();
    for tree in stream {
        let here = *left == 0;
        *left = left.wrapping_sub(1);
        let tree = match tree {
            TokenTree::Group(g) => {
                TokenTree::Group(Group::new(g.delimiter(), changed(g.stream(), left, change)))
            }
            tree => tree,
        };
        match (here, change) {
            (true, Change::Remove) => {}
            (true, Change::Insert(new)) => out.extend([new.clone(), tree]),
            (true, Change::Replace(new)) => out.push(new.clone()),
            (true, Change::Double) => out.extend([tree.clone(), tree]),
            (true, Change::Swap) => {
                let before = out.pop();
                out.push(tree);
                out.extend(before);
            }
            (false, _) => out.push(tree),
        }
    }
    out.into_iter().collect()
}

fn parse(text: &str) -> TokenStream {
    text.parse().expect("a test's tokens are tokens")
}

/// Any result will do, as long as there is one and errors say something.
fn survive(declaration: TokenStream, implementation: TokenStream) {
    if let Err(errors) = compile(declaration, implementation) {
        assert!(!errors.is_empty(), "refused without a word");
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(300))]

    #[test]
    fn changed_models_are_compiled_or_refused(
        which in 0..3usize,
        changes in proptest::collection::vec(change(), 1..4),
        in_struct in any::<bool>(),
    ) {
        let (declaration, implementation) = [DOUBLE_PENDULUM, ARRAYS, CONSTRAINED][which];
        let (mut declaration, mut implementation) = (parse(declaration), parse(implementation));
        for (at, change) in changes {
            let target = if in_struct { &mut declaration } else { &mut implementation };
            let count = target.to_string().split_whitespace().count().max(1);
            *target = changed(std::mem::take(target), &mut (at % count), &change);
        }
        survive(declaration, implementation);
    }

    #[test]
    fn arbitrary_tokens_are_refused(tokens in proptest::collection::vec(token(), 0..60)) {
        let stream: TokenStream = tokens.into_iter().collect();
        survive(stream.clone(), parse(ARRAYS.1));
        survive(parse(ARRAYS.0), stream.clone());
        let body: TokenTree = TokenTree::Group(Group::new(Delimiter::Brace, stream));
        let mut function = parse("#[kinetic] fn kinetic(&self, q: &Coordinates<Self>) -> Expr");
        function.extend([body]);
        let mut implementation = parse("impl Chain");
        implementation.extend([TokenTree::Group(Group::new(Delimiter::Brace, function))]);
        survive(parse(ARRAYS.0), implementation);
    }
}

#[test]
fn what_grows_without_bound_is_stopped() {
    let chain = |n: usize, part: &str| vec![part; n].join(" + ");
    let nested = |n: usize, open: &str, close: &str| format!("{}q.x{}", open.repeat(n), close.repeat(n));
    let doubling: String = (0..40)
        .map(|i| {
            format!(
                "fn f{}(&self, q: &Coordinates<Self>) -> Expr {{ self.f{i}(q) * self.f{i}(q).sin() }}",
                i + 1
            )
        })
        .collect();
    let bodies = [
        chain(1500, "q.x"),
        chain(100_000, "q.x"),
        nested(60, "(", ")"),
        nested(5_000, "(", ")"),
        nested(5_000, "-", ""),
        nested(150, "- ", ""),
        nested(5_000, "! ", ""),
        nested(3_000, "return ", ""),
        nested(60, "{ let y = ", "; y }"),
        nested(3_000, "if q.x > 0.0 { q.x } else ", ""),
        format!("q.x{}", ".sin()".repeat(1_200)),
        format!("q.x{}", ".dt()".repeat(3)),
        format!("q.x{}", ".exp().dt()".repeat(60)),
        "let mut s = q.x; for i in 0..1000 { for j in 0..1000 { for k in 0..1000 { s = s.sin(); } } } s"
            .into(),
        "let mut s = q.x; for i in 0..100000 { for j in 0..100000 { for k in 0..100000 { } } } s".into(),
        "let a = [[[[[q.x; 1000]; 1000]; 1000]; 1000]; 1000]; a[0][0][0][0][0].dt()".into(),
        "let a = [[[[[q.x; 1000]; 1000]; 1000]; 1000]; 1000]; a.dt()[0][0][0][0][0]".into(),
        "self.f40(q)".into(),
        "let mut s = q.x; for i in 0..20000 { s = s.sin() * s; } s".into(),
        "let mut s = q.x; for i in 0..2000 { s = s * s + s; } s.powi(1000)".into(),
        "let mut n = 2; for i in 0..1000 { n = n * n; } q.x * n as f64".into(),
        "let mut s = q.x + 1.0; for i in 0..1000 { s = s * s; } q.x * s".into(),
        "let mut s = 10.0; for i in 0..1000 { s = s * s; } q.x * s".into(),
    ];
    for body in bodies {
        let implementation = format!(
            "impl M {{
                #[kinetic] fn kinetic(&self, q: &Coordinates<Self>) -> Expr {{ 0.5 * q.x.dt().powi(2) }}
                #[output] fn result(&self, q: &Coordinates<Self>) -> Expr {{ {body} }}
                fn f0(&self, q: &Coordinates<Self>) -> Expr {{ q.x }} {doubling}
            }}"
        );
        let Ok(implementation) = implementation.parse() else { continue };
        survive(parse("#[coordinates(x)] struct M {}"), implementation);
    }
}
