//! The plan of a run: the problem, its end and its options; and how a run ends without an error.

use core::sync::atomic::AtomicBool;

use crate::integrate::StepOptions;
use crate::model::SimulationModel;
use crate::progress::Progress;
use crate::simulate::events::location::EventLocator;
use crate::simulate::right_hand_side::RightHandSide;

/// What a run needs. The loop in `run.rs` changes the right-hand side and the locator, and reads the others.
pub(crate) struct RunPlan<'r, 'm, M: SimulationModel> {
    pub(crate) rhs: RightHandSide<'r, 'm, M>,
    pub(crate) start: M::State,
    pub(crate) end: f64,
    pub(crate) options: StepOptions,
    pub(crate) max_steps: u64,
    pub(crate) cancel: Option<&'m AtomicBool>,
    pub(crate) cancel_when: Option<&'r (dyn Fn() -> bool + 'm)>,
    pub(crate) locator: EventLocator<'m, M>,
    pub(crate) progress: Progress,
    /// Whether another method continues where the motion is stiff for this one.
    pub(crate) may_change_method: bool,
    /// The state from which this method continues a run, and the number of steps before it.
    pub(crate) resume_from: Option<(M::State, u64)>,
}

impl<'r, 'm, M: SimulationModel> RunPlan<'r, 'm, M> {
    /// Resets the plan to the start, for another run with other options and without progress bar.
    pub(crate) fn restart(
        &mut self,
        rhs: RightHandSide<'r, 'm, M>,
        options: StepOptions,
        may_change_method: bool,
    ) {
        (self.rhs, self.options, self.may_change_method) = (rhs, options, may_change_method);
        self.resume_from = None;
        self.locator.restart();
        self.progress = Progress::none();
    }
}

/// How a run ended without an error.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum RunEnd<S> {
    /// At its end time, or where an event or the observer stopped it.
    Finished,
    /// At this state, because the motion is stiff for the method.
    Stiff(S),
}
