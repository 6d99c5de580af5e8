//! What a stepper asks of a method.

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
    /// of the step. Empty where stages are not evaluations at states of the solution: integrals over a step
    /// then use the interpolant.
    const WEIGHTS: &'static [f64];
    /// |h λ| at the border of the region of stability on the negative real axis, for the stiffness test.
    const STABILITY_BORDER: f64;
    /// Number of parts in which a step is scanned for events.
    const EVENT_PANELS: usize;
    /// Parts of a step at which defect control inserts dense output into the equations of motion: where its
    /// error changes fastest, away from its nodes. Empty for methods that judge their interpolants
    /// themselves, whose interpolants are as accurate as their steps, or without error estimate.
    const DEFECT_SAMPLES: &'static [f64] = &[];
    /// Whether the stages are states near the solution, each computed from those before it. Constraint
    /// violations of such stages are judged and projected near rank loss. Stages of implicit methods satisfy
    /// their equations instead.
    const IS_EXPLICIT: bool = false;
    /// Whether the method makes few and long steps. Its first step from rest is then as long as the
    /// characteristic times of the mechanism allow; others begin with a short step and grow fast.
    const LONG_STEPS: bool = false;
    /// The interpolant.
    type Dense: Dense<V> + Send + Sync + 'static;

    /// The method with its default options.
    fn new() -> Self;
    /// Whether [`Scheme::propose`] chooses the size of every step. The controller then handles rejected steps
    /// only.
    const PROPOSES_STEP: bool = false;
    /// The size of the step that starts here, positive, for methods that choose it before the attempt. `h` is
    /// the signed size that the last step suggests.
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
    /// Drops the data of earlier steps: the motion goes on from another state, or with other forces.
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
    /// As [`Scheme::attempt`], with equal bits, for a step that is repeated. [`Scheme::attempt`] is inlined
    /// into the loop of a run; this function may be slower and should be short, since it is compiled again
    /// for every model.
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
    /// Called before a recorded step is repeated, all of it (`part` = 1) or its first part: the record may
    /// start the iterations. Returns whether the iterations may converge to another end, which the caller
    /// then compares.
    #[inline(always)]
    fn prepare_replay(&mut self, _step: &Step<V>, _part: f64) -> bool {
        false
    }
    /// q̈ at the end of the step just tried. By default this evaluates the accelerations once more. Methods
    /// whose last stage lies at the end return its derivative.
    #[inline(always)]
    fn finish<S: System<V>>(&mut self, system: &mut S, end_t: f64, end: &Phase<V>) -> Result<V, S::Error> {
        system.accelerations(end_t, &end.q, &end.u)
    }
    /// The interpolant of the step just finished; may evaluate further stages.
    fn dense<S: System<V>>(
        &mut self,
        system: &mut S,
        start: &StepNode<V>,
        end: &StepNode<V>,
        h: f64,
    ) -> Result<Self::Dense, S::Error>;
    /// The interpolant of a recorded step, if it follows from the ends of the step alone, so that the step
    /// need not be repeated.
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
    /// Stage derivatives of the step just tried, in the order of evaluation.
    fn stages(&self) -> &[Phase<V>];
    /// The vector whose norm `attempt` returned, unscaled. Messages name the coordinate of its largest
    /// element. Every method whose `attempt` returns an estimate gives it; the default is for methods
    /// without one.
    fn error_vector(&self) -> Phase<V> {
        Phase::zeros()
    }
    /// The disagreement of the stages of the step just tried, unscaled: the error, where it is estimated.
    fn stage_disagreement(&self) -> Phase<V> {
        self.error_vector()
    }
    /// Whether the equations of the last attempt are solved. If not, its results are invalid. Always true for
    /// explicit methods.
    #[inline(always)]
    fn has_converged(&self) -> bool {
        true
    }
    /// Called with every accepted step, with its projected end.
    #[inline(always)]
    fn accept_step(&mut self, _step: &Step<V>) {}
    /// The factor from the last step to the next one, given that of the controller and the error of the last
    /// step.
    #[inline(always)]
    fn adjust_step_factor(&mut self, factor: f64, _error: f64) -> f64 {
        factor
    }
    /// Estimate |h λ| of the dominant eigenvalue from two stages at the end of the step; `None` where they
    /// coincide, and for methods without a test for stiffness.
    fn stiffness(&self, _h: f64, _end: &StepNode<V>) -> Option<f64> {
        None
    }
}
