//! A method as a run calls it: one table of functions per model and method that the program names.

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

pub(crate) trait ErasedMethod<M: Model>: Send + Sync {
    fn method(&self) -> Method;
    /// Whether it estimates its error, and so can choose its step.
    fn is_adaptive(&self) -> bool;
    /// Whether it needs the motion's Taylor series.
    fn needs_series(&self) -> bool;
    /// What models it is for.
    fn suits(&self) -> Suits;
    /// See [`Choice::option`].
    fn option(&self, constrained: bool) -> Option<(&'static str, f64, bool, &'static str)>;
    /// A stepper at time t and phase y, in direction of `limit`.
    fn begin(
        &self,
        rhs: &mut RightHandSide<'_, '_, M>,
        from: (f64, Phase<M::Vector>),
        limit: f64,
        options: StepOptions,
    ) -> StepResult<Box<dyn ErasedStepper<M>>>
    where
        M: SimulationModel;
    /// What makes steps again.
    fn step_replay(&self) -> Box<dyn StepReplay<M>>
    where
        M: SimulationModel;
    /// See [`Scheme::WEIGHTS`].
    fn weights(&self) -> &'static [f64];
}

/// Makes steps of a motion again, one after the other: implicit methods remember their matrices from one to
/// the next.
pub(crate) trait StepReplay<M: SimulationModel>: Send + Sync {
    /// The interpolant of a step, which is made again where its ends do not tell; `None` where that fails.
    /// `judged`: as good as its ends, if need be in parts.
    fn interpolate(
        &mut self,
        rhs: &mut RightHandSide<'_, '_, M>,
        step: &Step<M::Vector>,
        tolerances: &Tolerances,
        judged: bool,
    ) -> Option<Interpolant<M::Vector>>;
    /// Where the step with this start and size ends, stabilized as it was, and its error, 1 where it is just
    /// permitted; `None` where that fails.
    fn end_of(
        &mut self,
        rhs: &mut RightHandSide<'_, '_, M>,
        step: &Step<M::Vector>,
        tolerances: &Tolerances,
    ) -> Option<(Phase<M::Vector>, f64)>;
    /// The same on whatever branches the right-hand side holds.
    fn end_on_branches(
        &mut self,
        rhs: &mut RightHandSide<'_, '_, M>,
        step: &Step<M::Vector>,
        tolerances: &Tolerances,
    ) -> Option<(Phase<M::Vector>, f64)>;
    /// Makes the step again, with everything else as it is to be; whether that succeeds.
    fn attempt(
        &mut self,
        rhs: &mut RightHandSide<'_, '_, M>,
        step: &Step<M::Vector>,
        tolerances: &Tolerances,
    ) -> bool;
    /// Is told that the step of which it has found the end is made.
    fn accepted(&mut self, step: &Step<M::Vector>);
    /// What comes next goes on from something else.
    fn forget(&mut self);
}

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
        if const { S::DEFECT_SAMPLES.is_empty() } || !judged || rhs.stabilization.is_tied() {
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

pub(crate) type SharedMethod<M> = Arc<dyn ErasedMethod<M>>;

/// Some method for model M, where a list of several is run through: `for method in
/// &[AnyMethod::from(Rk4), Dop853.into()]`.
pub struct AnyMethod<M: Model>(pub(crate) SharedMethod<M>);

impl<M: Model> AnyMethod<M> {
    /// Which one.
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

// By hand, because a derive would ask the same of the model.
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
