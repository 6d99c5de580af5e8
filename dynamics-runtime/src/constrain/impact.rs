//! Impacts: the jump of velocities when constraints take hold at once. Poisson's hypothesis, in two phases at
//! fixed positions. *Compression*: M Δq̇ = Φ_qᵀ Λ brings Φ̇ to zero on the rows that hit and keeps it
//! zero on the active rows, all impulses computed together. *Restitution*: every hit returns e times the
//! impulse that it took. For a single hit this is Newton's law Φ̇⁺ = −e Φ̇⁻. For several hits at
//! once, where contacts push and do not pull, 0 ≤ Λ ⟂ Φ̇⁺ ≥ 0, Poisson's hypothesis never creates
//! energy, as Newton's law can. A contact that closes again during restitution is compressed once more.
//!
//! The complementarity problems are solved by principal pivoting (Murty, Opsearch 11, 1974). Source of the
//! impact law: Pfeiffer & Glocker, Multibody Dynamics with Unilateral Contacts (1996), §8. Friction is
//! ignored: sticking constraints hold whatever their impulse is.

use super::correct::{ConstraintCorrection, CorrectionOf, correct_rows};
use super::{FactoredEquations, Gradients, holds, system_names};
use crate::constrain::project::ConstraintLevel;
use crate::error::SolveError;
use crate::linalg::{add, add_scaled, dot, max_abs};
use crate::model::{ActiveSet, Constraint, ConstraintKind, Constraints, ModelState, Vector};

/// Most pivots of Murty's method. k contacts that do not repeat each other take 2ᵏ at most, three contacts
/// eight; in practice there are far fewer.
const MAX_SIDE_CHANGES: usize = 256;

/// Most hits that can be released, one bit each; further ones always take part.
const MAX_TRACKED_HITS: usize = 64;
/// Distance |Φ̇|/‖Φ_q‖, in parts of 1 + |q̇|, at which a row counts as at rest after an impact: far
/// above rounding, far below any velocity of interest.
const REST_TOLERANCE: f64 = 1e-9;
/// A released contact closes where Φ̇ is below zero by this part of the velocities: less is rounding.
const CLOSING_ROUNDING: f64 = 1e-12;

/// Impulses of an impact, and the energy that it took.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ImpactSolution<R> {
    /// Λ by rows: time integrals of the multipliers during the impact; 0 where nothing acted.
    pub impulses: R,
    /// T⁻ − T⁺ of the kinetic energy T = ½ q̇ᵀMq̇: −½ Λᵀ Φ_q(q̇⁺ + q̇⁻). Negative where a moving constraint
    /// strikes.
    pub energy_lost: f64,
}

/// Changes the velocities of `state` by the impact of the constraints listed, by index in
/// [`Constraints::CONSTRAINTS`], each with its coefficient of restitution e (0: plastic, 1: elastic). Listed
/// constraints need not hold; all other active constraints stay active. The active set stays.
///
/// A listed scalar constraint that was released to a side is a contact: its impulse pushes to that side or is
/// 0. Other constraints push either way.
///
/// # Errors
/// As [`super::solve`]; [`SolveError::OffConstraint`] where no velocities fulfil the constraints,
/// [`SolveError::ImpactSqueezes`] where the constraints drive contacts together,
/// [`SolveError::ImpactUndecided`] where contacts repeat each other so that no set of impulses fulfils the
/// complementarity conditions.
pub fn impact<M: Constraints>(
    model: &M,
    state: &mut M::State,
    hits: &[(usize, f64)],
    workspace: &mut [f64],
) -> Result<ImpactSolution<M::Rows>, SolveError> {
    let mut contacts = ContactSet::<M> {
        hits,
        active_set: state.active_set(),
        released_hits: 0,
        in_restitution: false,
        rates_before: M::Rows::zeros(),
    };
    let (mut after, mut impulses) = contacts.compress(model, state, workspace)?;
    if hits.iter().any(|(_, restitution)| *restitution != 0.0) {
        contacts.in_restitution = true;
        let mut returned_impulses = M::Rows::zeros();
        for row in 0..M::Rows::LEN {
            returned_impulses[row] = contacts.hit_of_row(row).map_or(0.0, |hit| hits[hit].1 * impulses[row]);
        }
        let impulse_response = contacts.impulse_response(model, &after, &returned_impulses, workspace)?;
        add(after.u_mut().as_mut_slice(), impulse_response.change.as_slice());
        add(impulses.as_mut_slice(), returned_impulses.as_slice());
        add(impulses.as_mut_slice(), impulse_response.impulses.as_slice());
        let (after_restitution, further_impulses) = contacts.compress(model, &after, workspace)?;
        after = after_restitution;
        add(impulses.as_mut_slice(), further_impulses.as_slice());
    }
    let energy_lost = energy_loss(model, state, &after, &impulses, workspace);
    *state = after;
    Ok(ImpactSolution { impulses, energy_lost })
}

/// The constraints that take part in a phase of an impact.
struct ContactSet<'h, M: Constraints> {
    hits: &'h [(usize, f64)],
    active_set: ActiveSet,
    /// Bits of the hits that open, so that no impulse acts on them.
    released_hits: u64,
    /// In restitution, hits that are no contacts and rebound are free again.
    in_restitution: bool,
    /// Φ̇ before the phase.
    rates_before: M::Rows,
}

impl<M: Constraints> ContactSet<'_, M> {
    /// Brings the acting rows to Φ̇ = 0; returns velocities and impulses. An error names a contact that is
    /// squeezed, where that can be proved.
    fn compress(
        &mut self,
        model: &M,
        state: &M::State,
        workspace: &mut [f64],
    ) -> Result<(M::State, M::Rows), SolveError> {
        match self.solve_complementarity(model, state, workspace) {
            Err(error @ (SolveError::ImpactUndecided { .. } | SolveError::OffConstraint { .. })) => {
                Err(self.prove_squeezed(model, state, workspace)?.unwrap_or(error))
            }
            solved => solved,
        }
    }

    /// Proves by Farkas' lemma that no velocities keep all contacts apart. The residual of Φ̇ that the best
    /// velocities leave on all rows together is a combination of rows that does not depend on velocities.
    /// Where every contact closes in it, all other velocities leave at least as much. `None` where there is
    /// no proof.
    fn prove_squeezed(
        &mut self,
        model: &M,
        state: &M::State,
        workspace: &mut [f64],
    ) -> Result<Option<SolveError>, SolveError> {
        self.released_hits = 0;
        let correction =
            correct_rows(model, state, &self.right_hand_side(), &|row| self.acts(row), workspace)?;
        let mut after = *state;
        add(after.u_mut().as_mut_slice(), correction.change.as_slice());
        let velocities = model.velocity_residual(&after);
        let gradients = Gradients::of(model, &after, workspace);
        let rest_tolerance = REST_TOLERANCE * (1.0 + max_abs(after.u().as_slice()));
        let mut worst_closing = (0.0, None);
        for hit in 0..self.hits.len().min(MAX_TRACKED_HITS) {
            let (Some(side), row) = (self.side(hit), self.first_row(hit)) else { continue };
            let (closing, distance) = (side * velocities[row], gradients.distance(row, velocities[row]));
            // NaN proves nothing.
            if distance.is_nan() || (closing > 0.0 && distance > rest_tolerance) {
                return Ok(None);
            }
            if distance > rest_tolerance.max(worst_closing.0) {
                let row = system_names::<M>().row(row);
                worst_closing = (distance, Some(SolveError::ImpactSqueezes { row, closing }));
            }
        }
        Ok(worst_closing.1)
    }

    /// Solves the complementarity problem of a compression, 0 ≤ Λ ⟂ Φ̇⁺ ≥ 0.
    fn solve_complementarity(
        &mut self,
        model: &M,
        state: &M::State,
        workspace: &mut [f64],
    ) -> Result<(M::State, M::Rows), SolveError> {
        self.rates_before = model.velocity_residual(state);
        self.released_hits = 0;
        for hit in 0..self.hits.len().min(MAX_TRACKED_HITS) {
            if self.side(hit).is_some_and(|side| side * self.rates_before[self.first_row(hit)] >= 0.0) {
                self.released_hits |= 1 << hit;
            }
        }
        // Murty's rule: the first contact that violates its condition, by pulling or closing, changes sides.
        // For contacts that do not repeat each other this is finite, and ends after a few rounds as a rule.
        for _ in 0..MAX_SIDE_CHANGES {
            let correction =
                correct_rows(model, state, &self.right_hand_side(), &|row| self.acts(row), workspace)?;
            let mut after = *state;
            add(after.u_mut().as_mut_slice(), correction.change.as_slice());
            let velocities = model.velocity_residual(&after);
            if let Some(violating) = self.first_violation(&correction.impulses, &velocities) {
                self.released_hits ^= 1 << violating;
                continue;
            }
            self.check_at_rest(model, &after, &velocities, workspace)?;
            return Ok((after, correction.impulses));
        }
        let row = self.hits.first().map_or(0, |(hit, _)| M::CONSTRAINTS[*hit].first);
        Err(SolveError::ImpactUndecided { row: system_names::<M>().row(row) })
    }

    /// The change of velocities by impulses at the hits while the other constraints stay active, and the
    /// impulses of these.
    fn impulse_response(
        &self,
        model: &M,
        state: &M::State,
        impulses: &M::Rows,
        workspace: &mut [f64],
    ) -> Result<CorrectionOf<M>, SolveError> {
        let held =
            |row: usize| self.hit_of_row(row).is_none_or(|hit| self.keeps_holding(hit)) && self.may_act(row);
        let mut force = M::Vector::zeros();
        let gradients = Gradients::of(model, state, workspace);
        for (row, impulse) in impulses.as_slice().iter().enumerate() {
            add_scaled(force.as_mut_slice(), *impulse, gradients.row(row));
        }
        let Some(mut factored) = FactoredEquations::new(model, state, &held, false, workspace)? else {
            return Ok(ConstraintCorrection::undefined());
        };
        factored.force.copy_from_slice(force.as_slice());
        factored.gamma.fill(0.0);
        let mut correction = ConstraintCorrection::none();
        let ConstraintCorrection { change, impulses }: &mut CorrectionOf<M> = &mut correction;
        factored.system.solve(factored.force, factored.gamma, change.as_mut_slice(), impulses.as_mut_slice());
        Ok(correction)
    }

    /// The side to which a contact pushes; `None` where the constraint is no contact.
    fn side(&self, hit: usize) -> Option<f64> {
        let Constraint { kind, rows, switched, .. } = M::CONSTRAINTS[self.hits[hit].0];
        let side = switched.map_or(0.0, |index| self.active_set.side(index));
        (kind == ConstraintKind::Holonomic && rows == 1 && side != 0.0).then_some(side)
    }

    /// Whether a hit is no contact and does not rebound: it is active from now on.
    fn keeps_holding(&self, hit: usize) -> bool {
        self.side(hit).is_none() && self.hits[hit].1 == 0.0
    }

    fn first_row(&self, hit: usize) -> usize {
        M::CONSTRAINTS[self.hits[hit].0].first
    }

    /// Whether impulses may act at a hit in this phase.
    fn takes_part(&self, hit: usize) -> bool {
        let free = self.in_restitution && self.side(hit).is_none() && !self.keeps_holding(hit);
        !free && (hit >= MAX_TRACKED_HITS || self.released_hits >> hit & 1 == 0)
    }

    /// The hit whose constraint has this row.
    fn hit_of_row(&self, row: usize) -> Option<usize> {
        let of = |hit: &usize| {
            let Constraint { first, rows, .. } = M::CONSTRAINTS[self.hits[*hit].0];
            (first..first + rows).contains(&row)
        };
        (0..self.hits.len()).find(of)
    }

    /// Whether a row is hit or active.
    fn may_act(&self, row: usize) -> bool {
        self.hit_of_row(row).is_some() || holds::<M>(self.active_set, row)
    }

    /// Whether a row acts in this phase.
    fn acts(&self, row: usize) -> bool {
        self.may_act(row) && self.hit_of_row(row).is_none_or(|hit| self.takes_part(hit))
    }

    /// −Φ̇ on the acting rows.
    fn right_hand_side(&self) -> M::Rows {
        let mut right_hand_side = M::Rows::zeros();
        for row in (0..M::Rows::LEN).filter(|row| self.acts(*row)) {
            right_hand_side[row] = -self.rates_before[row];
        }
        right_hand_side
    }

    /// The first contact that pulls, or that is released and closes.
    fn first_violation(&self, impulses: &M::Rows, velocities: &M::Rows) -> Option<usize> {
        let size = max_abs(velocities.as_slice()) + max_abs(self.rates_before.as_slice());
        let violating = |hit: &usize| {
            let (row, hit) = (self.first_row(*hit), *hit);
            self.side(hit).is_some_and(|side| match self.takes_part(hit) {
                true => side * impulses[row] < 0.0,
                false => side * velocities[row] < -CLOSING_ROUNDING * size,
            })
        };
        (0..self.hits.len().min(MAX_TRACKED_HITS)).find(violating)
    }

    /// Checks that the acting rows have come to rest.
    fn check_at_rest(
        &self,
        model: &M,
        after: &M::State,
        velocities: &M::Rows,
        workspace: &mut [f64],
    ) -> Result<(), SolveError> {
        let gradients = Gradients::of(model, after, workspace);
        let size = max_abs(after.u().as_slice());
        for row in (0..M::Rows::LEN).filter(|row| self.acts(*row)) {
            let (residual, distance) = (velocities[row], gradients.distance(row, velocities[row]));
            if distance.is_nan() || distance > REST_TOLERANCE * (1.0 + size) {
                let (what, row) = (ConstraintLevel::Velocities.name(), system_names::<M>().row(row));
                return Err(SolveError::OffConstraint { what, row, residual, distance });
            }
        }
        Ok(())
    }
}

/// T⁻ − T⁺ = −½ Λᵀ Φ_q (q̇⁺ + q̇⁻).
fn energy_loss<M: Constraints>(
    model: &M,
    before: &M::State,
    after: &M::State,
    impulses: &M::Rows,
    workspace: &mut [f64],
) -> f64 {
    let gradients = Gradients::of(model, before, workspace);
    let mut sum = *before.u();
    add(sum.as_mut_slice(), after.u().as_slice());
    let rows = impulses.as_slice().iter().enumerate().filter(|(_, x)| **x != 0.0);
    -rows.map(|(row, impulse)| 0.5 * impulse * dot(gradients.row(row), sum.as_slice())).sum::<f64>()
}
