//! Impacts: the jump of velocities when constraints take hold at once.
//!
//! M (q̇⁺ − q̇⁻) = Φ_qᵀ Λ with Φ̇⁺ = −e Φ̇⁻ on the rows that hit (Newton's hypothesis) and Φ̇⁺ = 0 on the rows that hold: impulses Λ at all of
//! them, computed together. Positions do not change. Where several contacts hit at once, each may push and none may pull: contacts that
//! would have to pull are let go, as are those that part already. Glocker, Set-Valued Force Laws (2001), §5; Pfeiffer & Glocker, Multibody Dynamics
//! with Unilateral Contacts (1996), §8.

use super::correct::correct_rows;
use super::{holds, names};
use crate::error::SolveError;
use crate::model::{Constraint, ConstraintKind, Constraints, ModelState, Modes, Vector};

/// What an impact did.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Impact<R> {
    /// Λ by rows: time integrals of the multipliers during the impact; 0 where nothing acted.
    pub impulses: R,
    /// T⁻ − T⁺ of the kinetic energy T = ½ q̇ᵀMq̇: −½ Λᵀ Φ_q(q̇⁺ + q̇⁻). Negative where a moving constraint strikes.
    pub energy_lost: f64,
}

/// Changes the velocities of `state` by the impact of the constraints listed, by index in [`Constraints::CONSTRAINTS`], each with its
/// coefficient of restitution e (0: plastic, 1: elastic). Listed constraints need not hold; those that hold besides go on holding. Modes stay.
///
/// A listed scalar constraint that was released to a side is a contact: its impulse pushes to that side or is 0. Others push either way.
///
/// # Errors
/// As [`super::solve`]; [`SolveError::OffConstraint`] where the constraints leave no velocities to go on with.
pub fn impact<M: Constraints>(
    model: &M,
    state: &mut M::State,
    hits: &[(usize, f64)],
    workspace: &mut [f64],
) -> Result<Impact<M::Rows>, SolveError> {
    let modes = state.modes();
    let before = model.velocity_residual(state);
    let mut set = Set::<M> { hits, modes, out: 0, before };
    set.drop_parting();
    // Every round lets one contact go, or takes one back at most once.
    let mut taken_back = 0_u64;
    for _ in 0..2 * hits.len().max(1) {
        let right = set.right();
        let solved = correct_rows(model, state, &right, |row| set.acts(row), workspace)?;
        if let Some(pulling) = set.pulling(&solved.multipliers) {
            set.out |= 1 << pulling;
            continue;
        }
        let mut after = *state;
        add(after.u_mut().as_mut_slice(), solved.accelerations.as_slice());
        let velocities = model.velocity_residual(&after);
        let closing = set.closing(&velocities).filter(|at| taken_back >> at & 1 == 0);
        if let Some(closing) = closing {
            set.out &= !(1 << closing);
            taken_back |= 1 << closing;
            continue;
        }
        set.check(model, &after, &right, &velocities)?;
        let energy_lost = lost(model, state, &after, &solved.multipliers);
        *state = after;
        return Ok(Impact { impulses: solved.multipliers, energy_lost });
    }
    let row = hits.first().map_or(0, |(at, _)| M::CONSTRAINTS[*at].first);
    Err(SolveError::Friction { row: names::<M>().row(row), solutions: 0 })
}

/// Which contacts take part.
struct Set<'h, M: Constraints> {
    hits: &'h [(usize, f64)],
    modes: Modes,
    /// Bits of the hits that are let go.
    out: u64,
    /// Φ̇⁻.
    before: M::Rows,
}

impl<M: Constraints> Set<'_, M> {
    /// The side to which a contact pushes; `None` where the constraint is no contact.
    fn side(&self, at: usize) -> Option<f64> {
        let Constraint { kind, rows, switched, .. } = M::CONSTRAINTS[self.hits[at].0];
        let side = switched.map_or(0.0, |index| self.modes.side(index));
        (kind == ConstraintKind::Holonomic && rows == 1 && side != 0.0).then_some(side)
    }

    fn first_row(&self, at: usize) -> usize {
        M::CONSTRAINTS[self.hits[at].0].first
    }

    fn takes_part(&self, at: usize) -> bool {
        at >= 64 || self.out >> at & 1 == 0
    }

    /// The hit that a row belongs to.
    fn hit(&self, row: usize) -> Option<usize> {
        let of = |at: &usize| {
            let Constraint { first, rows, .. } = M::CONSTRAINTS[self.hits[*at].0];
            (first..first + rows).contains(&row)
        };
        (0..self.hits.len()).find(of)
    }

    fn acts(&self, row: usize) -> bool {
        match self.hit(row) {
            Some(at) => self.takes_part(at),
            None => holds::<M>(self.modes, row),
        }
    }

    /// −(1 + e) Φ̇⁻ on rows that hit, −Φ̇⁻ on rows that hold.
    fn right(&self) -> M::Rows {
        let mut right = M::Rows::zeros();
        for (row, x) in right.as_mut_slice().iter_mut().enumerate().filter(|(row, _)| self.acts(*row)) {
            let restitution = self.hit(row).map_or(0.0, |at| self.hits[at].1);
            *x = -(1.0 + restitution) * self.before[row];
        }
        right
    }

    /// Contacts that part already take no part.
    fn drop_parting(&mut self) {
        for at in 0..self.hits.len().min(64) {
            if self.side(at).is_some_and(|side| side * self.before[self.first_row(at)] > 0.0) {
                self.out |= 1 << at;
            }
        }
    }

    /// The contact that pulls most.
    fn pulling(&self, impulses: &M::Rows) -> Option<usize> {
        let pull = |at: usize| self.side(at).map_or(0.0, |side| -side * impulses[self.first_row(at)]);
        let pulls = (0..self.hits.len().min(64)).filter(|at| self.takes_part(*at)).map(|at| (at, pull(at)));
        let most = pulls.fold((0, 0.0), |most, next| if next.1 > most.1 { next } else { most });
        (most.1 > 0.0).then_some(most.0)
    }

    /// A contact that was let go and closes nevertheless.
    fn closing(&self, velocities: &M::Rows) -> Option<usize> {
        let size = super::memory::max_abs(velocities.as_slice()) + super::memory::max_abs(self.before.as_slice());
        let closes =
            |at: usize| self.side(at).is_some_and(|side| side * velocities[self.first_row(at)] < -1e-12 * size);
        (0..self.hits.len().min(64)).filter(|at| !self.takes_part(*at)).find(|at| closes(*at))
    }

    /// What was wanted of each acting row was got.
    fn check(&self, model: &M, after: &M::State, right: &M::Rows, velocities: &M::Rows) -> Result<(), SolveError> {
        let jacobian = model.jacobian(after);
        let size = super::memory::max_abs(after.u().as_slice());
        for row in (0..M::Rows::LEN).filter(|row| self.acts(*row)) {
            let residual = velocities[row] - (self.before[row] + right[row]);
            let square: f64 = (0..M::Vector::LEN).map(|j| jacobian[(row, j)] * jacobian[(row, j)]).sum();
            let distance = residual.abs() / crate::math::sqrt(square);
            if residual != 0.0 && (distance.is_nan() || distance > 1e-9 * (1.0 + size)) {
                let (what, row) = ("velocities", names::<M>().row(row));
                return Err(SolveError::OffConstraint { what, row, residual, distance });
            }
        }
        Ok(())
    }
}

/// −½ Λᵀ Φ_q (q̇⁺ + q̇⁻).
fn lost<M: Constraints>(model: &M, before: &M::State, after: &M::State, impulses: &M::Rows) -> f64 {
    let jacobian = model.jacobian(before);
    let rows = impulses.as_slice().iter().enumerate().filter(|(_, x)| **x != 0.0);
    let work = |(row, impulse): (usize, &f64)| {
        let rates = (0..M::Vector::LEN).map(|j| jacobian[(row, j)] * (before.u()[j] + after.u()[j]));
        0.5 * impulse * rates.sum::<f64>()
    };
    -rows.map(work).sum::<f64>()
}

fn add(to: &mut [f64], more: &[f64]) {
    to.iter_mut().zip(more).for_each(|(to, more)| *to += more);
}
