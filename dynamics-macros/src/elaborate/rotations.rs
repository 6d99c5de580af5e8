//! Rotations, and the angular velocity of what they turn.
//!
//! Where a matrix is known to be a product of turns, its angular velocity is the sum of their rates about the
//! axes as the turns before left them: what an expert writes by hand. Only a matrix of unknown making is
//! differentiated element by element. Which turns a matrix is made of is looked up by its elements: equal
//! elements are one node, so whatever way a matrix was made, it is found.

mod velocity;

use std::collections::BTreeMap;
use std::rc::Rc;

use dynamics_symbolic::graph::{Node, NodeId, Number, Symbol, Unary};
use dynamics_symbolic::mechanics::AngleSet;
use syn::Ident;

use super::Elaborator;
use super::calls::Argument;
use super::operators::Operator;
use super::values::{Scalar, Value};
use crate::diagnostics::Place;
use crate::messages;

pub(super) type Rows = [[Scalar; 3]; 3];

/// The matrices that are known to be products of turns.
pub(super) type Rotations = BTreeMap<[NodeId; 9], Rc<Vec<Turn>>>;

/// A rotation that stands in a product of them.
#[derive(Clone, Debug)]
pub(super) struct Turn {
    rows: Rc<Rows>,
    by: RotationParameters,
}

#[derive(Clone, Debug)]
enum RotationParameters {
    /// An angle about a unit vector that does not move.
    Angle { axis: [Scalar; 3], angle: Scalar },
    /// Euler parameters.
    Parameters([Scalar; 4]),
    /// Nothing is known but the matrix.
    Matrix,
}

impl Turn {
    /// Its matrix.
    pub(super) fn rows(&self) -> &Rows {
        &self.rows
    }

    /// Whether it is by an angle: then it turns whatever the values are.
    pub(super) fn is_by_angle(&self) -> bool {
        matches!(self.by, RotationParameters::Angle { .. })
    }

    /// Its Euler parameters.
    pub(super) fn euler_parameters(&self) -> Option<&[Scalar; 4]> {
        match &self.by {
            RotationParameters::Parameters(e) => Some(e),
            _ => None,
        }
    }

    /// Whether it is the same.
    pub(super) fn is(&self, other: &Self) -> bool {
        key(&self.rows) == key(&other.rows)
    }
}

/// A turn about a coordinate axis, from 1 to 3, by a coordinate or back by it.
#[derive(Clone, Copy)]
struct CoordinateTurn {
    axis: u8,
    coordinate: u32,
    back: bool,
}

/// In whose components an angular velocity is asked for.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(super) enum Components {
    World,
    Body,
}

impl Elaborator<'_> {
    /// The turns that a matrix is made of.
    pub(super) fn turns(&self, rows: &Rc<Rows>) -> Option<Rc<Vec<Turn>>> {
        self.rotations.get(&key(rows)).cloned()
    }

    fn register(&mut self, rows: Rows, turns: Vec<Turn>) -> Value {
        let rows = Rc::new(rows);
        self.rotations.entry(key(&rows)).or_insert_with(|| Rc::new(turns));
        Value::Matrix(rows)
    }

    fn one_turn(&mut self, rows: Rows, by: RotationParameters) -> Value {
        let turn = Turn { rows: Rc::new(rows.clone()), by };
        self.register(rows, vec![turn])
    }

    /// Notes what a product of matrices is made of, if that is known of one of them.
    pub(super) fn note_product(&mut self, a: &Rc<Rows>, b: &Rc<Rows>, product: &Value) {
        let (Value::Matrix(rows), left, right) = (product, self.turns(a), self.turns(b)) else { return };
        if left.is_none() && right.is_none() {
            return;
        }
        let all = |turns: Option<Rc<Vec<Turn>>>, rows: &Rc<Rows>| {
            turns.map_or_else(
                || vec![Turn { rows: rows.clone(), by: RotationParameters::Matrix }],
                |t| t.to_vec(),
            )
        };
        let mut turns = all(left, a);
        turns.extend(all(right, b));
        self.steps += turns.len();
        self.rotations.entry(key(rows)).or_insert_with(|| Rc::new(turns));
    }

    /// Notes the rotations that three coordinates make, one after the other about axes of the body: what they
    /// cannot tell apart the runtime names.
    pub(super) fn note_angle_sets(&mut self) {
        let mut found: Vec<(bool, AngleSet)> = Vec::new();
        for turns in self.rotations.values() {
            for three in turns.windows(3) {
                let [Some(a), Some(b), Some(c)] = [0, 1, 2].map(|k| self.coordinate_turn(&three[k])) else {
                    continue;
                };
                if a.axis != b.axis
                    && b.axis != c.axis
                    && a.coordinate != b.coordinate
                    && b.coordinate != c.coordinate
                    && a.coordinate != c.coordinate
                {
                    let angles = [a, b, c].map(|turn| turn.coordinate);
                    let back = a.back || b.back || c.back;
                    found.push((back, AngleSet { angles, axes: [a, b, c].map(|turn| turn.axis) }));
                }
            }
        }
        found.sort_unstable();
        for (back, set) in found {
            let [a, b, c] = set.angles;
            let known = self
                .model
                .angle_sets
                .iter()
                .any(|s| s.angles == [a, b, c] || (back && s.angles == [c, b, a]));
            if !known {
                self.model.angle_sets.push(set);
            }
        }
    }

    /// A turn about a coordinate axis by a coordinate.
    fn coordinate_turn(&self, turn: &Turn) -> Option<CoordinateTurn> {
        let RotationParameters::Angle { axis, angle } = &turn.by else { return None };
        let graph = &self.model.graph;
        let number = |x: &Scalar| graph.as_number(x.node).map(Number::value);
        let [x, y, z] = axis.each_ref().map(number);
        let axis = [x?, y?, z?].map(f64::abs);
        let axis =
            1 + (0..3u8).find(|k| (0..3u8).all(|i| axis[usize::from(i)] == f64::from(u8::from(i == *k))))?;
        let (node, back) = match graph.node(angle.node) {
            Node::Neg(angle) => (graph.node(angle), true),
            angle => (angle, false),
        };
        match node {
            Node::Symbol(Symbol::Coordinate(coordinate)) => Some(CoordinateTurn { axis, coordinate, back }),
            _ => None,
        }
    }

    /// The transpose, which turns back.
    pub(super) fn transposed(&mut self, m: &Rc<Rows>) -> Value {
        let rows = transpose(m);
        let Some(turns) = self.turns(m) else { return Value::matrix(rows) };
        let mut back = Vec::new();
        for turn in turns.iter().rev() {
            let by = match &turn.by {
                RotationParameters::Angle { axis, angle } => {
                    RotationParameters::Angle { axis: axis.clone(), angle: self.negative(angle) }
                }
                RotationParameters::Parameters([e0, e @ ..]) => {
                    let [x, y, z] = e.clone().map(|x| self.negative(&x));
                    RotationParameters::Parameters([e0.clone(), x, y, z])
                }
                RotationParameters::Matrix => RotationParameters::Matrix,
            };
            back.push(Turn { rows: Rc::new(transpose(&turn.rows)), by });
        }
        self.register(rows, back)
    }

    /// `Mat3::rotation_z(angle)` and its like, about axis 0, 1 or 2.
    pub(super) fn rotation(&mut self, axis: usize, arguments: Vec<Argument>) -> Value {
        match arguments.into_iter().next().and_then(|argument| self.angle(argument, "rotation")) {
            Some(angle) => self.about(axis, angle),
            None => Value::Poison,
        }
    }

    fn angle(&mut self, (value, place): Argument, function: &str) -> Option<Scalar> {
        let angle = self.scalar(value, place)?;
        self.require_dimensionless(&angle, function, place).map(|()| angle)
    }

    fn sine_and_cosine(&mut self, angle: &Scalar) -> (Scalar, Scalar) {
        if let Some((sin, cos)) = self.value_of(angle).and_then(of_quarters) {
            return (self.number(Number::integer(sin)), self.number(Number::integer(cos)));
        }
        let unit = self.dimensionless();
        let mut of =
            |function| Scalar { node: self.model.graph.unary(function, angle.node), unit: unit.clone() };
        let cos = of(Unary::Cos);
        (of(Unary::Sin), cos)
    }

    /// Right-handed rotation about a coordinate axis.
    fn about(&mut self, c: usize, angle: Scalar) -> Value {
        let (a, b) = ((c + 1) % 3, (c + 2) % 3);
        let (sin, cos) = self.sine_and_cosine(&angle);
        let minus_sin = self.negative(&sin);
        let mut rows = [(); 3].map(|()| [(); 3].map(|()| self.number(Number::ZERO)));
        rows[a][a] = cos.clone();
        rows[b][b] = cos;
        rows[a][b] = minus_sin;
        rows[b][a] = sin;
        rows[c][c] = self.number(Number::ONE);
        let axis = [0, 1, 2].map(|k| self.number(Number::integer(i64::from(k == c))));
        self.one_turn(rows, RotationParameters::Angle { axis, angle })
    }

    /// `Mat3::euler(sequence, angles)`; about axes of space in the reverse order.
    pub(super) fn euler(&mut self, name: &Ident, mut arguments: Vec<Argument>) -> Value {
        let (angles, at_angles) = arguments.remove(1);
        let (sequence, at_sequence) = arguments.remove(0);
        let axes = match sequence {
            Value::Axes(axes) => axes,
            Value::Poison => return Value::Poison,
            other => {
                return self
                    .fail(at_sequence, &messages::expected_shape("an `EulerSequence`", other.shape()));
            }
        };
        let angles = match angles {
            Value::Array(items) if items.len() == 3 => items,
            Value::Poison => return Value::Poison,
            other => {
                return self
                    .fail(at_angles, &messages::expected_shape("an array of 3 angles", other.shape()));
            }
        };
        let mut turns = Vec::new();
        for (axis, angle) in axes.into_iter().zip(angles.iter()) {
            let Some(angle) = self.angle((angle.clone(), at_angles), &name.to_string()) else {
                return Value::Poison;
            };
            turns.push(self.about(axis, angle));
        }
        if name == "euler_space" {
            turns.reverse();
        }
        let mut turns = turns.into_iter();
        let first = turns.next().unwrap_or(Value::Poison);
        turns.fold(first, |product, turn| self.arithmetic(Operator::Mul, product, turn, name.span()))
    }

    /// `Mat3::axis_angle(axis, angle)`, after Rodrigues.
    pub(super) fn axis_angle(&mut self, name: &Ident, mut arguments: Vec<Argument>) -> Value {
        let angle = arguments.remove(1);
        let (axis, at) = arguments.remove(0);
        let v = match axis {
            Value::Vector(v) if v.len() == 3 => v,
            Value::Poison => return Value::Poison,
            other => return self.fail(at, &messages::expected_shape("a `Vec3`", other.shape())),
        };
        let Some(angle) = self.angle(angle, "axis_angle") else { return Value::Poison };
        let Value::Vector(n) = self.vector_method(v, &Ident::new("normalize", name.span()), Vec::new())
        else {
            return Value::Poison;
        };
        let (sin, cos) = self.sine_and_cosine(&angle);
        let one = self.number(Number::ONE);
        let versine = self.sum(Operator::Sub, &one, &cos, at);
        let rows = versine.and_then(|versine| self.rodrigues(&n, &sin, &cos, &versine, at));
        let (Some(rows), Ok(n)) = (rows, <[Scalar; 3]>::try_from(n)) else { return Value::Poison };
        // About an axis that moves, the rate of the angle is not all.
        self.note_axis(&n, at);
        let still = n.iter().all(|x| self.model.graph.is_constant(x.node));
        self.one_turn(
            rows,
            if still { RotationParameters::Angle { axis: n, angle } } else { RotationParameters::Matrix },
        )
    }

    /// (1 − cos) n nᵀ + sin n× + cos.
    fn rodrigues(
        &mut self,
        n: &[Scalar],
        sin: &Scalar,
        cos: &Scalar,
        versine: &Scalar,
        at: Place,
    ) -> Option<Rows> {
        let mut rows = [(); 3].map(|()| [(); 3].map(|()| cos.clone()));
        for i in 0..3 {
            for j in 0..3 {
                let along = self.product(versine, &n[i]);
                let along = self.product(&along, &n[j]);
                let (across, sign) = if (i + 1) % 3 == j {
                    (self.product(sin, &n[(i + 2) % 3]), Operator::Sub)
                } else if i == j {
                    (cos.clone(), Operator::Add)
                } else {
                    (self.product(sin, &n[(i + 1) % 3]), Operator::Add)
                };
                rows[i][j] = self.sum(sign, &along, &across, at)?;
            }
        }
        Some(rows)
    }

    /// `Mat3::euler_parameters(e)`.
    pub(super) fn euler_parameters(&mut self, mut arguments: Vec<Argument>) -> Value {
        let (value, place) = arguments.remove(0);
        let e = match value {
            Value::Array(items) if items.len() == 4 => {
                let e: Option<Vec<Scalar>> = items.iter().map(|e| self.scalar(e.clone(), place)).collect();
                e
            }
            Value::Poison => None,
            other => {
                self.fail(place, &messages::expected_shape("an array of 4 scalars", other.shape()));
                None
            }
        };
        let Some(e) = e.and_then(|e| <[Scalar; 4]>::try_from(e).ok()) else { return Value::Poison };
        for parameter in &e {
            if self.require_dimensionless(parameter, "euler_parameters", place).is_none() {
                return Value::Poison;
            }
        }
        match self.rows_of_parameters(&e, place) {
            Some(rows) => self.one_turn(rows, RotationParameters::Parameters(e)),
            None => Value::Poison,
        }
    }

    fn rows_of_parameters(&mut self, e: &[Scalar; 4], at: Place) -> Option<Rows> {
        let square = e.each_ref().map(|x| self.product(x, x));
        let mut rows = [(); 3].map(|()| [(); 3].map(|()| square[0].clone()));
        let two = self.number(Number::integer(2));
        for i in 0..3 {
            let (j, k) = ((i + 1) % 3, (i + 2) % 3);
            let mut diagonal = self.sum(Operator::Add, &square[0], &square[1 + i], at)?;
            for other in [j.min(k), j.max(k)] {
                diagonal = self.sum(Operator::Sub, &diagonal, &square[1 + other], at)?;
            }
            rows[i][i] = diagonal;
            let mixed = self.product(&e[1 + i], &e[1 + j]);
            let turned = self.product(&e[0], &e[1 + k]);
            for (row, column, sign) in [(i, j, Operator::Sub), (j, i, Operator::Add)] {
                let sum = self.sum(sign, &mixed, &turned, at)?;
                rows[row][column] = self.product(&two, &sum);
            }
        }
        Some(rows)
    }
}

/// Sine and cosine of a whole number of quarter turns, written as a multiple of π/2 in `f64`: it stands for
/// the quarter turn, not for the number beside it.
fn of_quarters(angle: f64) -> Option<(i64, i64)> {
    let quarters: i32 = (-4..=4).find(|k| f64::from(*k) * core::f64::consts::FRAC_PI_2 == angle)?;
    Some([(0, 1), (1, 0), (0, -1), (-1, 0)][quarters.rem_euclid(4) as usize])
}

fn key(rows: &Rc<Rows>) -> [NodeId; 9] {
    let mut nodes = rows.iter().flatten().map(|x| x.node);
    [(); 9].map(|()| nodes.next().unwrap_or_else(|| rows[0][0].node))
}

fn transpose(m: &Rows) -> Rows {
    [0, 1, 2].map(|i| [0, 1, 2].map(|j| m[j][i].clone()))
}
