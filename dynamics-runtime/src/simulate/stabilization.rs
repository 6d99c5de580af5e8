//! Constraint stabilization of a run: how Φ = 0 and Φ̇ = 0 are kept, by its [`Formulation`].
//!
//! Every evaluation solves M q̈ = Q + Φ_qᵀλ, Φ_q q̈ = γ by [`crate::constrain`]. Steps leave errors
//! in Φ and Φ̇. What becomes of them depends on the formulation:
//!
//! | formulation | what happens | file |
//! |---|---|---|
//! | projected, embedded | ends of steps, or stages too, are moved onto the constraints | `projection.rs` |
//! | Baumgarte | γ − 2αΦ̇ − β²Φ at every evaluation | [`Stabilization::accelerations`] |
//! | Baumgarte, tied gains | a correction that is constant within a step | `adaptive_gain.rs` |
//! | augmented, Baumgarte | the drift and its influence on the motion are watched | `drift_inspection.rs` |
//!
//! `initial_consistency.rs` checks starts and what actions leave. `contacts.rs` decides which contacts take
//! part in an impact. `singular_start.rs` finds accelerations where rank is lost. The tolerance reaches the
//! constraints in three places: at ends of steps in `RightHandSide::project_end` (`right_hand_side.rs`),
//! which compares the move of the projection with it; in [`Stabilization::violation`]; and in
//! `projection.rs`, for stages and states between. Solving and projecting themselves are in
//! [`crate::constrain`], and errors of this module become messages in [`crate::simulate::failure`].

pub(crate) mod adaptive_gain;
pub(crate) mod contacts;
pub(crate) mod counts;
pub(crate) mod drift_inspection;
pub(crate) mod initial_consistency;
pub(crate) mod near_singular;
pub(crate) mod projection;
pub(crate) mod singular_start;

use alloc::vec::Vec;

pub(crate) use crate::simulate::stabilization::contacts::ContactHistory;
pub use crate::simulate::stabilization::counts::StabilizationCounts;
pub(crate) use crate::simulate::stabilization::drift_inspection::{DriftVerdict, Drifted};
pub(crate) use crate::simulate::stabilization::initial_consistency::ConsistencyError;

use crate::constrain::active_set::{active_rows, holds};
use crate::constrain::assemble::{CONSISTENT, size_along};
use crate::constrain::{self, DiagnosedAccelerations, Gradients, RankDiagnosis};
use crate::error::SolveError;
use crate::integrate::{Phase, Tolerances, zip};
use crate::linalg::max_abs;
use crate::math;
use crate::model::{Constraint, Constraints, ModelState, StaticTraits, Vector};
use crate::simulate::failure::SimulationErrorKind;
use crate::simulate::options::formulation::Formulation;
use crate::simulate::stabilization::adaptive_gain::CorrectionTime;

/// Difference between the limit of the accelerations along a branch and those of least norm above which the
/// limit is taken, in parts of |q̈| + |q̇|². The limit has fewer digits: at a distance x from the singular
/// position its rounding is ε/x³. A smaller bound would replace good accelerations by their noisy limit; a
/// larger one would keep accelerations that belong to no branch.
const BRANCH_LIMIT_DIFFERENCE: f64 = 1e-5;

/// What steps change in a [`Stabilization`], so that a trial step can be undone.
pub(crate) struct StabilizationSnapshot<M: Constraints> {
    counts: StabilizationCounts,
    step_correction: M::Vector,
    correction_time: CorrectionTime,
    last_inspection: Option<drift_inspection::DriftInspection<M::Rows>>,
    mean_sensitivity: Option<f64>,
    latest_sensitivity: Option<f64>,
    latest_move: Option<f64>,
    stage_tolerances: Option<Tolerances>,
}

/// Keeps the constraints of one run. Its workspace is allocated once.
pub(crate) struct Stabilization<M: Constraints> {
    pub(crate) formulation: Option<Formulation>,
    pub(crate) counts: StabilizationCounts,
    /// Baumgarte's α and β where they are fixed, else 0. α has the sign of the run's direction in time.
    gains: (f64, f64),
    /// Accelerations that tied gains add throughout the step that is being made.
    step_correction: M::Vector,
    correction_time: CorrectionTime,
    drift_limit: f64,
    /// Lower bound of the size of all rows, once it was computed.
    least_size: Option<f64>,
    /// The last full inspection of the drift.
    last_inspection: Option<drift_inspection::DriftInspection<M::Rows>>,
    /// The contacts of the run, which take part in every impact where they touch.
    pub(crate) contacts: Vec<ContactHistory>,
    /// Geometric mean of the sensitivities of the projections that ended the steps so far. It does not change
    /// during a step, nor between its attempts and its interpolant, so that the step can be repeated exactly.
    pub(crate) mean_sensitivity: Option<f64>,
    /// Sensitivity of the projection that ended the last attempted step.
    latest_sensitivity: Option<f64>,
    constants: M::Constants,
    /// Size of the move that projected the end of the last attempted step, in permitted errors.
    pub(crate) latest_move: Option<f64>,
    /// Tolerances to which stages of steps are projected, too; `None` where the formulation does not ask for
    /// it or projects to rounding level.
    stage_tolerances: Option<Tolerances>,
    /// Whether the start has been treated, so that lost rank is met by the motion and not by its start.
    pub(crate) is_under_way: bool,
    workspace: Vec<f64>,
}

impl<M: Constraints> Stabilization<M> {
    /// For a run between two times, in this order.
    pub(crate) fn new(
        formulation: Option<Formulation>,
        drift_limit: f64,
        constants: M::Constants,
        run: (f64, f64),
    ) -> Self {
        Self::with_workspace(formulation, drift_limit, constants, run, Vec::new())
    }

    /// As [`Stabilization::new`], with the [workspace](Stabilization::into_workspace) of another one.
    pub(crate) fn with_workspace(
        formulation: Option<Formulation>,
        drift_limit: f64,
        constants: M::Constants,
        (from, to): (f64, f64),
        mut workspace: Vec<f64>,
    ) -> Self {
        // A term that damps in one direction of time drives in the other.
        let direction = if to < from { -1.0 } else { 1.0 };
        let gains = match formulation {
            Some(Formulation::Baumgarte { alpha, beta }) => (direction * alpha, beta),
            _ => (0.0, 0.0),
        };
        let len = constrain::workspace_len(M::COORDINATES.len(), M::ROWS.len());
        workspace.resize(if M::IS_UNCONSTRAINED { 0 } else { len }, 0.0);
        Self {
            formulation,
            counts: StabilizationCounts::default(),
            gains,
            step_correction: M::Vector::zeros(),
            correction_time: CorrectionTime::default(),
            drift_limit,
            least_size: None,
            last_inspection: None,
            contacts: Vec::new(),
            mean_sensitivity: None,
            latest_sensitivity: None,
            constants,
            latest_move: None,
            stage_tolerances: None,
            is_under_way: false,
            workspace,
        }
    }

    /// What steps have changed so far, to undo a trial step by [`Stabilization::restore_snapshot`].
    pub(crate) fn snapshot(&self) -> StabilizationSnapshot<M> {
        StabilizationSnapshot {
            counts: self.counts,
            step_correction: self.step_correction,
            correction_time: self.correction_time,
            last_inspection: self.last_inspection,
            mean_sensitivity: self.mean_sensitivity,
            latest_sensitivity: self.latest_sensitivity,
            latest_move: self.latest_move,
            stage_tolerances: self.stage_tolerances,
        }
    }

    /// Undoes what steps have changed since the snapshot.
    pub(crate) fn restore_snapshot(&mut self, snapshot: StabilizationSnapshot<M>) {
        self.counts = snapshot.counts;
        self.step_correction = snapshot.step_correction;
        self.correction_time = snapshot.correction_time;
        self.last_inspection = snapshot.last_inspection;
        self.mean_sensitivity = snapshot.mean_sensitivity;
        self.latest_sensitivity = snapshot.latest_sensitivity;
        self.latest_move = snapshot.latest_move;
        self.stage_tolerances = snapshot.stage_tolerances;
    }

    /// Its workspace, for another one.
    pub(crate) fn into_workspace(self) -> Vec<f64> {
        self.workspace
    }

    /// Lends its workspace. Nothing else may be asked of it until the workspace is returned.
    pub(crate) fn lend_workspace(&mut self) -> Vec<f64> {
        core::mem::take(&mut self.workspace)
    }

    /// Returns what [`Stabilization::lend_workspace`] lent.
    pub(crate) fn return_workspace(&mut self, workspace: Vec<f64>) {
        self.workspace = workspace;
    }

    /// Whether Baumgarte's gains follow the step size.
    #[inline(always)]
    pub(crate) fn has_tied_gains(&self) -> bool {
        self.formulation == Some(Formulation::BaumgarteTied)
    }

    /// Whether accelerations are those of the model at the given state: no gains are added and stages are not
    /// projected.
    pub(crate) fn uses_model_accelerations(&self) -> bool {
        matches!(self.formulation, None | Some(Formulation::Augmented | Formulation::Projected))
    }

    /// Whether [`Self::accelerations`] equals the model's own code at the given state, so that four states
    /// can be evaluated at once.
    #[inline(always)]
    pub(crate) fn adds_nothing(&self) -> bool {
        let is_plain = self.gains == (0.0, 0.0) && !self.weighs_all_rows();
        is_plain && !self.has_tied_gains() && !self.projects_stages()
    }

    /// The part of a small change of a state that is tangent to the constraints. Projection leaves only this.
    pub(crate) fn tangential_part(
        &mut self,
        model: &M,
        state: &M::State,
        change: &Phase<M::Vector>,
    ) -> Result<Phase<M::Vector>, SolveError> {
        let q = self.inadmissible_part(model, state, &change.q, M::Residual::LEN)?;
        let u = self.inadmissible_part(model, state, &change.u, M::Rows::LEN)?;
        Ok(zip(change, &Phase { q, u }, |change, inadmissible| change - inadmissible))
    }

    /// The part of a change δ of positions or velocities, along M⁻¹Φ_qᵀ, that the first `rows` rows
    /// forbid: what is left of δ has Φ_q δ = 0.
    pub(crate) fn inadmissible_part(
        &mut self,
        model: &M,
        state: &M::State,
        change: &M::Vector,
        rows: usize,
    ) -> Result<M::Vector, SolveError> {
        let jacobian = Gradients::of(model, state, &mut self.workspace).rows;
        let mut rates = M::Rows::zeros();
        let gradients = jacobian.chunks_exact(M::Vector::LEN).zip(rates.as_mut_slice()).enumerate();
        for (row, (gradient, rate)) in gradients.take(rows) {
            if holds::<M>(state.active_set(), row) {
                *rate = gradient.iter().zip(change.as_slice()).map(|(a, b)| a * b).sum();
            }
        }
        constrain::correct(model, &self.constants, state, &rates, &mut self.workspace)
    }

    /// One correction δ of positions towards Φ = 0, with Φ_q δ = −Φ, and A δ = −`rate` (A q̇ + b)
    /// for rows that bind velocities.
    pub(crate) fn correction_towards(
        &mut self,
        model: &M,
        state: &M::State,
        rate: f64,
    ) -> Result<M::Vector, SolveError> {
        let (position, mut right) = (model.residual(state), model.velocity_residual(state));
        for (row, right) in right.as_mut_slice().iter_mut().enumerate() {
            *right = match holds::<M>(state.active_set(), row) {
                true if row < M::Residual::LEN => -position[row],
                true => -rate * *right,
                false => 0.0,
            };
        }
        constrain::correct(model, &self.constants, state, &right, &mut self.workspace)
    }

    /// Violation of the worst row, |Φ|/‖Φ_q‖ or |Φ̇|/‖Φ_q‖, in permitted errors:
    /// absolute + relative · max |q|, or max |q̇|. Infinite where a residual is not a number.
    #[cold]
    pub(crate) fn violation(&mut self, model: &M, state: &M::State, tolerances: &Tolerances) -> f64 {
        let (position, velocity) = (model.residual(state), model.velocity_residual(state));
        let permitted =
            |values: &M::Vector| tolerances.absolute + tolerances.relative * max_abs(values.as_slice());
        let (of_q, of_u) = (permitted(state.q()), permitted(state.u()));
        let distances = Distances::of(model, state, &mut self.workspace);
        active_rows::<M>(state.active_set(), false).fold(0.0f64, |worst, row| {
            let of_row = |residual: f64, permitted: f64| distances.distance(row, residual) / permitted;
            let at = if row < M::Residual::LEN { of_row(position[row], of_q) } else { 0.0 };
            let of_row = math::max(at, of_row(velocity[row], of_u));
            if of_row.is_nan() { f64::INFINITY } else { worst.max(of_row) }
        })
    }

    /// Sets what tied gains add to the accelerations throughout a step of length h from this state: Φ_q
    /// a = −(3/2 Φ̇ + Φ/τ)/τ, and A a = −(A q̇ + b)/τ for rows that bind velocities. τ is that of
    /// [`CorrectionTime`].
    pub(crate) fn set_step_correction(
        &mut self,
        model: &M,
        state: &M::State,
        h: f64,
    ) -> Result<(), SolveError> {
        let (position, mut right) = (model.residual(state), model.velocity_residual(state));
        let tau = self.correction_time.of_step(state.t(), h.abs()).copysign(h);
        for (row, right) in right.as_mut_slice().iter_mut().enumerate() {
            *right = if row < M::Residual::LEN {
                -(1.5 * *right + position[row] / tau) / tau
            } else {
                -*right / tau
            };
        }
        self.step_correction =
            constrain::correct(model, &self.constants, state, &right, &mut self.workspace)?;
        Ok(())
    }

    /// The time τ in which tied gains correct the drift, in the last attempted step.
    pub(crate) fn correction_time(&self) -> f64 {
        self.correction_time.tau
    }

    /// Repeats steps with the correction time with which they were made.
    pub(crate) fn replay_correction_time(&mut self, tau: f64) {
        self.correction_time.replayed = tau;
    }

    /// Whether the ends of steps are projected.
    #[inline(always)]
    pub(crate) fn projects(&self) -> bool {
        self.formulation.is_some_and(Formulation::is_exact)
    }

    /// λ at a state.
    pub(crate) fn reactions(
        &mut self,
        model: &M,
        constants: &M::Constants,
        state: &M::State,
    ) -> Result<M::Rows, SolveError> {
        constrain::solve(model, constants, state, &mut self.workspace).map(|solved| solved.multipliers)
    }

    /// Whether accelerations depend on the side to which a constraint is released: whether they differ by
    /// more than the part `negligible` of 1 + |q̈|. True also where they fail.
    pub(crate) fn side_matters(
        &mut self,
        model: &M,
        constants: &M::Constants,
        state: &M::State,
        switch: usize,
        negligible: f64,
    ) -> bool {
        let [one, other] = [1.0, -1.0].map(|side| {
            let mut state = *state;
            state.active_set_mut().release(switch, side);
            constrain::accelerate(model, constants, &state, &mut self.workspace)
        });
        let (Ok(one), Ok(other)) = (one, other) else { return true };
        let (one, other) = (one.accelerations, other.accelerations);
        let size = negligible * (1.0 + max_abs(one.as_slice()));
        // Differences that are not a number count as different.
        !one.as_slice().iter().zip(other.as_slice()).all(|(one, other)| (one - other).abs() <= size)
    }

    /// Change of the slip rate d/dt (A q̇ + b) of a constraint of one row if it were released to the other
    /// side; `None` where accelerations fail.
    pub(crate) fn slip_rate_change_on_other_side(
        &mut self,
        model: &M,
        constants: &M::Constants,
        state: &M::State,
        (constraint, switch): (&Constraint, usize),
    ) -> Option<f64> {
        let side = state.active_set().side(switch);
        let mut accelerations = |side: f64| {
            let mut state = *state;
            state.active_set_mut().release(switch, side);
            constrain::accelerate(model, constants, &state, &mut self.workspace)
                .ok()
                .map(|solved| solved.accelerations)
        };
        let (here, there) = (accelerations(side)?, accelerations(-side)?);
        let gradients = self.gradients(model, state);
        let row = gradients.row(constraint.first).iter().enumerate();
        Some(row.map(|(j, x)| x * (there[j] - here[j])).sum())
    }

    /// Whether all stages are projected to rounding level.
    #[inline(always)]
    pub(crate) fn embeds(&self) -> bool {
        self.formulation == Some(Formulation::Embedded)
    }

    /// q̈ of the constrained model.
    #[inline(always)]
    pub(crate) fn accelerations(
        &mut self,
        model: &M,
        constants: &M::Constants,
        state: &M::State,
    ) -> Result<M::Vector, SolveError> {
        let is_plain = self.gains == (0.0, 0.0) && !self.weighs_all_rows();
        let unrolled = if is_plain { model.accelerate_unrolled(constants, state) } else { None };
        let mut accelerations = match unrolled {
            Some(accelerations) => accelerations,
            None => self.general_accelerations(model, constants, state, is_plain)?,
        };
        if self.has_tied_gains() {
            for (a, step_correction) in
                accelerations.as_mut_slice().iter_mut().zip(self.step_correction.as_slice())
            {
                *a += step_correction;
            }
        }
        Ok(accelerations)
    }

    /// q̈ with Baumgarte's gains, or if `is_plain` by the general solver alone.
    #[inline(never)]
    fn general_accelerations(
        &mut self,
        model: &M,
        constants: &M::Constants,
        state: &M::State,
        is_plain: bool,
    ) -> Result<M::Vector, SolveError> {
        let workspace = &mut self.workspace;
        let DiagnosedAccelerations { accelerations, diagnosis } = match is_plain {
            true => constrain::solve_general(model, state, workspace)?.into(),
            false => constrain::solve_baumgarte(model, constants, state, self.gains, workspace)?,
        };
        let Some(diagnosis) = &diagnosis else { return Ok(accelerations) };
        self.count_general_solution(state.t(), diagnosis);
        match self.loses_rank(diagnosis) {
            true => self.branch_limit(model, constants, state, &accelerations, diagnosis),
            false => Ok(accelerations),
        }
    }

    /// Stages of projected steps violate the constraints a little. Redundant rows then contradict each other
    /// and are better left out. Baumgarte's equations, with gains of 0 too, weigh all rows.
    #[inline(always)]
    fn weighs_all_rows(&self) -> bool {
        has_redundant_constraints::<M>() && self.formulation != Some(Formulation::Projected)
    }

    /// Whether constraints that are independent elsewhere have lost rank during the motion. Singular starts
    /// are treated where the run begins.
    fn loses_rank(&self, diagnosis: &RankDiagnosis) -> bool {
        self.is_under_way
            && diagnosis.rank < diagnosis.active
            && diagnosis.active == M::ROWS.len()
            && !has_redundant_constraints::<M>()
    }

    /// The accelerations in a singular position: their limit along the branch of the motion. Those of least
    /// norm, which the general solver finds, belong to no branch.
    #[cold]
    fn branch_limit(
        &mut self,
        model: &M,
        constants: &M::Constants,
        state: &M::State,
        found: &M::Vector,
        diagnosis: &RankDiagnosis,
    ) -> Result<M::Vector, SolveError> {
        let undetermined = SolveError::BranchUndetermined { rank: diagnosis.rank, active: diagnosis.active };
        let Some(limit) = self.singular_start(model, constants, state, found).map_err(|_| undetermined)?
        else {
            return Ok(*found);
        };
        // The limit has fewer digits: keep the least accelerations where both agree.
        let difference =
            (0..M::Vector::LEN).fold(0.0, |most, i| math::max(most, (limit[i] - found[i]).abs()));
        let speed = max_abs(state.u().as_slice());
        let differs = difference > BRANCH_LIMIT_DIFFERENCE * (max_abs(found.as_slice()) + speed * speed);
        Ok(if differs { limit } else { *found })
    }

    #[cold]
    fn count_general_solution(&mut self, t: f64, diagnosis: &RankDiagnosis) {
        let counts = &mut self.counts;
        counts.general += 1;
        let released = diagnosis.active < M::ROWS.len();
        counts.released += u64::from(released);
        if !released {
            counts.general_at.get_or_insert(t);
        }
        if diagnosis.rank < diagnosis.active {
            counts.dependent += 1;
            counts.dependent_at.get_or_insert(t);
        }
        if counts.conditioning.is_none_or(|worst| diagnosis.condition > worst.0) {
            counts.conditioning = Some((diagnosis.condition, t));
        }
    }

    /// Accelerations at a start where constraints depend on each other: see
    /// [`crate::simulate::diagnosis::singular_position`].
    pub(crate) fn singular_start(
        &mut self,
        model: &M,
        constants: &M::Constants,
        start: &M::State,
        found: &M::Vector,
    ) -> Result<Option<M::Vector>, SimulationErrorKind> {
        crate::simulate::stabilization::singular_start::start_accelerations(
            model,
            constants,
            start,
            found,
            &mut self.workspace,
        )
    }

    /// Φ_q at a state.
    pub(crate) fn gradients(&mut self, model: &M, state: &M::State) -> Gradients<'_> {
        Gradients::alone(model, state, &mut self.workspace)
    }

    /// An impact on constraints, by index and coefficient of restitution. The velocities of the state jump.
    pub(crate) fn impact(
        &mut self,
        model: &M,
        state: &mut M::State,
        hits: &[(usize, f64)],
    ) -> Result<constrain::ImpactSolution<M::Rows>, SolveError> {
        constrain::impact(model, state, hits, &mut self.workspace)
    }

    /// The side to which a released nonholonomic constraint of one row slips: the sign of A q̇ + b. `None`
    /// where it slips no faster than a start may violate it.
    pub(crate) fn slip_side(&mut self, model: &M, state: &M::State, constraint: &Constraint) -> Option<f64> {
        let slip = self.slip_velocity(model, state, constraint);
        (slip.abs() > CONSISTENT * self.velocity_size(model, state, constraint)).then_some(slip.signum())
    }

    /// The [size](size_along) of the coordinates that a constraint involves, the largest of its rows.
    pub(crate) fn size_of(&mut self, model: &M, state: &M::State, constraint: &Constraint) -> f64 {
        let gradients = Gradients::alone(model, state, &mut self.workspace);
        let rows = constraint.first..constraint.first + constraint.rows;
        rows.map(|row| size_along(model, state.q().as_slice(), gradients.row(row))).fold(0.0, math::max)
    }

    /// The [size](size_along) of the velocities that a constraint of one row involves.
    pub(crate) fn velocity_size(&mut self, model: &M, state: &M::State, constraint: &Constraint) -> f64 {
        let gradients = Gradients::alone(model, state, &mut self.workspace);
        size_along(model, state.u().as_slice(), gradients.row(constraint.first))
    }

    /// Φ̇/‖Φ_q‖ or (A q̇ + b)/‖A‖ of a constraint of one row.
    pub(crate) fn slip_velocity(&mut self, model: &M, state: &M::State, constraint: &Constraint) -> f64 {
        let slip = model.velocity_residual(state)[constraint.first];
        Distances::of(model, state, &mut self.workspace).distance(constraint.first, slip).copysign(slip)
    }

    /// See [`missed_row`].
    pub(crate) fn missed_row(
        &mut self,
        model: &M,
        state: &M::State,
        constraint: &Constraint,
        part: f64,
    ) -> Option<(&'static str, f64)> {
        missed_row(model, state, (constraint, part), &mut self.workspace)
    }
}

/// The row of a holonomic constraint that is violated most, and its Φ, if |Φ|/‖Φ_q‖ is above this part
/// of its [size](size_along).
pub(crate) fn missed_row<M: Constraints>(
    model: &M,
    state: &M::State,
    (constraint, part): (&Constraint, f64),
    workspace: &mut [f64],
) -> Option<(&'static str, f64)> {
    let residual = model.residual(state);
    let distances = Distances::of(model, state, workspace);
    let rows = constraint.first..constraint.first + constraint.rows;
    let of_size = |row: usize| {
        distances.distance(row, residual[row])
            / size_along(model, state.q().as_slice(), distances.gradients.row(row))
    };
    let (row, violation) = rows.map(|row| (row, of_size(row))).max_by(|a, b| a.1.total_cmp(&b.1))?;
    // Negated, so that a violation that is not a number is reported.
    let is_permitted = violation <= part;
    (!is_permitted).then(|| (M::ROWS[row].name, residual[row]))
}

/// Gradients by which residuals become distances |residual|/‖Φ_q‖.
struct Distances<'w> {
    gradients: Gradients<'w>,
}

impl<'w> Distances<'w> {
    fn of<M: Constraints>(model: &M, state: &M::State, workspace: &'w mut [f64]) -> Self {
        Self { gradients: Gradients::of(model, state, workspace) }
    }

    /// |residual|/‖Φ_q‖ of a row. See [`Gradients::distance`] for gradients that nearly vanish.
    fn distance(&self, row: usize, residual: f64) -> f64 {
        self.gradients.distance(row, residual)
    }
}

/// Whether the model declares some constraints as redundant.
fn has_redundant_constraints<M: Constraints>() -> bool {
    M::CONSTRAINTS.iter().any(|constraint| constraint.redundant)
}
