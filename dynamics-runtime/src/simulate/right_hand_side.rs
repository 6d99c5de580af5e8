//! The right-hand side: q̇ and q̈ of a model with its inputs, as the integrators evaluate it.
//!
//! It combines the model's code with three things. Inputs are held, or follow the law of
//! [`Simulation::inputs`](crate::simulate::Simulation::inputs). Constraints are kept by the formulation of
//! the run, see [`crate::simulate::stabilization`]. Where the model has switching functions (kinks), the
//! branches at the start of a step are held throughout the step, see `switching_functions.rs`.
//!
//! The traits of the integrators are implemented in `system.rs`. Steps are made, accepted and rejected by
//! `integrate/stepper.rs`; the loop that calls it is `run.rs`. Projected ends become errors of a step in
//! [`RightHandSide::project_end`].

pub(crate) mod switching_functions;
mod system;

use alloc::boxed::Box;

use crate::constrain::rank_margin::rank_margin;
use crate::error::SolveError;
use crate::integrate::{
    Accelerations, Dense, Phase, ProjectedEnd, Stages, Step, StepFlags, StepNode, Tolerances, increment, zip,
};
use crate::lanes::Lanes;
use crate::linalg::max_abs;
use crate::model::{
    ActiveSet, Branches, Constraints, LaneEvaluation, Model, ModelState, SharedValues, StaticTraits, Vector,
    WideOf,
};
use crate::simulate::stabilization::{Stabilization, StabilizationSnapshot};

/// Input values as a function of time and state.
pub(crate) type InputLaw<'m, M> =
    Box<dyn Fn(f64, &<M as Model>::State) -> <M as Model>::Inputs + Send + Sync + 'm>;

/// A function that receives the states of stages.
pub(crate) type Listener<'r, M> = Box<dyn FnMut(&<M as Model>::State) + 'r>;

/// Why there are no accelerations at a state.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum EvaluationError {
    Solve(SolveError),
    /// Index of the input whose value is not finite.
    Input(usize),
}

/// Move of a projected end, in permitted errors, up to which the move itself counts as the violation of the
/// constraints. Of a larger move the violation is computed that caused it, because near a singular position a
/// small violation causes a large move. The stepper rejects a step whose violation is above ten permitted
/// errors (`integrate/stepper/singularity_crossing.rs`). A smaller value computes violations at more steps. A
/// value above ten would reject steps for their moves alone.
pub(crate) const MAX_UNINSPECTED_MOVE: f64 = 1.0;
/// Largest ratio of such a move to the violation that caused it. The violation counts as at least the move
/// over this, as constraints that amplify more are too near to losing rank to determine the end. A smaller
/// value rejects more steps near singular positions, a larger one accepts ends that rounding has moved.
pub(crate) const MAX_MOVE_PER_VIOLATION: f64 = 1e6;
/// Condition of the constraints, with rows scaled to unit length, above which a singular position may be
/// near. The bound is low on purpose: what it triggers is a closer inspection, never an error by itself.
pub(crate) const NEARLY_SINGULAR_CONDITION: f64 = 5.0;

/// Largest violation of the constraints by an interpolant, in permitted errors, at [`PROBED_PARTS`] of its
/// step. One that violates them by more has a stage beside a singular position. Ordinary interpolants are
/// below, as their error is about that of the step.
pub(crate) const MAX_VIOLATION_BETWEEN: f64 = 10.0;
/// Parts of a step at which an interpolant is compared with the constraints: between the ends, which fulfil
/// them, and at unequal distances, so that an error that vanishes at one of them shows at another.
const PROBED_PARTS: [f64; 4] = [0.15, 0.4, 0.65, 0.85];

/// The right-hand side of a run. See this file's head.
pub(crate) struct RightHandSide<'r, 'm, M: Constraints> {
    pub(crate) model: &'m M,
    pub(crate) constants: &'r M::Constants,
    pub(crate) law: Option<&'r InputLaw<'m, M>>,
    /// Input values where there is no law. A law reads them in the state that it gets.
    pub(crate) held_inputs: M::Inputs,
    /// Which of the switched constraints hold.
    pub(crate) active_set: ActiveSet,
    pub(crate) evaluations: u64,
    pub(crate) stabilization: Stabilization<M>,
    /// Branches that are held during the step that is being made.
    pub(crate) held_branches: Branches,
    /// Branches on which the accelerations at the stepper's current node were found.
    pub(crate) acceleration_branches: Branches,
    /// Memory of Taylor series, allocated with the first one.
    pub(crate) series_memory: Option<Box<M::Series>>,
    /// Receives the states of stages, for the account of work. A right-hand side of its own would have every
    /// method compiled once more.
    pub(crate) listener: Option<Listener<'r, M>>,
}

/// What trial steps change in a right-hand side.
pub(crate) struct TrialSnapshot<'r, M: Constraints> {
    branches: (Branches, Branches),
    stabilization: StabilizationSnapshot<M>,
    listener: Option<Listener<'r, M>>,
}

impl<'r, 'm, M: Constraints> RightHandSide<'r, 'm, M> {
    /// With the held inputs and the active set of a state.
    pub(crate) fn new(
        model: &'m M,
        constants: &'r M::Constants,
        law: Option<&'r InputLaw<'m, M>>,
        state: &M::State,
        stabilization: Stabilization<M>,
    ) -> Self {
        Self {
            model,
            constants,
            law,
            held_inputs: *state.inputs(),
            active_set: state.active_set(),
            evaluations: 0,
            stabilization,
            held_branches: Branches::FREE,
            acceleration_branches: Branches::FREE,
            series_memory: None,
            listener: None,
        }
    }

    /// Takes the listener off and saves what trial steps would change.
    pub(crate) fn save_for_trials(&mut self) -> TrialSnapshot<'r, M> {
        TrialSnapshot {
            branches: (self.held_branches, self.acceleration_branches),
            stabilization: self.stabilization.snapshot(),
            listener: self.listener.take(),
        }
    }

    /// Undoes what trial steps have changed. Their evaluations remain counted.
    pub(crate) fn restore_after_trials(&mut self, saved: TrialSnapshot<'r, M>) {
        (self.held_branches, self.acceleration_branches) = saved.branches;
        self.stabilization.restore_snapshot(saved.stabilization);
        self.listener = saved.listener;
    }
}

impl<M: Constraints> RightHandSide<'_, '_, M> {
    /// The state with its inputs.
    #[inline(always)]
    pub(crate) fn state(&self, t: f64, q: &M::Vector, u: &M::Vector) -> M::State {
        let mut state = M::State::new(t, *q, *u, self.held_inputs);
        self.complete(&mut state);
        state
    }

    /// Gives a state its active set and inputs, in place: copying what was just written has to wait for it.
    #[inline(always)]
    fn complete(&self, state: &mut M::State) {
        *state.active_set_mut() = self.active_set;
        if let Some(law) = self.law {
            let inputs = law(state.t(), state);
            *state.inputs_mut() = inputs;
        }
    }

    /// The state at which a stage is evaluated, projected where the stabilization projects stages.
    #[inline(always)]
    pub(crate) fn stage(&mut self, t: f64, y: &Phase<M::Vector>) -> Result<M::State, EvaluationError> {
        let mut state = self.state(t, &y.q, &y.u);
        if !M::IS_UNCONSTRAINED && self.stabilization.projects_stages() {
            self.project_stage(&mut state)?;
        }
        Ok(state)
    }

    #[cold]
    fn project_stage(&mut self, state: &mut M::State) -> Result<(), EvaluationError> {
        let project = |stabilization: &mut Stabilization<M>, model: &M, state: &mut M::State| {
            stabilization.project_stage(model, state)
        };
        self.move_on_held_branches(state, project).map_err(EvaluationError::Solve)?;
        // The law reads the projected state.
        self.complete(state);
        Ok(())
    }

    /// The state at the part `theta` of a step that was just made, projected where the step asks for it.
    pub(crate) fn state_within(
        &mut self,
        dense: &dyn Dense<M::Vector>,
        step: &Step<M::Vector>,
        tolerances: &Tolerances,
        theta: f64,
    ) -> M::State {
        if theta >= 1.0 {
            return self.state(step.end.t, &step.end.y.q, &step.end.y.u);
        }
        if theta <= 0.0 {
            return self.state(step.start.t, &step.start.y.q, &step.start.y.u);
        }
        let y = dense.at(theta);
        let mut state = self.state(step.start.t + theta * step.h, &y.q, &y.u);
        if step.flags.between && M::IS_CONSTRAINED {
            let _ = self.move_on_held_branches(&mut state, |stabilization, model, state| {
                Ok(stabilization.project_between(model, state, tolerances))
            });
            state = with_inputs::<M>(self.law, state);
        }
        state
    }

    /// Whether states between the ends of a step have to be projected. Near a singular position a stage of
    /// the interpolant, which the step itself does not use, may lie so close to it that its accelerations are
    /// wrong. The ends of the step do not show that.
    pub(crate) fn projects_between(
        &mut self,
        dense: &dyn Dense<M::Vector>,
        step: &Step<M::Vector>,
        tolerances: &Tolerances,
    ) -> bool {
        let StepFlags { stages, between, .. } = step.flags;
        between || stages && self.violation_between(dense, step, tolerances) > MAX_VIOLATION_BETWEEN
    }

    /// The largest violation of the constraints at [`PROBED_PARTS`] of a step, in permitted errors.
    pub(crate) fn violation_between(
        &mut self,
        dense: &dyn Dense<M::Vector>,
        step: &Step<M::Vector>,
        tolerances: &Tolerances,
    ) -> f64 {
        if M::IS_UNCONSTRAINED {
            return 0.0;
        }
        PROBED_PARTS.iter().fold(0.0, |most: f64, &theta| {
            let y = dense.at(theta);
            let state = self.on_branches(&self.state(step.start.t + theta * step.h, &y.q, &y.u));
            most.max(self.stabilization.violation(self.model, &state, tolerances))
        })
    }

    /// Whether an interpolant violates constraints that may drift by much more than the ends of its step do.
    pub(crate) fn interpolant_strays(
        &mut self,
        dense: &dyn Dense<M::Vector>,
        step: &Step<M::Vector>,
        tolerances: &Tolerances,
    ) -> bool {
        if M::IS_UNCONSTRAINED || self.stabilization.projects() {
            return false;
        }
        let ends = [&step.start, &step.end].map(|end| self.state(end.t, &end.y.q, &end.y.u));
        let drift = ends.map(|end| self.stabilization.violation(self.model, &end, tolerances));
        self.violation_between(dense, step, tolerances)
            > MAX_VIOLATION_BETWEEN * drift[0].max(drift[1]).max(1.0)
    }

    #[cold]
    fn not_expandable(&self, state: &M::State) -> EvaluationError {
        EvaluationError::Solve(SolveError::NotExpandable { rows: rank_margin(self.model, state).rows })
    }

    /// A state on the branches that are held.
    #[inline(always)]
    pub(crate) fn on_branches(&self, state: &M::State) -> M::State {
        state_on_branches::<M>(self.held_branches, state)
    }

    /// Moves a state by `moved` with the held branches. Constraints keep their branches, too, up to the end
    /// of the step. Where that fails, on the branches at the state itself.
    #[inline(always)]
    fn move_on_held_branches<R>(
        &mut self,
        state: &mut M::State,
        moved: impl Fn(&mut Stabilization<M>, &M, &mut M::State) -> Result<R, SolveError>,
    ) -> Result<R, SolveError> {
        if M::HAS_KINKS && self.held_branches != Branches::FREE {
            let mut held = self.on_branches(state);
            if let Ok(found) = moved(&mut self.stabilization, self.model, &mut held)
                && is_finite(held.q())
                && is_finite(held.u())
            {
                held.hold(Branches::FREE);
                *state = held;
                return Ok(found);
            }
        }
        moved(&mut self.stabilization, self.model, state)
    }

    #[inline(always)]
    fn solve(&mut self, state: &M::State) -> Result<M::Vector, SolveError> {
        if M::IS_UNCONSTRAINED {
            self.model.accelerations_with(self.constants, state)
        } else {
            self.stabilization.accelerations(self.model, self.constants, state)
        }
    }

    #[inline(always)]
    fn notify_listener(&mut self, state: &M::State) {
        if let Some(listener) = &mut self.listener {
            listener(state);
        }
    }

    /// q̈ at the state of a stage.
    #[inline(always)]
    pub(crate) fn accelerations_of(&mut self, state: &M::State) -> Result<M::Vector, EvaluationError> {
        self.evaluations += 1;
        if self.law.is_some()
            && let Some(index) = state.inputs().as_slice().iter().position(|x| !x.is_finite())
        {
            return Err(EvaluationError::Input(index));
        }
        let solved = if M::HAS_KINKS { self.solve(&self.on_branches(state)) } else { self.solve(state) };
        if M::HAS_KINKS && self.held_branches != Branches::FREE && !solved.as_ref().is_ok_and(is_finite) {
            // A held branch may not exist behind its switching point, as the root of a negative number. The
            // model's own branch is finite there. Few stages lie there, as the step will end at the point.
            self.evaluations += 1;
            return self.solve(state).map_err(EvaluationError::Solve);
        }
        solved.map_err(EvaluationError::Solve)
    }
}

impl<M: Constraints> RightHandSide<'_, '_, M> {
    /// Writes q̈ of several stages at once, where that equals evaluating them one by one: without a listener,
    /// an input law, held branches or added terms. False where it was not possible.
    #[inline(always)]
    fn accelerations_in_lanes<L: Lanes>(
        &mut self,
        t: L,
        y: &Stages<M::Vector, L>,
        a: &mut WideOf<M, L>,
    ) -> bool {
        let plain = self.law.is_none() && self.listener.is_none() && self.held_branches == Branches::FREE;
        if !M::HAS_LANES || !plain || !(M::IS_UNCONSTRAINED || self.stabilization.adds_nothing()) {
            return false;
        }
        let mut state = M::State::new(f64::NAN, M::Vector::zeros(), M::Vector::zeros(), self.held_inputs);
        *state.active_set_mut() = self.active_set;
        let found = L::call(LaneEvaluation {
            model: self.model,
            constants: self.constants,
            state: &state,
            values: SharedValues,
            t,
            states: [&y.q, &y.u],
            accelerations: a,
        });
        self.evaluations += if found { L::COUNT as u64 } else { 0 };
        found
    }
}

/// The state, evaluated on these branches.
#[inline(always)]
pub(crate) fn state_on_branches<M: Constraints>(branches: Branches, state: &M::State) -> M::State {
    let mut state = *state;
    if M::HAS_KINKS {
        state.hold(branches);
    }
    state
}

fn is_finite(v: &impl Vector) -> bool {
    v.as_slice().iter().all(|x| x.is_finite())
}

/// Replaces the inputs of a state by those of the law, if there is one.
#[inline(always)]
pub(crate) fn with_inputs<M: Model>(law: Option<&InputLaw<'_, M>>, mut state: M::State) -> M::State {
    if let Some(law) = law {
        *state.inputs_mut() = law(state.t(), &state);
    }
    state
}

impl<M: Constraints> RightHandSide<'_, '_, M> {
    /// ∂q̈/∂q and ∂q̈/∂q̇ from generated code, including the derivatives of an input law. False
    /// where the generated code does not apply.
    fn exact_jacobian(
        &mut self,
        at: &StepNode<M::Vector>,
        by_q: &mut [f64],
        by_u: &mut [f64],
    ) -> Result<bool, EvaluationError> {
        if !self.stabilization.uses_model_accelerations() {
            return Ok(false);
        }
        let state = self.stage(at.t, &at.y)?;
        if !self.model.acceleration_derivatives(&self.on_branches(&state), by_q, by_u) {
            return Ok(false);
        }
        let law = self.law;
        if law.is_some() && M::Inputs::LEN > 0 {
            self.add_input_law_derivatives(&state, by_q, by_u)?;
        }
        Ok(by_q.iter().chain(by_u.iter()).all(|x| x.is_finite()))
    }

    /// Adds ∂q̈/∂inputs · ∂inputs/∂state, by one-sided differences of the law and of the
    /// accelerations.
    fn add_input_law_derivatives(
        &mut self,
        state: &M::State,
        by_q: &mut [f64],
        by_u: &mut [f64],
    ) -> Result<(), EvaluationError> {
        let n = M::Vector::LEN;
        let here = self.accelerations_of(state)?;
        for j in 0..2 * n {
            let mut displaced = M::State::new(state.t(), *state.q(), *state.u(), self.held_inputs);
            *displaced.active_set_mut() = self.active_set;
            let (elements, matrix) = match j < n {
                true => (displaced.q_mut(), &mut *by_q),
                false => (displaced.u_mut(), &mut *by_u),
            };
            let step = increment(elements[j % n], max_abs(elements.as_slice()));
            elements[j % n] += step;
            let inputs = *with_inputs::<M>(self.law, displaced).inputs();
            if inputs == *state.inputs() {
                continue;
            }
            let mut other = *state;
            *other.inputs_mut() = inputs;
            let there = self.accelerations_of(&other)?;
            (0..n).for_each(|i| matrix[i * n + j % n] += (there[i] - here[i]) / step);
        }
        Ok(())
    }
}

/// What models with constraints need at every stage or step. Not inlined, so that it is compiled once for all
/// methods: the call is short against the hundreds of nanoseconds of an evaluation.
impl<M: Constraints> RightHandSide<'_, '_, M> {
    /// (q̇, q̈) at a stage.
    #[inline(never)]
    fn constrained_derivative(
        &mut self,
        t: f64,
        y: &Phase<M::Vector>,
    ) -> Result<Phase<M::Vector>, EvaluationError> {
        let mut state = M::State::new(t, y.q, y.u, self.held_inputs);
        self.complete(&mut state);
        if self.stabilization.projects_stages() {
            self.project_stage(&mut state)?;
        }
        self.notify_listener(&state);
        Ok(Phase { q: *state.u(), u: self.accelerations_of(&state)? })
    }

    /// Sets the correction that tied gains add during a step, and evaluates its start anew. See
    /// [`Accelerations::begin_attempt`].
    #[inline(never)]
    fn apply_tied_gains(&mut self, start: &mut StepNode<M::Vector>, h: f64) -> Result<(), EvaluationError> {
        let state = self.on_branches(&self.state(start.t, &start.y.q, &start.y.u));
        self.stabilization.set_step_correction(self.model, &state, h).map_err(EvaluationError::Solve)?;
        // The accelerations at the start contain the correction of the step before.
        start.a = self.accelerations(start.t, &start.y.q, &start.y.u)?;
        Ok(())
    }

    /// Projects the end of a step. See [`Stabilized::project`](crate::integrate::Stabilized::project).
    #[inline(never)]
    fn project_end(
        &mut self,
        t: f64,
        y: &mut Phase<M::Vector>,
        tolerances: &Tolerances,
    ) -> Result<ProjectedEnd, EvaluationError> {
        let before = self.state(t, &y.q, &y.u);
        let mut state = before;
        let project = |stabilization: &mut Stabilization<M>, model: &M, state: &mut M::State| {
            stabilization.project(model, state)
        };
        let noise = self.move_on_held_branches(&mut state, project).map_err(EvaluationError::Solve)?;
        let projected = Phase { q: *state.q(), u: *state.u() };
        let change = zip(&projected, y, |to, from| to - from);
        let size = tolerances.norm(&change, y, &projected);
        self.stabilization.latest_move = Some(size);
        let mut violation = size;
        if size > MAX_UNINSPECTED_MOVE {
            // Near a singular position a small violation causes a large move along the direction that the
            // constraints lose. The violation decides whether the step is rejected, and not the move.
            let before = self.on_branches(&before);
            violation = self
                .stabilization
                .violation(self.model, &before, tolerances)
                .max(size / MAX_MOVE_PER_VIOLATION)
                .min(size);
        }
        *y = projected;
        let permitted = tolerances.absolute + tolerances.relative * max_abs(projected.u.as_slice());
        Ok(ProjectedEnd { by: size, violation, noise: noise / permitted })
    }
}
