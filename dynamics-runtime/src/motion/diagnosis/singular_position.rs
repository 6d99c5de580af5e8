//! Singular positions: where constraints lose rank on the way of a motion.
//!
//! Where branches cross, the weak direction y of the constraints and the direction x of the motion fulfil y
//! (y − k x) = c to second order, c = 0 on the manifold. States that have drifted have c ≠ 0: the crossing
//! opens into two hyperbolas, and a motion that follows one of them turns, within
//! |x| of order √c, to the other branch or back, smoothly and without a growing residual. What decides is the drift, so the motion is not
//! determined there. It is told by the step δ = −Φ_q⁺Φ back to the constraints, which is c/(k x): where
//! Newton's method does not contract from the state (½‖Φ_q⁺Φ_qq δ²‖/‖δ‖, Kantorovich's condition), or where δ
//! changes at a rate that is a part of the motion's own velocity, ‖Φ_q⁺Φ_qq δ q̇‖/‖q̇‖. Both are of order
//! c/(k x)². A step over the position that leaves none of its states there goes on on its branch.

use alloc::boxed::Box;

use crate::constrain;
use crate::constrain::Gradients;
use crate::constrain::held::active_rows;
use crate::constrain::nearby::{NEARBY, at_time, beside};
use crate::constrain::weakness::{Weakness, condition as condition_of, weakness, weakness_against};
use crate::error::SolveError;
use crate::linalg::{max_abs, norm};
use crate::math;
use crate::model::{Constraints, Known, ModelState, Vector};
use crate::motion::diagnosis::Way;
use crate::motion::failure::{Met, SimulationErrorKind as Kind};
use crate::motion::verification::conditioning::golden;

/// Part of the velocity, or of the step back to the constraints, that may be decided by drift.
pub(crate) const DECIDED: f64 = 0.02;
/// Displacement by which second derivatives are measured, against the size of the coordinates.
const PROBE: f64 = 1e-4;

/// Up to here the size of a coordinate counts: angles count revolutions.
const TURNS: f64 = 10.0;

/// What is known of a state of which it is asked what drift decides there.
pub(crate) struct Here<M: Constraints> {
    /// Φ.
    pub(crate) residual: M::Residual,
    /// Lengths of the rows' gradients.
    pub(crate) lengths: M::Rows,
    /// √Mᵢᵢ, see [`weigh`](crate::constrain::assemble::weigh).
    pub(crate) weights: M::Vector,
}

/// Conditioning from which on constraints are taken for singular, whatever it was elsewhere.
const SINGULAR: f64 = 1e6;
/// Part by which conditioning has to be worse than at the start for what fails to be put down to it; what a
/// start that is singular itself has counts as no more than [`USUAL`].
const WORSE: f64 = 10.0;
/// See [`WORSE`].
const USUAL: f64 = 1e3;

/// The same against the lengths that gradients had at the start, which change on other ways, too.
const SHORTER: f64 = 100.0;
/// How far ahead it is looked where a step was not made, in its own length.
const AHEAD: f64 = 1.5;

/// Conditioning from which on steps without end are put down to it: where rounding errors count for more than
/// the tolerance they come nearer and nearer.
const CREEPS: f64 = 1e5;

/// Way of a step, in parts of what is left to a singular position, below which that makes it so short:
/// without it steps are of its size.
const SHORT: f64 = 1e-3;

/// A failure that singular constraints may cause (see [`crate::motion::diagnosis`]), told as that: where they are much
/// nearer to losing rank than they were at the start, or so near that nothing could be computed anywhere.
pub(crate) fn explain<M: Constraints>(
    model: &M,
    start: &M::State,
    state: &M::State,
    (kind, h): (Kind, f64),
    way: Way,
) -> Kind {
    let creeps = matches!(kind, Kind::TooManySteps { .. } | Kind::StepsVanish { .. });
    if M::IS_FREE {
        return kind;
    }
    let found = weakest_ahead(state, h, &kind, |state| weakness(model, state));
    let worse =
        found.condition >= SINGULAR || found.condition >= WORSE * condition_of(model, start).min(USUAL);
    // A single row shows it against the length that it had.
    let (worse, found) = if worse {
        (true, found)
    } else {
        let found = weakest_ahead(state, h, &kind, |state| weakness_against(model, start, state));
        (found.condition >= SHORTER, found)
    };
    let Weakness { condition, rows, coordinates } = found;
    // What is left to such a position is 1/κ of the size of the mechanism: steps of a part of that are short
    // because of it.
    if creeps && condition < CREEPS && way_in(state, h) * condition > SHORT {
        return kind;
    }
    match worse {
        true => Kind::SingularPosition {
            rows,
            coordinates,
            condition,
            met: Box::new(Met { kind, over: way.over() }),
        },
        false => kind,
    }
}

/// Where a step was not made for what lies ahead in it, as a fixed one that cannot be shorter: the worst on
/// the straight way on, else here.
fn weakest_ahead<S: ModelState>(
    state: &S,
    h: f64,
    kind: &Kind,
    weakness: impl Fn(&S) -> Weakness,
) -> Weakness {
    let here = weakness(state);
    let lies_ahead = matches!(
        kind,
        Kind::Solve(SolveError::OffConstraint { .. })
            | Kind::StepNotSolved { .. }
            | Kind::StepDisplaced { .. }
    );
    if !lies_ahead || h == 0.0 {
        return here;
    }
    let ahead = |part: f64| {
        let mut ahead = at_time(state, state.t() + part * h);
        (0..S::Vector::LEN).for_each(|i| ahead.q_mut()[i] += part * h * state.u()[i]);
        weakness(&ahead)
    };
    let (part, worst) = golden(0.0, AHEAD, &mut |part| ahead(part).condition);
    if worst > here.condition { ahead(part) } else { here }
}

/// The way of a motion in a time, in parts of its size.
fn way_in<S: ModelState>(state: &S, time: f64) -> f64 {
    time.abs() * max_abs(state.u().as_slice()) / (1.0 + max_abs(state.q().as_slice()).min(TURNS))
}

/// Part of what is left to a singular position that many steps come at least, where they come past it.
const COMES: f64 = 0.05;

/// Whether many steps that took this time do not come past the singular position that is near.
pub(crate) fn crawls<M: Constraints>(model: &M, state: &M::State, took: f64) -> bool {
    let way = way_in(state, took);
    M::IS_HELD && way * CREEPS < COMES && {
        let condition = condition_of(model, state);
        condition >= CREEPS && way * condition < COMES
    }
}

/// Time to either side of a singular start at which accelerations are looked at, in parts of the time in
/// which the motion turns.
const BESIDE: f64 = 1e-3;
/// Relative difference up to which accelerations to both sides of it agree.
const AGREE: f64 = 0.05;

/// How long a motion takes to be so far from a singular start that its velocities are determined to within a
/// tolerance: at a distance x of it the constraints know them to ε/x².
pub(crate) fn least_distance<S: ModelState>(start: &S, tolerance: f64) -> f64 {
    let speed = max_abs(start.u().as_slice());
    if speed > 0.0 { 3.0 * math::sqrt(f64::EPSILON / tolerance) / speed } else { 0.0 }
}

/// The accelerations at a start where the general solver found constraints that depend on each other; `None`
/// where the position is not a singular one.
///
/// At a singular position Φ_q q̈ = γ says nothing of the direction in which branches part. Where velocities
/// follow a branch it is the limit of what holds beside the position: the mean of both sides, extrapolated.
///
/// # Errors
/// [`Kind::SingularStart`] where both sides do not agree.
pub(crate) fn start_accelerations<M: Constraints>(
    model: &M,
    constants: &M::Constants,
    start: &M::State,
    found: &M::Vector,
    workspace: &mut [f64],
) -> Result<Option<M::Vector>, Kind> {
    let Weakness { condition, rows, coordinates } = weakness(model, start);
    if condition < SINGULAR {
        return Ok(None);
    }
    let undetermined = Kind::SingularStart { rows, coordinates };
    let size = |x: &M::Vector| max_abs(x.as_slice());
    let (speed, force) = (size(start.u()), size(found));
    if speed == 0.0 {
        // At rest and without forces it stays; where forces begin to move it branches are open.
        return if force == 0.0 { Ok(Some(*found)) } else { Err(undetermined) };
    }
    let tau = BESIDE * (1.0 / speed).min(speed / force);
    let mut beside = |tau: f64| -> Result<M::Vector, SolveError> {
        let mut state = at_time(start, start.t() + tau);
        for i in 0..M::Vector::LEN {
            state.q_mut()[i] += tau * (start.u()[i] + 0.5 * tau * found[i]);
            state.u_mut()[i] += tau * found[i];
        }
        constrain::project_positions(model, constants, &mut state, workspace)?;
        constrain::project_velocities(model, constants, &mut state, workspace)?;
        Ok(constrain::solve(model, constants, &state, workspace)?.accelerations)
    };
    let mut mean = |tau: f64| -> Result<(M::Vector, f64), SolveError> {
        let (before, after) = (beside(-tau)?, beside(tau)?);
        let mean = combined(&before, 0.5, &after, 0.5);
        Ok((mean, size(&combined(&after, 1.0, &before, -1.0))))
    };
    let (Ok((near, apart)), Ok((far, _))) = (mean(tau), mean(2.0 * tau)) else { return Err(undetermined) };
    // Errors of the means grow with τ².
    let limit = combined(&near, 4.0 / 3.0, &far, -1.0 / 3.0);
    let scale = size(&limit).max(force).max(speed * speed);
    let settled = size(&combined(&near, 1.0, &far, -1.0)) <= AGREE * scale && apart <= AGREE * scale;
    if !settled || !size(&limit).is_finite() {
        return Err(undetermined);
    }
    Ok(Some(limit))
}

/// a x + b y.
fn combined<V: Vector>(x: &V, a: f64, y: &V, b: f64) -> V {
    let mut out = V::zeros();
    (0..V::LEN).for_each(|i| out[i] = a * x[i] + b * y[i]);
    out
}

/// What drift decides at a state.
pub(crate) struct Probe<'p, M: Constraints> {
    model: &'p M,
    constants: &'p M::Constants,
    state: &'p M::State,
    here: &'p Here<M>,
    workspace: &'p mut [f64],
}

impl<'p, M: Constraints> Probe<'p, M> {
    pub(crate) fn new(
        model: &'p M,
        constants: &'p M::Constants,
        state: &'p M::State,
        here: &'p Here<M>,
        workspace: &'p mut [f64],
    ) -> Self {
        Self { model, constants, state, here, workspace }
    }

    /// The part of the motion that drift decides: from [`DECIDED`] on it is nearer to a singular position
    /// than its drift permits. `usual`: see [`Self::usual`].
    pub(crate) fn part(&mut self, usual: &M::Rows) -> Result<f64, SolveError> {
        let (state, residual) = (self.state, self.drift(usual));
        let delta = self.back(&residual, -1.0)?;
        let (length, speed) = (self.length(&delta), self.length(state.u()));
        if length == 0.0 {
            return Ok(0.0);
        }
        // Φ_qq δ² by a displacement along δ; Φ_qq δ q̇ by two along the sum and the difference of both at the
        // same length.
        let scale = PROBE * self.size() / length;
        let straight = scaled(&delta, scale);
        let curved = combined(&self.second(&straight), 1.0, &self.here.residual, -2.0);
        let newton = self.back(&curved, 0.5 / (scale * scale))?;
        let contracts = self.length(&newton) / length;
        if contracts > DECIDED || speed == 0.0 {
            return Ok(contracts);
        }
        let pace = scale * length / speed;
        let [plus, minus] =
            [1.0, -1.0].map(|sign| self.second(&combined(&straight, 1.0, state.u(), sign * pace)));
        let mixed = combined(&plus, 1.0, &minus, -1.0);
        let turning = self.back(&mixed, 0.25 / (scale * pace))?;
        Ok(math::max(contracts, self.length(&turning) / speed))
    }

    /// Lengths of the rows' gradients; of those that nearly vanish, by how much they grow beside the state.
    pub(crate) fn usual(&mut self) -> M::Rows {
        let mut usual = self.here.lengths;
        let nearby = beside::<M>(self.state);
        let gradients = Gradients::alone(self.model, &nearby, self.workspace);
        for row in 0..M::Rows::LEN {
            usual[row] = math::max(usual[row], (norm(gradients.row(row)) - usual[row]).abs() / NEARBY);
        }
        usual
    }

    /// Φ, with what rounding leaves open of it: no drift is known to be less. Of rows whose gradient nearly
    /// vanishes, too.
    fn drift(&self, usual: &M::Rows) -> M::Residual {
        let rounding = f64::EPSILON * (1.0 + max_abs(self.state.q().as_slice()).min(TURNS));
        let mut drift = self.here.residual;
        for row in 0..M::Residual::LEN {
            drift[row] += (rounding * usual[row]).copysign(drift[row]);
        }
        drift
    }

    /// factor · Φ_q⁺ of values of the holonomic rows.
    fn back(&mut self, values: &M::Residual, factor: f64) -> Result<M::Vector, SolveError> {
        let mut right = M::Rows::zeros();
        for row in active_rows::<M>(self.state.modes(), true) {
            right[row] = factor * values[row];
        }
        constrain::correct(self.model, self.constants, self.state, &right, self.workspace)
    }

    fn length(&self, x: &M::Vector) -> f64 {
        math::sqrt(
            x.as_slice().iter().zip(self.here.weights.as_slice()).map(|(x, w)| (x * w) * (x * w)).sum(),
        )
    }

    /// ‖w (1 + |q|)‖, see [`TURNS`].
    fn size(&self) -> f64 {
        let terms = self.state.q().as_slice().iter().zip(self.here.weights.as_slice());
        math::sqrt(terms.map(|(q, w)| math::powi(w * (1.0 + q.abs().min(TURNS)), 2)).sum())
    }

    /// Φ(q + x) + Φ(q − x) = 2Φ(q) + Φ_qq x², but for terms of the fourth order; Φ(q) drops out of
    /// differences.
    fn second(&self, x: &M::Vector) -> M::Residual {
        let mut displaced = *self.state;
        let mut at = |sign: f64| {
            (0..M::Vector::LEN).for_each(|i| displaced.q_mut()[i] = self.state.q()[i] + sign * x[i]);
            self.model.residual(&displaced)
        };
        combined(&at(1.0), 1.0, &at(-1.0), 1.0)
    }
}

fn scaled<V: Vector>(x: &V, factor: f64) -> V {
    let mut out = *x;
    out.as_mut_slice().iter_mut().for_each(|x| *x *= factor);
    out
}
