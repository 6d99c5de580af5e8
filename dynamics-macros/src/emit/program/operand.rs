//! Where values come from, and how one operation is written.

use dynamics_symbolic::graph::{Binary, Comparison, FunctionId, Graph, Node, NodeId, Number, Symbol, Unary};
use proc_macro2::{Ident, Literal, TokenStream};
use quote::quote;

use super::super::{Surface, local};
use super::Printer;

/// Where a function finds what it does not compute.
pub(in super::super) struct Access<'a> {
    /// The nodes.
    pub(in super::super) graph: &'a Graph,
    /// Path of what generated code uses.
    pub(in super::super) private: TokenStream,
    /// Expressions of the parameters, in order.
    parameters: Vec<TokenStream>,
    /// Expressions of the smooth functions, in order.
    functions: Vec<TokenStream>,
}

impl<'a> Access<'a> {
    /// Parameters and functions are fields of `model`.
    pub(in super::super) fn new(surface: &Surface, graph: &'a Graph) -> Self {
        let model = local("model");
        Self {
            graph,
            private: surface.private(),
            parameters: surface.parameters.iter().map(|place| quote!(#model #place)).collect(),
            functions: surface.functions.iter().map(|field| quote!(#model.#field)).collect(),
        }
    }

    pub(super) fn function(&self, id: FunctionId) -> &TokenStream {
        &self.functions[id.0 as usize]
    }

    /// A number or symbol.
    pub(super) fn leaf(&self, id: NodeId) -> TokenStream {
        let (q, u, w, t) = (local("q"), local("u"), local("w"), local("t"));
        match self.graph.node(id) {
            Node::Number(number) => literal(number),
            Node::Symbol(Symbol::Time) => quote!(#t),
            Node::Symbol(Symbol::Coordinate(i)) => element(&q, i),
            Node::Symbol(Symbol::Rate(i)) => element(&u, i),
            Node::Symbol(Symbol::Input(i)) => element(&w, i),
            Node::Symbol(Symbol::Parameter(i)) => self.parameters[i as usize].clone(),
            // The engine replaces accelerations by their values and schedules every operation before its use.
            node => unreachable!("{node:?} is read before it is computed"),
        }
    }
}

fn element(array: &Ident, index: u32) -> TokenStream {
    let index = Literal::usize_unsuffixed(index as usize);
    quote!(#array[#index])
}

/// The shortest literal that reads back as the same `f64`.
fn literal(number: Number) -> TokenStream {
    let value = number.value();
    // `{:?}` of a finite f64 is a Rust float literal: shortest digits that round-trip, with `.0` or an exponent.
    let text = format!("{:?}", value.abs());
    let literal: Literal = text.parse().expect("a finite f64 prints as a literal");
    if value.is_sign_negative() && value != 0.0 { quote!((-#literal)) } else { quote!(#literal) }
}

fn unary_name(function: Unary) -> &'static str {
    match function {
        Unary::Sin => "sin",
        Unary::Cos => "cos",
        Unary::Tan => "tan",
        Unary::Asin => "asin",
        Unary::Acos => "acos",
        Unary::Atan => "atan",
        Unary::Sinh => "sinh",
        Unary::Cosh => "cosh",
        Unary::Tanh => "tanh",
        Unary::Exp => "exp",
        Unary::Ln => "ln",
        Unary::Sqrt => "sqrt",
        Unary::Cbrt => "cbrt",
        Unary::Abs => "abs",
        Unary::Signum => "signum",
    }
}

fn binary_name(function: Binary) -> &'static str {
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
    pub(super) fn operation(&self, id: NodeId) -> TokenStream {
        let private = &self.access.private;
        let v = |id| self.value(id);
        let call = |name: &str, arguments: &[NodeId]| {
            let (name, arguments) = (local(name), arguments.iter().map(|a| v(*a)));
            quote!(#private::math::#name(#(#arguments),*))
        };
        match self.access.graph.node(id) {
            Node::Number(_) | Node::Symbol(_) => self.access.leaf(id),
            Node::Add(a, b) => binary(&v(a), &quote!(+), &v(b)),
            Node::Sub(a, b) => binary(&v(a), &quote!(-), &v(b)),
            Node::Mul(a, b) => binary(&v(a), &quote!(*), &v(b)),
            Node::Div(a, b) => binary(&v(a), &quote!(/), &v(b)),
            Node::Neg(a) => {
                let a = v(a);
                quote!(-#a)
            }
            Node::Unary(function, a) => call(unary_name(function), &[a]),
            Node::Binary(function, a, b) => call(binary_name(function), &[a, b]),
            Node::Select { comparison, left, right, then, otherwise } => {
                let (left, right, then, otherwise) = (v(left), v(right), v(then), v(otherwise));
                let comparison = match comparison {
                    Comparison::Less => quote!(<),
                    Comparison::LessEqual => quote!(<=),
                    Comparison::Equal => quote!(==),
                };
                quote!(if #left #comparison #right { #then } else { #otherwise })
            }
            Node::Smooth { function, order, argument } => {
                let (function, order) = (self.access.function(function), Literal::usize_unsuffixed(order.into()));
                let argument = v(argument);
                quote!(#private::SmoothFunction::derivatives(&#function, #argument)[#order])
            }
        }
    }
}

fn binary(a: &TokenStream, operator: &TokenStream, b: &TokenStream) -> TokenStream {
    quote!(#a #operator #b)
}
