//! What a method is to a stepper.

use crate::integrate::controller::ControllerSettings;
use crate::integrate::dense::Dense;
use crate::integrate::method::Method;
use crate::integrate::phase::{Phase, StepNode};
use crate::integrate::step::Step;
use crate::integrate::step::Tolerances;
use crate::integrate::system::System;
use crate::model::Vector;

/// One integration method.
///
/// `attempt` makes a trial step and keeps its stages; `finish` evaluates q̈ at its end; `dense` builds the
/// interpolant. They are called in this order, each at most once per step.
pub trait Scheme<V: Vector>: Clone {
    /// Which method this is.
    const METHOD: Method;
    /// Order of the step.
    const ORDER: u32;
    /// Order that the error estimate behaves like: the step follows tolerance^(1/(this + 1)).
    const ERROR_ORDER: u32;
    /// Step control suited to the method; `None` where there is no error estimate.
    const CONTROL: Option<ControllerSettings>;
    /// Weights b of the step's quadrature, one per stage in the order of evaluation, the first for the start
    /// of the step; none where stages are no evaluations at states of the solution: sums over a step are then
    /// taken from the interpolant.
    const WEIGHTS: &'static [f64];
    /// |h λ| at the border of the region of stability on the negative real axis, for the stiffness test.
    const STABILITY_BORDER: f64;
    /// Number of parts in which a step is scanned for events.
    const EVENT_PANELS: usize;
    /// Places within a step, as parts of it, at which dense output is held against the equations of motion:
    /// where what it is off changes fastest, away from its own nodes. None for methods with interpolants that
    /// they judge themselves, or that are as good as their steps, and for those without error estimate.
    const DEFECT_SAMPLES: &'static [f64] = &[];
    /// Whether it makes few and long steps: the first one from rest is then as long as the times of the
    /// mechanism permit, where others begin with short ones and soon have longer ones.
    const LONG_STEPS: bool = false;
    /// The interpolant.
    type Dense: Dense<V> + Send + Sync + 'static;

    /// With the options that it has by itself.
    fn new() -> Self;
    /// Whether the next one says how long every step is: errors that are permitted are then no matter of the
    /// controller.
    const PROPOSES_STEP: bool = false;
    /// The size of the step that starts here, positive, where the method knows it before it tries; `h` is
    /// what the step before suggests, with its sign.
    #[inline(always)]
    fn propose<S: System<V>>(
        &mut self,
        _system: &mut S,
        _start: &StepNode<V>,
        _h: f64,
        _tolerances: &Tolerances,
    ) -> Option<f64> {
        None
    }
    /// Drops what it remembers of steps before: the motion goes on from another state, or by other forces.
    #[inline(always)]
    fn forget_history(&mut self) {}
    /// Tries a step of size h. Returns the new phase and the scaled norm of the local error estimate (0
    /// without estimate).
    fn attempt<S: System<V>>(
        &mut self,
        system: &mut S,
        start: &StepNode<V>,
        h: f64,
        tolerances: &Tolerances,
    ) -> Result<(Phase<V>, f64), S::Error>;
    /// As [`Scheme::attempt`], to the same bits, of a step that is made once more. Steps are inlined where
    /// motions are made, and are most of what a method is to a compiler; here what is short may be slower.
    #[inline(always)]
    fn replay_attempt<S: System<V>>(
        &mut self,
        system: &mut S,
        start: &StepNode<V>,
        h: f64,
        tolerances: &Tolerances,
    ) -> Result<(Phase<V>, f64), S::Error> {
        self.attempt(system, start, h, tolerances)
    }
    /// Is told of a step that was made before and is to be tried once more, all of it (1) or its first part:
    /// what is known of it may start its iterations. Whether these may end elsewhere, so that it is only what
    /// it was where it ends where it did.
    #[inline(always)]
    fn prepare_replay(&mut self, _step: &Step<V>, _part: f64) -> bool {
        false
    }
    /// q̈ at the end of the step just tried.
    fn finish<S: System<V>>(&mut self, system: &mut S, end_t: f64, end: &Phase<V>) -> Result<V, S::Error>;
    /// The interpolant of the step just finished; may evaluate further stages.
    fn dense<S: System<V>>(
        &mut self,
        system: &mut S,
        start: &StepNode<V>,
        end: &StepNode<V>,
        h: f64,
    ) -> Result<Self::Dense, S::Error>;
    /// The interpolant of a step that was made before, where its ends tell it, so that nothing has to be
    /// tried once more.
    #[inline(always)]
    fn dense_from_ends<S: System<V>>(
        &mut self,
        _system: &mut S,
        _start: &StepNode<V>,
        _end: &StepNode<V>,
        _h: f64,
        _tolerances: &Tolerances,
    ) -> Result<Option<Self::Dense>, S::Error> {
        Ok(None)
    }
    /// Stage derivatives of the step just tried, in the order of evaluation, to find what is not finite.
    fn stages(&self) -> &[Phase<V>];
    /// The vector whose norm `attempt` returned, unscaled, to name the coordinate that forces small steps.
    fn error_vector(&self) -> Phase<V>;
    /// What the stages of the step just tried disagree by, unscaled: the error, where it is estimated.
    fn stage_disagreement(&self) -> Phase<V> {
        self.error_vector()
    }
    /// Whether the equations of the last attempt are solved: always, for methods without any. Where they are
    /// not, the attempt's results mean nothing.
    #[inline(always)]
    fn has_converged(&self) -> bool {
        true
    }
    /// Is told of every step that is accepted, with its end as it was projected.
    #[inline(always)]
    fn accept_step(&mut self, _step: &Step<V>) {}
    /// Has the last word on the next step: the step control wants it `factor` times as long as the one tried
    /// last, which had this error.
    #[inline(always)]
    fn adjust_step_factor(&mut self, factor: f64, _error: f64) -> f64 {
        factor
    }
    /// Estimate |h λ| of the dominant eigenvalue from two stages at the end of the step; `None` where they
    /// coincide.
    fn stiffness(&self, h: f64, end: &StepNode<V>) -> Option<f64>;
}
