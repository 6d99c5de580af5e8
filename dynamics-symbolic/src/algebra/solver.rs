//! M q̈ − Φ_qᵀλ = Q, Φ_q q̈ = γ solved on the graph by the cheaper of two ways: q̈ and λ together in minimum-degree order, or independent
//! coordinates first, with loops eliminated block by block.

use crate::calculus::{collect, share};
use crate::graph::{Bindings, Graph, NodeId, Symbol};

use super::minimum_degree::MinimumDegree;
use super::null_space::{NullSpace, Partition};
use super::partition::{Choice, conditioning, partitions};
use super::sparse::Sparse;
use super::structure::blocks;
use super::unrolled::{Elimination, Guard, Guarded, Unrolled};

/// The equations of a system with constraints: N coordinates, R rows.
#[derive(Clone, Copy, Debug)]
pub struct Constrained<'a> {
    /// M, N×N, symmetric; may be singular where the constraints carry what has no inertia.
    pub mass: &'a [Vec<NodeId>],
    /// Q, N.
    pub force: &'a [NodeId],
    /// Φ_q, R×N.
    pub jacobian: &'a [Vec<NodeId>],
    /// γ, R.
    pub gamma: &'a [NodeId],
}

/// Why equations with constraints are not solved on the graph.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Stuck {
    /// Rows are redundant in every state.
    Redundant,
    /// Every way meets a pivot that is zero in every state.
    NoPivots,
    /// The cheapest way takes this many operations.
    TooLarge(usize),
}

/// The factored equations, for any right-hand side.
#[derive(Clone, Debug)]
pub struct Solver(Way);

#[derive(Clone, Debug)]
enum Way {
    MinimumDegree(MinimumDegree),
    Blocks(Box<NullSpace>),
}

impl Solver {
    /// q̈ and λ together in minimum-degree order; `None` where only pivots are left that are zero in every state.
    #[must_use]
    pub fn together(g: &mut Graph, mass: &[Vec<NodeId>], jacobian: &[Vec<NodeId>]) -> Option<Self> {
        MinimumDegree::new(g, mass, jacobian).map(|factors| Self(Way::MinimumDegree(factors)))
    }

    /// Block by block, the given coordinates independent; `None` where a block or the reduced inertia is singular in every state.
    #[must_use]
    pub fn by_blocks(
        g: &mut Graph,
        mass: &[Vec<NodeId>],
        jacobian: &[Vec<NodeId>],
        independent: &[usize],
    ) -> Option<Self> {
        let (mass, jacobian) = (Sparse::new(g, mass, mass.len()), Sparse::new(g, jacobian, mass.len()));
        let dependent: Vec<usize> = (0..mass.rows.len()).filter(|c| !independent.contains(c)).collect();
        let blocks = blocks(&jacobian.pattern(), &dependent)?;
        let partition = Partition { independent: independent.to_vec(), blocks };
        NullSpace::new(g, &mass, &jacobian, &partition).map(|reduced| Self(Way::Blocks(Box::new(reduced))))
    }

    /// q̈ (N) and λ (R) with M q̈ − Φ_qᵀλ = `force`, Φ_q q̈ = `gamma`.
    #[must_use]
    pub fn solve(&self, g: &mut Graph, force: &[NodeId], gamma: &[NodeId]) -> (Vec<NodeId>, Vec<NodeId>) {
        match &self.0 {
            Way::MinimumDegree(factors) => factors.solve(g, force, gamma),
            Way::Blocks(reduced) => reduced.solve(g, force, gamma),
        }
    }

    /// The order of elimination.
    #[must_use]
    pub fn elimination(&self) -> Elimination {
        match &self.0 {
            Way::MinimumDegree(_) => Elimination::MinimumDegree,
            Way::Blocks(reduced) => Elimination::Blocks(reduced.blocks().to_vec()),
        }
    }

    /// Pivots that may vanish.
    #[must_use]
    pub fn guards(&self) -> &[Guard] {
        match &self.0 {
            Way::MinimumDegree(factors) => &factors.guards,
            Way::Blocks(reduced) => &reduced.guards,
        }
    }
}

/// Partitions that are tried on the graph; the structurally cheapest.
const TRIED: usize = 12;
/// Nodes of a graph above which fewer are tried, as every try is on a copy.
const LARGE: usize = 20_000;
/// A partition may cost this much more than the cheapest where it is better conditioned.
const NEARLY: f64 = 1.25;

/// Smallest share of its constant that a diagonal element of M may have where it is not written as a sum of squares: below, the general solver
/// takes over, which has it as it was declared.
const CANCELLED: f64 = 1e-4;

/// Solves the equations with at most `limit` operations. Of several nearly equally cheap choices of independent coordinates the one is taken
/// whose blocks are farthest from singular at the worst of the given states, which have to be on the manifold to be of use; without states
/// the coordinates declared first are independent.
///
/// # Errors
/// Why it is left to the general solver.
pub fn unroll(
    g: &mut Graph,
    system: &Constrained,
    states: &[&dyn Bindings],
    limit: usize,
) -> Result<(Unrolled, Solver), Stuck> {
    let (n, r) = (system.mass.len(), system.jacobian.len());
    let terms = [&system.mass.concat()[..], &system.jacobian.concat(), system.force, system.gamma].concat();
    let diagonal: Vec<NodeId> = (0..n).map(|i| system.mass[i][i]).collect();
    let short = collect(g, &terms, &diagonal);
    let (rows, vectors) = short.nodes.split_at((n + r) * n);
    let rows: Vec<Vec<NodeId>> = rows.chunks(n).map(<[NodeId]>::to_vec).collect();
    let (mass, jacobian) = rows.split_at(n);
    let (force, gamma) = vectors.split_at(n);
    let system = &Constrained { mass, jacobian, force, gamma };
    let mass = Sparse::new(g, system.mass, n);
    let jacobian = Sparse::new(g, system.jacobian, n);
    let Choice::Partitions(candidates) = partitions(g, &jacobian, n) else { return Err(Stuck::Redundant) };
    let way = |g: &mut Graph, choice: Option<&Partition>| match choice {
        Some(partition) => NullSpace::new(g, &mass, &jacobian, partition).map(|reduced| Way::Blocks(Box::new(reduced))),
        None => MinimumDegree::new(g, system.mass, system.jacobian).map(Way::MinimumDegree),
    };
    let cost = |choice: Option<&Partition>| {
        // On a copy, so that what is not taken leaves no trace.
        let mut trial = g.clone();
        let solver = Solver(way(&mut trial, choice)?);
        let (accelerations, multipliers) = solver.solve(&mut trial, system.force, system.gamma);
        let guards = solver.guards().iter().flat_map(|guard| [guard.pivot, guard.scale]);
        Some(trial.weight(&[accelerations, multipliers, guards.collect()].concat()))
    };
    let tried = if g.len() > LARGE { 2 } else { TRIED };
    let priced: Vec<(usize, f64, &Partition)> = candidates
        .iter()
        .take(tried)
        .filter_map(|p| Some((cost(Some(p))?, conditioning(g, &jacobian, p, states), p)))
        .collect();
    let cheapest = priced.iter().map(|(cost, ..)| *cost).min().unwrap_or(usize::MAX);
    let near = priced.iter().filter(|(cost, ..)| *cost as f64 <= NEARLY * cheapest as f64);
    let best = near.min_by(|(a, good, _), (b, better, _)| better.total_cmp(good).then(a.cmp(b)));
    let together = cost(None);
    let choice = match (best, together) {
        (Some((blocks, ..)), Some(together)) if together < *blocks => None,
        (Some((.., partition)), _) => Some(*partition),
        (None, Some(_)) => None,
        (None, None) => return Err(Stuck::NoPivots),
    };
    let solver = Solver(way(g, choice).ok_or(Stuck::NoPivots)?);
    let (accelerations, multipliers) = solver.solve(g, system.force, system.gamma);
    let mut guards = solver.guards().to_vec();
    guards.extend((0..n).filter_map(|i| {
        let (pivot, scale) =
            *short.squares.iter().find(|(new, _)| *new == system.mass[i][i] && !g.is_constant(*new))?;
        Some(Guard { of: Guarded::Coordinate(i), pivot, scale, tolerance: CANCELLED })
    }));
    let zero = vec![g.zero(); n];
    let given: Vec<NodeId> = (0..r as u32).map(|row| g.symbol(Symbol::Multiplier(row))).collect();
    let correction = solver.solve(g, &zero, &given);
    let checked: Vec<NodeId> = guards.iter().flat_map(|guard| [guard.pivot, guard.scale]).collect();
    let shared = share(g, &[&accelerations[..], &multipliers, &checked].concat());
    let operations = g.operations(&shared);
    if operations > limit {
        return Err(Stuck::TooLarge(operations));
    }
    let (accelerations, rest) = shared.split_at(n);
    let (multipliers, checked) = rest.split_at(r);
    for (guard, new) in guards.iter_mut().zip(checked.chunks(2)) {
        (guard.pivot, guard.scale) = (new[0], new[1]);
    }
    let (accelerations, multipliers) = (accelerations.to_vec(), multipliers.to_vec());
    let elimination = solver.elimination();
    Ok((Unrolled { elimination, accelerations, multipliers, guards, correction }, solver))
}
