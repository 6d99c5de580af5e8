//! What keeps the constraints of a run, by its formulation.

pub(crate) mod adaptive_gain;
pub(crate) mod contacts;
pub(crate) mod drift_monitor;
pub(crate) mod initial_consistency;
pub(crate) mod near_singular;
pub(crate) mod projection;
pub(crate) mod singular_start;

use alloc::vec::Vec;

pub(crate) use crate::simulate::stabilization::contacts::ContactHistory;
pub(crate) use crate::simulate::stabilization::drift_monitor::{DriftVerdict, Drifted};
pub(crate) use crate::simulate::stabilization::initial_consistency::PlaceError;

use crate::constrain::active_set::{active_rows, holds};
use crate::constrain::assemble::{CONSISTENT, size_along};
use crate::constrain::{self, Gradients, RankDiagnosis};
use crate::error::SolveError;
use crate::integrate::{Phase, Tolerances, zip};
use crate::linalg::max_abs;
use crate::math;
use crate::model::{Constraint, Constraints, Known, ModelState, Vector};
use crate::simulate::failure::SimulationErrorKind;
use crate::simulate::options::formulation::Formulation;
use crate::simulate::stabilization::adaptive_gain::{DriftInfluence, Pace};

/// How often a run had to leave the straight way to keep its constraints.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct StabilizationCounts {
    /// Evaluations by the general solver where generated code did not apply: a pivot was too small, a
    /// constraint was released.
    pub general: u64,
    /// When generated code did not apply first though all constraints held.
    pub general_at: Option<f64>,
    /// Those among them at which a switched constraint was released: there the general solver is the way that
    /// was chosen.
    pub released: u64,
    /// Evaluations at which the Jacobian had a lower rank than it has rows that hold, so that multipliers are
    /// not unique.
    pub dependent: u64,
    /// When that was met first.
    pub dependent_at: Option<f64>,
    /// Steps after which the state was put back onto the constraints.
    pub projected: u64,
    /// Largest size of such a move, in parts of what the tolerance permits per step.
    pub largest_move: f64,
    /// How often the embedded formulation chose anew which coordinates are dependent: at a state where a
    /// block of dependent ones of the generated code had degraded, so that the general solver chose its own
    /// pivots. 0 where there is no generated code: then it always does.
    pub repartitions: u64,
    /// How often a contact without a [`rest_speed`](crate::simulate::Contact::rest_speed) was hit too slowly
    /// to rebound and counted as at rest.
    pub rests: u64,
    /// The largest speed, |Φ̇|, at which one did.
    pub fastest_rest: f64,
    /// Worst conditioning of the constraints that was met by the general solver, and when.
    pub conditioning: Option<(f64, f64)>,
    /// Where drift turned the motion most: where constraints drift, at the ends of those steps that may be
    /// near a singular position, and of every fourth to thirteenth of the others.
    pub turned: Option<DriftInfluence>,
}

impl StabilizationCounts {
    /// A contact came to rest that approached, or moved away, with a speed.
    fn rest(&mut self, speed: f64) {
        self.rests += 1;
        self.fastest_rest = self.fastest_rest.max(speed.abs());
    }

    /// Adds the evaluations of steps that were made before the run, as they are counted of its own.
    pub(crate) fn add_evaluations(&mut self, before: &Self) {
        self.general += before.general;
        self.released += before.released;
        self.dependent += before.dependent;
    }

    /// The end of a step was projected: by how much.
    #[inline]
    pub(crate) fn note_move(&mut self, size: f64) {
        self.projected += 1;
        if size > self.largest_move {
            self.largest_move = size;
        }
    }
}

/// Relative difference from accelerations of least norm from which on a limit along a branch is another
/// value: at a distance x its rounding is ε/x³.
const LIMIT: f64 = 1e-5;
/// What steps leave in a [`Stabilization`].
pub(crate) struct StabilizationNotes<M: Constraints> {
    counts: StabilizationCounts,
    push: M::Vector,
    pace: Pace,
    look: Option<drift_monitor::DriftInspection<M::Rows>>,
    usual: Option<f64>,
    latest: Option<f64>,
    moved: Option<f64>,
    held: Option<Tolerances>,
}

/// Keeps the constraints of one run; what it works in is allocated once.
pub(crate) struct Stabilization<M: Constraints> {
    pub(crate) formulation: Option<Formulation>,
    pub(crate) counts: StabilizationCounts,
    /// α and β where they are fixed, α with the sign of the run.
    gains: (f64, f64),
    /// What the step being made adds to the accelerations, where gains follow the step.
    push: M::Vector,
    pace: Pace,
    drift_limit: f64,
    /// No row is smaller, once that was asked.
    least_size: Option<f64>,
    /// The last close look at what has drifted.
    look: Option<drift_monitor::DriftInspection<M::Rows>>,
    /// The contacts of the run, which take part in every impact where they touch.
    pub(crate) contacts: Vec<ContactHistory>,
    /// Mean of the sensitivities of the projections that ended steps so far, on a logarithmic scale. It is
    /// the same in all of a step, in every attempt to make it and in its interpolant, so that it can be made
    /// again.
    pub(crate) usual: Option<f64>,
    /// The sensitivity of the projection that ended the step which was tried last.
    latest: Option<f64>,
    constants: M::Constants,
    /// By how much the end of the step that was tried last moved onto the constraints, in parts of what the
    /// tolerance permits.
    pub(crate) moved: Option<f64>,
    /// The stages of steps are put onto the constraints too, as far as these tolerances ask for.
    held: Option<Tolerances>,
    /// The start has been looked at.
    pub(crate) under_way: bool,
    workspace: Vec<f64>,
}

impl<M: Constraints> Stabilization<M> {
    /// For a run from the first of two times to the second.
    pub(crate) fn new(
        formulation: Option<Formulation>,
        drift_limit: f64,
        constants: M::Constants,
        run: (f64, f64),
    ) -> Self {
        Self::within(formulation, drift_limit, constants, run, Vec::new())
    }

    /// As [`Stabilization::new`], in memory that another one [left](Stabilization::into_memory).
    pub(crate) fn within(
        formulation: Option<Formulation>,
        drift_limit: f64,
        constants: M::Constants,
        (from, to): (f64, f64),
        mut workspace: Vec<f64>,
    ) -> Self {
        // What damps in one direction of time drives in the other.
        let along = if to < from { -1.0 } else { 1.0 };
        let gains = match formulation {
            Some(Formulation::Baumgarte { alpha, beta }) => (along * alpha, beta),
            _ => (0.0, 0.0),
        };
        let len = constrain::workspace_len(M::COORDINATES.len(), M::ROWS.len());
        workspace.resize(if M::IS_FREE { 0 } else { len }, 0.0);
        Self {
            formulation,
            counts: StabilizationCounts::default(),
            gains,
            push: M::Vector::zeros(),
            pace: Pace::default(),
            drift_limit,
            least_size: None,
            look: None,
            contacts: Vec::new(),
            usual: None,
            latest: None,
            constants,
            moved: None,
            held: None,
            under_way: false,
            workspace,
        }
    }

    /// What steps have left in it so far.
    pub(crate) fn noted(&self) -> StabilizationNotes<M> {
        let Self { counts, push, pace, look, usual, latest, moved, held, .. } = *self;
        StabilizationNotes { counts, push, pace, look, usual, latest, moved, held }
    }

    /// Forgets what steps have left in it since.
    pub(crate) fn put_back(&mut self, noted: StabilizationNotes<M>) {
        let StabilizationNotes { counts, push, pace, look, usual, latest, moved, held } = noted;
        (self.counts, self.push, self.pace, self.look) = (counts, push, pace, look);
        (self.usual, self.latest, self.moved, self.held) = (usual, latest, moved, held);
    }

    /// The memory that it worked in.
    pub(crate) fn into_memory(self) -> Vec<f64> {
        self.workspace
    }

    /// The memory that it works in, for as long as nothing else is asked of it.
    pub(crate) fn lend(&mut self) -> Vec<f64> {
        core::mem::take(&mut self.workspace)
    }

    /// What was lent.
    pub(crate) fn take_back(&mut self, memory: Vec<f64>) {
        self.workspace = memory;
    }

    /// Whether the gains follow the step.
    #[inline(always)]
    pub(crate) fn is_tied(&self) -> bool {
        self.formulation == Some(Formulation::BaumgarteTied)
    }

    /// Whether accelerations are those of the model: nothing is added, and no coordinate is solved for where
    /// they are evaluated.
    pub(crate) fn is_plain(&self) -> bool {
        matches!(self.formulation, None | Some(Formulation::Augmented | Formulation::Projected))
    }

    /// Whether [`Self::accelerations`] adds nothing to those of the model, and states are evaluated where
    /// they are: so that four can be evaluated at once.
    #[inline(always)]
    pub(crate) fn is_bare(&self) -> bool {
        let alike = repeat::<M>() && self.formulation != Some(Formulation::Projected);
        self.gains == (0.0, 0.0) && !alike && !self.is_tied() && !self.restores()
    }

    /// What is left of a small change of a state once it is projected: the part that is tangent to the
    /// constraints.
    pub(crate) fn along(
        &mut self,
        model: &M,
        state: &M::State,
        change: &Phase<M::Vector>,
    ) -> Result<Phase<M::Vector>, SolveError> {
        let q = self.across(model, state, &change.q, M::Residual::LEN)?;
        let u = self.across(model, state, &change.u, M::Rows::LEN)?;
        Ok(zip(change, &Phase { q, u }, |change, across| change - across))
    }

    /// The part of a change of positions or velocities that the first so many rows do not permit, along
    /// M⁻¹Φ_qᵀ.
    pub(crate) fn across(
        &mut self,
        model: &M,
        state: &M::State,
        change: &M::Vector,
        rows: usize,
    ) -> Result<M::Vector, SolveError> {
        let jacobian = Gradients::of(model, state, &mut self.workspace).rows;
        let mut across = M::Rows::zeros();
        let lines = jacobian.chunks_exact(M::Vector::LEN).zip(across.as_mut_slice()).enumerate();
        for (row, (line, across)) in lines.take(rows) {
            if holds::<M>(state.modes(), row) {
                *across = line.iter().zip(change.as_slice()).map(|(a, b)| a * b).sum();
            }
        }
        constrain::correct(model, &self.constants, state, &across, &mut self.workspace)
    }

    /// One correction of positions towards Φ = 0; rows that bind velocities ask for `rate` times what is
    /// missing of A q̇ + b = 0.
    pub(crate) fn onto(&mut self, model: &M, state: &M::State, rate: f64) -> Result<M::Vector, SolveError> {
        let (position, mut right) = (model.residual(state), model.velocity_residual(state));
        for (row, right) in right.as_mut_slice().iter_mut().enumerate() {
            *right = match holds::<M>(state.modes(), row) {
                true if row < M::Residual::LEN => -position[row],
                true => -rate * *right,
                false => 0.0,
            };
        }
        constrain::correct(model, &self.constants, state, &right, &mut self.workspace)
    }

    /// By how much a state violates its constraints, |Φ|/‖Φ_q‖ and |Φ̇|/‖Φ_q‖ of the worst row, in parts of
    /// what the tolerance permits; infinite where one is not a number.
    #[cold]
    pub(crate) fn violation(&mut self, model: &M, state: &M::State, tolerances: &Tolerances) -> f64 {
        let (position, velocity) = (model.residual(state), model.velocity_residual(state));
        let permitted =
            |values: &M::Vector| tolerances.absolute + tolerances.relative * max_abs(values.as_slice());
        let (of_q, of_u) = (permitted(state.q()), permitted(state.u()));
        let distances = Distances::of(model, state, &mut self.workspace);
        active_rows::<M>(state.modes(), false).fold(0.0f64, |worst, row| {
            let of_row = |residual: f64, permitted: f64| distances.along(row, residual) / permitted;
            let at = if row < M::Residual::LEN { of_row(position[row], of_q) } else { 0.0 };
            let of_row = math::max(at, of_row(velocity[row], of_u));
            if of_row.is_nan() { f64::INFINITY } else { worst.max(of_row) }
        })
    }

    /// What a step from a state adds to the accelerations all along, to take back what has drifted up to
    /// there.
    pub(crate) fn push_back(&mut self, model: &M, state: &M::State, h: f64) -> Result<(), SolveError> {
        let (position, mut right) = (model.residual(state), model.velocity_residual(state));
        let h = self.pace.of_step(state.t(), h.abs()).copysign(h);
        for (row, right) in right.as_mut_slice().iter_mut().enumerate() {
            *right =
                if row < M::Residual::LEN { -(1.5 * *right + position[row] / h) / h } else { -*right / h };
        }
        self.push = constrain::correct(model, &self.constants, state, &right, &mut self.workspace)?;
        Ok(())
    }

    /// The time in which tied gains take back what has drifted, in the step tried last.
    pub(crate) fn pace(&self) -> f64 {
        self.pace.now
    }

    /// Has the steps that follow made again at the pace at which they were.
    pub(crate) fn replay(&mut self, pace: f64) {
        self.pace.recorded = pace;
    }

    /// Whether states are put back onto the constraints after a step.
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

    /// Whether accelerations differ by more than this part of 1 + |q̈| between the sides to which a
    /// constraint may be released; also where they fail.
    pub(crate) fn side_counts(
        &mut self,
        model: &M,
        constants: &M::Constants,
        state: &M::State,
        switch: usize,
        negligible: f64,
    ) -> bool {
        let [one, other] = [1.0, -1.0].map(|side| {
            let mut state = *state;
            state.modes_mut().release(switch, side);
            constrain::accelerate(model, constants, &state, &mut self.workspace)
        });
        let (Ok(one), Ok(other)) = (one, other) else { return true };
        let (one, other) = (one.accelerations, other.accelerations);
        let size = negligible * (1.0 + max_abs(one.as_slice()));
        // What is not a number counts.
        !one.as_slice().iter().zip(other.as_slice()).all(|(one, other)| (one - other).abs() <= size)
    }

    /// By how much the rate of a slip, of one row, differs if its constraint is released to the other side;
    /// `None` where accelerations fail.
    pub(crate) fn change_of_side(
        &mut self,
        model: &M,
        constants: &M::Constants,
        state: &M::State,
        (constraint, switch): (&Constraint, usize),
    ) -> Option<f64> {
        let side = state.modes().side(switch);
        let mut accelerations = |side: f64| {
            let mut state = *state;
            state.modes_mut().release(switch, side);
            constrain::accelerate(model, constants, &state, &mut self.workspace)
                .ok()
                .map(|solved| solved.accelerations)
        };
        let (here, there) = (accelerations(side)?, accelerations(-side)?);
        let gradients = self.gradients(model, state);
        let row = gradients.row(constraint.first).iter().enumerate();
        Some(row.map(|(j, x)| x * (there[j] - here[j])).sum())
    }

    /// Whether dependent coordinates are solved for wherever accelerations are evaluated.
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
        let workspace = &mut self.workspace;
        // Stages of projected steps lie beside the manifold, where rows that repeat others are better left
        // out; Baumgarte's equations weigh all rows alike, without gains too.
        let alike = repeat::<M>() && self.formulation != Some(Formulation::Projected);
        let solved = match self.gains {
            (0.0, 0.0) if !alike => constrain::accelerate(model, constants, state, workspace)?,
            gains => constrain::solve_baumgarte(model, constants, state, gains, workspace)?,
        };
        let mut accelerations = solved.accelerations;
        if let Some(diagnosis) = &solved.diagnosis {
            self.note(state.t(), diagnosis);
            if self.loses_rank(diagnosis) {
                accelerations = self.branch_limit(model, constants, state, &accelerations, diagnosis)?;
            }
        }
        if self.is_tied() {
            for (a, push) in accelerations.as_mut_slice().iter_mut().zip(self.push.as_slice()) {
                *a += push;
            }
        }
        Ok(accelerations)
    }

    /// Whether constraints that are independent elsewhere depend on each other, once the motion is under way:
    /// what a start is taken for is decided where it is.
    fn loses_rank(&self, diagnosis: &RankDiagnosis) -> bool {
        self.under_way
            && diagnosis.rank < diagnosis.active
            && diagnosis.active == M::ROWS.len()
            && !repeat::<M>()
    }

    /// The accelerations in a singular position are those of the branch: least ones, as the general solver
    /// finds them, are on none.
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
        // The limit is known to fewer digits.
        let apart = (0..M::Vector::LEN).fold(0.0, |most, i| math::max(most, (limit[i] - found[i]).abs()));
        let speed = max_abs(state.u().as_slice());
        let differs = apart > LIMIT * (max_abs(found.as_slice()) + speed * speed);
        Ok(if differs { limit } else { *found })
    }

    #[cold]
    fn note(&mut self, t: f64, diagnosis: &RankDiagnosis) {
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

    /// An impact on the rows of constraints, by index with their coefficients of restitution; the state's
    /// velocities jump.
    pub(crate) fn impact(
        &mut self,
        model: &M,
        state: &mut M::State,
        hits: &[(usize, f64)],
    ) -> Result<constrain::ImpactSolution<M::Rows>, SolveError> {
        constrain::impact(model, state, hits, &mut self.workspace)
    }

    /// The side to which a released nonholonomic constraint of one row slips; `None` where it slips no faster
    /// than a start may miss it.
    pub(crate) fn slip_side(&mut self, model: &M, state: &M::State, constraint: &Constraint) -> Option<f64> {
        let slip = self.slip(model, state, constraint);
        (slip.abs() > CONSISTENT * self.speed(model, state, constraint)).then_some(slip.signum())
    }

    /// The [size](size_along) of what a constraint of one row involves; the largest of several rows.
    pub(crate) fn length(&mut self, model: &M, state: &M::State, constraint: &Constraint) -> f64 {
        let gradients = Gradients::alone(model, state, &mut self.workspace);
        let rows = constraint.first..constraint.first + constraint.rows;
        rows.map(|row| size_along(model, state.q().as_slice(), gradients.row(row))).fold(0.0, math::max)
    }

    /// The [size](size_along) of the velocities by which a constraint of one row is missed.
    pub(crate) fn speed(&mut self, model: &M, state: &M::State, constraint: &Constraint) -> f64 {
        let gradients = Gradients::alone(model, state, &mut self.workspace);
        size_along(model, state.u().as_slice(), gradients.row(constraint.first))
    }

    /// Φ̇ or A q̇ + b of a constraint of one row, as the velocity by which it is missed.
    pub(crate) fn slip(&mut self, model: &M, state: &M::State, constraint: &Constraint) -> f64 {
        let slip = model.velocity_residual(state)[constraint.first];
        Distances::of(model, state, &mut self.workspace).along(constraint.first, slip).copysign(slip)
    }

    /// The row of a holonomic constraint that is missed most, if it is missed by more than this part of its
    /// [size](size_along).
    pub(crate) fn apart(
        &mut self,
        model: &M,
        state: &M::State,
        constraint: &Constraint,
        part: f64,
    ) -> Option<(&'static str, f64)> {
        apart(model, state, (constraint, part), &mut self.workspace)
    }
}

/// The row of a holonomic constraint that is missed most, if it is missed by more than this part of its
/// [size](size_along).
pub(crate) fn apart<M: Constraints>(
    model: &M,
    state: &M::State,
    (constraint, part): (&Constraint, f64),
    workspace: &mut [f64],
) -> Option<(&'static str, f64)> {
    let residual = model.residual(state);
    let distances = Distances::of(model, state, workspace);
    let rows = constraint.first..constraint.first + constraint.rows;
    let of_size = |row: usize| {
        distances.along(row, residual[row])
            / size_along(model, state.q().as_slice(), distances.gradients.row(row))
    };
    let (row, off) = rows.map(|row| (row, of_size(row))).max_by(|a, b| a.1.total_cmp(&b.1))?;
    let near = off <= part;
    (!near).then(|| (M::ROWS[row].name, residual[row]))
}

/// What turns residuals into distances.
struct Distances<'w> {
    gradients: Gradients<'w>,
}

impl<'w> Distances<'w> {
    fn of<M: Constraints>(model: &M, state: &M::State, workspace: &'w mut [f64]) -> Self {
        Self { gradients: Gradients::of(model, state, workspace) }
    }

    /// |residual|/‖Φ_q‖ of a row.
    fn along(&self, row: usize, residual: f64) -> f64 {
        self.gradients.distance(row, residual)
    }
}

/// Whether some constraints are declared to repeat others.
fn repeat<M: Constraints>() -> bool {
    M::CONSTRAINTS.iter().any(|constraint| constraint.redundant)
}
