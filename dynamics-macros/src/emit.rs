//! From a compiled model to Rust tokens. Cannot fail: every check has been made before.
//!
//! What is emitted names everything by absolute path through `__private` of the façade, so that a user's
//! crate may shadow whatever it likes.
//!
//! Sizes follow measurements. Blocks have at most 256 `let`s, because longer ones crash rustc with debug
//! information. Functions have about 1,024 operations above 4,000, and share one array. The engine refuses
//! above 20,000. What a run does not ask for at every step (M, energies, derivatives) is then a table instead
//! of functions: one literal, which the runtime reads at one and a half times the time of the code, and free
//! to compile. What has more than 600 steps is not inlined: every part into which the compiler divides a
//! program would have its copy. Programs are printed as text and parsed once. A value that is read once
//! stands where it is read.

mod bridge;
mod builder;
mod constants;
mod coordinates;
mod docs;
mod fallback;
mod families;
mod program;
mod state;
mod traits;

pub(crate) use bridge::{bridge, broken_bridge, dead_bridge, mark, once, once_per_name};
pub(crate) use constants::{assert_paths, followed};
pub(crate) use fallback::fallback;
pub(crate) use families::{family_fallback, family_traits, family_types};
pub(crate) use traits::traits;

use std::mem;

use proc_macro2::{Delimiter, Group, Span, TokenStream, TokenTree};
use quote::{format_ident, quote};
use syn::{Ident, Path, Visibility};

use crate::syntax::Targets;

/// What the user's struct looks like from outside: all that the types with its names need.
#[derive(Clone)]
pub(crate) struct Surface {
    /// Name of the struct.
    pub(crate) name: Ident,
    /// How the impl block names it; the struct may stand in another module.
    pub(crate) target: TokenStream,
    /// Where the block has its `impl` and its braces.
    pub(crate) block: Option<[Span; 2]>,
    /// Its visibility, which the generated types share.
    pub(crate) vis: Visibility,
    /// Path of the façade crate.
    pub(crate) krate: Path,
    /// Whether sines and cosines are the platform's.
    pub(crate) accurate: bool,
    /// The languages in which programs are printed besides.
    pub(crate) targets: Targets,
    /// Generalized coordinates as declared.
    pub(crate) coordinates: Vec<Slot>,
    /// Generalized speeds as declared.
    pub(crate) speeds: Vec<Slot>,
    /// Inputs as declared.
    pub(crate) inputs: Vec<Slot>,
    /// What follows `model` to read each scalar parameter: `.m1`, `.mass[3]`, `.axis.x`.
    pub(crate) parameters: Vec<TokenStream>,
    /// Fields that are smooth functions.
    pub(crate) functions: Vec<Ident>,
    /// Functions of constraints in the order of their rows.
    pub(crate) constraints: Vec<Ident>,
    /// Helper functions `(&self, q) -> Vec2`, `Vec3` or an array of them that may be places: the points of
    /// the default drawing.
    pub(crate) points: Vec<Ident>,
    /// The `#[drawing]` function.
    pub(crate) drawing: Option<Ident>,
    /// The documentation of the struct.
    pub(crate) documentation: String,
    /// The documentation of its fields that have some: name and text.
    pub(crate) field_documentation: Vec<(String, String)>,
}

/// A declared coordinate or input, perhaps an array of them.
#[derive(Clone)]
pub(crate) struct Slot {
    /// Its name.
    pub(crate) name: Ident,
    /// Number of elements of an array; `None` for a scalar.
    pub(crate) len: Option<usize>,
    /// Whether it is a family, whose length is known when the program runs.
    pub(crate) family: bool,
    /// Whether its nodes have two indices.
    pub(crate) grid: bool,
    /// Its unit, empty where not declared.
    pub(crate) unit: String,
}

impl Slot {
    fn width(&self) -> usize {
        self.len.unwrap_or(1)
    }
    fn ty(&self, element: &TokenStream) -> TokenStream {
        match self.len {
            Some(n) => quote!([#element; #n]),
            None => element.clone(),
        }
    }
    /// The name without `r#`.
    fn text(&self) -> String {
        plain(&self.name)
    }
}

/// An identifier as text, without `r#`.
pub(crate) fn plain(name: &Ident) -> String {
    let text = name.to_string();
    text.strip_prefix("r#").map(str::to_owned).unwrap_or(text)
}

impl Surface {
    /// Number of generalized coordinates.
    fn degrees(&self) -> usize {
        self.coordinates.iter().map(Slot::width).sum()
    }
    /// Number of inputs.
    fn input_count(&self) -> usize {
        self.inputs.iter().map(Slot::width).sum()
    }
    /// Number of generalized speeds.
    fn speed_count(&self) -> usize {
        self.speeds.iter().map(Slot::width).sum()
    }
    fn coordinates_type(&self) -> Ident {
        format_ident!("{}Coordinates", self.name)
    }
    fn state_type(&self) -> Ident {
        format_ident!("{}State", self.name)
    }
    fn builder_type(&self) -> Ident {
        format_ident!("{}StateBuilder", self.name)
    }
    /// Visibility of what the impl block adds: the struct's own is relative to the struct's module, which may
    /// be another one.
    fn impl_vis(&self) -> TokenStream {
        match self.vis {
            Visibility::Public(_) => quote!(pub),
            _ => quote!(pub(crate)),
        }
    }
    /// Path of what generated code uses.
    fn private(&self) -> TokenStream {
        let krate = &self.krate;
        quote!(#krate::__private)
    }
}

/// Every slot with the index of its first element.
fn offsets(slots: &[Slot]) -> impl Iterator<Item = (usize, &Slot)> {
    slots.iter().scan(0, |next, slot| {
        let at = *next;
        *next += slot.width();
        Some((at, slot))
    })
}

/// An identifier for a local of generated code; what programs print as text finds it by its name.
///
/// A pattern that is the name of a static or a constant in scope is no binding but that static or constant,
/// whatever the hygiene of its span: names that users have for theirs must not be bound.
fn local(name: &str) -> Ident {
    function(&format!("__{name}"))
}

/// An identifier for a function, or whatever else patterns cannot bind.
fn function(name: &str) -> Ident {
    Ident::new(name, Span::call_site())
}

/// Attributes of everything that is generated: no lint of the user's crate concerns it.
fn quiet() -> TokenStream {
    quote!(#[allow(unused, clippy::all, clippy::pedantic, clippy::nursery)])
}

/// What two blocks for one struct collide on, where they stand in two modules.
fn only_one(surface: &Surface) -> TokenStream {
    let (model, private) = (&surface.target, surface.private());
    quote!(impl #private::OnlyOneDynamicsImplPerModel for #model {})
}

/// `<Model as Complete>`: what the derive's types need of the impl block.
fn complete(surface: &Surface) -> TokenStream {
    let (model, private) = (&surface.name, surface.private());
    quote!(<#model as #private::Complete>)
}

/// Tokens that are shown at the struct's name: rustc says the same thing of the same place once, so that a
/// missing impl block is one error.
fn at_name(surface: &Surface, tokens: TokenStream) -> TokenStream {
    let tokens = tokens.into_iter().map(|mut tree| {
        if let TokenTree::Group(group) = &mut tree {
            *group = Group::new(group.delimiter(), at_name(surface, group.stream()));
        }
        tree.set_span(Span::call_site().located_at(surface.name.span()));
        tree
    });
    tokens.collect()
}

/// Puts generated impls where the user's block is, so that rustc names it where they collide with those of a
/// second block.
fn at_block(surface: &Surface, tokens: TokenStream) -> TokenStream {
    match surface.block {
        Some(spans) => respanned(spans, tokens, 2),
        None => tokens,
    }
}

/// The impls in `tokens` and in braces at most `depth` deep: the bodies of functions are long and hold none.
fn respanned(spans: [Span; 2], tokens: TokenStream, depth: usize) -> TokenStream {
    let [keyword, braces] = spans.map(|span| Span::call_site().located_at(span));
    let mut of_impl = false;
    let tokens = tokens.into_iter().map(|mut tree| {
        match &mut tree {
            TokenTree::Ident(word) if word == "impl" => {
                of_impl = true;
                word.set_span(keyword);
            }
            TokenTree::Group(group) if group.delimiter() == Delimiter::Brace => {
                let inner = if of_impl || depth == 0 {
                    group.stream()
                } else {
                    respanned(spans, group.stream(), depth - 1)
                };
                let span = if mem::take(&mut of_impl) { braces } else { group.span() };
                *group = Group::new(Delimiter::Brace, inner);
                group.set_span(span);
            }
            _ => {}
        }
        tree
    });
    tokens.collect()
}

/// The types that carry the names of a model: coordinates, state and its builder. They need the struct alone.
pub(crate) fn named_types(surface: &Surface) -> TokenStream {
    let (coordinates, state, builder) =
        (coordinates::coordinates(surface), state::state(surface), builder::builder(surface));
    let model = coordinates::model(surface);
    quote!(#coordinates #state #builder #model)
}
