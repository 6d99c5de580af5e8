//! Degenerate rows: the gradients that vanish where branches of constraints meet.
//!
//! It is the gradient of one row, or that of the combination of rows that loses rank. For the latter, let
//! wᵀΦ_q = σ vᵀ for the least singular value σ. δ = Φ_q⁺ r, of least M-norm for a fixed r, is
//! (wᵀr/σ) v plus a finite part. So g = δ/|δ|² is the gradient σ v of the combination wᵀΦ over
//! wᵀr, up to a relative error of order σ. It vanishes where rank is lost, its sign is that of the branch,
//! and it takes one correction and no decomposition.
//!
//! Whether branches can touch in a place is decided by second derivatives: near it, g = Hξ on the directions
//! that the constraints leave open. Where branches cross, g grows along the motion as it does across. Where
//! they touch, Hτ = 0 for the motion's direction τ. If g does not change much within a part of a step on
//! all sides, it is only short and vanishes nowhere near: the other branch, at −2|g|/vᵀHv, is farther
//! away.

use alloc::vec::Vec;

use crate::constrain::active_set::{active_rows, holds};
use crate::constrain::assemble::weigh;
use crate::constrain::gradients::mass;
use crate::constrain::rank_margin::rank_margin;
use crate::constrain::{self, Gradients, TopContributors};
use crate::linalg::norm;
use crate::math;
use crate::model::{ConstraintKind, Constraints, ModelState, Vector};

/// Displacement, in parts of the distance between nodes, by which the growth of gradients is measured.
const GROWTH_PROBE: f64 = 0.1;
/// Least growth of a gradient along the motion, in parts of that across, for which branches cross and do not
/// touch.
const MIN_GROWTH_ALONG: f64 = 0.2;
/// Displacement, in the same parts, within which a gradient that is only short does not change much.
const SHORT_PROBE: f64 = 0.03;
/// Least length of such a gradient, in parts of that at the displaced states.
const MIN_REMAINING_LENGTH: f64 = 0.5;

/// Most coordinates n with which combinations of rows are followed. Near lost rank generated code has no
/// solution, a correction takes n³ operations, and a suspected place needs 6n of them.
const MAX_COORDINATES: usize = 32;

/// A gradient that may vanish.
#[derive(Clone, Copy, PartialEq)]
pub(crate) enum DegenerateRows {
    /// The gradient of a constraint of one row.
    Row(usize),
    /// That of a combination of rows.
    All,
}

/// Lengths of gradients.
#[derive(Clone, Copy)]
pub(crate) struct Lengths<R> {
    rows: R,
    all: f64,
}

impl<R: Vector> Lengths<R> {
    pub(crate) fn zeros() -> Self {
        Self { rows: R::zeros(), all: 0.0 }
    }

    pub(crate) fn of(&self, degenerate: DegenerateRows) -> f64 {
        match degenerate {
            DegenerateRows::Row(row) => self.rows[row],
            DegenerateRows::All => self.all,
        }
    }

    fn set(&mut self, degenerate: DegenerateRows, to: f64) {
        match degenerate {
            DegenerateRows::Row(row) => self.rows[row] = to,
            DegenerateRows::All => self.all = to,
        }
    }

    pub(crate) fn at_least(&mut self, other: &Self) {
        (0..R::LEN).for_each(|row| self.rows[row] = math::max(self.rows[row], other.rows[row]));
        self.all = math::max(self.all, other.all);
    }
}

/// The gradients that are followed, with the weights by which they are measured.
pub(crate) struct DegenerateRowSet<M: Constraints> {
    pub(crate) all: Vec<DegenerateRows>,
    /// √Mᵢᵢ at the start.
    pub(crate) weights: M::Vector,
    /// r of this file's head.
    right: M::Rows,
    /// The workspace of the stabilization, lent during a check.
    pub(crate) workspace: Vec<f64>,
}

impl<M: Constraints> DegenerateRowSet<M> {
    /// Without gradients to follow.
    pub(crate) fn none() -> Self {
        Self { all: Vec::new(), weights: M::Vector::zeros(), right: M::Rows::zeros(), workspace: Vec::new() }
    }

    /// Follows all gradients that may vanish, in a run from this start.
    pub(crate) fn follow(&mut self, model: &M, start: &M::State) {
        let single =
            M::CONSTRAINTS.iter().filter(|one| one.kind == ConstraintKind::Holonomic && one.rows == 1);
        self.all.extend(single.map(|one| DegenerateRows::Row(one.first)));
        // Models with redundant constraints have no full rank that could be lost.
        if M::Residual::LEN > 1
            && M::Vector::LEN <= MAX_COORDINATES
            && !M::CONSTRAINTS.iter().any(|one| one.redundant)
        {
            self.all.push(DegenerateRows::All);
        }
        if self.all.is_empty() {
            return;
        }
        self.weights = weights(model, start, &mut self.workspace);
        let gradients = Gradients::alone(model, start, &mut self.workspace);
        for row in 0..M::Residual::LEN {
            let start_length = length(gradients.row(row), self.weights.as_slice());
            // Irregular shares, so that no likely combination w has wᵀr = 0.
            let share = 1.5 + math::sin(1.0 + 2.4 * row as f64);
            self.right[row] =
                share * if start_length > 0.0 && start_length.is_finite() { start_length } else { 1.0 };
        }
    }

    /// Whether its constraints hold: released ones, as a slack rope, do not guide the motion.
    pub(crate) fn holds(&self, state: &M::State, degenerate: DegenerateRows) -> bool {
        match degenerate {
            DegenerateRows::Row(row) => holds::<M>(state.active_set(), row),
            DegenerateRows::All => active_rows::<M>(state.active_set(), true).nth(1).is_some(),
        }
    }

    pub(crate) fn lengths(
        &mut self,
        model: &M,
        constants: &M::Constants,
        state: &M::State,
    ) -> Lengths<M::Rows> {
        let mut lengths = Lengths::<M::Rows>::zeros();
        let gradients = match self.all[0] {
            DegenerateRows::Row(_) => Some(Gradients::alone(model, state, &mut self.workspace)),
            DegenerateRows::All => None,
        };
        for degenerate in &self.all {
            if let (DegenerateRows::Row(row), Some(gradients)) = (*degenerate, &gradients)
                && holds::<M>(state.active_set(), row)
            {
                lengths.rows[row] = length(gradients.row(row), self.weights.as_slice());
            }
        }
        if self.all.contains(&DegenerateRows::All) && self.holds(state, DegenerateRows::All) {
            lengths.set(
                DegenerateRows::All,
                norm(self.gradient(model, constants, state, DegenerateRows::All).as_slice()),
            );
        }
        lengths
    }

    /// The gradient in weighted coordinates; zero where it cannot be found.
    pub(crate) fn gradient(
        &mut self,
        model: &M,
        constants: &M::Constants,
        state: &M::State,
        degenerate: DegenerateRows,
    ) -> M::Vector {
        let mut out = M::Vector::zeros();
        match degenerate {
            DegenerateRows::Row(row) => {
                let gradients = Gradients::alone(model, state, &mut self.workspace);
                (0..M::Vector::LEN).for_each(|i| out[i] = gradients.row(row)[i] / self.weights[i]);
            }
            DegenerateRows::All => {
                let mut right = M::Rows::zeros();
                active_rows::<M>(state.active_set(), true).for_each(|row| right[row] = self.right[row]);
                let Ok(delta) = constrain::correct(model, constants, state, &right, &mut self.workspace)
                else {
                    return out;
                };
                (0..M::Vector::LEN).for_each(|i| out[i] = delta[i] * self.weights[i]);
                let size = norm(out.as_slice());
                let usable = size > 0.0 && size.is_finite();
                out.as_mut_slice().iter_mut().for_each(|x| *x = if usable { *x / size / size } else { 0.0 });
            }
        }
        out
    }

    /// Whether a gradient that is short in a place does not vanish there as that of touching branches does.
    /// `distance` is that between the nodes around the place.
    pub(crate) fn is_only_short(
        &mut self,
        (model, constants): (&M, &M::Constants),
        place: &M::State,
        degenerate: DegenerateRows,
        distance: f64,
    ) -> bool {
        let mut tangent = *place.u();
        (0..M::Vector::LEN).for_each(|i| tangent[i] *= self.weights[i]);
        let speed = norm(tangent.as_slice());
        if !(speed > 0.0 && speed.is_finite()) {
            return false;
        }
        tangent.as_mut_slice().iter_mut().for_each(|x| *x /= speed);
        // The length of the gradient at a displacement along the motion and along one of the coordinates.
        let mut at = |forward: f64, (axis, other): (usize, f64)| {
            let mut state = *place;
            (0..M::Vector::LEN).for_each(|i| state.q_mut()[i] += forward * tangent[i] / self.weights[i]);
            state.q_mut()[axis] += other / self.weights[axis];
            norm(self.gradient(model, constants, &state, degenerate).as_slice())
        };
        let (here, short_probe, sides) = (at(0.0, (0, 0.0)), SHORT_PROBE * distance, [1.0, -1.0]);
        // False for a length that is not a number.
        let stays = |beside: f64| beside > 0.0 && here >= MIN_REMAINING_LENGTH * beside;
        let mut across = (0..M::Vector::LEN).flat_map(|axis| sides.map(|side| (axis, side * short_probe)));
        if sides.iter().all(|side| stays(at(side * short_probe, (0, 0.0))))
            && across.all(|other| stays(at(0.0, other)))
        {
            return true;
        }
        let (growth_probe, mut most) = (GROWTH_PROBE * distance, here);
        for axis in 0..M::Vector::LEN {
            for (forward, other) in [
                (0.0, growth_probe),
                (0.0, -growth_probe),
                (growth_probe, growth_probe),
                (growth_probe, -growth_probe),
            ] {
                most = math::max(most, at(forward, (axis, other)));
            }
        }
        sides.iter().all(|side| at(side * growth_probe, (0, 0.0)) >= MIN_GROWTH_ALONG * most)
    }
}

/// The rows of a gradient that vanishes at a state.
pub(crate) fn rows_of<M: Constraints>(
    model: &M,
    state: &M::State,
    degenerate: DegenerateRows,
) -> TopContributors {
    match degenerate {
        DegenerateRows::Row(row) => TopContributors::ranked(M::ROWS, core::iter::once((row, 1.0))),
        DegenerateRows::All => rank_margin(model, state).rows,
    }
}

/// √Mᵢᵢ of the coordinates.
pub(crate) fn weights<M: Constraints>(model: &M, state: &M::State, workspace: &mut [f64]) -> M::Vector {
    let mass = mass(model, state, workspace);
    let mut weights = M::Vector::zeros();
    (0..M::Vector::LEN).for_each(|i| weights[i] = mass[i * (M::Vector::LEN + 1)]);
    weigh(weights.as_mut_slice());
    weights
}

/// Length of a gradient in weighted coordinates.
pub(crate) fn length(gradient: &[f64], weights: &[f64]) -> f64 {
    math::sqrt(gradient.iter().zip(weights).map(|(x, w)| (x / w) * (x / w)).sum())
}
