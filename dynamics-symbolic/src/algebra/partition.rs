//! Which coordinates are independent: candidates whose dependent columns are regular at a random point,
//! structurally cheap ones first.

use std::collections::BTreeSet;

use crate::graph::{Bindings, Graph};

use super::modular::{FreeColumns, is_singular};
use super::null_space::Partition;
use super::sparse::SparseMatrix;
use super::structure::{Block, blocks};

/// Most degrees of freedom, and most coordinates, with which all sets of independent coordinates are priced.
const LARGEST_EXHAUSTIVE: (usize, usize) = (3, 20);
/// Most sets of these: three of twenty coordinates can be chosen in 1140 ways.
const MOST_EXHAUSTIVE_SETS: usize = 1140;
/// Most sets of independent coordinates that the descent prices, where not all are priced. A smaller bound
/// may miss the cheapest set, a larger one only takes time.
const MOST_SETS: usize = 300;

/// What there is to choose from.
#[derive(Debug)]
pub(super) enum PartitionChoice {
    /// Partitions, the structurally cheapest first.
    Partitions(Vec<Partition>),
    /// The rows are redundant at a random point.
    Redundant,
}

/// The partitions of the coordinates of Φ_q that are worth a try.
pub(super) fn partitions(g: &Graph, jacobian: &SparseMatrix, coordinates: usize) -> PartitionChoice {
    let values = jacobian.rows.iter().map(|row| row.iter().map(|(c, x)| (*c, g.fingerprint(*x))).collect());
    let mut basis = FreeColumns::new(values.collect(), coordinates);
    let first = basis.columns();
    let freedom = first.len();
    if coordinates - freedom < jacobian.rows.len() {
        return PartitionChoice::Redundant;
    }
    let pattern = jacobian.pattern();
    let priced = |set: &[usize]| {
        let mut is_independent = vec![false; coordinates];
        set.iter().for_each(|c| is_independent[*c] = true);
        let dependent: Vec<usize> = (0..coordinates).filter(|c| !is_independent[*c]).collect();
        let blocks = blocks(&pattern, &dependent)?;
        Some((structural_cost(&pattern, &blocks, set), Partition { independent: set.to_vec(), blocks }))
    };
    let (most_freedom, most_coordinates) = LARGEST_EXHAUSTIVE;
    let few = freedom == 1 || freedom <= most_freedom && coordinates <= most_coordinates;
    let mut found: Vec<(usize, Partition)> = if few {
        let regular = |set: &&Vec<usize>| !is_singular(basis.minor(set));
        let sets = subsets(coordinates, freedom);
        sets.iter().take(MOST_EXHAUSTIVE_SETS).filter(regular).filter_map(|set| priced(set)).collect()
    } else {
        descend(&mut basis, first, coordinates, &priced)
    };
    found.sort_by(|(a, p), (b, r)| (a, &p.independent).cmp(&(b, &r.independent)));
    PartitionChoice::Partitions(found.into_iter().map(|(_, partition)| partition).collect())
}

/// The structural cost of a set of independent coordinates with its partition; `None` where the others are
/// not determined by it whatever the entries are.
type PartitionPrice<'a> = dyn Fn(&[usize]) -> Option<(usize, Partition)> + 'a;

/// Exchanges one independent coordinate for a dependent one as long as that is cheaper.
fn descend(
    basis: &mut FreeColumns,
    first: Vec<usize>,
    coordinates: usize,
    priced: &PartitionPrice,
) -> Vec<(usize, Partition)> {
    let mut seen = BTreeSet::from([first.clone()]);
    let Some(mut best) = priced(&first) else { return Vec::new() };
    let mut found = vec![best.clone()];
    loop {
        let mut improved = None;
        let base = best.1.independent.clone();
        'exchanges: for at in 0..base.len() {
            for c in (0..coordinates).filter(|c| base.binary_search(c).is_err()) {
                if seen.len() > MOST_SETS {
                    break 'exchanges;
                }
                let mut set = base.clone();
                set[at] = c;
                set.sort_unstable();
                if !seen.insert(set.clone()) || !basis.can_exchange(base[at], c) {
                    continue;
                }
                if let Some(next) = priced(&set) {
                    if next.0 < best.0 {
                        best = next.clone();
                        improved = Some((base[at], c));
                    }
                    found.push(next);
                }
            }
        }
        match improved {
            Some((leaves, enters)) => basis.exchange(leaves, enters),
            None => return found,
        }
    }
}

/// All subsets of so many of the first n numbers, in lexicographic order.
fn subsets(n: usize, size: usize) -> Vec<Vec<usize>> {
    let mut sets = vec![Vec::new()];
    for _ in 0..size {
        let longer = |set: Vec<usize>| {
            let from = set.last().map_or(0, |x| x + 1);
            (from..n).map(move |x| set.iter().copied().chain([x]).collect())
        };
        sets = sets.into_iter().flat_map(longer).collect();
    }
    sets
}

/// About how many products the elimination takes: what each block costs, and how far the independent
/// coordinates reach.
fn structural_cost(pattern: &[Vec<usize>], blocks: &[Block], independent: &[usize]) -> usize {
    let width = pattern
        .iter()
        .flatten()
        .max()
        .map_or(0, |c| c + 1)
        .max(independent.iter().max().map_or(0, |c| c + 1));
    let mut reach = vec![Reach::none(independent.len()); width];
    for (place, i) in independent.iter().enumerate() {
        reach[*i].insert(place);
    }
    let mut cost = 0;
    for (rows, columns) in blocks {
        let outside: Vec<usize> =
            rows.iter().flat_map(|r| &pattern[*r]).copied().filter(|c| !columns.contains(c)).collect();
        let mut all = Reach::none(independent.len());
        outside.iter().for_each(|c| all.unite(&reach[*c]));
        let (size, reached) = (rows.len(), all.len());
        // The determinant, then for every independent coordinate and the particular solution the right-hand
        // side and the substitution.
        let right: usize = outside.iter().map(|c| reach[*c].len() + 1).sum();
        cost += size.pow(3) + right + size * size * (reached + 1) + size * reached * reached;
        columns.iter().for_each(|c| reach[*c] = all.clone());
    }
    cost
}

/// How many times the cost of another way the structural cost of a partition may be, beside a constant, if it
/// is to be tried. The structural cost counts products of entries that cancel, so it is up to eight times the
/// real one in mechanisms of bodies in absolute coordinates; in a chain of n links it grows with n³, and all
/// orders by blocks are hopeless.
const MOST_STRUCTURAL_COST: (usize, usize) = (32, 20_000);

impl Partition {
    /// Whether it may cost about as little as a way of this cost, as far as the pattern of Φ_q tells.
    pub(super) fn may_cost(&self, pattern: &[Vec<usize>], other: usize) -> bool {
        let (times, beside) = MOST_STRUCTURAL_COST;
        structural_cost(pattern, &self.blocks, &self.independent) <= times * other + beside
    }
}

/// The independent coordinates, by place, that something moves with: one bit of each, as in a long chain
/// almost everything moves with all of them.
#[derive(Clone)]
struct Reach(Vec<u64>);

impl Reach {
    fn none(size: usize) -> Self {
        Self(vec![0; size.div_ceil(64)])
    }

    fn insert(&mut self, place: usize) {
        self.0[place / 64] |= 1 << (place % 64);
    }

    fn unite(&mut self, other: &Self) {
        self.0.iter_mut().zip(&other.0).for_each(|(a, b)| *a |= b);
    }

    fn len(&self) -> usize {
        self.0.iter().map(|bits| bits.count_ones() as usize).sum()
    }
}

/// Φ_q at some states.
pub(super) struct Slopes {
    /// At each of them, by node.
    values: Vec<Vec<f64>>,
}

impl Slopes {
    pub(super) fn at(g: &Graph, jacobian: &SparseMatrix, states: &[&dyn Bindings]) -> Self {
        let roots: Vec<_> = jacobian.rows.iter().flat_map(|row| row.values().copied()).collect();
        Self { values: states.iter().map(|state| g.evaluate(&roots, *state)).collect() }
    }

    /// How far the dependent blocks are from being singular at the worst of the states: the least ratio of a
    /// block's determinant to the norms of its columns, 1 at best.
    pub(super) fn conditioning(&self, jacobian: &SparseMatrix, partition: &Partition) -> f64 {
        let ratios = self.values.iter().flat_map(|values| {
            partition.blocks.iter().map(|block| {
                determinant(entries(jacobian, values, block)).abs() / by_columns(jacobian, values, block)
            })
        });
        // Unknown is not good.
        ratios.fold(1.0, |worst, ratio| if ratio.is_nan() { 0.0 } else { worst.min(ratio) })
    }

    /// At which of the states no block vanishes: its determinant is above `least` of the norms of its
    /// columns, and of its rows.
    pub(super) fn regular(&self, jacobian: &SparseMatrix, partition: &Partition, least: f64) -> Vec<bool> {
        let at = |values: &Vec<f64>| {
            partition.blocks.iter().all(|block| {
                let (columns, rows) = (by_columns(jacobian, values, block), by_rows(jacobian, values, block));
                determinant(entries(jacobian, values, block)).abs() > least * columns.max(rows)
            })
        };
        self.values.iter().map(at).collect()
    }
}

fn entries(jacobian: &SparseMatrix, values: &[f64], (rows, columns): &Block) -> Vec<Vec<f64>> {
    let entry = |r: usize, c: usize| jacobian.rows[r].get(&c).map_or(0.0, |x| values[x.index()]);
    rows.iter().map(|r| columns.iter().map(|c| entry(*r, *c)).collect()).collect()
}

/// The product of the norms of the block's columns in the whole Jacobian.
fn by_columns(jacobian: &SparseMatrix, values: &[f64], (_, columns): &Block) -> f64 {
    columns
        .iter()
        .map(|c| jacobian.column(*c).map(|(_, x)| values[x.index()].powi(2)).sum::<f64>().sqrt())
        .product()
}

/// The same of its rows.
fn by_rows(jacobian: &SparseMatrix, values: &[f64], (rows, _): &Block) -> f64 {
    rows.iter()
        .map(|r| jacobian.rows[*r].values().map(|x| values[x.index()].powi(2)).sum::<f64>().sqrt())
        .product()
}

/// By elimination with row pivoting.
fn determinant(mut a: Vec<Vec<f64>>) -> f64 {
    let n = a.len();
    let mut product = 1.0;
    for k in 0..n {
        let pivot = (k..n).max_by(|i, j| a[*i][k].abs().total_cmp(&a[*j][k].abs())).unwrap_or(k);
        a.swap(k, pivot);
        product *= if pivot == k { a[k][k] } else { -a[k][k] };
        if a[k][k] == 0.0 {
            return 0.0;
        }
        let (done, rest) = a.split_at_mut(k + 1);
        for row in rest {
            let factor = row[k] / done[k][k];
            row.iter_mut().zip(&done[k]).for_each(|(x, p)| *x -= factor * p);
        }
    }
    product
}
