//! Positions that fulfil the holonomic constraints: damped Gauss–Newton, then the closest approach, then a
//! diagnosis.

use super::workspace::{self, AssemblyWorkspace, moved};
use super::{ASSEMBLY_TOLERANCE, Violation, model_size, one_plus_largest, worst_violation};
use crate::constrain::TopContributors;
use crate::constrain::active_set::active_rows;
use crate::error::StateError;
use crate::linalg::norm;
use crate::math;
use crate::model::{Constraints, ModelState, Vector};

/// Singular values below this part of the largest count as zero in a Newton step. Rounding leaves about
/// 10⁻¹⁵; a larger value would cut off directions near singular positions.
const NEWTON_RANK_TOLERANCE: f64 = 1e-11;
/// Where no progress is made, directions with singular values below this part of the largest are searched for
/// branches. Such a place is known to the square root of the accuracy only, so that zeros come out larger
/// there than in [`NEWTON_RANK_TOLERANCE`].
const OPEN_DIRECTION_TOLERANCE: f64 = 1e-5;
/// Most Newton steps. A good guess takes fewer than ten.
const MAX_NEWTON_STEPS: usize = 100;
/// Smallest damping factor. Where a smaller one is needed, a singular configuration lies across the path.
const MIN_DAMPING: f64 = 1e-4;
/// Longest step, in parts of ‖w (1 + |q|)‖ of the guess. Near a singular configuration Newton steps have
/// any length, and an angle that turns several times on its way has lost its branch.
const MAX_STEP_RATIO: f64 = 0.25;
/// Number of other guesses from which a closer approach is searched after the user's guess failed, and most
/// steps from each. The search only improves the error message (`the_miss_is_that_of_the_closest_approach` in
/// `dynamics-runtime/tests/assembly.rs`).
const RESTARTS: usize = 12;
const MAX_RESTART_DESCENTS: usize = 60;
/// Part of the gap by which the approach from another guess must be closer to replace the first.
const RESTART_IMPROVEMENT: f64 = 1e-2;
/// Most steps of the Levenberg–Marquardt method from the user's guess.
const MAX_DESCENTS: usize = 300;

/// Solves for the positions that are not given.
pub(super) fn solve<M: Constraints>(
    model: &M,
    state: &mut M::State,
    given: &[bool],
    work: &mut AssemblyWorkspace<'_>,
) -> Result<(), StateError> {
    let guess = *state;
    work.evaluate(model, state);
    work.weigh();
    // Newton's method from the guess.
    let mut search = PositionSearch { model, given, work };
    search.newton(state)?;
    if search.violation(state)?.is_none() {
        return Ok(());
    }
    // The closest approach, and Newton's method from there.
    *state = guess;
    search.linearise(state)?;
    search.descend(state, MAX_DESCENTS)?;
    let mut polished = *state;
    search.newton(&mut polished)?;
    if search.violation(&polished)?.is_none() {
        *state = polished;
        return Ok(());
    }
    match search.violation(state)? {
        Some(violation) => {
            let error = search.diagnose(&guess, state, &violation)?;
            Err(search.search_from_restarts(&guess, state, error)?)
        }
        // The closest approach is a solution.
        None => Ok(()),
    }
}

struct PositionSearch<'s, 'w, M> {
    model: &'s M,
    given: &'s [bool],
    work: &'s mut AssemblyWorkspace<'w>,
}

impl<M: Constraints> PositionSearch<'_, '_, M> {
    /// The row with the largest violation, if any.
    fn violation(&mut self, state: &M::State) -> Result<Option<Violation>, StateError> {
        let values = self.model.residual(state);
        let tolerance = ASSEMBLY_TOLERANCE * one_plus_largest(state.q().as_slice());
        self.work.evaluate(self.model, state);
        worst_violation::<M>(
            state.active_set(),
            true,
            values.as_slice(),
            (self.work.jacobian, self.work.usual_lengths),
            |_| tolerance,
        )
    }

    fn linearise(&mut self, state: &M::State) -> Result<(), StateError> {
        self.work.evaluate(self.model, state);
        self.work.decompose::<M>(state.active_set(), true, self.given).map_err(|error| {
            // Where Φ itself is not finite, the error is about Φ.
            let residual = self.model.residual(state);
            let row = active_rows::<M>(state.active_set(), true).find(|row| !residual[*row].is_finite());
            row.map_or(error, |row| StateError::ConstraintNotFinite { row: M::ROWS[row].name })
        })
    }

    /// Linearises in the scales of the last linearisation.
    fn relinearise(&mut self, state: &M::State) {
        self.work.evaluate(self.model, state);
        self.work.decompose_in_scales::<M>(state.active_set(), true, self.given);
    }

    /// Loads −Φ at a state as right-hand side, in the scales of the last linearisation; returns its norm.
    fn load_residual(&mut self, state: &M::State) -> Result<f64, StateError> {
        self.work.load_residual::<M>(state.active_set(), true, self.model.residual(state).as_slice())
    }

    /// The state after a part of a step.
    fn trial(&self, state: &M::State, factor: f64, step: usize) -> M::State {
        moved(state, self.given, self.work.weights, factor, self.work.steps[step])
    }

    /// Length in scaled coordinates against which rounding is judged: ‖w (1 + |q|)‖.
    fn coordinate_scale(&self, state: &M::State) -> f64 {
        let terms = self.work.weights.iter().zip(state.q().as_slice());
        math::sqrt(terms.map(|(w, q)| math::powi(w * (1.0 + q.abs()), 2)).sum())
    }

    /// NLEQ-ERR: Newton steps δ, simplified Newton corrections δ̄ at their ends, and the damping λ that both
    /// predict. Ends at a solution, or where no progress is made.
    fn newton(&mut self, state: &mut M::State) -> Result<(), StateError> {
        const STEP: usize = 0;
        const NEXT: usize = 1;
        const WORK: usize = 2;
        let coordinate_scale = self.coordinate_scale(state);
        let rounding = 4.0 * f64::EPSILON * coordinate_scale;
        // λ and ‖δ‖ of the last step, whose simplified correction is still in NEXT.
        let mut last_step: Option<(f64, f64)> = None;
        for _ in 0..MAX_NEWTON_STEPS {
            // The Newton step δ.
            self.linearise(state)?;
            self.load_residual(state)?;
            self.work.solve(STEP, NEWTON_RANK_TOLERANCE, 0.0);
            let length = self.work.step_norm(STEP);
            if length <= rounding {
                *state = self.trial(state, 1.0, STEP);
                return Ok(());
            }
            // Predicted damping: λ ‖δ_last‖ ‖δ̄‖ / (‖δ̄ − δ‖ ‖δ‖), limited by the
            // longest step.
            let predicted_damping = last_step.map_or(1.0, |(lambda, last)| {
                let difference = difference(self.work, NEXT, STEP, 1.0);
                lambda * last * self.work.step_norm(NEXT) / (difference * length)
            });
            let longest = f64::min(1.0, MAX_STEP_RATIO * coordinate_scale / length);
            let mut lambda =
                if predicted_damping.is_nan() { 1.0 } else { predicted_damping.max(MIN_DAMPING) }
                    .min(longest);
            loop {
                let trial = self.trial(state, lambda, STEP);
                // Monotonicity test ‖δ̄(λ)‖ ≤ (1 − λ/4) ‖δ‖. Outside of the domain of Φ the
                // step is too long.
                let is_defined = self.load_residual(&trial).is_ok();
                let (mut is_better, mut suggested_damping) = (false, 0.5 * lambda);
                if is_defined {
                    self.work.solve(WORK, NEWTON_RANK_TOLERANCE, 0.0);
                    is_better = self.work.step_norm(WORK) <= (1.0 - 0.25 * lambda) * length;
                    let curvature = difference(self.work, WORK, STEP, 1.0 - lambda);
                    suggested_damping = 0.5 * length * lambda * lambda / curvature;
                }
                if is_better {
                    *state = trial;
                    let [_, next_step, work] = &mut self.work.steps;
                    next_step.copy_from_slice(work);
                    last_step = Some((lambda, length));
                    break;
                }
                if lambda <= MIN_DAMPING || length <= 1e5 * rounding {
                    return Ok(());
                }
                lambda = if suggested_damping < 0.5 * lambda {
                    suggested_damping.max(0.1 * lambda)
                } else {
                    0.5 * lambda
                };
            }
        }
        Ok(())
    }

    /// Levenberg–Marquardt on ‖Φ/s‖ with the scales s of the last linearisation, to a solution or to the
    /// closest approach. The scales stay fixed: otherwise there is no function that decreases, and the method
    /// could end at a point that is stationary for none.
    fn descend(&mut self, state: &mut M::State, most: usize) -> Result<(), StateError> {
        let longest = MAX_STEP_RATIO * self.coordinate_scale(state);
        let mut mu = 1e-2;
        for _ in 0..most {
            self.relinearise(state);
            let length = self.load_residual(state)?;
            let largest = self.work.svd().largest();
            if length == 0.0 || largest == 0.0 {
                return Ok(());
            }
            loop {
                self.load_residual(state)?;
                self.work.solve(0, 0.0, mu * largest);
                let trial = self.trial(state, 1.0, 0);
                if self.work.step_norm(0) <= f64::EPSILON * self.coordinate_scale(state) {
                    return Ok(());
                }
                if self.work.step_norm(0) <= longest
                    && self.load_residual(&trial).is_ok_and(|next| next < length)
                {
                    *state = trial;
                    mu = (0.2 * mu).max(1e-14);
                    break;
                }
                mu *= 4.0;
            }
        }
        Ok(())
    }

    /// The error for the closest approach: branches that meet there, or given coordinates that prevent
    /// closing.
    fn diagnose(
        &mut self,
        guess: &M::State,
        state: &M::State,
        violation: &Violation,
    ) -> Result<StateError, StateError> {
        // In the scales of the guess, in which this is the closest approach.
        self.linearise(guess)?;
        self.relinearise(state);
        let length = self.load_residual(state)?;
        let (row, residual, distance) = (M::ROWS[violation.row].name, violation.residual, violation.distance);
        if let Some(coordinates) = self.find_descending_branch(state, length)? {
            return Ok(StateError::SingularGuess { row, residual, coordinates });
        }
        self.relinearise(state);
        self.load_residual(state)?;
        let given = self.blocking_coordinates(state);
        Ok(StateError::NotAssembled { row, residual, distance, given })
    }

    /// Improves the error by other guesses, because the closest approach from the user's guess may be one of
    /// several. Where another guess leads to a solution, the error names the coordinate that differs most.
    /// Otherwise it reports the smallest gap.
    #[cold]
    fn search_from_restarts(
        &mut self,
        guess: &M::State,
        state: &mut M::State,
        error: StateError,
    ) -> Result<StateError, StateError> {
        let StateError::NotAssembled { row, residual, .. } = error else { return Ok(error) };
        self.linearise(guess)?;
        let (first, mut best) = (self.load_residual(state)?, *state);
        let mut least = first;
        for restart in 0..RESTARTS {
            // In the scales of the user's guess, so that gaps can be compared.
            let mut displaced = self.restart(guess, restart);
            let ends = self.load_residual(&displaced).is_ok()
                && self.descend(&mut displaced, MAX_RESTART_DESCENTS).is_ok();
            match self.load_residual(&displaced) {
                Ok(length) if ends && length < (1.0 - RESTART_IMPROVEMENT) * least => {
                    (least, best) = (length, displaced)
                }
                _ => {}
            }
        }
        if least == first {
            return Ok(error);
        }
        let mut closed = best;
        if self.newton(&mut closed).is_ok()
            && self.violation(&closed).is_ok_and(|violation| violation.is_none())
        {
            let change = |j: &usize| (closed.q().as_slice()[*j] - guess.q().as_slice()[*j]).abs();
            let most = workspace::free_columns(self.given).max_by(|i, j| change(i).total_cmp(&change(j)));
            if let Some(j) = most {
                let (coordinate, value) = (M::COORDINATES[j].name, closed.q().as_slice()[j]);
                return Ok(StateError::NotReached { row, residual, coordinate, value });
            }
        }
        let Some(violation) = self.violation(&best)? else { return Ok(error) };
        self.linearise(guess)?;
        self.relinearise(&best);
        self.load_residual(&best)?;
        let given = self.blocking_coordinates(&best);
        *state = best;
        let (row, residual, distance) = (M::ROWS[violation.row].name, violation.residual, violation.distance);
        Ok(StateError::NotAssembled { row, residual, distance, given })
    }

    /// Another guess: free angles are turned by up to half a turn, other free coordinates moved by up to
    /// their size.
    fn restart(&self, guess: &M::State, restart: usize) -> M::State {
        let mut displaced = *guess;
        for j in workspace::free_columns(self.given) {
            let q = guess.q().as_slice()[j];
            let coordinate = &M::COORDINATES[j];
            let size = || q.abs().max(model_size(self.model, coordinate));
            let by = if coordinate.is_angle() { core::f64::consts::PI } else { size() };
            // Pseudo-random between −1 and 1, different for each coordinate and guess.
            let (part, _) = math::sin_cos(1.3 + 2.399_963 * (1 + restart + RESTARTS * j) as f64);
            displaced.q_mut()[j] = q + by * part;
        }
        displaced
    }

    /// The coordinates of an open direction along which a displaced state comes closer: this place is then a
    /// saddle between two branches.
    fn find_descending_branch(
        &mut self,
        state: &M::State,
        length: f64,
    ) -> Result<Option<TopContributors>, StateError> {
        let (_, free_columns) = self.work.shape;
        let coordinate_scale = 0.05 * self.coordinate_scale(state);
        for column in 0..free_columns {
            for sign in [1.0, -1.0] {
                self.relinearise(state);
                let svd = self.work.svd();
                let open = svd.sigma[column] <= OPEN_DIRECTION_TOLERANCE * svd.largest();
                if !open {
                    break;
                }
                self.work.copy_right_singular_vector(column);
                let direction = &self.work.spare[0][..free_columns];
                let shares = workspace::free_columns(self.given).zip(direction.iter().copied());
                let coordinates = TopContributors::ranked(M::COORDINATES, shares);
                let mut displaced =
                    moved(state, self.given, self.work.weights, sign * coordinate_scale, direction);
                self.descend(&mut displaced, 30)?;
                if self.load_residual(&displaced).is_ok_and(|closer| closer < 0.5 * length) {
                    return Ok(Some(coordinates));
                }
            }
        }
        Ok(None)
    }

    /// The given coordinates that would have to move to reduce the gap, by −∂‖Φ/s‖²/∂q. Where
    /// that gradient is zero, at the place farthest from closing, all given coordinates that enter the
    /// constraints.
    fn blocking_coordinates(&self, state: &M::State) -> TopContributors {
        let n = self.work.weights.len();
        let entry = |k: usize, row: usize, j: usize| {
            self.work.jacobian[row * n + j] / (self.work.scales[k] * self.work.weights[j])
        };
        let rows = || active_rows::<M>(state.active_set(), true).enumerate();
        // Below this, a pull is rounding of the descent in the free coordinates.
        let rounding = 1e-6 * norm(&self.work.right[..self.work.shape.0]);
        let pull = |j: usize| {
            let pull: f64 = rows().map(|(k, row)| self.work.right[k] * entry(k, row, j)).sum();
            if pull.abs() > rounding { pull } else { 0.0 }
        };
        let sensitivity = |j: usize| rows().map(|(k, row)| entry(k, row, j).abs()).fold(0.0, f64::max);
        let given = || (0..n).filter(|j| self.given[*j]);
        let pulled = TopContributors::ranked(M::COORDINATES, given().map(|j| (j, pull(j))));
        if pulled.is_empty() {
            TopContributors::ranked(M::COORDINATES, given().map(|j| (j, sensitivity(j))))
        } else {
            pulled
        }
    }
}

/// ‖steps\[a\] − factor·steps\[b\]‖.
fn difference(work: &AssemblyWorkspace<'_>, a: usize, b: usize, factor: f64) -> f64 {
    let (_, f) = work.shape;
    let pairs = work.steps[a][..f].iter().zip(&work.steps[b][..f]);
    math::sqrt(pairs.map(|(a, b)| math::powi(a - factor * b, 2)).sum())
}
