//! The attributes that give a function its role, and the options of constraints.

use std::mem;

use syn::parse::Parser;
use syn::punctuated::Punctuated;
use syn::{Attribute, Ident, ImplItemFn, Meta, Token};

use crate::diagnostics::{Diagnostics, Place};
use crate::messages;
use crate::suggest;

/// What a function means to the model.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Role {
    Kinetic,
    Potential,
    Lagrangian,
    Dissipation,
    Force,
    Holonomic,
    Nonholonomic,
    /// What a speed of its name is.
    Kinematic,
    Output,
    Event,
    /// Any Rust; runs when the motion is drawn, is not elaborated.
    Drawing,
    /// No role.
    Helper,
}

/// Attribute names of the roles.
pub(crate) const ROLES: &[(&str, Role)] = &[
    ("kinetic", Role::Kinetic),
    ("potential", Role::Potential),
    ("lagrangian", Role::Lagrangian),
    ("dissipation", Role::Dissipation),
    ("force", Role::Force),
    ("holonomic", Role::Holonomic),
    ("nonholonomic", Role::Nonholonomic),
    ("kinematic", Role::Kinematic),
    ("output", Role::Output),
    ("event", Role::Event),
    ("drawing", Role::Drawing),
];

impl Role {
    /// Whether it declares a constraint.
    pub(crate) fn is_constraint(self) -> bool {
        matches!(self, Self::Holonomic | Self::Nonholonomic)
    }
    /// The attribute's name; empty for helpers.
    pub(crate) fn name(self) -> &'static str {
        ROLES.iter().find(|(_, role)| *role == self).map_or("", |(name, _)| name)
    }
}

/// Whether an attribute is `#[drawing]`.
pub(super) fn is_drawing(attribute: &syn::Attribute) -> bool {
    attribute.path().is_ident(Role::Drawing.name())
}

/// Options of a constraint, beside its role.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct ConstraintOptions {
    /// It is switched on and off while the model runs.
    pub(crate) switched: bool,
    /// `integrable`: that the constraint, or a combination of it with others, can be integrated on purpose.
    pub(crate) integrable: Option<Place>,
    /// `#[redundant]`: that the constraint repeats others on purpose.
    pub(crate) redundant: Option<Place>,
}

/// The role of a function, and its options.
pub(super) struct FunctionAttributes {
    pub(super) role: Role,
    pub(super) place: Place,
    pub(super) options: ConstraintOptions,
}

/// The attribute beside a constraint's role.
const REDUNDANT: &str = "redundant";

/// Options in the parentheses of a constraint's role, with the roles that have them.
const OPTIONS: &[(&str, &[Role])] =
    &[("switched", &[Role::Holonomic, Role::Nonholonomic]), ("integrable", &[Role::Nonholonomic])];

/// Takes the role's attributes off a function.
pub(super) fn take(function: &mut ImplItemFn, d: &mut Diagnostics) -> FunctionAttributes {
    let mut found: Option<(Role, Place)> = None;
    let mut options = ConstraintOptions::default();
    for attribute in mem::take(&mut function.attrs) {
        let name = attribute.path().get_ident().map(ToString::to_string).unwrap_or_default();
        let place = attribute_place(&attribute);
        if name == REDUNDANT {
            check_bare(&attribute, &name, d);
            if options.redundant.replace(place).is_some() {
                d.error(place, &messages::role_twice(&name, &function.sig.ident));
            }
            continue;
        }
        let Some((_, role)) = ROLES.iter().find(|(known, _)| *known == name) else {
            check_misspelt(&attribute, &name, d);
            function.attrs.push(attribute);
            continue;
        };
        if role.is_constraint() {
            read_options(&attribute, *role, &mut options, d);
        } else {
            check_bare(&attribute, &name, d);
        }
        match found {
            Some((first, _)) if first == *role => {
                d.error(place, &messages::role_twice(&name, &function.sig.ident));
            }
            Some((first, _)) => {
                d.error(place, &messages::two_roles(&function.sig.ident, first.name(), &name));
            }
            None => found = Some((*role, place)),
        }
    }
    let (role, place) = found.unwrap_or((Role::Helper, Place::from(function.sig.ident.span())));
    if let Some(at) = options.redundant
        && !role.is_constraint()
    {
        d.error(at, &messages::redundant_without_constraint(&function.sig.ident));
    }
    FunctionAttributes { role, place, options }
}

/// Roles other than those of constraints have no options.
fn check_bare(attribute: &Attribute, name: &str, d: &mut Diagnostics) {
    if !matches!(attribute.meta, Meta::Path(_)) {
        d.error(attribute_place(attribute), &messages::role_with_arguments(name));
    }
}

/// `#[holonomic(switched)]`.
fn read_options(attribute: &Attribute, role: Role, options: &mut ConstraintOptions, d: &mut Diagnostics) {
    let list = match &attribute.meta {
        Meta::Path(_) => return,
        Meta::List(list) => Punctuated::<Ident, Token![,]>::parse_terminated.parse2(list.tokens.clone()).ok(),
        Meta::NameValue(_) => None,
    };
    let known = || OPTIONS.iter().filter(|(_, roles)| roles.contains(&role)).map(|(name, _)| *name);
    let Some(list) = list.filter(|list| !list.is_empty()) else {
        let example = known().next().unwrap_or_default();
        return d.error(attribute_place(attribute), &messages::constraint_options(role.name(), example));
    };
    for option in list {
        let text = option.to_string();
        let twice = match text.as_str() {
            REDUNDANT => {
                d.error(option.span(), &messages::redundant_as_option(role.name()));
                continue;
            }
            "switched" => mem::replace(&mut options.switched, true),
            "integrable" if role == Role::Holonomic => {
                d.error(option.span(), &messages::integrable_holonomic());
                continue;
            }
            "integrable" => options.integrable.replace(option.span().into()).is_some(),
            _ => {
                let hint = suggest::did_you_mean(&text, known());
                d.error(option.span(), &messages::unknown_constraint_option(role.name(), &text, hint));
                continue;
            }
        };
        if twice {
            d.error(option.span(), &messages::constraint_option_twice(&text));
        }
    }
}

/// Rust's own attributes near a role's name would be misread as misspelt; everything unknown and far from a
/// role is rustc's to judge.
fn check_misspelt(attribute: &Attribute, name: &str, d: &mut Diagnostics) {
    const RUST: &[&str] =
        &["doc", "inline", "cold", "cfg", "cfg_attr", "allow", "expect", "warn", "deny", "must_use", "test"];
    if RUST.contains(&name) || name.is_empty() {
        return;
    }
    let known = ROLES.iter().map(|(name, _)| *name).chain([REDUNDANT]);
    if let Some(role) = suggest::nearest(name, known) {
        d.error(attribute_place(attribute), &messages::misspelt_role(name, role));
    }
}

/// The attribute without `#[..]`, so that the name is underlined.
fn attribute_place(attribute: &Attribute) -> Place {
    Place::of(&attribute.meta)
}
