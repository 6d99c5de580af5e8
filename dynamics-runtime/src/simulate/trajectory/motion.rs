//! A computed motion: states at any time, and all quantities that follow from a state.
//!
//! The record keeps the start of every step. To interpolate, the step is made again with the same stages and
//! the same branches, so that dense output has the order of the method.

use alloc::boxed::Box;
use alloc::sync::Arc;
use alloc::vec;
use alloc::vec::Vec;

use dynamics_view::suggest;

use crate::constrain;
use crate::integrate::{Accelerations as _, Dense as _, Hermite, Method, Phase, Step, StepNode};
use crate::linalg::max_abs;
use crate::model::{ModelState, SimulationModel, StaticTraits, Vector};
use crate::simulate::erased_method::{Interpolant, StepReplay};
use crate::simulate::failure::MotionError;
use crate::simulate::options::formulation::Formulation;
use crate::simulate::right_hand_side::{InputLaw, RightHandSide, with_inputs};
use crate::simulate::stabilization::Stabilization;
use crate::simulate::trajectory::global_error::GlobalError;
use crate::simulate::trajectory::record::{Counts, EventRecord, Record, Trajectory};

/// Velocities that are solved from constraints may differ from interpolated ones by this part of the speed. A
/// larger difference shows that rounding determines them, as right at a bifurcation.
const VELOCITY_DEVIATION: f64 = 0.01;

/// The motion of a model, as a simulation computed it.
///
/// It borrows the model. Times run from [`Motion::start_time`] to [`Motion::end_time`], which is the smaller
/// one where the motion was computed backwards.
pub struct Motion<'m, M: SimulationModel> {
    model: &'m M,
    constants: M::Constants,
    pub(crate) law: Option<InputLaw<'m, M>>,
    /// Shared with its [`MotionRecord`](crate::simulate::MotionRecord)s.
    pub(crate) trajectory: Arc<Trajectory<M>>,
}

impl<'m, M: SimulationModel> Motion<'m, M> {
    pub(crate) fn new(
        model: &'m M,
        constants: M::Constants,
        law: Option<InputLaw<'m, M>>,
        trajectory: Arc<Trajectory<M>>,
    ) -> Self {
        Self { model, constants, law, trajectory }
    }

    /// The model that moved.
    #[must_use]
    pub fn model(&self) -> &'m M {
        self.model
    }

    /// The state at the start.
    #[must_use]
    pub fn start(&self) -> M::State {
        self.complete(self.trajectory.first().state)
    }

    /// The state at the end.
    #[must_use]
    pub fn end(&self) -> M::State {
        self.complete(self.trajectory.last().state)
    }

    /// Time of the start.
    #[must_use]
    pub fn start_time(&self) -> f64 {
        self.trajectory.first().state.t()
    }

    /// Time of the end.
    #[must_use]
    pub fn end_time(&self) -> f64 {
        self.trajectory.last().state.t()
    }

    /// The state at time t, from the method's dense output; after a reset where t is the time of one.
    ///
    /// Outside the motion q, u and inputs are NaN: nothing is clamped. [`Motion::try_at`] gives an error
    /// there. Each call computes the stages of a step again; [`Motion::sample`] does so once per step.
    #[must_use]
    pub fn at(&self, t: f64) -> M::State {
        self.sampler().at(t)
    }

    /// The state at time t.
    pub fn try_at(&self, t: f64) -> Result<M::State, MotionError> {
        self.check_time(t)?;
        Ok(self.at(t))
    }

    /// The states at several times, at one set of stages per step where the times follow each other.
    pub fn sample<I: IntoIterator<Item = f64>>(
        &self,
        times: I,
    ) -> impl Iterator<Item = M::State> + use<'_, 'm, M, I> {
        let mut sampler = self.sampler();
        times.into_iter().map(move |t| sampler.at(t))
    }

    /// Evaluates states at times of one's choosing, at one set of stages per step where the times follow each
    /// other.
    #[must_use]
    pub fn sampler(&self) -> Sampler<'_, 'm, M> {
        Sampler { motion: self, cached: None, stabilization: None, replay: None }
    }

    /// A sampler for passes over all steps in order. It keeps the state of the method from one step to the
    /// next, which saves implicit methods most of their matrices. So states depend on the order of the calls,
    /// by about a hundredth of the permitted error, as Newton's iterations end differently.
    pub(crate) fn reader(&self) -> Sampler<'_, 'm, M> {
        Sampler { replay: Some(None), ..self.sampler() }
    }

    /// The states at the requested output times, or after every accepted step where none were requested.
    pub fn states(&self) -> impl Iterator<Item = M::State> + use<'_, 'm, M> {
        let times = self.trajectory.output_times.as_ref();
        let end = self.end_time();
        let direction = self.trajectory.direction();
        // A motion may end before the last requested time.
        let reached =
            times.map(|times| times.iter().copied().take_while(move |t| direction * (end - t) >= 0.0));
        let at_times = reached.into_iter().flat_map(|times| self.sample(times));
        let steps = if times.is_some() { 0 } else { self.trajectory.records.len() };
        at_times.chain(self.steps().take(steps))
    }

    /// The accepted states, start and end included. At a reset the same time comes twice: before and after.
    pub fn steps(&self) -> impl ExactSizeIterator<Item = M::State> + use<'_, 'm, M> {
        self.trajectory.records.iter().map(|record| self.complete(record.state))
    }

    /// q̈ at time t; NaN outside the motion and where they do not exist.
    #[must_use]
    pub fn accelerations_at(&self, t: f64) -> M::Vector {
        self.accelerations_of(&self.at(t))
    }

    /// q̈ at a state of the motion; NaN where they do not exist.
    #[must_use]
    pub fn accelerations_of(&self, state: &M::State) -> M::Vector {
        self.model.accelerations_with(&self.constants, state).unwrap_or_else(|_| nan())
    }

    /// Time jets of the coordinates at time t, accelerations included: what helper functions and drawings
    /// take.
    #[must_use]
    pub fn coordinates_at(&self, t: f64) -> M::Coordinates {
        self.coordinates_of(&self.at(t))
    }

    /// Time jets of the coordinates at a state of the motion, with the multipliers of its constraints.
    #[must_use]
    pub fn coordinates_of(&self, state: &M::State) -> M::Coordinates {
        if M::IS_UNCONSTRAINED {
            return M::coordinates_with(state, &self.accelerations_of(state), &[]);
        }
        match constrain::solve_once(self.model, &self.constants, state) {
            Ok(solved) => M::coordinates_with(state, &solved.accelerations, solved.multipliers.as_slice()),
            Err(_) => M::coordinates_with(state, &nan(), nan::<M::Rows>().as_slice()),
        }
    }

    /// λ of all rows at time t in their order; 0 for constraints that are released there, NaN outside the
    /// motion and where there are none.
    ///
    /// Where constraints repeat each other λ is not unique: those of least norm are given (see
    /// [`crate::constrain::RankDiagnosis`]).
    #[must_use]
    pub fn multipliers_at(&self, t: f64) -> M::Rows {
        self.multipliers_of(&self.at(t))
    }

    /// λ of all rows at a state of the motion; NaN where there are none.
    #[must_use]
    pub fn multipliers_of(&self, state: &M::State) -> M::Rows {
        let not_a_number = |v: &[f64]| v.iter().any(|x| x.is_nan());
        if not_a_number(state.q().as_slice()) || not_a_number(state.u().as_slice()) {
            return nan();
        }
        constrain::solve_once(self.model, &self.constants, state)
            .map_or_else(|_| nan(), |solved| solved.multipliers)
    }

    /// λ of a named constraint at time t, by its rows: the force that pushes toward growing Φ.
    pub fn reaction_at(&self, name: &str, t: f64) -> Result<Vec<f64>, MotionError> {
        self.check_time(t)?;
        self.reaction_of(name, &self.at(t))
    }

    /// λ of a named constraint at a state of the motion, by its rows.
    pub fn reaction_of(&self, name: &str, state: &M::State) -> Result<Vec<f64>, MotionError> {
        let Some(constraint) = M::CONSTRAINTS.iter().find(|constraint| constraint.name == name) else {
            let suggestion = suggest(name, M::CONSTRAINTS.iter().map(|constraint| constraint.name));
            return Err(MotionError::UnknownConstraint { name: name.into(), suggestion });
        };
        let solved = constrain::solve_once(self.model, &self.constants, state).map_err(MotionError::Solve)?;
        let rows = constraint.first..constraint.first + constraint.rows;
        let multipliers = &solved.multipliers.as_slice()[rows];
        constrain::check_inputs::<M>(state, multipliers).map_err(MotionError::Solve)?;
        Ok(multipliers.to_vec())
    }

    /// Energy function E = q̇·∂L/∂q̇ − L at time t; NaN outside the motion.
    #[must_use]
    pub fn energy_at(&self, t: f64) -> f64 {
        self.model.energy_function(&self.at(t))
    }

    /// A named output at time t.
    pub fn output(&self, name: &str, t: f64) -> Result<f64, MotionError> {
        let Some(index) = M::OUTPUTS.iter().position(|output| output.name == name) else {
            let suggestion = suggest(name, M::OUTPUTS.iter().map(|output| output.name));
            return Err(MotionError::UnknownOutput { name: name.into(), suggestion });
        };
        self.check_time(t)?;
        let mut values = vec![0.0; M::OUTPUTS.len()];
        self.model.outputs(&self.at(t), &mut values).map_err(MotionError::Solve)?;
        Ok(values[index])
    }

    /// All outputs at time t in the order of the model; NaN outside the motion.
    #[must_use]
    pub fn outputs_at(&self, t: f64) -> Vec<f64> {
        self.outputs_of(&self.at(t))
    }

    /// All outputs at a state of the motion; NaN where they do not exist.
    #[must_use]
    pub fn outputs_of(&self, state: &M::State) -> Vec<f64> {
        let mut values = vec![0.0; M::OUTPUTS.len()];
        if self.model.outputs(state, &mut values).is_err() {
            values.fill(f64::NAN);
        }
        values
    }

    /// The events that happened, in order: those of the model and those declared with `.event(..)`.
    #[must_use]
    pub fn events(&self) -> &[EventRecord<M::State>] {
        &self.trajectory.events
    }

    /// The method that computed it, or its first part: see [`Motion::switched`].
    #[must_use]
    pub fn method(&self) -> Method {
        self.trajectory
            .erased_method
            .as_ref()
            .map_or(Method::PositionAnalysis, |erased_method| erased_method.method())
    }

    /// When and to which method the run went over, because the motion was stiff for the one that was chosen
    /// by itself.
    #[must_use]
    pub fn switched(&self) -> Option<(f64, Method)> {
        self.trajectory.relay.as_ref().map(|(from, erased_method)| (*from, erased_method.method()))
    }

    /// What it cost.
    #[must_use]
    pub fn counts(&self) -> Counts {
        self.trajectory.counts
    }

    /// Its error by a second run; `None` where
    /// [`Simulation::estimate_error`](crate::simulate::Simulation::estimate_error) did not ask for one.
    #[must_use]
    pub fn global_error(&self) -> Option<&GlobalError> {
        self.trajectory.error.as_deref()
    }

    fn check_time(&self, time: f64) -> Result<(), MotionError> {
        let (start, end) = (self.start_time(), self.end_time());
        self.trajectory.find(time).map(|_| ()).ok_or(MotionError::OutOfRange { time, start, end })
    }

    /// Adds the inputs of the law.
    // Public for dynamics-analysis alone.
    #[doc(hidden)]
    #[must_use]
    pub fn complete(&self, mut state: M::State) -> M::State {
        if self.trajectory.has_law && self.law.is_none() {
            state.inputs_mut().as_mut_slice().fill(f64::NAN);
        }
        with_inputs::<M>(self.law.as_ref(), state)
    }

    /// Whether inputs come from a law.
    // Public for dynamics-analysis alone.
    #[doc(hidden)]
    #[must_use]
    pub fn has_law(&self) -> bool {
        self.trajectory.has_law
    }

    /// Whether its steps were of a fixed size, so that none of them ends where the model changes its branch.
    // Public for dynamics-analysis alone.
    #[doc(hidden)]
    #[must_use]
    pub fn is_fixed(&self) -> bool {
        self.trajectory.fixed
    }

    /// What depends on parameters alone.
    // Public for dynamics-analysis alone.
    #[doc(hidden)]
    #[must_use]
    pub fn constants(&self) -> &M::Constants {
        &self.constants
    }

    /// The right-hand side as it was during the step of a record.
    pub(crate) fn rhs(&self, index: usize) -> RightHandSide<'_, 'm, M> {
        self.rhs_in(index, Vec::new())
    }

    /// The same, in a workspace that [`Stabilization::into_workspace`] of another one returned.
    pub(crate) fn rhs_in(&self, index: usize, workspace: Vec<f64>) -> RightHandSide<'_, 'm, M> {
        let Record { state, mean_sensitivity, correction_time, .. } = &self.trajectory.records[index];
        let mut stabilization = self.stabilization(*mean_sensitivity, workspace);
        stabilization.replay_correction_time(*correction_time);
        RightHandSide::new(self.model, &self.constants, self.law.as_ref(), state, stabilization)
    }

    fn stabilization(&self, mean_sensitivity: Option<f64>, workspace: Vec<f64>) -> Stabilization<M> {
        let run = (self.start_time(), self.end_time());
        let mut stabilization =
            Stabilization::with_workspace(self.formulation(), f64::INFINITY, self.constants, run, workspace);
        stabilization.mean_sensitivity = mean_sensitivity;
        stabilization.is_under_way = true;
        stabilization
    }

    /// How constraints were kept; `None` for models without constraints.
    #[must_use]
    pub fn formulation(&self) -> Option<Formulation> {
        self.trajectory.formulation.as_ref().map(|(formulation, _)| *formulation)
    }

    /// Whether steps can be made again: not where the inputs law was lost with a failed simulation.
    pub(crate) fn is_repeatable(&self) -> bool {
        !self.trajectory.has_law || self.law.is_some()
    }

    pub(crate) fn step(&self, index: usize) -> Step<M::Vector> {
        let [from, to] = [0, 1].map(|i| &self.trajectory.records[index + i]);
        Step { start: from.knot(), end: to.knot(), h: from.h, flags: from.flags }
    }

    /// The interpolant of the step of a record. `replay`: the state of the method after the step before, if
    /// it was kept.
    fn interpolant(&self, index: usize, replay: &mut Option<ReplayState<M>>) -> CachedInterpolant<M::Vector> {
        let step = self.step(index);
        let (mut step_replay, workspace) = match replay.take() {
            Some(ReplayState { step_replay, next, workspace }) => {
                (step_replay.filter(|_| next == index), workspace)
            }
            None => (None, Vec::new()),
        };
        let mut rhs = self.rhs_in(index, workspace);
        let tolerances = &self.trajectory.tolerances;
        let erased_method = self.trajectory.erased_method_of(index).filter(|_| self.is_repeatable());
        let remade = erased_method.and_then(|erased_method| {
            let judged = !self.trajectory.fixed;
            step_replay
                .get_or_insert_with(|| erased_method.step_replay())
                .interpolate(&mut rhs, &step, tolerances, judged)
        });
        // The state of the method is useless after a reset, with other constraints or another method.
        let step_replay = step_replay.filter(|_| remade.is_some() && self.is_followed_alike(index));
        let interpolant = match remade {
            Some(remade) if !rhs.interpolant_strays(&*remade, &step, tolerances) => remade,
            remade => self.interpolant_of_ends(&mut rhs, &step, remade),
        };
        let projects = M::IS_CONSTRAINED && rhs.projects_between(&*interpolant, &step, tolerances);
        *replay =
            Some(ReplayState { step_replay, next: index + 1, workspace: rhs.stabilization.into_workspace() });
        CachedInterpolant { index, interpolant, projects }
    }

    /// Whether the step of a record is followed by one of the same method with the same constraints.
    fn is_followed_alike(&self, index: usize) -> bool {
        let [here, next] = [0, 1].map(|i| &self.trajectory.records[index + i]);
        let methods = [0, 1]
            .map(|i| self.trajectory.erased_method_of(index + i).map(|erased_method| erased_method.method()));
        next.h != 0.0 && here.state.active_set() == next.state.active_set() && methods[0] == methods[1]
    }

    /// The interpolant of a step by its ends alone. It is used where the step cannot be made again, as where
    /// an inputs closure returns other values, or where a stage lies next to a singular position, unless the
    /// step that was made again (`remade`) is nearer to the constraints.
    #[cold]
    fn interpolant_of_ends(
        &self,
        rhs: &mut RightHandSide<'_, '_, M>,
        step: &Step<M::Vector>,
        remade: Option<Interpolant<M::Vector>>,
    ) -> Interpolant<M::Vector> {
        let Step { start, end, h, .. } = step;
        let mut first = *start;
        if !self.is_repeatable() || rhs.begin_attempt(&mut first, *h).is_err() {
            first = *start;
        }
        let quintic = Hermite::between(&first, end, *h);
        let tolerances = &self.trajectory.tolerances;
        match remade {
            Some(remade)
                if rhs.violation_between(&*remade, step, tolerances)
                    <= rhs.violation_between(&quintic, step, tolerances) =>
            {
                remade
            }
            _ => Box::new(quintic),
        }
    }
}

fn nan<V: Vector>() -> V {
    let mut out = V::zeros();
    out.as_mut_slice().fill(f64::NAN);
    out
}

/// The interpolant of the step of a record, and whether its states have to be projected.
struct CachedInterpolant<V> {
    index: usize,
    interpolant: Interpolant<V>,
    projects: bool,
}

/// States of a motion at times of one's choosing; remembers the interpolant of the last step.
pub struct Sampler<'a, 'm, M: SimulationModel> {
    motion: &'a Motion<'m, M>,
    cached: Option<CachedInterpolant<M::Vector>>,
    /// Projects states onto the constraints, where `.consistent_output()` or the step requires it.
    stabilization: Option<Stabilization<M>>,
    /// State of the method after the last step: `None` where it is not to be kept.
    replay: Option<Option<ReplayState<M>>>,
}

/// State of the method after a step that was made again, the index of the step that it can go on with, and
/// the workspace of the constraint stabilization.
struct ReplayState<M: SimulationModel> {
    step_replay: Option<Box<dyn StepReplay<M>>>,
    next: usize,
    workspace: Vec<f64>,
}

impl<'a, 'm, M: SimulationModel> Sampler<'a, 'm, M> {
    pub(crate) fn motion(&self) -> &'a Motion<'m, M> {
        self.motion
    }

    /// [`Trajectory::find`], without a search where times follow each other.
    fn find(&self, t: f64) -> Option<usize> {
        let trajectory = &self.motion.trajectory;
        let direction = trajectory.direction();
        let here = self.cached.as_ref().map(|cached| cached.index).filter(|&index| {
            let times = [0, 1].map(|i| trajectory.records[index + i].state.t());
            direction * (times[0] - t) <= 0.0 && direction * (times[1] - t) > 0.0
        });
        here.or_else(|| trajectory.find(t))
    }

    /// The state at time t, as [`Motion::at`] gives it.
    pub fn at(&mut self, t: f64) -> M::State {
        let trajectory = &self.motion.trajectory;
        let Some(index) = self.find(t) else {
            let mut inputs = M::Inputs::zeros();
            inputs.as_mut_slice().fill(f64::NAN);
            return M::State::new(t, nan(), nan(), inputs);
        };
        let Record { state, h, .. } = trajectory.records[index];
        if h == 0.0 || state.t() == t {
            return self.motion.complete(state);
        }
        if self.cached.as_ref().is_none_or(|cached| cached.index != index) {
            self.cached = Some(self.motion.interpolant(index, self.replay.as_mut().unwrap_or(&mut None)));
        }
        let (mut between, projected) = self.between(index, t);
        if M::IS_UNCONSTRAINED {
            // Without constraints the interpolant is exact enough.
        } else if !projected && let Some(y) = self.bridge_singularity(index, (t - state.t()) / h) {
            (*between.q_mut(), *between.u_mut()) = (y.q, y.u);
        }
        self.motion.complete(between)
    }

    /// The state within the step of a record, and whether a projection that was required succeeded.
    fn between(&mut self, index: usize, t: f64) -> (M::State, bool) {
        let trajectory = &self.motion.trajectory;
        let Record { state, h, mean_sensitivity, .. } = trajectory.records[index];
        let CachedInterpolant { interpolant, projects, .. } =
            self.cached.as_ref().expect("the caller has stored it");
        // A time before the start by rounding is the start.
        let y = interpolant.at(((t - state.t()) / h).max(0.0));
        let mut between = M::State::new(t, y.q, y.u, *state.inputs());
        *between.active_set_mut() = state.active_set();
        if !(trajectory.consistent || *projects) || M::IS_UNCONSTRAINED {
            return (between, true);
        }
        let stabilization =
            self.stabilization.get_or_insert_with(|| self.motion.stabilization(mean_sensitivity, Vec::new()));
        stabilization.mean_sensitivity = mean_sensitivity;
        // Constraints may contain inputs; the closure reads those that are held.
        let mut projected = self.motion.complete(between);
        let mut done =
            stabilization.project_between(self.motion.model, &mut projected, &trajectory.tolerances);
        if trajectory.erased_method.is_none() {
            // In position analysis velocities follow from constraints. Right at a bifurcation rounding
            // determines them.
            let speed = max_abs(y.u.as_slice()) + max_abs(state.u().as_slice());
            let apart =
                projected.u().as_slice().iter().zip(y.u.as_slice()).map(|(to, from)| (to - from).abs());
            done &= apart.fold(0.0, f64::max) <= VELOCITY_DEVIATION * speed;
        }
        (*between.q_mut(), *between.u_mut()) = (*projected.q(), *projected.u());
        (between, done)
    }

    /// The state right at a singular position, where rounding determines a projection: interpolated between
    /// states on both sides, with their accelerations.
    #[cold]
    fn bridge_singularity(&mut self, index: usize, theta: f64) -> Option<Phase<M::Vector>> {
        const WIDTHS: [f64; 3] = [0.01, 0.03, 0.09];
        let Record { state: start, h, .. } = self.motion.trajectory.records[index];
        WIDTHS.iter().find_map(|width| {
            let (a, b) = ((theta - width).max(0.0), (theta + width).min(1.0));
            let [from, to] = [a, b].map(|part| {
                let (state, projected) = self.between(index, start.t() + part * h);
                let state = self.motion.complete(state);
                let node = StepNode {
                    t: state.t(),
                    y: Phase { q: *state.q(), u: *state.u() },
                    a: self.motion.accelerations_of(&state),
                };
                (projected && node.a.as_slice().iter().all(|a| a.is_finite())).then_some(node)
            });
            let (from, to) = (from?, to?);
            Some(Hermite::between(&from, &to, (b - a) * h).at((theta - a) / (b - a)))
        })
    }
}

/// Its summary.
impl<M: SimulationModel> core::fmt::Display for Motion<'_, M> {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        core::fmt::Display::fmt(&self.summary(), f)
    }
}

impl<M: SimulationModel> core::fmt::Debug for Motion<'_, M> {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.debug_struct("Motion")
            .field("model", &M::NAME)
            .field("method", &self.method())
            .field("start", &self.start())
            .field("end", &self.end())
            .field("counts", &self.counts())
            .finish_non_exhaustive()
    }
}
