//! Taylor series of a motion: from M q̈ = Q as a graph to programs that compute one coefficient after the other.
//!
//! Every value x of the graph has coefficients x₀, x₁, … with x(t₀ + s τ) = Σ xₖ sᵏ. Those of order 0 are its values at t₀. Those of order k
//! follow from lower ones: linear operations coefficient by coefficient, all others by a Cauchy sum Σ aⱼ bₖ₋ⱼ (`recurrence.rs`). M is not
//! inverted as a series: with M₀ = LDLᵀ factored once, the coefficients of q̈ come one by one from
//!
//! ```text
//! M₀ q̈ₖ = Qₖ − Σ Mⱼ q̈ₖ₋ⱼ   (j = 1 … k)
//! ```
//!
//! The inner parts j = 1 … k−1 of all Cauchy sums of order k are known once order k−1 is: they are independent of each other and of everything else
//! of order k. Each is a *lane* with a left and a right factor; whoever runs the programs keeps the coefficients of all factors as rows, one
//! column per lane, and forms all sums of an order side by side. What is left is straight-line code ([`Series::next`]), linear in what is new.
//!
//! With constraints λ has coefficients too, and coefficient k of M q̈ = Q + Φ_qᵀλ is solved together with coefficient k + 2 of Φ = 0
//! (`constrained.rs`).
//!
//! Source: Moore, *Interval Analysis* (1966); Jorba, Zou, Experimental Mathematics 14 (2005) 99. The solution order by order with one
//! factorisation is that of Pryce, BIT 41 (2001) 364, and Nedialkov, Pryce, BIT 45 (2005) 561, for differential–algebraic equations.

mod constrained;
mod recurrence;

use crate::algebra::Factors;
use crate::graph::{FunctionId, Graph, NodeId, Symbol};
use crate::mechanics::{Equations, General, Solution};
use crate::schedule::{Program, Staging, schedule};

pub use constrained::{Constrained, Solve};
use recurrence::{Expansion, Lane};

/// Programs for the Taylor coefficients of the coordinates, N of them.
#[derive(Clone, Debug)]
pub struct Series {
    /// What the recurrences need of order 0, over the model's graph, with q̈ as symbols.
    pub start: Program,
    /// Nodes of `next`.
    ///
    /// | symbol | meaning |
    /// |---|---|
    /// | `Coordinate(i)`, `Rate(i)`, `Time` | coefficients k of qᵢ, q̇ᵢ and t |
    /// | `Parameter(i)` | result i of `start` |
    /// | `Multiplier(i)` | Σ over j = 1 … k−1 of left factor j times right factor k−j of lane i |
    /// | `Input(0)`, `Input(1)` | k, 1/k |
    pub graph: Graph,
    /// Coefficients k ≥ 1: q̈ (N; none where there are constraints), left factors, then right factors of the lanes.
    pub next: Program,
    /// Number of lanes.
    pub lanes: usize,
    /// Whether some value is a choice (`if`, min, max, abs, signum): the series is that of the branch taken at its start.
    pub chooses: bool,
    /// What constraints add.
    pub constrained: Option<Constrained>,
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
}

/// Most operations of [`Series::start`] and of what gives one order, which are one function.
pub const LIMIT: usize = 3_000;

/// The series of a model's motions.
///
/// # Errors
/// Why they cannot be expanded.
pub fn expand(graph: &mut Graph, equations: &Equations) -> Result<Series, Unexpandable> {
    // What takes so many by itself takes more order by order: large models are not expanded in vain.
    let terms = [&equations.mass_matrix.concat()[..], &equations.generalized_force].concat();
    let operations = graph.operations(&terms);
    if operations > LIMIT {
        return Err(Unexpandable::TooLarge(operations));
    }
    match &equations.constraints {
        None => expand_free(graph, &equations.mass_matrix, &equations.generalized_force),
        Some(c) => match c.solution {
            Solution::General(General::Redundant) => Err(Unexpandable::Redundant),
            Solution::General(General::Friction) => Err(Unexpandable::Friction),
            Solution::Unrolled(_) | Solution::General(General::NoPivots | General::TooLarge(_)) => {
                constrained::expand(graph, &equations.mass_matrix, &equations.generalized_force, c)
            }
        },
    }
}

/// The series of solutions of M q̈ = Q; N×N and N.
///
/// # Errors
/// Why they cannot be expanded.
pub fn expand_free(graph: &mut Graph, mass: &[Vec<NodeId>], force: &[NodeId]) -> Result<Series, Unexpandable> {
    let factors = Factors::new(graph, mass).map_err(Unexpandable::Singular)?;
    let mut e = Expansion::new(graph);
    let mut right = Vec::with_capacity(mass.len());
    for (row, force) in mass.iter().zip(force) {
        right.push(right_side(&mut e, row, *force)?);
    }
    let accelerations = factors.solve_elsewhere(&mut e, &right);
    for (i, coefficient) in accelerations.iter().enumerate() {
        let symbol = e.base.symbol(Symbol::Acceleration(i as u32));
        e.know(symbol, *coefficient);
    }
    finish(e, accelerations)
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

/// The factors of all lanes, and everything as programs.
fn finish(mut e: Expansion<'_>, accelerations: Vec<NodeId>) -> Result<Series, Unexpandable> {
    let factors = factors(&mut e)?;
    let lanes = e.lanes().len();
    let results = [accelerations, factors].concat();
    let Expansion { base, order: graph, kept, chooses, .. } = e;
    let next = schedule(&graph, "series_next", &results, Staging::Inline);
    let start = schedule(base, "series_start", &kept, Staging::Inline);
    let operations = next.cost.total().max(start.cost.total());
    if operations > LIMIT {
        return Err(Unexpandable::TooLarge(operations));
    }
    Ok(Series { start, graph, next, lanes, chooses, constrained: None })
}

/// Coefficients of the left factors of all lanes, then those of the right ones.
fn factors(e: &mut Expansion<'_>) -> Result<Vec<NodeId>, Unexpandable> {
    // Factors may bring further lanes with them.
    let (mut left, mut right) = (Vec::new(), Vec::new());
    while let Some(Lane { left: of_left, weighted, right: of_right }) = e.lanes().get(left.len()).copied() {
        left.push(if weighted { e.weighted(of_left)? } else { e.coefficient(of_left)? });
        right.push(e.coefficient(of_right)?);
    }
    left.append(&mut right);
    Ok(left)
}
