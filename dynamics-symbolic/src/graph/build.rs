//! Smart constructors: folding, signs outermost, parameter-only factors outermost.

use super::fingerprint::Fingerprint;
use super::{Dependence, Graph, Node, NodeId, Number, Symbol, Unary};

/// Relative difference up to which two rounded numbers with the same fingerprint are the same number. Sums of
/// the same literals in another order differ by some ε.
const SAME_NUMBER: f64 = 1e-9;

impl Graph {
    /// A number.
    pub fn number(&mut self, number: Number) -> NodeId {
        self.intern(Node::Number(number), Fingerprint::number(number))
    }
    /// A folded number whose exact value is known by its fingerprint, however it was rounded: sums of the
    /// same literals in another order stay the same node.
    pub(super) fn folded(&mut self, number: Number, value: Fingerprint) -> NodeId {
        match number {
            Number::Rational(..) => self.number(number),
            // Rounded numbers of many digits may meet modulo the prime: what another number already owns is
            // not this number's.
            Number::Float(x) => {
                match self.known(&Node::Number(number), value).and_then(|id| self.as_number(id)) {
                    Some(other) if (other.value() - x).abs() > SAME_NUMBER * x.abs() => self.number(number),
                    _ => self.intern(Node::Number(number), value),
                }
            }
        }
    }
    /// An integer.
    pub fn integer(&mut self, n: i64) -> NodeId {
        self.number(Number::integer(n))
    }
    /// Zero.
    #[must_use]
    pub fn zero(&self) -> NodeId {
        Self::ZERO
    }
    /// One.
    #[must_use]
    pub fn one(&self) -> NodeId {
        Self::ONE
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
            Symbol::Multiplier(i) => (7, i),
            Symbol::Mode(i) => (8, i),
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
    /// Whether two nodes are opposite.
    #[must_use]
    pub fn are_opposite(&self, a: NodeId, b: NodeId) -> bool {
        self.fingerprint(a) == self.fingerprint(b).neg()
    }
    /// Whether a node is a number or depends on parameters alone.
    #[must_use]
    pub fn is_constant(&self, id: NodeId) -> bool {
        self.dependence(id).within(Dependence::PARAMETERS)
    }

    /// Whether a node contains no symbol: a number, or an operation on numbers that could not be folded.
    fn is_numeric(&self, id: NodeId) -> bool {
        self.dependence(id).within(Dependence::NONE)
    }

    /// Two nodes as (factor, rest): a parameter-only factor, or, where both are parameter-only, a number.
    /// Numbers stand outside parameters and parameters outside everything else, so that like terms meet and
    /// parameter-only work can be hoisted.
    fn split(&mut self, a: NodeId, b: NodeId) -> [(NodeId, NodeId); 2] {
        let numbers = self.is_constant(a) && self.is_constant(b);
        [a, b].map(|id| {
            // A product of numbers that is beyond f64 stays a node; it is a number all the same.
            let is_factor = |x| if numbers { self.is_numeric(x) } else { self.is_constant(x) };
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
                    let value = self.fingerprint(a).add(self.fingerprint(b));
                    return self.folded(sum, value);
                }
            }
            (_, Node::Neg(y)) => return self.sub(a, y),
            (Node::Neg(x), _) => return self.sub(b, x),
            _ => {}
        }
        let value = self.fingerprint(a).add(self.fingerprint(b));
        if let Some(known) = self.known(&Node::Add(a, b), value) {
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
                    let value = self.fingerprint(a).sub(self.fingerprint(b));
                    return self.folded(difference, value);
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
        if let Some(known) = self.known(&Node::Sub(a, b), value) {
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
            Node::Number(x) => {
                let value = self.fingerprint(a).neg();
                self.folded(x.opposite(), value)
            }
            Node::Neg(x) => x,
            // As it stands: what was found to be x − y for a factor times (y − x) would be looked at for
            // factors again, without end.
            Node::Sub(x, y) => {
                let value = self.fingerprint(a).neg();
                self.intern(Node::Sub(y, x), value)
            }
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
                    Some(product) => self.folded(product, value),
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
                let opposite = self.neg(a);
                let product = self.mul(opposite, b);
                return self.neg(product);
            }
            (_, Node::Number(_)) => return self.mul(b, a),
            (Node::Unary(Unary::Sqrt, x), _) if a == b => return x,
            _ => {}
        }
        let value = self.fingerprint(a).mul(self.fingerprint(b));
        if let Some(known) = self.known(&Node::Mul(a, b), value) {
            return known;
        }
        let [(p, x), (r, y)] = self.split(a, b);
        // Factors without a rest are already as far outside as they can be.
        let rests = [x, y].iter().filter(|x| !self.is_one(**x)).count();
        let factors = [p, r].iter().filter(|f| !self.is_one(**f)).count();
        if factors == 2 && rests > 0 || factors == 1 && rests == 2 {
            let (factor, rest) = (self.mul(p, r), self.mul(x, y));
            return self.mul(factor, rest);
        }
        if let Some((square, rest)) = self.repeated(a, b).or_else(|| self.repeated(b, a)) {
            let square = self.mul(square, square);
            return self.mul(square, rest);
        }
        // Constants first, otherwise in order of creation.
        let swap = self.is_constant(b) && !self.is_constant(a)
            || self.is_constant(a) == self.is_constant(b) && b < a;
        let (a, b) = if swap { (b, a) } else { (a, b) };
        self.intern(Node::Mul(a, b), value)
    }

    /// a · b without moving parameter-only factors outward: for factors that are needed as they are, as in an
    /// elimination.
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

    /// a · b, whatever a and b are made of; for forms that were chosen before.
    pub(crate) fn mul_exactly(&mut self, a: NodeId, b: NodeId) -> NodeId {
        let value = self.fingerprint(a).mul(self.fingerprint(b));
        self.intern(Node::Mul(a.min(b), a.max(b)), value)
    }

    /// a + b, likewise.
    pub(crate) fn add_exactly(&mut self, a: NodeId, b: NodeId) -> NodeId {
        let value = self.fingerprint(a).add(self.fingerprint(b));
        self.intern(Node::Add(a, b), value)
    }

    /// a − b, likewise.
    pub(crate) fn sub_exactly(&mut self, a: NodeId, b: NodeId) -> NodeId {
        let value = self.fingerprint(a).sub(self.fingerprint(b));
        self.intern(Node::Sub(a, b), value)
    }

    /// x·(x·y) as (x, y) for a symbol x: squares of velocities and lengths are shared where products of three
    /// are not.
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
        let value = self.fingerprint(a).div(self.fingerprint(b));
        if let (Some(x), Some(y)) = (self.as_number(a), self.as_number(b))
            && let Some(quotient) = x.over(y)
        {
            return Some(self.folded(quotient, value));
        }
        match (self.node(a), self.node(b)) {
            (Node::Neg(x), _) => return self.div(x, b).map(|q| self.neg(q)),
            (_, Node::Neg(y)) => return self.div(a, y).map(|q| self.neg(q)),
            _ => {}
        }
        if let Some(known) = self.known(&Node::Div(a, b), value) {
            return Some(known);
        }
        if let Some((x, y)) = self.without_common_factors(a, b) {
            return self.div(x, y);
        }
        // By a number it is a multiplication, unless the reciprocal overflows; by anything else a
        // multiplication by the reciprocal, which other quotients and the derivative share, and which lets
        // constant factors of a and of other factors meet.
        let overflows = self.as_number(b).is_some_and(|n| n.recip().is_none());
        if !overflows && !self.is_one(a) {
            let one = self.one();
            let reciprocal = self.div(one, b)?;
            return Some(self.mul(reciprocal, a));
        }
        Some(self.intern(Node::Div(a, b), value))
    }

    /// a / b where numerator and denominator share factors; `None` where they share none and a reciprocal of
    /// b serves others too.
    pub fn cancelled_quotient(&mut self, a: NodeId, b: NodeId) -> Option<NodeId> {
        if let Node::Neg(x) = self.node(a) {
            return self.cancelled_quotient(x, b).map(|q| self.neg(q));
        }
        let (x, y) = self.without_common_factors(a, b)?;
        self.div(x, y)
    }

    /// Numerator and denominator of a/b without the factors that they share; `None` where they share none.
    fn without_common_factors(&mut self, a: NodeId, b: NodeId) -> Option<(NodeId, NodeId)> {
        let (above, mut below) = (self.factors(a), self.factors(b));
        let count = below.len();
        let mut left = Vec::new();
        for x in above {
            match below.iter().position(|y| *y == x) {
                Some(at) => drop(below.remove(at)),
                None => left.push(x),
            }
        }
        (below.len() < count).then(|| {
            let mut product = |factors: Vec<NodeId>| {
                let one = self.one();
                factors.into_iter().fold(one, |p, x| self.mul(p, x))
            };
            (product(left), product(below))
        })
    }

    /// The factors of a product, a few at most; anything else is its own only factor.
    fn factors(&self, id: NodeId) -> Vec<NodeId> {
        let mut found = Vec::new();
        let mut stack = vec![id];
        while let Some(id) = stack.pop() {
            match self.node(id) {
                Node::Mul(a, b) if found.len() + stack.len() < 16 => stack.extend([b, a]),
                _ => found.push(id),
            }
        }
        found
    }
}
