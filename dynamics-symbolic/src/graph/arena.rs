//! The arena: hash-consing by fingerprint. The only place that creates ids.

use core::hash::{BuildHasherDefault, Hasher};
use std::collections::HashMap;

use super::fingerprint::{Circle, Fingerprint};
use super::{Dependence, Node, NodeId, Number, Unary};

/// A hasher for keys that are random already or small and dense: one multiplication per word.
#[derive(Clone, Copy, Debug, Default)]
struct Multiply(u64);

impl Hasher for Multiply {
    fn finish(&self) -> u64 {
        self.0
    }
    fn write(&mut self, bytes: &[u8]) {
        bytes.iter().for_each(|b| self.write_u64(u64::from(*b)));
    }
    fn write_u32(&mut self, x: u32) {
        self.write_u64(x.into());
    }
    fn write_u64(&mut self, x: u64) {
        self.0 = (self.0.rotate_left(26) ^ x).wrapping_mul(0x9e37_79b9_7f4a_7c15);
    }
    fn write_usize(&mut self, x: usize) {
        self.write_u64(x as u64);
    }
}

/// A hash map that cannot be iterated, so that no result depends on its order.
#[derive(Clone, Debug)]
pub(super) struct Lookup<K, V>(HashMap<K, V, BuildHasherDefault<Multiply>>);

impl<K: Eq + core::hash::Hash, V: Copy> Lookup<K, V> {
    fn new() -> Self {
        Self(HashMap::default())
    }
    pub(super) fn get(&self, key: &K) -> Option<V> {
        self.0.get(key).copied()
    }
    pub(super) fn insert(&mut self, key: K, value: V) {
        self.0.insert(key, value);
    }
}

/// The expression graph.
#[derive(Clone, Debug)]
pub struct Graph {
    nodes: Vec<Node>,
    fingerprints: Vec<Fingerprint>,
    dependences: Vec<Dependence>,
    monomials: Vec<bool>,
    by_value: Lookup<Fingerprint, NodeId>,
    /// Nodes that stand for no value at present, by id.
    hidden: Vec<bool>,
    pub(super) circles: Lookup<NodeId, Circle>,
}

impl Default for Graph {
    fn default() -> Self {
        Self::new()
    }
}

impl Graph {
    /// The first two nodes of every graph.
    pub(super) const ZERO: NodeId = NodeId(0);
    pub(super) const ONE: NodeId = NodeId(1);

    /// A graph that holds the small numbers, so that expressions with such a value are recognised.
    #[must_use]
    pub fn new() -> Self {
        let mut graph = Self {
            nodes: Vec::new(),
            fingerprints: Vec::new(),
            dependences: Vec::new(),
            monomials: Vec::new(),
            by_value: Lookup::new(),
            hidden: Vec::new(),
            circles: Lookup::new(),
        };
        for (n, d) in [(0, 1), (1, 1), (2, 1), (1, 2), (3, 1), (4, 1), (1, 4), (1, 3)] {
            graph.number(Number::ratio(n, d));
        }
        graph
    }

    /// Number of nodes.
    #[must_use]
    pub fn len(&self) -> usize {
        self.nodes.len()
    }

    /// Whether it holds no node; never so in practice, as the small numbers are always there.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.nodes.is_empty()
    }

    /// The operation of a node.
    #[must_use]
    pub fn node(&self, id: NodeId) -> Node {
        self.nodes[id.index()]
    }

    /// The value of a node at the random points.
    #[must_use]
    pub fn fingerprint(&self, id: NodeId) -> Fingerprint {
        self.fingerprints[id.index()]
    }

    /// What a node depends on.
    #[must_use]
    pub fn dependence(&self, id: NodeId) -> Dependence {
        self.dependences[id.index()]
    }

    /// All ids in order of creation, children before parents.
    pub fn ids(&self) -> impl DoubleEndedIterator<Item = NodeId> + ExactSizeIterator + use<> {
        (0..self.nodes.len() as u32).map(NodeId)
    }

    /// Number of operations that evaluating `roots` takes once what depends on parameters alone is there.
    #[must_use]
    pub fn operations(&self, roots: &[NodeId]) -> usize {
        let works = |id: &NodeId| {
            !self.dependence(*id).within(Dependence::PARAMETERS) && self.node(*id).children().next().is_some()
        };
        self.cone(roots).iter().filter(|id| works(id)).count()
    }

    /// About how long evaluating `roots` takes, in products: like [`Graph::operations`], with a division or
    /// root as a handful of them.
    #[must_use]
    pub fn weight(&self, roots: &[NodeId]) -> usize {
        let of = |id: &NodeId| match self.node(*id) {
            _ if self.dependence(*id).within(Dependence::PARAMETERS) => 0,
            Node::Div(..) | Node::Unary(Unary::Sqrt, _) => 5,
            node => usize::from(node.children().next().is_some()),
        };
        self.cone(roots).iter().map(of).sum()
    }

    /// Runs `work` while no node stands for its value but `kept`, symbols, functions of one variable of
    /// these, and what depends on parameters alone: what is built then is a new form of what is there
    /// already, and stands for it from then on. A function has no other form, and sines and cosines of an
    /// angle, like the orders of a smooth function, are evaluated together: there must be one node of each;
    /// so of symbols, or a gradient by one would miss what reads the other.
    pub(crate) fn afresh<T>(&mut self, kept: &[NodeId], work: impl FnOnce(&mut Self) -> T) -> T {
        let constant = |id: NodeId| self.dependence(id).within(Dependence::PARAMETERS);
        let mut hidden: Vec<bool> = self.ids().map(|id| !constant(id)).collect();
        kept.iter().for_each(|id| hidden[id.index()] = false);
        for id in self.ids() {
            match self.node(id) {
                Node::Symbol(_) => hidden[id.index()] = false,
                Node::Unary(_, argument) | Node::Smooth { argument, .. } => {
                    hidden[id.index()] &= hidden[argument.index()]
                }
                _ => {}
            }
        }
        self.hidden = hidden;
        let result = work(self);
        self.hidden = Vec::new();
        result
    }

    fn dependence_of(&self, node: &Node) -> Dependence {
        let own = match node {
            Node::Symbol(s) => Dependence::of(*s),
            Node::Smooth { .. } => Dependence::PARAMETERS,
            _ => Dependence::NONE,
        };
        node.children().fold(own, |d, c| d.with(self.dependence(c)))
    }

    /// Whether no sum has to be formed to evaluate an operation, arguments of functions aside: then nothing
    /// can cancel.
    fn is_monomial(&self, node: &Node) -> bool {
        match node {
            Node::Add(..) | Node::Sub(..) => false,
            Node::Mul(a, b) | Node::Div(a, b) => self.monomials[a.index()] && self.monomials[b.index()],
            Node::Neg(a) => self.monomials[a.index()],
            _ => true,
        }
    }

    fn is_choice(&self, node: &Node) -> bool {
        let chosen = |node: &Node| matches!(node, Node::Select { .. });
        chosen(node) || matches!(node, Node::Neg(a) if chosen(&self.node(*a)))
    }

    /// The node that already stands for the value of `node`, if it serves as well. It does not
    /// - where it contains sums and `node` does not: 1 − cos² must never stand for sin²;
    /// - where it is made of more kinds of symbols: q̈ − q̈ + q must never stand for q;
    /// - where `node` is a number and it is not;
    /// - where `node` is a choice and the other is not: 0 · NaN of the branch that is not taken must never
    ///   stand for 0.
    ///   for 0.
    pub(super) fn known(&self, node: &Node, fingerprint: Fingerprint) -> Option<NodeId> {
        let known =
            self.by_value.get(&fingerprint).filter(|id| self.hidden.get(id.index()) != Some(&true))?;
        let is_number = |node: &Node| matches!(node, Node::Number(_));
        let serves = (self.monomials[known.index()] || !self.is_monomial(node))
            && self.dependence(known).within(self.dependence_of(node))
            && (is_number(&self.node(known)) || !is_number(node))
            && (self.is_choice(&self.node(known)) || !self.is_choice(node));
        serves.then_some(known)
    }

    /// The node with this value; `node` where there is none yet that serves as well.
    pub(super) fn intern(&mut self, node: Node, fingerprint: Fingerprint) -> NodeId {
        if let Some(known) = self.known(&node, fingerprint) {
            return known;
        }
        if let Some(opposite) = self.known(&node, fingerprint.neg())
            && !matches!(node, Node::Neg(_) | Node::Number(_))
        {
            let opposite = match self.node(opposite) {
                Node::Number(n) => Node::Number(n.opposite()),
                _ => Node::Neg(opposite),
            };
            return self.push(opposite, fingerprint);
        }
        self.push(node, fingerprint)
    }

    fn push(&mut self, node: Node, fingerprint: Fingerprint) -> NodeId {
        let id =
            NodeId(u32::try_from(self.nodes.len()).expect("a graph of 2³² nodes does not fit into memory"));
        let dependence = self.dependence_of(&node);
        self.monomials.push(self.is_monomial(&node));
        self.nodes.push(node);
        self.fingerprints.push(fingerprint);
        self.dependences.push(dependence);
        self.by_value.insert(fingerprint, id);
        id
    }
}
