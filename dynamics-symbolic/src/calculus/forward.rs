//! Forward sweep: directional derivatives.

use std::cmp::Reverse;
use std::collections::{BTreeMap, BinaryHeap};

use crate::graph::{Graph, Node, NodeId, NodeMap, Symbol};

use super::local::{BranchChoice, partials};

/// Derivatives of `roots` along the direction in which every symbol s moves with velocity `seed(s)` (`None`:
/// it does not move).
pub fn directional(
    g: &mut Graph,
    roots: &[NodeId],
    seed: &mut dyn FnMut(&mut Graph, Symbol) -> Option<NodeId>,
) -> Vec<NodeId> {
    let ids = g.cone(roots);
    let mut tangents = NodeMap::new(&ids, None);
    for id in ids {
        let tangent = match g.node(id) {
            Node::Symbol(s) => seed(g, s),
            _ => tangent(g, id, &|c| tangents.get(c)),
        };
        tangents.set(id, tangent);
    }
    let zero = g.zero();
    roots.iter().map(|r| tangents.get(*r).unwrap_or(zero)).collect()
}

/// The derivative of an operation whose arguments have these; `None` for zero.
fn tangent(g: &mut Graph, id: NodeId, of: &dyn Fn(NodeId) -> Option<NodeId>) -> Option<NodeId> {
    let node = g.node(id);
    if node.children().all(|c| of(c).is_none()) {
        return None;
    }
    if let Some(choice) = BranchChoice::of(node) {
        let zero = g.zero();
        let [then, otherwise] = [choice.then, choice.otherwise].map(|c| of(c).unwrap_or(zero));
        let chosen = choice.between(g, then, otherwise);
        return Some(chosen).filter(|s| !g.is_zero(*s));
    }
    let locals = partials(g, id, &|c| of(c).is_some());
    let mut sum: Option<NodeId> = None;
    for (child, partial) in locals {
        let Some(speed) = of(child) else { continue };
        let term = g.mul(partial, speed);
        sum = Some(match sum {
            Some(s) => g.add(s, term),
            None => term,
        });
    }
    sum.filter(|s| !g.is_zero(*s))
}

/// Derivatives of the same roots by one symbol after the other. Each sweep visits only what contains its
/// symbol, so that all together take time in proportion to the entries that are not zero.
pub struct ForwardSweeps {
    /// What the roots are made of, ascending.
    ids: Vec<NodeId>,
    /// The symbols among them, by place.
    symbols: BTreeMap<Symbol, u32>,
    /// Where the parents of each node begin in `parents`, in the order of `ids`; one more for the end.
    begin: Vec<u32>,
    /// Parents of all nodes, by place in `ids`.
    parents: Vec<u32>,
    /// (node, number of the root), ascending.
    roots: Vec<(NodeId, usize)>,
    /// Derivatives of the present sweep, by place; all `None` between sweeps.
    tangents: Vec<Option<NodeId>>,
}

impl ForwardSweeps {
    /// For derivatives of `roots`.
    #[must_use]
    pub fn new(g: &Graph, roots: &[NodeId]) -> Self {
        let ids = g.cone(roots);
        let symbol = |(place, id): (u32, &NodeId)| match g.node(*id) {
            Node::Symbol(s) => Some((s, place)),
            _ => None,
        };
        let symbols = (0u32..).zip(&ids).filter_map(symbol).collect();
        let mut places = NodeMap::new(&ids, 0u32);
        (0u32..).zip(&ids).for_each(|(place, id)| places.set(*id, place));
        let children = || ids.iter().map(|id| g.node(*id).children().map(|c| places.get(c) as usize));
        let mut begin = vec![0u32; ids.len() + 1];
        children().flatten().for_each(|child| begin[child + 1] += 1);
        for place in 0..ids.len() {
            begin[place + 1] += begin[place];
        }
        let mut next = begin.clone();
        let mut parents = vec![0u32; begin.last().map_or(0, |all| *all as usize)];
        for (parent, child) in (0u32..).zip(children()).flat_map(|(p, all)| all.map(move |c| (p, c))) {
            parents[next[child] as usize] = parent;
            next[child] += 1;
        }
        let mut numbered: Vec<(NodeId, usize)> = roots.iter().copied().zip(0..).collect();
        numbered.sort_unstable();
        let tangents = vec![None; ids.len()];
        Self { ids, symbols, begin, parents, roots: numbered, tangents }
    }

    /// The derivatives by a symbol that are not identically zero, with the numbers of their roots, ascending;
    /// what [`directional`] gives where this symbol alone moves, with velocity `seed`.
    pub fn along(&mut self, g: &mut Graph, symbol: Symbol, seed: NodeId) -> Vec<(usize, NodeId)> {
        let Some(&start) = self.symbols.get(&symbol) else { return Vec::new() };
        let mut waiting = BinaryHeap::from([Reverse(start)]);
        let mut visited: Vec<u32> = Vec::new();
        while let Some(Reverse(place)) = waiting.pop() {
            if visited.last() == Some(&place) {
                continue;
            }
            visited.push(place);
            let id = self.ids[place as usize];
            let of = |c: NodeId| self.ids.binary_search(&c).ok().and_then(|child| self.tangents[child]);
            let found = if place == start { Some(seed) } else { tangent(g, id, &of) };
            self.tangents[place as usize] = found;
            if found.is_some() {
                let parents = self.begin[place as usize] as usize..self.begin[place as usize + 1] as usize;
                waiting.extend(self.parents[parents].iter().copied().map(Reverse));
            }
        }
        let mut derivatives = Vec::new();
        for place in visited {
            let Some(tangent) = self.tangents[place as usize].take() else { continue };
            let id = self.ids[place as usize];
            let first = self.roots.partition_point(|(root, _)| *root < id);
            let all = self.roots[first..].iter().take_while(|(root, _)| *root == id);
            derivatives.extend(all.map(|(_, number)| (*number, tangent)));
        }
        derivatives.sort_unstable();
        derivatives
    }
}

#[cfg(test)]
mod tests {
    use super::{ForwardSweeps, Graph, NodeId, Symbol, directional};
    use crate::graph::{Binary, Unary};

    /// Single sweeps make the same nodes in the same order as sweeps over everything.
    #[test]
    fn sweeps_by_symbol_are_those_over_everything() {
        let mut g = Graph::new();
        let q: Vec<NodeId> = (0..40).map(|i| g.symbol(Symbol::Coordinate(i))).collect();
        let mut roots = Vec::new();
        for i in 1..q.len() {
            let gap = g.sub(q[i], q[i - 1]);
            let angle = g.mul(q[i], q[i - 1]);
            let (sine, bent) = (g.unary(Unary::Sin, angle), g.mul(gap, gap));
            let larger = g.binary(Binary::Max, sine, bent);
            roots.extend([g.mul(larger, q[0]), gap, bent]);
        }
        roots.push(roots[4]);
        let mut other = g.clone();
        let mut sweeps = ForwardSweeps::new(&g, &roots);
        for i in 0..41 {
            let x = Symbol::Coordinate(i);
            let minus = g.integer(-1);
            let found = sweeps.along(&mut g, x, minus);
            let all = directional(&mut other, &roots, &mut |g, s| (s == x).then(|| g.integer(-1)));
            let expected: Vec<(usize, NodeId)> =
                all.into_iter().enumerate().filter(|(_, d)| !other.is_zero(*d)).collect();
            assert_eq!(found, expected, "∂/∂q{i}");
        }
        assert_eq!(g.len(), other.len());
        assert!(other.ids().all(|id| format!("{:?}", g.node(id)) == format!("{:?}", other.node(id))));
    }
}
