//! A stepper without the type of its method, as a run drives it.
//!
//! The loop of a run, its events and its monitors are compiled once per model, not once more for every
//! method. A step takes hundreds of nanoseconds, a call through a trait object about one. All functions are
//! those of [`Stepper`]; `integrate/stepper.rs` accepts and rejects steps.

use alloc::boxed::Box;

use crate::integrate::{Phase, Scheme, Step, StepError, StepNode, Stepper};
use crate::model::SimulationModel;
use crate::simulate::erased_method::Interpolant;
use crate::simulate::right_hand_side::{EvaluationError, RightHandSide};

/// The current time of a stepper, its counts and its findings.
pub(crate) struct StepStatistics {
    pub(crate) t: f64,
    pub(crate) accepted: u64,
    pub(crate) rejected: u64,
    /// Size proposed for the next step, positive.
    pub(crate) proposed: f64,
    /// First time at which the steps were at the border of stability.
    pub(crate) stiff_at: Option<f64>,
    /// First time at which the motion was found to slide along a switching surface.
    pub(crate) slides_at: Option<f64>,
    /// How often it was found to slide.
    pub(crate) slides: u64,
}

/// Result of a function of [`ErasedStepper`].
pub(crate) type StepResult<T> = Result<T, StepError<EvaluationError>>;

/// See [`Stepper`], whose functions these are.
pub(crate) trait ErasedStepper<M: SimulationModel> {
    fn now(&self) -> &StepNode<M::Vector>;
    fn statistics(&self) -> StepStatistics;
    fn subdivided_steps(&self) -> (u64, Option<f64>);
    /// See [`Scheme::EVENT_PANELS`].
    fn scan(&self) -> usize;
    fn set_accelerations(&mut self, a: M::Vector, h: f64);
    fn step(&mut self, rhs: &mut RightHandSide<'_, '_, M>, limit: f64) -> StepResult<Step<M::Vector>>;
    fn shorten(
        &mut self,
        rhs: &mut RightHandSide<'_, '_, M>,
        step: &Step<M::Vector>,
        end_t: f64,
    ) -> StepResult<Step<M::Vector>>;
    fn restart(
        &mut self,
        rhs: &mut RightHandSide<'_, '_, M>,
        t: f64,
        y: Phase<M::Vector>,
        limit: f64,
    ) -> StepResult<()>;
    /// The interpolant of a step. `judged`: as accurate as the ends of the step, in parts if necessary.
    fn dense(
        &mut self,
        rhs: &mut RightHandSide<'_, '_, M>,
        step: &Step<M::Vector>,
        judged: bool,
    ) -> Result<Interpolant<M::Vector>, EvaluationError>;
    fn undo(&mut self, step: &Step<M::Vector>);
    fn reject(&mut self, step: &Step<M::Vector>);
    fn roll_back(&mut self, to: &StepNode<M::Vector>);
    fn end_at_branch(&mut self, made: Option<&Step<M::Vector>>);
    /// A copy of the stepper for trial steps, where its method is for stiff motions, so that interpolants are
    /// less accurate than ends of steps.
    fn clone_for_trials(&self) -> Option<Box<dyn ErasedStepper<M> + '_>>;
}

impl<M: SimulationModel, S: Scheme<M::Vector>> ErasedStepper<M> for Stepper<M::Vector, S> {
    fn now(&self) -> &StepNode<M::Vector> {
        self.now()
    }

    fn statistics(&self) -> StepStatistics {
        StepStatistics {
            t: self.now().t,
            accepted: self.accepted(),
            rejected: self.rejected(),
            proposed: self.proposed_step(),
            stiff_at: self.stiff_at(),
            slides_at: self.slides_at(),
            slides: self.slides(),
        }
    }

    fn subdivided_steps(&self) -> (u64, Option<f64>) {
        self.subdivided_steps()
    }

    fn scan(&self) -> usize {
        S::EVENT_PANELS
    }

    fn set_accelerations(&mut self, a: M::Vector, h: f64) {
        self.set_accelerations(a, h);
    }

    fn step(&mut self, rhs: &mut RightHandSide<'_, '_, M>, limit: f64) -> StepResult<Step<M::Vector>> {
        self.step(rhs, limit)
    }

    fn shorten(
        &mut self,
        rhs: &mut RightHandSide<'_, '_, M>,
        step: &Step<M::Vector>,
        end_t: f64,
    ) -> StepResult<Step<M::Vector>> {
        self.shorten(rhs, step, end_t)
    }

    fn restart(
        &mut self,
        rhs: &mut RightHandSide<'_, '_, M>,
        t: f64,
        y: Phase<M::Vector>,
        limit: f64,
    ) -> StepResult<()> {
        self.restart(rhs, t, y, limit)
    }

    fn dense(
        &mut self,
        rhs: &mut RightHandSide<'_, '_, M>,
        step: &Step<M::Vector>,
        judged: bool,
    ) -> Result<Interpolant<M::Vector>, EvaluationError> {
        let dense = self.dense(rhs, step)?;
        // Tied gains would differ in the parts of the step.
        if const { S::DEFECT_SAMPLES.is_empty() }
            || !judged
            || self.is_fixed()
            || rhs.stabilization.has_tied_gains()
        {
            return Ok(Box::new(dense));
        }
        // Trial steps in parts leave no trace in the right-hand side.
        let saved = rhs.save_for_trials();
        let (mut scheme, tolerances) = (self.scheme().clone(), self.tolerances());
        let parts = Self::dense_in_parts(&mut scheme, rhs, step, &dense, &tolerances);
        rhs.restore_after_trials(saved);
        Ok(match parts {
            Some(parts) => Box::new(parts),
            None => Box::new(dense),
        })
    }

    fn undo(&mut self, step: &Step<M::Vector>) {
        self.undo(step);
    }

    fn reject(&mut self, step: &Step<M::Vector>) {
        self.reject(step);
    }

    fn roll_back(&mut self, to: &StepNode<M::Vector>) {
        self.roll_back(to);
    }

    fn end_at_branch(&mut self, made: Option<&Step<M::Vector>>) {
        self.end_at_branch(made);
    }

    fn clone_for_trials(&self) -> Option<Box<dyn ErasedStepper<M> + '_>> {
        if const { S::STABILITY_BORDER.is_infinite() } { Some(Box::new(self.clone())) } else { None }
    }
}
