//! Loops: the smallest sets of holonomic rows that have to be solved together for as many coordinates, one
//! set after the other.
//!
//! Every row is matched with a coordinate of its own, the coordinates declared last first, so that those
//! declared first stay independent. A row needs the rows that are matched with the coordinates it reads; the
//! strongly connected components of that relation, in order of need, are the loops (Dulmage and Mendelsohn's
//! block triangular form).

use crate::graph::NodeId;
use crate::mechanics::Model;

/// A set of rows and the coordinates that they determine, both ascending.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Loop {
    /// Rows.
    pub rows: Vec<usize>,
    /// Coordinates, equally many.
    pub coordinates: Vec<usize>,
}

/// The loops among some rows of Φ_q; a row that finds no coordinate of its own is in none.
#[must_use]
pub fn loops(model: &Model, jacobian: &[Vec<NodeId>], rows: &[usize]) -> Vec<Loop> {
    let nonzero = |r: &usize| {
        let entries = jacobian[*r].iter().enumerate().filter(|(_, node)| !model.graph.is_zero(**node));
        entries.map(|(j, _)| j).rev().collect::<Vec<_>>()
    };
    let reads: Vec<Vec<usize>> = rows.iter().map(nonzero).collect();
    let owner = matching(&reads, model.coordinates.len());
    let needs: Vec<Vec<usize>> = reads.iter().map(|c| c.iter().filter_map(|j| owner[*j]).collect()).collect();
    let determined = |i: &usize| owner.iter().position(|o| *o == Some(*i));
    let sorted = |mut v: Vec<usize>| {
        v.sort_unstable();
        v
    };
    let blocks = components(&needs).into_iter().map(|block| Loop {
        coordinates: sorted(block.iter().filter_map(determined).collect()),
        rows: sorted(block.iter().map(|i| rows[*i]).collect()),
    });
    blocks.filter(|b| b.rows.len() == b.coordinates.len()).collect()
}

/// The row that owns each coordinate, by augmenting paths.
fn matching(reads: &[Vec<usize>], coordinates: usize) -> Vec<Option<usize>> {
    let mut owner: Vec<Option<usize>> = vec![None; coordinates];
    for start in 0..reads.len() {
        // Breadth first: from which row each coordinate was reached.
        let mut reached: Vec<Option<usize>> = vec![None; coordinates];
        let (mut queue, mut at, mut end) = (vec![start], 0, None);
        'search: while at < queue.len() {
            let row = queue[at];
            at += 1;
            for j in &reads[row] {
                if reached[*j].is_some() {
                    continue;
                }
                reached[*j] = Some(row);
                match owner[*j] {
                    Some(next) => queue.push(next),
                    None => {
                        end = Some(*j);
                        break 'search;
                    }
                }
            }
        }
        // Every row on the way gives its coordinate to the one before it.
        while let Some(j) = end {
            let row = reached[j].expect("every coordinate on the way was reached from a row");
            let given = owner.iter().position(|o| *o == Some(row));
            owner[j] = Some(row);
            end = given.filter(|_| row != start);
            if let Some(old) = end {
                owner[old] = None;
            }
        }
    }
    owner
}

/// Strongly connected components, each after those that it needs (Tarjan's algorithm without recursion).
fn components(needs: &[Vec<usize>]) -> Vec<Vec<usize>> {
    let n = needs.len();
    let mut index = vec![usize::MAX; n];
    let mut low = vec![0; n];
    let mut open = vec![false; n];
    let (mut stack, mut found, mut next) = (Vec::new(), Vec::new(), 0);
    for start in 0..n {
        if index[start] != usize::MAX {
            continue;
        }
        let mut path: Vec<(usize, usize)> = vec![(start, 0)];
        while let Some((v, edge)) = path.pop() {
            if edge == 0 {
                (index[v], low[v]) = (next, next);
                next += 1;
                stack.push(v);
                open[v] = true;
            }
            if let Some(w) = needs[v].get(edge).copied() {
                path.push((v, edge + 1));
                if index[w] == usize::MAX {
                    path.push((w, 0));
                } else if open[w] {
                    low[v] = low[v].min(index[w]);
                }
                continue;
            }
            if low[v] == index[v] {
                let at = stack
                    .iter()
                    .position(|x| *x == v)
                    .expect("v is on the stack until its component is taken");
                let block = stack.split_off(at);
                block.iter().for_each(|x| open[*x] = false);
                found.push(block);
            }
            if let Some((parent, _)) = path.last() {
                low[*parent] = low[*parent].min(low[v]);
            }
        }
    }
    found
}

#[cfg(test)]
mod tests {
    use super::{components, matching};

    #[test]
    fn rows_give_way_to_each_other() {
        // Row 1 takes what row 0 had first.
        assert_eq!(matching(&[vec![1, 0], vec![1]], 2), [Some(0), Some(1)]);
        assert_eq!(matching(&[vec![2], vec![2, 1], vec![2, 1, 0]], 3), [Some(2), Some(1), Some(0)]);
        assert_eq!(matching(&[vec![0], vec![0]], 1), [Some(0)]);
        // A chain of exchanges.
        let owner = matching(&[vec![3, 2], vec![3, 1], vec![3, 2], vec![0, 1]], 4);
        assert!((0..4).all(|r| owner.contains(&Some(r))), "{owner:?}");
    }

    #[test]
    fn components_come_after_what_they_need() {
        assert_eq!(components(&[vec![1], vec![0], vec![1, 2], vec![3]]), [vec![0, 1], vec![2], vec![3]]);
        assert_eq!(components(&[vec![1], vec![2], vec![]]), [vec![2], vec![1], vec![0]]);
    }
}
