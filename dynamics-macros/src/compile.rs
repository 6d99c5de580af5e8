//! The driver: one line per pass, two error checkpoints.

use dynamics_symbolic::compile::Compiled;
use proc_macro2::{TokenStream, TokenTree};
use quote::ToTokens;

use crate::assertions::Constants;
use crate::diagnostics::{Diagnostics, Place};
use crate::elaborate;
use crate::library::{self, Library};
use crate::messages;
use crate::suggest;
use crate::syntax::{self, Declaration, Implementation, Role};

/// A model with everything that emission needs.
#[derive(Clone, Debug)]
pub(crate) struct CompiledModel {
    pub(crate) declaration: Declaration,
    pub(crate) implementation: Implementation,
    pub(crate) compiled: Compiled,
    pub(crate) constants: Constants,
    /// Helpers that return vectors which by their units are no places: directions, velocities, forces.
    pub(crate) vectors: Vec<syn::Ident>,
}

/// Tokens of the struct and of its impl block → derived model.
pub(crate) fn compile(
    item_struct: TokenStream,
    item_impl: TokenStream,
) -> Result<CompiledModel, Vec<syn::Error>> {
    let mut diagnostics = Diagnostics::new();
    let declaration = syntax::parse_struct(item_struct, &mut diagnostics);
    let implementation = syntax::parse_impl(item_impl, &mut diagnostics);
    if let (Some(declaration), Some(implementation)) = (&declaration, &implementation) {
        check_name(declaration, implementation, &mut diagnostics);
        check_output_units(declaration, implementation, &mut diagnostics);
    }
    diagnostics.checkpoint()?;
    let (Some(declaration), Some(implementation)) = (declaration, implementation) else {
        return Err(Vec::new());
    };
    let elaborated = elaborate::elaborate(&declaration, &implementation, &mut diagnostics);
    let model = Place::from(declaration.name.span());
    if diagnostics.len() > 0 {
        // What could be elaborated has its own mistakes, which do not wait for those of others.
        let findings = dynamics_symbolic::check::one_by_one(&elaborated.model);
        elaborated.origins.report_whole(findings, model, &mut diagnostics);
    }
    diagnostics.checkpoint()?;

    match dynamics_symbolic::compile::compile(elaborated.model) {
        Ok(compiled) => {
            let elaborate::Elaborated { constants, vectors, .. } = elaborated;
            Ok(CompiledModel { declaration, implementation, compiled, constants, vectors })
        }
        Err(findings) => {
            let terms = elaborate::elaborate_terms(&declaration, &implementation);
            let at_fault = dynamics_symbolic::check::one_by_one(&terms.model);
            let beside = terms.origins.beside(at_fault);
            elaborated.origins.report_at_terms(findings, &beside, model, &mut diagnostics);
            Err(diagnostics.finish().err().unwrap_or_default())
        }
    }
}

/// Types of the language of models that only some models name.
const SOMETIMES_NAMED: &[&str] = &["Drawing", "Force", "Mat3", "Vec2", "Vec3"];

/// Whether tokens name this as what the user's modules have: alone, or by `self::`, `super::` or `crate::`.
fn names_own(tokens: TokenStream, name: &str) -> bool {
    let mut left = vec![tokens];
    while let Some(stream) = left.pop() {
        let mut before = [const { String::new() }; 3];
        for tree in stream {
            let own = before[1..] != [":", ":"] || matches!(&*before[0], "self" | "super" | "crate");
            let text = match tree {
                TokenTree::Ident(word) if own && word == name => return true,
                TokenTree::Group(group) => {
                    left.push(group.stream());
                    String::new()
                }
                other => other.to_string(),
            };
            before.rotate_left(1);
            before[2] = text;
        }
    }
    false
}

/// Refuses a struct with the name of a type that its own functions use: they would find the struct, and the
/// macro could not notice. A name with a path before it is found where the path leads.
fn check_name(declaration: &Declaration, implementation: &Implementation, diagnostics: &mut Diagnostics) {
    let name = declaration.name.to_string();
    let named = |stream: TokenStream| match SOMETIMES_NAMED.contains(&name.as_str()) {
        true => names_own(stream, &name),
        // What the library has is read by its name, whatever stands before it.
        false => Library::has(&name) && library::any_word(stream, &|word| word == name),
    };
    let items = implementation.item.items.iter().map(ToTokens::into_token_stream);
    let fields = declaration.item.fields.iter().map(|field| field.ty.to_token_stream());
    if items.chain(fields).any(named) {
        diagnostics.error(declaration.name.span(), &messages::name_of_language(&name));
    }
}

/// `#[units(..)]` names fields, and outputs.
fn check_output_units(
    declaration: &Declaration,
    implementation: &Implementation,
    diagnostics: &mut Diagnostics,
) {
    let outputs =
        || implementation.functions.iter().filter(|f| f.role == Role::Output).map(|f| f.name.to_string());
    let known: Vec<String> = declaration.fields.iter().map(|f| f.name.to_string()).chain(outputs()).collect();
    for (i, (name, _)) in declaration.output_units.iter().enumerate() {
        if !outputs().any(|output| name == output.as_str()) {
            let hint = suggest::did_you_mean(&name.to_string(), known.iter().map(String::as_str));
            diagnostics.error(name.span(), &messages::units_of_unknown(name, hint));
        } else if declaration.output_units[..i].iter().any(|(before, _)| before == name) {
            diagnostics.error(name.span(), &messages::entry_twice("units", name));
        }
    }
}
