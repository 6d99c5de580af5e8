//! What drawings read of numbers and of smooth functions, beyond the language of models.

use dynamics_symbolic::graph::{Binary, FunctionId, Number, Unary};
use dynamics_symbolic::mechanics::Extra;
use syn::Ident;

use super::super::Elaborator;
use super::super::calls::Argument;
use super::super::values::{Scalar, Value};

impl Elaborator<'_> {
    /// `.domain()`, `.value(x)` and `.derivatives(x)` of a smooth function; `None` for other methods.
    pub(super) fn drawn_function(
        &mut self,
        function: FunctionId,
        name: &Ident,
        arguments: &[Argument],
    ) -> Option<Value> {
        match (name.to_string().as_str(), arguments) {
            ("domain", []) => {
                let ends = [Extra::Start(function), Extra::End(function)];
                Some(Value::array(ends.map(|end| self.extra_scalar(end).into()).into()))
            }
            ("derivatives", [(x, place)]) => {
                let Some(x) = self.scalar(x.clone(), *place) else { return Some(Value::Poison) };
                let orders = (0..4).map(|order| self.model.graph.smooth(function, order, x.node));
                Some(Value::array(orders.map(|node| Scalar { node, unit: None }.into()).collect()))
            }
            _ => None,
        }
    }

    /// Methods of numbers that models do not have; `None` for those that they have.
    pub(super) fn drawn_scalar(&mut self, x: &Scalar, name: &Ident, arguments: &[Argument]) -> Option<Value> {
        match (name.to_string().as_str(), arguments) {
            ("value", []) => Some(x.clone().into()),
            ("rate", []) => Some(self.time_derivative(x.clone().into(), name)),
            ("acceleration", []) => {
                let rate = self.time_derivative(x.clone().into(), name);
                Some(self.time_derivative(rate, name))
            }
            ("to_radians", []) => {
                let factor = self.number(Number::Float(std::f64::consts::PI / 180.0));
                Some(self.product(x, &factor).into())
            }
            ("rem_euclid", [(other, place)]) => {
                let Some(other) = self.scalar(other.clone(), *place) else { return Some(Value::Poison) };
                Some(self.remainder(x, &other, name).into())
            }
            _ => None,
        }
    }

    /// x mod d as |d|·(½ + arg(−e^{2πi x/|d|})/2π), since expressions have no remainder. It has the
    /// rounding errors of an angle: where x is a multiple of d the result may be |d| instead of 0. Whoever
    /// draws marks at equal distances d sees the same picture.
    fn remainder(&mut self, x: &Scalar, d: &Scalar, name: &Ident) -> Option<Scalar> {
        let d = Scalar { node: self.model.graph.unary(Unary::Abs, d.node), unit: d.unit.clone() };
        let turns = self.quotient(x, &d, name.span())?;
        let graph = &mut self.model.graph;
        let turn = graph.number(Number::Float(std::f64::consts::TAU));
        let half = graph.number(Number::Float(0.5));
        let angle = graph.mul(turn, turns.node);
        let (sin, cos) = (graph.unary(Unary::Sin, angle), graph.unary(Unary::Cos, angle));
        let (sin, cos) = (graph.neg(sin), graph.neg(cos));
        let angle = graph.binary(Binary::Atan2, sin, cos);
        let part = graph.div(angle, turn)?;
        let part = graph.add(half, part);
        Some(Scalar { node: graph.mul(d.node, part), unit: d.unit })
    }
}
