//! What the entry points do, on `proc_macro2` tokens, so that it can be tested outside of a macro.

use proc_macro2::{Delimiter, Span, TokenStream, TokenTree};
use quote::{ToTokens, quote};
use syn::{Ident, ImplItem, ItemImpl, ItemStruct, ReturnType, Type};

use crate::assertions::Constants;
use crate::compile::{Compiled, CompiledFamilies, CompiledModel, compile};
use crate::diagnostics::{Diagnostics, Place};
use crate::elaborate;
use crate::emit::{self, Slot, Surface};
use crate::messages;
use crate::syntax::{self, Declaration, FieldKind, Implementation, Quantity, Role};

/// `#[derive(Dynamics)]` in this line and column, unless the module has a model of the struct's name already:
/// rustc says so of the structs, and would of everything that the derive adds.
pub(crate) fn derive_once(item: TokenStream, place: [usize; 2]) -> TokenStream {
    let name = is_shallow(&item)
        .then(|| syn::parse2::<syn::DeriveInput>(item.clone()).ok())
        .flatten()
        .map(|s| s.ident);
    match name {
        Some(name) => emit::once_per_name(&name, &derive(item.clone()), &item, place),
        None => derive(item),
    }
}

/// The types with the model's names, and the bridge to `#[dynamics] impl`.
pub(crate) fn derive(item: TokenStream) -> TokenStream {
    let mut diagnostics = Diagnostics::new();
    let declaration = syntax::parse_struct(ungrouped(item.clone()), &mut diagnostics);
    let errors = diagnostics.finish().err().unwrap_or_default();
    let errors = report(&errors);
    let Some(declaration) = declaration else {
        // The impl block finds a bridge that drops it: its errors would only repeat the struct's.
        let named = is_shallow(&item).then(|| syn::parse2::<syn::DeriveInput>(item).ok()).flatten();
        let bridge = named.map(|item| {
            let (bridge, mark) =
                (emit::dead_bridge(&item.ident, &item.vis), emit::mark(&item.ident, &item.generics));
            quote!(#bridge #mark)
        });
        return quote!(#errors #bridge);
    };
    let mark = emit::mark(&declaration.name, &declaration.item.generics);
    let surface = surface(&declaration, None, &[]);
    let families = declaration.has_families();
    let types = if families { emit::family_types(&surface) } else { emit::named_types(&surface) };
    if errors.is_empty() {
        let bridge = emit::bridge(&surface, &own_tokens(declaration.item));
        quote!(#types #bridge #mark)
    } else {
        let bridge = emit::broken_bridge(&surface);
        let fallback = if families { emit::family_fallback(&surface) } else { emit::fallback(&surface) };
        if !declaration.item.generics.params.is_empty() {
            // Impls for a type whose arguments are missing would be a second error.
            return quote!(#errors #bridge #mark);
        }
        if syntax::is_always_named(&declaration.name) {
            // As would be the functions of the block, which name the type that the struct hides.
            let bridge = emit::dead_bridge(&declaration.name, &declaration.visibility);
            return quote!(#errors #types #bridge #mark #fallback);
        }
        quote!(#errors #types #bridge #mark #fallback)
    }
}

/// `#[dynamics] impl X { .. }` in this line and column: hands the block to the bridge, a macro of the
/// struct's own name.
pub(crate) fn attribute(arguments: TokenStream, item: TokenStream, place: [usize; 2]) -> TokenStream {
    let mut diagnostics = Diagnostics::new();
    if !arguments.is_empty() {
        diagnostics.error(Place::of(&arguments), &messages::attribute_arguments());
    }
    let errors = report(&diagnostics.finish().err().unwrap_or_default());
    let header = header(item.clone());
    if !is_shallow(&header) {
        return syn::Error::new(Span::call_site(), messages::not_an_impl()).to_compile_error();
    }
    let bridge = match syn::parse2::<ItemImpl>(header) {
        Ok(ItemImpl { self_ty, trait_: None, .. }) => match *self_ty {
            Type::Path(ty)
                if ty.qself.is_none() && ty.path.segments.first().is_some_and(|s| s.ident != "Self") =>
            {
                Ok(ty.path)
            }
            // The block itself would be rustc's second error.
            other => {
                return syn::Error::new_spanned(other, messages::impl_of_other_type()).to_compile_error();
            }
        },
        Ok(ItemImpl { trait_: Some((path, _)), .. }) => {
            Err(syn::Error::new_spanned(path, messages::trait_impl()))
        }
        Err(_) => Err(syn::Error::new(Span::call_site(), messages::not_an_impl())),
    };
    match bridge {
        Ok(mut path) => {
            // A generic struct would need its types here. That it is generic is an error already.
            let marked = path.segments.iter().all(|segment| segment.arguments.is_none());
            path.segments.iter_mut().for_each(|segment| segment.arguments = syn::PathArguments::None);
            let once = emit::once(&path, &item, marked, place);
            quote!(#errors #once)
        }
        Err(error) => {
            let error = error.to_compile_error();
            quote!(#error #item)
        }
    }
}

/// `#[kinetic]` and the like, where no `#[dynamics]` has removed them: on a method the derive reports the
/// missing attribute; anywhere else they do nothing.
pub(crate) fn role(name: &str, item: TokenStream) -> TokenStream {
    let is_method = |f: syn::ImplItemFn| f.sig.receiver().is_some();
    if !is_shallow(&item) || syn::parse2(item.clone()).is_ok_and(is_method) {
        return item;
    }
    let error = syn::Error::new(Span::call_site(), messages::role_outside(name)).to_compile_error();
    quote!(#error #item)
}

/// Whether `syn` may see the tokens; what is too deep is reported by whoever parses in earnest.
fn is_shallow(tokens: &TokenStream) -> bool {
    let mut depth = Diagnostics::new();
    let shallow = syntax::check_nesting(tokens, &mut depth).is_some();
    let _ = depth.finish();
    shallow
}

/// An item with nothing in its last braces: all that is needed to know whose `impl` it is, however deep the
/// functions nest.
fn header(item: TokenStream) -> TokenStream {
    let mut tokens: Vec<TokenTree> = item.into_iter().collect();
    if let Some(TokenTree::Group(body)) = tokens.last_mut()
        && body.delimiter() == Delimiter::Brace
    {
        let mut empty = proc_macro2::Group::new(Delimiter::Brace, TokenStream::new());
        empty.set_span(body.span());
        *body = empty;
    }
    tokens.into_iter().collect()
}

/// `__model!({struct} {impl})`: everything that is derived from both.
pub(crate) fn model(input: TokenStream) -> TokenStream {
    let mut groups = input.into_iter().filter_map(|tree| match tree {
        TokenTree::Group(group) if group.delimiter() == Delimiter::Brace => Some(group.stream()),
        _ => None,
    });
    let (Some(item), Some(implementation)) = (groups.next(), groups.next()) else {
        return syn::Error::new(Span::call_site(), "write `#[dynamics] impl Model { .. }`")
            .to_compile_error();
    };
    if item.is_empty() {
        return stubbed(implementation);
    }
    let (item, implementation) = (resolved_like(item, &implementation), ungrouped(implementation));
    match compile(item.clone(), implementation.clone()) {
        Ok(Compiled::Families(families)) => {
            let CompiledFamilies { declaration, implementation, constants, .. } = &*families;
            let surface = surface(declaration, Some(implementation), &[]);
            let (item, traits) =
                (kept(implementation, constants, &surface), emit::family_traits(&surface, &families));
            let asserted = emit::followed(&surface, constants);
            quote!(#item #traits #asserted)
        }
        Ok(Compiled::Model(model)) => {
            let CompiledModel { declaration, implementation, compiled, constants, vectors } = *model;
            let surface = surface(&declaration, Some(&implementation), &vectors);
            let (item, traits) =
                (kept(&implementation, &constants, &surface), emit::traits(&surface, &compiled));
            let asserted = emit::followed(&surface, &constants);
            quote!(#item #traits #asserted)
        }
        Err(errors) => {
            let (errors, stubbed) = (failed(&errors), stubbed(implementation));
            let fallback = declared(item).map(|declaration| {
                let surface = surface(&declaration, None, &[]);
                if declaration.has_families() {
                    emit::family_fallback(&surface)
                } else {
                    emit::fallback(&surface)
                }
            });
            quote!(#errors #stubbed #fallback)
        }
    }
}

/// The errors of the model; never none, since what is emitted beside them does not work.
fn failed(errors: &[syn::Error]) -> TokenStream {
    if errors.is_empty() {
        let message = "the model cannot be derived, and no reason was found; this is a mistake of \
            `dynamics`, please report it";
        return syn::Error::new(Span::call_site(), message).to_compile_error();
    }
    report(errors)
}

fn report(errors: &[syn::Error]) -> TokenStream {
    errors.iter().map(syn::Error::to_compile_error).collect()
}

/// The declaration of a struct that the derive has accepted.
fn declared(item: TokenStream) -> Option<Declaration> {
    let mut diagnostics = Diagnostics::new();
    let declaration = syntax::parse_struct(item, &mut diagnostics);
    // The derive has reported what is wrong with the struct.
    let _ = diagnostics.finish();
    declaration
}

/// The struct without attributes of other macros, which say nothing about the model and may contain any
/// tokens.
fn own_tokens(mut item: ItemStruct) -> TokenStream {
    item.attrs.retain(|attribute| syntax::ATTRIBUTES.iter().any(|own| attribute.path().is_ident(own)));
    item.fields.iter_mut().for_each(|field| field.attrs.clear());
    item.into_token_stream()
}

/// Tokens that passed through the bridge's body resolve inside it; errors on them should read as errors on
/// the user's own.
fn resolved_like(tokens: TokenStream, user: &TokenStream) -> TokenStream {
    match user.clone().into_iter().next() {
        Some(tree) if is_shallow(&tokens) => resolved_at(tokens, tree.span()),
        _ => tokens,
    }
}

fn resolved_at(tokens: TokenStream, context: Span) -> TokenStream {
    tokens
        .into_iter()
        .map(|mut tree| {
            let span = tree.span().resolved_at(context);
            if let TokenTree::Group(group) = &mut tree {
                *group = proc_macro2::Group::new(group.delimiter(), resolved_at(group.stream(), context));
            }
            tree.set_span(span);
            tree
        })
        .collect()
}

/// Takes the invisible group off single tokens: a `$n:literal` of the user's own macro is as good as the
/// literal.
fn ungrouped(tokens: TokenStream) -> TokenStream {
    if is_shallow(&tokens) { ungrouped_within(tokens) } else { tokens }
}

fn ungrouped_within(tokens: TokenStream) -> TokenStream {
    tokens
        .into_iter()
        .map(|tree| {
            let TokenTree::Group(group) = tree else { return tree };
            let (delimiter, inner) = (group.delimiter(), ungrouped_within(group.stream()));
            let mut trees = inner.clone().into_iter();
            match (delimiter, trees.next(), trees.next()) {
                (Delimiter::None, Some(only), None) => only,
                _ => {
                    let mut rebuilt = proc_macro2::Group::new(delimiter, inner);
                    rebuilt.set_span(group.span());
                    TokenTree::Group(rebuilt)
                }
            }
        })
        .collect()
}

/// The user's impl block as it goes back into the program. What has a role is used by the derivation, even
/// where nothing calls it.
fn kept(implementation: &Implementation, constants: &Constants, surface: &Surface) -> TokenStream {
    let mut item = implementation.item.clone();
    emit::assert_paths(&mut item, implementation, constants, surface);
    // What the lint advises, `iter_mut`, a model cannot say.
    item.attrs.push(syn::parse_quote!(#[allow(clippy::needless_range_loop)]));
    for entry in &mut item.items {
        if let ImplItem::Fn(function) = entry {
            let known = implementation.functions.iter().find(|f| f.name == function.sig.ident);
            if known.is_some_and(|f| f.role != Role::Helper) {
                function.attrs.push(syn::parse_quote!(#[allow(dead_code, clippy::unused_self)]));
            }
        }
    }
    item.into_token_stream()
}

/// The impl block of a model with errors: signatures remain for who calls them; bodies do not, since rustc
/// would report their mistakes again.
fn stubbed(implementation: TokenStream) -> TokenStream {
    // That it is too deep is among the model's errors already.
    let shown =
        if is_shallow(&implementation) { implementation.clone() } else { header(implementation.clone()) };
    if !is_shallow(&shown) {
        return TokenStream::new();
    }
    let Ok(mut item) = syn::parse2::<ItemImpl>(shown) else { return implementation };
    if !item.generics.params.is_empty() {
        // A generic struct has no coordinates that the signatures could name.
        return TokenStream::new();
    }
    // A second item of the name would be rustc's second error.
    item.items.retain(|entry| !elaborate::is_generated(entry));
    for entry in &mut item.items {
        if let ImplItem::Fn(function) = entry {
            function.attrs.retain(kept_in_stub);
            if !matches!(&function.sig.output, ReturnType::Type(_, ty) if matches!(**ty, Type::ImplTrait(_)))
            {
                function.block = syn::parse_quote!({ ::core::unreachable!() });
            }
        }
    }
    quote!(#[allow(unused, clippy::all, clippy::pedantic)] #item)
}

/// Attributes that matter to callers; a role's, or a misspelt one, is unknown to rustc.
fn kept_in_stub(attribute: &syn::Attribute) -> bool {
    ["doc", "cfg", "must_use", "deprecated"].iter().any(|name| attribute.path().is_ident(name))
}

/// The fields that have documentation: name and text.
fn documented_fields(item: &ItemStruct) -> Vec<(String, String)> {
    let text = |field: &syn::Field| Some((emit::plain(field.ident.as_ref()?), documentation(&field.attrs)));
    item.fields.iter().filter_map(text).filter(|(_, text)| !text.is_empty()).collect()
}

/// The text of documentation comments, a line each.
fn documentation(attributes: &[syn::Attribute]) -> String {
    let lines = attributes.iter().filter_map(|attribute| match &attribute.meta {
        syn::Meta::NameValue(pair) if pair.path.is_ident("doc") => match &pair.value {
            syn::Expr::Lit(syn::ExprLit { lit: syn::Lit::Str(text), .. }) => Some(text.value()),
            _ => None,
        },
        _ => None,
    });
    lines.map(|line| line.trim().to_owned()).collect::<Vec<_>>().join("\n").trim().to_owned()
}

/// The parts of the declarations that emission needs.
fn surface(declaration: &Declaration, implementation: Option<&Implementation>, vectors: &[Ident]) -> Surface {
    let slot = |quantity: &Quantity| Slot {
        name: quantity.name.clone(),
        len: quantity.length,
        family: quantity.family.is_some(),
        grid: quantity.family_columns.is_some(),
        unit: quantity.unit.as_ref().map(syntax::UnitText::text).unwrap_or_default(),
    };
    let (mut parameters, mut functions) = (Vec::new(), Vec::new());
    for field in &declaration.fields {
        let name = &field.name;
        match &field.kind {
            FieldKind::Parameter { shape, .. } => {
                parameters.extend(shape.elements().into_iter().map(|element| {
                    let access = element.access;
                    quote!(.#name #access)
                }));
            }
            FieldKind::Function(_) => functions.push(name.clone()),
            FieldKind::Count | FieldKind::Numbered => {}
        }
    }
    let functions_of = |wanted: &dyn Fn(&syntax::Function) -> bool| -> Vec<Ident> {
        let all = implementation.map(|i| i.functions.as_slice()).unwrap_or_default();
        all.iter().filter(|f| wanted(f)).map(|f| f.name.clone()).collect()
    };
    Surface {
        name: declaration.name.clone(),
        target: implementation
            .map_or_else(|| declaration.name.to_token_stream(), |i| i.item.self_ty.to_token_stream()),
        block: implementation.map(|i| [i.item.impl_token.span, i.item.brace_token.span.join()]),
        vis: declaration.visibility.clone(),
        krate: declaration.crate_path.clone().unwrap_or_else(|| syn::parse_quote!(::dynamics)),
        accurate: declaration.accurate,
        targets: declaration.targets,
        coordinates: declaration.coordinates.iter().map(slot).collect(),
        speeds: declaration.speeds.iter().map(slot).collect(),
        inputs: declaration.inputs.iter().map(slot).collect(),
        parameters,
        functions,
        constraints: [Role::Holonomic, Role::Nonholonomic]
            .into_iter()
            .flat_map(|role| functions_of(&|f| f.role == role))
            .collect(),
        points: functions_of(&|f| f.role == Role::Helper && f.may_be_place() && !vectors.contains(&f.name)),
        drawing: functions_of(&|f| f.role == Role::Drawing).into_iter().next(),
        documentation: documentation(&declaration.item.attrs),
        field_documentation: documented_fields(&declaration.item),
    }
}
