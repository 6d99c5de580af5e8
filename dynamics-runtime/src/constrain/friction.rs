//! Forces that depend on the reactions of the same instant: Coulomb friction, worm gears, rollers that wedge.
//!
//! M a = Q(λ) + Φ_qᵀλ, Φ_q a = γ. With the frictionless system factored, the reactions to any given force F
//! are affine, λ = λ₀ + S F, so that what has to be solved is G(λ) = λ − λ₀ − S Q(λ) = 0, for the reactions
//! that Q reads alone; M may be singular on the way. G is piecewise smooth (|λ| has a kink), and Newton with
//! the derivative of the piece at hand, I − S ∂Q/∂λ, ends in one step in the right piece where Q is piecewise
//! linear. It starts from the frictionless reactions and from every pattern of their signs — 2ᵏ for k
//! reactions up to 6, above that a fixed sample of 64 — and all distinct solutions are kept: Coulomb's law
//! need not have one, and may have several (Painlevé 1895; Génot & Brogliato, Eur. J. Mech. A/Solids 18
//! (1999) 653–677; Leine, Brogliato & Nijmeijer, ibid. 21 (2002) 1–22).
//!
//! Where Q is linear for each pattern of signs, and all were tried, that none was found is a proof that there
//! is none. Other laws (creep forces of wheels go with λ^(2/3), their tanh with λ^(-1/3)) are searched
//! further, by damped steps, by fixed points and by growing friction (`search.rs`); what is not found then
//! may exist, and the error says so.
//!
//! A single solution counts only where det(I − S ∂Q/∂λ) > 0 (without friction it is 1). Where it is negative,
//! the acceleration along the constraint answers a growing reaction with the wrong sign: contact of any
//! compliance, however stiff, leaves that solution at once, and a one-sided contact also has the motion in
//! which it parts. That is reported like the other two, not used.

mod search;
mod sign_patterns;

use super::system::{self, FactoredSystem};
use super::{
    ConstrainedAccelerations, ConstrainedAccelerationsOf, FactoredEquations, check_contradiction,
    check_gradients, diagnosis, holds, system_names, undefined,
};
use crate::error::SolveError;
use crate::linalg::lu;
use crate::linalg::{Indices, WorkMemory, dot, max_abs};
use crate::model::{Constraints, ModelState, Vector};
use sign_patterns::pattern_count;

/// Most reactions whose sign patterns are all tried.
const MAX_EXHAUSTIVE_REACTIONS: usize = 6;
/// Solutions closer than this, against their size, are one.
const SAME_TOLERANCE: f64 = 1e-7;
/// What the derivative of a force by reactions may have of what constraints that repeat each other leave
/// open.
const DERIVATIVE_TOLERANCE: f64 = 1e-9;
/// Signs of all reactions, and of every second one.
const SIGN_PATTERNS: [(f64, f64); 4] = [(1.0, 1.0), (-1.0, 1.0), (1.0, -1.0), (-1.0, -1.0)];

/// Memory that the friction solve takes on top of the factored system: S, ∂Q/∂λ, Newton's matrix, vectors.
pub(super) const fn memory(n: usize, r: usize) -> usize {
    2 * n * r + 2 * r * r + 3 * n + 8 * r + lu::memory(r)
}

/// Distinct solutions that were found, up to two.
struct FrictionSolutions<R> {
    first: Option<R>,
    /// Whether the determinant is negative at the first.
    negative: bool,
    count: usize,
}

impl<R> FrictionSolutions<R> {
    /// Whether there is one that a contact of any compliance keeps to, and no other.
    fn is_one(&self) -> bool {
        self.count == 1 && !self.negative
    }
}

/// What one solve works on.
struct FrictionProblem<'w, 'm, M: Constraints> {
    model: &'m M,
    state: &'m M::State,
    /// Rows that Q reads.
    rows_read: Indices<'w>,
    k: usize,
    /// Reactions at no force at all, by all rows.
    unforced_reactions: &'w mut [f64],
    /// S, r×n.
    by_force: &'w mut [f64],
    /// Forces that no reaction decides.
    fixed_force: &'w mut [f64],
    /// Q and ∂Q/∂λ.
    force: &'w mut [f64],
    by_multipliers: &'w mut [f64],
    /// Newton's matrix and vectors, k each.
    matrix: &'w mut [f64],
    right: &'w mut [f64],
    step: &'w mut [f64],
}

/// q̈ and λ with Φ_q q̈ = γ + `gamma_correction`, where applied forces depend on λ; `gradients_checked`: that gradients which are
/// zero may be.
pub(super) fn solve<M: Constraints>(
    model: &M,
    state: &M::State,
    gamma_correction: Option<&M::Rows>,
    gradients_checked: bool,
    workspace: &mut [f64],
) -> Result<ConstrainedAccelerationsOf<M>, SolveError> {
    let modes = state.modes();
    let (n, r) = (M::Vector::LEN, M::Rows::LEN);
    // What is solved for lies behind what the system takes.
    let (first, second) = workspace.split_at_mut(system_memory(n, r));
    let mut friction_memory = WorkMemory::new(second);
    let active = |row: usize| holds::<M>(modes, row);
    let Some(mut factored) =
        FactoredEquations::in_memory(model, state, &active, true, WorkMemory::new(first))?
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
    let mut problem = FrictionProblem::new(model, state, &mut factored, &mut friction_memory);
    let lu_memory = friction_memory.take(lu::memory(r));
    problem.find_rows_read();
    // What is read may depend on the reactions themselves (a threshold): rows are added until nothing changes
    // any more.
    for _ in 0..=r {
        let assumed = if problem.k == 0 {
            M::Rows::zeros()
        } else {
            problem.find_unique_solution(&mut factored.system, lu_memory)?
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
        let size = residual.scale + system.size_of_rows(gamma_terms);
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
    // Which reactions decide changes with them: a search among too few says nothing.
    Err(problem.unsolved_error(&M::Rows::zeros()))
}

/// Memory of the factored system.
const fn system_memory(n: usize, r: usize) -> usize {
    n * n + n + n * r + 3 * r + system::memory(n, r)
}

/// Memory of it all.
pub(super) const fn total_memory(n: usize, r: usize) -> usize {
    system_memory(n, r) + memory(n, r)
}

impl<'w, 'm, M: Constraints> FrictionProblem<'w, 'm, M> {
    fn new(
        model: &'m M,
        state: &'m M::State,
        factored: &mut FactoredEquations<'_>,
        memory: &mut WorkMemory<'w>,
    ) -> Self {
        let (n, r) = (M::Vector::LEN, M::Rows::LEN);
        let (unforced_reactions, by_force) = (memory.zeros(r), memory.zeros(r * n));
        let fixed_force = memory.take(n);
        fixed_force.copy_from_slice(factored.force);
        let (force, by_multipliers) = (memory.zeros(n), memory.zeros(n * r));
        let matrix = memory.zeros(r * r);
        let (right, step) = (memory.zeros(r), memory.zeros(r));
        let unit = memory.zeros(n);
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
        let rows_read = memory.indices(r);
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

    /// Rows that Q reads: those with ∂Q/∂λ ≠ 0 at the frictionless reactions, at their size, or at any, with
    /// either sign.
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

    /// Adds the rows with ∂Q/∂λ ≠ 0 as last evaluated; whether there were any more.
    fn add_rows_read(&mut self) -> bool {
        let (n, r, before) = (M::Vector::LEN, M::Rows::LEN, self.k);
        for row in (0..r).filter(|row| holds::<M>(self.state.modes(), *row)) {
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

    /// The one solution that there should be.
    fn find_unique_solution(
        &mut self,
        system: &mut FactoredSystem<'_>,
        lu_memory: &mut [f64],
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
            let find_unique_solution = self.newton(start, lu_memory);
            self.record_solution(&mut found, find_unique_solution);
            if found.count > 1 {
                break;
            }
        }
        let complete = k <= MAX_EXHAUSTIVE_REACTIONS
            && (found.is_one() || found.count > 1 || self.is_linear_in_patterns(&frictionless_reactions));
        if !found.is_one() && found.count < 2 && !complete {
            self.search(&frictionless_reactions, &mut found, lu_memory);
        }
        match found.first {
            Some(lambda) if found.is_one() => Ok(lambda),
            // A search that is not complete does not say that there are no others.
            _ if found.count < 2 && !complete => Err(self.unsolved_error(&frictionless_reactions)),
            _ => Err(SolveError::Friction {
                row: system_names::<M>().row(self.most_loaded_row(&frictionless_reactions)),
                solutions: found.count,
            }),
        }
    }

    /// Counts a solution, unless it is the one that is known.
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

    /// That no solution was found, which is no proof that there is none.
    fn unsolved_error(&self, frictionless_reactions: &M::Rows) -> SolveError {
        let row = system_names::<M>().row(self.most_loaded_row(frictionless_reactions));
        SolveError::FrictionUnsolved { row, reactions: self.k, tried: pattern_count(self.k) }
    }

    /// Whether Q is the same for all reactions that hold the motion alike, though these are not unique: Q(λ +
    /// z) = Q(λ) wherever Φ_qᵀz = 0, as where feet that repeat each other rub with one coefficient. The
    /// derivatives ∂Qⱼ/∂λ are of the form Φ_q a then, for all signs of the reactions on which they depend.
    /// Where each term of a force goes by one reaction, as in every law of friction of a contact, that holds
    /// for all patterns of signs as soon as it does for one of them and for each sign changed alone; of more
    /// than six reactions, no more than those and the sample are looked at.
    #[cold]
    fn is_force_unique(&mut self, system: &mut FactoredSystem<'_>) -> bool {
        let (n, r, frictionless_reactions) = (M::Vector::LEN, M::Rows::LEN, self.frictionless_reactions());
        let (zero_force, mut a, mut lambda) = (M::Vector::zeros(), M::Vector::zeros(), M::Rows::zeros());
        let single_changes = if self.k > MAX_EXHAUSTIVE_REACTIONS { self.k as u64 } else { 0 };
        (0..pattern_count(self.k) + single_changes).all(|pattern| {
            let mut reactions = self.start(&frictionless_reactions, pattern.saturating_sub(single_changes));
            if pattern < single_changes {
                // All push but one.
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
                residual.size <= DERIVATIVE_TOLERANCE * residual.scale
            })
        })
    }

    /// λ₀ + S Q(0). Where Q(0) is not a number, as of N tanh(c N^(-1/3)), the forces that depend on reactions
    /// are left out.
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

    /// The row that friction changes most: what a report names.
    fn most_loaded_row(&self, frictionless_reactions: &M::Rows) -> usize {
        let rows = (0..self.k).map(|i| self.rows_read.get(i));
        let size = rows.map(|row| (row, frictionless_reactions[row].abs()));
        size.fold((self.rows_read.get(0), -1.0), |most, next| if next.1 > most.1 { next } else { most }).0
    }
}

/// Reactions of a size at least, of these signs.
fn with_signs<V: Vector>(sizes: &V, (sign, alternating): (f64, f64)) -> V {
    let mut lambda = *sizes;
    for (i, x) in lambda.as_mut_slice().iter_mut().enumerate() {
        *x = sign * (1.0 + x.abs()) * if i % 2 == 0 { 1.0 } else { alternating };
    }
    lambda
}
