//! Names: variables, constants, parameters, coordinates.
//!
//! Only rustc can resolve a path outside of the block. A path that ends like a constant of std is taken for
//! that constant, and noted: emitted code asserts at the same place that rustc resolves it to std's
//! (`emit/constants.rs`).

use dynamics_symbolic::graph::Number;
use proc_macro2::TokenStream;
use quote::{ToTokens, quote};
use syn::{ExprPath, Ident};

use super::Elaborator;
use super::scope::Frame;
use super::values::{Scalar, Value};
use crate::assertions::{Followed, FollowedConstant, TakenForLibrary, TakenForStd, Within};
use crate::diagnostics::Place;
use crate::messages;

/// `core::f64::consts`, correctly rounded.
const MATHEMATICS: &[(&str, f64)] = {
    use core::f64::consts as c;
    &[
        ("PI", c::PI),
        ("TAU", c::TAU),
        ("E", c::E),
        ("SQRT_2", c::SQRT_2),
        ("LN_2", c::LN_2),
        ("LN_10", c::LN_10),
        ("LOG2_E", c::LOG2_E),
        ("LOG10_E", c::LOG10_E),
        ("LOG2_10", c::LOG2_10),
        ("LOG10_2", c::LOG10_2),
        ("FRAC_PI_2", c::FRAC_PI_2),
        ("FRAC_PI_3", c::FRAC_PI_3),
        ("FRAC_PI_4", c::FRAC_PI_4),
        ("FRAC_PI_6", c::FRAC_PI_6),
        ("FRAC_PI_8", c::FRAC_PI_8),
        ("FRAC_1_PI", c::FRAC_1_PI),
        ("FRAC_2_PI", c::FRAC_2_PI),
        ("FRAC_2_SQRT_PI", c::FRAC_2_SQRT_PI),
        ("FRAC_1_SQRT_2", c::FRAC_1_SQRT_2),
    ]
};

/// Types of the library that the macro recognises by name, beside those of `crate::library`.
const OF_LIBRARY: &[&str] = &["Expr", "Vec2", "Vec3", "Mat3", "Force", "EulerSequence"];

/// Most elements of an array of constants for which an assertion is emitted that rustc has the same values.
const MOST_ELEMENTS: usize = 64;

fn is_mathematical(name: &Ident) -> bool {
    MATHEMATICS.iter().any(|(known, _)| name == known)
}

/// Whether a segment of a path is named like a module.
fn is_module(name: &Ident) -> bool {
    name.to_string().starts_with(|c: char| c.is_lowercase() || c == '_')
}

/// The axes of one of the twelve sequences: three letters, no two neighbours alike.
fn sequence(name: &str) -> Option<[usize; 3]> {
    let mut letters = name.chars();
    let mut next = |axes: &str| letters.next().and_then(|letter| axes.find(letter));
    let axes = [next("XYZ")?, next("xyz")?, next("xyz")?];
    (letters.next().is_none() && axes[0] != axes[1] && axes[1] != axes[2]).then_some(axes)
}

impl<'a> Elaborator<'a> {
    /// A path as a value.
    pub(super) fn path(&mut self, e: &'a ExprPath) -> Value {
        if self.draws()
            && let Some(value) = self.drawn_path(e)
        {
            return value;
        }
        let segments: Vec<&Ident> = e.path.segments.iter().map(|s| &s.ident).collect();
        let place = Place::of(&e.path);
        match segments.as_slice() {
            [name] => self.name(name, &e.path),
            [ty, name] if *ty == "Self" || **ty == self.declaration.name => self.constant(name),
            [.., module, name] if *module == "consts" => self.mathematics(name, &e.path),
            [.., ty, name] if *ty == "f64" || *ty == "f32" => self.limit_of_f64(name, &e.path),
            // A module, or an alias of one: `use std::f64::consts as c`.
            [.., ty, name] if is_module(ty) && is_mathematical(name) => self.mathematics(name, &e.path),
            [.., ty, name] => {
                self.taken_for_owner(&e.path);
                self.associated_constant(ty, name, place)
            }
            [] => Value::Poison,
        }
    }

    /// A variable, or one of the mathematical constants where imported.
    fn name(&mut self, name: &Ident, path: &syn::Path) -> Value {
        let text = name.to_string();
        match self.frame().find(&text).cloned() {
            Some(Value::Unset) => self.fail(name.span(), &messages::unset_variable(name)),
            Some(Value::Accumulator(_)) => self.misused_sum(name, name.span()),
            Some(value) => value,
            None if is_mathematical(name) => self.mathematics(name, path),
            None if self.implementation.constants.iter().any(|c| c.name == text) => {
                self.fail(name.span(), &messages::constant_without_self(name))
            }
            None if text.starts_with(char::is_uppercase) && text.chars().all(|c| !c.is_lowercase()) => {
                self.fail(name.span(), &messages::foreign_constant(name))
            }
            None => self.unknown_variable(name),
        }
    }

    fn mathematics(&mut self, name: &Ident, path: &syn::Path) -> Value {
        let known = MATHEMATICS.iter().find(|(known, _)| name == known);
        match known {
            Some((_, value)) => self.taken_for(name, path, *value),
            None => {
                let names = MATHEMATICS.iter().map(|(known, _)| *known);
                match crate::suggest::nearest(&name.to_string(), names) {
                    Some(best) => {
                        let hint = format!("did you mean `{best}`?");
                        self.fail(Place::of(path), &messages::unknown_name(name, hint))
                    }
                    None => self
                        .fail(Place::of(path), &messages::foreign_constant(crate::syntax::path_text(path))),
                }
            }
        }
    }

    /// `f64::EPSILON`, and the like.
    fn limit_of_f64(&mut self, name: &Ident, path: &syn::Path) -> Value {
        match name.to_string().as_str() {
            "EPSILON" => self.taken_for(name, path, f64::EPSILON),
            "MIN_POSITIVE" => self.taken_for(name, path, f64::MIN_POSITIVE),
            "NAN" | "INFINITY" | "NEG_INFINITY" => {
                self.fail(Place::of(path), &messages::not_finite(format!("`f64::{name}`")))
            }
            _ => self.fail(Place::of(path), &messages::foreign_constant(crate::syntax::path_text(path))),
        }
    }

    /// A path that looks like std's constant of this value.
    fn taken_for(&mut self, name: &Ident, path: &syn::Path, value: f64) -> Value {
        if let Some(within) = self.within() {
            let text = crate::syntax::path_text(path);
            if !self.taken.iter().any(|known| known.within == within && known.text == text) {
                self.taken.push(TakenForStd {
                    within,
                    text,
                    path: path.clone(),
                    name: name.to_string(),
                    value,
                });
            }
        }
        self.number(Number::Float(value)).into()
    }

    /// The user's function or constant that is elaborated; `None` inside of the library's own words, which
    /// are the runtime's, where they are compiled.
    fn within(&mut self) -> Option<Within> {
        let frame = self.frame();
        match (frame.function, frame.constant) {
            _ if frame.of.is_some() => None,
            (Some(function), _) => Some(Within::Function(function)),
            (None, constant) => constant.map(Within::Constant),
        }
    }

    /// Notes that a path, perhaps to an item of the user's own, was taken for a type or a function of the
    /// library.
    pub(super) fn taken_for_library(&mut self, path: &syn::Path) {
        let (Some(within), Some(last)) = (self.within(), path.segments.last()) else { return };
        let (name, mut path) = (last.ident.clone(), path.clone());
        // `Vec3::<f64>::new`: which `Vec3` it is, not of what.
        path.segments.iter_mut().for_each(|segment| segment.arguments = syn::PathArguments::None);
        if !self.taken_words.iter().any(|known| known.within == within && known.path == path) {
            self.taken_words.push(TakenForLibrary { within, path, name });
        }
    }

    /// The same of the type whose function or constant a path is.
    pub(super) fn taken_for_owner(&mut self, path: &syn::Path) {
        let mut ty = path.clone();
        ty.segments.pop();
        ty.segments.pop_punct();
        let named = ty.segments.last().is_some_and(|last| OF_LIBRARY.iter().any(|known| last.ident == known));
        if named {
            self.taken_for_library(&ty);
        }
    }

    /// The constants of the block that were evaluated, number by number.
    pub(super) fn followed(&self) -> Vec<FollowedConstant> {
        let mut all = Vec::new();
        for (constant, value) in self.implementation.constants.iter().zip(&self.constants) {
            let mut parts = Vec::new();
            if let Some(value) = value {
                self.numbers_in(value, TokenStream::new(), &mut parts);
            }
            all.push(FollowedConstant { name: constant.name.clone(), parts });
        }
        all
    }

    fn numbers_in(&self, value: &Value, access: TokenStream, parts: &mut Vec<(TokenStream, Followed)>) {
        match value {
            Value::Integer(i) => parts.push((access, Followed::Integer(i.value))),
            Value::Scalar(x) => parts.extend(self.value_of(x).map(|x| (access, Followed::Real(x)))),
            Value::Array(items) => {
                for (i, item) in items.iter().enumerate().take(MOST_ELEMENTS) {
                    self.numbers_in(item, quote!(#access[#i]), parts);
                }
            }
            _ => {}
        }
    }

    /// `Expr::ZERO`, `Vec3::X`, `Mat3::IDENTITY`, `f64::EPSILON`, …
    fn associated_constant(&mut self, ty: &Ident, name: &Ident, place: Place) -> Value {
        let (ty, name) = (ty.to_string(), name.to_string());
        let axis = ["X", "Y", "Z"].iter().position(|a| *a == name);
        let mut number = |n: i64| self.number(Number::integer(n));
        match (ty.as_str(), name.as_str(), axis) {
            ("Expr", "ZERO", _) => number(0).into(),
            ("Expr", "ONE", _) => number(1).into(),
            ("Vec2" | "Vec3", "ZERO", _) => Value::Vector(vec![number(0); if ty == "Vec2" { 2 } else { 3 }]),
            ("Vec2", _, Some(k)) if k < 2 => {
                Value::Vector((0..2).map(|i| number(i64::from(i == k))).collect())
            }
            ("Vec3", _, Some(k)) => Value::Vector((0..3).map(|i| number(i64::from(i == k))).collect()),
            ("Mat3", "ZERO", _) => Value::matrix([(); 3].map(|()| [(); 3].map(|()| number(0)))),
            ("Mat3", "IDENTITY", _) => {
                Value::matrix([0, 1, 2].map(|i| [0, 1, 2].map(|j| number(i64::from(i == j)))))
            }
            ("EulerSequence", _, _) => match sequence(&name) {
                Some(axes) => Value::Axes(axes),
                None => self.fail(place, &messages::foreign_constant(format!("{ty}::{name}"))),
            },
            ("Force", "ZERO", _) => Value::Force(std::rc::Rc::default()),
            _ => self.fail(place, &messages::foreign_constant(format!("{ty}::{name}"))),
        }
    }

    /// `Self::NAME`. Where units are checked, a numeric constant may have one: it is inferred.
    fn constant(&mut self, name: &Ident) -> Value {
        let implementation = self.implementation;
        let Some(index) = implementation.constants.iter().position(|c| c.name == *name) else {
            let known: Vec<String> = implementation.constants.iter().map(|c| c.name.to_string()).collect();
            let hint = match crate::suggest::nearest(&name.to_string(), known.iter().map(String::as_str)) {
                Some(best) => format!("did you mean `{best}`?"),
                None => "move it into this block from another `impl`, which the macro does not see".into(),
            };
            return self.fail(name.span(), &messages::unknown_constant(name, hint));
        };
        match self.constants.get(index) {
            Some(Some(value)) => return value.clone(),
            Some(None) => {}
            None => self.constants.resize(implementation.constants.len(), None),
        }
        // A constant that needs itself is rustc's to report: it is poison while it is evaluated.
        self.constants[index] = Some(Value::Poison);
        self.frames.push(Frame { constant: Some(index), ..Frame::default() });
        let item = &implementation.constants[index].item;
        self.refuse_single_precision(item.ty.to_token_stream());
        self.refuse_single_precision(item.expr.to_token_stream());
        let mut value = self.expression(&item.expr);
        self.declared_as(&value, &item.ty);
        self.frames.pop();
        if let Value::Scalar(Scalar { node, .. }) = value {
            let unit = self.unknown_unit(&format!("Self::{name}"));
            value = Value::Scalar(Scalar { node, unit });
        }
        self.constants[index] = Some(value.clone());
        value
    }

    /// `self.name`.
    pub(super) fn parameter(&mut self, name: &Ident) -> Value {
        if let Some((_, value)) = self.parameters.iter().find(|(known, _)| name == known) {
            return value.clone();
        }
        let text = name.to_string();
        let message = if self.coordinates.iter().any(|(known, _)| *known == text) {
            messages::coordinate_as_parameter(name)
        } else {
            let hint = crate::suggest::did_you_mean(&text, self.parameters.iter().map(|(n, _)| n.as_str()));
            messages::unknown_parameter(name, hint)
        };
        self.fail(name.span(), &message)
    }

    /// `q.name`.
    pub(super) fn coordinate(&mut self, name: &Ident) -> Value {
        if let Some((_, value)) = self.coordinates.iter().find(|(known, _)| name == known) {
            return value.clone();
        }
        let text = name.to_string();
        let message = if self.parameters.iter().any(|(known, _)| *known == text) {
            messages::parameter_as_coordinate(name)
        } else if self.declaration.speeds.iter().any(|speed| speed.name == *name) {
            messages::speed_as_coordinate(name)
        } else if let Some(base) = text.strip_suffix("_rate")
            && self.coordinates.iter().any(|(known, _)| known == base)
        {
            messages::rate_as_coordinate(name, base)
        } else {
            let hint = crate::suggest::did_you_mean(&text, self.coordinates.iter().map(|(n, _)| n.as_str()));
            messages::unknown_coordinate(name, hint)
        };
        self.fail(name.span(), &message)
    }
}
