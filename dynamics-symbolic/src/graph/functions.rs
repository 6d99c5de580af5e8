//! Smart constructors of functions, powers, conditions.

use super::fingerprint::{Circle, Fingerprint};
use super::{Binary, Comparison, FunctionId, Graph, Node, NodeId, Number, Unary};

impl Graph {
    /// aⁿ by repeated squaring; `None` for a negative power of zero.
    pub fn powi(&mut self, a: NodeId, n: i32) -> Option<NodeId> {
        let mut result = self.one();
        let mut base = a;
        let mut left = n.unsigned_abs();
        while left > 0 {
            if left & 1 == 1 {
                result = self.mul(result, base);
            }
            left >>= 1;
            if left > 0 {
                base = self.mul(base, base);
            }
        }
        if n < 0 {
            let one = self.one();
            self.div(one, result)
        } else {
            Some(result)
        }
    }

    /// Point of the circle of an angle: additive where the angle is a sum or an integer multiple. Without
    /// recursion, as sums can be deep.
    fn circle(&mut self, angle: NodeId) -> Circle {
        let mut stack = vec![angle];
        while let Some(&id) = stack.last() {
            let missing = |g: &Self, x: NodeId| g.circles.get(&x).is_none();
            let parts: Vec<NodeId> = match self.node(id) {
                _ if self.is_zero(id) => Vec::new(),
                Node::Add(a, b) | Node::Sub(a, b) => vec![a, b],
                Node::Neg(a) => vec![a],
                Node::Mul(n, a) if self.multiple(n).is_some() => vec![a],
                _ => Vec::new(),
            };
            let left: Vec<NodeId> = parts.into_iter().filter(|x| missing(self, *x)).collect();
            if left.is_empty() {
                stack.pop();
                let point = self.circle_of_known(id);
                self.circles.insert(id, point);
            } else {
                stack.extend(left);
            }
        }
        self.circles.get(&angle).expect("the loop ends with the angle's own point")
    }

    /// The integer that a node is, if it is small enough to multiply an angle by.
    fn multiple(&self, n: NodeId) -> Option<i64> {
        match self.as_number(n) {
            Some(Number::Rational(n, 1)) => i32::try_from(n).ok().map(i64::from),
            _ => None,
        }
    }

    /// The point of an angle whose parts have theirs.
    fn circle_of_known(&self, angle: NodeId) -> Circle {
        let known = |x: NodeId| self.circles.get(&x).expect("parts come first");
        match self.node(angle) {
            _ if self.is_zero(angle) => Circle::ZERO_ANGLE,
            Node::Add(a, b) => known(a).add(known(b)),
            Node::Sub(a, b) => known(a).add(known(b).neg()),
            Node::Neg(a) => known(a).neg(),
            Node::Mul(n, a) => match self.multiple(n) {
                Some(n) => known(a).times(n),
                None => Circle::opaque(self.fingerprint(angle)),
            },
            _ => Circle::opaque(self.fingerprint(angle)),
        }
    }

    /// f(a) for a function of one argument.
    pub fn unary(&mut self, f: Unary, a: NodeId) -> NodeId {
        use Unary::{Abs, Asin, Atan, Cbrt, Cos, Cosh, Exp, Sin, Sinh, Tan, Tanh};
        if self.is_zero(a) {
            match f {
                Cos | Cosh | Exp => return self.one(),
                Sin | Tan | Asin | Atan | Sinh | Tanh | Unary::Sqrt | Cbrt | Abs => return a,
                _ => {}
            }
        }
        if let Node::Neg(x) = self.node(a) {
            match f {
                Sin | Tan | Asin | Atan | Sinh | Tanh | Cbrt => {
                    let value = self.unary(f, x);
                    return self.neg(value);
                }
                Cos | Cosh | Abs => return self.unary(f, x),
                _ => {}
            }
        }
        let value = match f {
            Sin => self.circle(a).sin,
            Cos => self.circle(a).cos,
            Tan => {
                let point = self.circle(a);
                point.sin.div(point.cos)
            }
            _ => Fingerprint::opaque(0x100 + f as u64, &[self.fingerprint(a)]),
        };
        match self.as_number(a).and_then(|n| fold(f, n)) {
            Some(folded) => self.folded(folded, value),
            None => self.intern(Node::Unary(f, a), value),
        }
    }

    /// f(a, b) for a function of two arguments.
    pub fn binary(&mut self, f: Binary, a: NodeId, b: NodeId) -> NodeId {
        let value = Fingerprint::opaque(0x200 + f as u64, &[self.fingerprint(a), self.fingerprint(b)]);
        let folded = self.as_number(a).zip(self.as_number(b)).and_then(|(x, y)| {
            let z = evaluate_binary(f, x.value(), y.value());
            z.is_finite().then_some(Number::Float(z))
        });
        match (folded, f) {
            (Some(z), Binary::Min | Binary::Max) => {
                let first = self.as_number(a).is_some_and(|x| x.value() == z.value());
                if first { a } else { b }
            }
            (Some(z), _) => self.folded(z, value),
            (None, _) => self.intern(Node::Binary(f, a, b), value),
        }
    }

    /// `if left ∘ right { then } else { otherwise }`.
    pub fn select(
        &mut self,
        comparison: Comparison,
        left: NodeId,
        right: NodeId,
        then: NodeId,
        otherwise: NodeId,
    ) -> NodeId {
        if then == otherwise {
            return then;
        }
        if let (Some(l), Some(r)) = (self.as_number(left), self.as_number(right)) {
            let (l, r) = (l.value(), r.value());
            let holds = match comparison {
                Comparison::Less => l < r,
                Comparison::LessEqual => l <= r,
                Comparison::Equal => l == r,
            };
            return if holds { then } else { otherwise };
        }
        let value =
            Fingerprint::chosen(comparison, [left, right, then, otherwise].map(|x| self.fingerprint(x)));
        self.intern(Node::Select { comparison, left, right, then, otherwise }, value)
    }

    /// Derivative of given order of a smooth parameter function at `argument`.
    pub fn smooth(&mut self, function: FunctionId, order: u8, argument: NodeId) -> NodeId {
        let kind = 0x400 + (u64::from(function.0) << 16) + u64::from(order);
        let value = Fingerprint::opaque(kind, &[self.fingerprint(argument)]);
        self.intern(Node::Smooth { function, order, argument }, value)
    }
}

/// f of a literal, where the result is finite; exact for roots of squares and cubes.
fn fold(f: Unary, n: Number) -> Option<Number> {
    let y = evaluate(f, n.value());
    let exact = matches!(f, Unary::Sqrt | Unary::Cbrt | Unary::Abs | Unary::Signum);
    match Number::finite(y)? {
        whole @ Number::Rational(..) if exact => {
            let power = match f {
                Unary::Sqrt => whole.times(whole)?,
                Unary::Cbrt => whole.times(whole)?.times(whole)?,
                _ => return Some(whole),
            };
            let holds =
                matches!((power, n), (Number::Rational(a, b), Number::Rational(c, d)) if (a, b) == (c, d));
            Some(if holds { whole } else { Number::Float(y) })
        }
        _ => Some(Number::Float(y)),
    }
}

/// f(x) in `f64`.
pub(super) fn evaluate(f: Unary, x: f64) -> f64 {
    match f {
        Unary::Sin => x.sin(),
        Unary::Cos => x.cos(),
        Unary::Tan => x.tan(),
        Unary::Asin => x.asin(),
        Unary::Acos => x.acos(),
        Unary::Atan => x.atan(),
        Unary::Sinh => x.sinh(),
        Unary::Cosh => x.cosh(),
        Unary::Tanh => x.tanh(),
        Unary::Exp => x.exp(),
        Unary::Ln => x.ln(),
        Unary::Sqrt => x.sqrt(),
        Unary::Cbrt => x.cbrt(),
        Unary::Abs => x.abs(),
        Unary::Signum => x.signum(),
    }
}

/// f(x, y) in `f64`.
pub(super) fn evaluate_binary(f: Binary, x: f64, y: f64) -> f64 {
    match f {
        Binary::Atan2 => x.atan2(y),
        Binary::Powf => x.powf(y),
        Binary::Hypot => x.hypot(y),
        Binary::Min if y < x => y,
        Binary::Max if y > x => y,
        Binary::Min | Binary::Max => x,
    }
}
