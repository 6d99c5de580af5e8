//! Methods of real numbers, as `f64` and `Expr` have them, from one table.

use dynamics_symbolic::check::units::Exponent;
use dynamics_symbolic::graph::{Binary, FunctionId, Number, Unary};
use syn::Ident;

use super::Elaborator;
use super::calls::Argument;
use super::dimensions::power;
use super::integer_types::TypeOf;
use super::operators::Operator;
use super::values::{Scalar, Value};
use crate::messages;

/// What a function does to units.
#[derive(Clone, Copy, Debug)]
enum Rule {
    /// 1 → 1.
    Plain,
    /// The unit to a power.
    Power(Exponent),
    /// Unchanged.
    Same,
    /// Anything → 1.
    Sign,
}

/// Functions of one argument.
const UNARY: &[(&str, Unary, Rule)] = &[
    ("sin", Unary::Sin, Rule::Plain),
    ("cos", Unary::Cos, Rule::Plain),
    ("tan", Unary::Tan, Rule::Plain),
    ("asin", Unary::Asin, Rule::Plain),
    ("acos", Unary::Acos, Rule::Plain),
    ("atan", Unary::Atan, Rule::Plain),
    ("sinh", Unary::Sinh, Rule::Plain),
    ("cosh", Unary::Cosh, Rule::Plain),
    ("tanh", Unary::Tanh, Rule::Plain),
    ("exp", Unary::Exp, Rule::Plain),
    ("ln", Unary::Ln, Rule::Plain),
    ("sqrt", Unary::Sqrt, Rule::Power(Exponent::HALF)),
    ("cbrt", Unary::Cbrt, Rule::Power(Exponent::THIRD)),
    ("abs", Unary::Abs, Rule::Same),
    ("signum", Unary::Signum, Rule::Sign),
];

/// All methods of a scalar, for did-you-mean and for the test that holds this list against the runtime's.
pub(crate) const SCALAR_METHODS: &[&str] = &[
    "sin", "cos", "tan", "asin", "acos", "atan", "sinh", "cosh", "tanh", "exp", "ln", "sqrt", "cbrt", "abs",
    "signum", "recip", "sin_cos", "powi", "powf", "atan2", "hypot", "min", "max", "clamp", "mul_add", "dt",
];

/// Largest exponent of `powi` that is multiplied out.
const MAX_POWER: i128 = 1000;

impl Elaborator<'_> {
    pub(super) fn scalar_method(&mut self, x: Scalar, name: &Ident, arguments: Vec<Argument>) -> Value {
        let text = name.to_string();
        if let Some((_, f, rule)) = UNARY.iter().find(|(known, ..)| *known == text) {
            if !self.takes(name, &arguments, 0) {
                return Value::Poison;
            }
            return self.unary_function(*f, *rule, &x, name).into();
        }
        let expected = match text.as_str() {
            "recip" | "sin_cos" | "dt" => 0,
            "powi" | "powf" | "atan2" | "hypot" | "min" | "max" => 1,
            "clamp" | "mul_add" => 2,
            _ => return self.unknown_method(&Value::Scalar(x), name, SCALAR_METHODS),
        };
        if !self.takes(name, &arguments, expected) {
            return Value::Poison;
        }
        match text.as_str() {
            "recip" => {
                let one = self.number(Number::ONE);
                self.quotient(&one, &x, name.span()).into()
            }
            "sin_cos" => {
                let sin = self.unary_function(Unary::Sin, Rule::Plain, &x, name);
                let cos = sin.as_ref().and_then(|_| self.unary_function(Unary::Cos, Rule::Plain, &x, name));
                Value::tuple(vec![sin.into(), cos.into()])
            }
            "dt" => self.time_derivative(Value::Scalar(x), name),
            "powi" => self.integer_power(&x, arguments, name),
            _ => {
                let mut others = Vec::new();
                for (value, place) in arguments {
                    match self.scalar(value, place) {
                        Some(other) => others.push(other),
                        None => return Value::Poison,
                    }
                }
                self.with_others(&x, &others, name).into()
            }
        }
    }

    /// Functions of two or three real numbers.
    fn with_others(&mut self, x: &Scalar, others: &[Scalar], name: &Ident) -> Option<Scalar> {
        let text = name.to_string();
        match (text.as_str(), others) {
            ("atan2", [y]) => {
                let mut result = self.equal_units(Binary::Atan2, x, y, name)?;
                result.unit = self.dimensionless();
                Some(result)
            }
            ("hypot", [y]) => self.equal_units(Binary::Hypot, x, y, name),
            ("min", [y]) => self.equal_units(Binary::Min, x, y, name),
            ("max", [y]) => self.equal_units(Binary::Max, x, y, name),
            ("powf", [exponent]) => self.real_power(x, exponent, name),
            ("clamp", [low, high]) => {
                if let (Some(l), Some(h)) = (self.value_of(low), self.value_of(high))
                    && l > h
                {
                    self.diagnostics
                        .error(name.span(), &messages::clamp_order(messages::number(l), messages::number(h)));
                    return None;
                }
                let raised = self.equal_units(Binary::Max, x, low, name)?;
                self.equal_units(Binary::Min, &raised, high, name)
            }
            ("mul_add", [factor, summand]) => {
                let product = self.product(x, factor);
                self.sum(Operator::Add, &product, summand, name.span())
            }
            _ => None,
        }
    }

    /// A function of two numbers of one unit; the result has it too.
    fn equal_units(&mut self, f: Binary, x: &Scalar, y: &Scalar, name: &Ident) -> Option<Scalar> {
        let unit =
            self.equate(&x.unit, &y.unit, name.span(), |l, r| super::dimensions::mismatch(name, l, r))?;
        Some(Scalar { node: self.model.graph.binary(f, x.node, y.node), unit })
    }

    /// f(x), where x is not a number outside of f's domain.
    fn unary_function(&mut self, f: Unary, rule: Rule, x: &Scalar, name: &Ident) -> Option<Scalar> {
        if let Some(value) = self.value_of(x) {
            let inside = match f {
                Unary::Sqrt => value >= 0.0,
                Unary::Ln => value > 0.0,
                Unary::Asin | Unary::Acos => value.abs() <= 1.0,
                Unary::Exp | Unary::Sinh | Unary::Cosh => value.abs() < 700.0,
                _ => true,
            };
            if !inside {
                self.diagnostics.error(name.span(), &messages::domain(name, messages::number(value)));
                return None;
            }
        }
        let unit = match rule {
            Rule::Plain => {
                self.require_dimensionless(x, &name.to_string(), name.span())?;
                self.dimensionless()
            }
            Rule::Power(exponent) => power(&x.unit, exponent),
            Rule::Same => x.unit.clone(),
            Rule::Sign => self.dimensionless(),
        };
        Some(Scalar { node: self.model.graph.unary(f, x.node), unit })
    }

    /// The number that a scalar is, if it is one.
    pub(super) fn value_of(&self, x: &Scalar) -> Option<f64> {
        self.model.graph.as_number(x.node).map(Number::value)
    }

    /// `x.powi(n)`.
    fn integer_power(&mut self, x: &Scalar, arguments: Vec<Argument>, name: &Ident) -> Value {
        let n = match arguments.first() {
            Some((exponent @ Value::Integer(i), _)) => {
                self.is_of(exponent, TypeOf::I32);
                i.value
            }
            Some((other, place)) => {
                let message = messages::expected_shape("an integer known at compile time", other.shape());
                return self.fail(*place, &message);
            }
            None => return Value::Poison,
        };
        self.multiplied_out(x, n, name).into()
    }

    fn multiplied_out(&mut self, x: &Scalar, n: i128, name: &Ident) -> Option<Scalar> {
        let exponent = i32::try_from(n).ok().filter(|_| n.abs() <= MAX_POWER);
        let Some(exponent) = exponent else {
            self.diagnostics.error(name.span(), &messages::power_too_large(n, MAX_POWER));
            return None;
        };
        let Some(node) = self.model.graph.powi(x.node, exponent) else {
            self.diagnostics.error(name.span(), &messages::division_by_zero());
            return None;
        };
        if self.model.graph.as_number(node).is_some_and(|n| !n.value().is_finite()) {
            self.diagnostics.error(name.span(), &messages::not_finite("this power"));
            return None;
        }
        Some(Scalar { node, unit: power(&x.unit, Exponent::integer(exponent)) })
    }

    /// `x.powf(y)`: powers by a whole or half number are products and roots.
    fn real_power(&mut self, x: &Scalar, y: &Scalar, name: &Ident) -> Option<Scalar> {
        let whole = |v: f64| v.fract() == 0.0 && v.abs() <= 64.0;
        match (self.value_of(x), self.model.graph.as_number(y.node)) {
            (_, Some(n)) if whole(n.value()) => self.multiplied_out(x, n.value() as i128, name),
            (Some(base), Some(n)) if base < 0.0 && n.value().fract() != 0.0 => {
                self.diagnostics.error(name.span(), &messages::domain(name, messages::number(base)));
                None
            }
            (_, Some(n)) if n.value() == 0.5 => {
                self.unary_function(Unary::Sqrt, Rule::Power(Exponent::HALF), x, name)
            }
            (_, Some(Number::Rational(n, d))) => {
                let node = self.model.graph.binary(Binary::Powf, x.node, y.node);
                let unit = match Exponent::ratio(n, d) {
                    Some(exponent) => power(&x.unit, exponent),
                    None => self.dimensionless(),
                };
                Some(Scalar { node, unit })
            }
            _ => {
                self.require_dimensionless(x, "powf", name.span())?;
                self.require_dimensionless(y, "powf", name.span())?;
                let unit = self.dimensionless();
                Some(Scalar { node: self.model.graph.binary(Binary::Powf, x.node, y.node), unit })
            }
        }
    }

    /// `self.track.at(x)`.
    pub(super) fn function_method(
        &mut self,
        f: FunctionId,
        name: &Ident,
        mut arguments: Vec<Argument>,
    ) -> Value {
        if name != "at" {
            return self.unknown_method(&Value::Function(f), name, &["at"]);
        }
        if !self.takes(name, &arguments, 1) {
            return Value::Poison;
        }
        let (value, place) = arguments.remove(0);
        let Some(x) = self.scalar(value, place) else { return Value::Poison };
        let (argument, result) = match self.functions.get(f.0 as usize) {
            Some(function) => function.clone(),
            None => (None, None),
        };
        let message = |expected, found| messages::unit_of_function_argument(found, expected);
        if self.equate(&argument, &x.unit, name.span(), message).is_none() {
            return Value::Poison;
        }
        Value::Scalar(Scalar { node: self.model.graph.smooth(f, 0, x.node), unit: result })
    }
}
