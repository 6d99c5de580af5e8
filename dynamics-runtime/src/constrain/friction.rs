//! Forces that depend on the reactions of the same instant: Coulomb friction, worm gears, rollers that wedge.
//!
//! ```text
//! M a = Q(λ) + Φ_qᵀλ        Φ_q a = γ
//! ```
//!
//! With the frictionless system factored, the reactions to a given force F are affine, λ = λ₀ + S F. So
//! what has to be solved is G(λ) = λ − λ₀ − S Q(λ) = 0 for the reactions that Q reads; M may be
//! singular. G is piecewise smooth, because |λ| has a kink. Newton's method with the derivative of the
//! current piece, I − S ∂Q/∂λ, ends in one step in the right piece where Q is piecewise linear. It
//! starts from the frictionless reactions and from every pattern of their signs: 2ᵏ for k reactions up to
//! 6, above that a fixed sample of 64. Distinct solutions are counted, because Coulomb's law
//! need not have one, and may have several (Painlevé 1895; Génot & Brogliato, Eur. J. Mech. A/Solids 18
//! (1999) 653–677; Leine, Brogliato & Nijmeijer, ibid. 21 (2002) 1–22).
//!
//! Where Q is linear for each pattern of signs and all patterns were tried without a solution, there is
//! provably none. Other laws are searched further, by damped steps, fixed points and growing friction
//! (`search.rs`): creep forces of wheels behave like λ^(2/3), their tanh like λ^(-1/3). A solution that
//! this search does not find may exist, and the error says so.
//!
//! A single solution is accepted only where det(I − S ∂Q/∂λ) > 0; without friction it is 1. Where the
//! determinant is negative, a growing reaction accelerates the constraint in the wrong direction. A contact
//! of any compliance, however stiff, leaves that solution at once, and a one-sided contact also has the
//! motion in which it opens. This case is reported like the other two.

mod search;
mod sign_patterns;

use super::system::{self, FactoredSystem};
use super::{
    ConstrainedAccelerations, ConstrainedAccelerationsOf, FactoredEquations, check_contradiction,
    check_gradients, diagnosis, holds, system_names, undefined,
};
use crate::error::SolveError;
use crate::linalg::lu;
use crate::linalg::{Indices, WorkspaceSlices, dot, max_abs};
use crate::model::{Constraints, ModelState, Vector};
use sign_patterns::pattern_count;

/// Up to so many reactions all sign patterns are tried: 64 Newton iterations.
const MAX_EXHAUSTIVE_REACTIONS: usize = 6;
/// Solutions, and forces, that differ by less than this part of their size are the same. Newton's method ends
/// at 10⁻¹³, so that iterates towards one solution are far closer.
const SAME_TOLERANCE: f64 = 1e-7;
/// Relative tolerance for derivatives ∂Q/∂λ: for their component in the directions that redundant
/// constraints leave undetermined, and for the difference of Q from a linear function. Rounding is far below
/// it.
const DERIVATIVE_TOLERANCE: f64 = 1e-9;
/// Signs with which ∂Q/∂λ is looked at: of all reactions, and of every second one in addition.
const SIGN_PATTERNS: [(f64, f64); 4] = [(1.0, 1.0), (-1.0, 1.0), (1.0, -1.0), (-1.0, -1.0)];

/// Length of the workspace of the friction solve besides the factored system: S, ∂Q/∂λ, Newton's matrix,
/// vectors.
pub(super) const fn workspace_len(n: usize, r: usize) -> usize {
    2 * n * r + 2 * r * r + 3 * n + 8 * r + lu::workspace_len(r)
}

/// The first solution that was found, and the number of distinct ones up to two.
struct FrictionSolutions<R> {
    first: Option<R>,
    /// Whether the determinant is negative at the first.
    negative: bool,
    count: usize,
}

impl<R> FrictionSolutions<R> {
    /// Whether there is exactly one solution, and a compliant contact would stay at it.
    fn is_one(&self) -> bool {
        self.count == 1 && !self.negative
    }
}

/// State and workspace of one solve.
struct FrictionProblem<'w, 'm, M: Constraints> {
    model: &'m M,
    state: &'m M::State,
    /// Rows that Q reads.
    rows_read: Indices<'w>,
    k: usize,
    /// λ₀: reactions without any force, for all rows.
    unforced_reactions: &'w mut [f64],
    /// S, r×n.
    by_force: &'w mut [f64],
    /// Forces that do not depend on reactions.
    fixed_force: &'w mut [f64],
    /// Q and ∂Q/∂λ.
    force: &'w mut [f64],
    by_multipliers: &'w mut [f64],
    /// Newton's matrix and vectors, k each.
    matrix: &'w mut [f64],
    right: &'w mut [f64],
    step: &'w mut [f64],
}

/// q̈ and λ with Φ_q q̈ = γ + `gamma_correction`, where applied forces depend on λ.
/// `gradients_checked`: gradients that are zero have been checked to vanish at this position only.
pub(super) fn solve<M: Constraints>(
    model: &M,
    state: &M::State,
    gamma_correction: Option<&M::Rows>,
    gradients_checked: bool,
    workspace: &mut [f64],
) -> Result<ConstrainedAccelerationsOf<M>, SolveError> {
    let active_set = state.active_set();
    let (n, r) = (M::Vector::LEN, M::Rows::LEN);
    // The factored system takes the first part of the workspace, the friction solve the second.
    let (first, second) = workspace.split_at_mut(system_workspace_len(n, r));
    let mut friction_workspace = WorkspaceSlices::new(second);
    let active = |row: usize| holds::<M>(active_set, row);
    let Some(mut factored) =
        FactoredEquations::in_workspace(model, state, &active, true, WorkspaceSlices::new(first))?
    else {
        return Ok(undefined());
    };
    if factored.system.has_vanished_row && !gradients_checked {
        check_gradients(model, state, workspace)?;
        return solve(model, state, gamma_correction, true, workspace);
    }
    if let Some(gamma_correction) = gamma_correction {
        factored
            .gamma
            .iter_mut()
            .zip(gamma_correction.as_slice())
            .for_each(|(gamma, gamma_correction)| *gamma += gamma_correction);
    }
    let mut problem = FrictionProblem::new(model, state, &mut factored, &mut friction_workspace);
    let lu_workspace = friction_workspace.take(lu::workspace_len(r));
    problem.find_rows_read();
    // Which reactions Q reads may depend on the reactions themselves, as with a threshold. Rows are added
    // until Q at the solution is the Q that was solved with.
    for _ in 0..=r {
        let assumed = if problem.k == 0 {
            M::Rows::zeros()
        } else {
            problem.find_unique_solution(&mut factored.system, lu_workspace)?
        };
        let mut outcome = ConstrainedAccelerations {
            accelerations: M::Vector::zeros(),
            multipliers: assumed,
            diagnosis: None,
        };
        let Some(force) = problem.evaluate_force(&assumed) else { return Ok(undefined()) };
        let FactoredEquations { gamma, gamma_terms, redundancy_tolerance, system, .. } = &mut factored;
        let (a, lambda) = (outcome.accelerations.as_mut_slice(), outcome.multipliers.as_mut_slice());
        let residual = system.solve(force.as_slice(), gamma, a, lambda);
        let size = residual.gamma_norm + system.size_of_rows(gamma_terms);
        check_contradiction(residual, size, *redundancy_tolerance, system, system_names::<M>())?;
        let Some(force_then) = problem.evaluate_force(&outcome.multipliers) else { return Ok(undefined()) };
        let size = max_abs(force.as_slice()).max(max_abs(force_then.as_slice()));
        if (0..n).all(|j| (force[j] - force_then[j]).abs() <= SAME_TOLERANCE * size) {
            outcome.diagnosis = Some(diagnosis(&factored.system));
            return Ok(outcome);
        }
        if !problem.add_rows_read() {
            break;
        }
    }
    // The set of reactions that Q reads does not settle, so that no search is complete.
    Err(problem.unsolved_error(&M::Rows::zeros()))
}

/// Length of the workspace of the factored system.
const fn system_workspace_len(n: usize, r: usize) -> usize {
    n * n + n + n * r + 3 * r + system::workspace_len(n, r)
}

/// Length of the workspace of both, the factored system and the friction solve.
pub(super) const fn total_workspace_len(n: usize, r: usize) -> usize {
    system_workspace_len(n, r) + workspace_len(n, r)
}

impl<'w, 'm, M: Constraints> FrictionProblem<'w, 'm, M> {
    fn new(
        model: &'m M,
        state: &'m M::State,
        factored: &mut FactoredEquations<'_>,
        workspace: &mut WorkspaceSlices<'w>,
    ) -> Self {
        let (n, r) = (M::Vector::LEN, M::Rows::LEN);
        let (unforced_reactions, by_force) = (workspace.zeros(r), workspace.zeros(r * n));
        let fixed_force = workspace.take(n);
        fixed_force.copy_from_slice(factored.force);
        let (force, by_multipliers) = (workspace.zeros(n), workspace.zeros(n * r));
        let matrix = workspace.zeros(r * r);
        let (right, step) = (workspace.zeros(r), workspace.zeros(r));
        let unit = workspace.zeros(n);
        let mut a = M::Vector::zeros();
        let mut lambda = M::Rows::zeros();
        factored.system.solve(unit, factored.gamma, a.as_mut_slice(), unforced_reactions);
        let zero_gamma = M::Rows::zeros();
        for j in 0..n {
            unit[j] = 1.0;
            factored.system.solve(unit, zero_gamma.as_slice(), a.as_mut_slice(), lambda.as_mut_slice());
            unit[j] = 0.0;
            (0..r).for_each(|i| by_force[i * n + j] = lambda[i]);
        }
        let rows_read = workspace.indices(r);
        Self {
            model,
            state,
            rows_read,
            k: 0,
            unforced_reactions,
            by_force,
            fixed_force,
            force,
            by_multipliers,
            matrix,
            right,
            step,
        }
    }

    /// Finds the rows that Q reads: those with ∂Q/∂λ ≠ 0 at the frictionless reactions, or at reactions of
    /// their size or more with either sign.
    fn find_rows_read(&mut self) {
        let frictionless_reactions = self.frictionless_reactions();
        for reactions in SIGN_PATTERNS {
            self.model.friction(
                self.state,
                &with_signs(&frictionless_reactions, reactions),
                self.force,
                self.by_multipliers,
            );
            self.add_rows_read();
        }
        self.model.friction(self.state, &frictionless_reactions, self.force, self.by_multipliers);
        self.add_rows_read();
    }

    /// Adds the rows with ∂Q/∂λ ≠ 0 in the last evaluation; returns whether there were new ones.
    fn add_rows_read(&mut self) -> bool {
        let (n, r, before) = (M::Vector::LEN, M::Rows::LEN, self.k);
        for row in (0..r).filter(|row| holds::<M>(self.state.active_set(), *row)) {
            let is_listed = (0..self.k).any(|i| self.rows_read.get(i) == row);
            if !is_listed && (0..n).any(|j| self.by_multipliers[j * r + row] != 0.0) {
                self.rows_read.set(self.k, row);
                self.k += 1;
            }
        }
        self.k > before
    }

    /// Q at these reactions, with its derivatives; `None` where it is not finite.
    fn evaluate_force(&mut self, multipliers: &M::Rows) -> Option<M::Vector> {
        self.model.friction(self.state, multipliers, self.force, self.by_multipliers);
        let mut force = M::Vector::zeros();
        force.as_mut_slice().copy_from_slice(self.force);
        max_abs(self.force).is_finite().then_some(force)
    }

    /// The unique solution, or the error that says why there is none.
    fn find_unique_solution(
        &mut self,
        system: &mut FactoredSystem<'_>,
        lu_workspace: &mut [f64],
    ) -> Result<M::Rows, SolveError> {
        let k = self.k;
        let undetermined_row = (0..k).map(|i| self.rows_read.get(i)).find(|row| !system.is_unique(*row));
        if let Some(row) = undetermined_row
            && !self.is_force_unique(system)
        {
            return Err(SolveError::ReactionNotUnique { row: system_names::<M>().row(row) });
        }
        let frictionless_reactions = self.frictionless_reactions();
        let mut found = FrictionSolutions { first: None, negative: false, count: 0 };
        // The frictionless reactions first, then their size with every pattern of signs.
        for pattern in 0..=pattern_count(k) {
            let start = if pattern == 0 {
                frictionless_reactions
            } else {
                self.start(&frictionless_reactions, pattern - 1)
            };
            let find_unique_solution = self.newton(start, lu_workspace);
            self.record_solution(&mut found, find_unique_solution);
            if found.count > 1 {
                break;
            }
        }
        let complete = k <= MAX_EXHAUSTIVE_REACTIONS
            && (found.is_one() || found.count > 1 || self.is_linear_in_patterns(&frictionless_reactions));
        if !found.is_one() && found.count < 2 && !complete {
            self.search(&frictionless_reactions, &mut found, lu_workspace);
        }
        match found.first {
            Some(lambda) if found.is_one() => Ok(lambda),
            // An incomplete search does not prove that there are no others.
            _ if found.count < 2 && !complete => Err(self.unsolved_error(&frictionless_reactions)),
            _ => Err(SolveError::Friction {
                row: system_names::<M>().row(self.most_loaded_row(&frictionless_reactions)),
                solutions: found.count,
            }),
        }
    }

    /// Counts a solution, unless it equals the first one.
    fn record_solution(
        &self,
        found: &mut FrictionSolutions<M::Rows>,
        find_unique_solution: Option<(M::Rows, bool)>,
    ) {
        let Some((lambda, negative)) = find_unique_solution else { return };
        match &found.first {
            Some(first) if self.is_same_solution(first, &lambda) => found.negative &= negative,
            Some(_) => found.count = 2,
            None => *found = FrictionSolutions { first: Some(lambda), negative, count: 1 },
        }
    }

    /// The error that no solution was found, which is no proof that there is none.
    fn unsolved_error(&self, frictionless_reactions: &M::Rows) -> SolveError {
        let row = system_names::<M>().row(self.most_loaded_row(frictionless_reactions));
        SolveError::FrictionUnsolved { row, reactions: self.k, tried: pattern_count(self.k) }
    }

    /// Whether Q is the same for all reactions of the same motion, though these are not unique:
    /// Q(λ + z) = Q(λ) wherever Φ_qᵀz = 0. That holds for feet that repeat each other and have one
    /// coefficient of friction. The derivatives ∂Qⱼ/∂λ are then of the form Φ_q a, for all signs of
    /// the reactions on which they depend. Where each term of a force depends on one reaction, as in every
    /// friction law of a contact, it suffices to test one pattern of signs and each sign changed alone. Of
    /// more than six reactions no more than those and the sample are tested.
    #[cold]
    fn is_force_unique(&mut self, system: &mut FactoredSystem<'_>) -> bool {
        let (n, r, frictionless_reactions) = (M::Vector::LEN, M::Rows::LEN, self.frictionless_reactions());
        let (zero_force, mut a, mut lambda) = (M::Vector::zeros(), M::Vector::zeros(), M::Rows::zeros());
        let single_changes = if self.k > MAX_EXHAUSTIVE_REACTIONS { self.k as u64 } else { 0 };
        (0..pattern_count(self.k) + single_changes).all(|pattern| {
            let mut reactions = self.start(&frictionless_reactions, pattern.saturating_sub(single_changes));
            if pattern < single_changes {
                // One sign changed.
                let row = self.rows_read.get(pattern as usize);
                reactions[row] = -reactions[row];
            }
            self.model.friction(self.state, &reactions, self.force, self.by_multipliers);
            (0..n).all(|j| {
                let force_derivative = &self.by_multipliers[j * r..(j + 1) * r];
                let residual = system.solve(
                    zero_force.as_slice(),
                    force_derivative,
                    a.as_mut_slice(),
                    lambda.as_mut_slice(),
                );
                residual.norm <= DERIVATIVE_TOLERANCE * residual.gamma_norm
            })
        })
    }

    /// The frictionless reactions λ₀ + S Q(0). Where Q(0) is NaN, as of N tanh(c N^(-1/3)), the forces that
    /// depend on reactions are left out.
    fn frictionless_reactions(&mut self) -> M::Rows {
        let n = M::Vector::LEN;
        self.model.friction(self.state, &M::Rows::zeros(), self.force, self.by_multipliers);
        if !max_abs(self.force).is_finite() {
            self.force.copy_from_slice(self.fixed_force);
        }
        let mut lambda = M::Rows::zeros();
        for (i, x) in lambda.as_mut_slice().iter_mut().enumerate() {
            *x = self.unforced_reactions[i] + dot(&self.by_force[i * n..(i + 1) * n], self.force);
        }
        lambda
    }

    /// The row with the largest frictionless reaction, for errors.
    fn most_loaded_row(&self, frictionless_reactions: &M::Rows) -> usize {
        let rows = (0..self.k).map(|i| self.rows_read.get(i));
        let size = rows.map(|row| (row, frictionless_reactions[row].abs()));
        size.fold((self.rows_read.get(0), -1.0), |most, next| if next.1 > most.1 { next } else { most }).0
    }
}

/// Reactions of at least these sizes with these signs.
fn with_signs<V: Vector>(sizes: &V, (sign, alternating): (f64, f64)) -> V {
    let mut lambda = *sizes;
    for (i, x) in lambda.as_mut_slice().iter_mut().enumerate() {
        *x = sign * (1.0 + x.abs()) * if i % 2 == 0 { 1.0 } else { alternating };
    }
    lambda
}
