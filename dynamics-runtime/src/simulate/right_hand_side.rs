//! A model with its inputs, as the integrators see it.

pub(crate) mod switching_functions;
mod system;

use alloc::boxed::Box;

use crate::constrain::weakness::weakness;
use crate::error::SolveError;
use crate::integrate::{
    Accelerations, Dense, Phase, ProjectedEnd, Stages, Step, StepFlags, StepNode, Tolerances, increment, zip,
};
use crate::lanes::{self, Lanes};
use crate::linalg::max_abs;
use crate::model::{Branches, Constraints, Known, Model, ModelState, Modes, Vector, WideOf};
use crate::simulate::stabilization::Stabilization;

/// Input values as a function of time and state.
pub(crate) type InputLaw<'m, M> =
    Box<dyn Fn(f64, &<M as Model>::State) -> <M as Model>::Inputs + Send + Sync + 'm>;

/// Is shown states.
pub(crate) type Listener<'r, M> = Box<dyn FnMut(&<M as Model>::State) + 'r>;

/// Why accelerations do not exist at a state.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum EvaluationError {
    Solve(SolveError),
    /// Index of the input whose value is not finite.
    Input(usize),
}

/// A move onto the constraints by more permitted errors than this is looked at more closely.
pub(crate) const INSPECTED_MOVE: f64 = 1.0;
/// How much larger than what is violated such a move may be: constraints that are so near to losing rank
/// decide nothing any more.
pub(crate) const WEAK: f64 = 1e6;
/// Conditioning of constraints from which on a singular position is near.
pub(crate) const NEARLY_SINGULAR: f64 = 5.0;

/// An interpolant that violates constraints by more permitted errors than this, in one of these parts of its
/// step, has stages that are off.
pub(crate) const STRAYED: f64 = 10.0;
const PROBES: [f64; 4] = [0.15, 0.4, 0.65, 0.85];

/// q̈ of a model whose inputs are held or come from a law, and whose constraints are kept by a formulation.
pub(crate) struct RightHandSide<'r, 'm, M: Constraints> {
    pub(crate) model: &'m M,
    pub(crate) constants: &'r M::Constants,
    pub(crate) law: Option<&'r InputLaw<'m, M>>,
    /// Input values where there is no law; a law sees them in the state it gets.
    pub(crate) held: M::Inputs,
    /// Which switched constraints hold.
    pub(crate) modes: Modes,
    pub(crate) evaluations: u64,
    pub(crate) stabilization: Stabilization<M>,
    /// Branches that are held.
    pub(crate) branches: Branches,
    /// Those by which the accelerations where the stepper stands were found.
    pub(crate) known: Branches,
    /// What series are made in, from the first one on.
    pub(crate) memory: Option<Box<M::Series>>,
    /// Sees the states of stages: an account of work, which a system of its own would have every method
    /// compiled once more for.
    pub(crate) listener: Option<Listener<'r, M>>,
}

impl<M: Constraints> RightHandSide<'_, '_, M> {
    /// The state with its inputs.
    #[inline(always)]
    pub(crate) fn state(&self, t: f64, q: &M::Vector, u: &M::Vector) -> M::State {
        let mut state = M::State::new(t, *q, *u, self.held);
        *state.modes_mut() = self.modes;
        with_inputs::<M>(self.law, state)
    }

    /// The state at which a stage of a step is evaluated: where coordinates are embedded, with the dependent
    /// ones solved for.
    #[inline(always)]
    pub(crate) fn stage(&mut self, t: f64, y: &Phase<M::Vector>) -> Result<M::State, EvaluationError> {
        let state = self.state(t, &y.q, &y.u);
        if M::IS_FREE || !self.stabilization.restores() { Ok(state) } else { self.restored(state) }
    }

    #[cold]
    fn restored(&mut self, mut state: M::State) -> Result<M::State, EvaluationError> {
        self.held(&mut state, |stabilization, model, state| stabilization.restore(model, state))
            .map_err(EvaluationError::Solve)?;
        // The law sees the state that there is.
        Ok(with_inputs::<M>(self.law, state))
    }

    /// A state within a step just made; theta is 0 at its start.
    pub(crate) fn within(
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
        if step.kept.between && M::IS_HELD {
            let _ = self.held(&mut state, |stabilization, model, state| {
                Ok(stabilization.project_between(model, state, tolerances))
            });
            state = with_inputs::<M>(self.law, state);
        }
        state
    }

    /// Whether states between the ends of a step have to be projected. Near a singular position one more stage,
    /// which only the interpolant has, may lie right beside it, where nothing gives it accelerations to the
    /// tolerance; the ends know nothing of it.
    pub(crate) fn projects_between(
        &mut self,
        dense: &dyn Dense<M::Vector>,
        step: &Step<M::Vector>,
        tolerances: &Tolerances,
    ) -> bool {
        let StepFlags { stages, between, .. } = step.kept;
        between || stages && self.off_between(dense, step, tolerances) > STRAYED
    }

    /// How far states within a step are off the constraints at most, in permitted errors.
    pub(crate) fn off_between(
        &mut self,
        dense: &dyn Dense<M::Vector>,
        step: &Step<M::Vector>,
        tolerances: &Tolerances,
    ) -> f64 {
        if M::IS_FREE {
            return 0.0;
        }
        PROBES.iter().fold(0.0, |most: f64, &theta| {
            let y = dense.at(theta);
            let state = self.on_branches(&self.state(step.start.t + theta * step.h, &y.q, &y.u));
            most.max(self.stabilization.violation(self.model, &state, tolerances))
        })
    }

    /// Whether states within a step stray from constraints that may drift: further than its ends.
    pub(crate) fn strays(
        &mut self,
        dense: &dyn Dense<M::Vector>,
        step: &Step<M::Vector>,
        tolerances: &Tolerances,
    ) -> bool {
        if M::IS_FREE || self.stabilization.projects() {
            return false;
        }
        let ends = [&step.start, &step.end].map(|end| self.state(end.t, &end.y.q, &end.y.u));
        let drift = ends.map(|end| self.stabilization.violation(self.model, &end, tolerances));
        self.off_between(dense, step, tolerances) > STRAYED * drift[0].max(drift[1]).max(1.0)
    }

    #[cold]
    fn not_expandable(&self, state: &M::State) -> EvaluationError {
        EvaluationError::Solve(SolveError::NotExpandable { rows: weakness(self.model, state).rows })
    }

    /// A state on the branches that are held.
    #[inline(always)]
    pub(crate) fn on_branches(&self, state: &M::State) -> M::State {
        on::<M>(self.branches, state)
    }

    /// Moves a state as it is moved on the branches that are held: constraints, too, are what they are before
    /// the place at which a step is to end.
    #[inline(always)]
    fn held<R>(
        &mut self,
        state: &mut M::State,
        moved: impl Fn(&mut Stabilization<M>, &M, &mut M::State) -> Result<R, SolveError>,
    ) -> Result<R, SolveError> {
        if M::HAS_KINKS && self.branches != Branches::FREE {
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
    fn solved(&mut self, state: &M::State) -> Result<M::Vector, SolveError> {
        if M::IS_FREE {
            self.model.accelerations_with(self.constants, state)
        } else {
            self.stabilization.accelerations(self.model, self.constants, state)
        }
    }

    #[inline(always)]
    fn show(&mut self, state: &M::State) {
        if let Some(listener) = &mut self.listener {
            listener(state);
        }
    }

    /// q̈ at a stage.
    #[inline(always)]
    pub(crate) fn accelerations_of(&mut self, state: &M::State) -> Result<M::Vector, EvaluationError> {
        self.evaluations += 1;
        if self.law.is_some()
            && let Some(index) = state.inputs().as_slice().iter().position(|x| !x.is_finite())
        {
            return Err(EvaluationError::Input(index));
        }
        let solved = if M::HAS_KINKS { self.solved(&self.on_branches(state)) } else { self.solved(state) };
        if M::HAS_KINKS && self.branches != Branches::FREE && !solved.as_ref().is_ok_and(is_finite) {
            // A branch may not exist beyond the place where it ends, as a root of what has become negative:
            // what the model has there instead is finite, and no more than a stage or two stand there.
            self.evaluations += 1;
            return self.solved(state).map_err(EvaluationError::Solve);
        }
        solved.map_err(EvaluationError::Solve)
    }
}

impl<M: Constraints> RightHandSide<'_, '_, M> {
    /// Writes q̈ of four stages at once, where that is what each of them by itself would give: nobody is
    /// shown them, inputs are held, and nothing is solved for or added.
    #[inline(always)]
    fn accelerations_in_lanes(&mut self, t: Lanes, y: &Stages<M::Vector>, a: &mut WideOf<M>) -> bool {
        let plain = self.law.is_none() && self.listener.is_none() && self.branches == Branches::FREE;
        if !M::HAS_LANES || !plain || !(M::IS_FREE || self.stabilization.is_bare()) {
            return false;
        }
        let mut state = M::State::new(f64::NAN, M::Vector::zeros(), M::Vector::zeros(), self.held);
        *state.modes_mut() = self.modes;
        let found = self.model.accelerations_in_lanes(self.constants, &state, t, [&y.q, &y.u], a);
        self.evaluations += if found { lanes::COUNT as u64 } else { 0 };
        found
    }
}

/// A state on these branches.
#[inline(always)]
pub(crate) fn on<M: Constraints>(branches: Branches, state: &M::State) -> M::State {
    let mut state = *state;
    if M::HAS_KINKS {
        state.hold(branches);
    }
    state
}

fn is_finite(v: &impl Vector) -> bool {
    v.as_slice().iter().all(|x| x.is_finite())
}

/// Replaces the inputs of a state by what the law says, if there is one.
#[inline(always)]
pub(crate) fn with_inputs<M: Model>(law: Option<&InputLaw<'_, M>>, mut state: M::State) -> M::State {
    if let Some(law) = law {
        *state.inputs_mut() = law(state.t(), &state);
    }
    state
}

impl<M: Constraints> RightHandSide<'_, '_, M> {
    /// ∂q̈/∂q and ∂q̈/∂q̇ from generated code, with what an inputs law adds; false where there is none for
    /// what is integrated.
    fn exact_jacobian(
        &mut self,
        at: &StepNode<M::Vector>,
        by_q: &mut [f64],
        by_u: &mut [f64],
    ) -> Result<bool, EvaluationError> {
        if !self.stabilization.is_plain() {
            return Ok(false);
        }
        let state = self.stage(at.t, &at.y)?;
        if !self.model.acceleration_derivatives(&self.on_branches(&state), by_q, by_u) {
            return Ok(false);
        }
        let law = self.law;
        if law.is_some() && M::Inputs::LEN > 0 {
            self.add_law(&state, by_q, by_u)?;
        }
        Ok(by_q.iter().chain(by_u.iter()).all(|x| x.is_finite()))
    }

    /// What follows from inputs that depend on the state: by differences of the law, and of the accelerations
    /// along what it changes.
    fn add_law(
        &mut self,
        state: &M::State,
        by_q: &mut [f64],
        by_u: &mut [f64],
    ) -> Result<(), EvaluationError> {
        let n = M::Vector::LEN;
        let here = self.accelerations_of(state)?;
        for j in 0..2 * n {
            let mut moved = M::State::new(state.t(), *state.q(), *state.u(), self.held);
            *moved.modes_mut() = self.modes;
            let (elements, matrix) = match j < n {
                true => (moved.q_mut(), &mut *by_q),
                false => (moved.u_mut(), &mut *by_u),
            };
            let by = increment(elements[j % n], max_abs(elements.as_slice()));
            elements[j % n] += by;
            let inputs = *with_inputs::<M>(self.law, moved).inputs();
            if inputs == *state.inputs() {
                continue;
            }
            let mut other = *state;
            *other.inputs_mut() = inputs;
            let there = self.accelerations_of(&other)?;
            (0..n).for_each(|i| matrix[i * n + j % n] += (there[i] - here[i]) / by);
        }
        Ok(())
    }
}

/// What is asked of models with constraints at every stage or step: one copy of it for every method, a call
/// among hundreds of nanoseconds.
impl<M: Constraints> RightHandSide<'_, '_, M> {
    /// (q̇, q̈) at a stage.
    #[inline(never)]
    fn held_derivative(&mut self, t: f64, y: &Phase<M::Vector>) -> Result<Phase<M::Vector>, EvaluationError> {
        // Copies of a state are calls where it is long.
        let mut state = self.state(t, &y.q, &y.u);
        if self.stabilization.restores() {
            state = self.restored(state)?;
        }
        self.show(&state);
        Ok(Phase { q: *state.u(), u: self.accelerations_of(&state)? })
    }

    /// See [`Accelerations::begin_attempt`], of motions that are tied to their constraints.
    #[inline(never)]
    fn push_back(&mut self, start: &mut StepNode<M::Vector>, h: f64) -> Result<(), EvaluationError> {
        let state = self.on_branches(&self.state(start.t, &start.y.q, &start.y.u));
        self.stabilization.push_back(self.model, &state, h).map_err(EvaluationError::Solve)?;
        // What the step before took back is none of this one's.
        start.a = self.accelerations(start.t, &start.y.q, &start.y.u)?;
        Ok(())
    }

    /// See [`Stabilized::project`].
    #[inline(never)]
    fn projected(
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
        let noise = self.held(&mut state, project).map_err(EvaluationError::Solve)?;
        let projected = Phase { q: *state.q(), u: *state.u() };
        let moved = zip(&projected, y, |to, from| to - from);
        let by = tolerances.norm(&moved, y, &projected);
        self.stabilization.moved = Some(by);
        let mut violation = by;
        if by > INSPECTED_MOVE {
            // Near a singular position a small violation takes a large move, along the direction that the
            // constraints lose.
            let before = self.on_branches(&before);
            violation = self.stabilization.violation(self.model, &before, tolerances).max(by / WEAK).min(by);
        }
        *y = projected;
        let permitted = tolerances.absolute + tolerances.relative * max_abs(projected.u.as_slice());
        Ok(ProjectedEnd { by, violation, noise: noise / permitted })
    }
}
