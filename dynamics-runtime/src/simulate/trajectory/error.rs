//! A simulation that stopped before its end, with what it had computed.

use alloc::boxed::Box;
use alloc::sync::Arc;
use core::fmt;

use crate::model::{Dynamics, InputValues, Model, ModelState, SimulationModel};
use crate::simulate::failure::SimulationErrorKind;
use crate::simulate::trajectory::motion::Motion;
use crate::simulate::trajectory::record::Trajectory;
use crate::wording::Readable;

/// A simulation that stopped before its end. What was computed up to there is still in hand:
/// [`SimulationError::motion`].
pub struct SimulationError<M: Model> {
    /// What happened.
    pub kind: SimulationErrorKind,
    /// Time of the last good state; the start's where nothing has moved.
    pub time: f64,
    /// Size of the last step that was tried; 0 where none was.
    pub step: f64,
    /// The last good state; the start where nothing has moved.
    pub state: Box<M::State>,
    pub(crate) trajectory: Option<Arc<Trajectory<M>>>,
}

impl<M: Dynamics> fmt::Display for SimulationError<M> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if matches!(self.kind, SimulationErrorKind::Option(_)) {
            return write!(f, "`{}` was not simulated: {}", M::NAME, self.kind);
        }
        write!(f, "`{}` stopped at t = {}: {}", M::NAME, Readable(self.time), self.kind)?;
        if self.step != 0.0 {
            write!(f, " (last step tried {:.3e})", self.step)?;
        }
        write!(f, "\n  state there:")?;
        for (i, coordinate) in M::COORDINATES.iter().enumerate() {
            let (q, u) = (Readable(self.state.q()[i]), Readable(self.state.u()[i]));
            write!(f, "\n    {} = {q}, rate {u}", coordinate.name)?;
        }
        Ok(())
    }
}

crate::error::sentence_for_debugging!(SimulationError<M: Dynamics>);

impl<M: Dynamics> core::error::Error for SimulationError<M> {}

impl<M: SimulationModel> SimulationError<M> {
    /// The motion up to the failure; `None` where nothing was computed because an option was invalid.
    ///
    /// The inputs closure of the simulation no longer exists. So inputs are NaN, and states between steps
    /// come from the quintic Hermite interpolant. [`SimulationError::motion_with_inputs`] takes the closure
    /// again.
    #[must_use]
    pub fn motion<'m>(&self, model: &'m M) -> Option<Motion<'m, M>> {
        let constants = model.constants().ok()?;
        Some(Motion::new(model, constants, None, Arc::clone(self.trajectory.as_ref()?)))
    }

    /// The motion up to the failure, with the inputs closure that it ran with.
    #[must_use]
    pub fn motion_with_inputs<'m, R: InputValues<M::Inputs>>(
        &self,
        model: &'m M,
        law: impl Fn(f64, &M::State) -> R + Send + Sync + 'm,
    ) -> Option<Motion<'m, M>> {
        let mut motion = self.motion(model)?;
        motion.law = Some(Box::new(move |t, state| law(t, state).values()));
        Some(motion)
    }
}
