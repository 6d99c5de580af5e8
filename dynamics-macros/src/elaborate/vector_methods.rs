//! Methods of vectors and matrices, and the matrices' constructors.

use std::rc::Rc;

use dynamics_symbolic::check::units::Exponent;
use dynamics_symbolic::graph::{Number, Unary};
use proc_macro2::Span;
use syn::Ident;

use super::Elaborator;
use super::calls::Argument;
use super::dimensions::power;
use super::integer_types::TypeOf;
use super::operators::Operator;
use super::rotations::{Components, Rows};
use super::values::{Scalar, Value};
use crate::messages;

/// All methods of vectors.
pub(crate) const VECTOR_METHODS: &[&str] =
    &["dot", "cross", "norm", "norm_squared", "normalize", "perp", "dt", "to_array"];

/// All methods of matrices.
pub(crate) const MATRIX_METHODS: &[&str] = &[
    "transpose",
    "trace",
    "determinant",
    "row",
    "column",
    "angular_velocity",
    "angular_velocity_in_body",
    "rotational_energy",
    "dt",
];

impl Elaborator<'_> {
    pub(super) fn vector_method(
        &mut self,
        v: Vec<Scalar>,
        name: &Ident,
        mut arguments: Vec<Argument>,
    ) -> Value {
        let text = name.to_string();
        let expected = match text.as_str() {
            "dot" | "cross" => 1,
            "norm" | "norm_squared" | "normalize" | "dt" | "to_array" => 0,
            "perp" if v.len() == 2 => 0,
            _ => return self.unknown_method(&Value::Vector(v), name, VECTOR_METHODS),
        };
        if !self.takes(name, &arguments, expected) {
            return Value::Poison;
        }
        let at = name.span();
        match text.as_str() {
            "dot" | "cross" => {
                let (other, place) = arguments.remove(0);
                let w = match other {
                    Value::Vector(w) if w.len() == v.len() => w,
                    other => {
                        let message = messages::shape_mismatch(name, Value::Vector(v).shape(), other.shape());
                        return self.fail(place, &message);
                    }
                };
                if text == "dot" { self.dot(&v, &w, at).into() } else { self.cross(&v, &w, at) }
            }
            "norm_squared" => self.dot(&v, &v, at).into(),
            "norm" => self.norm(&v, at).into(),
            "normalize" => {
                let Some(norm) = self.norm(&v, at) else { return Value::Poison };
                let unit = v.iter().map(|x| self.quotient(x, &norm, at)).collect::<Option<Vec<_>>>();
                unit.map_or(Value::Poison, Value::Vector)
            }
            "perp" => {
                let turned = self.negative(&v[1]);
                Value::Vector(vec![turned, v[0].clone()])
            }
            "to_array" => Value::array(v.into_iter().map(Value::Scalar).collect()),
            _ => self.time_derivative(Value::Vector(v), name),
        }
    }

    /// √(v·v).
    fn norm(&mut self, v: &[Scalar], at: Span) -> Option<Scalar> {
        let squared = self.dot(v, v, at)?;
        let node = self.model.graph.unary(Unary::Sqrt, squared.node);
        Some(Scalar { node, unit: power(&squared.unit, Exponent::HALF) })
    }

    /// v×w; a scalar in the plane.
    pub(super) fn cross(&mut self, v: &[Scalar], w: &[Scalar], at: Span) -> Value {
        let mut component = |i: usize, j: usize| {
            let (a, b) = (self.product(&v[i], &w[j]), self.product(&v[j], &w[i]));
            self.sum(Operator::Sub, &a, &b, at)
        };
        if v.len() == 2 {
            return component(0, 1).into();
        }
        let all = [component(1, 2), component(2, 0), component(0, 1)];
        all.into_iter().collect::<Option<Vec<_>>>().map_or(Value::Poison, Value::Vector)
    }

    pub(super) fn matrix_method(&mut self, m: Rc<Rows>, name: &Ident, mut arguments: Vec<Argument>) -> Value {
        let text = name.to_string();
        let expected = match text.as_str() {
            "row" | "column" | "rotational_energy" => 1,
            "transpose"
            | "trace"
            | "determinant"
            | "angular_velocity"
            | "angular_velocity_in_body"
            | "dt" => 0,
            _ => return self.unknown_method(&Value::Matrix(m), name, MATRIX_METHODS),
        };
        if !self.takes(name, &arguments, expected) {
            return Value::Poison;
        }
        let at = name.span();
        match text.as_str() {
            "transpose" => self.transposed(&m),
            "angular_velocity" => self.angular_velocity(&m, Components::World, name),
            "angular_velocity_in_body" => self.angular_velocity(&m, Components::Body, name),
            "trace" => {
                let sum = self.sum(Operator::Add, &m[0][0], &m[1][1], at);
                sum.and_then(|s| self.sum(Operator::Add, &s, &m[2][2], at)).into()
            }
            "determinant" => match self.cross(&m[1], &m[2], at) {
                Value::Vector(normal) => self.dot(&m[0], &normal, at).into(),
                _ => Value::Poison,
            },
            "rotational_energy" => self.rotational_energy(&m, arguments.remove(0), name),
            "row" | "column" => {
                let (index, place) = arguments.remove(0);
                self.is_of(&index, TypeOf::USIZE);
                let k = match index {
                    Value::Integer(i) => match usize::try_from(i.value).ok().filter(|k| *k < 3) {
                        Some(k) => k,
                        None => {
                            return self.fail(place, &messages::index_out_of_range(i.value, "the matrix", 3));
                        }
                    },
                    other => return self.fail(place, &messages::index_unknown(other.shape())),
                };
                let line = |i: usize| if text == "row" { m[k][i].clone() } else { m[i][k].clone() };
                Value::Vector((0..3).map(line).collect())
            }
            _ => self.time_derivative(Value::Matrix(m), name),
        }
    }

    /// `Mat3::name(..)`; the number of arguments is checked.
    pub(super) fn matrix_constructor(&mut self, word: &Ident, arguments: Vec<Argument>) -> Value {
        let zero = self.number(Number::ZERO);
        let one = self.number(Number::ONE);
        let name = word.to_string();
        match name.as_str() {
            "from_rows" | "from_columns" => {
                let Some(rows) = self.spatial_vectors(arguments) else { return Value::Poison };
                let transposed = name == "from_columns";
                Value::matrix([0, 1, 2].map(|i| {
                    [0, 1, 2].map(|j| if transposed { rows[j][i].clone() } else { rows[i][j].clone() })
                }))
            }
            "from" => self.matrix_from(arguments),
            "diagonal" => match self.vector_of(arguments) {
                Value::Vector(d) => Value::matrix(
                    [0, 1, 2].map(|i| [0, 1, 2].map(|j| if i == j { d[i].clone() } else { zero.clone() })),
                ),
                _ => Value::Poison,
            },
            "skew" => {
                let Some((Value::Vector(v), _)) = arguments.first().filter(|(v, _)| v.shape() == "a `Vec3`")
                else {
                    return self.wrong_shape("a `Vec3`", arguments);
                };
                let [x, y, z] = [0, 1, 2].map(|i| self.negative(&v[i]));
                Value::matrix([
                    [zero.clone(), z, v[1].clone()],
                    [v[2].clone(), zero.clone(), x],
                    [y, v[0].clone(), zero],
                ])
            }
            "outer" => match self.spatial_vectors(arguments).as_deref() {
                Some([a, b]) => {
                    Value::matrix([0, 1, 2].map(|i| [0, 1, 2].map(|j| self.product(&a[i], &b[j]))))
                }
                _ => Value::Poison,
            },
            "rotation_x" => self.rotation(0, arguments),
            "rotation_y" => self.rotation(1, arguments),
            "rotation_z" => self.rotation(2, arguments),
            "axis_angle" => self.axis_angle(word, arguments),
            "euler" | "euler_space" => self.euler(word, arguments),
            "euler_parameters" => self.euler_parameters(arguments),
            _ => Value::matrix(
                [0, 1, 2].map(|i| [0, 1, 2].map(|j| if i == j { one.clone() } else { zero.clone() })),
            ),
        }
    }

    /// `Mat3::from([[..]; 3])` or from a matrix.
    fn matrix_from(&mut self, arguments: Vec<Argument>) -> Value {
        let Some((value, place)) = arguments.into_iter().next() else { return Value::Poison };
        let items = match value {
            Value::Matrix(m) => return Value::Matrix(m),
            Value::Array(items) if items.len() == 3 => items,
            other => return self.wrong_shape("three rows of three scalars", vec![(other, place)]),
        };
        let mut rows = Vec::new();
        for item in items.iter() {
            let row = match item {
                Value::Array(row) if row.len() == 3 => {
                    self.vector_of(row.iter().map(|x| (x.clone(), place)).collect())
                }
                other => self.wrong_shape("three rows of three scalars", vec![(other.clone(), place)]),
            };
            rows.push((row, place));
        }
        match self.spatial_vectors(rows).and_then(|rows| Rows::try_from(rows).ok()) {
            Some(rows) => Value::matrix(rows),
            None => Value::Poison,
        }
    }

    /// Arguments that all have to be vectors of space.
    fn spatial_vectors(&mut self, arguments: Vec<Argument>) -> Option<Vec<[Scalar; 3]>> {
        let (count, mut rows) = (arguments.len(), Vec::new());
        for (value, place) in arguments {
            let shape = value.shape();
            match value {
                Value::Vector(v) => match <[Scalar; 3]>::try_from(v) {
                    Ok(row) => rows.push(row),
                    Err(_) => self.diagnostics.error(place, &messages::expected_shape("a `Vec3`", shape)),
                },
                Value::Poison => {}
                _ => self.diagnostics.error(place, &messages::expected_shape("a `Vec3`", shape)),
            }
        }
        (rows.len() == count).then_some(rows)
    }

    fn wrong_shape(&mut self, expected: &str, arguments: Vec<Argument>) -> Value {
        match arguments.into_iter().next() {
            Some((value, place)) if !value.is_poison() => {
                self.fail(place, &messages::expected_shape(expected, value.shape()))
            }
            _ => Value::Poison,
        }
    }
}
