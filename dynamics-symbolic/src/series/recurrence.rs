//! Coefficients of order k ≥ 1 of every operation.
//!
//! With ⟨a, b⟩ = Σ aⱼ bₖ₋ⱼ over j = 1 … k−1 (a lane) and a′ⱼ = j aⱼ (a weighted left factor):
//!
//! | c | coefficient k |
//! |---|---|
//! | a b | a₀ bₖ + aₖ b₀ + ⟨a, b⟩ |
//! | a² | 2a₀ aₖ + ⟨a, a⟩ |
//! | a / b | (aₖ − c₀ bₖ − ⟨c, b⟩) / b₀ |
//! | √a | (aₖ − ⟨c, c⟩) / 2c₀ |
//! | c′ = g a′ | aₖ g₀ + ⟨a′, g⟩ / k |
//! | c′ b = a′ | (aₖ − ⟨c′, b⟩ / k) / b₀ |
//! | aᵖ | (p (aₖ c₀ + ⟨a′, c⟩ / k) − ⟨c′, a⟩ / k) / a₀ |

use std::collections::{BTreeMap, BTreeSet};

use crate::algebra::Elsewhere;
use crate::graph::{Binary, Comparison, Dependence, Graph, Node, NodeId, Number, Symbol, Unary};

use super::Unexpandable;

/// A Cauchy sum without its first and last term.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) struct Lane {
    /// Left factor, a node of the base graph.
    pub(super) left: NodeId,
    /// Its coefficients times their order.
    pub(super) weighted: bool,
    /// Right factor.
    pub(super) right: NodeId,
}

/// From nodes of a base graph to nodes of another that are their coefficients of order k.
pub(super) struct Expansion<'a> {
    /// What is expanded.
    pub(super) base: &'a mut Graph,
    /// Coefficients of order k.
    pub(super) order: Graph,
    /// Nodes of `base` whose values at order 0 are `Parameter(i)` of `order`.
    pub(super) kept: Vec<NodeId>,
    /// Whether some value is a choice.
    pub(super) chooses: bool,
    /// Whether sums of products of sines and cosines are written as those of one angle.
    pub(super) one_angle: bool,
    kept_as: BTreeMap<NodeId, u32>,
    coefficients: BTreeMap<NodeId, NodeId>,
    lanes: Vec<Lane>,
    lanes_as: BTreeMap<Lane, NodeId>,
    /// Nodes of `base` whose coefficients of order k another expansion has computed before.
    early: BTreeSet<NodeId>,
    /// Those of them that this one reads: coefficient k of the i-th is the symbol `Mode(i)`.
    pub(super) read: Vec<NodeId>,
}

/// An expansion without the graph that it expands, while another one of that graph is made.
pub(super) struct DetachedExpansion {
    order: Graph,
    /// Values at order 0, of which the other one keeps more.
    kept: Vec<NodeId>,
    kept_as: BTreeMap<NodeId, u32>,
    coefficients: BTreeMap<NodeId, NodeId>,
    lanes: Vec<Lane>,
    lanes_as: BTreeMap<Lane, NodeId>,
    chooses: bool,
}

impl DetachedExpansion {
    /// The expansion again. All coefficients that are read from it have to be computed already.
    pub(super) fn resume(self, base: &mut Graph) -> Expansion<'_> {
        let Self { order, kept, kept_as, coefficients, lanes, lanes_as, chooses } = self;
        Expansion { order, kept, kept_as, coefficients, lanes, lanes_as, chooses, ..Expansion::new(base) }
    }
}

impl Elsewhere for Expansion<'_> {
    fn graph(&mut self) -> &mut Graph {
        &mut self.order
    }
    fn carry(&mut self, id: NodeId) -> NodeId {
        self.kept(id)
    }
}

impl<'a> Expansion<'a> {
    pub(super) fn new(base: &'a mut Graph) -> Self {
        Self {
            base,
            order: Graph::new(),
            kept: Vec::new(),
            chooses: false,
            one_angle: true,
            kept_as: BTreeMap::new(),
            coefficients: BTreeMap::new(),
            lanes: Vec::new(),
            lanes_as: BTreeMap::new(),
            early: BTreeSet::new(),
            read: Vec::new(),
        }
    }

    /// An expansion that reads what another one has computed.
    pub(super) fn after(base: &'a mut Graph, other: &DetachedExpansion) -> Self {
        let early = other.coefficients.keys().copied();
        // What is given, and what does not change, is at hand.
        let early =
            early.filter(|id| !matches!(base.node(*id), Node::Symbol(_)) && !held(base, *id)).collect();
        let (kept, kept_as) = (other.kept.clone(), other.kept_as.clone());
        Self { kept, kept_as, early, chooses: other.chooses, ..Self::new(base) }
    }

    /// What is left for others.
    pub(super) fn leave(self) -> DetachedExpansion {
        let Self { order, kept, kept_as, coefficients, lanes, lanes_as, chooses, .. } = self;
        DetachedExpansion { order, kept, kept_as, coefficients, lanes, lanes_as, chooses }
    }

    /// The lanes so far.
    pub(super) fn lanes(&self) -> &[Lane] {
        &self.lanes
    }

    /// Whether a value does not change along a motion.
    pub(super) fn is_constant(&self, id: NodeId) -> bool {
        held(self.base, id)
    }

    /// The value at order 0.
    pub(super) fn kept(&mut self, id: NodeId) -> NodeId {
        if let Some(number) = self.base.as_number(id) {
            return self.order.number(number);
        }
        let next = self.kept.len() as u32;
        let place = *self.kept_as.entry(id).or_insert(next);
        if place == next {
            self.kept.push(id);
        }
        self.order.symbol(Symbol::Parameter(place))
    }

    /// 1/x at order 0.
    fn kept_reciprocal(&mut self, id: NodeId) -> NodeId {
        let one = self.base.one();
        let reciprocal =
            self.base.div(one, id).expect("what an existing node divides by is not identically zero");
        self.kept(reciprocal)
    }

    /// Says what the coefficient of a node is.
    pub(super) fn know(&mut self, id: NodeId, coefficient: NodeId) {
        self.coefficients.insert(id, coefficient);
    }

    /// ⟨left, right⟩.
    pub(super) fn lane(&mut self, left: NodeId, right: NodeId) -> NodeId {
        self.sum(Lane { left: left.min(right), weighted: false, right: left.max(right) })
    }

    /// ⟨left′, right⟩ / k.
    fn lane_of_slope(&mut self, left: NodeId, right: NodeId) -> NodeId {
        let sum = self.sum(Lane { left, weighted: true, right });
        let reciprocal = self.order.symbol(Symbol::Input(1));
        self.order.mul_as_is(reciprocal, sum)
    }

    fn sum(&mut self, lane: Lane) -> NodeId {
        if self.is_constant(lane.left) || self.is_constant(lane.right) {
            return self.order.zero();
        }
        if let Some(known) = self.lanes_as.get(&lane) {
            return *known;
        }
        let symbol = self.order.symbol(Symbol::Multiplier(self.lanes.len() as u32));
        self.lanes.push(lane);
        self.lanes_as.insert(lane, symbol);
        symbol
    }

    /// k times the coefficient.
    pub(super) fn weighted(&mut self, id: NodeId) -> Result<NodeId, Unexpandable> {
        let coefficient = self.coefficient(id)?;
        let k = self.order.symbol(Symbol::Input(0));
        Ok(self.order.mul_as_is(k, coefficient))
    }

    /// The coefficient of order k of a node.
    pub(super) fn coefficient(&mut self, root: NodeId) -> Result<NodeId, Unexpandable> {
        if let Some(known) = self.coefficients.get(&root) {
            return Ok(*known);
        }
        if self.early.contains(&root) {
            let symbol = self.order.symbol(Symbol::Mode(self.read.len() as u32));
            self.read.push(root);
            self.coefficients.insert(root, symbol);
            return Ok(symbol);
        }
        // Children come first, so that what an operation needs of its arguments is there and nothing recurs
        // deeply.
        for id in self.base.cone(&[root]) {
            if !self.coefficients.contains_key(&id) && !self.early.contains(&id) {
                let coefficient = if self.is_constant(id) { self.order.zero() } else { self.recurrence(id)? };
                self.coefficients.insert(id, coefficient);
            }
        }
        Ok(self.coefficients[&root])
    }

    fn recurrence(&mut self, id: NodeId) -> Result<NodeId, Unexpandable> {
        Ok(match self.base.node(id) {
            Node::Number(_) => self.order.zero(),
            Node::Symbol(symbol) => self.order.symbol(symbol),
            node @ (Node::Add(a, b) | Node::Sub(a, b)) => {
                if let Some(coefficient) = self.of_one_angle(id, a, b)? {
                    return Ok(coefficient);
                }
                let (a, b) = (self.coefficient(a)?, self.coefficient(b)?);
                if matches!(node, Node::Add(..)) { self.order.add(a, b) } else { self.order.sub(a, b) }
            }
            Node::Neg(a) => {
                let a = self.coefficient(a)?;
                self.order.neg(a)
            }
            Node::Mul(a, b) => self.product(a, b)?,
            Node::Div(a, b) => self.quotient(id, a, b)?,
            Node::Unary(f, a) => self.unary(f, id, a)?,
            Node::Binary(f, a, b) => self.binary(f, id, a, b)?,
            Node::Select { comparison, left, right, then, otherwise } => {
                self.choice(comparison, [left, right], [then, otherwise])?
            }
            Node::Smooth { function, .. } => return Err(Unexpandable::Smooth(function)),
        })
    }

    /// early + late: what is known from orders before first, so that nothing but one fused operation waits
    /// for what is new.
    fn late(&mut self, early: NodeId, late: NodeId) -> NodeId {
        let plain = |g: &Graph, id| !g.is_zero(id) && !matches!(g.node(id), Node::Neg(_) | Node::Number(_));
        if plain(&self.order, early) && plain(&self.order, late) {
            self.order.add_exactly(early, late)
        } else {
            self.order.add(early, late)
        }
    }

    fn product(&mut self, a: NodeId, b: NodeId) -> Result<NodeId, Unexpandable> {
        let (of_a, of_b) = (self.coefficient(a)?, self.coefficient(b)?);
        let inner = self.lane(a, b);
        if a == b {
            // 2 a₀ aₖ: one fused operation waits for what is new.
            let double = self.base.add(a, a);
            let double = self.kept(double);
            let outer = self.order.mul_as_is(double, of_a);
            return Ok(self.late(inner, outer));
        }
        let (a0, b0) = (self.kept(a), self.kept(b));
        let (first, last) = (self.order.mul_as_is(a0, of_b), self.order.mul_as_is(of_a, b0));
        let sum = self.late(inner, first);
        Ok(self.late(sum, last))
    }

    fn quotient(&mut self, id: NodeId, a: NodeId, b: NodeId) -> Result<NodeId, Unexpandable> {
        let (of_a, of_b) = (self.coefficient(a)?, self.coefficient(b)?);
        let (c0, inner) = (self.kept(id), self.lane(id, b));
        let known = self.order.mul_as_is(c0, of_b);
        let rest = self.order.sub(of_a, inner);
        let above = self.order.sub(rest, known);
        let reciprocal = self.kept_reciprocal(b);
        Ok(self.order.mul_as_is(above, reciprocal))
    }

    /// The coefficient of sin a cos b ± cos a sin b or cos a cos b ∓ sin a sin b as that of a sine or cosine
    /// of one angle: two lanes instead of four for the pair of them.
    fn of_one_angle(&mut self, id: NodeId, x: NodeId, y: NodeId) -> Result<Option<NodeId>, Unexpandable> {
        if !self.one_angle {
            return Ok(None);
        }
        let Some([(f, a), (g, b)]) = self.circular_factors(x) else { return Ok(None) };
        let Some(other) = self.circular_factors(y) else { return Ok(None) };
        let opposite = |f| if f == Unary::Sin { Unary::Cos } else { Unary::Sin };
        let pair = [(opposite(f), a), (opposite(g), b)];
        if other != pair && other != [pair[1], pair[0]] {
            return Ok(None);
        }
        let whole = if f == g { Unary::Cos } else { Unary::Sin };
        for (sum, first, second) in [(true, a, b), (false, a, b), (false, b, a)] {
            let angle = if sum { self.base.add(first, second) } else { self.base.sub(first, second) };
            let found = self.base.unary(whole, angle);
            if self.base.fingerprint(found) == self.base.fingerprint(id) {
                let known = found != id && !self.is_constant(found);
                return if known { self.coefficient(found) } else { self.unary(whole, id, angle) }.map(Some);
            }
        }
        Ok(None)
    }

    /// The factors of a product of two sines or cosines, with their angles.
    fn circular_factors(&self, id: NodeId) -> Option<[(Unary, NodeId); 2]> {
        let Node::Mul(a, b) = self.base.node(id) else { return None };
        let circular = |id| match self.base.node(id) {
            Node::Unary(f @ (Unary::Sin | Unary::Cos), angle) => Some((f, angle)),
            _ => None,
        };
        Some([circular(a)?, circular(b)?])
    }

    /// c with c′ = g a′.
    fn integral(&mut self, g: NodeId, a: NodeId) -> Result<NodeId, Unexpandable> {
        let (of_a, g0) = (self.coefficient(a)?, self.kept(g));
        let (last, inner) = (self.order.mul_as_is(of_a, g0), self.lane_of_slope(a, g));
        Ok(self.late(inner, last))
    }

    /// c with c′ b = r′, rₖ given.
    fn divided_integral(&mut self, id: NodeId, of_r: NodeId, b: NodeId) -> NodeId {
        let (inner, reciprocal) = (self.lane_of_slope(id, b), self.kept_reciprocal(b));
        let rest = self.order.sub(of_r, inner);
        self.order.mul_as_is(rest, reciprocal)
    }

    /// √s.
    fn root(&mut self, id: NodeId, s: NodeId) -> Result<NodeId, Unexpandable> {
        let (of_s, inner) = (self.coefficient(s)?, self.lane(id, id));
        let rest = self.order.sub(of_s, inner);
        let twice = self.base.add(id, id);
        let reciprocal = self.kept_reciprocal(twice);
        let coefficient = self.order.mul_as_is(rest, reciprocal);
        self.at_rest(s, coefficient)
    }

    /// aᵖ for a constant p, given at order 0.
    fn power(&mut self, id: NodeId, a: NodeId, p: NodeId) -> Result<NodeId, Unexpandable> {
        let grown = self.integral(id, a)?;
        let grown = self.order.mul_as_is(p, grown);
        let coefficient = self.divided_integral(id, grown, a);
        self.at_rest(a, coefficient)
    }

    /// 0, where `a` may be on a branch on which it is 0 and stays 0: max(−x, 0)^1.5 out of contact. Where it
    /// is 0 and does not stay so, there is no series, and what divides by it is not finite.
    fn at_rest(&mut self, a: NodeId, coefficient: NodeId) -> Result<NodeId, Unexpandable> {
        if !self.base.cone(&[a]).into_iter().any(|id| self.is_choice(id)) {
            return Ok(coefficient);
        }
        let (of_a, a0, zero) = (self.coefficient(a)?, self.kept(a), self.order.zero());
        let rest = self.order.select(Comparison::Equal, of_a, zero, zero, coefficient);
        Ok(self.order.select(Comparison::Equal, a0, zero, rest, coefficient))
    }

    fn is_choice(&self, id: NodeId) -> bool {
        matches!(
            self.base.node(id),
            Node::Select { .. } | Node::Unary(Unary::Abs, _) | Node::Binary(Binary::Min | Binary::Max, ..)
        )
    }

    fn unary(&mut self, f: Unary, id: NodeId, a: NodeId) -> Result<NodeId, Unexpandable> {
        let one = self.base.one();
        match f {
            Unary::Sin => {
                let cos = self.base.unary(Unary::Cos, a);
                self.integral(cos, a)
            }
            Unary::Cos => {
                let sin = self.base.unary(Unary::Sin, a);
                let slope = self.integral(sin, a)?;
                Ok(self.order.neg(slope))
            }
            Unary::Sinh => {
                let cosh = self.base.unary(Unary::Cosh, a);
                self.integral(cosh, a)
            }
            Unary::Cosh => {
                let sinh = self.base.unary(Unary::Sinh, a);
                self.integral(sinh, a)
            }
            Unary::Exp => self.integral(id, a),
            Unary::Tan | Unary::Tanh => {
                let square = self.base.mul(id, id);
                let slope =
                    if f == Unary::Tan { self.base.add(one, square) } else { self.base.sub(one, square) };
                self.integral(slope, a)
            }
            Unary::Ln => {
                let of_a = self.coefficient(a)?;
                Ok(self.divided_integral(id, of_a, a))
            }
            Unary::Atan => {
                let square = self.base.mul(a, a);
                let below = self.base.add(one, square);
                let of_a = self.coefficient(a)?;
                Ok(self.divided_integral(id, of_a, below))
            }
            Unary::Asin | Unary::Acos => {
                let (low, high) = (self.base.sub(one, a), self.base.add(one, a));
                let product = self.base.mul(low, high);
                let below = self.base.unary(Unary::Sqrt, product);
                let of_a = self.coefficient(a)?;
                let of_r = if f == Unary::Asin { of_a } else { self.order.neg(of_a) };
                Ok(self.divided_integral(id, of_r, below))
            }
            Unary::Sqrt => self.root(id, a),
            Unary::Cbrt => {
                let third = self.order.number(Number::ratio(1, 3));
                self.power(id, a, third)
            }
            Unary::Abs => {
                self.chooses = true;
                let sign = self.base.unary(Unary::Signum, a);
                let (of_a, sign) = (self.coefficient(a)?, self.kept(sign));
                Ok(self.order.mul_as_is(of_a, sign))
            }
            Unary::Signum => {
                self.chooses = true;
                Ok(self.order.zero())
            }
        }
    }

    fn binary(&mut self, f: Binary, id: NodeId, a: NodeId, b: NodeId) -> Result<NodeId, Unexpandable> {
        match f {
            Binary::Powf if self.is_constant(b) => {
                let p = self.kept(b);
                self.power(id, a, p)
            }
            Binary::Powf => {
                let ln = self.base.unary(Unary::Ln, a);
                let exponent = self.base.mul(b, ln);
                self.integral(id, exponent)
            }
            Binary::Hypot => {
                let squares = self.squares(a, b);
                self.root(id, squares)
            }
            // (x² + y²) c′ = x y′ − y x′.
            Binary::Atan2 => {
                // Across its cut the value of order 0 is another one.
                self.chooses = true;
                let below = self.squares(a, b);
                let (up, down) = (self.integral(b, a)?, self.integral(a, b)?);
                let of_r = self.order.sub(up, down);
                Ok(self.divided_integral(id, of_r, below))
            }
            Binary::Min => self.choice(Comparison::LessEqual, [a, b], [a, b]),
            Binary::Max => self.choice(Comparison::LessEqual, [b, a], [a, b]),
        }
    }

    fn squares(&mut self, a: NodeId, b: NodeId) -> NodeId {
        let (a, b) = (self.base.mul(a, a), self.base.mul(b, b));
        self.base.add(a, b)
    }

    /// The branch taken at order 0.
    fn choice(
        &mut self,
        by: Comparison,
        compared: [NodeId; 2],
        branches: [NodeId; 2],
    ) -> Result<NodeId, Unexpandable> {
        self.chooses = true;
        // Decided once, where a state can hold it.
        let (one, zero) = (self.base.one(), self.base.zero());
        let decision = self.base.select(by, compared[0], compared[1], one, zero);
        let decision = self.kept(decision);
        let (then, otherwise) = (self.coefficient(branches[0])?, self.coefficient(branches[1])?);
        let zero = self.order.zero();
        Ok(self.order.select(Comparison::Less, zero, decision, then, otherwise))
    }
}

/// Whether a value does not change along a motion.
fn held(g: &Graph, id: NodeId) -> bool {
    g.dependence(id).within(Dependence::PARAMETERS.with(Dependence::INPUTS).with(Dependence::MODES))
}
