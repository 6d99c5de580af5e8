//! Rules of a run: which action is called at which crossing.
//!
//! `simulation/check.rs` makes the rules, and [`EventLocator::apply_rules`] applies them.
//!
//! [`EventLocator::apply_rules`]: crate::simulate::events::location::EventLocator::apply_rules

use alloc::boxed::Box;

use crate::integrate::{Crossing, Direction};
use crate::model::SimulationModel;
use crate::simulate::events::action::EventAction;

/// Whether a simulation continues after an event.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Flow {
    /// It continues.
    Continue,
    /// It ends here.
    Stop,
}

impl From<()> for Flow {
    fn from((): ()) -> Self {
        Self::Continue
    }
}

/// What happens at an event.
pub(crate) enum Action<'m, M: SimulationModel> {
    /// The simulation ends.
    Stop,
    /// An action given by the user.
    Reset(Box<Reset<'m, M>>),
    /// The unilateral constraint with this index switches, see `unilateral.rs`.
    UnilateralConstraint(usize),
}

/// An action given by the user.
pub(crate) type Reset<'m, M> = dyn FnMut(&mut EventAction<'_, M>) -> Flow + 'm;

/// An action, with the event and the direction of the crossings at which it is called.
pub(crate) struct Rule<'m, M: SimulationModel> {
    pub(crate) index: usize,
    pub(crate) direction: Direction,
    pub(crate) action: Action<'m, M>,
}

/// Whether a crossing calls for an action.
pub(crate) fn calls_for_action<M: SimulationModel>(rules: &[Rule<'_, M>], crossing: &Crossing) -> bool {
    rules.iter().any(|r| r.index == crossing.index && r.direction.admits(crossing.direction))
}
