//! `.dt()`: the total time derivative of any value.

use std::rc::Rc;

use dynamics_symbolic::calculus::{NotDifferentiable, total_derivative};
use dynamics_symbolic::check::units::{Dimension, UnitExpr};
use dynamics_symbolic::graph::{Node, NodeId, Symbol};
use syn::Ident;

use super::Elaborator;
use super::values::{Scalar, Value};
use crate::messages;

impl Elaborator<'_> {
    /// d/dt of all scalars in a value, which keeps its shape.
    pub(super) fn time_derivative(&mut self, value: Value, name: &Ident) -> Value {
        let mut scalars = Vec::new();
        if !collect(&value, &mut scalars) {
            return self.fail(name.span(), &messages::no_time_derivative(value.shape()));
        }
        let nodes: Vec<NodeId> = scalars.iter().map(|s| s.node).collect();
        match total_derivative(&mut self.model.graph, &nodes) {
            Ok(rates) => {
                let second = UnitExpr::known(Dimension::TIME);
                let graph = &self.model.graph;
                let mut rates = rates.into_iter().zip(&scalars).map(|(node, s)| {
                    // The rate of a constant is zero, which has any unit.
                    let unit =
                        s.unit.as_ref().filter(|_| !graph.is_zero(node)).map(|u| Rc::new(u.div(&second)));
                    Scalar { node, unit }
                });
                rebuild(&value, &mut rates)
            }
            Err(NotDifferentiable::Input) => {
                let input = nodes.iter().find_map(|n| self.first_input(*n)).unwrap_or_default();
                self.fail(name.span(), &messages::rate_of_input(input))
            }
            Err(NotDifferentiable::Multiplier) => self.fail(name.span(), &messages::rate_of_reaction()),
            Err(NotDifferentiable::Acceleration) => self.fail(name.span(), &messages::third_derivative()),
        }
    }

    /// Name of an input below a node.
    fn first_input(&self, root: NodeId) -> Option<String> {
        let graph = &self.model.graph;
        let mut seen = std::collections::BTreeSet::new();
        let mut left = vec![root];
        while let Some(id) = left.pop() {
            if let Node::Symbol(Symbol::Input(i)) = graph.node(id) {
                return self.model.inputs.get(i as usize).map(|i| i.name.clone());
            }
            left.extend(graph.node(id).children().filter(|c| seen.insert(*c)));
        }
        None
    }
}

/// All scalars of a value in order; false where it holds something without a time derivative.
pub(super) fn collect(value: &Value, scalars: &mut Vec<Scalar>) -> bool {
    match value {
        Value::Scalar(s) => scalars.push(s.clone()),
        Value::Vector(v) => scalars.extend(v.iter().cloned()),
        Value::Matrix(m) => scalars.extend(m.iter().flatten().cloned()),
        Value::Tuple(items) | Value::Array(items) => return items.iter().all(|v| collect(v, scalars)),
        Value::Poison => {}
        _ => return false,
    }
    true
}

/// A value of the same shape from other scalars.
pub(super) fn rebuild(value: &Value, scalars: &mut impl Iterator<Item = Scalar>) -> Value {
    match value {
        Value::Scalar(_) => scalars.next().into(),
        Value::Vector(v) => Value::Vector(scalars.take(v.len()).collect()),
        Value::Matrix(m) => {
            let flat: Vec<Scalar> = scalars.take(9).collect();
            if flat.len() < 9 {
                return Value::Matrix(m.clone());
            }
            Value::matrix([0, 1, 2].map(|i| [0, 1, 2].map(|j| flat[3 * i + j].clone())))
        }
        Value::Tuple(items) => Value::Tuple(Rc::new(items.iter().map(|v| rebuild(v, scalars)).collect())),
        Value::Array(items) => Value::Array(Rc::new(items.iter().map(|v| rebuild(v, scalars)).collect())),
        other => other.clone(),
    }
}
