//! The arena: hash-consing by fingerprint. The only place that creates ids.

use std::collections::HashMap;

use super::fingerprint::{Circle, Fingerprint};
use super::{Dependence, Node, NodeId, Number};

/// A hash map that cannot be iterated, so that no result depends on its order.
#[derive(Clone, Debug)]
pub(super) struct Lookup<K, V>(HashMap<K, V>);

impl<K: Eq + core::hash::Hash, V: Copy> Lookup<K, V> {
    fn new() -> Self {
        Self(HashMap::new())
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
    pub(super) circles: Lookup<NodeId, Circle>,
}

impl Default for Graph {
    fn default() -> Self {
        Self::new()
    }
}

impl Graph {
    /// A graph that holds the small numbers, so that expressions with such a value are recognised.
    #[must_use]
    pub fn new() -> Self {
        let mut graph = Self {
            nodes: Vec::new(),
            fingerprints: Vec::new(),
            dependences: Vec::new(),
            monomials: Vec::new(),
            by_value: Lookup::new(),
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

    /// What `roots` are made of, themselves included, children before parents.
    #[must_use]
    pub fn cone(&self, roots: &[NodeId]) -> Vec<NodeId> {
        let end = roots.iter().map(|r| r.index() + 1).max().unwrap_or(0);
        let mut needed = vec![false; end];
        for root in roots {
            needed[root.index()] = true;
        }
        let mut found = Vec::new();
        for id in self.ids().take(end).rev() {
            if needed[id.index()] {
                self.node(id).children().for_each(|c| needed[c.index()] = true);
                found.push(id);
            }
        }
        found.reverse();
        found
    }

    /// Number of operations that evaluating `roots` takes once what depends on parameters alone is there.
    #[must_use]
    pub fn operations(&self, roots: &[NodeId]) -> usize {
        let works = |id: &NodeId| {
            !self.dependence(*id).within(Dependence::PARAMETERS) && self.node(*id).children().next().is_some()
        };
        self.cone(roots).iter().filter(|id| works(id)).count()
    }

    /// The node with this value, if there is one.
    pub(super) fn find(&self, fingerprint: Fingerprint) -> Option<NodeId> {
        self.by_value.get(&fingerprint)
    }

    /// Whether no sum has to be formed to evaluate a node, arguments of functions aside: then nothing can cancel.
    pub(super) fn is_monomial(&self, id: NodeId) -> bool {
        self.monomials[id.index()]
    }

    fn makes_monomial(&self, node: &Node) -> bool {
        match node {
            Node::Add(..) | Node::Sub(..) => false,
            Node::Mul(a, b) | Node::Div(a, b) => self.is_monomial(*a) && self.is_monomial(*b),
            Node::Neg(a) => self.is_monomial(*a),
            _ => true,
        }
    }

    /// The node with this value; `node` where there is none yet.
    ///
    /// The first-built representative wins, with one exception: what contains sums is replaced, for later uses, by a form that cannot cancel
    /// (1 − cos² must never stand for sin²), and anything by a number.
    pub(super) fn intern(&mut self, node: Node, fingerprint: Fingerprint) -> NodeId {
        let safe = self.makes_monomial(&node);
        let is_number = |node: &Node| matches!(node, Node::Number(_));
        let good = |known: &NodeId| {
            (self.is_monomial(*known) || !safe) && (is_number(&self.node(*known)) || !is_number(&node))
        };
        if let Some(known) = self.find(fingerprint).filter(good) {
            return known;
        }
        if let Some(opposite) = self.find(fingerprint.neg()).filter(good)
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
        let id = NodeId(u32::try_from(self.nodes.len()).expect("a graph of 2³² nodes does not fit into memory"));
        let own = match node {
            Node::Symbol(s) => Dependence::of(s),
            Node::Smooth { .. } => Dependence::PARAMETERS,
            _ => Dependence::NONE,
        };
        let dependence = node.children().fold(own, |d, c| d.with(self.dependence(c)));
        self.monomials.push(self.makes_monomial(&node));
        self.nodes.push(node);
        self.fingerprints.push(fingerprint);
        self.dependences.push(dependence);
        self.by_value.insert(fingerprint, id);
        id
    }
}
