//! A motion apart from the model that it borrows.

use alloc::boxed::Box;
use alloc::sync::Arc;

use crate::model::{InputValues, SimulationModel};
use crate::simulate::trajectory::motion::Motion;
use crate::simulate::trajectory::record::Trajectory;

/// What a motion is made of, without the model that it borrows and without the inputs closure: to be kept in
/// a struct beside the model, or sent to another thread.
///
/// [`Motion::record`] makes it, [`MotionRecord::motion`] makes the motion again. Both share the computed
/// steps; nothing is copied.
///
/// ```
/// # use dynamics_runtime as dynamics;
/// use dynamics::simulate::{MotionRecord, Simulate, SimulationError};
///
/// /// A model and its last motion.
/// struct Session<M: Simulate> {
///     model: M,
///     last: Option<MotionRecord<M>>,
/// }
///
/// impl<M: Simulate> Session<M> {
///     fn run(&mut self, start: M::State) -> Result<(), SimulationError<M>> {
///         self.last = Some(self.model.simulate(start).until(1.0).run()?.record());
///         Ok(())
///     }
///     fn end(&self) -> Option<M::State> {
///         Some(self.last.as_ref()?.motion(&self.model).end())
///     }
/// }
/// ```
pub struct MotionRecord<M: SimulationModel> {
    constants: M::Constants,
    trajectory: Arc<Trajectory<M>>,
}

impl<M: SimulationModel> Clone for MotionRecord<M> {
    fn clone(&self) -> Self {
        Self { constants: self.constants, trajectory: Arc::clone(&self.trajectory) }
    }
}

impl<M: SimulationModel> core::fmt::Debug for MotionRecord<M> {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.debug_struct("MotionRecord").field("steps", &self.trajectory.records.len()).finish_non_exhaustive()
    }
}

impl<M: SimulationModel> Motion<'_, M> {
    /// The motion without the model that it borrows and without its inputs closure.
    #[must_use]
    pub fn record(&self) -> MotionRecord<M> {
        MotionRecord { constants: *self.constants(), trajectory: Arc::clone(&self.trajectory) }
    }
}

impl<M: SimulationModel> MotionRecord<M> {
    /// The motion. The model must be the one that moved, or equal to it: states between steps are computed
    /// with its equations.
    ///
    /// The inputs closure of a simulation no longer exists. So inputs are NaN, and states between steps come
    /// from the quintic Hermite interpolant. [`MotionRecord::motion_with_inputs`] takes the closure again.
    #[must_use]
    pub fn motion<'m>(&self, model: &'m M) -> Motion<'m, M> {
        Motion::new(model, self.constants, None, Arc::clone(&self.trajectory))
    }

    /// The motion, with the inputs closure that it ran with.
    #[must_use]
    pub fn motion_with_inputs<'m, R: InputValues<M::Inputs>>(
        &self,
        model: &'m M,
        law: impl Fn(f64, &M::State) -> R + Send + Sync + 'm,
    ) -> Motion<'m, M> {
        let mut motion = self.motion(model);
        motion.law = Some(Box::new(move |t, state| law(t, state).values()));
        motion
    }
}
