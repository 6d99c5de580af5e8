//! The driver: one line per pass, two error checkpoints.

use dynamics_symbolic::families::{Derived, FamilyModel, FamilyPortability, NoElement, Range, Shown};
use dynamics_symbolic::graph::NodeId;
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
    pub(crate) compiled: dynamics_symbolic::compile::Compiled,
    pub(crate) constants: Constants,
    /// Helpers that return vectors which by their units are no places: directions, velocities, forces.
    pub(crate) vectors: Vec<syn::Ident>,
}

/// A derived model with families.
#[derive(Clone, Debug)]
pub(crate) struct CompiledFamilies {
    pub(crate) declaration: Declaration,
    pub(crate) implementation: Implementation,
    pub(crate) family: FamilyModel,
    pub(crate) derived: Derived,
    /// For every field what the rounds give to a node far from all ends.
    pub(crate) interior: Vec<Option<NodeId>>,
    pub(crate) report: String,
    pub(crate) equations: String,
    /// The same in MathML.
    pub(crate) mathml: String,
    /// Names and units of the outputs, and whether they have a value for every index.
    pub(crate) outputs: Vec<(syn::Ident, String, bool)>,
    /// Helpers `(&self, q, index)` and `(&self, q, index, index)` that return places, with the indices for
    /// which they are called.
    pub(crate) places: Vec<(syn::Ident, Vec<Range>)>,
    pub(crate) portability: FamilyPortability,
    pub(crate) constants: Constants,
}

/// A derived model, of whatever kind.
pub(crate) enum Compiled {
    /// Of fixed size.
    Model(Box<CompiledModel>),
    /// With families.
    Families(Box<CompiledFamilies>),
}

/// Tokens of the struct and of its impl block → derived model.
pub(crate) fn compile(item_struct: TokenStream, item_impl: TokenStream) -> Result<Compiled, Vec<syn::Error>> {
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
    if declaration.has_families() {
        return families(declaration, implementation, diagnostics)
            .map(|compiled| Compiled::Families(Box::new(compiled)));
    }
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
            let compiled = CompiledModel { declaration, implementation, compiled, constants, vectors };
            Ok(Compiled::Model(Box::new(compiled)))
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

/// How many nodes a family has at least where the model is unrolled, beyond what its ends need.
const UNROLLED_BEYOND_ENDS: i64 = 3;

/// The same for a grid, of which the unrolled model has so many times as many nodes.
const UNROLLED_GRID: i64 = 2;

/// The counts at which a model is unrolled. They differ from one another, so that none can be taken for
/// another one.
fn witness_counts(family: &FamilyModel) -> Vec<i64> {
    let has_grids = family.fields.iter().any(|field| field.columns.is_some());
    let beyond = if has_grids { UNROLLED_GRID } else { UNROLLED_BEYOND_ENDS };
    let mut counts: Vec<i64> = Vec::new();
    for least in &family.least {
        let free = (least.max(&1) + beyond..).find(|count| !counts.contains(count));
        counts.extend(free);
    }
    counts
}

/// A model with families: element by element, and unrolled at small counts. The latter goes through all
/// checks of ordinary models, and has to have the same equations.
fn families(
    declaration: Declaration,
    implementation: Implementation,
    mut diagnostics: Diagnostics,
) -> Result<CompiledFamilies, Vec<syn::Error>> {
    let model = Place::from(declaration.name.span());
    let elaborated = elaborate::elaborate_families(&declaration, &implementation, &mut diagnostics);
    diagnostics.checkpoint()?;
    let elaborate::ElaboratedFamilies { mut family, origins, called } = elaborated;
    let derived = match dynamics_symbolic::families::derive(&mut family) {
        Ok(derived) => derived,
        Err(reasons) => {
            for reason in reasons {
                let (message, origin) = match reason {
                    NoElement::MassMoves { function, origin } => (messages::mass_moves(function), origin),
                    NoElement::NotQuadratic { function, origin } => {
                        (messages::energy_not_quadratic(function), origin)
                    }
                };
                diagnostics.error(origins.place(origin).unwrap_or(model), &message);
            }
            return Err(diagnostics.finish().err().unwrap_or_default());
        }
    };
    let counts = witness_counts(&family);
    let value = |name: &syn::Ident| {
        let index = family.counts.iter().position(|count| name == count);
        index.map_or(0, |index| counts[index])
    };
    let unrolled = declaration.at_counts(value);
    let witness = elaborate::elaborate_unrolled(&unrolled, &implementation, &counts, &mut diagnostics);
    diagnostics.checkpoint()?;
    let mut compiled = match dynamics_symbolic::compile::compile(witness.model) {
        Ok(compiled) => compiled,
        Err(findings) => {
            witness.origins.report_whole(findings, model, &mut diagnostics);
            return Err(diagnostics.finish().err().unwrap_or_default());
        }
    };
    let same = dynamics_symbolic::families::verify(
        &family,
        &derived,
        &counts,
        &mut compiled.model,
        &compiled.equations,
    );
    if let Err(mismatch) = same {
        let message = messages::elements_differ(mismatch.what, mismatch.coordinate);
        diagnostics.error(model, &message);
        return Err(diagnostics.finish().err().unwrap_or_default());
    }
    // What is inferred of units is known of the unrolled model.
    let unit =
        |name: &str| compiled.model.coordinates.iter().find(|c| c.name == name).map(|c| c.unit.clone());
    for field in &mut family.fields {
        let first = match (field.length, field.columns) {
            (None, _) => "",
            (Some(_), None) => "[0]",
            (Some(_), Some(_)) => "[0][0]",
        };
        let node = format!("{}{first}", field.name);
        field.unit = unit(&node).unwrap_or_default();
    }
    let mut known = compiled.model.constraints.iter();
    for constraint in &mut family.constraints {
        let Some(unrolled) = known.next() else { continue };
        for (unit, of_row) in constraint.units.iter_mut().zip(&unrolled.units) {
            unit.clone_from(of_row);
        }
    }
    let all = compiled.equations.conserved.iter();
    let mut conserved: Vec<String> = all.map(|c| of_families(&c.quantity.name, &family, &counts)).collect();
    conserved.dedup();
    let report = dynamics_symbolic::families::report(&family, &derived, &conserved);
    let outputs = implementation.functions.iter().filter(|f| f.role == Role::Output).map(|f| {
        let known = compiled.model.outputs.iter().find(|output| f.name == output.name.as_str());
        (f.name.clone(), known.map(|o| o.unit.clone()).unwrap_or_default(), f.returns_list())
    });
    let outputs: Vec<(syn::Ident, String, bool)> = outputs.collect();
    let places = places(&implementation, &called, &witness.vectors);
    let interior = dynamics_symbolic::families::interior_forces(&mut family, &derived.elements);
    let shown = shown(&family, &outputs, &places);
    let mut portability = dynamics_symbolic::families::javascript(&family, &derived, &interior, &shown);
    portability.obstacles.extend(not_shown(&shown, &outputs, &places));
    let equations = dynamics_symbolic::families::equations(&mut family, &derived);
    let (equations, mathml) = (equations.plain, equations.mathml);
    let constants = witness.constants;
    Ok(CompiledFamilies {
        declaration,
        implementation,
        family,
        derived,
        interior,
        report,
        equations,
        mathml,
        outputs,
        places,
        portability,
        constants,
    })
}

/// A conserved quantity of the unrolled model as one of families: sums over all nodes are sums over i again,
/// `momentum of sum of s[i]`. Of other combinations the numbers of the nodes say nothing.
fn of_families(name: &str, family: &FamilyModel, counts: &[i64]) -> String {
    let mut name = name.to_owned();
    for field in &family.fields {
        let Some(length) = field.length.map(|length| length.at(counts)).filter(|length| *length > 1) else {
            continue;
        };
        let nodes: Vec<String> = (0..length).map(|k| format!("{}[{k}]", field.name)).collect();
        name = name.replace(&nodes.join(" + "), &format!("sum of {}[i]", field.name));
        if nodes.iter().any(|node| name.contains(node.as_str())) {
            return String::from("momentum of a combination of nodes");
        }
    }
    name
}

/// What a live page shows: outputs with their units, and helpers that place nodes.
fn shown<'a>(
    family: &'a FamilyModel,
    outputs: &[(syn::Ident, String, bool)],
    places: &[(syn::Ident, Vec<Range>)],
) -> Vec<(&'a Shown, String)> {
    let mut all = Vec::new();
    for shown in &family.shown {
        let unit = match shown.is_place {
            true => places.iter().find(|(name, _)| *name == shown.function).map(|_| String::new()),
            false => {
                outputs.iter().find(|(name, ..)| *name == shown.function).map(|(_, unit, _)| unit.clone())
            }
        };
        all.extend(unit.map(|unit| (shown, unit)));
    }
    all
}

/// What a live page lacks, in words.
fn not_shown(
    shown: &[(&Shown, String)],
    outputs: &[(syn::Ident, String, bool)],
    places: &[(syn::Ident, Vec<Range>)],
) -> Vec<String> {
    let is_shown = |name: &syn::Ident| shown.iter().any(|(shown, _)| *name == shown.function);
    let outputs = outputs.iter().filter(|(name, ..)| !is_shown(name)).map(|(name, ..)| {
        format!(
            "the page does not show the output `{name}`: the macro could not follow it for a range of indices"
        )
    });
    let places = places.iter().filter(|(name, _)| !is_shown(name));
    let places = places
        .map(|(name, _)| format!("the places of `{name}` cannot be followed: its live page lacks them"));
    outputs.chain(places).collect()
}

/// Helpers `(&self, q, index)` and `(&self, q, index, index)` that return places, with all indices for which
/// they are called. A helper is left out where two counts decide which of these is the last: drawings would
/// ask for nodes that are not there.
fn places(
    implementation: &Implementation,
    called: &[(usize, Vec<Range>)],
    vectors: &[syn::Ident],
) -> Vec<(syn::Ident, Vec<Range>)> {
    let place = |(index, ranges): (usize, Option<Vec<Range>>)| {
        let function = &implementation.functions[index];
        let is_place = function.may_be_place_of_index() && !vectors.contains(&function.name);
        Some((function.name.clone(), ranges.filter(|_| is_place)?))
    };
    elaborate::hulls(called).into_iter().filter_map(place).collect()
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
