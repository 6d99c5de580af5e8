//! The reference for errors, and its uncertainty.

use alloc::format;
use alloc::string::{String, ToString};

use dynamics_runtime::methods::{Any, Dop853, DormandPrince5, Verner9};
use dynamics_runtime::model::{ModelState, Vector};
use dynamics_runtime::simulate::Simulate;

use super::WorkPrecision;
use super::error::WorkPrecisionError;
use super::errors::{End, Errors};
use crate::runs::{check_end, first_line};

/// Where the runs of the reference take their tolerance from, unless it is given: near rounding, but not so
/// near that a method rejects its steps for rounding's sake.
const TIGHT: f64 = 1e-14;
/// Where it takes it from by and by where runs at that fail: where constraints nearly lose rank, rounding
/// counts for more than such tolerances permit.
const LOOSER: [f64; 4] = [1e-13, 1e-12, 1e-11, 1e-10];
/// Most steps of a run of the reference: minutes for a small model, and it keeps none of them.
const MOST_STEPS: u64 = 50_000_000;
/// The same with constraints, while there are other references to be tried.
const CONSTRAINED: u64 = 1_000_000;
/// The part of a quantity that its uncertainty may be at most: three digits.
const THREE_DIGITS: f64 = 1e-3;

/// What errors are measured against.
pub struct Reference<M: Simulate>(ReferenceKind<M>);

enum ReferenceKind<M: Simulate> {
    Chosen,
    Runs { methods: [Any<M>; 2], tolerance: f64 },
    Known { end: M::State, uncertainty: f64 },
}

impl<M: Simulate> Default for Reference<M> {
    /// DOP853 and Dormand–Prince 5(4) at tolerance 1e-14; where a run of theirs fails, as beside change
    /// points, where rounding counts, Verner 9(8) and DOP853 at the tightest of 1e-13, 1e-12, 1e-11 and 1e-10
    /// at which they do not. No step of a reference is longer than a five-hundredth of the motion, unless
    /// options say another `.max_step(..)`.
    fn default() -> Self {
        Self(ReferenceKind::Chosen)
    }
}

impl<M: Simulate> Reference<M> {
    /// The end by the first method at this tolerance; uncertain by twice the largest difference between it,
    /// the second method's, and that of the first at ten times the tolerance. The methods should have nothing
    /// in common but the model.
    #[must_use]
    pub fn runs(first: impl Into<Any<M>>, second: impl Into<Any<M>>, tolerance: f64) -> Self {
        Self(ReferenceKind::Runs { methods: [first.into(), second.into()], tolerance })
    }

    /// A known state at the end, with the uncertainty of its positions and velocities. The uncertainty of
    /// multipliers and energy is found by moving each of them by this amount. If runs of the study are nearer
    /// to each other than to this state, it is compared with the default reference.
    #[must_use]
    pub fn known(end: M::State, uncertainty: f64) -> Self {
        Self(ReferenceKind::Known { end, uncertainty })
    }

    /// Runs what has to be run.
    pub(super) fn find(
        self,
        study: &WorkPrecision<'_, M>,
        end: f64,
    ) -> Result<ReferenceSolution, WorkPrecisionError> {
        match self.0 {
            ReferenceKind::Chosen => chosen(study, end),
            ReferenceKind::Runs { methods, tolerance } => {
                by_runs(study, end, &methods, tolerance, MOST_STEPS)
            }
            ReferenceKind::Known { end: state, uncertainty } => {
                if !(uncertainty >= 0.0 && uncertainty.is_finite()) {
                    return Err(WorkPrecisionError::Uncertainty { value: uncertainty });
                }
                known(study, end, state, uncertainty)
            }
        }
    }
}

/// The reference of a study.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct ReferenceSolution {
    pub(super) end: End,
    /// In each of its parts.
    pub(super) uncertainty: Errors,
    /// How it was found, in words.
    pub(super) how: String,
    /// It was given, and nobody has seen how it was found.
    pub(super) given: bool,
}

impl ReferenceSolution {
    /// Rejects a reference of fewer than three digits. No uncertainty is below what is rounded in so many
    /// steps: half a last place in each, all to one side, as equal steps of an even motion do.
    fn checked(mut self, start: &End, span: f64, steps: u64) -> Result<Self, WorkPrecisionError> {
        let scale = self.end.size().zip(start.size(), f64::max);
        // What starts and ends at rest moved nevertheless.
        let scale = Errors { velocities: scale.velocities.max(scale.positions / span), ..scale };
        let rounding = f64::EPSILON * (0.5 * steps as f64).max(1.0);
        self.uncertainty = self.uncertainty.zip(scale.map(|x| rounding * x), f64::max);
        let Errors { positions, velocities, .. } = self.uncertainty;
        for (what, uncertainty, scale) in
            [("positions", positions, scale.positions), ("velocities", velocities, scale.velocities)]
        {
            if uncertainty.is_nan() || uncertainty > THREE_DIGITS * scale {
                return Err(WorkPrecisionError::NotConverged { what, uncertainty, scale });
            }
        }
        Ok(self)
    }
}

/// The first of some references whose runs do not fail.
pub(super) fn chosen<M: Simulate>(
    study: &WorkPrecision<'_, M>,
    end: f64,
) -> Result<ReferenceSolution, WorkPrecisionError> {
    // Beside a change point steps may shrink to nothing.
    let most_steps = if M::ROWS.is_empty() { MOST_STEPS } else { CONSTRAINED };
    let found = by_runs(study, end, &[Dop853.into(), DormandPrince5.into()], TIGHT, most_steps);
    let Err(WorkPrecisionError::ReferenceFails { method, tolerance: tight, .. }) = &found else {
        return found;
    };
    for tolerance in LOOSER {
        match by_runs(study, end, &[Verner9.into(), Dop853.into()], tolerance, MOST_STEPS) {
            Err(WorkPrecisionError::ReferenceFails { .. }) => {}
            Err(error) => return Err(error),
            Ok(found) => {
                let how = format!("{}, as {method} fails at {tight:e}", found.how);
                return Ok(ReferenceSolution { how, ..found });
            }
        }
    }
    found
}

fn by_runs<M: Simulate>(
    study: &WorkPrecision<'_, M>,
    end: f64,
    methods: &[Any<M>; 2],
    tolerance: f64,
    most_steps: u64,
) -> Result<ReferenceSolution, WorkPrecisionError> {
    if !(tolerance > 0.0 && tolerance.is_finite()) {
        return Err(WorkPrecisionError::Setting { what: "tolerances", value: tolerance });
    }
    let run = |method: &Any<M>, tolerance: f64| -> Result<(End, u64), WorkPrecisionError> {
        let failed = |reason: String| WorkPrecisionError::ReferenceFails {
            method: method.to_string(),
            tolerance,
            reason,
        };
        let simulation = study.simulation(end, method, Some(most_steps)).tolerance(tolerance);
        let mut steps = 0;
        let state = simulation.run_with(|_| steps += 1).map_err(|error| failed(first_line(&error)))?;
        check_end(&state, end).map_err(&failed)?;
        Ok((End::of(study.model, &state), steps))
    };
    let [first, second] = methods;
    let (best, steps) = run(first, tolerance)?;
    let ends = [best, run(first, 10.0 * tolerance)?.0, run(second, tolerance)?.0];
    let apart = |i: usize, j: usize| ends[i].errors(&ends[j]);
    let spread = apart(0, 1).zip(apart(0, 2), larger).zip(apart(1, 2), larger);
    let how = format!("{first} and {second} at tolerance {tolerance:e}");
    let [best, ..] = ends;
    ReferenceSolution { end: best, uncertainty: spread.map(|x| 2.0 * x), how, given: false }.checked(
        &End::of(study.model, &study.start),
        (end - study.start.t()).abs(),
        steps,
    )
}

/// The larger one; NaN wins, so that it is seen.
fn larger(a: f64, b: f64) -> f64 {
    if a > b || a.is_nan() { a } else { b }
}

fn known<M: Simulate>(
    study: &WorkPrecision<'_, M>,
    end: f64,
    state: M::State,
    uncertainty: f64,
) -> Result<ReferenceSolution, WorkPrecisionError> {
    if check_end(&state, end).is_err() {
        return Err(WorkPrecisionError::ReferenceState { time: state.t(), end });
    }
    let known = End::of(study.model, &state);
    let none = known.errors(&known);
    let mut sum = none;
    for i in 0..2 * M::Vector::LEN {
        let mut moved = state;
        match i.checked_sub(M::Vector::LEN) {
            None => moved.q_mut()[i] += uncertainty,
            Some(i) => moved.u_mut()[i] += uncertainty,
        }
        sum = sum.zip(End::of(study.model, &moved).errors(&known), |a, b| a + b);
    }
    let uncertainty = Errors { positions: uncertainty, velocities: uncertainty, ..sum };
    ReferenceSolution { end: known, uncertainty, how: "a known end".into(), given: true }.checked(
        &End::of(study.model, &study.start),
        (end - study.start.t()).abs(),
        1,
    )
}
