//! The terms of a sum that a function returns, so that an error of the whole can be shown at the one at
//! fault.

use dynamics_symbolic::graph::NodeId;
use syn::{BinOp, Expr, ExprReturn, Stmt};

use super::Elaborator;
use super::operators::Operator;
use super::values::Value;
use crate::diagnostics::Place;
use crate::syntax::Function;

/// What was added or subtracted in the body of a function with a role.
#[derive(Clone, Debug)]
pub(super) struct Added<'a> {
    /// The variable it was added to, as by `sum += ..`.
    to: Option<String>,
    term: &'a Expr,
    node: NodeId,
}

impl<'a> Elaborator<'a> {
    /// Notes a part of a sum.
    pub(super) fn note_term(&mut self, to: Option<&Expr>, op: Operator, term: &'a Expr, value: &Value) {
        let here = self.frames.len() == 1 && self.sums == super::Sums::Apart;
        if let (true, Operator::Add | Operator::Sub, Value::Scalar(x)) = (here, op, value) {
            let to = to.map(name_of).unwrap_or_default();
            self.terms.push(Added { to, term, node: x.node });
        }
    }

    /// The terms of the sum that a function returns; none where it returns anything else.
    pub(super) fn terms_of(&self, function: &'a Function) -> Vec<(NodeId, Place)> {
        let mut found = Vec::new();
        let mut left: Vec<&Expr> = returned(function).into_iter().collect();
        while let Some(expr) = left.pop() {
            match expr {
                Expr::Paren(inner) => left.push(&inner.expr),
                Expr::Group(inner) => left.push(&inner.expr),
                Expr::Binary(sum) if matches!(sum.op, BinOp::Add(_) | BinOp::Sub(_)) => {
                    left.extend([&*sum.right, &*sum.left]);
                }
                expr => {
                    let name = name_of(expr);
                    let same = |added: &&Added<'_>| {
                        std::ptr::eq(added.term, expr) || name.is_some() && added.to == name
                    };
                    found.extend(
                        self.terms.iter().filter(same).map(|added| (added.node, Place::of(added.term))),
                    );
                }
            }
        }
        found
    }
}

/// The name of a variable.
fn name_of(expr: &Expr) -> Option<String> {
    match expr {
        Expr::Path(path) => path.path.get_ident().map(ToString::to_string),
        _ => None,
    }
}

/// The expression whose value a function returns.
pub(super) fn returned(function: &Function) -> Option<&Expr> {
    match function.item.block.stmts.last()? {
        Stmt::Expr(Expr::Return(ExprReturn { expr, .. }), _) => expr.as_deref(),
        Stmt::Expr(value, None) => Some(value),
        _ => None,
    }
}
