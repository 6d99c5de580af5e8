//! Constraints at run time: accelerations and reactions, corrections of positions and velocities, diagnosis.
//!
//! ```text
//! M q̈ = Q + Φ_qᵀ λ        Φ_q q̈ = γ
//! ```
//!
//! Where the macro found straight-line code for these equations, that code is used
//! ([`Constraints::solve_unrolled`]). It does not apply where a pivot vanishes, where there is no code for
//! the constraints that are released, or where constraints repeat each other. There the general solver
//! (`system.rs`) determines the rank at the state at hand. All functions work in a workspace that the caller
//! lends, [`workspace_len`] numbers of it, and allocate nothing.

pub(crate) mod active_set;
#[cfg(feature = "alloc")]
pub(crate) mod compare;
#[cfg(feature = "alloc")]
pub(crate) mod conditioning;
mod correct;
mod embed;
mod friction;
pub(crate) mod gradients;
mod impact;
#[cfg(feature = "alloc")]
pub(crate) mod inertia;
#[cfg(feature = "alloc")]
pub(crate) mod mechanism;
pub(crate) mod nearby;
pub(crate) mod project;
mod speeds;
pub(crate) mod system;
mod unconstrained;

pub use active_set::{ActiveRows, active_rows};
#[cfg(feature = "alloc")]
pub use compare::{Comparison, FormulationResult};
pub use correct::{correct, solve_baumgarte};
pub use embed::Embedding;
pub(crate) use gradients::{Gradients, distance};
pub use impact::{ImpactSolution, impact};
#[cfg(feature = "alloc")]
pub use mechanism::{ConstraintReaction, multipliers, reactions};
pub use nearby::at_time;
pub use project::{Projection, project_along, project_positions, project_velocities};
pub use speeds::move_by_speeds;
pub use system::RANK_TOLERANCE;

use active_set::holds;
use system::{FactoredSystem, GammaResidual, ModelTerms, SystemNames};

use crate::error::SolveError;
use crate::linalg::{WorkspaceSlices, max_abs};
use crate::model::{Constraints, ModelState, Solved, SolverKind, StaticTraits, Terms, Vector, Workspace};

// Public for dynamics-analysis alone. What users call is exported below.
#[doc(hidden)]
pub mod assemble;
#[cfg(feature = "alloc")]
pub(crate) mod rank_margin;

pub use crate::declaration::TopContributors;
pub use assemble::{assemble, check_gradients, check_sides, check_start, set_sides};

/// Length of the workspace that the general solvers need for n coordinates and r constraint rows.
#[must_use]
pub const fn workspace_len(n: usize, r: usize) -> usize {
    let evaluate_terms = n * n + n + n * r + r;
    let solving = evaluate_terms + 2 * r + system::workspace_len(n, r);
    largest_of([
        solving,
        embed::workspace_len(n, r),
        assemble::workspace_len(n, r),
        friction::total_workspace_len(n, r),
        gradients::workspace_len(n, r),
        assemble::check_workspace_len(n, r),
        speeds::workspace_len(n, r),
    ])
}

/// Divides the workspace that a caller lends for n coordinates and r constraint rows.
///
/// # Panics
/// Where it is shorter than [`workspace_len`]. That is an error of the program, not of its input.
fn borrow_workspace(workspace: &mut [f64], n: usize, r: usize) -> WorkspaceSlices<'_> {
    let (needed, given) = (workspace_len(n, r), workspace.len());
    assert!(
        given >= needed,
        "a workspace of {given} numbers for {n} coordinates and {r} rows; give {needed}"
    );
    WorkspaceSlices::new(workspace)
}

/// The largest of some lengths; `Iterator::max` is no `const fn`.
const fn largest_of<const K: usize>(lengths: [usize; K]) -> usize {
    let (mut most, mut i) = (0, 0);
    while i < K {
        if lengths[i] > most {
            most = lengths[i];
        }
        i += 1;
    }
    most
}

/// Singular values of Φ_q below this part of the largest count as zero. A singular position is itself known
/// to √ε = 1.5·10⁻⁸ at best, and its zero singular values come out about as large as that.
const SINGULAR_VALUE_TOLERANCE: f64 = 1e-7;

/// Φ_q a = γ counts as contradictory where the best a leaves a residual above this part of the size of γ.
/// The bound is well above the residual that the drift of an unstabilized motion leaves on constraints that
/// repeat each other.
const CONTRADICTION_TOLERANCE: f64 = 1e-6;
/// This part of ‖a‖ is added to the size of γ in that test. At rest γ is rounding only, and so is the
/// residual. A contradiction is then larger than 10⁻¹² ‖a‖.
const ROUNDING_PER_ACCELERATION: f64 = 1e-6;

/// Rank and conditioning of the active constraints at a state, as the general solver determined them.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RankDiagnosis {
    /// Number of active rows.
    pub active: usize,
    /// Rank of their Jacobian. Below [`RankDiagnosis::active`] some rows repeat others. The accelerations are
    /// then unique and the multipliers are not. The multipliers of least norm are returned: Σ (λᵢ
    /// ‖Φ_q,ᵢ‖)² is least, with coordinates scaled by the square roots of their inertias.
    pub rank: usize,
    /// First over last pivot of the Jacobian, with rows at unit length. The multipliers lose log₁₀ of it of
    /// their digits.
    pub condition: f64,
}

impl RankDiagnosis {
    /// Whether the multipliers are unique.
    #[must_use]
    pub fn unique(&self) -> bool {
        self.rank == self.active
    }
}

/// q̈ and λ at a state.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ConstrainedAccelerations<V, R> {
    /// q̈.
    pub accelerations: V,
    /// λ; 0 for rows of released constraints.
    pub multipliers: R,
    /// Rank diagnosis of the general solver; `None` where the generated code applied.
    pub diagnosis: Option<RankDiagnosis>,
}

impl<V, R> ConstrainedAccelerations<V, R> {
    /// Whether the multipliers are unique. They always are where the generated code applies.
    #[must_use]
    pub fn unique(&self) -> bool {
        self.diagnosis.is_none_or(|d| d.unique())
    }
}

impl<V, R> From<Solved<V, R>> for ConstrainedAccelerations<V, R> {
    fn from(Solved { accelerations, multipliers }: Solved<V, R>) -> Self {
        Self { accelerations, multipliers, diagnosis: None }
    }
}

/// [`ConstrainedAccelerations`] of a model.
pub type ConstrainedAccelerationsOf<M> =
    ConstrainedAccelerations<<M as crate::model::Model>::Vector, <M as Constraints>::Rows>;

/// Solves for q̈ and λ, by the generated code where it applies, else by the general solver.
///
/// At a change point constraints that are independent elsewhere lose rank. The accelerations are then those
/// of least norm, which need not belong to a branch of the motion. The diagnosis shows this case, as it shows
/// multipliers that are not unique. A run takes the limit along the branch of its velocities instead.
///
/// # Errors
/// A mass matrix that is singular on the motions that the constraints leave, contradictory constraints,
/// constraints that are not finite.
pub fn solve<M: Constraints>(
    model: &M,
    constants: &M::Constants,
    state: &M::State,
    workspace: &mut [f64],
) -> Result<ConstrainedAccelerationsOf<M>, SolveError> {
    if M::IS_DIRECT {
        return solve_unconstrained(model, constants, state);
    }
    match model.solve_unrolled(constants, state) {
        Some(solved) => Ok(solved.into()),
        None => solve_general(model, state, workspace),
    }
}

/// [`solve`] with its own workspace. Small ones are on the stack, large ones are allocated where the crate
/// has `alloc`. The generated code needs none.
///
/// # Errors
/// As [`solve`].
pub fn solve_once<M: Constraints>(
    model: &M,
    constants: &M::Constants,
    state: &M::State,
) -> Result<ConstrainedAccelerationsOf<M>, SolveError> {
    if M::IS_DIRECT {
        return solve_unconstrained(model, constants, state);
    }
    match model.solve_unrolled(constants, state) {
        Some(solved) => Ok(solved.into()),
        None => with_workspace::<M, _>(|workspace| solve_general(model, state, workspace)),
    }
}

/// q̈ at a state, without λ.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DiagnosedAccelerations<V> {
    /// q̈.
    pub accelerations: V,
    /// Rank diagnosis of the general solver; `None` where the generated code applied.
    pub diagnosis: Option<RankDiagnosis>,
}

impl<V, R> From<ConstrainedAccelerations<V, R>> for DiagnosedAccelerations<V> {
    fn from(
        ConstrainedAccelerations { accelerations, diagnosis, .. }: ConstrainedAccelerations<V, R>,
    ) -> Self {
        Self { accelerations, diagnosis }
    }
}

/// [`solve`] without λ, which is less work.
///
/// # Errors
/// As [`solve`].
#[inline]
pub fn accelerate<M: Constraints>(
    model: &M,
    constants: &M::Constants,
    state: &M::State,
    workspace: &mut [f64],
) -> Result<DiagnosedAccelerations<M::Vector>, SolveError> {
    let unrolled = match M::SOLVER {
        SolverKind::Unconstrained => Some(model.accelerations_with(constants, state)?),
        _ => model.accelerate_unrolled(constants, state),
    };
    match unrolled {
        Some(accelerations) => Ok(DiagnosedAccelerations { accelerations, diagnosis: None }),
        None => solve_general(model, state, workspace).map(DiagnosedAccelerations::from),
    }
}

/// q̈ and λ of a model as the generated code returns them.
pub type SolvedOf<M> = Solved<<M as crate::model::Model>::Vector, <M as Constraints>::Rows>;

/// q̈ of a model without constraints, and no multipliers.
fn solve_unconstrained<M: Constraints>(
    model: &M,
    constants: &M::Constants,
    state: &M::State,
) -> Result<ConstrainedAccelerationsOf<M>, SolveError> {
    let accelerations = model.accelerations_with(constants, state)?;
    Ok(ConstrainedAccelerations { accelerations, multipliers: M::Rows::zeros(), diagnosis: None })
}

/// Largest workspace, in numbers, that is put on the stack where there is a heap. 8192 numbers are 64 kB, a
/// small part of the 2 MB that a thread of the standard library has.
#[cfg(feature = "alloc")]
const MAX_STACK_WORKSPACE: usize = 8192;

/// Calls a function with a workspace of [`workspace_len`] numbers.
#[cold]
pub fn with_workspace<M: Constraints, R>(f: impl FnOnce(&mut [f64]) -> R) -> R {
    #[inline(never)]
    fn on_stack<M: Constraints, R>(f: impl FnOnce(&mut [f64]) -> R) -> R {
        f(M::Workspace::new().as_mut_slice())
    }
    #[cfg(feature = "alloc")]
    {
        let len = const { workspace_len(M::Vector::LEN, M::Rows::LEN) };
        if len > MAX_STACK_WORKSPACE {
            return f(&mut alloc::vec![0.0; len]);
        }
    }
    on_stack::<M, R>(f)
}

/// q̈ and λ by the general solver, whatever the generated code could do.
///
/// A mass matrix or force that is not finite gives NaN accelerations, as in models without constraints.
///
/// # Errors
/// As [`solve`].
pub fn solve_general<M: Constraints>(
    model: &M,
    state: &M::State,
    workspace: &mut [f64],
) -> Result<ConstrainedAccelerationsOf<M>, SolveError> {
    solve_with_correction(model, state, None, workspace)
}

/// [`solve_general`] with Φ_q q̈ = γ + `gamma_correction`, as Baumgarte's stabilization needs it.
fn solve_with_correction<M: Constraints>(
    model: &M,
    state: &M::State,
    gamma_correction: Option<&M::Rows>,
    workspace: &mut [f64],
) -> Result<ConstrainedAccelerationsOf<M>, SolveError> {
    if M::FRICTION {
        return friction::solve(model, state, gamma_correction, false, workspace);
    }
    solve_frictionless(model, state, gamma_correction, true, workspace)
}

/// q̈ of a mechanism without degrees of freedom. It follows from Φ_q q̈ = γ alone, so inputs that only
/// load the mechanism need no value.
///
/// # Errors
/// As [`solve`].
#[cfg(feature = "alloc")]
pub(crate) fn solve_driven<M: Constraints>(
    model: &M,
    constants: &M::Constants,
    state: &M::State,
    workspace: &mut [f64],
) -> Result<M::Vector, SolveError> {
    match model.accelerate_unrolled(constants, state) {
        Some(accelerations) if max_abs(accelerations.as_slice()).is_finite() => Ok(accelerations),
        _ => Ok(solve_frictionless(model, state, None, false, workspace)?.accelerations),
    }
}

/// Checks that no multiplier is NaN because an input was never set.
///
/// # Errors
/// [`SolveError::InputNotSet`], where a multiplier and an input are NaN.
#[cfg(feature = "alloc")]
pub(crate) fn check_inputs<M: Constraints>(state: &M::State, multipliers: &[f64]) -> Result<(), SolveError> {
    let unset = || state.inputs().as_slice().iter().position(|x| x.is_nan());
    match multipliers.iter().any(|x| x.is_nan()).then(unset).flatten() {
        Some(input) => Err(SolveError::InputNotSet { input: M::INPUTS[input].name }),
        None => Ok(()),
    }
}

/// [`solve_with_correction`] without friction; Q counts as 0 unless `with_forces`.
fn solve_frictionless<M: Constraints>(
    model: &M,
    state: &M::State,
    gamma_correction: Option<&M::Rows>,
    with_forces: bool,
    workspace: &mut [f64],
) -> Result<ConstrainedAccelerationsOf<M>, SolveError> {
    let active_set = state.active_set();
    let active = |row: usize| holds::<M>(active_set, row);
    let Some(mut factored) = FactoredEquations::new(model, state, &active, with_forces, workspace)? else {
        return Ok(undefined());
    };
    if factored.system.has_vanished_row {
        // A row is zero. At a change point, where constraints cross, that is regular. Where the row is zero
        // on the whole manifold, the constraint restricts nothing, and the check reports it. The check uses
        // the same workspace, so that the factors are computed again.
        check_gradients(model, state, workspace)?;
        let Some(refactored) = FactoredEquations::new(model, state, &active, with_forces, workspace)? else {
            return Ok(undefined());
        };
        factored = refactored;
    }
    if let Some(gamma_correction) = gamma_correction {
        factored
            .gamma
            .iter_mut()
            .zip(gamma_correction.as_slice())
            .for_each(|(gamma, gamma_correction)| *gamma += gamma_correction);
        // Only this correction takes back the drift of a row, so that redundant rows count like the others.
        factored.system.ignore_redundancy();
    }
    let FactoredEquations { force, gamma, gamma_terms, redundancy_tolerance, system } = &mut factored;
    let mut accelerations = M::Vector::zeros();
    let mut multipliers = M::Rows::zeros();
    let residual = system.solve(force, gamma, accelerations.as_mut_slice(), multipliers.as_mut_slice());
    let size = residual.gamma_norm
        + system.size_of_rows(gamma_terms)
        + ROUNDING_PER_ACCELERATION * residual.acceleration_norm;
    check_contradiction(residual, size, *redundancy_tolerance, system, system_names::<M>())?;
    Ok(ConstrainedAccelerations { accelerations, multipliers, diagnosis: Some(diagnosis(system)) })
}

/// Checks that the reaction of an active row is unique, even where other rows repeat each other.
///
/// # Errors
/// [`SolveError::ReactionNotUnique`] where it is not; those of [`solve`].
#[cfg(feature = "alloc")]
pub(crate) fn check_unique<M: Constraints>(
    model: &M,
    state: &M::State,
    row: usize,
    workspace: &mut [f64],
) -> Result<(), SolveError> {
    let active_set = state.active_set();
    let factored = FactoredEquations::new(model, state, &|row| holds::<M>(active_set, row), true, workspace)?;
    match factored.is_none_or(|mut factored| factored.system.is_unique(row)) {
        true => Ok(()),
        false => Err(SolveError::ReactionNotUnique { row: system_names::<M>().row(row) }),
    }
}

fn diagnosis(system: &FactoredSystem<'_>) -> RankDiagnosis {
    RankDiagnosis { active: system.active(), rank: system.rank(), condition: system.condition() }
}

/// Tolerance within which rows that are declared redundant may differ from the rows that they repeat. On the
/// manifold they do not differ, at a distance from it by the order of that distance. If such rows were taken
/// for independent, they would be divided by that distance, and the accelerations would be noise.
fn redundancy_tolerance<M: Constraints>(
    model: &M,
    state: &M::State,
    jacobian: &[f64],
    active: &dyn Fn(usize) -> bool,
) -> f64 {
    if !M::CONSTRAINTS.iter().any(|c| c.redundant) {
        return system::RANK_TOLERANCE;
    }
    let largest_distance = |values: &[f64], at: &M::Vector| {
        let rows = values.iter().zip(jacobian.chunks_exact(M::Vector::LEN)).enumerate();
        // A row that is zero, as at a change point, has no distance.
        let of = |(_, (x, row)): (usize, (&f64, &[f64]))| {
            Some(distance(*x, row, 0.0)).filter(|distance| *distance < f64::INFINITY)
        };
        let distances = rows.filter(|(row, _)| active(*row)).filter_map(of);
        distances.fold(0.0, f64::max) / (1.0 + max_abs(at.as_slice()))
    };
    let (residual, rate) = (model.residual(state), model.velocity_residual(state));
    let distance =
        largest_distance(residual.as_slice(), state.q()).max(largest_distance(rate.as_slice(), state.u()));
    (REDUNDANT_ROW_CURVATURE * distance).clamp(system::RANK_TOLERANCE, MAX_REDUNDANCY_TOLERANCE)
}

/// Curvature of constraints, per unit of length, up to which redundant rows are recognised at a distance from
/// the manifold: rows that agree on the manifold differ by distance × curvature beside it.
const REDUNDANT_ROW_CURVATURE: f64 = 100.0;
/// Largest tolerance for redundant rows. Rows that differ by more than a tenth of their length are treated as
/// independent: so far from the manifold nothing is known about the rank on it.
const MAX_REDUNDANCY_TOLERANCE: f64 = 0.1;

/// The factored equations of a model at a state.
struct FactoredEquations<'w> {
    /// Q.
    force: &'w mut [f64],
    /// γ.
    gamma: &'w mut [f64],
    /// Σⱼ |Φ_q,ᵢⱼ| q̇ⱼ², the size of the terms of γ. Where these cancel, the remainder comes from
    /// rounding and from states a little off the constraints, and is no contradiction.
    gamma_terms: &'w mut [f64],
    /// How far rows that repeat each other may differ, in parts of their length.
    redundancy_tolerance: f64,
    system: FactoredSystem<'w>,
}

impl<'w> FactoredEquations<'w> {
    /// Factors the rows that `active` admits. Without `with_forces` Q is 0, even where an input was never
    /// set: for callers that need no forces or bring their own. `None` where M or Q is not finite.
    fn new<M: Constraints>(
        model: &M,
        state: &M::State,
        active: &dyn Fn(usize) -> bool,
        with_forces: bool,
        workspace: &'w mut [f64],
    ) -> Result<Option<Self>, SolveError> {
        Self::in_workspace(
            model,
            state,
            active,
            with_forces,
            borrow_workspace(workspace, M::Vector::LEN, M::Rows::LEN),
        )
    }

    fn in_workspace<M: Constraints>(
        model: &M,
        state: &M::State,
        active: &dyn Fn(usize) -> bool,
        with_forces: bool,
        mut workspace: WorkspaceSlices<'w>,
    ) -> Result<Option<Self>, SolveError> {
        let usual_lengths = workspace.take(M::Rows::LEN);
        let Some(terms) = evaluate_terms(model, state, active, with_forces, usual_lengths, &mut workspace)?
        else {
            return Ok(None);
        };
        let ModelTerms { mass, force, jacobian, gamma } = terms;
        let gamma_terms = workspace.take(M::Rows::LEN);
        for (gamma_terms, row) in gamma_terms.iter_mut().zip(jacobian.chunks_exact(M::Vector::LEN)) {
            *gamma_terms = row.iter().zip(state.u().as_slice()).map(|(x, u)| x.abs() * u * u).sum();
        }
        let redundancy_tolerance = redundancy_tolerance(model, state, jacobian, active);
        let system = FactoredSystem::factor(
            mass,
            jacobian,
            active,
            &is_redundant::<M>,
            (redundancy_tolerance, usual_lengths),
            system_names::<M>(),
            &mut workspace,
        )?;
        Ok(Some(Self { force, gamma, gamma_terms, redundancy_tolerance, system }))
    }
}

/// Whether a row is declared redundant.
fn is_redundant<M: Constraints>(row: usize) -> bool {
    M::CONSTRAINTS.iter().any(|c| c.redundant && (c.first..c.first + c.rows).contains(&row))
}

/// Reports constraints whose accelerations contradict each other; `size` is that of γ.
fn check_contradiction(
    residual: GammaResidual,
    size: f64,
    redundancy_tolerance: f64,
    system: &FactoredSystem<'_>,
    system_names: SystemNames,
) -> Result<(), SolveError> {
    if residual.norm <= CONTRADICTION_TOLERANCE.max(100.0 * redundancy_tolerance) * size {
        return Ok(());
    }
    let (row, rank) = (system_names.row(residual.row), system.rank());
    Err(SolveError::Contradiction { row, residual: residual.residual, rank })
}

fn system_names<M: Constraints>() -> SystemNames {
    SystemNames { rows: M::ROWS, coordinates: M::COORDINATES }
}

/// M, Q (0 unless `with_forces`), Φ_q and γ at a state, by [`gradients::terms`]; `None` where M or Q is not
/// finite, an error where Φ_q or γ is not.
fn evaluate_terms<'w, M: Constraints>(
    model: &M,
    state: &M::State,
    active: &dyn Fn(usize) -> bool,
    with_forces: bool,
    usual_lengths: &mut [f64],
    workspace: &mut WorkspaceSlices<'w>,
) -> Result<Option<ModelTerms<'w>>, SolveError> {
    let (n, r) = (M::Vector::LEN, M::Rows::LEN);
    let read = ModelTerms::new(n, r, workspace);
    let terms = &mut Terms { mass: read.mass, force: read.force, jacobian: read.jacobian, gamma: read.gamma };
    gradients::terms(model, state, terms, usual_lengths);
    if !with_forces {
        terms.force.fill(0.0);
    }
    let row_is_finite =
        |i: usize| read.gamma[i].is_finite() && max_abs(&read.jacobian[i * n..(i + 1) * n]).is_finite();
    if let Some(row) = (0..r).find(|i| active(*i) && !row_is_finite(*i)) {
        return Err(SolveError::ConstraintNotFinite { row: system_names::<M>().row(row) });
    }
    let finite = max_abs(read.mass).is_finite() && max_abs(read.force).is_finite();
    Ok(finite.then_some(read))
}

/// NaN accelerations and multipliers, where M or Q is not finite.
fn undefined<V: Vector, R: Vector>() -> ConstrainedAccelerations<V, R> {
    let mut solution =
        ConstrainedAccelerations { accelerations: V::zeros(), multipliers: R::zeros(), diagnosis: None };
    solution.accelerations.as_mut_slice().fill(f64::NAN);
    solution.multipliers.as_mut_slice().fill(f64::NAN);
    solution
}
