//! What expressions of the model language evaluate to while they are elaborated.

mod drawn;

use std::rc::Rc;

use dynamics_symbolic::check::units::UnitExpr;
use dynamics_symbolic::families::{NodeIndex, Range, Rounds};
use dynamics_symbolic::graph::{Comparison, FunctionId, NodeId};
use proc_macro2::Span;

use super::integer_types::TypeOf;
use crate::diagnostics::Place;
pub(super) use drawn::{Canvas, Choice};

/// The unit of a value; `None`: any unit at all, as for the literal 0, or no unit is declared in the model.
pub(super) type UnitOf = Option<Rc<UnitExpr>>;

/// A real number: `f64` and `Expr` alike, as rustc already tells them apart.
#[derive(Clone, Debug)]
pub(super) struct Scalar {
    pub(super) node: NodeId,
    pub(super) unit: UnitOf,
}

/// An integer known while the macro runs.
#[derive(Clone, Copy, Debug)]
pub(super) struct Integer {
    pub(super) value: i128,
    /// The division that dropped a remainder on the way here.
    pub(super) truncated: Option<Span>,
    pub(super) ty: TypeOf,
}

/// A condition: decided now, or by the values at run time.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Condition {
    Known(bool),
    Compare(Comparison, NodeId, NodeId),
    Not(Box<Condition>),
    And(Box<Condition>, Box<Condition>),
}

/// A term of a force.
#[derive(Clone, Debug)]
pub(super) enum Term {
    At { point: Vec<Scalar>, vector: Vec<Scalar>, place: Place },
    Along { expression: Scalar, magnitude: Scalar, place: Place },
}

/// A value of a library type.
#[derive(Clone, Debug)]
pub(super) struct Record {
    /// Index of the type.
    pub(super) ty: usize,
    /// Its name.
    pub(super) name: String,
    /// In the order of their declaration.
    pub(super) fields: Vec<Value>,
}

/// A value.
#[derive(Clone, Debug)]
pub(super) enum Value {
    /// The result of a mistake that is already reported: silences everything that follows from it.
    Poison,
    /// `let x;`
    Unset,
    /// `self`.
    Model,
    /// `q`.
    Coordinates,
    Scalar(Scalar),
    Integer(Integer),
    Condition(Condition),
    Tuple(Rc<Vec<Value>>),
    Array(Rc<Vec<Value>>),
    /// A range or an iterator over an array.
    Sequence(Rc<Vec<Value>>),
    /// `Vec2` or `Vec3`.
    Vector(Vec<Scalar>),
    /// `Mat3` by rows.
    Matrix(Rc<[[Scalar; 3]; 3]>),
    Force(Rc<Vec<Term>>),
    /// `Frame`, `RigidBody` and the like.
    Record(Rc<Record>),
    /// `EulerSequence::Zxz`: the axes to turn about.
    Axes([usize; 3]),
    /// A smooth function among the parameters.
    Function(FunctionId),
    /// An index that is not known now.
    Index(NodeIndex),
    /// Indices up to a count.
    Range(Range),
    /// What every round of a range gives, and what single indices give, which have the rounds around.
    Mapped(Rc<Vec<(Rounds, Value)>>),
    /// A sum over an index.
    Total(Rc<Total>),
    /// A variable to which the rounds of a loop add.
    Accumulator(Rc<Vec<Addend>>),
    /// `q.s` of a family.
    Family(usize),
    /// `q.w[i]` of a grid.
    GridRow(usize, NodeIndex),
    /// `self.mass` of a parameter with an element for every index.
    Numbered(usize),
    /// A picture. This and what follows is only in drawings.
    Drawing(Rc<Canvas>),
    /// A closure, by its number.
    Closure(usize),
    /// Words.
    Text(Rc<Choice<String>>),
    /// A colour as pages name it.
    Color(Rc<Choice<String>>),
}

/// A sum over an index, or several: what every round of a range adds, and what is added once.
#[derive(Clone, Debug)]
pub(super) struct Total {
    /// What is added once.
    pub(super) rest: Value,
    /// What every round adds, of all loops that are open there.
    pub(super) rounds: Vec<(Rounds, Value)>,
    /// The elaboration of a round in which the sum was made.
    pub(super) scope: u32,
}

/// What a round of a loop adds to a variable, and where.
#[derive(Clone, Debug)]
pub(super) struct Addend {
    pub(super) value: Value,
    pub(super) at: Span,
}

/// A numbered coordinate or parameter.
#[derive(Clone, Debug)]
pub(super) struct Numbered {
    pub(super) name: String,
    pub(super) unit: UnitOf,
    pub(super) unit_text: String,
    pub(super) place: Place,
}

impl Value {
    pub(super) fn unit() -> Self {
        Self::Tuple(Rc::default())
    }
    /// A `usize`.
    pub(super) fn count(value: usize) -> Self {
        Self::Integer(Integer { value: value as i128, truncated: None, ty: TypeOf::USIZE })
    }
    pub(super) fn array(values: Vec<Value>) -> Self {
        Self::Array(Rc::new(values))
    }
    pub(super) fn tuple(values: Vec<Value>) -> Self {
        Self::Tuple(Rc::new(values))
    }
    pub(super) fn matrix(rows: [[Scalar; 3]; 3]) -> Self {
        Self::Matrix(Rc::new(rows))
    }
    /// Whether it is poison, or contains some.
    pub(super) fn has_poison(&self) -> bool {
        match self {
            Self::Poison => true,
            Self::Array(all) | Self::Sequence(all) | Self::Tuple(all) => all.iter().any(Self::has_poison),
            _ => false,
        }
    }
    pub(super) fn is_poison(&self) -> bool {
        matches!(self, Self::Poison)
    }

    /// Number of parts. Values are bounded when they are put together, so that this is quick.
    pub(super) fn size(&self) -> usize {
        match self {
            Self::Tuple(items) | Self::Array(items) | Self::Sequence(items) => {
                items.iter().fold(1, |sum: usize, item| sum.saturating_add(item.size()))
            }
            Self::Force(terms) => 1 + terms.len(),
            Self::Drawing(canvas) => 1 + canvas.shapes.len(),
            Self::Record(record) => {
                record.fields.iter().fold(1, |sum: usize, field| sum.saturating_add(field.size()))
            }
            _ => 1,
        }
    }

    /// The shape in the user's words, for messages.
    pub(super) fn shape(&self) -> String {
        match self {
            Self::Poison | Self::Unset => "nothing".into(),
            Self::Model => "the model itself".into(),
            Self::Coordinates => "the coordinates".into(),
            Self::Scalar(_) => "a scalar".into(),
            Self::Integer(_) => "an integer".into(),
            Self::Condition(_) => "a condition".into(),
            Self::Tuple(items) if items.is_empty() => "`()`".into(),
            Self::Tuple(items) => format!("a tuple of {}", items.len()),
            Self::Array(items) => format!("an array of {}", items.len()),
            Self::Sequence(_) => "a range".into(),
            Self::Vector(v) => format!("a `Vec{}`", v.len()),
            Self::Matrix(_) => "a `Mat3`".into(),
            Self::Force(_) => "a `Force`".into(),
            Self::Record(record) => format!("a `{}`", record.name),
            Self::Axes(_) => "an `EulerSequence`".into(),
            Self::Function(_) => "a smooth function".into(),
            Self::Index(_) => "an index".into(),
            Self::Range(_) => "a range".into(),
            Self::Mapped(_) => "an iterator over an index".into(),
            Self::Total(_) => "a sum over an index".into(),
            Self::Accumulator(_) => "a sum that a loop adds up".into(),
            Self::Family(_) => "a family of coordinates".into(),
            Self::GridRow(..) => "a row of a grid of coordinates, which needs a second index".into(),
            Self::Numbered(_) => "a parameter with an index".into(),
            Self::Drawing(_) => "a `Drawing`".into(),
            Self::Closure(_) => "a closure".into(),
            Self::Text(_) => "a text".into(),
            Self::Color(_) => "a `Color`".into(),
        }
    }
}

impl From<Scalar> for Value {
    fn from(scalar: Scalar) -> Self {
        Self::Scalar(scalar)
    }
}

impl From<Option<Scalar>> for Value {
    fn from(scalar: Option<Scalar>) -> Self {
        scalar.map_or(Self::Poison, Self::Scalar)
    }
}

impl Condition {
    pub(super) fn not(self) -> Self {
        match self {
            Self::Known(b) => Self::Known(!b),
            Self::Not(inner) => *inner,
            other => Self::Not(Box::new(other)),
        }
    }
    pub(super) fn and(self, other: Self) -> Self {
        match (self, other) {
            (Self::Known(true), c) | (c, Self::Known(true)) => c,
            (Self::Known(false), _) | (_, Self::Known(false)) => Self::Known(false),
            (a, b) => Self::And(Box::new(a), Box::new(b)),
        }
    }
    pub(super) fn or(self, other: Self) -> Self {
        self.not().and(other.not()).not()
    }
}

/// Scalar components of an output or a constraint with their suffixes; false where it holds something else.
pub(super) fn flatten(
    value: &Value,
    prefix: &str,
    components: &mut Vec<(String, Scalar)>,
    units: &mut Vec<UnitOf>,
) -> bool {
    let mut add = |suffix: String, scalar: &Scalar| {
        units.push(scalar.unit.clone());
        components.push((suffix, scalar.clone()));
    };
    match value {
        Value::Scalar(s) => add(prefix.to_owned(), s),
        Value::Vector(v) => {
            for (name, s) in ["x", "y", "z"].iter().zip(v) {
                add(format!("{prefix}.{name}"), s);
            }
        }
        Value::Array(items) => {
            return items
                .iter()
                .enumerate()
                .all(|(i, item)| flatten(item, &format!("{prefix}[{i}]"), components, units));
        }
        _ => return false,
    }
    true
}
