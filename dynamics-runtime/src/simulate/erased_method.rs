//! Methods of integration without their type: [`AnyMethod`] for users, [`ErasedMethod`] for a run.
//!
//! The methods themselves are types below [`crate::integrate`]. A run works with trait objects, so that only
//! the stepper is compiled for each method that a program uses. [`StepReplay`] makes recorded steps again,
//! for interpolants and checks. Which method is chosen by default: `simulation/check.rs`.

pub(crate) mod stepping;

use alloc::boxed::Box;
use alloc::sync::Arc;
use core::fmt;

use crate::integrate::choice::{Choice, Suits};
use crate::integrate::{Dense, Method, Phase, Scheme, Step, StepOptions, Stepper, Tolerances};
use crate::model::{Model, SimulationModel};
use crate::simulate::erased_method::stepping::{ErasedStepper, StepResult};
use crate::simulate::right_hand_side::RightHandSide;

/// The interpolant of one step, of whatever method.
pub(crate) type Interpolant<V> = Box<dyn Dense<V> + Send + Sync>;

/// A method of integration for the model M.
pub(crate) trait ErasedMethod<M: Model>: Send + Sync {
    fn method(&self) -> Method;
    /// Whether it estimates its error, and so can choose its step.
    fn is_adaptive(&self) -> bool;
    /// Whether it needs the Taylor series of the motion.
    fn needs_series(&self) -> bool;
    /// The models that it suits.
    fn suits(&self) -> Suits;
    /// See [`Choice::option`].
    fn option(&self, constrained: bool) -> Option<(&'static str, f64, bool, &'static str)>;
    /// A stepper that starts at a time and a phase, in the direction of `limit`.
    fn begin(
        &self,
        rhs: &mut RightHandSide<'_, '_, M>,
        from: (f64, Phase<M::Vector>),
        limit: f64,
        options: StepOptions,
    ) -> StepResult<Box<dyn ErasedStepper<M>>>
    where
        M: SimulationModel;
    /// The object that makes recorded steps again.
    fn step_replay(&self) -> Box<dyn StepReplay<M>>
    where
        M: SimulationModel;
    /// See [`Scheme::WEIGHTS`].
    fn weights(&self) -> &'static [f64];
}

/// Makes recorded steps of a motion again, one after the other: implicit methods keep their matrices from one
/// step to the next.
pub(crate) trait StepReplay<M: SimulationModel>: Send + Sync {
    /// The interpolant of a step; `None` where the step cannot be made again. `judged`: as accurate as the
    /// ends of the step, in parts if necessary.
    fn interpolate(
        &mut self,
        rhs: &mut RightHandSide<'_, '_, M>,
        step: &Step<M::Vector>,
        tolerances: &Tolerances,
        judged: bool,
    ) -> Option<Interpolant<M::Vector>>;
    /// The end of the step with this start and size, stabilized as in the run, and its error in permitted
    /// errors; `None` where it cannot be made.
    fn end_of(
        &mut self,
        rhs: &mut RightHandSide<'_, '_, M>,
        step: &Step<M::Vector>,
        tolerances: &Tolerances,
    ) -> Option<(Phase<M::Vector>, f64)>;
    /// The same on the branches that the right-hand side holds.
    fn end_on_branches(
        &mut self,
        rhs: &mut RightHandSide<'_, '_, M>,
        step: &Step<M::Vector>,
        tolerances: &Tolerances,
    ) -> Option<(Phase<M::Vector>, f64)>;
    /// Makes the stages of the step again, with the right-hand side as it is. Returns whether that succeeded.
    fn attempt(
        &mut self,
        rhs: &mut RightHandSide<'_, '_, M>,
        step: &Step<M::Vector>,
        tolerances: &Tolerances,
    ) -> bool;
    /// The step whose end was found last is accepted: the next one continues from it.
    fn accepted(&mut self, step: &Step<M::Vector>);
    /// The next step does not continue from the last one.
    fn forget(&mut self);
}

/// [`StepReplay`] of one scheme.
struct SchemeReplay<S>(S);

impl<M: SimulationModel, S: Scheme<M::Vector> + Send + Sync> StepReplay<M> for SchemeReplay<S> {
    fn interpolate(
        &mut self,
        rhs: &mut RightHandSide<'_, '_, M>,
        step: &Step<M::Vector>,
        tolerances: &Tolerances,
        judged: bool,
    ) -> Option<Interpolant<M::Vector>> {
        let dense = Stepper::replay(&mut self.0, rhs, step, tolerances).ok()??;
        if const { S::DEFECT_SAMPLES.is_empty() } || !judged || rhs.stabilization.has_tied_gains() {
            return Some(Box::new(dense));
        }
        Some(match Stepper::dense_in_parts(&mut self.0, rhs, step, &dense, tolerances) {
            Some(parts) => Box::new(parts),
            None => Box::new(dense),
        })
    }

    fn end_of(
        &mut self,
        rhs: &mut RightHandSide<'_, '_, M>,
        step: &Step<M::Vector>,
        tolerances: &Tolerances,
    ) -> Option<(Phase<M::Vector>, f64)> {
        Stepper::replay_end(&mut self.0, rhs, step, tolerances).ok()?
    }

    fn end_on_branches(
        &mut self,
        rhs: &mut RightHandSide<'_, '_, M>,
        step: &Step<M::Vector>,
        tolerances: &Tolerances,
    ) -> Option<(Phase<M::Vector>, f64)> {
        Stepper::replay_end_on_held_branches(&mut self.0, rhs, step, tolerances).ok()?
    }

    fn attempt(
        &mut self,
        rhs: &mut RightHandSide<'_, '_, M>,
        step: &Step<M::Vector>,
        tolerances: &Tolerances,
    ) -> bool {
        Stepper::replay_attempt(&mut self.0, rhs, (&step.start, step.h), tolerances).is_ok()
    }

    fn accepted(&mut self, step: &Step<M::Vector>) {
        self.0.accept_step(step);
    }

    fn forget(&mut self) {
        self.0.forget_history();
    }
}

/// A method that a simulation, its reference run and its motion share.
pub(crate) type SharedMethod<M> = Arc<dyn ErasedMethod<M>>;

/// Any method for the model M, for lists of methods: `for method in &[AnyMethod::from(Rk4), Dop853.into()]`.
pub struct AnyMethod<M: Model>(pub(crate) SharedMethod<M>);

impl<M: Model> AnyMethod<M> {
    /// The method.
    #[must_use]
    pub fn method(&self) -> Method {
        self.0.method()
    }

    /// Whether it estimates its error, and so can choose its step; the others need
    /// [`crate::simulate::Simulation::fixed_step`].
    #[must_use]
    pub fn is_adaptive(&self) -> bool {
        self.0.is_adaptive()
    }
}

impl<M: Model, C: Choice> From<C> for AnyMethod<M> {
    fn from(choice: C) -> Self {
        Self(Arc::new(choice))
    }
}

impl<M: Model> From<&AnyMethod<M>> for AnyMethod<M> {
    fn from(method: &AnyMethod<M>) -> Self {
        method.clone()
    }
}

// By hand, because a derive would require `Clone` of the model.
impl<M: Model> Clone for AnyMethod<M> {
    fn clone(&self) -> Self {
        Self(Arc::clone(&self.0))
    }
}

impl<M: Model> fmt::Display for AnyMethod<M> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        fmt::Display::fmt(&self.method(), f)
    }
}

impl<M: Model> fmt::Debug for AnyMethod<M> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        fmt::Debug::fmt(&self.method(), f)
    }
}

impl<M: Model, C: Choice> ErasedMethod<M> for C {
    fn method(&self) -> Method {
        <C::Scheme<M::Vector> as Scheme<M::Vector>>::METHOD
    }

    fn is_adaptive(&self) -> bool {
        <C::Scheme<M::Vector> as Scheme<M::Vector>>::CONTROL.is_some()
    }

    fn needs_series(&self) -> bool {
        C::NEEDS_SERIES
    }

    fn suits(&self) -> Suits {
        C::SUITS
    }

    fn option(&self, constrained: bool) -> Option<(&'static str, f64, bool, &'static str)> {
        Choice::option(self, constrained)
    }

    fn begin(
        &self,
        rhs: &mut RightHandSide<'_, '_, M>,
        (t, y): (f64, Phase<M::Vector>),
        limit: f64,
        options: StepOptions,
    ) -> StepResult<Box<dyn ErasedStepper<M>>>
    where
        M: SimulationModel,
    {
        Ok(Box::new(Stepper::with(self.scheme::<M::Vector>(), rhs, t, y, limit, options)?))
    }

    fn step_replay(&self) -> Box<dyn StepReplay<M>>
    where
        M: SimulationModel,
    {
        Box::new(SchemeReplay(self.scheme::<M::Vector>()))
    }

    fn weights(&self) -> &'static [f64] {
        <C::Scheme<M::Vector> as Scheme<M::Vector>>::WEIGHTS
    }
}
