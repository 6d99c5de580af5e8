//! Taylor series of a motion: from M q̈ = Q as a graph to programs that compute one coefficient after the
//! other.
//!
//! Every value x of the graph has coefficients x₀, x₁, … with x(t₀ + s τ) = Σ xₖ sᵏ. Those of
//! order 0 are its values at t₀. Those of order k follow from lower ones: linear operations coefficient by
//! coefficient, all others by a Cauchy sum Σ aⱼ bₖ₋ⱼ (`recurrence.rs`). M is not inverted as a
//! series: with M₀ = LDLᵀ factored once, the coefficients of q̈ come one by one from
//!
//! ```text
//! M₀ q̈ₖ = Qₖ − Σ Mⱼ q̈ₖ₋ⱼ   (j = 1 … k)
//! ```
//!
//! The inner parts j = 1 … k−1 of all Cauchy sums of order k are known once order k−1 is: they are
//! independent of each other and of everything else of order k. Each is a *lane* with a left and a right
//! factor; whoever runs the programs keeps the coefficients of all factors as rows, one column per lane, and
//! forms all sums of an order side by side. What is left is straight-line code ([`Series::next`]), linear in
//! what is new.
//!
//! With constraints λ has coefficients too, and coefficient k of M q̈ = Q + Φ_qᵀλ is solved together
//! with coefficient k + 2 of Φ = 0 (`constrained.rs`).
//!
//! Source: Moore, *Interval Analysis* (1966); Jorba, Zou, Experimental Mathematics 14 (2005) 99. The solution
//! order by order with one factorisation is that of Pryce, BIT 41 (2001) 364, and Nedialkov, Pryce, BIT 45
//! (2005) 561, for differential–algebraic equations.

mod constrained;
mod recurrence;

use std::collections::{BTreeMap, BTreeSet};

use crate::algebra::Factors;
use crate::calculus::{collect_terms, rebuild, substitute};
use crate::graph::{FunctionId, Graph, Node, NodeId, Symbol};
use crate::mechanics::{Equations, General, Solution};
use crate::schedule::{Program, Staging, schedule};

pub use constrained::{ConstrainedSeries, Solve};
use recurrence::{Expansion, Lane};

/// Programs for the Taylor coefficients of the coordinates, N of them.
#[derive(Clone, Debug)]
pub struct Series {
    /// What the recurrences need of order 0, over the model's graph, with q̈ as symbols.
    pub start: Program,
    /// Without constraints: q̈ (N), Dᵢ and Mᵢᵢ for every pivot of `Programs::accelerations`, then what
    /// `start` gives. Staged like the accelerations.
    pub begin: Option<Program>,
    /// Nodes of `next`.
    ///
    /// | symbol | meaning |
    /// |---|---|
    /// | `Coordinate(i)`, `Rate(i)`, `Time` | coefficients k of qᵢ, q̇ᵢ and t |
    /// | `Parameter(i)` | result i of `start` |
    /// | `Multiplier(i)` | Σ over j = 1 … k−1 of left factor j times right factor k−j of lane i |
    /// | `Input(0)`, `Input(1)` | k, 1/k |
    pub graph: Graph,
    /// Coefficients k ≥ 1: q̈ (N; none where there are constraints), left factors, then right factors of
    /// the lanes.
    pub next: Program,
    /// Number of lanes.
    pub lanes: usize,
    /// Whether some value is a choice (`if`, min, max, abs, signum): the series is that of the branch taken
    /// at its start.
    pub chooses: bool,
    /// What constraints add.
    pub constrained: Option<ConstrainedSeries>,
}

/// Why there is no series.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Unexpandable {
    /// A function that is known by its value and a few derivatives.
    Smooth(FunctionId),
    /// A pivot of M is identically zero: the coordinate's index.
    Singular(usize),
    /// Constraints repeat each other: λ is not unique.
    Redundant,
    /// Applied forces depend on the reactions.
    Friction,
    /// So many operations per coefficient.
    TooLarge(usize),
    /// M is left out as too large.
    NoMassMatrix,
}

/// Most operations of [`Series::start`], and of the function that computes the coefficients of one order. A
/// larger bound expands larger models, whose functions rustc takes longer to compile.
pub const MOST_OPERATIONS: usize = 3_000;

/// The series of a model's motions.
///
/// # Errors
/// Why they cannot be expanded.
pub fn expand(graph: &mut Graph, equations: &Equations) -> Result<Series, Unexpandable> {
    if equations.leaves_out_mass_matrix() {
        return Err(Unexpandable::NoMassMatrix);
    }
    // An expansion takes at least as many operations for each order: large models are not tried.
    let terms = [&equations.mass_matrix.concat()[..], &equations.generalized_force].concat();
    let operations = graph.operations(&terms);
    if operations > MOST_OPERATIONS {
        return Err(Unexpandable::TooLarge(operations));
    }
    match &equations.constraints {
        None => {
            let mut series = expand_free(graph, &equations.mass_matrix, &equations.generalized_force)?;
            series.begin = Some(begin(graph, equations, &series.start.results));
            Ok(series)
        }
        Some(c) => match c.solution {
            Solution::General(General::Redundant) => Err(Unexpandable::Redundant),
            Solution::General(General::Friction) => Err(Unexpandable::Friction),
            Solution::Unrolled(_) | Solution::General(General::NoPivots | General::TooLarge(_)) => {
                constrained::expand(graph, &equations.mass_matrix, &equations.generalized_force, c)
            }
        },
    }
}

/// [`Series::begin`].
fn begin(graph: &mut Graph, equations: &Equations, kept: &[NodeId]) -> Program {
    let value = |_: &mut Graph, symbol| match symbol {
        Symbol::Acceleration(i) => Some(equations.accelerations[i as usize]),
        _ => None,
    };
    let kept =
        substitute(graph, kept, &mut { value }).expect("nothing that is kept divides by accelerations");
    let pivots = equations.pivots.iter().flat_map(|p| [p.pivot, p.diagonal]).collect::<Vec<_>>();
    schedule(
        graph,
        "begin_series",
        &[&equations.accelerations, &pivots[..], &kept].concat(),
        Staging::Hoisted,
    )
}

/// The series of solutions of M q̈ = Q; N×N and N.
///
/// # Errors
/// Why they cannot be expanded.
pub fn expand_free(
    graph: &mut Graph,
    mass: &[Vec<NodeId>],
    force: &[NodeId],
) -> Result<Series, Unexpandable> {
    let (mass, force) = &short(graph, mass, force);
    let factors = Factors::new(graph, mass).map_err(Unexpandable::Singular)?;
    let [plain, turned] = [false, true].map(|one_angle| expand_with(graph, mass, force, &factors, one_angle));
    let (plain, turned) = (plain?, turned?);
    // Fewer lanes are less work where they are a block less; else products are, as nothing of them waits: a
    // double pendulum takes 5 % less.
    let blocks = |series: &Series| series.lanes.div_ceil(LANES_OF_BLOCK);
    let series = if blocks(&turned) < blocks(&plain) { turned } else { plain };
    let operations = series.operations().max(series.start.cost.total());
    if operations > MOST_OPERATIONS { Err(Unexpandable::TooLarge(operations)) } else { Ok(series) }
}

/// Lanes that are summed together at run time, as `dynamics_runtime::series::WIDTH`.
const LANES_OF_BLOCK: usize = 4;

/// [`expand_free`] by one way to write sums of products of sines and cosines.
fn expand_with(
    graph: &mut Graph,
    mass: &[Vec<NodeId>],
    force: &[NodeId],
    factors: &Factors,
    one_angle: bool,
) -> Result<Series, Unexpandable> {
    let mut e = Expansion::new(graph);
    e.one_angle = one_angle;
    let mut right = Vec::with_capacity(mass.len());
    for (row, force) in mass.iter().zip(force) {
        right.push(right_side(&mut e, row, *force)?);
    }
    let accelerations = factors.solve_elsewhere(&mut e, &right);
    for (i, coefficient) in accelerations.iter().enumerate() {
        let symbol = e.base.symbol(Symbol::Acceleration(i as u32));
        e.know(symbol, *coefficient);
    }
    finish(e, &accelerations)
}

/// Qₖ − Σ Mⱼ q̈ₖ₋ⱼ of one row.
fn right_side(e: &mut Expansion<'_>, row: &[NodeId], force: NodeId) -> Result<NodeId, Unexpandable> {
    let mut sum = e.coefficient(force)?;
    for (j, entry) in row.iter().enumerate() {
        if e.is_constant(*entry) {
            continue;
        }
        let acceleration = e.base.symbol(Symbol::Acceleration(j as u32));
        let (of_entry, known) = (e.coefficient(*entry)?, e.kept(acceleration));
        let (last, inner) = (e.order.mul(of_entry, known), e.lane(*entry, acceleration));
        sum = e.order.sub(sum, inner);
        sum = e.order.sub(sum, last);
    }
    Ok(sum)
}

/// Everything as programs.
fn finish(mut e: Expansion<'_>, accelerations: &[NodeId]) -> Result<Series, Unexpandable> {
    let Compact { mut roots, factors } = Compact::new(&mut e, &[accelerations])?;
    roots.push(factors);
    let kept = forget(&e.kept, &mut [(&mut e.order, &mut roots)]);
    let (lanes, results) = (roots[1].len() / 2, roots.concat());
    let Expansion { base, order: graph, chooses, .. } = e;
    let next = schedule(&graph, "series_next", &results, Staging::Inline);
    let start = schedule(base, "series_start", &kept, Staging::Inline);
    Ok(Series { start, begin: None, graph, next, lanes, chooses, constrained: None })
}

/// What is needed of an expansion: recurrences that were set up may have become superfluous.
struct Compact {
    /// The requested values, with lanes numbered anew.
    roots: Vec<Vec<NodeId>>,
    /// Coefficients of the left factors of all lanes, then those of the right ones.
    factors: Vec<NodeId>,
}

impl Compact {
    /// Finds the lanes that `roots` need, and those that their factors need; the others are left out.
    fn new(e: &mut Expansion<'_>, roots: &[&[NodeId]]) -> Result<Self, Unexpandable> {
        let mut used: BTreeMap<u32, [NodeId; 2]> = BTreeMap::new();
        let mut open = roots.concat();
        while !open.is_empty() {
            let found = symbols(&e.order, &open, lane_of);
            open.clear();
            for lane in found.into_iter().filter(|lane| !used.contains_key(lane)).collect::<Vec<u32>>() {
                let Lane { left, weighted, right } = e.lanes()[lane as usize];
                let left = if weighted { e.weighted(left)? } else { e.coefficient(left)? };
                let right = e.coefficient(right)?;
                open.extend([left, right]);
                used.insert(lane, [left, right]);
            }
        }
        let places: BTreeMap<u32, u32> = used.keys().zip(0..).map(|(lane, place)| (*lane, place)).collect();
        let by = |symbol| lane_of(symbol).map(|lane| Symbol::Multiplier(places[&lane]));
        let roots = roots.iter().map(|nodes| renamed(&mut e.order, nodes, by)).collect();
        let sides = [0, 1].map(|side| used.values().map(|factors| factors[side]).collect::<Vec<NodeId>>());
        Ok(Self { roots, factors: renamed(&mut e.order, &sides.concat(), by) })
    }
}

fn lane_of(symbol: Symbol) -> Option<u32> {
    if let Symbol::Multiplier(lane) = symbol { Some(lane) } else { None }
}

/// Leaves out values at order 0 that nothing reads any more, in graphs with what is asked of them: those that
/// are left.
fn forget(kept: &[NodeId], graphs: &mut [(&mut Graph, &mut Vec<Vec<NodeId>>)]) -> Vec<NodeId> {
    let place_of = |symbol| if let Symbol::Parameter(place) = symbol { Some(place) } else { None };
    let used: BTreeSet<u32> =
        graphs.iter().flat_map(|(g, roots)| symbols(g, &roots.concat(), place_of)).collect();
    let places: BTreeMap<u32, u32> = used.iter().zip(0..).map(|(old, new)| (*old, new)).collect();
    for (g, roots) in graphs {
        for nodes in roots.iter_mut() {
            *nodes =
                renamed(g, nodes, |symbol| place_of(symbol).map(|place| Symbol::Parameter(places[&place])));
        }
    }
    used.into_iter().map(|place| kept[place as usize]).collect()
}

/// Nodes with other symbols, operation by operation as they are: their order was chosen.
fn renamed(g: &mut Graph, nodes: &[NodeId], by: impl Fn(Symbol) -> Option<Symbol>) -> Vec<NodeId> {
    let same =
        |g: &Graph, id| matches!(g.node(id), Node::Symbol(old) if by(old).is_none_or(|new| new == old));
    let cone = g.cone(nodes);
    if cone.iter().all(|id| !matches!(g.node(*id), Node::Symbol(_)) || same(g, *id)) {
        return nodes.to_vec();
    }
    let mut new: BTreeMap<NodeId, NodeId> = BTreeMap::new();
    for id in cone {
        let node = g.node(id);
        let moved = node.children().any(|child| new[&child] != child);
        let renamed = match node {
            Node::Symbol(symbol) => by(symbol).map_or(id, |symbol| g.symbol(symbol)),
            _ if !moved => id,
            Node::Add(a, b) => g.add_exactly(new[&a], new[&b]),
            Node::Sub(a, b) => g.sub_exactly(new[&a], new[&b]),
            Node::Mul(a, b) => g.mul_exactly(new[&a], new[&b]),
            node => rebuild(g, node, &|child| new[&child]).expect("nothing is divided by in a recurrence"),
        };
        new.insert(id, renamed);
    }
    nodes.iter().map(|id| new[id]).collect()
}

/// What `pick` makes of the symbols of these nodes.
fn symbols(g: &Graph, nodes: &[NodeId], pick: impl Fn(Symbol) -> Option<u32>) -> BTreeSet<u32> {
    let all = g.cone(nodes).into_iter().filter_map(|id| match g.node(id) {
        Node::Symbol(symbol) => pick(symbol),
        _ => None,
    });
    all.collect()
}

/// Computes the factors of all lanes: the expansion is complete then.
fn complete(e: &mut Expansion<'_>) -> Result<(), Unexpandable> {
    let mut at = 0;
    // Factors may bring further lanes with them.
    while let Some(Lane { left, right, .. }) = e.lanes().get(at).copied() {
        e.coefficient(left)?;
        e.coefficient(right)?;
        at += 1;
    }
    Ok(())
}

/// M and Q in shorter forms, in which squares of sine and cosine are put together: every product less is a
/// lane less.
fn short(graph: &mut Graph, mass: &[Vec<NodeId>], force: &[NodeId]) -> (Vec<Vec<NodeId>>, Vec<NodeId>) {
    let n = mass.len();
    let diagonal: Vec<NodeId> = (0..n).map(|i| mass[i][i]).collect();
    let mut collected = collect_terms(graph, &[&mass.concat(), force].concat(), &diagonal).nodes;
    let force = collected.split_off(n * n);
    (collected.chunks(n.max(1)).map(<[NodeId]>::to_vec).collect(), force)
}
