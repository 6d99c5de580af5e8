//! Stiffness detection by implicit trial steps, and the change to an implicit method.
//!
//! Hairer's test in the stepper finds steps at the border of stability. Methods of high order do not reach
//! this border at small tolerances: their error estimates grow as a high power of hλ and hold the steps at a
//! constant fraction of it. So every few hundred steps an implicit step is tried that is many times as long.
//! If its error is permitted, the motion does not need the short steps: that is the meaning of stiff (Hairer
//! & Wanner, Solving ODE II, IV.1, "explicit methods don't work").
//!
//! `StiffnessDetection::is_stiff` decides, by `Stepper::test_stiffness` (`integrate/stepper/stiffness.rs`)
//! and by these trials. It does so only where the user has set neither a method nor a fixed step. Then
//! `run_method` in `simulation/execution.rs` continues with Radau IIA. The summary's check of a finished
//! motion is `verification/stiffness.rs`.

use alloc::boxed::Box;
use alloc::vec::Vec;

use crate::integrate::choice::Radau5;
use crate::integrate::{Method, Step, StepFlags, Tolerances};
use crate::math;
use crate::model::{Branches, ModelState as _, SimulationModel, Vector};
use crate::simulate::erased_method::stepping::StepStatistics;
use crate::simulate::erased_method::{ErasedMethod, StepReplay};
use crate::simulate::failure::SimulationErrorKind as Kind;
use crate::simulate::right_hand_side::RightHandSide;
use crate::simulate::run::monitor::{Advice, Monitor, Retreat, Watched};
use crate::simulate::stabilization::Stabilization;

/// Steps between two trials: at least the first number, and the second times the square of the number of
/// coordinates. A trial costs as much as some dozens of steps, with many coordinates as much as the second
/// term (1,500 steps for a chain of 45 masses).
const TRIAL_INTERVAL: (u64, u64) = (500, 4);
/// Factor by which steps of Radau IIA have to be longer to take less time: the first number, plus the second
/// times the square of the number of coordinates for the factorization. Measured on a stiff spring pendulum
/// (k = 1e8 N/m, c = 2e4 N s/m): at 1e-7 and 1e-9 its steps are 65 and 42 times those of Verner 9(8), and
/// cost as much as two of these.
const WORTHWHILE_LENGTH: (f64, f64) = (20.0, 0.02);
/// Tolerance below which steps at the border of stability do not suffice to change the method: Radau IIA may
/// need so many steps that the explicit method is no slower. Implicit trial steps decide.
const TIGHT_TOLERANCE: f64 = 1e-11;
/// Tolerance below which the method is not changed: Newton's iterations of an implicit method leave a larger
/// error. Stiffness is still reported where steps run out.
pub(crate) const FINEST_TOLERANCE: f64 = 1e-13;
/// Further factors of the length of implicit trial steps at tight tolerances, tried in turn: rounding may
/// hold the explicit steps far inside the border of stability.
const LENGTHS_IN_TURN: [f64; 3] = [1.0, 5.0, 25.0];
/// Trials in a row that have to pass: a single one may pass by the chance position of its stages.
const PASSES_IN_A_ROW: u32 = 2;
/// Factors of the lengths of two trials from one state, for the same reason.
pub(crate) const LENGTHS_FROM_ONE_PLACE: [f64; 2] = [1.0, 1.3];

/// The factor of [`WORTHWHILE_LENGTH`] for a number of coordinates.
pub(crate) fn worthwhile_factor(coordinates: usize) -> f64 {
    WORTHWHILE_LENGTH.0 + WORTHWHILE_LENGTH.1 * math::powi(coordinates as f64, 2)
}

/// Steps between two trials.
fn trial_interval<M: SimulationModel>() -> u64 {
    TRIAL_INTERVAL.0.max(TRIAL_INTERVAL.1 * (M::Vector::LEN as u64).pow(2))
}

/// Decides whether an implicit method continues, and whether stability has used up the steps.
pub(crate) struct StiffnessDetection<M> {
    /// Number of accepted steps, and time of the motion, at the last trial.
    accepted_at_trial: u64,
    trial_time: f64,
    /// Trials that passed, in a row.
    passes_in_a_row: u32,
    /// Index in [`LENGTHS_IN_TURN`] of the next trial.
    next_length: usize,
    /// Whether the method is explicit.
    is_explicit: bool,
    /// What makes the trials and the workspace that constraints take in them: made for the first one,
    /// so that a run allocates no more the longer it is.
    trials: Option<(Box<dyn StepReplay<M>>, Vec<f64>)>,
}

impl<M: SimulationModel> Monitor<M> for StiffnessDetection<M> {
    fn begin(run: &mut Watched<'_, '_, '_, M>, method: Method) -> Self {
        let (t, is_explicit) = (run.stepper.now().t, !method.is_for_stiff());
        Self {
            accepted_at_trial: 0,
            trial_time: t,
            passes_in_a_row: 0,
            next_length: 0,
            is_explicit,
            trials: None,
        }
    }

    #[inline(always)]
    fn after_step(
        &mut self,
        run: &mut Watched<'_, '_, '_, M>,
        ends: bool,
    ) -> Result<Advice, Retreat<M::Vector>> {
        Ok(if !ends && self.is_stiff(run) { Advice::ChangeMethod } else { Advice::Continue })
    }

    /// If the steps have run out, checks whether stability alone kept them short.
    fn explain(&mut self, run: &mut Watched<'_, '_, '_, M>, kind: &mut Kind) {
        if let Kind::TooManySteps { stiff_at: stiff_at @ None, .. } = kind
            && self.is_held_by_stability(run)
        {
            *stiff_at = Some(run.stepper.now().t);
        }
    }
}

impl<M: SimulationModel> StiffnessDetection<M> {
    /// Whether the motion is stiff for its method, so that an implicit one continues.
    #[inline]
    fn is_stiff(&mut self, run: &mut Watched<'_, '_, '_, M>) -> bool {
        let statistics = run.stepper.statistics();
        let Tolerances { absolute, relative } = run.plan.options.tolerances;
        let tolerance = absolute.max(relative);
        if !run.plan.may_change_method || tolerance < FINEST_TOLERANCE {
            // For `explain`, recent steps count: a motion may be stiff at its end alone.
            if self.is_due(&statistics) {
                (self.accepted_at_trial, self.trial_time) = (statistics.accepted, statistics.t);
            }
            return false;
        }
        statistics.stiff_at.is_some() && tolerance >= TIGHT_TOLERANCE
            || self.is_due(&statistics)
                && self.implicit_steps_pass(run, &statistics, tolerance < TIGHT_TOLERANCE)
    }

    fn is_due(&self, statistics: &StepStatistics) -> bool {
        statistics.accepted >= self.accepted_at_trial + trial_interval::<M>()
    }

    /// Whether a run that has used up its steps is held by stability: whether implicit steps of a worthwhile
    /// length would pass.
    #[cold]
    fn is_held_by_stability(&mut self, run: &mut Watched<'_, '_, '_, M>) -> bool {
        if !self.is_explicit || run.plan.options.fixed.is_some() {
            return false;
        }
        let statistics = run.stepper.statistics();
        let mean_step = self.mean_step_since_trial(&statistics);
        // The option `max_step` bounds the steps, not stability.
        if mean_step > 0.5 * run.plan.options.most {
            return false;
        }
        let (trial_step, time_left) =
            (worthwhile_factor(M::Vector::LEN) * mean_step, run.plan.end - statistics.t);
        LENGTHS_IN_TURN.iter().any(|factor| {
            LENGTHS_FROM_ONE_PLACE.iter().all(|part| {
                let h = factor * part * trial_step;
                h <= time_left.abs() && self.trial_passes(run, h.copysign(time_left))
            })
        })
    }

    /// Mean length of the steps since the last trial, or the proposed length if that is larger.
    fn mean_step_since_trial(&self, statistics: &StepStatistics) -> f64 {
        let steps = (statistics.accepted - self.accepted_at_trial).max(1);
        let mean = (statistics.t - self.trial_time).abs() / steps as f64;
        mean.max(statistics.proposed)
    }

    /// Makes a trial of a worthwhile length, of several lengths in turn if `is_tight`. Returns whether enough
    /// trials in a row have passed.
    #[cold]
    fn implicit_steps_pass(
        &mut self,
        run: &mut Watched<'_, '_, '_, M>,
        statistics: &StepStatistics,
        is_tight: bool,
    ) -> bool {
        let time_left = run.plan.end - statistics.t;
        let mean_step = self.mean_step_since_trial(statistics);
        (self.accepted_at_trial, self.trial_time) = (statistics.accepted, statistics.t);
        // The option `max_step` bounds the steps, or the motion ends soon.
        if mean_step > 0.5 * run.plan.options.most || time_left.abs() < TRIAL_INTERVAL.0 as f64 * mean_step {
            return false;
        }
        let h = worthwhile_factor(M::Vector::LEN) * mean_step;
        let h = if is_tight { LENGTHS_IN_TURN[self.next_length % LENGTHS_IN_TURN.len()] * h } else { h };
        let passes = h <= time_left.abs() && self.trial_passes(run, h.copysign(time_left));
        // A length that has passed is tried again.
        self.next_length += usize::from(!passes);
        self.passes_in_a_row = if passes { self.passes_in_a_row + 1 } else { 0 };
        self.passes_in_a_row >= PASSES_IN_A_ROW
    }

    /// Whether an implicit step of this length from the current state has a permitted error. Of the run only
    /// the count of evaluations changes.
    fn trial_passes(&mut self, run: &mut Watched<'_, '_, '_, M>, h: f64) -> bool {
        let now = *run.stepper.now();
        let RightHandSide { model, constants, law, held_inputs, active_set, ref stabilization, .. } =
            run.plan.rhs;
        let interval = (run.plan.start.t(), run.plan.end);
        let trials = self.trials.take();
        let (mut step_replay, workspace) =
            trials.unwrap_or_else(|| (ErasedMethod::<M>::step_replay(&Radau5), Vec::new()));
        let mut stabilization = Stabilization::with_workspace(
            stabilization.formulation,
            f64::INFINITY,
            *constants,
            interval,
            workspace,
        );
        stabilization.is_under_way = true;
        let free = Branches::FREE;
        let mut rhs = RightHandSide {
            model,
            constants,
            law,
            held_inputs,
            active_set,
            evaluations: 0,
            held_branches: free,
            acceleration_branches: free,
            series_memory: None,
            listener: None,
            stabilization,
        };
        let step = Step { start: now, end: now, h, flags: StepFlags::default() };
        // Trials lie far apart: each begins as if it were the first.
        step_replay.forget();
        let end = step_replay.end_of(&mut rhs, &step, &run.plan.options.tolerances);
        let (evaluations, workspace) = (rhs.evaluations, rhs.stabilization.into_workspace());
        run.plan.rhs.evaluations += evaluations;
        self.trials = Some((step_replay, workspace));
        end.is_some_and(|(_, error)| error <= 1.0)
    }
}
