//! Products and sums are rebuilt so that they share parts: p·(c·u²) beside (p·c) costs one product less
//! as (p·c)·u². Chains of products, and of sums, whose links nothing else reads are taken apart. The pair
//! that most chains contain becomes a node, as long as two chains contain it (as in Hosangadi, Fallah &
//! Kastner 2006, for two terms). The rest of a chain is combined in the order in which its parts are ready,
//! so that long chains do not wait for one another.

use std::collections::BTreeMap;

use crate::graph::{Graph, Node, NodeId, Unary};

use super::substitute::rebuild;

/// Most operations in which shared parts are searched. The search takes time with the square of their number.
const MOST_OPERATIONS: usize = 6000;

/// `roots` with the same values to rounding, in fewer operations where that is possible. What depends on
/// parameters alone stays as it is.
#[must_use]
pub fn share_parts(g: &mut Graph, roots: &[NodeId]) -> Vec<NodeId> {
    if g.operations(roots) > MOST_OPERATIONS {
        return roots.to_vec();
    }
    let before = g.weight(roots);
    // On a copy first: where nothing is gained, nothing is left behind.
    let chains = Chains::new(g, roots);
    let mut trial = g.clone();
    let found = chains.build(&mut trial, roots);
    if trial.weight(&found) >= before {
        return roots.to_vec();
    }
    *g = trial;
    found
}

/// A part of a chain: a node of the graph, or a pair of parts that became one.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
enum Part {
    Node(NodeId),
    Pair(usize),
}

/// What a chain does with its parts.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
enum Kind {
    Product,
    Sum,
}

/// Two parts that become one; of a sum the second may be subtracted.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
struct Pair {
    kind: Kind,
    opposite: bool,
    first: Part,
    second: Part,
}

/// A product or sum of parts with their signs (true: negative).
#[derive(Clone, Debug)]
struct Chain {
    kind: Kind,
    parts: Vec<(bool, Part)>,
}

/// All chains by the node that they stand for, and the pairs that they share.
struct Chains {
    chains: BTreeMap<NodeId, Chain>,
    pairs: Vec<Pair>,
    kept: Vec<NodeId>,
}

impl Chains {
    fn new(g: &mut Graph, roots: &[NodeId]) -> Self {
        let cone = g.cone(roots);
        let mut uses = vec![0u32; g.len()];
        roots.iter().for_each(|r| uses[r.index()] += 2);
        for id in &cone {
            g.node(*id).children().for_each(|c| uses[c.index()] += 1);
        }
        // A link is read once, by a link of its own kind.
        let mut inner = vec![false; g.len()];
        for id in &cone {
            let Some(kind) = kind(g, *id) else { continue };
            for child in g.node(*id).children() {
                inner[child.index()] |= self::kind(g, child) == Some(kind) && uses[child.index()] == 1;
            }
        }
        let mut chains = BTreeMap::new();
        let heads: Vec<NodeId> = cone.iter().copied().filter(|id| !inner[id.index()]).collect();
        for head in heads {
            if let Some(kind) = kind(g, head) {
                chains.insert(head, Chain::new(g, head, kind, &inner));
            }
        }
        let is_function = |id: &NodeId| match g.node(*id) {
            Node::Unary(f, _) => f != Unary::Sqrt,
            Node::Binary(..) | Node::Select { .. } | Node::Smooth { .. } => true,
            node => node.children().next().is_none(),
        };
        let functions: Vec<NodeId> = cone.iter().copied().filter(is_function).collect();
        let mut found = Self { chains, pairs: Vec::new(), kept: g.cone(&functions) };
        found.pair();
        found
    }

    /// Turns the pair that most chains contain into a part, until no two chains contain the same.
    fn pair(&mut self) {
        let mut count: BTreeMap<Pair, usize> = BTreeMap::new();
        self.chains
            .values()
            .for_each(|chain| chain.pairs().into_iter().for_each(|p| *count.entry(p).or_default() += 1));
        while let Some((best, _)) =
            count.iter().filter(|(_, n)| **n > 1).max_by_key(|(pair, n)| (**n, core::cmp::Reverse(**pair)))
        {
            let (best, name) = (*best, Part::Pair(self.pairs.len()));
            self.pairs.push(best);
            for chain in self.chains.values_mut().filter(|chain| chain.pairs().contains(&best)) {
                let mut change = |chain: &Chain, by: isize| {
                    for pair in chain.pairs() {
                        let n = count.entry(pair).or_default();
                        *n = n.saturating_add_signed(by);
                        if *n == 0 {
                            count.remove(&pair);
                        }
                    }
                };
                change(chain, -1);
                chain.replace(best, name);
                change(chain, 1);
            }
        }
    }

    fn build(&self, g: &mut Graph, roots: &[NodeId]) -> Vec<NodeId> {
        let source = g.clone();
        g.afresh(&self.kept, |g| {
            let mut building = Building {
                chains: self,
                new: BTreeMap::new(),
                pairs: vec![None; self.pairs.len()],
                depths: Vec::new(),
            };
            for id in source.cone(roots) {
                building.node(g, &source, id);
            }
            roots.iter().map(|r| building.new.get(r).copied().unwrap_or(*r)).collect()
        })
    }
}

fn kind(g: &Graph, id: NodeId) -> Option<Kind> {
    match g.node(id) {
        _ if g.is_constant(id) => None,
        Node::Mul(..) => Some(Kind::Product),
        Node::Add(..) | Node::Sub(..) => Some(Kind::Sum),
        _ => None,
    }
}

impl Chain {
    /// Takes a chain apart; its constants become one.
    fn new(g: &mut Graph, head: NodeId, kind: Kind, inner: &[bool]) -> Self {
        let mut parts = Vec::new();
        let mut constant = if kind == Kind::Product { g.one() } else { g.zero() };
        let mut stack = vec![(false, head)];
        while let Some((negative, id)) = stack.pop() {
            let link = id == head || inner[id.index()] && self::kind(g, id) == Some(kind);
            match g.node(id) {
                Node::Mul(a, b) if link => stack.extend([(false, b), (false, a)]),
                Node::Add(a, b) if link => stack.extend([(negative, b), (negative, a)]),
                Node::Sub(a, b) if link => stack.extend([(!negative, b), (negative, a)]),
                _ if g.is_constant(id) => {
                    constant = match kind {
                        Kind::Product => g.mul(constant, id),
                        Kind::Sum if negative => g.sub(constant, id),
                        Kind::Sum => g.add(constant, id),
                    }
                }
                _ => parts.push((negative, Part::Node(id))),
            }
        }
        let neutral = if kind == Kind::Product { g.is_one(constant) } else { g.is_zero(constant) };
        if !neutral {
            parts.push((false, Part::Node(constant)));
        }
        parts.sort_by_key(|(_, part)| *part);
        Self { kind, parts }
    }

    /// The pairs that can be formed, each once.
    fn pairs(&self) -> Vec<Pair> {
        let mut found = Vec::new();
        for (i, (a, first)) in self.parts.iter().enumerate() {
            for (b, second) in &self.parts[i + 1..] {
                found.push(Pair { kind: self.kind, opposite: a != b, first: *first, second: *second });
            }
        }
        found.sort_unstable();
        found.dedup();
        found
    }

    /// Replaces a pair as often as it is there.
    fn replace(&mut self, pair: Pair, name: Part) {
        loop {
            let pairs = (0..self.parts.len()).flat_map(|i| (i + 1..self.parts.len()).map(move |j| (i, j)));
            let found = pairs.into_iter().find(|(i, j)| {
                let ((a, first), (b, second)) = (self.parts[*i], self.parts[*j]);
                first == pair.first && second == pair.second && (a != b) == pair.opposite
            });
            let Some((i, j)) = found else { return };
            let sign = self.parts[i].0;
            self.parts.remove(j);
            self.parts[i] = (sign, name);
            self.parts.sort_by_key(|(_, part)| *part);
        }
    }
}

/// The new graph while it grows.
struct Building<'a> {
    chains: &'a Chains,
    new: BTreeMap<NodeId, NodeId>,
    pairs: Vec<Option<NodeId>>,
    /// How long each node takes from the symbols on, in additions.
    depths: Vec<u32>,
}

impl Building<'_> {
    fn node(&mut self, g: &mut Graph, source: &Graph, id: NodeId) {
        if g.is_constant(id) || self.chains.kept.binary_search(&id).is_ok() {
            self.new.insert(id, id);
            return;
        }
        let built = match self.chains.chains.get(&id) {
            Some(chain) => Some(self.chain(g, chain)),
            // Links are built with their chains.
            None if kind(source, id).is_some() => None,
            None => rebuild(g, source.node(id), &|c| self.new.get(&c).copied().unwrap_or(c)).ok(),
        };
        if let Some(built) = built {
            self.new.insert(id, built);
        }
    }

    fn part(&mut self, g: &mut Graph, part: Part) -> NodeId {
        match part {
            Part::Node(id) => self.new.get(&id).copied().unwrap_or(id),
            Part::Pair(at) => {
                if let Some(built) = self.pairs[at] {
                    return built;
                }
                let pair = self.chains.pairs[at];
                let chain =
                    Chain { kind: pair.kind, parts: vec![(false, pair.first), (pair.opposite, pair.second)] };
                let built = self.chain(g, &chain);
                self.pairs[at] = Some(built);
                built
            }
        }
    }

    /// Combines what is ready first.
    fn chain(&mut self, g: &mut Graph, chain: &Chain) -> NodeId {
        let mut parts: Vec<(u32, bool, NodeId)> = Vec::new();
        for (negative, part) in &chain.parts {
            let id = self.part(g, *part);
            parts.push((self.depth(g, id), *negative, id));
        }
        parts.sort_by_key(|(depth, ..)| *depth);
        while parts.len() > 1 {
            let second = parts.remove(1);
            let first = parts.remove(0);
            let (negative, id) = match (chain.kind, first.1, second.1) {
                (Kind::Product, ..) => (false, g.mul_exactly(first.2, second.2)),
                (Kind::Sum, a, b) if a == b => (a, g.add_exactly(first.2, second.2)),
                (Kind::Sum, true, _) => (false, g.sub_exactly(second.2, first.2)),
                (Kind::Sum, ..) => (false, g.sub_exactly(first.2, second.2)),
            };
            let depth = self.depth(g, id);
            let at = parts.iter().position(|(d, ..)| *d > depth).unwrap_or(parts.len());
            parts.insert(at, (depth, negative, id));
        }
        match parts.pop() {
            Some((_, true, id)) => g.neg(id),
            Some((_, false, id)) => id,
            None => g.zero(),
        }
    }

    fn depth(&mut self, g: &Graph, id: NodeId) -> u32 {
        for id in g.ids().skip(self.depths.len()) {
            let children = g.node(id).children().map(|c| self.depths[c.index()]).max().unwrap_or(0);
            let own = match g.node(id) {
                _ if g.is_constant(id) => 0,
                Node::Number(_) | Node::Symbol(_) => 0,
                Node::Neg(_) => children,
                Node::Add(..) | Node::Sub(..) | Node::Mul(..) => children + 1,
                Node::Div(..) | Node::Unary(Unary::Sqrt, _) => children + 4,
                _ => children + 12,
            };
            self.depths.push(own);
        }
        self.depths[id.index()]
    }
}
