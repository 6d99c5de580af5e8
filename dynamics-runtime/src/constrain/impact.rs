//! Impacts: the jump of velocities when constraints take hold at once.
//!
//! Poisson's hypothesis, in two phases at fixed positions. *Compression*: M Δq̇ = Φ_qᵀ Λ brings Φ̇ to zero on
//! the rows that hit and keeps it zero on the rows that hold, all impulses computed together. *Restitution*:
//! every hit gives back e times the impulse that it took. For a single hit this is Newton's Φ̇⁺ = −e Φ̇⁻. For
//! several at once, where contacts may push and not pull, 0 ≤ Λ ⟂ Φ̇⁺ ≥ 0, it never makes energy as Newton's
//! can; what closes again during restitution is compressed once more. The complementarity problems are solved
//! by principal pivoting (Murty, Opsearch 11, 1974). Friction takes no part. Pfeiffer & Glocker, Multibody
//! Dynamics with Unilateral Contacts (1996), §8.

use super::correct::{ConstraintCorrection, CorrectionOf, correct_rows};
use super::{FactoredEquations, Gradients, holds, system_names};
use crate::error::SolveError;
use crate::linalg::{add, add_scaled, dot, max_abs};
use crate::model::{Constraint, ConstraintKind, Constraints, ModelState, Modes, Vector};

/// Most changes of sides; three contacts take at most eight.
const ROUNDS: usize = 256;

/// What an impact did.
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
/// constraints need not hold; those that hold besides go on holding. Modes stay.
///
/// A listed scalar constraint that was released to a side is a contact: its impulse pushes to that side or
/// is 0. Others push either way.
///
/// # Errors
/// As [`super::solve`]; [`SolveError::OffConstraint`] where the constraints leave no velocities to go on
/// with, [`SolveError::ImpactSqueezes`] where they drive contacts together, [`SolveError::ImpactUndecided`]
/// where contacts repeat each other so that none of their impulses fits.
pub fn impact<M: Constraints>(
    model: &M,
    state: &mut M::State,
    hits: &[(usize, f64)],
    workspace: &mut [f64],
) -> Result<ImpactSolution<M::Rows>, SolveError> {
    let mut set =
        ContactSet::<M> { hits, modes: state.modes(), out: 0, restoring: false, before: M::Rows::zeros() };
    let (mut after, mut impulses) = set.compress(model, state, workspace)?;
    if hits.iter().any(|(_, restitution)| *restitution != 0.0) {
        set.restoring = true;
        let mut returned = M::Rows::zeros();
        for row in 0..M::Rows::LEN {
            returned[row] = set.hit(row).map_or(0.0, |at| hits[at].1 * impulses[row]);
        }
        let kick = set.kick(model, &after, &returned, workspace)?;
        add(after.u_mut().as_mut_slice(), kick.change.as_slice());
        add(impulses.as_mut_slice(), returned.as_slice());
        add(impulses.as_mut_slice(), kick.impulses.as_slice());
        let (settled, more) = set.compress(model, &after, workspace)?;
        after = settled;
        add(impulses.as_mut_slice(), more.as_slice());
    }
    let energy_lost = lost(model, state, &after, &impulses, workspace);
    *state = after;
    Ok(ImpactSolution { impulses, energy_lost })
}

/// Which contacts take part.
struct ContactSet<'h, M: Constraints> {
    hits: &'h [(usize, f64)],
    modes: Modes,
    /// Bits of the hits that are let go.
    out: u64,
    /// Hits that are no contacts and rebound are free again.
    restoring: bool,
    /// Φ̇ before the phase.
    before: M::Rows,
}

impl<M: Constraints> ContactSet<'_, M> {
    /// Brings rows that act to Φ̇ = 0; velocities and impulses. What cannot come apart says so.
    fn compress(
        &mut self,
        model: &M,
        state: &M::State,
        workspace: &mut [f64],
    ) -> Result<(M::State, M::Rows), SolveError> {
        match self.settle(model, state, workspace) {
            Err(error @ (SolveError::ImpactUndecided { .. } | SolveError::OffConstraint { .. })) => {
                Err(self.squeezed(model, state, workspace)?.unwrap_or(error))
            }
            settled => settled,
        }
    }

    /// Whether no velocities keep all contacts apart, by Farkas' lemma: what the best velocities leave of Φ̇
    /// on all rows together is combined of what does not depend on velocities; where every contact closes in
    /// it, every other velocity leaves at least as much.
    fn squeezed(
        &mut self,
        model: &M,
        state: &M::State,
        workspace: &mut [f64],
    ) -> Result<Option<SolveError>, SolveError> {
        self.out = 0;
        let correction = correct_rows(model, state, &self.right(), &|row| self.acts(row), workspace)?;
        let mut after = *state;
        add(after.u_mut().as_mut_slice(), correction.change.as_slice());
        let velocities = model.velocity_residual(&after);
        let gradients = Gradients::of(model, &after, workspace);
        let permitted = 1e-9 * (1.0 + max_abs(after.u().as_slice()));
        let mut worst = (0.0, None);
        for at in 0..self.hits.len().min(64) {
            let (Some(side), row) = (self.side(at), self.first_row(at)) else { continue };
            let (closing, distance) = (side * velocities[row], gradients.distance(row, velocities[row]));
            // Not a number is no proof.
            if distance.is_nan() || (closing > 0.0 && distance > permitted) {
                return Ok(None);
            }
            if distance > permitted.max(worst.0) {
                let row = system_names::<M>().row(row);
                worst = (distance, Some(SolveError::ImpactSqueezes { row, closing }));
            }
        }
        Ok(worst.1)
    }

    /// See [`ContactSet::compress`].
    fn settle(
        &mut self,
        model: &M,
        state: &M::State,
        workspace: &mut [f64],
    ) -> Result<(M::State, M::Rows), SolveError> {
        self.before = model.velocity_residual(state);
        self.out = 0;
        for at in 0..self.hits.len().min(64) {
            if self.side(at).is_some_and(|side| side * self.before[self.first_row(at)] >= 0.0) {
                self.out |= 1 << at;
            }
        }
        // Murty's rule: the first contact that pulls or closes changes sides. It ends, for contacts that do
        // not repeat each other, and after a few rounds as a rule.
        for _ in 0..ROUNDS {
            let correction = correct_rows(model, state, &self.right(), &|row| self.acts(row), workspace)?;
            let mut after = *state;
            add(after.u_mut().as_mut_slice(), correction.change.as_slice());
            let velocities = model.velocity_residual(&after);
            if let Some(wrong) = self.first_wrong(&correction.impulses, &velocities) {
                self.out ^= 1 << wrong;
                continue;
            }
            self.check(model, &after, &velocities, workspace)?;
            return Ok((after, correction.impulses));
        }
        let row = self.hits.first().map_or(0, |(at, _)| M::CONSTRAINTS[*at].first);
        Err(SolveError::ImpactUndecided { row: system_names::<M>().row(row) })
    }

    /// What impulses at the hits do to the velocities while the rest goes on holding: Δq̇, and the impulses
    /// of the rest.
    fn kick(
        &self,
        model: &M,
        state: &M::State,
        impulses: &M::Rows,
        workspace: &mut [f64],
    ) -> Result<CorrectionOf<M>, SolveError> {
        let held = |row: usize| self.hit(row).is_none_or(|at| self.stays(at)) && self.may_act(row);
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
    fn side(&self, at: usize) -> Option<f64> {
        let Constraint { kind, rows, switched, .. } = M::CONSTRAINTS[self.hits[at].0];
        let side = switched.map_or(0.0, |index| self.modes.side(index));
        (kind == ConstraintKind::Holonomic && rows == 1 && side != 0.0).then_some(side)
    }

    /// A hit that is no contact and does not rebound: it holds from now on.
    fn stays(&self, at: usize) -> bool {
        self.side(at).is_none() && self.hits[at].1 == 0.0
    }

    fn first_row(&self, at: usize) -> usize {
        M::CONSTRAINTS[self.hits[at].0].first
    }

    fn takes_part(&self, at: usize) -> bool {
        let free = self.restoring && self.side(at).is_none() && !self.stays(at);
        !free && (at >= 64 || self.out >> at & 1 == 0)
    }

    /// The hit that a row belongs to.
    fn hit(&self, row: usize) -> Option<usize> {
        let of = |at: &usize| {
            let Constraint { first, rows, .. } = M::CONSTRAINTS[self.hits[*at].0];
            (first..first + rows).contains(&row)
        };
        (0..self.hits.len()).find(of)
    }

    /// It is hit, or holds.
    fn may_act(&self, row: usize) -> bool {
        self.hit(row).is_some() || holds::<M>(self.modes, row)
    }

    fn acts(&self, row: usize) -> bool {
        self.may_act(row) && self.hit(row).is_none_or(|at| self.takes_part(at))
    }

    /// −Φ̇ on rows that act.
    fn right(&self) -> M::Rows {
        let mut right = M::Rows::zeros();
        for row in (0..M::Rows::LEN).filter(|row| self.acts(*row)) {
            right[row] = -self.before[row];
        }
        right
    }

    /// The first contact that takes part and pulls, or does not and closes.
    fn first_wrong(&self, impulses: &M::Rows, velocities: &M::Rows) -> Option<usize> {
        let size = max_abs(velocities.as_slice()) + max_abs(self.before.as_slice());
        let wrong = |at: &usize| {
            let (row, at) = (self.first_row(*at), *at);
            self.side(at).is_some_and(|side| match self.takes_part(at) {
                true => side * impulses[row] < 0.0,
                false => side * velocities[row] < -1e-12 * size,
            })
        };
        (0..self.hits.len().min(64)).find(wrong)
    }

    /// Rows that act have come to rest.
    fn check(
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
            if distance.is_nan() || distance > 1e-9 * (1.0 + size) {
                let (what, row) = ("velocities", system_names::<M>().row(row));
                return Err(SolveError::OffConstraint { what, row, residual, distance });
            }
        }
        Ok(())
    }
}

/// −½ Λᵀ Φ_q (q̇⁺ + q̇⁻).
fn lost<M: Constraints>(
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
