//! The search for reactions λ = λ₀ + S Q(λ): Newton's method, and the attempts after it fails.
//!
//! Full Newton steps end in a solution where Q is piecewise linear. Otherwise they may diverge, and three
//! further methods are tried in this order:
//!
//! * Newton steps that are halved until ‖G‖ falls, G = λ − λ₀ − S Q(λ) (J. E. Dennis & R. B. Schnabel,
//!   *Numerical Methods for Unconstrained Optimization*, 1983, §6.3).
//! * The fixed point of λ ← λ + ω (λ₀ + S Q(λ) − λ), which weak friction has.
//! * The path from the frictionless reactions λ_f on which friction grows from s = 0 to 1: G_s(λ) = 0,
//!   G_s = λ − (1 − s) λ_f − s (λ₀ + S Q(λ)) (E. L. Allgower & K. Georg, *Numerical Continuation Methods*,
//!   1990, §2).
//!
//! `tests/slow/contact/friction/laws.rs` has laws that need the fixed point, and laws that need the path.

use super::sign_patterns::pattern_count;
use super::{FrictionProblem, FrictionSolutions, SAME_TOLERANCE};
use crate::linalg::Lu;
use crate::linalg::{WorkspaceSlices, dot, max_abs};
use crate::model::{Constraints, Vector};

/// Most Newton steps from one start. Piecewise linear laws take two.
const MAX_NEWTON_STEPS: usize = 25;
/// Rounding error of a reaction, in parts of the sum of its terms, which exceeds the reaction itself near a
/// change of sign.
const REACTION_ROUNDING: f64 = 16.0 * f64::EPSILON;
/// Damped steps from one start, and halvings of one of them.
const MAX_DAMPED_STEPS: usize = 50;
const MAX_HALVINGS: usize = 30;
/// Part of the predicted decrease that a damped step must achieve (Armijo's condition; the value of Dennis &
/// Schnabel, §6.3).
const REQUIRED_DECREASE: f64 = 1e-4;
/// ‖G‖, in parts of the largest reaction, from which full Newton steps take over.
const FULL_STEP_RESIDUAL: f64 = 1e-6;
/// Relaxation factors ω of the fixed-point iteration, and most steps with each.
const RELAXATION: [f64; 3] = [1.0, 0.5, 0.1];
const MAX_FIXED_POINT_STEPS: usize = 100;
/// First and smallest step of the strength s of friction.
const STRENGTH_STEP: (f64, f64) = (0.125, 1e-4);
/// A Newton matrix whose least scaled pivot is below this is singular to rounding.
const MIN_NEWTON_PIVOT: f64 = 1e-14;

impl<M: Constraints> FrictionProblem<'_, '_, M> {
    /// Newton's method from a start; the solution, and whether det(I − S ∂Q/∂λ) is negative there.
    pub(super) fn newton(&mut self, mut lambda: M::Rows, workspace: &mut [f64]) -> Option<(M::Rows, bool)> {
        let k = self.k;
        for _ in 0..MAX_NEWTON_STEPS {
            self.evaluate(&lambda, None);
            let (largest_reaction, rounding_of_reactions) =
                (self.largest_reaction(&lambda), self.rounding_of_reactions());
            let residual = max_abs(&self.right[..k]);
            let lu = Lu::new(&mut self.matrix[..k * k], k, &mut WorkspaceSlices::new(workspace));
            let negative = lu.negative;
            if residual <= rounding_of_reactions.max(1e-13 * largest_reaction) {
                return Some((lambda, negative));
            }
            if lu.least.is_nan() || lu.least <= MIN_NEWTON_PIVOT || !residual.is_finite() {
                return None;
            }
            lu.solve(&self.right[..k], &mut self.step[..k]);
            let step = max_abs(&self.step[..k]);
            (0..k).for_each(|i| lambda[self.rows_read.get(i)] += self.step[i]);
            // Steps are at rounding level, unless terms are so large that their rounding exceeds any step.
            if step <= rounding_of_reactions.max(1e-15 * largest_reaction)
                && residual
                    <= SAME_TOLERANCE * (rounding_of_reactions / REACTION_ROUNDING).max(largest_reaction)
            {
                return Some((lambda, negative));
            }
        }
        None
    }

    /// Further attempts where Newton's method found no solution, or none that is accepted.
    #[cold]
    pub(super) fn search(
        &mut self,
        frictionless_reactions: &M::Rows,
        found: &mut FrictionSolutions<M::Rows>,
        workspace: &mut [f64],
    ) {
        let attempts = 1 + pattern_count(self.k) + RELAXATION.len() as u64 + 1;
        for attempt in 0..attempts {
            let end = match attempt {
                0 => self.damped(*frictionless_reactions, None, workspace),
                attempt if attempt <= pattern_count(self.k) => {
                    let start = self.start(frictionless_reactions, attempt - 1);
                    self.damped(start, None, workspace)
                }
                attempt if attempt + 1 < attempts => self.fixed_point(
                    *frictionless_reactions,
                    RELAXATION[(attempt - 1 - pattern_count(self.k)) as usize],
                ),
                _ => self.continue_in_strength(frictionless_reactions, workspace),
            };
            let solution = end.and_then(|end| self.newton(end, workspace));
            self.record_solution(found, solution);
            if found.count > 1 || found.is_one() {
                return;
            }
        }
    }

    /// Damped Newton steps towards G = 0, or G_s = 0 where a strength s is given with the frictionless
    /// reactions. Ends near a solution.
    fn damped(
        &mut self,
        mut lambda: M::Rows,
        strength: Option<(f64, &M::Rows)>,
        workspace: &mut [f64],
    ) -> Option<M::Rows> {
        let k = self.k;
        let mut residual = self.evaluate(&lambda, strength)?;
        for _ in 0..MAX_DAMPED_STEPS {
            if residual <= FULL_STEP_RESIDUAL * self.largest_reaction(&lambda) {
                return Some(lambda);
            }
            let lu = Lu::new(&mut self.matrix[..k * k], k, &mut WorkspaceSlices::new(workspace));
            if lu.least > MIN_NEWTON_PIVOT {
                lu.solve(&self.right[..k], &mut self.step[..k]);
            } else {
                // A fixed-point step where Newton's matrix is singular.
                self.step[..k].copy_from_slice(&self.right[..k]);
            }
            let (mut part, mut halvings) = (1.0, 0);
            (lambda, residual) = loop {
                let mut next = lambda;
                (0..k).for_each(|i| next[self.rows_read.get(i)] += part * self.step[i]);
                match self.evaluate(&next, strength) {
                    Some(trial) if trial <= (1.0 - REQUIRED_DECREASE * part) * residual => {
                        break (next, trial);
                    }
                    _ if halvings == MAX_HALVINGS => return None,
                    _ => (part, halvings) = (0.5 * part, halvings + 1),
                }
            };
        }
        None
    }

    /// The limit of λ ← λ + ω (λ₀ + S Q(λ) − λ).
    fn fixed_point(&mut self, mut lambda: M::Rows, relaxation: f64) -> Option<M::Rows> {
        for _ in 0..MAX_FIXED_POINT_STEPS {
            if self.evaluate(&lambda, None)? <= FULL_STEP_RESIDUAL * self.largest_reaction(&lambda) {
                return Some(lambda);
            }
            (0..self.k).for_each(|i| lambda[self.rows_read.get(i)] += relaxation * self.right[i]);
        }
        None
    }

    /// Follows the solution while friction grows from zero.
    fn continue_in_strength(
        &mut self,
        frictionless_reactions: &M::Rows,
        workspace: &mut [f64],
    ) -> Option<M::Rows> {
        let (mut lambda, mut strength, mut by) = (*frictionless_reactions, 0.0, STRENGTH_STEP.0);
        while strength < 1.0 {
            let next = f64::min(strength + by, 1.0);
            match self.damped(lambda, Some((next, frictionless_reactions)), workspace) {
                Some(trial) => (lambda, strength, by) = (trial, next, 2.0 * by),
                None if by <= STRENGTH_STEP.1 => return None,
                None => by *= 0.5,
            }
        }
        Some(lambda)
    }

    /// −G_s and its derivative by −λ at these reactions; ‖G_s‖, or `None` where it is not finite.
    fn evaluate(&mut self, lambda: &M::Rows, strength: Option<(f64, &M::Rows)>) -> Option<f64> {
        let (n, r, k) = (M::Vector::LEN, M::Rows::LEN, self.k);
        self.model.friction(self.state, lambda, self.force, self.by_multipliers);
        let s = strength.map_or(1.0, |(s, _)| s);
        for i in 0..k {
            let row = self.rows_read.get(i);
            let influence = &self.by_force[row * n..(row + 1) * n];
            let reaction = self.unforced_reactions[row] + dot(influence, self.force);
            self.right[i] = match strength {
                None => reaction - lambda[row],
                Some((s, frictionless_reactions)) => {
                    (1.0 - s) * frictionless_reactions[row] + s * reaction - lambda[row]
                }
            };
            for j in 0..k {
                let column = self.rows_read.get(j);
                let by = (0..n).map(|l| influence[l] * self.by_multipliers[l * r + column]).sum::<f64>();
                self.matrix[i * k + j] = f64::from(u8::from(i == j)) - s * by;
            }
        }
        let residual = dot(&self.right[..k], &self.right[..k]);
        residual.is_finite().then(|| crate::math::sqrt(residual))
    }

    /// The largest of the reactions that are read.
    fn largest_reaction(&self, lambda: &M::Rows) -> f64 {
        (0..self.k).map(|i| lambda[self.rows_read.get(i)].abs()).fold(0.0, f64::max)
    }

    pub(super) fn is_same_solution(&self, a: &M::Rows, b: &M::Rows) -> bool {
        let rows = || (0..self.k).map(|i| self.rows_read.get(i));
        let largest_reaction = rows().map(|row| a[row].abs().max(b[row].abs())).fold(0.0, f64::max);
        let is_same_solution = (SAME_TOLERANCE * largest_reaction).max(4.0 * self.rounding_of_reactions());
        rows().all(|row| (a[row] - b[row]).abs() <= is_same_solution)
    }

    /// Rounding errors of the reactions that are read, at the force evaluated last.
    fn rounding_of_reactions(&self) -> f64 {
        let n = M::Vector::LEN;
        let sum = |row: usize| {
            let influence = &self.by_force[row * n..(row + 1) * n];
            let terms = influence.iter().zip(self.force.iter()).map(|(x, force)| (x * force).abs());
            self.unforced_reactions[row].abs() + terms.sum::<f64>()
        };
        REACTION_ROUNDING * (0..self.k).map(|i| sum(self.rows_read.get(i))).fold(0.0, f64::max)
    }
}
