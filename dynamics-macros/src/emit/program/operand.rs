//! Where values come from, and how one operation is written.

use std::cell::{Cell, RefCell};
use std::collections::BTreeMap;

use dynamics_symbolic::check::hazards::Branch;
use dynamics_symbolic::compile::Compiled;
use dynamics_symbolic::graph::{Binary, Comparison, FunctionId, Graph, Node, NodeId, Number, Symbol, Unary};
use proc_macro2::TokenStream;
use quote::quote;

use super::super::{Surface, local};
use super::{Printer, parsed};

/// Lanes of a block of Cauchy sums, as `dynamics_runtime::series::LANES_OF_BLOCK`.
pub(in super::super) const LANES_OF_BLOCK: usize = 4;

/// Where a function finds what it does not compute.
pub(in super::super) struct Access<'a> {
    /// The nodes.
    pub(in super::super) graph: &'a Graph,
    /// Path of what generated code uses.
    pub(in super::super) private: TokenStream,
    /// Expressions of the parameters, in order.
    parameters: Vec<String>,
    /// Expressions of the smooth functions, in order.
    functions: Vec<String>,
    /// Which operations are choices that a state can hold.
    pub(super) branches: Option<&'a BTreeMap<NodeId, Branch>>,
    /// Whether it is for Taylor coefficients: sums of lanes come in blocks.
    coefficients: bool,
    /// Whether values are those of several states side by side.
    pub(in super::super) lanes: bool,
    /// What several states may share or have each for itself, in the order of its first use: parameters,
    /// constants, inputs.
    lane_values: RefCell<Vec<String>>,
    /// Whether sines and cosines are the platform's.
    pub(super) accurate: bool,
    /// Elements of families: how their symbols are written.
    names: BTreeMap<Symbol, String>,
    /// Elements of families in blocks: which functions of numbers they call.
    pub(super) block: Option<Block>,
    /// Whether something printed has a range of arguments: it sets `__far` where one is outside.
    pub(in super::super) has_range: Cell<bool>,
}

/// The sines, cosines and reciprocal roots of a loop over a block. All have the same bits.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(in super::super) enum Block {
    /// Without a branch, so that the loop vectorises. Arguments out of range set `__far`.
    Near,
    /// For all arguments.
    Any,
}

impl<'a> Access<'a> {
    /// Parameters and functions are fields of `model`.
    pub(in super::super) fn new(surface: &Surface, compiled: &'a Compiled) -> Self {
        let (branches, model) = (&compiled.programs.kinks.branches, local("model"));
        Self {
            graph: &compiled.model.graph,
            branches: (!branches.is_empty()).then_some(branches),
            private: surface.private(),
            parameters: surface.parameters.iter().map(|place| quote!(#model #place).to_string()).collect(),
            functions: surface.functions.iter().map(|field| quote!(#model.#field).to_string()).collect(),
            coefficients: false,
            lanes: false,
            lane_values: RefCell::default(),
            accurate: surface.accurate,
            names: BTreeMap::new(),
            block: None,
            has_range: Cell::new(false),
        }
    }

    /// Elements of families, whose symbols are written like this.
    pub(in super::super) fn of_elements(
        surface: &Surface,
        graph: &'a Graph,
        names: BTreeMap<Symbol, String>,
    ) -> Self {
        let functions = surface.functions.iter().map(|field| quote!(__model.#field).to_string()).collect();
        Self { functions, names, coefficients: false, ..Self::of_coefficients(surface, graph, 0) }
    }

    /// The same for a loop over a block.
    pub(in super::super) fn in_block(self, block: Block) -> Self {
        Self { block: Some(block), ..self }
    }

    /// Programs of Taylor coefficients: what they need of order 0 stands in an array `z`.
    pub(in super::super) fn of_coefficients(surface: &Surface, graph: &'a Graph, kept: usize) -> Self {
        let parameters = (0..kept).map(|i| format!("__z[{i}]")).collect();
        Self {
            graph,
            branches: None,
            private: surface.private(),
            parameters,
            functions: Vec::new(),
            coefficients: true,
            lanes: false,
            lane_values: RefCell::default(),
            accurate: surface.accurate,
            names: BTreeMap::new(),
            block: None,
            has_range: Cell::new(false),
        }
    }

    /// Several states side by side: as [`Self::new`], where the model makes no choices.
    pub(in super::super) fn of_lanes(surface: &Surface, compiled: &'a Compiled) -> Self {
        Self { lanes: true, ..Self::new(surface, compiled) }
    }

    /// What statements refer to by short names.
    pub(super) fn imports(&self) -> TokenStream {
        let private = &self.private;
        if self.lanes {
            return quote!(use #private::math as __math;);
        }
        quote!(use #private::{SmoothFunction as __Smooth, math as __math, sin_cos as __sin_cos};)
    }

    /// Whether there are choices that a state can hold, named `branches`.
    pub(in super::super) fn chooses(&self) -> bool {
        self.branches.is_some()
    }

    pub(super) fn function(&self, id: FunctionId) -> &str {
        &self.functions[id.0 as usize]
    }

    /// A number or symbol, in every lane where there are some.
    pub(super) fn leaf(&self, id: NodeId) -> String {
        let leaf = self.one(id);
        match self.graph.node(id) {
            _ if !self.lanes => leaf,
            Node::Symbol(Symbol::Time | Symbol::Coordinate(_) | Symbol::Rate(_)) => leaf,
            Node::Number(_) => format!("__Lanes::splat({leaf})"),
            _ => self.lane_value(leaf),
        }
    }

    /// What is written as `value` for one state, in every lane where there are some.
    pub(super) fn lane_value(&self, value: String) -> String {
        if !self.lanes {
            return value;
        }
        let mut known = self.lane_values.borrow_mut();
        let index = known.iter().position(|other| *other == value).unwrap_or_else(|| {
            known.push(value.clone());
            known.len() - 1
        });
        format!("__values.value({index},{value})")
    }

    /// All that was written by [`Self::lane_value`], in the order of the indices.
    pub(in super::super) fn lane_values(&self) -> Vec<TokenStream> {
        self.lane_values.borrow().iter().map(|value| parsed(value)).collect()
    }

    fn one(&self, id: NodeId) -> String {
        match self.graph.node(id) {
            Node::Symbol(symbol) if self.names.contains_key(&symbol) => self.names[&symbol].clone(),
            Node::Number(number) => literal(number),
            Node::Symbol(Symbol::Time) => "__t".into(),
            Node::Symbol(Symbol::Coordinate(i)) => format!("__q[{i}]"),
            Node::Symbol(Symbol::Rate(i)) => format!("__u[{i}]"),
            Node::Symbol(Symbol::Input(i)) => format!("__w[{i}]"),
            Node::Symbol(Symbol::Acceleration(i)) => format!("__a[{i}]"),
            Node::Symbol(Symbol::Multiplier(i)) if self.coefficients => {
                format!("__lambda[{}][{}]", i as usize / LANES_OF_BLOCK, i as usize % LANES_OF_BLOCK)
            }
            Node::Symbol(Symbol::Multiplier(i)) => format!("__lambda[{i}]"),
            Node::Symbol(Symbol::Mode(i)) => format!("__modes[{i}]"),
            Node::Symbol(Symbol::Parameter(i)) => self.parameters[i as usize].clone(),
            // The engine schedules every operation before its use.
            node => unreachable!("{node:?} is read before it is computed"),
        }
    }
}

/// The shortest literal that reads back as the same `f64`.
fn literal(number: Number) -> String {
    let value = number.value();
    // `{:?}` of a finite f64 is a Rust float literal: shortest digits that round-trip, with `.0` or an
    // exponent.
    if value.is_sign_negative() && value != 0.0 {
        format!("({value:?})")
    } else {
        format!("{:?}", value.abs())
    }
}

pub(super) fn binary_name(function: Binary) -> &'static str {
    match function {
        Binary::Atan2 => "atan2",
        Binary::Powf => "powf",
        Binary::Hypot => "hypot",
        Binary::Min => "min",
        Binary::Max => "max",
    }
}

impl Printer<'_> {
    /// The operation of a node.
    pub(super) fn operation(&self, id: NodeId) -> String {
        let v = |id| self.value(id);
        if let Some(branch) = self.access.branches.and_then(|branches| branches.get(&id)) {
            return self.choice(id, *branch);
        }
        match self.access.graph.node(id) {
            Node::Number(_) | Node::Symbol(_) => self.access.leaf(id),
            Node::Add(a, b) => match self.fused_product(id) {
                Some((product, [x, y])) => self.add_product(v(if product == a { b } else { a }), x, y),
                None => format!("{}+{}", v(a), v(b)),
            },
            Node::Sub(a, b) => match self.fused_product(id) {
                Some((product, [x, y])) if product == b => self.sub_product(v(a), x, y),
                Some((_, [x, y])) => self.product_sub(x, y, v(b)),
                None => format!("{}-{}", v(a), v(b)),
            },
            Node::Mul(a, b) => format!("{}*{}", v(a), v(b)),
            Node::Div(a, b) => match self.reciprocals.get(&b) {
                Some(reciprocal) if self.access.graph.is_one(a) => reciprocal.clone(),
                Some(reciprocal) => format!("{}*{reciprocal}", v(a)),
                None => format!("{}/{}", v(a), v(b)),
            },
            Node::Neg(a) => format!("-{}", v(a)),
            Node::Unary(Unary::Sqrt, a) if self.access.lanes => format!("{}.sqrt()", v(a)),
            Node::Unary(function, a) if self.access.lanes => {
                format!("{}.map(__math::{})", v(a), function.name())
            }
            Node::Binary(function, a, b) if self.access.lanes => {
                format!("{}.zip({},__math::{})", v(a), v(b), binary_name(function))
            }
            Node::Unary(function, a) => format!("__math::{}({})", function.name(), v(a)),
            Node::Binary(function, a, b) => format!("__math::{}({},{})", binary_name(function), v(a), v(b)),
            Node::Select { comparison, left, right, then, otherwise } => {
                let comparison = match comparison {
                    Comparison::Less => "<",
                    Comparison::LessEqual => "<=",
                    Comparison::Equal => "==",
                };
                let (left, right, then, otherwise) = (v(left), v(right), v(then), v(otherwise));
                format!("if {left} {comparison} {right} {{{then}}} else {{{otherwise}}}")
            }
            Node::Smooth { function, order, argument } => {
                format!("__Smooth::derivatives(&{},{})[{order}]", self.access.function(function), v(argument))
            }
        }
    }

    /// The product that is written with a sum or difference, and how its factors are read.
    fn fused_product(&self, sum: NodeId) -> Option<(NodeId, [String; 2])> {
        let product = self.fused.product(sum)?;
        let Node::Mul(x, y) = self.access.graph.node(product) else { return None };
        Some((product, [self.value(x), self.value(y)]))
    }

    /// sum + xy.
    fn add_product(&self, sum: String, x: String, y: String) -> String {
        if self.access.lanes {
            format!("{x}.times_plus({y},{sum})")
        } else {
            format!("__math::add_product({sum},{x},{y})")
        }
    }

    /// sum − xy.
    fn sub_product(&self, sum: String, x: String, y: String) -> String {
        if self.access.lanes {
            format!("{sum}.minus_product({x},{y})")
        } else {
            format!("__math::sub_product({sum},{x},{y})")
        }
    }

    /// xy − term.
    fn product_sub(&self, x: String, y: String, term: String) -> String {
        if self.access.lanes {
            format!("{x}.times_minus({y},{term})")
        } else {
            format!("__math::product_sub({x},{y},{term})")
        }
    }

    /// A choice that the state can hold, whatever the values are.
    fn choice(&self, id: NodeId, Branch { kink, exchanged }: Branch) -> String {
        let v = |id| self.value(id);
        // The kink's value is negative where left < right, unless they are exchanged.
        let decide = |condition: String| match exchanged {
            false => format!("__branches.below({kink},{condition})"),
            true => format!("!__branches.below({kink},!({condition}))"),
        };
        match self.access.graph.node(id) {
            Node::Select { comparison, left, right, then, otherwise } => {
                let comparison = if comparison == Comparison::LessEqual { "<=" } else { "<" };
                let condition = decide(format!("{} {comparison} {}", v(left), v(right)));
                format!("if {condition} {{{}}} else {{{}}}", v(then), v(otherwise))
            }
            Node::Unary(Unary::Abs, a) => format!("__branches.abs({kink},{})", v(a)),
            Node::Unary(Unary::Signum, a) => format!("__branches.signum({kink},{})", v(a)),
            Node::Binary(Binary::Min, a, b) => {
                format!("__branches.min({kink},{exchanged},{},{})", v(a), v(b))
            }
            Node::Binary(Binary::Max, a, b) => {
                format!("__branches.max({kink},{exchanged},{},{})", v(a), v(b))
            }
            Node::Binary(Binary::Atan2, y, x) => format!("__branches.atan2({kink},{},{})", v(y), v(x)),
            node => unreachable!("{node:?} is no choice"),
        }
    }
}
