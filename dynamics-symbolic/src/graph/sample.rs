//! Values of nodes modulo 2⁶¹ − 31 at further random points, for exact linear algebra with random
//! evaluations.

use super::fingerprint::{Circle, Fingerprint};
use super::{Graph, Node, NodeId, Number, Symbol, Unary};

/// Evaluates some nodes modulo 2⁶¹ − 31 at points of the caller's choice, with the same conventions as the
/// fingerprints: sines and cosines on the rational circle, other functions opaque. Two nodes with equal
/// fingerprints have equal samples.
#[derive(Clone, Debug)]
pub struct Sampler<'g> {
    graph: &'g Graph,
    roots: Vec<NodeId>,
    /// What the roots are made of, in order, and whether a sine or cosine needs it as an angle.
    needed: Vec<(NodeId, bool)>,
}

impl<'g> Sampler<'g> {
    /// For the values of `roots`.
    #[must_use]
    pub fn new(graph: &'g Graph, roots: &[NodeId]) -> Self {
        let end = roots.iter().map(|r| r.index() + 1).max().unwrap_or(0);
        let mut needed = vec![false; end];
        let mut angle = vec![false; end];
        roots.iter().for_each(|r| needed[r.index()] = true);
        let mut found = Vec::new();
        for id in graph.ids().take(end).rev().filter(|id| id.index() < end) {
            if !needed[id.index()] {
                continue;
            }
            let node = graph.node(id);
            let trigonometric = matches!(node, Node::Unary(Unary::Sin | Unary::Cos | Unary::Tan, _));
            // Angles that are sums or multiples are composed of their parts' points on the circle.
            let composed = angle[id.index()]
                && matches!(node, Node::Add(..) | Node::Sub(..) | Node::Neg(_) | Node::Mul(..));
            for child in node.children() {
                needed[child.index()] = true;
                angle[child.index()] |= trigonometric || composed;
            }
            found.push((id, angle[id.index()]));
        }
        found.reverse();
        Self { graph, roots: roots.to_vec(), needed: found }
    }

    /// A random value for a symbol, another one for every `point`.
    #[must_use]
    pub fn random(&self, symbol: Symbol, point: u64) -> Fingerprint {
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
        Fingerprint::atom(0x1000 + (point << 16) + kind, index.into())
    }

    /// The roots' values where every symbol is random.
    #[must_use]
    pub fn at(&self, point: u64) -> Vec<Fingerprint> {
        self.with(&mut |s| self.random(s, point))
    }

    /// The roots' values for the given symbols' values.
    pub fn with(&self, value: &mut dyn FnMut(Symbol) -> Fingerprint) -> Vec<Fingerprint> {
        let end = self.needed.last().map_or(0, |(id, _)| id.index() + 1);
        let mut values = vec![Fingerprint::ZERO; end];
        let mut circles = vec![Circle::ZERO_ANGLE; end];
        for (id, angle) in &self.needed {
            let own = self.value(*id, &values, &circles, value);
            values[id.index()] = own;
            if *angle {
                circles[id.index()] = self.circle(*id, own, &circles);
            }
        }
        self.roots.iter().map(|r| values[r.index()]).collect()
    }

    fn value(
        &self,
        id: NodeId,
        values: &[Fingerprint],
        circles: &[Circle],
        symbol: &mut dyn FnMut(Symbol) -> Fingerprint,
    ) -> Fingerprint {
        let at = |x: NodeId| values[x.index()];
        match self.graph.node(id) {
            Node::Number(_) => self.graph.fingerprint(id),
            Node::Symbol(s) => symbol(s),
            Node::Add(a, b) => at(a).add(at(b)),
            Node::Sub(a, b) => at(a).sub(at(b)),
            Node::Mul(a, b) => at(a).mul(at(b)),
            Node::Div(a, b) => at(a).div(at(b)),
            Node::Neg(a) => at(a).neg(),
            Node::Unary(Unary::Sin, a) => circles[a.index()].sin,
            Node::Unary(Unary::Cos, a) => circles[a.index()].cos,
            Node::Unary(Unary::Tan, a) => circles[a.index()].sin.div(circles[a.index()].cos),
            Node::Unary(f, a) => Fingerprint::opaque(0x100 + f as u64, &[at(a)]),
            Node::Binary(f, a, b) => Fingerprint::opaque(0x200 + f as u64, &[at(a), at(b)]),
            Node::Select { comparison, left, right, then, otherwise } => {
                Fingerprint::chosen(comparison, [left, right, then, otherwise].map(at))
            }
            Node::Smooth { function, order, argument } => {
                Fingerprint::opaque(0x400 + (u64::from(function.0) << 16) + u64::from(order), &[at(argument)])
            }
        }
    }

    fn circle(&self, id: NodeId, own: Fingerprint, circles: &[Circle]) -> Circle {
        let at = |x: NodeId| circles[x.index()];
        match self.graph.node(id) {
            _ if self.graph.is_zero(id) => Circle::ZERO_ANGLE,
            Node::Add(a, b) => at(a).add(at(b)),
            Node::Sub(a, b) => at(a).add(at(b).neg()),
            Node::Neg(a) => at(a).neg(),
            Node::Mul(n, a) => match self.graph.as_number(n) {
                Some(Number::Rational(n, 1)) if n.unsigned_abs() < 1 << 32 => at(a).times(n as i64),
                _ => Circle::opaque(own),
            },
            _ => Circle::opaque(own),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::{Fingerprint, Graph, Sampler, Symbol, Unary};

    #[test]
    fn identities_hold_at_every_point() {
        let mut g = Graph::new();
        let (x, y) = (g.symbol(Symbol::Coordinate(0)), g.symbol(Symbol::Coordinate(1)));
        let two = g.integer(2);
        let double = g.mul(two, x);
        let angle = g.sub(double, y);
        let [s, c, sx, cx, sy, cy] = [
            (Unary::Sin, angle),
            (Unary::Cos, angle),
            (Unary::Sin, x),
            (Unary::Cos, x),
            (Unary::Sin, y),
            (Unary::Cos, y),
        ]
        .map(|(f, a)| g.unary(f, a));
        let sampler = Sampler::new(&g, &[s, c, sx, cx, sy, cy, x]);
        for point in 0..5 {
            let [s, c, sx, cx, sy, cy, x] = <[Fingerprint; 7]>::try_from(sampler.at(point)).unwrap();
            assert_eq!(s.mul(s).add(c.mul(c)), Fingerprint::ONE);
            let (s2, c2) = (sx.mul(cx).add(sx.mul(cx)), cx.mul(cx).sub(sx.mul(sx)));
            assert_eq!(s, s2.mul(cy).sub(c2.mul(sy)), "sin(2x − y)");
            assert_ne!(x, Sampler::new(&g, &[double]).at(point)[0]);
            assert_ne!(x, sampler.at(point + 5)[6], "another point, another value");
        }
    }

    #[test]
    fn symbols_can_be_given_values() {
        let mut g = Graph::new();
        let (x, m) = (g.symbol(Symbol::Rate(0)), g.symbol(Symbol::Parameter(0)));
        let square = g.mul(x, x);
        let product = g.mul(m, square);
        let sampler = Sampler::new(&g, &[product]);
        let zero =
            sampler.with(&mut |s| if s == Symbol::Rate(0) { Fingerprint::ZERO } else { Fingerprint::ONE });
        assert_eq!(zero, [Fingerprint::ZERO]);
    }
}
