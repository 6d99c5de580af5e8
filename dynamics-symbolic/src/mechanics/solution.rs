//! The equations of motion solved for q̈ and λ: M q̈ = Q by LDLᵀ, and with constraints M q̈ − Φ_qᵀλ = Q, Φ_q
//! q̈ = γ by whatever order of elimination is cheapest, on the graph or, where that fails, at run time.

use crate::algebra::{
    ArticulatedForm, ConstrainedEquations, Factors, NotUnrolled, Solver, States, Stationary, Unrolled,
    applies, unroll,
};
use crate::calculus::directional;
use crate::graph::{Dependence, Graph, NodeId};

use super::constraints::{ConstraintTerms, reaction};
use super::equations::{General, Jacobians, NoDerivatives, Pivot, Released, Solution, Underivable};
use super::inverse::{Failure, Residual, SolvedFor, SweepDirection, jacobians, residual_by_entries};
use super::lagrange::Inertia;
use super::limits::MOST_OPERATIONS;
use super::model::Constraint;
use super::released::released;
use super::velocity_form::along_motion;

/// What is known of the states that the constraints admit before anything is derived.
#[derive(Clone, Copy, Default)]
pub struct Manifold<'a> {
    /// States on it, if any were found, by which an elimination is chosen.
    pub states: States<'a>,
    /// Rows repeat each other, everywhere or on the manifold.
    pub redundant: bool,
}

/// How many times cheaper than LDLᵀ of M articulated-body elimination has to be. One joint waits for the
/// next there, whereas the columns of M are independent of each other: a cart with ten links took 1.2 times
/// as long, with half of the operations.
const ARTICULATED_GAIN: f64 = 2.0;
/// The same for rod-force elimination, which divides by every mass. A gain of one or two operations does not
/// pay for that.
const ROD_FORCE_GAIN: f64 = 1.5;

/// The solved equations.
pub(super) enum Solved {
    /// M⁻¹Q, without constraints.
    Free {
        accelerations: Vec<NodeId>,
        pivots: Vec<(usize, NodeId, NodeId)>,
        /// What solves for other right-hand sides, where speeds lead.
        solver: Option<Box<Solver>>,
    },
    /// With constraints, on the graph.
    Unrolled(Box<Unrolled>, Box<Solver>),
    /// With constraints, at run time.
    General(General),
}

/// A part of the residual by inverse dynamics, and how it is best swept.
pub(super) type Swept<'a> = (Residual<'a>, SweepDirection);

impl Solved {
    /// Solves equations without constraints, through the articulated form where that is shorter than through
    /// M.
    ///
    /// # Errors
    /// A mass matrix that is singular in every state.
    pub(super) fn free(
        g: &mut Graph,
        inertia: &Inertia,
        articulated_form: &dyn Fn(&mut Graph) -> Option<ArticulatedForm>,
    ) -> Result<Self, Underivable> {
        let through_mass = |g: &mut Graph| {
            let factors = Factors::new(g, &inertia.mass)?;
            let unknowns = factors.solve(g, &inertia.force);
            let pivots = factors.pivots().map(|(i, pivot)| (i, pivot, inertia.mass[i][i])).collect();
            Ok(Stationary { unknowns, pivots })
        };
        let through_bodies = |g: &mut Graph| articulated_form(g).and_then(|form| form.solve(g).ok());
        let through_rods = |g: &mut Graph| articulated_form(g).and_then(|form| form.solve_for_rod_forces(g));
        if inertia.left_out > 0 {
            let form = articulated_form(g).ok_or(Underivable::TooLarge(inertia.left_out))?;
            let solved = form.solve_for_rod_forces(g).map_or_else(|| form.solve(g), Ok);
            let Stationary { unknowns, pivots } = solved.map_err(Underivable::Singular)?;
            return Ok(Self::Free { accelerations: unknowns, pivots, solver: None });
        }
        // All on copies, so that what is not taken leaves no trace.
        let weight = |solve: &dyn Fn(&mut Graph) -> Option<Stationary>| {
            let mut trial = g.clone();
            let solved = solve(&mut trial)?;
            let pivots = solved.pivots.iter().flat_map(|(_, pivot, diagonal)| [*pivot, *diagonal]);
            Some(trial.weight(&[solved.unknowns.clone(), pivots.collect()].concat()))
        };
        let mass = weight(&|g| through_mass(g).ok());
        let shorter = |weight: Option<usize>, serial: f64| {
            weight.is_some_and(|weight| mass.is_none_or(|mass| serial * (weight as f64) < mass as f64))
        };
        let solved = if shorter(weight(&through_rods), ROD_FORCE_GAIN) {
            through_rods(g)
        } else if shorter(weight(&through_bodies), ARTICULATED_GAIN) {
            through_bodies(g)
        } else {
            None
        };
        let solved = solved.map_or_else(|| through_mass(g), Ok);
        let Stationary { unknowns, pivots } = solved.map_err(Underivable::Singular)?;
        Ok(Self::Free { accelerations: unknowns, pivots, solver: None })
    }

    /// Solves equations with constraints. Inertia is then a matter of the directions that they leave.
    pub(super) fn constrained(
        g: &mut Graph,
        inertia: &Inertia,
        rows: &ConstraintTerms,
        manifold: &Manifold,
    ) -> Self {
        if inertia.force.iter().any(|f| g.dependence(*f).on(Dependence::MULTIPLIERS)) {
            return Self::General(General::Friction);
        }
        if manifold.redundant {
            return Self::General(General::Redundant);
        }
        let numbers: Vec<usize> = (0..rows.named.len()).collect();
        let system = ConstrainedEquations {
            mass: &inertia.mass,
            force: &inertia.force,
            jacobian: &rows.jacobian,
            gamma: &rows.gamma,
            numbers: &numbers,
        };
        match unroll(g, &system, &manifold.states, MOST_OPERATIONS) {
            Ok((unrolled, solver)) => Self::Unrolled(Box::new(unrolled), Box::new(solver)),
            Err(NotUnrolled::Redundant) => Self::General(General::Redundant),
            Err(NotUnrolled::NoPivots) => Self::General(General::NoPivots),
            Err(NotUnrolled::TooLarge(operations)) => Self::General(General::TooLarge(operations)),
        }
    }

    /// q̈ and pivots of a model without constraints.
    pub(super) fn free_results(&self) -> Vec<NodeId> {
        let Self::Free { accelerations, pivots, .. } = self else { return Vec::new() };
        let pivots = pivots.iter().flat_map(|(_, pivot, diagonal)| [*pivot, *diagonal]);
        accelerations.iter().copied().chain(pivots).collect()
    }

    /// q̈, then λ; `None` where the general solver finds them.
    pub(super) fn unknowns(&self) -> Option<Vec<NodeId>> {
        match self {
            Self::Free { accelerations, .. } => Some(accelerations.clone()),
            Self::Unrolled(unrolled, _) => {
                Some([unrolled.accelerations.as_slice(), &unrolled.multipliers].concat())
            }
            Self::General(_) => None,
        }
    }

    /// All that a program of the solution returns; `None` where the general solver finds it.
    pub(super) fn results(&self) -> Option<Vec<NodeId>> {
        let Self::Unrolled(unrolled, _) = self else {
            return self.free_accelerations().map(|_| self.free_results());
        };
        let guards = unrolled.guards.iter().flat_map(|guard| [guard.pivot, guard.scale]);
        Some(self.unknowns()?.into_iter().chain(guards).collect())
    }

    /// At which of the states where motions are likely to begin it applies; where no general solver stands
    /// behind it, at all of them.
    pub(super) fn applies(&self, g: &Graph, states: &States) -> Vec<bool> {
        match self {
            Self::Unrolled(unrolled, _) => applies(g, &unrolled.guards, states.likely),
            Self::Free { .. } | Self::General(_) => vec![true; states.likely.len()],
        }
    }

    /// The inertia of the speeds, where they lead.
    pub(super) fn led(&self, g: &mut Graph) -> Option<Vec<Vec<NodeId>>> {
        match self {
            Self::Free { solver: Some(solver), .. } | Self::Unrolled(_, solver) => Some(solver.led(g).0),
            _ => None,
        }
    }

    /// q̈ of a model without constraints.
    pub(super) fn free_accelerations(&self) -> Option<&[NodeId]> {
        match self {
            Self::Free { accelerations, .. } => Some(accelerations),
            Self::Unrolled(..) | Self::General(_) => None,
        }
    }

    /// Pivots of M that are not plain numbers, with the elements of the diagonal that they came from.
    pub(super) fn pivots(&self, g: &Graph) -> Vec<Pivot> {
        let Self::Free { pivots, .. } = self else { return Vec::new() };
        let all = pivots.iter().map(|(i, pivot, diagonal)| Pivot {
            coordinate: *i,
            pivot: *pivot,
            diagonal: *diagonal,
        });
        all.filter(|p| g.as_number(p.pivot).is_none()).collect()
    }

    /// The equations with some constraints released, where those with all of them are solved on the graph, or
    /// are not because switched ones are dependent while all are on: end stops of one coordinate never are.
    pub(super) fn released(
        &self,
        g: &mut Graph,
        inertia: &Inertia,
        rows: &ConstraintTerms,
        constraints: &[Constraint],
        manifold: &Manifold,
    ) -> Vec<Released> {
        match self {
            Self::Unrolled(unrolled, _) => {
                released(g, inertia, rows, constraints, &manifold.states, Some(unrolled))
            }
            Self::General(General::Redundant) if !manifold.redundant => {
                released(g, inertia, rows, constraints, &manifold.states, None)
            }
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
        rows: Option<&ConstraintTerms>,
        (swept, sweep): Swept,
        size: (usize, usize),
    ) -> Result<Result<Jacobians, NoDerivatives>, Underivable> {
        match (self, rows) {
            (Self::Free { accelerations, solver: Some(solver), .. }, _) => {
                let entered: Residual = &|g| residual_by_entries(g, &inertia.mass, &inertia.force);
                let solve = |g: &mut Graph, right: &[NodeId]| solver.solve(g, right, &[]).0;
                let solved = SolvedFor { accelerations, multipliers: &[], solve: &solve };
                withheld(jacobians(g, &[swept, entered], sweep, &solved, size))
            }
            (Self::Free { solver: None, .. }, _) if inertia.left_out > 0 => {
                Ok(Err(NoDerivatives::NoMassMatrix))
            }
            (Self::Free { accelerations, solver: None, .. }, _) => {
                // Pivots stand in the graph already, whichever way they were found.
                let factors = Factors::new(g, &inertia.mass).map_err(Underivable::Singular)?;
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
            _ => Ok(Err(NoDerivatives::General)),
        }
    }
}

/// M q̈ − Q − Φ_qᵀλ joined by Φ̈, from M q̈ − Q.
pub(super) fn with_constraints(g: &mut Graph, motion: Vec<NodeId>, rows: &ConstraintTerms) -> Vec<NodeId> {
    let reaction = reaction(g, &rows.named, rows.holonomic, motion.len());
    let mut residual: Vec<NodeId> = motion.into_iter().zip(reaction).map(|(m, r)| g.sub(m, r)).collect();
    residual.extend(directional(g, &rows.velocity_residual, &mut along_motion));
    residual
}

/// Jacobians may be missing, denominators may not be zero.
fn withheld(jacobians: Result<Jacobians, Failure>) -> Result<Result<Jacobians, NoDerivatives>, Underivable> {
    match jacobians {
        Ok(jacobians) => Ok(Ok(jacobians)),
        Err(Failure::TooLarge(nodes)) => Ok(Err(NoDerivatives::TooLarge(nodes))),
        Err(Failure::ZeroDenominator) => Err(Underivable::ZeroDenominator),
    }
}
