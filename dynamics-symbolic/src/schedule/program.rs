//! Straight-line programs, the one form that every back end prints.

use crate::graph::NodeId;

/// One assignment of a program.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Step {
    /// `v = operation of the graph's node`.
    Node(NodeId),
    /// `(sin, cos) = sin_cos(angle)`; either may be unused.
    SinCos {
        /// The angle.
        angle: NodeId,
        /// The node of its sine, if wanted.
        sin: Option<NodeId>,
        /// The node of its cosine, if wanted.
        cos: Option<NodeId>,
    },
    /// `d = derivatives(function, argument)`: value and three derivatives at once.
    Smooth {
        /// Nodes by order of derivative, where wanted.
        orders: [Option<NodeId>; 4],
    },
}

/// Operations of a program: additions, multiplications, divisions, roots and functions, after sharing.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Cost {
    /// Additions, subtractions and negations.
    pub additions: usize,
    /// Multiplications.
    pub multiplications: usize,
    /// Divisions.
    pub divisions: usize,
    /// Square roots.
    pub roots: usize,
    /// Pairs of sine and cosine of one angle.
    pub sin_cos: usize,
    /// Other functions, selections, smooth functions.
    pub functions: usize,
}

impl Cost {
    /// All operations, one for each pair of sine and cosine.
    #[must_use]
    pub fn total(&self) -> usize {
        self.additions + self.multiplications + self.divisions + self.roots + self.sin_cos + self.functions
    }
}

/// A straight-line program over a graph: symbols and numbers are read where they are used, everything else is
/// a step.
#[derive(Clone, Debug)]
pub struct Program {
    /// Name of the function.
    pub name: String,
    /// Steps that depend on parameters alone and are computed once per model; empty where the program is not
    /// staged.
    pub hoisted: Vec<Step>,
    /// Hoisted nodes that the body (or a result) reads, in the order of the constants array.
    pub constants: Vec<NodeId>,
    /// Steps of the body in order.
    pub body: Vec<Step>,
    /// Results in order: numbers, symbols, constants or steps' nodes.
    pub results: Vec<NodeId>,
    /// Cost of the hoisted part.
    pub hoisted_cost: Cost,
    /// Cost of the body.
    pub cost: Cost,
}
