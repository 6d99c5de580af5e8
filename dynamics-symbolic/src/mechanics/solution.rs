//! The equations of motion solved for q̈ and λ: M q̈ = Q by LDLᵀ, and with constraints M q̈ − Φ_qᵀλ = Q, Φ_q q̈ = γ by whatever order of
//! elimination is cheapest, on the graph or, where that fails, at run time.

use crate::algebra::{Constrained, Factors, Solver, Stuck, Unrolled, unroll};
use crate::calculus::directional;
use crate::graph::{Bindings, Dependence, Graph, NodeId};

use super::constraints::{Rows, reaction};
use super::derive::Underivable;
use super::equations::{General, Jacobians, Pivot, Released, Solution, Withheld};
use super::inverse::{Failure, Residual, SolvedFor, Sweep, jacobians, residual_by_entries};
use super::lagrange::Inertia;
use super::model::Constraint;
use super::released::released;
use super::velocity_form::along_motion;

/// What is known of the states that the constraints admit before anything is derived.
#[derive(Clone, Copy, Default)]
pub struct Manifold<'a> {
    /// States on it, if any were found: the best conditioned of nearly equally cheap eliminations is chosen there.
    pub states: &'a [&'a dyn Bindings],
    /// Rows repeat each other, everywhere or on the manifold.
    pub redundant: bool,
}

/// Operations of an unrolled solution above which the general solver, which works on arrays, takes over: what can be emitted.
const LIMIT: usize = 20_000;

/// The solved equations.
pub(super) enum Solved {
    /// M⁻¹Q, without constraints.
    Free { factors: Factors, accelerations: Vec<NodeId> },
    /// With constraints, on the graph.
    Unrolled(Box<Unrolled>, Box<Solver>),
    /// With constraints, at run time.
    General(General),
}

/// A part of the residual by inverse dynamics, and how it is best swept.
pub(super) type Swept<'a> = (Residual<'a>, Sweep);

impl Solved {
    /// Solves the equations.
    ///
    /// # Errors
    /// Without constraints, a mass matrix that is singular in every state. With them inertia is a matter of the directions that they leave.
    pub(super) fn new(
        g: &mut Graph,
        inertia: &Inertia,
        rows: Option<&Rows>,
        manifold: &Manifold,
    ) -> Result<Self, Underivable> {
        let Some(rows) = rows else {
            let factors = Factors::new(g, &inertia.mass).map_err(Underivable::Singular)?;
            let accelerations = factors.solve(g, &inertia.force);
            return Ok(Self::Free { factors, accelerations });
        };
        if inertia.force.iter().any(|f| g.dependence(*f).on(Dependence::MULTIPLIERS)) {
            return Ok(Self::General(General::Friction));
        }
        if manifold.redundant {
            return Ok(Self::General(General::Redundant));
        }
        let numbers: Vec<usize> = (0..rows.named.len()).collect();
        let system = Constrained {
            mass: &inertia.mass,
            force: &inertia.force,
            jacobian: &rows.jacobian,
            gamma: &rows.gamma,
            numbers: &numbers,
        };
        Ok(match unroll(g, &system, manifold.states, LIMIT) {
            Ok((unrolled, solver)) => Self::Unrolled(Box::new(unrolled), Box::new(solver)),
            Err(Stuck::Redundant) => Self::General(General::Redundant),
            Err(Stuck::NoPivots) => Self::General(General::NoPivots),
            Err(Stuck::TooLarge(operations)) => Self::General(General::TooLarge(operations)),
        })
    }

    /// q̈ of a model without constraints.
    pub(super) fn free_accelerations(&self) -> Option<&[NodeId]> {
        match self {
            Self::Free { accelerations, .. } => Some(accelerations),
            Self::Unrolled(..) | Self::General(_) => None,
        }
    }

    /// Pivots of M that are not plain numbers, with the elements of the diagonal that they came from.
    pub(super) fn pivots(&self, g: &Graph, mass: &[Vec<NodeId>]) -> Vec<Pivot> {
        let Self::Free { factors, .. } = self else { return Vec::new() };
        let all = factors.pivots().map(|(i, pivot)| Pivot { coordinate: i, pivot, diagonal: mass[i][i] });
        all.filter(|p| g.as_number(p.pivot).is_none()).collect()
    }

    /// The equations with some constraints released, where those with all of them are solved on the graph.
    pub(super) fn released(
        &self,
        g: &mut Graph,
        inertia: &Inertia,
        rows: &Rows,
        constraints: &[Constraint],
        manifold: &Manifold,
    ) -> Vec<Released> {
        match self {
            Self::Unrolled(unrolled, _) => released(g, inertia, rows, constraints, manifold.states, unrolled),
            Self::Free { .. } | Self::General(_) => Vec::new(),
        }
    }

    /// How equations with constraints are solved.
    pub(super) fn into_solution(self) -> Option<Solution> {
        match self {
            Self::Free { .. } => None,
            Self::Unrolled(unrolled, _) => Some(Solution::Unrolled(unrolled)),
            Self::General(reason) => Some(Solution::General(reason)),
        }
    }

    /// Derivatives of q̈ for so many inputs and parameters, from M q̈ − Q by inverse dynamics.
    pub(super) fn jacobians(
        &self,
        g: &mut Graph,
        inertia: &Inertia,
        rows: Option<&Rows>,
        (swept, sweep): Swept,
        size: (usize, usize),
    ) -> Result<Result<Jacobians, Withheld>, Underivable> {
        match (self, rows) {
            (Self::Free { factors, accelerations }, _) => {
                let entered: Residual = &|g| residual_by_entries(g, &inertia.mass, &inertia.force);
                let solve = |g: &mut Graph, right: &[NodeId]| factors.solve(g, right);
                let solved = SolvedFor { accelerations, multipliers: &[], solve: &solve };
                withheld(jacobians(g, &[swept, entered], sweep, &solved, size))
            }
            (Self::Unrolled(unrolled, solver), Some(rows)) => {
                let n = unrolled.accelerations.len();
                let joined = |g: &mut Graph, motion: Vec<NodeId>| with_constraints(g, motion, rows);
                let swept: Residual = &|g| {
                    let motion = swept(g);
                    joined(g, motion)
                };
                let entered: Residual = &|g| {
                    let motion = residual_by_entries(g, &inertia.mass, &inertia.force);
                    joined(g, motion)
                };
                let solve = |g: &mut Graph, right: &[NodeId]| solver.solve(g, &right[..n], &right[n..]).0;
                let (accelerations, multipliers) = (&unrolled.accelerations, &unrolled.multipliers);
                let solved = SolvedFor { accelerations, multipliers, solve: &solve };
                withheld(jacobians(g, &[swept, entered], sweep, &solved, size))
            }
            _ => Ok(Err(Withheld::General)),
        }
    }
}

/// M q̈ − Q − Φ_qᵀλ joined by Φ̈, from M q̈ − Q.
fn with_constraints(g: &mut Graph, motion: Vec<NodeId>, rows: &Rows) -> Vec<NodeId> {
    let reaction = reaction(g, rows, motion.len());
    let mut residual: Vec<NodeId> = motion.into_iter().zip(reaction).map(|(m, r)| g.sub(m, r)).collect();
    residual.extend(directional(g, &rows.velocity_residual, &mut along_motion));
    residual
}

/// Jacobians may be missing, denominators may not be zero.
fn withheld(jacobians: Result<Jacobians, Failure>) -> Result<Result<Jacobians, Withheld>, Underivable> {
    match jacobians {
        Ok(jacobians) => Ok(Ok(jacobians)),
        Err(Failure::TooLarge(nodes)) => Ok(Err(Withheld::TooLarge(nodes))),
        Err(Failure::ZeroDenominator) => Err(Underivable::ZeroDenominator),
    }
}
