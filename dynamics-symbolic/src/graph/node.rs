//! Operations, arity, children.

use super::{FunctionId, NodeId, Number};

/// What a model's expressions are made of.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Symbol {
    /// Time t.
    Time,
    /// Generalized coordinate qᵢ.
    Coordinate(u32),
    /// Generalized velocity q̇ᵢ.
    Rate(u32),
    /// Generalized acceleration q̈ᵢ.
    Acceleration(u32),
    /// Input wᵢ.
    Input(u32),
    /// Scalar parameter, arrays, vectors and matrices flattened.
    Parameter(u32),
    /// Multiplier λᵢ of a scalar constraint row, rows in the order of the model's constraints.
    Multiplier(u32),
    /// Mode of a switched constraint: 0 while it holds, ±1 while it is released, the sign that of the side to
    /// which it was left.
    Mode(u32),
}

impl Symbol {
    /// Which of its kind it is; `None` for time.
    #[must_use]
    pub fn number(self) -> Option<u32> {
        match self {
            Self::Time => None,
            Self::Coordinate(i)
            | Self::Rate(i)
            | Self::Acceleration(i)
            | Self::Input(i)
            | Self::Parameter(i)
            | Self::Multiplier(i)
            | Self::Mode(i) => Some(i),
        }
    }
}

/// Functions of one argument.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
#[allow(missing_docs)]
pub enum Unary {
    Sin,
    Cos,
    Tan,
    Asin,
    Acos,
    Atan,
    Sinh,
    Cosh,
    Tanh,
    Exp,
    Ln,
    Sqrt,
    Cbrt,
    Abs,
    /// 1 for x ≥ 0, −1 below, as `f64::signum` for +0.
    Signum,
}

impl Unary {
    /// Its name, which plain text and most languages share.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Sin => "sin",
            Self::Cos => "cos",
            Self::Tan => "tan",
            Self::Asin => "asin",
            Self::Acos => "acos",
            Self::Atan => "atan",
            Self::Sinh => "sinh",
            Self::Cosh => "cosh",
            Self::Tanh => "tanh",
            Self::Exp => "exp",
            Self::Ln => "ln",
            Self::Sqrt => "sqrt",
            Self::Cbrt => "cbrt",
            Self::Abs => "abs",
            Self::Signum => "signum",
        }
    }
}

/// Functions of two arguments.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Binary {
    /// Angle of the point (second, first).
    Atan2,
    /// First to the power of the second.
    Powf,
    /// √(a² + b²).
    Hypot,
    /// The smaller, the first on ties.
    Min,
    /// The larger, the first on ties.
    Max,
}

/// Comparisons of conditions.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
#[allow(missing_docs)]
pub enum Comparison {
    Less,
    LessEqual,
    Equal,
}

/// One operation on nodes built before.
#[derive(Clone, Copy, Debug)]
#[allow(missing_docs)]
pub enum Node {
    Number(Number),
    Symbol(Symbol),
    Add(NodeId, NodeId),
    Sub(NodeId, NodeId),
    Mul(NodeId, NodeId),
    Div(NodeId, NodeId),
    Neg(NodeId),
    Unary(Unary, NodeId),
    Binary(Binary, NodeId, NodeId),
    /// `if left ∘ right { then } else { otherwise }`; both branches are evaluated.
    Select {
        comparison: Comparison,
        left: NodeId,
        right: NodeId,
        then: NodeId,
        otherwise: NodeId,
    },
    /// Derivative of given order (0 to 3) of a smooth parameter function.
    Smooth {
        function: FunctionId,
        order: u8,
        argument: NodeId,
    },
}

impl Node {
    /// The arguments in order.
    #[must_use]
    pub fn children(&self) -> Children {
        let mut c = Children { ids: [NodeId(0); 4], len: 0, at: 0 };
        match *self {
            Self::Number(_) | Self::Symbol(_) => {}
            Self::Neg(a) | Self::Unary(_, a) | Self::Smooth { argument: a, .. } => c.push(a),
            Self::Add(a, b) | Self::Sub(a, b) | Self::Mul(a, b) | Self::Div(a, b) | Self::Binary(_, a, b) => {
                c.push(a);
                c.push(b);
            }
            Self::Select { left, right, then, otherwise, .. } => {
                [left, right, then, otherwise].into_iter().for_each(|x| c.push(x))
            }
        }
        c
    }
}

/// Iterator over a node's arguments, without allocation.
#[derive(Clone, Debug)]
pub struct Children {
    ids: [NodeId; 4],
    len: u8,
    at: u8,
}

impl Children {
    fn push(&mut self, id: NodeId) {
        self.ids[self.len as usize] = id;
        self.len += 1;
    }
}

impl Iterator for Children {
    type Item = NodeId;
    fn next(&mut self) -> Option<NodeId> {
        (self.at < self.len).then(|| {
            self.at += 1;
            self.ids[self.at as usize - 1]
        })
    }
}

/// Which kinds of symbols a node depends on.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Dependence(u8);

impl Dependence {
    /// Nothing: a number.
    pub const NONE: Self = Self(0);
    /// Parameters or parameter functions.
    pub const PARAMETERS: Self = Self(1);
    /// Time, explicitly.
    pub const TIME: Self = Self(2);
    /// Coordinates.
    pub const COORDINATES: Self = Self(4);
    /// Generalized velocities.
    pub const RATES: Self = Self(8);
    /// Generalized accelerations.
    pub const ACCELERATIONS: Self = Self(16);
    /// Inputs.
    pub const INPUTS: Self = Self(32);
    /// Multipliers of constraints.
    pub const MULTIPLIERS: Self = Self(64);
    /// Modes of switched constraints.
    pub const MODES: Self = Self(128);

    /// Union.
    #[must_use]
    pub const fn with(self, other: Self) -> Self {
        Self(self.0 | other.0)
    }
    /// What is left without `other`'s kinds.
    #[must_use]
    pub const fn without(self, other: Self) -> Self {
        Self(self.0 & !other.0)
    }
    /// Whether some of `other`'s kinds are contained.
    #[must_use]
    pub fn on(self, other: Self) -> bool {
        self.0 & other.0 != 0
    }
    /// Whether nothing outside `other`'s kinds is contained.
    #[must_use]
    pub fn within(self, other: Self) -> bool {
        self.0 & !other.0 == 0
    }
    pub(super) fn of(symbol: Symbol) -> Self {
        match symbol {
            Symbol::Time => Self::TIME,
            Symbol::Coordinate(_) => Self::COORDINATES,
            Symbol::Rate(_) => Self::RATES,
            Symbol::Acceleration(_) => Self::ACCELERATIONS,
            Symbol::Input(_) => Self::INPUTS,
            Symbol::Parameter(_) => Self::PARAMETERS,
            Symbol::Multiplier(_) => Self::MULTIPLIERS,
            Symbol::Mode(_) => Self::MODES,
        }
    }
}
