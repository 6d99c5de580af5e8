//! Smart constructors: folding, signs outermost, parameter-only factors outermost.

use super::fingerprint::{Circle, Fingerprint};
use super::{Binary, Comparison, Dependence, FunctionId, Graph, Node, NodeId, Number, Symbol, Unary};

impl Graph {
    /// A number.
    pub fn number(&mut self, number: Number) -> NodeId {
        self.intern(Node::Number(number), Fingerprint::number(number))
    }
    /// An integer.
    pub fn integer(&mut self, n: i64) -> NodeId {
        self.number(Number::integer(n))
    }
    /// Zero.
    pub fn zero(&mut self) -> NodeId {
        self.integer(0)
    }
    /// One.
    pub fn one(&mut self) -> NodeId {
        self.integer(1)
    }
    /// A symbol.
    pub fn symbol(&mut self, symbol: Symbol) -> NodeId {
        let (kind, index) = match symbol {
            Symbol::Time => (1, 0),
            Symbol::Coordinate(i) => (2, i),
            Symbol::Rate(i) => (3, i),
            Symbol::Acceleration(i) => (4, i),
            Symbol::Input(i) => (5, i),
            Symbol::Parameter(i) => (6, i),
        };
        self.intern(Node::Symbol(symbol), Fingerprint::atom(kind, index.into()))
    }

    /// The number that a node is, if it is one.
    #[must_use]
    pub fn as_number(&self, id: NodeId) -> Option<Number> {
        match self.node(id) {
            Node::Number(n) => Some(n),
            _ => None,
        }
    }
    /// Whether a node is identically zero.
    #[must_use]
    pub fn is_zero(&self, id: NodeId) -> bool {
        self.fingerprint(id) == Fingerprint::ZERO
    }
    /// Whether a node is identically one.
    #[must_use]
    pub fn is_one(&self, id: NodeId) -> bool {
        self.fingerprint(id) == Fingerprint::ONE
    }
    /// Whether a node is a number or depends on parameters alone.
    #[must_use]
    pub fn is_constant(&self, id: NodeId) -> bool {
        self.dependence(id).within(Dependence::PARAMETERS)
    }

    /// Two nodes as (factor, rest): a parameter-only factor, or, where both are parameter-only, a number. Numbers stand outside parameters and
    /// parameters outside everything else, so that like terms meet and parameter-only work can be hoisted.
    fn split(&mut self, a: NodeId, b: NodeId) -> [(NodeId, NodeId); 2] {
        let numbers = self.is_constant(a) && self.is_constant(b);
        [a, b].map(|id| {
            let is_factor = |x| if numbers { self.as_number(x).is_some() } else { self.is_constant(x) };
            match self.node(id) {
                _ if is_factor(id) => (id, self.one()),
                Node::Mul(factor, rest) if is_factor(factor) => (factor, rest),
                _ => (self.one(), id),
            }
        })
    }

    /// f·x and f·y as (f, x, y).
    fn common_factor(&self, a: NodeId, b: NodeId) -> Option<(NodeId, NodeId, NodeId)> {
        let (Node::Mul(a1, a2), Node::Mul(b1, b2)) = (self.node(a), self.node(b)) else { return None };
        let ways = [(a1, a2, b1, b2), (a1, a2, b2, b1), (a2, a1, b1, b2), (a2, a1, b2, b1)];
        ways.into_iter().find(|(f, _, h, _)| f == h).map(|(f, x, _, y)| (f, x, y))
    }

    /// a + b.
    pub fn add(&mut self, a: NodeId, b: NodeId) -> NodeId {
        if self.is_zero(a) {
            return b;
        }
        if self.is_zero(b) {
            return a;
        }
        match (self.node(a), self.node(b)) {
            (Node::Number(x), Node::Number(y)) => {
                if let Some(sum) = x.plus(y) {
                    return self.number(sum);
                }
            }
            (_, Node::Neg(y)) => return self.sub(a, y),
            (Node::Neg(x), _) => return self.sub(b, x),
            _ => {}
        }
        let value = self.fingerprint(a).add(self.fingerprint(b));
        if let Some(known) = self.find(value) {
            return known;
        }
        let [(p, x), (r, y)] = self.split(a, b);
        if x == y && !self.is_one(x) {
            let factor = self.add(p, r);
            return self.mul(factor, x);
        }
        if let Some((factor, x, y)) = self.common_factor(a, b) {
            let rest = self.add(x, y);
            return self.mul(factor, rest);
        }
        self.intern(Node::Add(a, b), value)
    }

    /// a − b.
    pub fn sub(&mut self, a: NodeId, b: NodeId) -> NodeId {
        if self.is_zero(b) {
            return a;
        }
        if self.is_zero(a) {
            return self.neg(b);
        }
        match (self.node(a), self.node(b)) {
            (Node::Number(x), Node::Number(y)) => {
                if let Some(difference) = x.plus(y.opposite()) {
                    return self.number(difference);
                }
            }
            (_, Node::Neg(y)) => return self.add(a, y),
            (Node::Neg(x), _) => {
                let sum = self.add(x, b);
                return self.neg(sum);
            }
            _ => {}
        }
        let value = self.fingerprint(a).sub(self.fingerprint(b));
        if let Some(known) = self.find(value) {
            return known;
        }
        let [(p, x), (r, y)] = self.split(a, b);
        if x == y && !self.is_one(x) {
            let factor = self.sub(p, r);
            return self.mul(factor, x);
        }
        if let Some((factor, x, y)) = self.common_factor(a, b) {
            let rest = self.sub(x, y);
            return self.mul(factor, rest);
        }
        self.intern(Node::Sub(a, b), value)
    }

    /// −a.
    pub fn neg(&mut self, a: NodeId) -> NodeId {
        match self.node(a) {
            Node::Number(x) => self.number(x.opposite()),
            Node::Neg(x) => x,
            Node::Sub(x, y) => self.sub(y, x),
            _ => {
                let value = self.fingerprint(a).neg();
                self.intern(Node::Neg(a), value)
            }
        }
    }

    /// a · b.
    pub fn mul(&mut self, a: NodeId, b: NodeId) -> NodeId {
        if self.is_zero(a) || self.is_one(b) {
            return a;
        }
        if self.is_zero(b) || self.is_one(a) {
            return b;
        }
        match (self.node(a), self.node(b)) {
            (Node::Number(x), Node::Number(y)) => {
                // A product beyond f64 is left as it stands.
                let value = self.fingerprint(a).mul(self.fingerprint(b));
                return match x.times(y) {
                    Some(product) => self.number(product),
                    None => self.intern(Node::Mul(a, b), value),
                };
            }
            (Node::Neg(x), Node::Neg(y)) => return self.mul(x, y),
            (Node::Neg(x), _) => {
                let product = self.mul(x, b);
                return self.neg(product);
            }
            (_, Node::Neg(y)) => {
                let product = self.mul(a, y);
                return self.neg(product);
            }
            (Node::Number(x), _) if x.is_negative() => {
                let opposite = self.number(x.opposite());
                let product = self.mul(opposite, b);
                return self.neg(product);
            }
            (_, Node::Number(_)) => return self.mul(b, a),
            (Node::Unary(Unary::Sqrt, x), _) if a == b => return x,
            _ => {}
        }
        let value = self.fingerprint(a).mul(self.fingerprint(b));
        if let Some(known) = self.find(value)
            && (self.is_monomial(known) || !(self.is_monomial(a) && self.is_monomial(b)))
        {
            return known;
        }
        let [(p, x), (r, y)] = self.split(a, b);
        let trivial = self.is_one(x) || self.is_one(y);
        let factors = [p, r].iter().filter(|f| !self.is_one(**f)).count();
        if factors == 2 || factors == 1 && !trivial {
            let (factor, rest) = (self.mul(p, r), self.mul(x, y));
            return self.mul(factor, rest);
        }
        if let Some((square, rest)) = self.repeated(a, b).or_else(|| self.repeated(b, a)) {
            let square = self.mul(square, square);
            return self.mul(square, rest);
        }
        // Constants first, otherwise in order of creation.
        let swap = self.is_constant(b) && !self.is_constant(a) || self.is_constant(a) == self.is_constant(b) && b < a;
        let (a, b) = if swap { (b, a) } else { (a, b) };
        self.intern(Node::Mul(a, b), value)
    }

    /// a · b without moving parameter-only factors outward: for factors that are needed as they are, as in an elimination.
    pub fn mul_as_is(&mut self, a: NodeId, b: NodeId) -> NodeId {
        match (self.node(a), self.node(b)) {
            _ if self.is_constant(a) || self.is_constant(b) => return self.mul(a, b),
            (Node::Neg(x), _) => {
                let product = self.mul_as_is(x, b);
                return self.neg(product);
            }
            (_, Node::Neg(y)) => {
                let product = self.mul_as_is(a, y);
                return self.neg(product);
            }
            _ => {}
        }
        let value = self.fingerprint(a).mul(self.fingerprint(b));
        self.intern(Node::Mul(a.min(b), a.max(b)), value)
    }

    /// x·(x·y) as (x, y) for a symbol x: squares of velocities and lengths are shared where products of three are not.
    fn repeated(&self, a: NodeId, b: NodeId) -> Option<(NodeId, NodeId)> {
        match self.node(b) {
            _ if !matches!(self.node(a), Node::Symbol(_)) => None,
            // A cube is written x²·x: nothing left to do.
            Node::Mul(x, y) if x == a && y == a => None,
            Node::Mul(x, y) if x == a => Some((x, y)),
            Node::Mul(y, x) if x == a => Some((x, y)),
            _ => None,
        }
    }

    /// a / b; `None` where b is identically zero.
    pub fn div(&mut self, a: NodeId, b: NodeId) -> Option<NodeId> {
        if self.is_zero(b) {
            return None;
        }
        if self.is_zero(a) || self.is_one(b) {
            return Some(a);
        }
        if let Some(n) = self.as_number(b)
            && let Some(r) = n.recip()
            && matches!(r, Number::Rational(..))
            && (self.as_number(a).is_some() || r.value().abs().log2().fract() == 0.0)
        {
            let r = self.number(r);
            return Some(self.mul(a, r));
        }
        match (self.node(a), self.node(b)) {
            (Node::Neg(x), _) => return self.div(x, b).map(|q| self.neg(q)),
            (_, Node::Neg(y)) => return self.div(a, y).map(|q| self.neg(q)),
            _ => {}
        }
        let value = self.fingerprint(a).div(self.fingerprint(b));
        if let Some(known) = self.find(value)
            && (self.is_monomial(known) || !(self.is_monomial(a) && self.is_monomial(b)))
        {
            return Some(known);
        }
        // A division by parameters alone is a multiplication by a hoisted reciprocal.
        if self.is_constant(b) && !self.is_constant(a) {
            let one = self.one();
            let reciprocal = self.intern(Node::Div(one, b), Fingerprint::ONE.div(self.fingerprint(b)));
            return Some(self.mul(reciprocal, a));
        }
        Some(self.intern(Node::Div(a, b), value))
    }

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

    /// Point of the circle of an angle: additive where the angle is a sum or an integer multiple. Without recursion, as sums can be deep.
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
        if let Some(n) = self.as_number(a)
            && let Some(folded) = fold(f, n)
        {
            return self.number(folded);
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
        self.intern(Node::Unary(f, a), value)
    }

    /// f(a, b) for a function of two arguments.
    pub fn binary(&mut self, f: Binary, a: NodeId, b: NodeId) -> NodeId {
        let value = Fingerprint::opaque(0x200 + f as u64, &[self.fingerprint(a), self.fingerprint(b)]);
        self.intern(Node::Binary(f, a, b), value)
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
        let arguments = [left, right, then, otherwise].map(|x| self.fingerprint(x));
        let value = Fingerprint::opaque(0x300 + comparison as u64, &arguments);
        self.intern(Node::Select { comparison, left, right, then, otherwise }, value)
    }

    /// Derivative of given order of a smooth parameter function at `argument`.
    pub fn smooth(&mut self, function: FunctionId, order: u8, argument: NodeId) -> NodeId {
        let kind = 0x400 + (u64::from(function.0) << 16) + u64::from(order);
        let value = Fingerprint::opaque(kind, &[self.fingerprint(argument)]);
        self.intern(Node::Smooth { function, order, argument }, value)
    }
}

/// f of a literal, where the result is finite.
fn fold(f: Unary, n: Number) -> Option<Number> {
    let x = n.value();
    let y = evaluate(f, x);
    let exact =
        y.fract() == 0.0 && y.abs() < 1e15 && matches!(f, Unary::Sqrt | Unary::Cbrt | Unary::Abs | Unary::Signum);
    y.is_finite().then(|| if exact { Number::integer(y as i64) } else { Number::Float(y) })
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
