//! What a run needs to know, and how one ended.

use core::sync::atomic::AtomicBool;

use crate::integrate::StepOptions;
use crate::model::SimulationModel;
use crate::progress::Progress;
use crate::simulate::events::location::EventLocator;
use crate::simulate::right_hand_side::RightHandSide;

/// What a run needs to know.
pub(crate) struct RunPlan<'r, 'm, M: SimulationModel> {
    pub(crate) rhs: RightHandSide<'r, 'm, M>,
    pub(crate) start: M::State,
    pub(crate) end: f64,
    pub(crate) options: StepOptions,
    pub(crate) most_steps: u64,
    pub(crate) cancel: Option<&'m AtomicBool>,
    pub(crate) locator: EventLocator<'m, M>,
    pub(crate) progress: Progress,
    /// Where the motion turns out to be stiff for its method, another one is to go on.
    pub(crate) hands_over: bool,
    /// The state from which this method goes on, and the steps made before.
    pub(crate) resumes: Option<(M::State, u64)>,
}

impl<'r, 'm, M: SimulationModel> RunPlan<'r, 'm, M> {
    /// Puts everything back to the start, for another run with other options that shows no progress.
    pub(crate) fn restart(&mut self, rhs: RightHandSide<'r, 'm, M>, options: StepOptions, hands_over: bool) {
        (self.rhs, self.options, self.hands_over) = (rhs, options, hands_over);
        self.resumes = None;
        self.locator.restart();
        self.progress = Progress::none();
    }
}

/// How a run ended that did not break off.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum RunEnd<S> {
    /// At its end, or where it was stopped.
    Arrived,
    /// Here, because it is stiff for the method.
    Stiff(S),
}
