//! What the entry points emit, parsed again: it is Rust, it holds what it promises, and the same tokens give
//! the same text.

use proc_macro2::TokenStream;
use quote::ToTokens;
use syn::{ImplItem, Item};

use crate::expand;

const DECLARATION: &str = r#"
    /// A cart with a chain.
    #[derive(Clone, Dynamics)]
    #[coordinates(x: m, theta: [rad; 3])]
    #[inputs(push: N)]
    struct Chain { cart: f64, mass: [f64; 3], length: f64, g: f64, track: Spline }
"#;
const IMPLEMENTATION: &str = r#"
    impl Chain {
        fn place(&self, q: &Coordinates<Self>, i: usize) -> Vec2 {
            let mut place = vec2(q.x, self.track.at(q.x));
            for k in 0..=i {
                place += self.length * vec2(q.theta[k].sin(), -q.theta[k].cos());
            }
            place
        }
        #[kinetic]
        fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
            let mut sum = 0.5 * self.cart * q.x.dt().powi(2);
            for i in 0..3 { sum += 0.5 * self.mass[i] * self.place(q, i).dt().norm_squared(); }
            sum
        }
        #[potential]
        fn gravity(&self, q: &Coordinates<Self>) -> Expr { self.mass[2] * self.g * self.place(q, 2).y }
        #[force]
        fn drive(&self, q: &Coordinates<Self>) -> Force { Force::along(q.x, q.push) }
        #[event]
        fn start(&self, q: &Coordinates<Self>) -> Expr { q.x }
    }
"#;

fn tokens(text: &str) -> TokenStream {
    text.parse().expect("a test's tokens are tokens")
}

/// What `__model!` makes of both.
fn model() -> TokenStream {
    let (item, implementation) = (tokens(DECLARATION), tokens(IMPLEMENTATION));
    expand::model(quote::quote!({ #item } { #implementation }))
}

fn items(tokens: TokenStream) -> Vec<Item> {
    syn::parse2::<syn::File>(tokens).expect("what is emitted is a list of items").items
}

fn types(items: &[Item]) -> Vec<String> {
    items
        .iter()
        .filter_map(|item| if let Item::Struct(s) = item { Some(s.ident.to_string()) } else { None })
        .collect()
}

/// Names of the implemented traits, also inside of `const _: () = { .. }`.
fn implemented(items: &[Item]) -> Vec<String> {
    let mut found = Vec::new();
    for item in items {
        match item {
            Item::Impl(item) => {
                found.extend(
                    item.trait_.as_ref().and_then(|t| t.0.segments.last()).map(|s| s.ident.to_string()),
                );
            }
            Item::Const(constant) => {
                let syn::Expr::Block(block) = &*constant.expr else { continue };
                let inner = block
                    .block
                    .stmts
                    .iter()
                    .filter_map(|s| if let syn::Stmt::Item(i) = s { Some(i) } else { None });
                found.extend(implemented(&inner.cloned().collect::<Vec<_>>()));
            }
            _ => {}
        }
    }
    found
}

#[test]
fn the_same_tokens_give_the_same_text() {
    assert_eq!(model().to_string(), model().to_string());
    assert_eq!(
        expand::derive(tokens(DECLARATION)).to_string(),
        expand::derive(tokens(DECLARATION)).to_string()
    );
}

#[test]
fn the_derive_emits_the_types_with_the_models_names() {
    let items = items(expand::derive(tokens(DECLARATION)));
    assert_eq!(types(&items), ["ChainCoordinates", "ChainState", "ChainStateBuilder"]);
    let implemented = implemented(&items);
    assert!(
        ["Model", "ModelState"].iter().all(|name| implemented.iter().any(|i| i == name)),
        "{implemented:?}"
    );
    assert!(items.iter().any(|item| matches!(item, Item::Macro(_))), "the bridge");
}

#[test]
fn the_model_implements_every_capability_and_keeps_the_users_functions() {
    let items = items(model());
    let implemented = implemented(&items);
    for name in
        ["OnlyOneDynamicsImplPerModel", "Dynamics", "Energies", "Linearize", "Powers", "Outputs", "Events"]
    {
        assert_eq!(implemented.iter().filter(|i| *i == name).count(), 1, "{name} in {implemented:?}");
    }
    let own = items.iter().find_map(|item| match item {
        Item::Impl(item) if item.trait_.is_none() => Some(item),
        _ => None,
    });
    let own = own.expect("the user's impl block goes back into the program");
    let names: Vec<String> = own
        .items
        .iter()
        .filter_map(|item| if let ImplItem::Fn(f) = item { Some(f.sig.ident.to_string()) } else { None })
        .collect();
    assert_eq!(names, ["place", "kinetic", "gravity", "drive", "start"]);
    let text = own.to_token_stream().to_string();
    assert!(!text.contains("# [kinetic]") && !text.contains("# [force]"), "role attributes are taken off");
}

#[test]
fn nothing_is_named_but_by_absolute_path() {
    // Names of the prelude that a user's crate may shadow; in emitted code they follow `::` or are imported
    // beside the impls.
    let text = model().to_string();
    let emitted = text.split("const _ : () =").nth(1).expect("the impls stand in a block of their own");
    for name in ["Vec", "Some", "None", "Option", "String", "Box"] {
        for (at, _) in emitted.match_indices(&format!(" {name} ")) {
            assert!(emitted[..at].ends_with("::"), "`{name}` is named at: {}", &emitted[at..][..40]);
        }
    }
}

#[test]
fn no_block_is_longer_than_rustc_bears() {
    struct Longest(usize);
    impl<'a> syn::visit::Visit<'a> for Longest {
        fn visit_block(&mut self, block: &'a syn::Block) {
            self.0 = self.0.max(block.stmts.len());
            syn::visit::visit_block(self, block);
        }
    }
    // Eight links: Jacobians of thousands of operations.
    let resized = |text: &str| tokens(&text.replace("; 3]", "; 8]").replace("0..3", "0..8"));
    let (item, implementation) = (resized(DECLARATION), resized(IMPLEMENTATION));
    let file =
        syn::parse2::<syn::File>(expand::model(quote::quote!({ #item } { #implementation }))).expect("items");
    let mut longest = Longest(0);
    syn::visit::Visit::visit_file(&mut longest, &file);
    // Steps that are read once are written where they are read: a block of 256 steps has fewer statements.
    assert!((60..=300).contains(&longest.0), "{} statements in one block", longest.0);
}

/// Without a `#[drawing]` helpers that return places are drawn, arrays too; by their units directions,
/// velocities and forces are none.
#[test]
fn only_places_are_drawn() {
    let functions = r#"impl Bob {
        fn along(&self, q: &Coordinates<Self>) -> Vec2 { vec2(q.theta.sin(), -q.theta.cos()) }
        fn bob(&self, q: &Coordinates<Self>) -> Vec2 { self.length * self.along(q) }
        fn velocity(&self, q: &Coordinates<Self>) -> Vec2 { self.bob(q).dt() }
        fn rod(&self, q: &Coordinates<Self>) -> [Vec2; 2] { [0.5 * self.bob(q), self.bob(q)] }
        fn weight(&self) -> Vec2 { vec2(0.0, -self.mass * self.g) }
        fn axes(&self, q: &Coordinates<Self>) -> [[Vec2; 1]; 1] { [[self.along(q)]] }
        fn unread(&self, q: &Coordinates<Self>) -> dynamics::Vec3<Expr> { anything(q) }
        fn ahead(&self, q: &Coordinates<Self>) -> Vec2 { vec2(q.theta.cos(), q.theta.sin()) }
        fn half(&self, q: &Coordinates<Self>) -> Vec2 { 0.5 * self.bob(q) }
        #[kinetic]
        fn kinetic(&self, q: &Coordinates<Self>) -> Expr { 0.5 * self.mass * self.velocity(q).norm_squared() }
        #[potential]
        fn gravity(&self, q: &Coordinates<Self>) -> Expr {
            -self.weight().dot(2.0 * self.rod(q)[0])
                + 0.0 * self.mass * self.g * self.length * self.axes(q)[0][0].x
        }
    }"#;
    let drawn = |units: &str| {
        let declaration =
            format!("#[coordinates(theta: rad)] {units} struct Bob {{ mass: f64, length: f64, g: f64 }}");
        let (item, implementation) = (tokens(&declaration), tokens(functions));
        let emitted = expand::model(quote::quote!({ #item } { #implementation })).to_string();
        let drawing = emitted.split("of_helpers").nth(1).expect("helpers are drawn").split('}').next();
        let drawing = drawing.unwrap_or_default().to_owned();
        ["along", "bob", "velocity", "rod", "weight", "axes", "unread", "ahead", "half"]
            .map(|name| drawing.contains(&format!("\"{name}\"")))
    };
    let units = "#[units(mass: kg, length: m, g: m / s^2)]";
    assert_eq!(drawn(units), [false, true, false, true, false, false, true, false, true]);
    // Where no units are known every vector may be a place.
    assert_eq!(drawn(""), [true, true, true, true, false, true, true, true, true]);
}

/// What only moves the picture is no parameter without influence: in places that are drawn by themselves, and
/// in a drawing.
#[test]
fn what_only_places_the_picture_is_read() {
    let expanded = |place: &str, velocity: &str, more: &str| {
        let functions = format!(
            "impl Bob {{
                {place}
                #[kinetic]
                fn kinetic(&self, q: &Coordinates<Self>) -> Expr {{
                    0.5 * self.mass * {velocity}.norm_squared()
                }}
                {more}
            }}"
        );
        let declaration = "#[coordinates(theta: rad)] #[units(mass: kg, length: m, pivot: m)]
            struct Bob { mass: f64, length: f64, pivot: Vec2<f64> }";
        let (item, implementation) = (tokens(declaration), tokens(&functions));
        expand::model(quote::quote!({ #item } { #implementation })).to_string()
    };
    let place = "fn bob(&self, q: &Coordinates<Self>) -> Vec2 {
        self.pivot + self.length * vec2(q.theta.sin(), -q.theta.cos())
    }";
    assert!(!expanded(place, "self.bob(q).dt()", "").contains("compile_error"));
    // The place is not drawn where a drawing says what is.
    let other = "#[drawing] fn other(&self, q: &Coordinates<Self>) -> Drawing { Drawing::new() }";
    assert!(expanded(place, "self.bob(q).dt()", other).contains("`pivot` has no influence"));
    let drawing = "#[drawing] fn drawn(&self, q: &Coordinates<Self>) -> Drawing {
        Drawing::new().ball(self.bob(q), 0.1)
    }";
    assert!(!expanded(place, "self.bob(q).dt()", drawing).contains("compile_error"));
    // A velocity is no place.
    let velocity = "fn bob(&self, q: &Coordinates<Self>) -> Vec2 {
        self.length * vec2(q.theta.cos(), q.theta.sin()) * q.theta.dt() + 0.0 * self.pivot * q.theta.dt()
    }";
    assert!(expanded(velocity, "self.bob(q)", "").contains("`pivot` has no influence"));
}
