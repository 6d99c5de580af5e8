//! Positions that fulfil the holonomic constraints: damped Gauss–Newton, then the closest approach, then what
//! is wrong.

use super::room::{self, Room, moved};
use super::{ASSEMBLED, Violation, own_size, size, worst};
use crate::constrain::Involved;
use crate::constrain::held::active_rows;
use crate::error::StateError;
use crate::linalg::norm;
use crate::math;
use crate::model::{Constraints, ModelState, Vector};

/// Singular values below this part of the largest count as zero in a Newton step.
const RANK: f64 = 1e-11;
/// Below this part of the largest at a place where no progress is made, a direction is one in which branches
/// may part.
const BRANCH: f64 = 1e-5;
/// Newton steps; from a guess that is any good there are fewer than ten.
const MOST_STEPS: usize = 100;
/// The shortest part of a Newton step that is tried: below it, a singular configuration lies in the way.
const LEAST_DAMPING: f64 = 1e-4;
/// The longest step, against ‖w (1 + |q|)‖ of the guess: near a singular configuration Newton steps have any
/// length, and an angle that turns several times on its way has lost its branch.
const LONGEST_STEP: f64 = 0.25;
/// Places from which a closer approach is looked for where the guess leads to none that closes, and steps
/// from each.
const PLACES: usize = 12;
const DESCENTS_ELSEWHERE: usize = 60;
/// Part of the miss by which another place has to be closer.
const CLOSER: f64 = 1e-2;
/// Steps of the Levenberg–Marquardt method.
const MOST_DESCENTS: usize = 300;

/// Solves the positions that are not given.
pub(super) fn solve<M: Constraints>(
    model: &M,
    state: &mut M::State,
    given: &[bool],
    room: &mut Room<'_>,
) -> Result<(), StateError> {
    let guess = *state;
    room.evaluate(model, state);
    room.weigh();
    let mut search = PositionSearch { model, given, room };
    search.newton(state)?;
    if search.missed(state)?.is_none() {
        return Ok(());
    }
    *state = guess;
    search.linearise(state)?;
    search.descend(state, MOST_DESCENTS)?;
    let mut polished = *state;
    search.newton(&mut polished)?;
    if search.missed(&polished)?.is_none() {
        *state = polished;
        return Ok(());
    }
    match search.missed(state)? {
        Some(missed) => {
            let error = search.diagnose(&guess, state, &missed)?;
            Err(search.look_elsewhere(&guess, state, error)?)
        }
        // The closest approach is a solution.
        None => Ok(()),
    }
}

struct PositionSearch<'s, 'w, M> {
    model: &'s M,
    given: &'s [bool],
    room: &'s mut Room<'w>,
}

impl<M: Constraints> PositionSearch<'_, '_, M> {
    /// The row that is missed most, if the constraints are missed.
    fn missed(&mut self, state: &M::State) -> Result<Option<Violation>, StateError> {
        let values = self.model.residual(state);
        let tolerance = ASSEMBLED * size(state.q().as_slice());
        self.room.evaluate(self.model, state);
        worst::<M>(state.modes(), true, values.as_slice(), (self.room.jacobian, self.room.usual), |_| {
            tolerance
        })
    }

    fn linearise(&mut self, state: &M::State) -> Result<(), StateError> {
        self.room.evaluate(self.model, state);
        self.room.decompose::<M>(state.modes(), true, self.given).map_err(|error| {
            // Where Φ is not finite it is no matter of its gradient.
            let residual = self.model.residual(state);
            let row = active_rows::<M>(state.modes(), true).find(|row| !residual[*row].is_finite());
            row.map_or(error, |row| StateError::ConstraintNotFinite { row: M::ROWS[row].name })
        })
    }

    /// Linearises with the rows scaled as they are.
    fn relinearise(&mut self, state: &M::State) {
        self.room.evaluate(self.model, state);
        self.room.decompose_again::<M>(state.modes(), true, self.given);
    }

    /// Loads Φ at a state in the scales of the last linearisation; returns its scaled length.
    fn load(&mut self, state: &M::State) -> Result<f64, StateError> {
        self.room.load::<M>(state.modes(), true, self.model.residual(state).as_slice())
    }

    fn trial(&self, state: &M::State, factor: f64, step: usize) -> M::State {
        moved(state, self.given, self.room.weights, factor, self.room.steps[step])
    }

    /// Length in scaled coordinates against which rounding is judged: ‖w (1 + |q|)‖.
    fn scale(&self, state: &M::State) -> f64 {
        let terms = self.room.weights.iter().zip(state.q().as_slice());
        math::sqrt(terms.map(|(w, q)| math::powi(w * (1.0 + q.abs()), 2)).sum())
    }

    /// NLEQ-ERR: Newton steps δ, simplified Newton corrections δ̄ at their ends, and the damping that the two
    /// of them predict. Ends at a solution, or where no progress is made.
    fn newton(&mut self, state: &mut M::State) -> Result<(), StateError> {
        const STEP: usize = 0;
        const NEXT: usize = 1;
        const WORK: usize = 2;
        let scale = self.scale(state);
        let rounding = 4.0 * f64::EPSILON * scale;
        // λ and ‖δ‖ of the step before, whose simplified correction is still in NEXT.
        let mut before: Option<(f64, f64)> = None;
        for _ in 0..MOST_STEPS {
            self.linearise(state)?;
            self.load(state)?;
            self.room.solve(STEP, RANK, 0.0);
            let length = self.room.length(STEP);
            if length <= rounding {
                *state = self.trial(state, 1.0, STEP);
                return Ok(());
            }
            let predicted = before.map_or(1.0, |(lambda, last)| {
                let difference = difference(self.room, NEXT, STEP, 1.0);
                lambda * last * self.room.length(NEXT) / (difference * length)
            });
            let farthest = f64::min(1.0, LONGEST_STEP * scale / length);
            let mut lambda =
                if predicted.is_nan() { 1.0 } else { predicted.max(LEAST_DAMPING) }.min(farthest);
            loop {
                let trial = self.trial(state, lambda, STEP);
                // Beyond the domain of the constraints: too far.
                let loaded = self.load(&trial).is_ok();
                let (mut better, mut suited) = (false, 0.5 * lambda);
                if loaded {
                    self.room.solve(WORK, RANK, 0.0);
                    better = self.room.length(WORK) <= (1.0 - 0.25 * lambda) * length;
                    let curvature = difference(self.room, WORK, STEP, 1.0 - lambda);
                    suited = 0.5 * length * lambda * lambda / curvature;
                }
                if better {
                    *state = trial;
                    let [_, next, work] = &mut self.room.steps;
                    next.copy_from_slice(work);
                    before = Some((lambda, length));
                    break;
                }
                if lambda <= LEAST_DAMPING || length <= 1e5 * rounding {
                    return Ok(());
                }
                lambda = if suited < 0.5 * lambda { suited.max(0.1 * lambda) } else { 0.5 * lambda };
            }
        }
        Ok(())
    }

    /// Levenberg–Marquardt on ‖Φ/s‖, s that of the last linearisation: to a solution or to the closest
    /// approach. With scales that change on the way it would descend on no function, and could end where none
    /// has a stationary point.
    fn descend(&mut self, state: &mut M::State, most: usize) -> Result<(), StateError> {
        let longest = LONGEST_STEP * self.scale(state);
        let mut mu = 1e-2;
        for _ in 0..most {
            self.relinearise(state);
            let length = self.load(state)?;
            let largest = self.room.svd().largest();
            if length == 0.0 || largest == 0.0 {
                return Ok(());
            }
            loop {
                self.load(state)?;
                self.room.solve(0, 0.0, mu * largest);
                let trial = self.trial(state, 1.0, 0);
                if self.room.length(0) <= f64::EPSILON * self.scale(state) {
                    return Ok(());
                }
                if self.room.length(0) <= longest && self.load(&trial).is_ok_and(|next| next < length) {
                    *state = trial;
                    mu = (0.2 * mu).max(1e-14);
                    break;
                }
                mu *= 4.0;
            }
        }
        Ok(())
    }

    /// Says what keeps the constraints from closing at the closest approach.
    fn diagnose(
        &mut self,
        guess: &M::State,
        state: &M::State,
        missed: &Violation,
    ) -> Result<StateError, StateError> {
        // In the scales in which this is the closest approach.
        self.linearise(guess)?;
        self.relinearise(state);
        let length = self.load(state)?;
        let (row, residual, distance) = (M::ROWS[missed.row].name, missed.residual, missed.distance);
        if let Some(coordinates) = self.branches(state, length)? {
            return Ok(StateError::SingularGuess { row, residual, coordinates });
        }
        self.relinearise(state);
        self.load(state)?;
        let given = self.culprits(state);
        Ok(StateError::NotAssembled { row, residual, distance, given })
    }

    /// The closest approach from other places, as that from the guess may be one of several: where one closes
    /// the guess is at fault, else the least miss is told.
    #[cold]
    fn look_elsewhere(
        &mut self,
        guess: &M::State,
        state: &mut M::State,
        error: StateError,
    ) -> Result<StateError, StateError> {
        let StateError::NotAssembled { row, residual, .. } = error else { return Ok(error) };
        self.linearise(guess)?;
        let (first, mut best) = (self.load(state)?, *state);
        let mut least = first;
        for place in 0..PLACES {
            // The scales are those of the guess, so that misses can be compared.
            let mut there = self.place(guess, place);
            let ends = self.load(&there).is_ok() && self.descend(&mut there, DESCENTS_ELSEWHERE).is_ok();
            match self.load(&there) {
                Ok(length) if ends && length < (1.0 - CLOSER) * least => (least, best) = (length, there),
                _ => {}
            }
        }
        if least == first {
            return Ok(error);
        }
        let mut closed = best;
        if self.newton(&mut closed).is_ok() && self.missed(&closed).is_ok_and(|missed| missed.is_none()) {
            let change = |j: &usize| (closed.q().as_slice()[*j] - guess.q().as_slice()[*j]).abs();
            let most = room::free(self.given).max_by(|i, j| change(i).total_cmp(&change(j)));
            if let Some(j) = most {
                let (coordinate, value) = (M::COORDINATES[j].name, closed.q().as_slice()[j]);
                return Ok(StateError::NotReached { row, residual, coordinate, value });
            }
        }
        let Some(missed) = self.missed(&best)? else { return Ok(error) };
        self.linearise(guess)?;
        self.relinearise(&best);
        self.load(&best)?;
        let given = self.culprits(&best);
        *state = best;
        let (row, residual, distance) = (M::ROWS[missed.row].name, missed.residual, missed.distance);
        Ok(StateError::NotAssembled { row, residual, distance, given })
    }

    /// The guess with free angles turned by up to half a turn, and other free coordinates moved by their
    /// size.
    fn place(&self, guess: &M::State, place: usize) -> M::State {
        let mut there = *guess;
        for j in room::free(self.given) {
            let q = guess.q().as_slice()[j];
            let unit = M::COORDINATES[j].unit;
            let by =
                if unit == "rad" { core::f64::consts::PI } else { q.abs().max(own_size(self.model, unit)) };
            // A scatter between −1 and 1, another for each coordinate and place.
            let (part, _) = math::sin_cos(1.3 + 2.399_963 * (1 + place + PLACES * j) as f64);
            there.q_mut()[j] = q + by * part;
        }
        there
    }

    /// Whether a little off this place along a direction that the constraints leave open there is a way to
    /// come closer: a saddle, on both sides of which branches lie. Returns the coordinates of that direction.
    fn branches(&mut self, state: &M::State, length: f64) -> Result<Option<Involved>, StateError> {
        let (_, free) = self.room.shape;
        let scale = 0.05 * self.scale(state);
        for column in 0..free {
            for sign in [1.0, -1.0] {
                self.relinearise(state);
                let svd = self.room.svd();
                let open = svd.sigma[column] <= BRANCH * svd.largest();
                if !open {
                    break;
                }
                self.room.keep_right(column);
                let direction = &self.room.spare[0][..free];
                let shares = room::free(self.given).zip(direction.iter().copied());
                let coordinates = Involved::ranked(M::COORDINATES, shares);
                let mut beside = moved(state, self.given, self.room.weights, sign * scale, direction);
                self.descend(&mut beside, 30)?;
                if self.load(&beside).is_ok_and(|closer| closer < 0.5 * length) {
                    return Ok(Some(coordinates));
                }
            }
        }
        Ok(None)
    }

    /// The given coordinates that would have to move: −∂‖Φ/s‖²/∂q of what is left; all that enter the
    /// constraints where that says nothing (at the farthest place from closing).
    fn culprits(&self, state: &M::State) -> Involved {
        let n = self.room.weights.len();
        let entry = |k: usize, row: usize, j: usize| {
            self.room.jacobian[row * n + j] / (self.room.scales[k] * self.room.weights[j])
        };
        let rows = || active_rows::<M>(state.modes(), true).enumerate();
        // Against noise in what the free coordinates have settled.
        let noise = 1e-6 * norm(&self.room.right[..self.room.shape.0]);
        let pull = |j: usize| {
            let pull: f64 = rows().map(|(k, row)| self.room.right[k] * entry(k, row, j)).sum();
            if pull.abs() > noise { pull } else { 0.0 }
        };
        let enters = |j: usize| rows().map(|(k, row)| entry(k, row, j).abs()).fold(0.0, f64::max);
        let given = || (0..n).filter(|j| self.given[*j]);
        let pulled = Involved::ranked(M::COORDINATES, given().map(|j| (j, pull(j))));
        if pulled.is_empty() {
            Involved::ranked(M::COORDINATES, given().map(|j| (j, enters(j))))
        } else {
            pulled
        }
    }
}

/// ‖steps\[a\] − factor·steps\[b\]‖.
fn difference(room: &Room<'_>, a: usize, b: usize, factor: f64) -> f64 {
    let (_, f) = room.shape;
    let pairs = room.steps[a][..f].iter().zip(&room.steps[b][..f]);
    math::sqrt(pairs.map(|(a, b)| math::powi(a - factor * b, 2)).sum())
}
