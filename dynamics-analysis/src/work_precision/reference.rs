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

/// Tolerance of the runs of the reference unless it is given: near rounding, but not so near that a method
/// rejects its steps because of rounding.
const REFERENCE_TOLERANCE: f64 = 1e-14;
/// Tolerances that are tried in turn if runs at [`REFERENCE_TOLERANCE`] fail. Where constraints nearly lose
/// rank, rounding causes errors above tighter tolerances.
const FALLBACK_TOLERANCES: [f64; 4] = [1e-13, 1e-12, 1e-11, 1e-10];
/// Largest number of steps of a run of the reference: minutes for a small model. No step is kept in memory.
const MAX_REFERENCE_STEPS: u64 = 50_000_000;
/// Largest number of steps in the first attempt with constraints. Beside a singular position steps may shrink
/// to nothing, and other references are tried then.
const MAX_STEPS_WITH_CONSTRAINTS: u64 = 1_000_000;
/// Largest uncertainty of the reference, relative to the largest position or velocity at start and end: three
/// digits. With fewer, hardly any error of a run is significant.
const MAX_RELATIVE_UNCERTAINTY: f64 = 1e-3;

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

    /// Runs what the reference needs.
    pub(super) fn find(
        self,
        study: &WorkPrecision<'_, M>,
        end: f64,
    ) -> Result<ReferenceSolution, WorkPrecisionError> {
        match self.0 {
            ReferenceKind::Chosen => chosen(study, end),
            ReferenceKind::Runs { methods, tolerance } => {
                by_runs(study, end, &methods, tolerance, MAX_REFERENCE_STEPS)
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
    /// The uncertainty of each part.
    pub(super) uncertainty: Errors,
    /// How it was found, in words.
    pub(super) how: String,
    /// Whether the end was given: then it may belong to another motion.
    pub(super) given: bool,
}

impl ReferenceSolution {
    /// Raises the uncertainty to the rounding of the steps, and rejects a reference of fewer than three
    /// digits. Rounding is half a last place in each step, all to one side, as in equal steps of a uniform
    /// motion.
    fn checked(mut self, start: &End, span: f64, steps: u64) -> Result<Self, WorkPrecisionError> {
        let scale = self.end.size().zip(start.size(), f64::max);
        // A motion that starts and ends at rest had velocities in between.
        let scale = Errors { velocities: scale.velocities.max(scale.positions / span), ..scale };
        let rounding = f64::EPSILON * (0.5 * steps as f64).max(1.0);
        self.uncertainty = self.uncertainty.zip(scale.map(|x| rounding * x), f64::max);
        let Errors { positions, velocities, .. } = self.uncertainty;
        for (what, uncertainty, scale) in
            [("positions", positions, scale.positions), ("velocities", velocities, scale.velocities)]
        {
            if uncertainty.is_nan() || uncertainty > MAX_RELATIVE_UNCERTAINTY * scale {
                return Err(WorkPrecisionError::NotConverged { what, uncertainty, scale });
            }
        }
        Ok(self)
    }
}

/// The default reference: the first of some whose runs do not fail.
pub(super) fn chosen<M: Simulate>(
    study: &WorkPrecision<'_, M>,
    end: f64,
) -> Result<ReferenceSolution, WorkPrecisionError> {
    let most_steps = if M::ROWS.is_empty() { MAX_REFERENCE_STEPS } else { MAX_STEPS_WITH_CONSTRAINTS };
    let found = by_runs(study, end, &[Dop853.into(), DormandPrince5.into()], REFERENCE_TOLERANCE, most_steps);
    let Err(WorkPrecisionError::ReferenceFails { method, tolerance: tight, .. }) = &found else {
        return found;
    };
    for tolerance in FALLBACK_TOLERANCES {
        match by_runs(study, end, &[Verner9.into(), Dop853.into()], tolerance, MAX_REFERENCE_STEPS) {
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

/// The reference by two methods, one of them at two tolerances. Its uncertainty is twice the largest
/// difference between the three ends.
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
        let simulation = study.simulation(end, Some(method), Some(most_steps)).tolerance(tolerance);
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

/// The larger one; NaN if either is NaN, so that it is not lost.
fn larger(a: f64, b: f64) -> f64 {
    if a > b || a.is_nan() { a } else { b }
}

/// A given end as the reference. The uncertainty of multipliers and energy is the sum of their changes as
/// each coordinate and velocity moves by its own.
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
