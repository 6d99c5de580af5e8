//! Series of motions with constraints: an equation system of index 3, solved directly.
//!
//! Coefficient k of M q̈ − Φ_qᵀλ = Q and coefficient K = k + 2 of Φ = 0 are linear in what is new, q̈ₖ and
//! λₖ, with one matrix for all orders:
//!
//! ```text
//! ⎡ M₀   −Φ_q₀ᵀ ⎤ ⎡ q̈ₖ ⎤   ⎡ what M q̈ − Q − Φ_qᵀλ is at order k with q̈ₖ = λₖ = 0, negative ⎤
//! ⎣ Φ_q₀    0   ⎦ ⎣ λₖ ⎦ = ⎣ what Φ is at order K with q_K = 0, negative, over τ²/(K(K−1))  ⎦
//!
//! q_K = τ²/(K(K−1)) q̈ₖ
//! ```
//!
//! so that Φ = 0 holds in every coefficient, and neither γ nor a product Φ_q q̈ is ever formed. What Φ is
//! made of is therefore expanded two orders ahead of everything else: coefficients of order k that the
//! equations of motion share with it are read, not computed again. Rows A q̇ + b of nonholonomic constraints
//! take part as A q̈ = γ, order by order.
//!
//! Source: Pryce, BIT 41 (2001) 364; Nedialkov, Pryce, BIT 45 (2005) 561; BIT 47 (2007) 191.

use std::collections::BTreeMap;

use crate::algebra::{Guard, MinimumDegree};
use crate::calculus::substitute;
use crate::graph::{Graph, NodeId, Symbol};
use crate::mechanics::{ConstraintEquations, reaction};
use crate::schedule::{Program, Staging, schedule};

use super::recurrence::{DetachedExpansion, Expansion};
use super::{
    Compact, MOST_OPERATIONS, Series, Unexpandable, complete, forget, renamed, right_side, short, symbols,
};

/// Programs for N coordinates under R rows of constraints, the first H of them holonomic.
///
/// In [`Series::graph`] there are further symbols: `Acceleration(i)`, coefficient k of q̈ᵢ, or of λ where i ≥
/// N; `Mode(i)`, coefficient k of result i of [`ConstrainedSeries::ahead`] after the factors.
#[derive(Clone, Debug)]
pub struct ConstrainedSeries {
    /// Nodes of `residue` and `ahead`, with the symbols of [`Series::graph`] for order K in the place of k
    /// and lanes of their own.
    pub graph: Graph,
    /// Coefficient K ≥ 3 of Φ with q_K = 0; H.
    pub residue: Program,
    /// Coefficients K ≥ 1: left factors, then right factors of the lanes, then what [`Series::next`] and
    /// `right` read.
    pub ahead: Program,
    /// Number of lanes.
    pub lanes: usize,
    /// Number of coefficients that are read.
    pub shared: usize,
    /// Right-hand sides of order k ≥ 1 in [`Series::graph`]: of the equations of motion (N), of nonholonomic
    /// rows (R − H).
    pub right: Program,
    /// Solves for q̈ₖ and λₖ in [`Series::graph`]; `None` where every order of elimination meets a pivot that
    /// is zero in every state.
    pub solve: Option<Solve>,
}

/// The solution by LDLᵀ.
#[derive(Clone, Debug)]
pub struct Solve {
    /// q̈ₖ (N) and λₖ (R); `Acceleration(i)` stands for right-hand side i here.
    pub program: Program,
    /// Pivots to check; pivot and scale of each are the last results of [`Series::start`].
    pub guards: Vec<Guard>,
}

/// The series of solutions of M q̈ = Q + Φ_qᵀλ, Φ = 0; N×N and N.
pub(super) fn expand(
    graph: &mut Graph,
    mass: &[Vec<NodeId>],
    force: &[NodeId],
    c: &ConstraintEquations,
) -> Result<Series, Unexpandable> {
    let (n, r) = (mass.len(), c.rows.len());
    let (mass, force) = short(graph, mass, force);
    let (mass, force) = (&mass, &force);
    let ahead = TwoOrdersAhead::new(graph, &c.residual)?;
    let reaction = reaction(graph, &c.rows, c.holonomic, n);
    let solver = MinimumDegree::new(graph, mass, &c.jacobian);
    let mut e = Expansion::after(graph, &ahead.early);
    let unknowns: Vec<NodeId> = (0..n + r).map(|i| e.order.symbol(Symbol::Acceleration(i as u32))).collect();
    for (i, unknown) in unknowns.iter().enumerate() {
        let symbol = if i < n { Symbol::Acceleration(i as u32) } else { Symbol::Multiplier((i - n) as u32) };
        let symbol = e.base.symbol(symbol);
        e.know(symbol, *unknown);
    }
    let mut right = Vec::with_capacity(n + r);
    for ((row, force), reaction) in mass.iter().zip(force).zip(reaction) {
        let known = right_side(&mut e, row, *force)?;
        let reaction = e.coefficient(reaction)?;
        let reaction = without(&mut e.order, &[reaction], |s| matches!(s, Symbol::Acceleration(_)))[0];
        right.push(e.order.add(known, reaction));
    }
    for (row, gamma) in c.jacobian.iter().zip(&c.gamma).skip(c.holonomic) {
        right.push(right_side(&mut e, row, *gamma)?);
    }
    let solved = solver.as_ref().map(|solver| solver.solve_elsewhere(&mut e, &unknowns));
    complete(&mut e)?;
    let asked: [&[NodeId]; 2] = [&right, solved.as_deref().unwrap_or_default()];
    let Compact { mut roots, factors } = Compact::new(&mut e, &asked)?;
    roots.push(factors);
    // What of the shared coefficients is still read.
    let read = symbols(&e.order, &roots.concat(), shared_of);
    let shared: Vec<NodeId> = read.iter().map(|place| e.read[*place as usize]).collect();
    let places: BTreeMap<u32, u32> = read.into_iter().zip(0..).collect();
    for nodes in &mut roots {
        *nodes =
            renamed(&mut e.order, nodes, |symbol| shared_of(symbol).map(|old| Symbol::Mode(places[&old])));
    }
    let Expansion { base, mut order, kept, mut chooses, .. } = e;
    let (mut of_places, mut asked_ahead) = ahead.compact(base, &shared)?;
    chooses |= of_places.chooses;
    let kept = forget(&kept, &mut [(&mut order, &mut roots), (&mut of_places.order, &mut asked_ahead)]);
    let Expansion { base, order: graph, .. } = of_places;
    let guards = solver.map_or_else(Vec::new, |solver| solver.guards);
    let checked = guards.iter().flat_map(|guard| [guard.pivot, guard.scale]);
    let start: Vec<NodeId> = kept.into_iter().chain(checked).collect();
    let inline =
        |graph: &Graph, name: &str, results: &[NodeId]| schedule(graph, name, results, Staging::Inline);
    let start = inline(base, "series_start", &start);
    let [residue, factors_ahead, shared_ahead] = &asked_ahead[..] else {
        unreachable!("three were asked for")
    };
    let constrained = ConstrainedSeries {
        residue: inline(&graph, "series_residue", residue),
        ahead: inline(&graph, "series_ahead", &[&factors_ahead[..], shared_ahead].concat()),
        lanes: factors_ahead.len() / 2,
        shared: shared_ahead.len(),
        right: inline(&order, "series_right", &roots[0]),
        solve: solved.map(|_| Solve { program: inline(&order, "series_solve", &roots[1]), guards }),
        graph,
    };
    let (next, lanes) = (inline(&order, "series_next", &roots[2]), roots[2].len() / 2);
    let constrained = Some(constrained);
    let series = Series { start, begin: None, graph: order, next, lanes, chooses, constrained };
    let operations = series.operations().max(series.start.cost.total());
    if operations > MOST_OPERATIONS { Err(Unexpandable::TooLarge(operations)) } else { Ok(series) }
}

impl Series {
    /// Number of Cauchy sums of one order.
    #[must_use]
    pub fn all_lanes(&self) -> usize {
        self.lanes + self.constrained.as_ref().map_or(0, |c| c.lanes)
    }

    /// Operations of one order, without its Cauchy sums.
    #[must_use]
    pub fn operations(&self) -> usize {
        let next = self.next.cost.total();
        self.constrained.as_ref().map_or(next, |c| {
            let solve = c.solve.as_ref().map_or(0, |solve| solve.program.cost.total());
            next + solve
                + [&c.residue, &c.ahead, &c.right].map(|program| program.cost.total()).iter().sum::<usize>()
        })
    }
}

/// The place of a coefficient that the other expansion has computed.
fn shared_of(symbol: Symbol) -> Option<u32> {
    if let Symbol::Mode(place) = symbol { Some(place) } else { None }
}

/// What is expanded two orders ahead.
struct TwoOrdersAhead {
    early: DetachedExpansion,
    residue: Vec<NodeId>,
}

impl TwoOrdersAhead {
    fn new(graph: &mut Graph, residual: &[NodeId]) -> Result<Self, Unexpandable> {
        let mut e = Expansion::new(graph);
        let mut residue = Vec::with_capacity(residual.len());
        for row in residual {
            residue.push(e.coefficient(*row)?);
        }
        let residue = without(&mut e.order, &residue, |s| matches!(s, Symbol::Coordinate(_) | Symbol::Time));
        complete(&mut e)?;
        Ok(Self { early: e.leave(), residue })
    }

    /// The residue, the factors of the lanes, and the coefficients that are shared.
    fn compact<'g>(
        self,
        base: &'g mut Graph,
        shared: &[NodeId],
    ) -> Result<(Expansion<'g>, Vec<Vec<NodeId>>), Unexpandable> {
        let mut e = self.early.resume(base);
        let mut of_shared = Vec::with_capacity(shared.len());
        for id in shared {
            of_shared.push(e.coefficient(*id)?);
        }
        let Compact { roots, factors } = Compact::new(&mut e, &[&self.residue, &of_shared])?;
        let [residue, shared] = <[_; 2]>::try_from(roots).expect("two were asked for");
        Ok((e, vec![residue, factors, shared]))
    }
}

/// Coefficients, which are linear in what is new, with some of that zero.
fn without(g: &mut Graph, coefficients: &[NodeId], new: impl Fn(Symbol) -> bool) -> Vec<NodeId> {
    let zero = g.zero();
    substitute(g, coefficients, &mut |_, symbol| new(symbol).then_some(zero))
        .expect("nothing is divided by what is new")
}
