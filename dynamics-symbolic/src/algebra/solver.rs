//! M q̈ − Φ_qᵀλ = Q, Φ_q q̈ = γ solved on the graph by the cheaper of two ways: q̈ and λ together in
//! minimum-degree order, or independent coordinates first, with loops eliminated block by block.

use crate::calculus::{collect_terms, share_parts};
use crate::graph::{Bindings, Graph, NodeId, Symbol};

use super::lengths;
use super::minimum_degree::MinimumDegree;
use super::null_space::{NullSpace, Partition};
use super::partition::{PartitionChoice, Slopes, partitions};
use super::sparse::SparseMatrix;
use super::structure::blocks;
use super::unrolled::{Elimination, Guard, Guarded, Unrolled};

/// The equations of a system with constraints: N coordinates, R rows.
#[derive(Clone, Copy, Debug)]
pub struct ConstrainedEquations<'a> {
    /// M, N×N, symmetric; may be singular where the constraints carry what has no inertia.
    pub mass: &'a [Vec<NodeId>],
    /// Q, N.
    pub force: &'a [NodeId],
    /// Φ_q, R×N.
    pub jacobian: &'a [Vec<NodeId>],
    /// γ, R.
    pub gamma: &'a [NodeId],
    /// What the model calls these rows: right-hand sides of corrections are the symbols `Symbol::Multiplier`
    /// of these numbers, R.
    pub numbers: &'a [usize],
}

/// States by which an order of elimination is chosen.
#[derive(Clone, Copy, Default)]
pub struct States<'a> {
    /// Where the constraints hold, at nominal values of the parameters: of nearly equally cheap orders the
    /// one is taken that is best conditioned at the worst of them.
    pub anywhere: &'a [&'a dyn Bindings],
    /// Where motions are likely to begin, the likeliest first: an order that does not apply there is not
    /// taken while there is another that is at most three times as long.
    pub likely: &'a [&'a dyn Bindings],
    /// States that motions pass: an order whose pivots vanish altogether there is not taken while there is
    /// another that is hardly longer.
    pub passed: &'a [&'a dyn Bindings],
}

impl States<'_> {
    /// Whether they affect the choice beyond its length.
    fn steer(&self) -> bool {
        !(self.likely.is_empty() && self.passed.is_empty())
    }
}

/// Why equations with constraints are not solved on the graph.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum NotUnrolled {
    /// Rows are redundant in every state.
    Redundant,
    /// Every way meets a pivot that is zero in every state.
    NoPivots,
    /// The cheapest way takes this many operations.
    TooLarge(usize),
}

/// The factored equations, for any right-hand side.
#[derive(Clone, Debug)]
pub struct Solver(SolverKind);

#[derive(Clone, Debug)]
enum SolverKind {
    MinimumDegree(MinimumDegree),
    Blocks(Box<NullSpace>),
}

impl Solver {
    /// q̈ and λ together in minimum-degree order; `None` where only pivots are left that are zero in every
    /// state.
    #[must_use]
    pub fn together(g: &mut Graph, mass: &[Vec<NodeId>], jacobian: &[Vec<NodeId>]) -> Option<Self> {
        MinimumDegree::new(g, mass, jacobian).map(|factors| Self(SolverKind::MinimumDegree(factors)))
    }

    /// Block by block, the given coordinates independent; `None` where a block or the reduced inertia is
    /// singular in every state.
    #[must_use]
    pub fn by_blocks(
        g: &mut Graph,
        mass: &[Vec<NodeId>],
        jacobian: &[Vec<NodeId>],
        independent: &[usize],
    ) -> Option<Self> {
        let (mass, jacobian) =
            (SparseMatrix::new(g, mass, mass.len()), SparseMatrix::new(g, jacobian, mass.len()));
        let dependent: Vec<usize> = (0..mass.rows.len()).filter(|c| !independent.contains(c)).collect();
        let blocks = blocks(&jacobian.pattern(), &dependent)?;
        let partition = Partition { independent: independent.to_vec(), blocks };
        NullSpace::new(g, &mass, &jacobian, &partition, usize::MAX)
            .map(|reduced| Self(SolverKind::Blocks(Box::new(reduced))))
    }

    /// Led by the first `speeds` rows of `kinematics`: the gradients of speeds by the velocities, then Φ_q, N
    /// rows in all. `None` where they do not determine all velocities in any state, or where the speeds have
    /// no inertia.
    #[must_use]
    pub fn by_speeds(
        g: &mut Graph,
        mass: &[Vec<NodeId>],
        kinematics: &[Vec<NodeId>],
        speeds: usize,
    ) -> Option<Self> {
        let (mass, kinematics) =
            (SparseMatrix::new(g, mass, mass.len()), SparseMatrix::new(g, kinematics, mass.len()));
        NullSpace::by_speeds(g, &mass, &kinematics, speeds)
            .map(|reduced| Self(SolverKind::Blocks(Box::new(reduced))))
    }

    /// The inertia of what leads, and the columns of the inverse of `kinematics`: what moves where one row is
    /// 1 and the others are 0. Empty where no speeds lead.
    #[must_use]
    pub fn led(&self, g: &mut Graph) -> (Vec<Vec<NodeId>>, Vec<Vec<NodeId>>) {
        match &self.0 {
            SolverKind::Blocks(reduced) if reduced.speeds() > 0 => {
                let inertia = reduced.inertia(g);
                (inertia, (0..reduced.coordinates()).map(|row| reduced.moved_by(g, row)).collect())
            }
            _ => (Vec::new(), Vec::new()),
        }
    }

    /// q̈ (N) and λ (R) with M q̈ − Φ_qᵀλ = `force`, Φ_q q̈ = `gamma`. Where speeds lead, `gamma` may begin
    /// with −Ẏq̇ − ẏ of each: that changes the form of the solution, not the solution.
    #[must_use]
    pub fn solve(&self, g: &mut Graph, force: &[NodeId], gamma: &[NodeId]) -> (Vec<NodeId>, Vec<NodeId>) {
        match &self.0 {
            SolverKind::MinimumDegree(factors) => factors.solve(g, force, gamma),
            SolverKind::Blocks(reduced) => reduced.solve(g, force, gamma),
        }
    }

    /// δ (N) with M δ = Φ_qᵀμ for some μ, Φ_q δ = `right`.
    #[must_use]
    pub fn correct(&self, g: &mut Graph, right: &[NodeId]) -> Vec<NodeId> {
        match &self.0 {
            SolverKind::MinimumDegree(factors) => factors.correct(g, right),
            SolverKind::Blocks(reduced) => reduced.correct(g, right),
        }
    }

    /// The order of elimination.
    #[must_use]
    pub fn elimination(&self) -> Elimination {
        match &self.0 {
            SolverKind::MinimumDegree(_) => Elimination::MinimumDegree,
            SolverKind::Blocks(reduced) if reduced.speeds() > 0 => Elimination::Speeds,
            SolverKind::Blocks(reduced) => Elimination::Blocks(reduced.blocks().to_vec()),
        }
    }

    /// Whether what a row's pivots are compared with stays where the row vanishes: a constant.
    fn sees_length(&self, g: &Graph, row: usize) -> bool {
        let SolverKind::Blocks(reduced) = &self.0 else { return false };
        if reduced.speeds() > 0 {
            return false;
        }
        let Some((rows, _)) = reduced.blocks().iter().find(|(rows, _)| rows.contains(&row)) else {
            return false;
        };
        let within = |guard: &&Guard| matches!(guard.of, Guarded::Row(row) if rows.contains(&row));
        reduced.guards.iter().filter(within).all(|guard| g.is_constant(guard.scale))
    }

    /// Pivots that may vanish.
    #[must_use]
    pub fn guards(&self) -> &[Guard] {
        match &self.0 {
            SolverKind::MinimumDegree(factors) => &factors.guards,
            SolverKind::Blocks(reduced) => &reduced.guards,
        }
    }
}

/// Most partitions that are tried on the graph, the structurally cheapest first. Every trial is on a copy of
/// the graph; a larger bound takes time and may find a cheaper solution.
const MOST_TRIALS: usize = 12;
/// Nodes of a graph above which only two partitions are tried, as every trial is on a copy.
const NODES_OF_LARGE_GRAPH: usize = 20_000;
/// Nodes after which the trial of a partition is given up, for each unit of the cost of the way that is
/// known, and beside that. Trials end with 0.9 to 1.6 nodes for each unit of their own cost, and one that
/// costs more than [`COST_OF_LIKELY_STATES`] of the other is never taken. Without a bound, the reduced
/// inertia of a chain of n links takes n³ nodes.
const NODES_OF_TRIAL: (usize, usize) = (6, 20_000);
/// How many times the cost of the cheapest partition a better conditioned one may have.
const COST_OF_CONDITIONING: f64 = 1.25;
/// How many times the operations of the cheapest solution one may take that applies at more of the likely
/// states. A bicycle took as long by the general solver as by five times its own operations.
const COST_OF_LIKELY_STATES: f64 = 3.0;
/// The same for states that motions only pass. They are few evaluations, so a tenth more operations is the
/// most that pays.
const COST_OF_PASSED_STATES: f64 = 1.1;
/// Ratio of a determinant to the norms of its columns and rows below which it counts as vanished: what is
/// left is rounding. The bound decides which partitions are preferred, and calls no general solver.
const VANISHED_DETERMINANT: f64 = 1e-7;
/// Ratio of a determinant to the norms of its columns, at the worst of the given states, below which a
/// partition is taken only if there is no other. Its guard would hand that state to the general solver, as
/// the bound of guards is the same, [`LEAST_DETERMINANT_RATIO`](super::block::LEAST_DETERMINANT_RATIO).
const POOR_CONDITIONING: f64 = 1e-3;
/// Smallest ratio of a diagonal element of M to the constant that it is written with, where it is not written
/// as a sum of squares. Below, four digits have cancelled, and the general solver takes over, which uses M as
/// it was declared.
const LEAST_SHARE_OF_CONSTANT: f64 = 1e-4;

/// Solves the equations with at most `limit` operations, in the order that `states` decide; without them the
/// coordinates declared first are independent.
///
/// # Errors
/// Why it is left to the general solver.
pub fn unroll(
    g: &mut Graph,
    system: &ConstrainedEquations,
    states: &States,
    limit: usize,
) -> Result<(Unrolled, Solver), NotUnrolled> {
    let short = CollectedEquations::new(g, system);
    let by = |g: &mut Graph, states: &States| {
        let solver = short.solver(g, states)?;
        let solution = solver.solve(g, &short.force, &short.gamma);
        let unrolled = short.finished(g, &solver, solution, system.numbers, limit)?;
        Ok((unrolled, solver))
    };
    let mut trial = g.clone();
    match by(&mut trial, states) {
        // What applies at fewer states is better than what applies at none.
        Err(NotUnrolled::TooLarge(_)) if states.steer() => {
            by(g, &States { anywhere: states.anywhere, ..States::default() })
        }
        found => {
            *g = trial;
            found
        }
    }
}

/// The same, led by the first rows of `kinematics`, whose `drift` −Ẏq̇ − ẏ has as many elements as there are
/// speeds; or none.
///
/// # Errors
/// As for [`unroll`].
pub fn unroll_by_speeds(
    g: &mut Graph,
    system: &ConstrainedEquations,
    (kinematics, speeds): (&[Vec<NodeId>], usize),
    drift: &[NodeId],
    limit: usize,
) -> Result<(Unrolled, Solver), NotUnrolled> {
    let short = CollectedEquations::new(g, system);
    let solver = Solver::by_speeds(g, system.mass, kinematics, speeds).ok_or(NotUnrolled::NoPivots)?;
    let solution = solver.solve(g, system.force, &[drift, system.gamma].concat());
    let unrolled = short.finished(g, &solver, solution, system.numbers, limit)?;
    Ok((unrolled, solver))
}

impl CollectedEquations {
    /// The solution with its guards, in shared forms.
    fn finished(
        &self,
        g: &mut Graph,
        solver: &Solver,
        (accelerations, multipliers): (Vec<NodeId>, Vec<NodeId>),
        numbers: &[usize],
        limit: usize,
    ) -> Result<Unrolled, NotUnrolled> {
        let (n, r) = (accelerations.len(), multipliers.len());
        let guards = self.guards(g, solver);
        let checked: Vec<NodeId> = guards.iter().flat_map(|guard| [guard.pivot, guard.scale]).collect();
        let shared = share_parts(g, &[&accelerations[..], &multipliers, &checked].concat());
        let operations = g.operations(&shared);
        if operations > limit {
            return Err(NotUnrolled::TooLarge(operations));
        }
        let given: Vec<NodeId> =
            numbers.iter().map(|row| g.symbol(Symbol::Multiplier(*row as u32))).collect();
        let delta = solver.correct(g, &given);
        // A program of its own: parts that it shares with the other save nothing.
        let corrected = share_parts(g, &[&delta[..], &checked].concat());
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
    guards
        .iter()
        .zip(nodes.chunks(2))
        .map(|(guard, new)| Guard { pivot: new[0], scale: new[1], ..*guard })
        .collect()
}

/// The equations in short forms.
struct CollectedEquations {
    mass: Vec<Vec<NodeId>>,
    force: Vec<NodeId>,
    jacobian: Vec<Vec<NodeId>>,
    gamma: Vec<NodeId>,
    /// Diagonal elements of M that are written with a constant that can cancel, and that constant.
    squares: Vec<(NodeId, NodeId)>,
}

impl CollectedEquations {
    fn new(g: &mut Graph, system: &ConstrainedEquations) -> Self {
        let (n, r) = (system.mass.len(), system.jacobian.len());
        let terms =
            [&system.mass.concat()[..], &system.jacobian.concat(), system.force, system.gamma].concat();
        let diagonal: Vec<NodeId> = (0..n).map(|i| system.mass[i][i]).collect();
        let short = collect_terms(g, &terms, &diagonal);
        let (rows, vectors) = short.nodes.split_at((n + r) * n);
        let mut mass: Vec<Vec<NodeId>> = rows.chunks(n.max(1)).map(<[NodeId]>::to_vec).collect();
        let jacobian = mass.split_off(n);
        let (force, gamma) = vectors.split_at(n);
        Self { mass, force: force.to_vec(), jacobian, gamma: gamma.to_vec(), squares: short.squares }
    }

    /// The better of all ways.
    fn solver(&self, g: &mut Graph, states: &States) -> Result<Solver, NotUnrolled> {
        let n = self.mass.len();
        let (mass, jacobian) = (SparseMatrix::new(g, &self.mass, n), SparseMatrix::new(g, &self.jacobian, n));
        let PartitionChoice::Partitions(candidates) = partitions(g, &jacobian, n) else {
            return Err(NotUnrolled::Redundant);
        };
        let way = |g: &mut Graph, choice: Option<&Partition>, most: usize| match choice {
            Some(partition) => NullSpace::new(g, &mass, &jacobian, partition, most)
                .map(|reduced| Solver(SolverKind::Blocks(Box::new(reduced)))),
            None => Solver::together(g, &self.mass, &self.jacobian),
        };
        let anywhere = Slopes::at(g, &jacobian, states.anywhere);
        let at = Slopes::at(g, &jacobian, &[states.likely, states.passed].concat());
        let priced = |choice, most| {
            // On a copy, so that what is not taken leaves no trace.
            let mut trial = g.clone();
            let solver = way(&mut trial, choice, most)?;
            let (accelerations, multipliers) = solver.solve(&mut trial, &self.force, &self.gamma);
            let guards = solver.guards().iter().flat_map(|guard| [guard.pivot, guard.scale]);
            let cost = trial.weight(&[accelerations, multipliers, guards.collect()].concat());
            let guards = self.guards(&mut trial, &solver);
            let vanishing: Vec<Guard> = guards
                .iter()
                .map(|guard| Guard { tolerance: guard.tolerance.min(VANISHED_DETERMINANT.powi(2)), ..*guard })
                .collect();
            let applies =
                [applies(&trial, &guards, states.likely), applies(&trial, &vanishing, states.passed)];
            let conditioning = choice.map_or(1.0, |p| anywhere.conditioning(&jacobian, p));
            Some(PricedSolution { choice, cost, applies, conditioning })
        };
        let tried = if g.len() > NODES_OF_LARGE_GRAPH { 2 } else { MOST_TRIALS };
        let worth = worth_trying(&candidates, &jacobian, (&at, states.likely.len()), tried);
        let together = priced(None, usize::MAX);
        let most = together.as_ref().map_or(usize::MAX, |way| g.len() + most_nodes(way.cost));
        let pattern = jacobian.pattern();
        let mut found: Vec<PricedSolution> = worth
            .into_iter()
            .filter(|partition| together.as_ref().is_none_or(|way| partition.may_cost(&pattern, way.cost)))
            .filter_map(|partition| priced(Some(partition), most))
            .collect();
        found.extend(together);
        let choice = prefer(found).ok_or(NotUnrolled::NoPivots)?;
        way(g, choice, usize::MAX).ok_or(NotUnrolled::NoPivots)
    }

    /// The guards outside of which the solution does not apply.
    fn guards(&self, g: &mut Graph, solver: &Solver) -> Vec<Guard> {
        let mut guards = solver.guards().to_vec();
        guards.extend(self.cancelled(g));
        let unseen: Vec<bool> = (0..self.jacobian.len()).map(|row| !solver.sees_length(g, row)).collect();
        guards.extend(lengths::guards(g, &self.jacobian, |row| unseen[row]));
        guards
    }

    /// Guards of the diagonal elements of M that can cancel.
    fn cancelled(&self, g: &Graph) -> Vec<Guard> {
        let diagonal = self.mass.iter().enumerate().map(|(i, row)| (i, row[i]));
        let written = diagonal.filter(|(_, element)| !g.is_constant(*element)).filter_map(|(i, element)| {
            let (_, constant) = self.squares.iter().find(|(square, _)| *square == element)?;
            Some(Guard {
                of: Guarded::Coordinate(i),
                pivot: element,
                scale: *constant,
                tolerance: LEAST_SHARE_OF_CONSTANT,
            })
        });
        written.collect()
    }
}

/// Nodes that the trial of a partition may add, beside a way of this cost.
fn most_nodes(cost: usize) -> usize {
    NODES_OF_TRIAL.0 * cost + NODES_OF_TRIAL.1
}

/// At which of the states no guard calls for the general solver.
pub(crate) fn applies(g: &Graph, guards: &[Guard], states: &[&dyn Bindings]) -> Vec<bool> {
    let roots: Vec<NodeId> = guards.iter().flat_map(|guard| [guard.pivot, guard.scale]).collect();
    let at = |state: &&dyn Bindings| {
        let values = g.evaluate(&roots, *state);
        let holds = |x: &Guard| values[x.pivot.index()].abs() > x.tolerance * values[x.scale.index()].abs();
        guards.iter().all(holds)
    };
    states.iter().map(at).collect()
}

/// The structurally cheapest of the partitions: `tried` of those that are regular where motions are likely to
/// be, the cheapest that is so where they begin, which are the first `likely` of the states, and the cheapest
/// of all.
fn worth_trying<'a>(
    candidates: &'a [Partition],
    jacobian: &SparseMatrix,
    (at, likely): (&Slopes, usize),
    tried: usize,
) -> Vec<&'a Partition> {
    let mut all: Vec<(Vec<bool>, &Partition)> = candidates
        .iter()
        .map(|partition| (at.regular(jacobian, partition, VANISHED_DETERMINANT), partition))
        .collect();
    let cheapest = all.first().map(|(_, partition)| *partition);
    // By what holds where motions begin, and by all; stable, so that the cheapest stay first among equals.
    all.sort_by(|(a, _), (b, _)| b[..likely].cmp(&a[..likely]));
    let beginning = all.first().map(|(_, partition)| *partition);
    all.sort_by(|(a, _), (b, _)| b.cmp(a));
    let mut worth: Vec<&Partition> = all.into_iter().take(tried).map(|(_, partition)| partition).collect();
    for other in [beginning, cheapest].into_iter().flatten() {
        if !worth.contains(&other) {
            worth.push(other);
        }
    }
    worth
}

/// A way to solve: by a partition, or q̈ and λ together.
struct PricedSolution<'a> {
    choice: Option<&'a Partition>,
    cost: usize,
    /// At which of the likely states it applies, and at which of those that are passed.
    applies: [Vec<bool>; 2],
    conditioning: f64,
}

/// Those that apply at the likeliest of the states, as far as they cost no more than so many times what is
/// cheapest.
fn applying(all: Vec<PricedSolution<'_>>, which: usize, times: f64) -> Vec<PricedSolution<'_>> {
    let cheapest = all.iter().map(|way| way.cost).min().unwrap_or(0);
    let affordable = |way: &&PricedSolution| way.cost as f64 <= times * cheapest as f64;
    let best = all.iter().filter(affordable).map(|way| way.applies[which].clone()).max().unwrap_or_default();
    all.into_iter().filter(|way| way.applies[which] == best).collect()
}

/// The partition to be taken, or q̈ and λ together (`Some(None)`) where that is cheaper; `None` where there
/// is no way at all.
fn prefer(found: Vec<PricedSolution<'_>>) -> Option<Option<&Partition>> {
    let is_good = |way: &PricedSolution| way.conditioning > POOR_CONDITIONING;
    let (good, poor): (Vec<PricedSolution>, Vec<PricedSolution>) = found.into_iter().partition(is_good);
    let all = if good.is_empty() { poor } else { good };
    let applying = [(0, COST_OF_LIKELY_STATES), (1, COST_OF_PASSED_STATES)]
        .into_iter()
        .fold(all, |all, (which, times)| applying(all, which, times));
    let cost = |way: &&PricedSolution| way.cost;
    let together = applying.iter().find(|way| way.choice.is_none()).map(|way| way.cost);
    let blocks = || applying.iter().filter(|way| way.choice.is_some());
    let cheapest = blocks().min_by_key(cost).map_or(usize::MAX, |way| way.cost);
    let near = blocks().filter(|way| way.cost as f64 <= COST_OF_CONDITIONING * cheapest as f64);
    let taken = near.min_by(|a, b| b.conditioning.total_cmp(&a.conditioning).then(a.cost.cmp(&b.cost)));
    match (taken, together) {
        (Some(way), together) if together.is_none_or(|cost| way.cost <= cost) => Some(way.choice),
        (_, Some(_)) => Some(None),
        _ => None,
    }
}
