//! Generalized speeds that need not be derivatives of coordinates, w = Y(q,t) q̇ + y(q,t): components of an
//! angular velocity in the body, the speed of a skate.
//!
//! With the constraints' rows below them, K = (Y; Φ_q; A), they determine all velocities:
//! K q̇ + k = (w; 0). Velocities are combinations of the columns of K⁻¹. Those of the speeds are B
//! (Kane's partial velocities), and since Φ_q B = 0 the reactions drop out of
//!
//!   (BᵀM B) ẇ = Bᵀ(Q − M s),    K s = (−Ẏq̇ − ẏ; γ),    K q̈ = (ẇ; 0) + (−Ẏq̇ − ẏ; γ).
//!
//! The same right-hand side in the form of Boltzmann and Hamel, with π = (w; 0), f = M̄π,
//! M̄ = K⁻ᵀM K⁻¹ and Q_V the forces without those of inertia:
//!
//!   BᵀQ_V − (H B)ᵀf − (Ṁ̄ π)_B + ½ Bᵀ∂(πᵀM̄π)/∂q,    H = K̇ − ∂(K q̇ + k)/∂q at fixed q̇.
//!
//! For the components of an angular velocity in the body, M̄ is its inertia, H B = ω×, and these are
//! Euler's equations. Both forms are built, the second first: where they are equal, by fingerprints, they are
//! one node, in the form that was built first. The shortest solution is taken; the one in coordinates is
//! among them. Source: Yu. I. Neĭmark, N. A. Fufaev, *Dynamics of Nonholonomic Systems*, AMS 1972;
//! T. R. Kane, D. A. Levinson, *Dynamics: Theory and Applications*, McGraw-Hill 1985, chapters 2 and 6.

use crate::algebra::{ConstrainedEquations, Guard, Guarded, Solver, States, unroll_by_speeds};
use crate::calculus::{directional, gradient, remove_coordinates, remove_time};
use crate::graph::{Dependence, Fingerprint, Graph, Node, NodeId, Symbol, Unary};

use super::constraints::{ConstraintTerms, jacobian, offsets};
use super::equations::{NoSpeedForm, SpeedEquations};
use super::lagrange::Inertia;
use super::limits::MOST_OPERATIONS;
use super::model::Model;
use super::model::symbols;
use super::solution::Solved;
use super::velocity_form::transport;

/// Most coordinates for which the form of Boltzmann and Hamel is tried. Its terms grow with the cube.
const MOST_COORDINATES: usize = 12;

/// The speeds' own equations; N coordinates, S speeds.
pub(super) struct Speeds {
    /// w, S.
    values: Vec<NodeId>,
    /// Y, S×N.
    jacobian: Vec<Vec<NodeId>>,
    /// y, S.
    offset: Vec<NodeId>,
    /// −Ẏq̇ − ẏ, S.
    drift: Vec<NodeId>,
}

/// The equations in coordinates, and what the speeds need of them.
pub(super) struct CoordinateEquations<'a> {
    /// The equations in coordinates.
    pub(super) inertia: &'a Inertia,
    /// The constraints' rows, if there are some; none of them switched.
    pub(super) rows: Option<&'a ConstraintTerms>,
    /// Q without the forces of inertia; `None` where it cannot be separated.
    pub(super) given: Option<&'a [NodeId]>,
    /// Where the solution is to apply.
    pub(super) states: States<'a>,
}

/// In which form the equations are written.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum SpeedForm {
    /// s from γ alone: Q as it is in coordinates.
    Projected,
    /// s with the speeds' own drift.
    Drifting,
    /// The latter, after the form of Boltzmann and Hamel.
    Hamel,
}

impl Speeds {
    /// Of a model; `None` without any.
    pub(super) fn of(model: &mut Model) -> Option<Self> {
        let (n, values): (_, Vec<NodeId>) =
            (model.coordinates.len(), model.speeds.iter().map(|s| s.node).collect());
        if values.is_empty() {
            return None;
        }
        let g = &mut model.graph;
        let rates = directional(g, &values, &mut transport);
        let drift: Vec<NodeId> = rates.into_iter().map(|rate| g.neg(rate)).collect();
        let (offset, jacobian) = (offsets(g, &[], &values), jacobian(g, &[], &values, n));
        Some(Self {
            values: remove_time(g, &values),
            jacobian: jacobian.iter().map(|row| remove_time(g, row)).collect(),
            offset: remove_time(g, &offset),
            drift: remove_time(g, &drift),
        })
    }

    /// The solution led by the speeds, in its shortest form, where that is shorter than `solved` and applies
    /// where this does; else this, and why.
    pub(super) fn lead(
        &self,
        g: &mut Graph,
        solved: Solved,
        unsolved: &Graph,
        beside: &CoordinateEquations,
    ) -> (Solved, Option<NoSpeedForm>) {
        let Some(results) = solved.results() else { return (solved, Some(NoSpeedForm::General)) };
        let (mut best, mut aside) = ((g.weight(&results), None), NoSpeedForm::Longer);
        let needed = solved.applies(g, &beside.states);
        for form in [SpeedForm::Projected, SpeedForm::Drifting, SpeedForm::Hamel] {
            // On a copy from before the solution in coordinates, whose forms would win where values are
            // equal.
            let mut trial = unsolved.clone();
            let found = match self.solve(&mut trial, beside, form) {
                Ok(found) => found,
                Err(why) => {
                    aside = if form == SpeedForm::Projected { why } else { aside };
                    continue;
                }
            };
            let weight = found.results().map_or(usize::MAX, |results| trial.weight(&results));
            if found.applies(&trial, &beside.states) < needed {
                aside = if form == SpeedForm::Projected { NoSpeedForm::Unsafe } else { aside };
            } else if weight < best.0 && same(g, &solved, &trial, &found) {
                best = (weight, Some((found, trial)));
            }
        }
        match best.1 {
            Some((found, trial)) => {
                *g = trial;
                (found, None)
            }
            None => (solved, Some(aside)),
        }
    }

    /// K.
    fn kinematics(&self, rows: Option<&ConstraintTerms>) -> Vec<Vec<NodeId>> {
        let of_rows = rows.map_or(&[][..], |rows| &rows.jacobian);
        self.jacobian.iter().chain(of_rows).cloned().collect()
    }

    fn solve(
        &self,
        g: &mut Graph,
        beside: &CoordinateEquations,
        form: SpeedForm,
    ) -> Result<Solved, NoSpeedForm> {
        let (inertia, kinematics) = (beside.inertia, self.kinematics(beside.rows));
        let (n, speeds) = (inertia.force.len(), self.values.len());
        if kinematics.len() != n {
            return Err(NoSpeedForm::Constraints);
        }
        if form == SpeedForm::Hamel {
            self.hamel(g, beside, &kinematics).ok_or(NoSpeedForm::Longer)?;
        }
        let drift: &[NodeId] = if form == SpeedForm::Projected { &[] } else { &self.drift };
        if let Some(rows) = beside.rows {
            let numbers: Vec<usize> = (0..rows.named.len()).collect();
            let system = ConstrainedEquations {
                mass: &inertia.mass,
                force: &inertia.force,
                jacobian: &rows.jacobian,
                gamma: &rows.gamma,
                numbers: &numbers,
            };
            let (unrolled, solver) =
                unroll_by_speeds(g, &system, (&kinematics, speeds), drift, MOST_OPERATIONS)
                    .map_err(|_| NoSpeedForm::Longer)?;
            return Ok(Solved::Unrolled(Box::new(unrolled), Box::new(solver)));
        }
        let solver = Solver::by_speeds(g, &inertia.mass, &kinematics, speeds).ok_or(NoSpeedForm::Unsafe)?;
        let (led, _) = solver.led(g);
        // No general solver stands behind: it must not fail where M has an inverse. det M = (det K)² det M̄,
        // so that where M̄ and K are finite everywhere K is singular only where M is. That holds for
        // parameters as well: a speed may be counted in one that is 0.
        let entries: Vec<NodeId> = led.iter().chain(&kinematics).flatten().copied().collect();
        if !is_finite(g, &entries, &inertia.mass.concat()) {
            return Err(NoSpeedForm::Unsafe);
        }
        let (accelerations, _) = solver.solve(g, &inertia.force, drift);
        let coordinate = |of| match of {
            Guarded::Coordinate(i) | Guarded::Row(i) => i,
        };
        let pivots =
            solver.guards().iter().map(|Guard { of, pivot, scale, .. }| (coordinate(*of), *pivot, *scale));
        let pivots = pivots.collect();
        Ok(Solved::Free { accelerations, pivots, solver: Some(Box::new(solver)) })
    }

    /// Builds the right-hand side of Boltzmann and Hamel; `None` where it does not exist, for example where T
    /// has terms of first degree in the speeds.
    fn hamel(&self, g: &mut Graph, beside: &CoordinateEquations, kinematics: &[Vec<NodeId>]) -> Option<()> {
        let (given, inertia, n) = (beside.given?, beside.inertia, kinematics.len());
        if n > MOST_COORDINATES {
            return None;
        }
        let (_, columns) = Solver::by_speeds(g, &inertia.mass, kinematics, self.values.len())?.led(g);
        let carried: Vec<Vec<NodeId>> = columns
            .iter()
            .map(|column| inertia.mass.iter().map(|row| dot(g, row, column)).collect())
            .collect();
        let whole: Vec<Vec<NodeId>> = (0..n)
            .map(|i| (0..n).map(|k| dot(g, &columns[i.max(k)], &carried[i.min(k)])).collect())
            .collect();
        let whole: Vec<Vec<NodeId>> = whole.iter().map(|row| remove_coordinates(g, row)).collect();
        let mut motions = self.values.clone();
        motions.extend(beside.rows.iter().flat_map(|rows| &rows.velocity_residual));
        let momenta: Vec<NodeId> = whole.iter().map(|row| dot(g, row, &motions)).collect();
        for (momentum, column) in momenta.iter().zip(&columns) {
            let own = dot(g, column, &inertia.momenta);
            if g.fingerprint(own) != g.fingerprint(*momentum) {
                return None;
            }
        }
        // (H K⁻¹)ᵀ f, row by row of H.
        let mut twisted = vec![g.zero(); self.values.len()];
        for ((row, motion), momentum) in kinematics.iter().zip(&motions).zip(&momenta) {
            let moved = directional(g, row, &mut transport);
            let one = g.one();
            let bent = gradient(g, &[(*motion, one)], &symbols(n, Symbol::Coordinate));
            let apart: Vec<NodeId> = moved.into_iter().zip(bent).map(|(a, b)| g.sub(a, b)).collect();
            for (sum, column) in twisted.iter_mut().zip(&columns) {
                let share = dot(g, &apart, column);
                let term = g.mul(share, *momentum);
                *sum = g.add(*sum, term);
            }
        }
        let entries = whole.concat();
        let carried_on = directional(g, &entries, &mut transport);
        for (r, (column, twisted)) in columns.iter().zip(twisted).enumerate() {
            let driving = dot(g, column, given);
            let driving = g.sub(driving, twisted);
            let carried_on = dot(g, &carried_on[r * n..][..n], &motions);
            let driving = g.sub(driving, carried_on);
            let slope = half_square(g, &entries, column, &motions);
            g.add(driving, slope);
        }
        Some(())
    }

    /// The equations of the speeds. `aside` is the reason why they are not solved, where they are not.
    pub(super) fn into_equations(
        self,
        g: &mut Graph,
        solved: &Solved,
        aside: Option<NoSpeedForm>,
    ) -> SpeedEquations {
        let Self { values, jacobian, offset, .. } = self;
        let inertia = aside.map_or_else(|| solved.led(g).ok_or(NoSpeedForm::General), Err);
        SpeedEquations { values, jacobian, offset, inertia }
    }
}

/// ½ Σ πᵢ πₖ ∂M̄ᵢₖ along `column`.
fn half_square(g: &mut Graph, entries: &[NodeId], column: &[NodeId], motions: &[NodeId]) -> NodeId {
    let along = |_: &mut Graph, s| match s {
        Symbol::Coordinate(j) => Some(column[j as usize]),
        _ => None,
    };
    let slopes = directional(g, entries, &mut { along });
    let rows: Vec<NodeId> = slopes.chunks(motions.len()).map(|row| dot(g, row, motions)).collect();
    let twice = dot(g, &rows, motions);
    let half = g.number(crate::graph::Number::ratio(1, 2));
    g.mul(half, twice)
}

/// Σ aᵢ bᵢ.
fn dot(g: &mut Graph, a: &[NodeId], b: &[NodeId]) -> NodeId {
    let mut sum = g.zero();
    for (a, b) in a.iter().zip(b) {
        let product = g.mul(*a, *b);
        sum = g.add(sum, product);
    }
    sum
}

/// Whether two solutions have the same values: a wrong derivation would cost operations, never a wrong
/// motion.
fn same(g: &Graph, a: &Solved, trial: &Graph, b: &Solved) -> bool {
    let (Some(a), Some(b)) = (a.unknowns(), b.unknowns()) else { return false };
    a.len() == b.len() && a.iter().zip(&b).all(|(a, b)| g.fingerprint(*a) == trial.fingerprint(*b))
}

/// Whether values are finite wherever coordinates are, and parameters for which `given` are: sums and
/// products of sines and cosines, divided by numbers and by what `given` are divided by at most.
fn is_finite(g: &Graph, nodes: &[NodeId], given: &[NodeId]) -> bool {
    let divided = |id: NodeId| match g.node(id) {
        Node::Div(_, b) => Some(g.fingerprint(b)),
        _ => None,
    };
    let known: Vec<Fingerprint> = g.cone(given).into_iter().filter_map(divided).collect();
    g.cone(nodes).into_iter().all(|id| match g.node(id) {
        Node::Div(_, b) => {
            g.as_number(b).is_some() || (g.is_constant(b) && known.contains(&g.fingerprint(b)))
        }
        _ if g.is_constant(id) => true,
        Node::Unary(f, _) => matches!(f, Unary::Sin | Unary::Cos | Unary::Tanh | Unary::Atan | Unary::Abs),
        Node::Binary(..) | Node::Select { .. } => false,
        Node::Number(_)
        | Node::Symbol(_)
        | Node::Add(..)
        | Node::Sub(..)
        | Node::Mul(..)
        | Node::Neg(_)
        | Node::Smooth { .. } => !g.dependence(id).on(Dependence::INPUTS),
    })
}
