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

mod patterns;
mod search;

use super::system::{self, FactoredSystem};
use super::{
    Factored, Outcome, OutcomeOf, check_gradients, contradiction, diagnosis, holds, names, not_a_number,
};
use crate::error::SolveError;
use crate::linalg::lu;
use crate::linalg::{Indices, WorkMemory, dot, max_abs};
use crate::model::{Constraints, ModelState, Vector};
use patterns::patterns;

/// Most reactions whose sign patterns are all tried.
const EXHAUSTIVE: usize = 6;
/// Solutions closer than this, against their size, are one.
const SAME: f64 = 1e-7;
/// What the derivative of a force by reactions may have of what constraints that repeat each other leave
/// open.
const DECIDED: f64 = 1e-9;
/// Signs of all reactions, and of every second one.
const SIGNS: [(f64, f64); 4] = [(1.0, 1.0), (-1.0, 1.0), (1.0, -1.0), (-1.0, -1.0)];

/// Memory that the friction solve takes on top of the factored system: S, ∂Q/∂λ, Newton's matrix, vectors.
pub(super) const fn memory(n: usize, r: usize) -> usize {
    2 * n * r + 2 * r * r + 3 * n + 8 * r + lu::memory(r)
}

/// Distinct solutions that were found, up to two.
struct Solutions<R> {
    first: Option<R>,
    /// Whether the determinant is negative at the first.
    negative: bool,
    count: usize,
}

impl<R> Solutions<R> {
    /// Whether there is one that a contact of any compliance keeps to, and no other.
    fn is_one(&self) -> bool {
        self.count == 1 && !self.negative
    }
}

/// What one solve works on.
struct Problem<'w, 'm, M: Constraints> {
    model: &'m M,
    state: &'m M::State,
    /// Rows that Q reads.
    read: Indices<'w>,
    k: usize,
    /// Reactions at no force at all, by all rows.
    offset: &'w mut [f64],
    /// S, r×n.
    by_force: &'w mut [f64],
    /// Forces that no reaction decides.
    free: &'w mut [f64],
    /// Q and ∂Q/∂λ.
    force: &'w mut [f64],
    by_multipliers: &'w mut [f64],
    /// Newton's matrix and vectors, k each.
    matrix: &'w mut [f64],
    right: &'w mut [f64],
    step: &'w mut [f64],
}

/// q̈ and λ with Φ_q q̈ = γ + `more`, where applied forces depend on λ; `checked`: that gradients which are
/// zero may be.
pub(super) fn solve<M: Constraints>(
    model: &M,
    state: &M::State,
    more: Option<&M::Rows>,
    checked: bool,
    workspace: &mut [f64],
) -> Result<OutcomeOf<M>, SolveError> {
    let modes = state.modes();
    let (n, r) = (M::Vector::LEN, M::Rows::LEN);
    // What is solved for lies behind what the system takes.
    let (first, second) = workspace.split_at_mut(system_memory(n, r));
    let mut rest = WorkMemory::new(second);
    let active = |row: usize| holds::<M>(modes, row);
    let Some(mut factored) = Factored::in_memory(model, state, &active, true, WorkMemory::new(first))? else {
        return Ok(not_a_number());
    };
    if factored.system.vanished && !checked {
        check_gradients(model, state, workspace)?;
        return solve(model, state, more, true, workspace);
    }
    if let Some(more) = more {
        factored.gamma.iter_mut().zip(more.as_slice()).for_each(|(gamma, more)| *gamma += more);
    }
    let mut problem = Problem::new(model, state, &mut factored, &mut rest);
    let work = rest.take(lu::memory(r));
    problem.find_rows_read();
    // What is read may depend on the reactions themselves (a threshold): rows are added until nothing changes
    // any more.
    for _ in 0..=r {
        let assumed =
            if problem.k == 0 { M::Rows::zeros() } else { problem.solution(&mut factored.system, work)? };
        let mut outcome =
            Outcome { accelerations: M::Vector::zeros(), multipliers: assumed, diagnosis: None };
        let Some(force) = problem.force_at(&assumed) else { return Ok(not_a_number()) };
        let Factored { gamma, floor, slack, system, .. } = &mut factored;
        let (a, lambda) = (outcome.accelerations.as_mut_slice(), outcome.multipliers.as_mut_slice());
        let miss = system.solve(force.as_slice(), gamma, a, lambda);
        let size = miss.scale + system.size_of_rows(floor);
        contradiction(miss, size, *slack, system, names::<M>())?;
        let Some(then) = problem.force_at(&outcome.multipliers) else { return Ok(not_a_number()) };
        let size = max_abs(force.as_slice()).max(max_abs(then.as_slice()));
        if (0..n).all(|j| (force[j] - then[j]).abs() <= SAME * size) {
            outcome.diagnosis = Some(diagnosis(&factored.system));
            return Ok(outcome);
        }
        if !problem.read_more() {
            break;
        }
    }
    // Which reactions decide changes with them: a search among too few says nothing.
    Err(problem.unsolved(&M::Rows::zeros()))
}

/// Memory of the factored system.
const fn system_memory(n: usize, r: usize) -> usize {
    n * n + n + n * r + 3 * r + system::memory(n, r)
}

/// Memory of it all.
pub(super) const fn memory_in_all(n: usize, r: usize) -> usize {
    system_memory(n, r) + memory(n, r)
}

impl<'w, 'm, M: Constraints> Problem<'w, 'm, M> {
    fn new(
        model: &'m M,
        state: &'m M::State,
        factored: &mut Factored<'_>,
        memory: &mut WorkMemory<'w>,
    ) -> Self {
        let (n, r) = (M::Vector::LEN, M::Rows::LEN);
        let (offset, by_force) = (memory.zeros(r), memory.zeros(r * n));
        let free = memory.take(n);
        free.copy_from_slice(factored.force);
        let (force, by_multipliers) = (memory.zeros(n), memory.zeros(n * r));
        let matrix = memory.zeros(r * r);
        let (right, step) = (memory.zeros(r), memory.zeros(r));
        let unit = memory.zeros(n);
        let mut a = M::Vector::zeros();
        let mut lambda = M::Rows::zeros();
        factored.system.solve(unit, factored.gamma, a.as_mut_slice(), offset);
        let still = M::Rows::zeros();
        for j in 0..n {
            unit[j] = 1.0;
            factored.system.solve(unit, still.as_slice(), a.as_mut_slice(), lambda.as_mut_slice());
            unit[j] = 0.0;
            (0..r).for_each(|i| by_force[i * n + j] = lambda[i]);
        }
        let read = memory.indices(r);
        Self { model, state, read, k: 0, offset, by_force, free, force, by_multipliers, matrix, right, step }
    }

    /// Rows that Q reads: those with ∂Q/∂λ ≠ 0 at the frictionless reactions, at their size, or at any, with
    /// either sign.
    fn find_rows_read(&mut self) {
        let frictionless = self.frictionless();
        for signs in SIGNS {
            self.model.friction(self.state, &signed(&frictionless, signs), self.force, self.by_multipliers);
            self.read_more();
        }
        self.model.friction(self.state, &frictionless, self.force, self.by_multipliers);
        self.read_more();
    }

    /// Adds the rows with ∂Q/∂λ ≠ 0 as last evaluated; whether there were any more.
    fn read_more(&mut self) -> bool {
        let (n, r, before) = (M::Vector::LEN, M::Rows::LEN, self.k);
        for row in (0..r).filter(|row| holds::<M>(self.state.modes(), *row)) {
            let known = (0..self.k).any(|i| self.read.get(i) == row);
            if !known && (0..n).any(|j| self.by_multipliers[j * r + row] != 0.0) {
                self.read.set(self.k, row);
                self.k += 1;
            }
        }
        self.k > before
    }

    /// Q at these reactions, with its derivatives; `None` where it is not finite.
    fn force_at(&mut self, multipliers: &M::Rows) -> Option<M::Vector> {
        self.model.friction(self.state, multipliers, self.force, self.by_multipliers);
        let mut force = M::Vector::zeros();
        force.as_mut_slice().copy_from_slice(self.force);
        max_abs(self.force).is_finite().then_some(force)
    }

    /// The one solution that there should be.
    fn solution(&mut self, system: &mut FactoredSystem<'_>, work: &mut [f64]) -> Result<M::Rows, SolveError> {
        let k = self.k;
        let open = (0..k).map(|i| self.read.get(i)).find(|row| !system.is_unique(*row));
        if let Some(row) = open
            && !self.is_the_same_for_all(system)
        {
            return Err(SolveError::ReactionNotUnique { row: names::<M>().row(row) });
        }
        let frictionless = self.frictionless();
        let mut found = Solutions { first: None, negative: false, count: 0 };
        // The frictionless reactions first, then their size with every pattern of signs.
        for pattern in 0..=patterns(k) {
            let start = if pattern == 0 { frictionless } else { self.start(&frictionless, pattern - 1) };
            let solution = self.newton(start, work);
            self.add(&mut found, solution);
            if found.count > 1 {
                break;
            }
        }
        let complete = k <= EXHAUSTIVE
            && (found.is_one() || found.count > 1 || self.is_linear_in_patterns(&frictionless));
        if !found.is_one() && found.count < 2 && !complete {
            self.search(&frictionless, &mut found, work);
        }
        match found.first {
            Some(lambda) if found.is_one() => Ok(lambda),
            // A search that is not complete does not say that there are no others.
            _ if found.count < 2 && !complete => Err(self.unsolved(&frictionless)),
            _ => Err(SolveError::Friction {
                row: names::<M>().row(self.decisive(&frictionless)),
                solutions: found.count,
            }),
        }
    }

    /// Counts a solution, unless it is the one that is known.
    fn add(&self, found: &mut Solutions<M::Rows>, solution: Option<(M::Rows, bool)>) {
        let Some((lambda, negative)) = solution else { return };
        match &found.first {
            Some(first) if self.same(first, &lambda) => found.negative &= negative,
            Some(_) => found.count = 2,
            None => *found = Solutions { first: Some(lambda), negative, count: 1 },
        }
    }

    /// That no solution was found, which is no proof that there is none.
    fn unsolved(&self, frictionless: &M::Rows) -> SolveError {
        let row = names::<M>().row(self.decisive(frictionless));
        SolveError::FrictionUnsolved { row, reactions: self.k, tried: patterns(self.k) }
    }

    /// Whether Q is the same for all reactions that hold the motion alike, though these are not unique: Q(λ +
    /// z) = Q(λ) wherever Φ_qᵀz = 0, as where feet that repeat each other rub with one coefficient. The
    /// derivatives ∂Qⱼ/∂λ are of the form Φ_q a then, for all signs of the reactions on which they depend.
    /// Where each term of a force goes by one reaction, as in every law of friction of a contact, that holds
    /// for all patterns of signs as soon as it does for one of them and for each sign changed alone; of more
    /// than six reactions, no more than those and the sample are looked at.
    #[cold]
    fn is_the_same_for_all(&mut self, system: &mut FactoredSystem<'_>) -> bool {
        let (n, r, frictionless) = (M::Vector::LEN, M::Rows::LEN, self.frictionless());
        let (none, mut a, mut lambda) = (M::Vector::zeros(), M::Vector::zeros(), M::Rows::zeros());
        let alone = if self.k > EXHAUSTIVE { self.k as u64 } else { 0 };
        (0..patterns(self.k) + alone).all(|pattern| {
            let mut signs = self.start(&frictionless, pattern.saturating_sub(alone));
            if pattern < alone {
                // All push but one.
                let row = self.read.get(pattern as usize);
                signs[row] = -signs[row];
            }
            self.model.friction(self.state, &signs, self.force, self.by_multipliers);
            (0..n).all(|j| {
                let along = &self.by_multipliers[j * r..(j + 1) * r];
                let miss = system.solve(none.as_slice(), along, a.as_mut_slice(), lambda.as_mut_slice());
                miss.size <= DECIDED * miss.scale
            })
        })
    }

    /// λ₀ + S Q(0). Where Q(0) is not a number, as of N tanh(c N^(-1/3)), the forces that depend on reactions
    /// are left out.
    fn frictionless(&mut self) -> M::Rows {
        let n = M::Vector::LEN;
        self.model.friction(self.state, &M::Rows::zeros(), self.force, self.by_multipliers);
        if !max_abs(self.force).is_finite() {
            self.force.copy_from_slice(self.free);
        }
        let mut lambda = M::Rows::zeros();
        for (i, x) in lambda.as_mut_slice().iter_mut().enumerate() {
            *x = self.offset[i] + dot(&self.by_force[i * n..(i + 1) * n], self.force);
        }
        lambda
    }

    /// The row that friction changes most: what a report names.
    fn decisive(&self, frictionless: &M::Rows) -> usize {
        let rows = (0..self.k).map(|i| self.read.get(i));
        let size = rows.map(|row| (row, frictionless[row].abs()));
        size.fold((self.read.get(0), -1.0), |most, next| if next.1 > most.1 { next } else { most }).0
    }
}

/// Reactions of a size at least, of these signs.
fn signed<V: Vector>(sizes: &V, (sign, alternating): (f64, f64)) -> V {
    let mut lambda = *sizes;
    for (i, x) in lambda.as_mut_slice().iter_mut().enumerate() {
        *x = sign * (1.0 + x.abs()) * if i % 2 == 0 { 1.0 } else { alternating };
    }
    lambda
}
