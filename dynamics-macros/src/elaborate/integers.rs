//! Integers: their values are known while the macro runs, and their types are those that rustc infers.
//!
//! A literal has the type of what it meets: an index, an argument, an annotation; `i32` where it meets none.
//! A value that its type does not hold panics or wraps when the function runs, so that it is an error here;
//! what `as` makes of a value is what Rust makes of it.

use proc_macro2::{Delimiter, Span, TokenStream, TokenTree};
use syn::{Ident, Type};

use super::Elaborator;
use super::calls::Argument;
use super::integer_types::{I32, IntegerType, TypeOf};
use super::scalar_methods::SCALAR_METHODS;
use super::values::{Integer, Value};
use crate::diagnostics::Place;
use crate::messages;

/// What every type of integers holds.
const HELD_BY_ALL: std::ops::RangeInclusive<i128> = 0..=127;

/// Methods of integers that are known while the macro runs: those that clippy advises are among them.
const INTEGER_METHODS: &[&str] = &[
    "pow",
    "min",
    "max",
    "abs",
    "clamp",
    "signum",
    "is_multiple_of",
    "div_ceil",
    "abs_diff",
    "rem_euclid",
    "div_euclid",
    "saturating_sub",
    "saturating_add",
];

/// What is known of integers whose types are still to be inferred.
#[derive(Clone, Debug, Default)]
pub(super) struct Inference {
    /// By variable: what it has turned out to be.
    found: Vec<Option<TypeOf>>,
    /// Values that not every type holds.
    late: Vec<(TypeOf, i128, Place, String)>,
}

impl Inference {
    fn fresh(&mut self) -> TypeOf {
        self.found.push(None);
        TypeOf::Inferred(self.found.len() - 1)
    }

    fn resolved(&self, mut of: TypeOf) -> TypeOf {
        while let TypeOf::Inferred(i) = of {
            match self.found[i] {
                Some(next) => of = next,
                None => break,
            }
        }
        of
    }

    /// Both are one type from here on. Two types that differ are no Rust: rustc says so.
    fn unify(&mut self, a: TypeOf, b: TypeOf) -> TypeOf {
        match (self.resolved(a), self.resolved(b)) {
            (TypeOf::Inferred(i), TypeOf::Inferred(j)) if i == j => TypeOf::Inferred(i),
            (TypeOf::Inferred(i), other) | (other, TypeOf::Inferred(i)) => {
                self.found[i] = Some(other);
                other
            }
            (known, TypeOf::Known(_)) => known,
        }
    }
}

impl Elaborator<'_> {
    /// A literal with its suffix.
    pub(super) fn integer_literal(&mut self, value: i128, suffix: &str) -> Value {
        let ty = IntegerType::named(suffix).map_or_else(|| self.inference.fresh(), TypeOf::Known);
        Value::Integer(Integer { value, truncated: None, ty })
    }

    /// Integers that meet are of one type.
    pub(super) fn one_type(&mut self, a: &Integer, b: &Integer) -> TypeOf {
        self.inference.unify(a.ty, b.ty)
    }

    /// All integers among these are of one type, as in an array.
    pub(super) fn all_of_one_type(&mut self, values: &[Value]) {
        let mut types =
            values.iter().filter_map(|v| if let Value::Integer(i) = v { Some(i.ty) } else { None });
        let Some(first) = types.next() else { return };
        for other in types {
            self.inference.unify(first, other);
        }
    }

    /// An integer here is of this type.
    pub(super) fn is_of(&mut self, value: &Value, ty: TypeOf) {
        if let Value::Integer(i) = value {
            self.inference.unify(i.ty, ty);
        }
    }

    /// What a declaration says of the integers in a value.
    pub(super) fn declared_as(&mut self, value: &Value, declared: &Type) {
        match (declared, value) {
            (Type::Reference(inner), _) => self.declared_as(value, &inner.elem),
            (Type::Paren(inner), _) => self.declared_as(value, &inner.elem),
            (Type::Group(inner), _) => self.declared_as(value, &inner.elem),
            (Type::Path(path), Value::Integer(_)) => {
                let named = path.path.segments.last().and_then(|s| IntegerType::named(&s.ident.to_string()));
                if let Some(ty) = named {
                    self.is_of(value, TypeOf::Known(ty));
                }
            }
            (Type::Tuple(types), Value::Tuple(items)) => {
                types.elems.iter().zip(items.iter()).for_each(|(ty, item)| self.declared_as(item, ty));
            }
            (Type::Array(array), Value::Array(items)) => {
                items.iter().for_each(|item| self.declared_as(item, &array.elem));
            }
            (Type::Slice(slice), Value::Array(items)) => {
                items.iter().for_each(|item| self.declared_as(item, &slice.elem));
            }
            _ => {}
        }
    }

    /// The result of `what`, an error where its type does not hold it; where the type is not known yet, that
    /// is looked at last.
    pub(super) fn held(&mut self, integer: Integer, what: &str, at: impl Into<Place>) -> Value {
        let Integer { value, ty, .. } = integer;
        match self.inference.resolved(ty) {
            TypeOf::Known(known) if !known.holds(value) => {
                self.fail(at, &messages::integer_beyond(what, value, format!("`{}`", known.name)))
            }
            TypeOf::Inferred(_) if !HELD_BY_ALL.contains(&value) => {
                let place = self.diagnostics.shown_at(at.into());
                self.inference.late.push((ty, value, place, what.to_owned()));
                Value::Integer(integer)
            }
            _ => Value::Integer(integer),
        }
    }

    /// Looks at the values whose types were not known when they were made.
    pub(super) fn check_integers(&mut self) {
        for (ty, value, place, what) in std::mem::take(&mut self.inference.late) {
            let known = match self.inference.resolved(ty) {
                TypeOf::Known(known) => known,
                TypeOf::Inferred(_) => I32,
            };
            if !known.holds(value) {
                let message = messages::integer_beyond(what, value, format!("`{}`", known.name));
                self.diagnostics.error(place, &message);
            }
        }
    }

    /// `integer as name`.
    pub(super) fn integer_cast(&mut self, integer: Integer, to: IntegerType, at: Span) -> Value {
        if integer.value < 0 && !to.signed && to.of_machine() {
            return self.fail(at, &messages::negative_index(integer.value));
        }
        let value = to.wrapped(integer.value);
        let narrow = IntegerType { bits: 32, ..to };
        if to.of_machine() && !narrow.holds(integer.value) {
            let on = format!("`{}` on machines of 32 bits", to.name);
            return self.fail(at, &messages::integer_beyond("as", integer.value, on));
        }
        Value::Integer(Integer { value, ty: TypeOf::Known(to), ..integer })
    }

    pub(super) fn integer_method(&mut self, i: Integer, name: &Ident, arguments: Vec<Argument>) -> Value {
        let text = name.to_string();
        if SCALAR_METHODS.contains(&text.as_str()) && !INTEGER_METHODS.contains(&text.as_str()) {
            // `2.sqrt()` is no Rust: rustc says so at the same place.
            let Value::Scalar(x) = self.real(i) else { return Value::Poison };
            return self.scalar_method(x, name, arguments);
        }
        if arguments.iter().any(|(value, _)| value.is_poison()) {
            return Value::Poison;
        }
        let mut values = Vec::new();
        for (value, place) in &arguments {
            match value {
                Value::Integer(j) => {
                    let ty = if text == "pow" { TypeOf::U32 } else { i.ty };
                    self.inference.unify(j.ty, ty);
                    values.push(j.value);
                }
                other => return self.fail(*place, &messages::expected_shape("an integer", other.shape())),
            }
        }
        // A type that is still unknown saturates where `i32` does. The check below ensures that it is not a
        // type that saturates elsewhere.
        let ty = match self.inference.resolved(i.ty) {
            TypeOf::Known(known) => known,
            TypeOf::Inferred(_) => I32,
        };
        let saturated = |value: Option<i128>| value.map(|v| v.clamp(ty.least(), ty.largest()));
        let value = match (text.as_str(), values.as_slice()) {
            ("is_multiple_of", [j]) => {
                let multiple = if *j == 0 { i.value == 0 } else { i.value % *j == 0 };
                return Value::Condition(super::values::Condition::Known(multiple));
            }
            ("abs", []) => i.value.checked_abs(),
            ("signum", []) => Some(i.value.signum()),
            ("min", [j]) => Some(i.value.min(*j)),
            ("max", [j]) => Some(i.value.max(*j)),
            ("clamp", [low, high]) if low > high => {
                return self.fail(name.span(), &messages::clamp_order(low, high));
            }
            ("clamp", [low, high]) => Some(i.value.clamp(*low, *high)),
            ("abs_diff", [j]) => i.value.checked_sub(*j).and_then(i128::checked_abs),
            ("rem_euclid", [j]) => i.value.checked_rem_euclid(*j),
            ("div_euclid", [j]) => i.value.checked_div_euclid(*j),
            ("div_ceil", [j]) => i.value.checked_div(*j).map(|whole| {
                let rest = i.value % *j != 0 && (i.value < 0) == (*j < 0);
                whole + i128::from(rest)
            }),
            ("saturating_sub", [j]) => saturated(i.value.checked_sub(*j)),
            ("saturating_add", [j]) => saturated(i.value.checked_add(*j)),
            ("pow", [j]) => u32::try_from(*j).ok().and_then(|j| i.value.checked_pow(j)),
            (known, _) if INTEGER_METHODS.contains(&known) => {
                let expected =
                    usize::from(!matches!(known, "abs" | "signum")) + usize::from(known == "clamp");
                return self.fail(name.span(), &messages::argument_count(name, expected, arguments.len()));
            }
            _ => return self.unknown_method(&Value::Integer(i), name, INTEGER_METHODS),
        };
        // Saturation depends on the type, which therefore has to be known.
        let decided = matches!(self.inference.resolved(i.ty), TypeOf::Known(_));
        if text.starts_with("saturating") && !decided {
            return self.fail(name.span(), &messages::integer_of_unknown_type(name));
        }
        match value {
            Some(value) => self.held(Integer { value, ..i }, &text, name.span()),
            None => self.fail(name.span(), &messages::integer_overflow(&text, i.value, "its argument")),
        }
    }

    /// Reports single precision in tokens that are elaborated: its rounding is not derived.
    pub(super) fn refuse_single_precision(&mut self, tokens: TokenStream) {
        let mut left = vec![tokens];
        while let Some(stream) = left.pop() {
            let trees: Vec<TokenTree> = stream.into_iter().collect();
            for (k, tree) in trees.iter().enumerate() {
                // A field, a function or a method may have this name.
                let after_dot =
                    k > 0 && matches!(&trees[k - 1], TokenTree::Punct(dot) if dot.as_char() == '.');
                let next = trees.get(k + 1);
                let called =
                    matches!(next, Some(TokenTree::Group(g)) if g.delimiter() == Delimiter::Parenthesis);
                let single = match tree {
                    TokenTree::Ident(word) => word == "f32" && !after_dot && !called,
                    TokenTree::Literal(literal) => {
                        let text = literal.to_string();
                        let decimal =
                            text.starts_with(|c: char| c.is_ascii_digit()) && !text.starts_with("0x");
                        decimal && text.ends_with("f32")
                    }
                    TokenTree::Group(group) => {
                        left.push(group.stream());
                        false
                    }
                    TokenTree::Punct(_) => false,
                };
                if single {
                    self.diagnostics.error(tree.span(), &messages::single_precision(tree));
                }
            }
        }
    }
}
