//! Stiffness that the steps themselves do not show.
//!
//! Hairer's test finds steps at the border of stability. Methods of high order do not get there at small
//! tolerances: their error estimates, which grow as a high power of h λ, hold the steps at a fraction of it,
//! the same for ever. So every so often an implicit step is tried that is many times as long. Where its error
//! is permitted, nothing in the motion needs the short ones: that is what stiff means (Hairer & Wanner,
//! Solving ODE II, IV.1, "explicit methods don't work").

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

/// Steps between two trials: one costs as much as some dozens of them, and of many coordinates as much as so
/// many for the square of their number (1,500 of a chain of 45 masses).
const TRIAL_INTERVAL: (u64, u64) = (500, 4);
/// Steps of Radau IIA that are so many times as long take less time, with matrices of few rows; what factors
/// add to that for each square of their number. Measured on a stiff spring pendulum (k = 1e8 N/m, c = 2e4 N
/// s/m): at 1e-7 and 1e-9 its steps are 65 and 42 times those of Verner 9(8), and cost as much as two of
/// these.
const WORTHWHILE_LENGTH: (f64, f64) = (20.0, 0.02);
/// Below this tolerance Radau IIA needs so many steps that an explicit method at the border of its stability
/// may be no slower: that border alone says too little, and implicit steps have to show what is won.
const TIGHT_TOLERANCE: f64 = 1e-11;
/// Below this one Newton's iterations of an implicit method leave more than is permitted: what is stiff is
/// told where steps run out, and runs go on as they are.
const FINEST_TOLERANCE: f64 = 1e-13;
/// At tight tolerances implicit steps that are longer by these factors are tried in turn: rounding may hold
/// the explicit ones far inside the border.
const LENGTHS_IN_TURN: [f64; 3] = [1.0, 5.0, 25.0];
/// Trials in a row that have to succeed, so that none is deceived by where its stages fall.
const PASSES_IN_A_ROW: u32 = 2;
/// Lengths of two trials from one place, for the same reason: stages of the longer one fall elsewhere.
const LENGTHS_FROM_ONE_PLACE: [f64; 2] = [1.0, 1.3];

/// By how much implicit steps of a model with so many coordinates have to be longer to be worth their while.
pub(crate) fn longer(coordinates: usize) -> f64 {
    WORTHWHILE_LENGTH.0 + WORTHWHILE_LENGTH.1 * math::powi(coordinates as f64, 2)
}

/// Steps between two trials.
fn trial_interval<M: SimulationModel>() -> u64 {
    TRIAL_INTERVAL.0.max(TRIAL_INTERVAL.1 * (M::Vector::LEN as u64).pow(2))
}

/// Looks whether an implicit method is to go on, and whether stability used up the steps.
pub(crate) struct StiffnessDetection<M> {
    /// Steps accepted, and the time, when an implicit step was tried last.
    accepted: u64,
    t: f64,
    /// How often in a row with success.
    passed: u32,
    /// Which of [`LENGTHS_IN_TURN`] is tried next.
    more: usize,
    /// The method is explicit.
    explicit: bool,
    /// What makes the trials and the memory that constraints take in them: made for the first one,
    /// so that a run allocates no more the longer it is.
    trials: Option<(Box<dyn StepReplay<M>>, Vec<f64>)>,
}

impl<M: SimulationModel> Monitor<M> for StiffnessDetection<M> {
    fn begin(run: &mut Watched<'_, '_, '_, M>, method: Method) -> Self {
        let (t, explicit) = (run.stepper.now().t, !method.is_for_stiff());
        Self { accepted: 0, t, passed: 0, more: 0, explicit, trials: None }
    }

    #[inline(always)]
    fn after_step(
        &mut self,
        run: &mut Watched<'_, '_, '_, M>,
        ends: bool,
    ) -> Result<Advice, Retreat<M::Vector>> {
        Ok(if !ends && self.is_stiff(run) { Advice::ChangeMethod } else { Advice::Continue })
    }

    /// Steps that are used up may be as short as they are because of stability alone.
    fn explain(&mut self, run: &mut Watched<'_, '_, '_, M>, kind: &mut Kind) {
        if let Kind::TooManySteps { stiff_at: stiff_at @ None, .. } = kind
            && self.is_held_by_stability(run)
        {
            *stiff_at = Some(run.stepper.now().t);
        }
    }
}

impl<M: SimulationModel> StiffnessDetection<M> {
    /// Whether the motion is stiff for its method, and an implicit one is to go on.
    #[inline]
    fn is_stiff(&mut self, run: &mut Watched<'_, '_, '_, M>) -> bool {
        let statistics = run.stepper.statistics();
        let Tolerances { absolute, relative } = run.plan.options.tolerances;
        let tolerance = absolute.max(relative);
        if !run.plan.hands_over || tolerance < FINEST_TOLERANCE {
            // Steps count that were made of late: a motion may be stiff at its end alone.
            if self.is_due(&statistics) {
                (self.accepted, self.t) = (statistics.accepted, statistics.t);
            }
            return false;
        }
        statistics.stiff_at.is_some() && tolerance >= TIGHT_TOLERANCE
            || self.is_due(&statistics) && self.steps_over(run, &statistics, tolerance < TIGHT_TOLERANCE)
    }

    fn is_due(&self, statistics: &StepStatistics) -> bool {
        statistics.accepted >= self.accepted + trial_interval::<M>()
    }

    /// Of a run that ends because its steps are too many: whether implicit steps that are worth their while
    /// would pass over what keeps these short.
    #[cold]
    fn is_held_by_stability(&mut self, run: &mut Watched<'_, '_, '_, M>) -> bool {
        if !self.explicit || run.plan.options.fixed.is_some() {
            return false;
        }
        let statistics = run.stepper.statistics();
        let usual = self.usual(&statistics);
        // What is asked for bounds these, not stability.
        if usual > 0.5 * run.plan.options.most {
            return false;
        }
        let (usual, left) = (longer(M::Vector::LEN) * usual, run.plan.end - statistics.t);
        LENGTHS_IN_TURN.iter().any(|more| {
            LENGTHS_FROM_ONE_PLACE.iter().all(|part| {
                let h = more * part * usual;
                h <= left.abs() && self.would_pass(run, h.copysign(left))
            })
        })
    }

    /// The length that steps have had since they were last counted, or have now.
    fn usual(&self, statistics: &StepStatistics) -> f64 {
        let steps = (statistics.accepted - self.accepted).max(1);
        let mean = (statistics.t - self.t).abs() / steps as f64;
        mean.max(statistics.proposed)
    }

    /// Whether implicit steps that are worth their while pass over what keeps these short; of several lengths
    /// in turn, where `tight`.
    #[cold]
    fn steps_over(
        &mut self,
        run: &mut Watched<'_, '_, '_, M>,
        statistics: &StepStatistics,
        tight: bool,
    ) -> bool {
        let left = run.plan.end - statistics.t;
        let usual = self.usual(statistics);
        (self.accepted, self.t) = (statistics.accepted, statistics.t);
        // What is asked for bounds these, or little is left to be gained.
        if usual > 0.5 * run.plan.options.most || left.abs() < TRIAL_INTERVAL.0 as f64 * usual {
            return false;
        }
        let h = longer(M::Vector::LEN) * usual;
        let h = if tight { LENGTHS_IN_TURN[self.more % LENGTHS_IN_TURN.len()] * h } else { h };
        let passes = h <= left.abs() && self.would_pass(run, h.copysign(left));
        // What has passed is tried again.
        self.more += usize::from(!passes);
        self.passed = if passes { self.passed + 1 } else { 0 };
        self.passed >= PASSES_IN_A_ROW
    }

    /// Whether an implicit step of this length from here has an error that is permitted. Nothing of the run
    /// is touched by it but the count of evaluations.
    fn would_pass(&mut self, run: &mut Watched<'_, '_, '_, M>, h: f64) -> bool {
        let now = *run.stepper.now();
        let RightHandSide { model, constants, law, held, modes, ref stabilization, .. } = run.plan.rhs;
        let interval = (run.plan.start.t(), run.plan.end);
        let trials = self.trials.take();
        let (mut step_replay, memory) =
            trials.unwrap_or_else(|| (ErasedMethod::<M>::step_replay(&Radau5), Vec::new()));
        let mut stabilization =
            Stabilization::within(stabilization.formulation, f64::INFINITY, *constants, interval, memory);
        stabilization.under_way = true;
        let free = Branches::FREE;
        let mut rhs = RightHandSide {
            model,
            constants,
            law,
            held,
            modes,
            evaluations: 0,
            branches: free,
            known: free,
            memory: None,
            listener: None,
            stabilization,
        };
        let step = Step { start: now, end: now, h, kept: StepFlags::default() };
        // Trials lie far apart: each begins as if it were the first.
        step_replay.forget();
        let end = step_replay.end_of(&mut rhs, &step, &run.plan.options.tolerances);
        let (evaluations, memory) = (rhs.evaluations, rhs.stabilization.into_memory());
        run.plan.rhs.evaluations += evaluations;
        self.trials = Some((step_replay, memory));
        end.is_some_and(|(_, error)| error <= 1.0)
    }
}
