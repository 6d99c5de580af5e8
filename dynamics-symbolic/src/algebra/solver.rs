//! M q̈ − Φ_qᵀλ = Q, Φ_q q̈ = γ solved on the graph by the cheaper of two ways: q̈ and λ together in minimum-degree order, or independent
//! coordinates first, with loops eliminated block by block.

use crate::calculus::{collect, share};
use crate::graph::{Bindings, Graph, NodeId, Symbol};

use super::lengths;
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
    /// What the model calls these rows: right-hand sides of corrections are the symbols `Symbol::Multiplier` of these numbers, R.
    pub numbers: &'a [usize],
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

    /// Led by the first `speeds` rows of `kinematics`: the gradients of speeds by the velocities, then Φ_q, N rows in all. `None` where they do not determine
    /// all velocities in any state, or where the speeds have no inertia.
    #[must_use]
    pub fn by_speeds(g: &mut Graph, mass: &[Vec<NodeId>], kinematics: &[Vec<NodeId>], speeds: usize) -> Option<Self> {
        let (mass, kinematics) = (Sparse::new(g, mass, mass.len()), Sparse::new(g, kinematics, mass.len()));
        NullSpace::by_speeds(g, &mass, &kinematics, speeds).map(|reduced| Self(Way::Blocks(Box::new(reduced))))
    }

    /// The inertia of what leads, and the columns of the inverse of `kinematics`: what moves where one row is 1 and the others are 0. Empty where
    /// no speeds lead.
    #[must_use]
    pub fn led(&self, g: &mut Graph) -> (Vec<Vec<NodeId>>, Vec<Vec<NodeId>>) {
        match &self.0 {
            Way::Blocks(reduced) if reduced.speeds() > 0 => {
                let inertia = reduced.inertia(g);
                (inertia, (0..reduced.coordinates()).map(|row| reduced.moved_by(g, row)).collect())
            }
            _ => (Vec::new(), Vec::new()),
        }
    }

    /// q̈ (N) and λ (R) with M q̈ − Φ_qᵀλ = `force`, Φ_q q̈ = `gamma`. Where speeds lead, `gamma` may begin with −Ẏq̇ − ẏ of each: that changes the form of the
    /// solution, not the solution.
    #[must_use]
    pub fn solve(&self, g: &mut Graph, force: &[NodeId], gamma: &[NodeId]) -> (Vec<NodeId>, Vec<NodeId>) {
        match &self.0 {
            Way::MinimumDegree(factors) => factors.solve(g, force, gamma),
            Way::Blocks(reduced) => reduced.solve(g, force, gamma),
        }
    }

    /// δ (N) with M δ = Φ_qᵀμ for some μ, Φ_q δ = `right`.
    #[must_use]
    pub fn correct(&self, g: &mut Graph, right: &[NodeId]) -> Vec<NodeId> {
        match &self.0 {
            Way::MinimumDegree(factors) => factors.correct(g, right),
            Way::Blocks(reduced) => reduced.correct(g, right),
        }
    }

    /// The order of elimination.
    #[must_use]
    pub fn elimination(&self) -> Elimination {
        match &self.0 {
            Way::MinimumDegree(_) => Elimination::MinimumDegree,
            Way::Blocks(reduced) if reduced.speeds() > 0 => Elimination::Speeds,
            Way::Blocks(reduced) => Elimination::Blocks(reduced.blocks().to_vec()),
        }
    }

    /// Whether what a row's pivots are compared with stays where the row vanishes: a constant.
    fn sees_length(&self, g: &Graph, row: usize) -> bool {
        let Way::Blocks(reduced) = &self.0 else { return false };
        if reduced.speeds() > 0 {
            return false;
        }
        let Some((rows, _)) = reduced.blocks().iter().find(|(rows, _)| rows.contains(&row)) else { return false };
        let within = |guard: &&Guard| matches!(guard.of, Guarded::Row(row) if rows.contains(&row));
        reduced.guards.iter().filter(within).all(|guard| g.is_constant(guard.scale))
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
/// Partitions that come nearer to a dead point than this at one of the given states are not taken while there is another way.
const POOR: f64 = 1e-3;
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
    let short = Short::new(g, system);
    let solver = short.solver(g, states)?;
    let solution = solver.solve(g, &short.force, &short.gamma);
    let unrolled = short.finished(g, &solver, solution, system.numbers, limit)?;
    Ok((unrolled, solver))
}

/// The same, led by the first rows of `kinematics`, whose `drift` −Ẏq̇ − ẏ has as many elements as there are speeds; or none.
///
/// # Errors
/// As for [`unroll`].
pub fn unroll_by_speeds(
    g: &mut Graph,
    system: &Constrained,
    (kinematics, speeds): (&[Vec<NodeId>], usize),
    drift: &[NodeId],
    limit: usize,
) -> Result<(Unrolled, Solver), Stuck> {
    let short = Short::new(g, system);
    let solver = Solver::by_speeds(g, system.mass, kinematics, speeds).ok_or(Stuck::NoPivots)?;
    let solution = solver.solve(g, system.force, &[drift, system.gamma].concat());
    let unrolled = short.finished(g, &solver, solution, system.numbers, limit)?;
    Ok((unrolled, solver))
}

impl Short {
    /// The solution with its guards, in shared forms.
    fn finished(
        &self,
        g: &mut Graph,
        solver: &Solver,
        (accelerations, multipliers): (Vec<NodeId>, Vec<NodeId>),
        numbers: &[usize],
        limit: usize,
    ) -> Result<Unrolled, Stuck> {
        let (n, r) = (accelerations.len(), multipliers.len());
        let mut guards = solver.guards().to_vec();
        guards.extend(self.cancelled(g));
        let unseen: Vec<bool> = (0..r).map(|row| !solver.sees_length(g, row)).collect();
        guards.extend(lengths::guards(g, &self.jacobian, |row| unseen[row]));
        let checked: Vec<NodeId> = guards.iter().flat_map(|guard| [guard.pivot, guard.scale]).collect();
        let shared = share(g, &[&accelerations[..], &multipliers, &checked].concat());
        let operations = g.operations(&shared);
        if operations > limit {
            return Err(Stuck::TooLarge(operations));
        }
        let given: Vec<NodeId> = numbers.iter().map(|row| g.symbol(Symbol::Multiplier(*row as u32))).collect();
        let delta = solver.correct(g, &given);
        // A program of its own: what it shares with the other is no gain to it.
        let corrected = share(g, &[&delta[..], &checked].concat());
        Ok(Unrolled {
            elimination: solver.elimination(),
            accelerations: shared[..n].to_vec(),
            multipliers: shared[n..n + r].to_vec(),
            guards: renewed(&guards, &shared[n + r..]),
            correction: corrected[..n].to_vec(),
            correction_guards: renewed(&guards, &corrected[n..]),
        })
    }
}

/// Guards with other nodes of the same values.
fn renewed(guards: &[Guard], nodes: &[NodeId]) -> Vec<Guard> {
    guards.iter().zip(nodes.chunks(2)).map(|(guard, new)| Guard { pivot: new[0], scale: new[1], ..*guard }).collect()
}

/// The equations in short forms.
struct Short {
    mass: Vec<Vec<NodeId>>,
    force: Vec<NodeId>,
    jacobian: Vec<Vec<NodeId>>,
    gamma: Vec<NodeId>,
    /// Diagonal elements of M that are written with a constant that can cancel, and that constant.
    squares: Vec<(NodeId, NodeId)>,
}

impl Short {
    fn new(g: &mut Graph, system: &Constrained) -> Self {
        let (n, r) = (system.mass.len(), system.jacobian.len());
        let terms = [&system.mass.concat()[..], &system.jacobian.concat(), system.force, system.gamma].concat();
        let diagonal: Vec<NodeId> = (0..n).map(|i| system.mass[i][i]).collect();
        let short = collect(g, &terms, &diagonal);
        let (rows, vectors) = short.nodes.split_at((n + r) * n);
        let mut mass: Vec<Vec<NodeId>> = rows.chunks(n.max(1)).map(<[NodeId]>::to_vec).collect();
        let jacobian = mass.split_off(n);
        let (force, gamma) = vectors.split_at(n);
        Self { mass, force: force.to_vec(), jacobian, gamma: gamma.to_vec(), squares: short.squares }
    }

    /// The better of all ways.
    fn solver(&self, g: &mut Graph, states: &[&dyn Bindings]) -> Result<Solver, Stuck> {
        let n = self.mass.len();
        let (mass, jacobian) = (Sparse::new(g, &self.mass, n), Sparse::new(g, &self.jacobian, n));
        let Choice::Partitions(candidates) = partitions(g, &jacobian, n) else { return Err(Stuck::Redundant) };
        let way = |g: &mut Graph, choice: Option<&Partition>| match choice {
            Some(partition) => {
                NullSpace::new(g, &mass, &jacobian, partition).map(|reduced| Solver(Way::Blocks(Box::new(reduced))))
            }
            None => Solver::together(g, &self.mass, &self.jacobian),
        };
        let cost = |choice: Option<&Partition>| {
            // On a copy, so that what is not taken leaves no trace.
            let mut trial = g.clone();
            let solver = way(&mut trial, choice)?;
            let (accelerations, multipliers) = solver.solve(&mut trial, &self.force, &self.gamma);
            let guards = solver.guards().iter().flat_map(|guard| [guard.pivot, guard.scale]);
            Some(trial.weight(&[accelerations, multipliers, guards.collect()].concat()))
        };
        let tried = if g.len() > LARGE { 2 } else { TRIED };
        let priced: Vec<Priced> = candidates
            .iter()
            .take(tried)
            .filter_map(|p| Some((cost(Some(p))?, conditioning(g, &jacobian, p, states), p)))
            .collect();
        let choice = prefer(&priced, cost(None)).ok_or(Stuck::NoPivots)?;
        way(g, choice).ok_or(Stuck::NoPivots)
    }

    /// Guards of the diagonal elements of M that can cancel.
    fn cancelled(&self, g: &Graph) -> Vec<Guard> {
        let diagonal = self.mass.iter().enumerate().map(|(i, row)| (i, row[i]));
        let written = diagonal.filter(|(_, element)| !g.is_constant(*element)).filter_map(|(i, element)| {
            let (_, constant) = self.squares.iter().find(|(square, _)| *square == element)?;
            Some(Guard { of: Guarded::Coordinate(i), pivot: element, scale: *constant, tolerance: CANCELLED })
        });
        written.collect()
    }
}

/// Cost, conditioning, and the partition that has them.
type Priced<'a> = (usize, f64, &'a Partition);

/// The partition to be taken, or q̈ and λ together (`Some(None)`) where that is cheaper; `None` where there is no way at all.
fn prefer<'a>(priced: &[Priced<'a>], together: Option<usize>) -> Option<Option<&'a Partition>> {
    let good: Vec<&Priced> = priced.iter().filter(|(_, conditioning, _)| *conditioning > POOR).collect();
    let candidates = if good.is_empty() && together.is_none() { priced.iter().collect() } else { good };
    let cheapest = candidates.iter().map(|(cost, ..)| *cost).min().unwrap_or(usize::MAX);
    let near = candidates.into_iter().filter(|(cost, ..)| *cost as f64 <= NEARLY * cheapest as f64);
    let best = near.min_by(|(a, good, _), (b, better, _)| better.total_cmp(good).then(a.cmp(b)));
    match (best, together) {
        (Some((blocks, _, partition)), together) if together.is_none_or(|cost| *blocks <= cost) => {
            Some(Some(*partition))
        }
        (_, Some(_)) => Some(None),
        _ => None,
    }
}
