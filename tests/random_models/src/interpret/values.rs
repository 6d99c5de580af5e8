//! Values of parameters, from the struct's literal in a text.

use syn::{Expr, ExprStruct, Lit, Member, UnOp};

use crate::syntax::{Declaration, FieldKind, Shape};

/// The values in the order of the engine's parameters; `None` where the literal is not of numbers alone.
pub(super) fn parameters(literal: &str, declaration: &Declaration) -> Option<Vec<f64>> {
    let literal: ExprStruct = syn::parse_str(literal).ok()?;
    let mut values = Vec::new();
    for field in &declaration.fields {
        let FieldKind::Parameter { shape, .. } = &field.kind else { continue };
        let given =
            literal.fields.iter().find(|f| matches!(&f.member, Member::Named(n) if *n == field.name))?;
        let before = values.len();
        flatten(&given.expr, shape, &mut values)?;
        (values.len() == before + shape.elements().len()).then_some(())?;
    }
    Some(values)
}

/// Numbers within arrays and calls, in their order.
fn flatten(value: &Expr, shape: &Shape, to: &mut Vec<f64>) -> Option<()> {
    match value {
        Expr::Array(array) => array.elems.iter().try_for_each(|e| flatten(e, shape, to)),
        Expr::Call(call) if call.args.iter().any(|a| matches!(a, Expr::Closure(_))) => {
            from_fn(call.args.first()?, shape, to)
        }
        Expr::Call(call) => call.args.iter().try_for_each(|e| flatten(e, shape, to)),
        number => {
            to.push(evaluate(number, 0.0)?);
            Some(())
        }
    }
}

/// `::core::array::from_fn(|i| ..)`.
fn from_fn(closure: &Expr, shape: &Shape, to: &mut Vec<f64>) -> Option<()> {
    let (Expr::Closure(closure), Shape::Array(length, inner)) = (closure, shape) else { return None };
    matches!(**inner, Shape::Scalar).then_some(())?;
    for i in 0..*length {
        to.push(evaluate(&closure.body, i as f64)?);
    }
    Some(())
}

/// A number; names stand for the index.
fn evaluate(value: &Expr, index: f64) -> Option<f64> {
    match value {
        Expr::Lit(lit) => match &lit.lit {
            Lit::Float(float) => float.base10_parse().ok(),
            Lit::Int(int) => int.base10_parse().ok(),
            _ => None,
        },
        Expr::Unary(minus) if matches!(minus.op, UnOp::Neg(_)) => Some(-evaluate(&minus.expr, index)?),
        Expr::Paren(inner) => evaluate(&inner.expr, index),
        Expr::Cast(cast) => evaluate(&cast.expr, index),
        Expr::Path(_) => Some(index),
        Expr::Binary(binary) => {
            let (a, b) = (evaluate(&binary.left, index)?, evaluate(&binary.right, index)?);
            match binary.op {
                syn::BinOp::Add(_) => Some(a + b),
                syn::BinOp::Mul(_) => Some(a * b),
                _ => None,
            }
        }
        _ => None,
    }
}
