//! Values by node.

use super::{Graph, NodeId};

/// A cone is small where it is less than this part of the nodes before its last one: then it is found and
/// indexed without looking at all of them. Sweeps of single rows of large models are.
const SMALL_PART: usize = 16;

/// A value for every node of a cone.
#[derive(Clone, Debug)]
pub(crate) struct NodeMap<T> {
    /// The nodes, ascending, where values stand in their order; empty where values stand by node.
    ids: Vec<NodeId>,
    values: Vec<T>,
    default: T,
}

impl<T: Copy> NodeMap<T> {
    /// For the nodes `ids`, ascending, all with the same value at first.
    pub(crate) fn new(ids: &[NodeId], default: T) -> Self {
        let end = ids.last().map_or(0, |id| id.index() + 1);
        if SMALL_PART * ids.len() < end {
            Self { ids: ids.to_vec(), values: vec![default; ids.len()], default }
        } else {
            Self { ids: Vec::new(), values: vec![default; end], default }
        }
    }

    fn place(&self, id: NodeId) -> Option<usize> {
        if self.ids.is_empty() {
            (id.index() < self.values.len()).then_some(id.index())
        } else {
            self.ids.binary_search(&id).ok()
        }
    }

    /// The value of a node; that of all at first for nodes that are not of the cone.
    pub(crate) fn get(&self, id: NodeId) -> T {
        self.place(id).map_or(self.default, |place| self.values[place])
    }

    /// Sets the value of a node of the cone.
    pub(crate) fn set(&mut self, id: NodeId, value: T) {
        if let Some(place) = self.place(id) {
            self.values[place] = value;
        }
    }
}

impl Graph {
    /// What `roots` are made of, themselves included, children before parents.
    #[must_use]
    pub fn cone(&self, roots: &[NodeId]) -> Vec<NodeId> {
        self.small_cone(roots).unwrap_or_else(|| self.large_cone(roots))
    }

    /// From the roots down; `None` where the cone is not small.
    fn small_cone(&self, roots: &[NodeId]) -> Option<Vec<NodeId>> {
        let end = roots.iter().map(|r| r.index() + 1).max().unwrap_or(0);
        let most = end / SMALL_PART;
        if roots.len() > most {
            return None;
        }
        let mut waiting: std::collections::BinaryHeap<NodeId> = roots.iter().copied().collect();
        let mut found: Vec<NodeId> = Vec::new();
        while let Some(id) = waiting.pop() {
            if found.last() == Some(&id) {
                continue;
            }
            if found.len() == most {
                return None;
            }
            found.push(id);
            waiting.extend(self.node(id).children());
        }
        found.reverse();
        Some(found)
    }

    fn large_cone(&self, roots: &[NodeId]) -> Vec<NodeId> {
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
}

#[cfg(test)]
mod tests {
    use super::{Graph, NodeId, NodeMap};
    use crate::graph::Symbol;

    /// A long sum, and a few products of its first terms at its end.
    fn graph() -> (Graph, Vec<NodeId>, NodeId) {
        let mut g = Graph::new();
        let symbols: Vec<NodeId> = (0..400).map(|i| g.symbol(Symbol::Coordinate(i))).collect();
        let sum = symbols.iter().fold(g.zero(), |sum, x| g.add(sum, *x));
        let (square, product) = (g.mul(symbols[0], symbols[0]), g.mul(symbols[1], symbols[2]));
        let few = [square, product, g.add(square, product), symbols[399]];
        (g, few.to_vec(), sum)
    }

    #[test]
    fn small_cones_are_those_that_a_scan_finds() {
        let (g, few, sum) = graph();
        let small = g.small_cone(&few).expect("seven of eight hundred");
        assert_eq!(small, g.large_cone(&few));
        assert_eq!(g.small_cone(&[sum]), None);
        assert_eq!(g.cone(&[sum]).len(), 799);
        assert_eq!(g.cone(&[]), []);
    }

    #[test]
    fn values_are_found_by_node_in_small_and_large_cones() {
        let (g, few, sum) = graph();
        for roots in [few, vec![sum]] {
            let ids = g.cone(&roots);
            let mut map = NodeMap::new(&ids, 0);
            ids.iter().enumerate().for_each(|(i, id)| map.set(*id, i + 1));
            assert!(ids.iter().enumerate().all(|(i, id)| map.get(*id) == i + 1));
            let other = g.ids().find(|id| !ids.contains(id)).expect("there are others");
            assert_eq!(map.get(other), 0);
        }
    }
}
