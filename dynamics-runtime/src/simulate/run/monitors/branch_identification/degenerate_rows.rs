//! What vanishes where branches of constraints meet: the gradient of one row, or that of the combination of
//! rows that loses rank.
//!
//! With wᵀΦ_q = σ vᵀ for the least singular value, δ = Φ_q⁺ r, of least M-norm for a fixed r, is (wᵀr/σ) v
//! but for what stays finite, so g = δ/|δ|² is the gradient σ v of the combination wᵀΦ over wᵀr, to σ of
//! itself: it vanishes where the rank is lost, and its sign is that of the branch. Of one row it is that
//! row's gradient. It takes one correction and no decomposition.
//!
//! Whether branches can touch in a place is told by the second order there: beside it, g = Hξ on the
//! directions that are left open. Where branches cross, g grows along the motion as it does elsewhere; where
//! they touch, Hτ = 0. And where g does not change much within a part of a step to all sides, it is short and
//! vanishes nowhere near: another branch, at −2|g|/vᵀHv, is farther off.

use alloc::vec::Vec;

use crate::constrain::active_set::{active_rows, holds};
use crate::constrain::assemble::weigh;
use crate::constrain::gradients::mass;
use crate::constrain::rank_margin::rank_margin;
use crate::constrain::{self, Gradients, TopContributors};
use crate::linalg::norm;
use crate::math;
use crate::model::{ConstraintKind, Constraints, ModelState, Vector};

/// Part of the way between states within which it is looked how gradients grow.
const PROBE: f64 = 0.1;
/// Growth along the motion in parts of that across from which on branches cross.
const CROSSES: f64 = 0.2;
/// Part of that way within which a gradient does not change much where no other branch is near.
const NEAR: f64 = 0.03;
/// Part of the gradient that is left there.
const STAYS: f64 = 0.5;

/// Most coordinates whose combinations of rows are followed: where generated code has no solution, next to
/// lost rank, a correction takes n³, and a doubtful place asks for 6 n of them.
const MOST: usize = 32;

/// What may vanish.
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

/// What is followed, and how it is measured.
pub(crate) struct DegenerateRowSet<M: Constraints> {
    pub(crate) all: Vec<DegenerateRows>,
    /// √Mᵢᵢ at the start.
    pub(crate) weights: M::Vector,
    /// r.
    right: M::Rows,
    /// That of what keeps the constraints, lent for as long as it is looked.
    pub(crate) workspace: Vec<f64>,
}

impl<M: Constraints> DegenerateRowSet<M> {
    /// Nothing.
    pub(crate) fn none() -> Self {
        Self { all: Vec::new(), weights: M::Vector::zeros(), right: M::Rows::zeros(), workspace: Vec::new() }
    }

    /// Follows what may vanish, from a start on.
    pub(crate) fn follow(&mut self, model: &M, start: &M::State) {
        let single =
            M::CONSTRAINTS.iter().filter(|one| one.kind == ConstraintKind::Holonomic && one.rows == 1);
        self.all.extend(single.map(|one| DegenerateRows::Row(one.first)));
        // Rows that repeat others have no rank of theirs to lose.
        if M::Residual::LEN > 1 && M::Vector::LEN <= MOST && !M::CONSTRAINTS.iter().any(|one| one.redundant) {
            self.all.push(DegenerateRows::All);
        }
        if self.all.is_empty() {
            return;
        }
        self.weights = weights(model, start, &mut self.workspace);
        let gradients = Gradients::alone(model, start, &mut self.workspace);
        for row in 0..M::Residual::LEN {
            let usual = length(gradients.row(row), self.weights.as_slice());
            // Of all combinations, none that a mechanism is likely to lose is without a share.
            let share = 1.5 + math::sin(1.0 + 2.4 * row as f64);
            self.right[row] = share * if usual > 0.0 && usual.is_finite() { usual } else { 1.0 };
        }
    }

    /// Whether it holds: a slack rope leads nobody, wherever its gradient is.
    pub(crate) fn holds(&self, state: &M::State, degenerate: DegenerateRows) -> bool {
        match degenerate {
            DegenerateRows::Row(row) => holds::<M>(state.modes(), row),
            DegenerateRows::All => active_rows::<M>(state.modes(), true).nth(1).is_some(),
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
                && holds::<M>(state.modes(), row)
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

    /// In coordinates measured by their weights; zero where it is not known.
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
                active_rows::<M>(state.modes(), true).for_each(|row| right[row] = self.right[row]);
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

    /// Whether what is short in a place does not vanish there as branches do that touch; `way` is that
    /// between states beside it.
    pub(crate) fn is_plain(
        &mut self,
        (model, constants): (&M, &M::Constants),
        place: &M::State,
        degenerate: DegenerateRows,
        way: f64,
    ) -> bool {
        let mut along = *place.u();
        (0..M::Vector::LEN).for_each(|i| along[i] *= self.weights[i]);
        let speed = norm(along.as_slice());
        if !(speed > 0.0 && speed.is_finite()) {
            return false;
        }
        along.as_mut_slice().iter_mut().for_each(|x| *x /= speed);
        // By so much along the motion, and along one of the coordinates.
        let mut at = |forward: f64, (axis, other): (usize, f64)| {
            let mut state = *place;
            (0..M::Vector::LEN).for_each(|i| state.q_mut()[i] += forward * along[i] / self.weights[i]);
            state.q_mut()[axis] += other / self.weights[axis];
            norm(self.gradient(model, constants, &state, degenerate).as_slice())
        };
        let (here, near, sides) = (at(0.0, (0, 0.0)), NEAR * way, [1.0, -1.0]);
        // What is not a number is none of both.
        let stays = |beside: f64| beside > 0.0 && here >= STAYS * beside;
        let mut across = (0..M::Vector::LEN).flat_map(|axis| sides.map(|side| (axis, side * near)));
        if sides.iter().all(|side| stays(at(side * near, (0, 0.0))))
            && across.all(|other| stays(at(0.0, other)))
        {
            return true;
        }
        let (probe, mut most) = (PROBE * way, here);
        for axis in 0..M::Vector::LEN {
            for (forward, other) in [(0.0, probe), (0.0, -probe), (probe, probe), (probe, -probe)] {
                most = math::max(most, at(forward, (axis, other)));
            }
        }
        sides.iter().all(|side| at(side * probe, (0, 0.0)) >= CROSSES * most)
    }
}

/// The rows of what vanishes at a state.
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

/// √Mᵢᵢ.
pub(crate) fn weights<M: Constraints>(model: &M, state: &M::State, workspace: &mut [f64]) -> M::Vector {
    let mass = mass(model, state, workspace);
    let mut weights = M::Vector::zeros();
    (0..M::Vector::LEN).for_each(|i| weights[i] = mass[i * (M::Vector::LEN + 1)]);
    weigh(weights.as_mut_slice());
    weights
}

/// Of a gradient, coordinates measured by these weights.
pub(crate) fn length(gradient: &[f64], weights: &[f64]) -> f64 {
    math::sqrt(gradient.iter().zip(weights).map(|(x, w)| (x / w) * (x / w)).sum())
}
