//! Constraints at run time: accelerations and reactions, corrections of positions and velocities, and what
//! they say of themselves.
//!
//! Where the macro found straight-line code for a model's equations that code is used
//! ([`Constraints::solve_unrolled`]); where it does not apply — a pivot vanishes, there is no code for what
//! is released, constraints repeat each other — a general solver takes over that decides the rank at the
//! state at hand. Everything works in memory that the caller lends, [`workspace_len`] numbers of it, and
//! allocates nothing.

#[cfg(feature = "alloc")]
pub(crate) mod compare;
#[cfg(feature = "alloc")]
pub(crate) mod conditioning;
mod correct;
mod embed;
mod friction;
pub(crate) mod gradients;
pub(crate) mod held;
mod impact;
#[cfg(feature = "alloc")]
pub(crate) mod inertia;
#[cfg(feature = "alloc")]
pub(crate) mod mechanism;
pub(crate) mod nearby;
mod project;
mod speeds;
pub(crate) mod system;
mod unconstrained;

#[cfg(feature = "alloc")]
pub use compare::{Comparison, Formulated};
pub use correct::{correct, solve_baumgarte};
pub use embed::Embedding;
pub(crate) use gradients::{Gradients, distance};
pub use held::{ActiveRows, active_rows};
pub use impact::{ImpactSolution, impact};
#[cfg(feature = "alloc")]
pub use mechanism::{ConstraintReaction, multipliers, reactions};
pub use nearby::at_time;
pub use project::{Projection, project_along, project_positions, project_velocities};
pub use speeds::move_by_speeds;
pub use system::RANK_TOLERANCE;

use held::holds;
use system::{FactoredSystem, Miss, Names, Read};

use crate::error::SolveError;
use crate::linalg::{WorkMemory, max_abs};
use crate::model::{Constraints, Known, ModelState, Route, Solved, Terms, Vector, Workspace};

// Public for dynamics-analysis alone. What users call is exported below.
#[doc(hidden)]
pub mod assemble;
#[cfg(feature = "alloc")]
pub(crate) mod weakness;

pub use crate::declaration::Involved;
pub use assemble::{assemble, check_gradients, check_sides, check_start, set_sides};

/// Length of the memory that the general solvers need for n coordinates and r constraint rows.
#[must_use]
pub const fn workspace_len(n: usize, r: usize) -> usize {
    let read = n * n + n + n * r + r;
    let solving = read + 2 * r + system::memory(n, r);
    greatest([
        solving,
        embed::memory(n, r),
        assemble::memory(n, r),
        friction::memory_in_all(n, r),
        gradients::memory(n, r),
        assemble::check_memory(n, r),
        speeds::memory(n, r),
    ])
}

/// The memory that a caller lends for n coordinates and r constraint rows.
///
/// # Panics
/// Where it is shorter than [`workspace_len`] says: a fault of the program, not of its input.
fn lent(workspace: &mut [f64], n: usize, r: usize) -> WorkMemory<'_> {
    let (needed, given) = (workspace_len(n, r), workspace.len());
    assert!(
        given >= needed,
        "a workspace of {given} numbers for {n} coordinates and {r} rows; give {needed}"
    );
    WorkMemory::new(workspace)
}

const fn greatest<const K: usize>(lengths: [usize; K]) -> usize {
    let (mut most, mut i) = (0, 0);
    while i < K {
        if lengths[i] > most {
            most = lengths[i];
        }
        i += 1;
    }
    most
}

/// Φ_q a = γ is contradictory where no a comes closer than this, against the size of γ: well above what the
/// drift of an unstabilised motion leaves on constraints that repeat each other.
const CONTRADICTION: f64 = 1e-6;
/// Part of the accelerations that joins γ there: at rest γ is rounding, and so is what misses it. A
/// contradiction is then larger than 1e-12 of a.
const ROUNDED: f64 = 1e-6;

/// What the general solver found about the constraints at a state.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Diagnosis {
    /// Number of rows that hold.
    pub active: usize,
    /// Rank of their Jacobian. Below [`Diagnosis::active`] some rows repeat others: the accelerations are
    /// unique, the multipliers are not, and those of least norm are given (in accelerations: Σ (λᵢ ‖Φ_q,ᵢ‖)²
    /// is least, with coordinates scaled by the square roots of their inertias).
    pub rank: usize,
    /// First over last pivot of the Jacobian, with rows at unit length: the loss of digits in the
    /// multipliers.
    pub condition: f64,
}

impl Diagnosis {
    /// Whether the multipliers are unique.
    #[must_use]
    pub fn unique(&self) -> bool {
        self.rank == self.active
    }
}

/// q̈ and λ at a state.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Outcome<V, R> {
    /// q̈.
    pub accelerations: V,
    /// λ; 0 for rows of released constraints.
    pub multipliers: R,
    /// What the general solver found; `None` where the generated code did the work.
    pub diagnosis: Option<Diagnosis>,
}

impl<V, R> Outcome<V, R> {
    /// Whether the multipliers are unique: always where the generated code applies.
    #[must_use]
    pub fn unique(&self) -> bool {
        self.diagnosis.is_none_or(|d| d.unique())
    }
}

impl<V, R> From<Solved<V, R>> for Outcome<V, R> {
    fn from(Solved { accelerations, multipliers }: Solved<V, R>) -> Self {
        Self { accelerations, multipliers, diagnosis: None }
    }
}

/// An outcome of a model.
pub type OutcomeOf<M> = Outcome<<M as crate::model::Model>::Vector, <M as Constraints>::Rows>;

/// q̈ and λ: by the generated code where it applies, else by the general solver.
///
/// In a change point, where constraints that are independent elsewhere have a lower rank, accelerations are
/// those of least norm, which need not be those of a branch: the diagnosis tells, as for multipliers that are
/// not unique. Runs take the limit along the branch of their velocities.
///
/// # Errors
/// No mass matrix on the motions that the constraints leave, contradictory constraints, constraints that are
/// not finite.
pub fn solve<M: Constraints>(
    model: &M,
    constants: &M::Constants,
    state: &M::State,
    workspace: &mut [f64],
) -> Result<OutcomeOf<M>, SolveError> {
    if M::IS_DIRECT {
        return direct(model, constants, state);
    }
    match model.solve_unrolled(constants, state) {
        Some(solved) => Ok(solved.into()),
        None => solve_general(model, state, workspace),
    }
}

/// [`solve`] with memory of its own: on the stack where it is small or there is no other, allocated where it
/// is large. Where the generated code applies none is needed.
///
/// # Errors
/// As [`solve`].
pub fn solve_once<M: Constraints>(
    model: &M,
    constants: &M::Constants,
    state: &M::State,
) -> Result<OutcomeOf<M>, SolveError> {
    if M::IS_DIRECT {
        return direct(model, constants, state);
    }
    match model.solve_unrolled(constants, state) {
        Some(solved) => Ok(solved.into()),
        None => with_workspace::<M, _>(|workspace| solve_general(model, state, workspace)),
    }
}

/// q̈ at a state.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Accelerated<V> {
    /// q̈.
    pub accelerations: V,
    /// What the general solver found; `None` where the generated code did the work.
    pub diagnosis: Option<Diagnosis>,
}

impl<V, R> From<Outcome<V, R>> for Accelerated<V> {
    fn from(Outcome { accelerations, diagnosis, .. }: Outcome<V, R>) -> Self {
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
) -> Result<Accelerated<M::Vector>, SolveError> {
    let unrolled = match M::ROUTE {
        Route::Unconstrained => Some(model.accelerations_with(constants, state)?),
        _ => model.accelerate_unrolled(constants, state),
    };
    match unrolled {
        Some(accelerations) => Ok(Accelerated { accelerations, diagnosis: None }),
        None => solve_general(model, state, workspace).map(Accelerated::from),
    }
}

/// What generated code gives for a model.
pub type SolvedOf<M> = Solved<<M as crate::model::Model>::Vector, <M as Constraints>::Rows>;

/// Of a model without constraints.
fn direct<M: Constraints>(
    model: &M,
    constants: &M::Constants,
    state: &M::State,
) -> Result<OutcomeOf<M>, SolveError> {
    let accelerations = model.accelerations_with(constants, state)?;
    Ok(Outcome { accelerations, multipliers: M::Rows::zeros(), diagnosis: None })
}

/// Largest memory, in numbers, that is put on the stack where there is a heap: 64 kB.
#[cfg(feature = "alloc")]
const ON_STACK: usize = 8192;

/// Calls a function with memory of [`workspace_len`].
#[cold]
pub fn with_workspace<M: Constraints, R>(f: impl FnOnce(&mut [f64]) -> R) -> R {
    #[inline(never)]
    fn on_stack<M: Constraints, R>(f: impl FnOnce(&mut [f64]) -> R) -> R {
        f(M::Workspace::new().as_mut_slice())
    }
    #[cfg(feature = "alloc")]
    {
        let len = const { workspace_len(M::Vector::LEN, M::Rows::LEN) };
        if len > ON_STACK {
            return f(&mut alloc::vec![0.0; len]);
        }
    }
    on_stack::<M, R>(f)
}

/// q̈ and λ by the general solver, whatever the generated code could do.
///
/// A mass matrix or force that is not a number gives accelerations that are none, as in models without
/// constraints.
///
/// # Errors
/// As [`solve`].
pub fn solve_general<M: Constraints>(
    model: &M,
    state: &M::State,
    workspace: &mut [f64],
) -> Result<OutcomeOf<M>, SolveError> {
    general(model, state, None, workspace)
}

/// [`solve_general`] with Φ_q q̈ = γ + `more`.
fn general<M: Constraints>(
    model: &M,
    state: &M::State,
    more: Option<&M::Rows>,
    workspace: &mut [f64],
) -> Result<OutcomeOf<M>, SolveError> {
    if M::FRICTION {
        return friction::solve(model, state, more, false, workspace);
    }
    general_with(model, state, more, true, workspace)
}

/// q̈ of a mechanism without freedom, where it follows from Φ_q q̈ = γ alone: inputs that only load it need
/// no value.
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
        _ => Ok(general_with(model, state, None, false, workspace)?.accelerations),
    }
}

/// That no multiplier is missing for want of an input.
///
/// # Errors
/// [`SolveError::InputNotSet`], where one is not a number and an input is none.
#[cfg(feature = "alloc")]
pub(crate) fn check_inputs<M: Constraints>(state: &M::State, multipliers: &[f64]) -> Result<(), SolveError> {
    let unset = || state.inputs().as_slice().iter().position(|x| x.is_nan());
    match multipliers.iter().any(|x| x.is_nan()).then(unset).flatten() {
        Some(input) => Err(SolveError::InputNotSet { input: M::INPUTS[input].name }),
        None => Ok(()),
    }
}

/// [`general`] without friction; Q counts as 0 unless `forces`.
fn general_with<M: Constraints>(
    model: &M,
    state: &M::State,
    more: Option<&M::Rows>,
    forces: bool,
    workspace: &mut [f64],
) -> Result<OutcomeOf<M>, SolveError> {
    let modes = state.modes();
    let active = |row: usize| holds::<M>(modes, row);
    let Some(mut factored) = Factored::new(model, state, &active, forces, workspace)? else {
        return Ok(not_a_number());
    };
    if factored.system.vanished {
        // A row is zero: at a change point it may be, where constraints cross; where it always is, the
        // constraint holds nothing. The check works in the same memory.
        check_gradients(model, state, workspace)?;
        let Some(again) = Factored::new(model, state, &active, forces, workspace)? else {
            return Ok(not_a_number());
        };
        factored = again;
    }
    if let Some(more) = more {
        factored.gamma.iter_mut().zip(more.as_slice()).for_each(|(gamma, more)| *gamma += more);
        // Nothing else brings back rows that drift, and where coordinates are embedded stages lie on the
        // manifold.
        factored.system.weigh_alike();
    }
    let Factored { force, gamma, floor, slack, system } = &mut factored;
    let mut accelerations = M::Vector::zeros();
    let mut multipliers = M::Rows::zeros();
    let miss = system.solve(force, gamma, accelerations.as_mut_slice(), multipliers.as_mut_slice());
    let size = miss.scale + system.size_of_rows(floor) + ROUNDED * miss.reach;
    contradiction(miss, size, *slack, system, names::<M>())?;
    Ok(Outcome { accelerations, multipliers, diagnosis: Some(diagnosis(system)) })
}

/// That the reaction of a row that holds is decided, whatever other rows repeat each other.
///
/// # Errors
/// [`SolveError::ReactionNotUnique`] where it is not. As [`solve`].
#[cfg(feature = "alloc")]
pub(crate) fn check_unique<M: Constraints>(
    model: &M,
    state: &M::State,
    row: usize,
    workspace: &mut [f64],
) -> Result<(), SolveError> {
    let modes = state.modes();
    let factored = Factored::new(model, state, &|row| holds::<M>(modes, row), true, workspace)?;
    match factored.is_none_or(|mut factored| factored.system.is_unique(row)) {
        true => Ok(()),
        false => Err(SolveError::ReactionNotUnique { row: names::<M>().row(row) }),
    }
}

fn diagnosis(system: &FactoredSystem<'_>) -> Diagnosis {
    Diagnosis { active: system.active(), rank: system.rank(), condition: system.condition() }
}

/// How far rows that are declared to repeat others may differ from what they repeat: on the manifold not at
/// all, beside it by the order of the distance. Taken for independent there, they would be divided by that
/// distance, and the accelerations would be noise.
fn slack<M: Constraints>(
    model: &M,
    state: &M::State,
    jacobian: &[f64],
    active: &dyn Fn(usize) -> bool,
) -> f64 {
    if !M::CONSTRAINTS.iter().any(|c| c.redundant) {
        return system::RANK_TOLERANCE;
    }
    let off = |values: &[f64], at: &M::Vector| {
        let rows = values.iter().zip(jacobian.chunks_exact(M::Vector::LEN)).enumerate();
        // A row that is zero, at a change point, says nothing.
        let of = |(_, (x, row)): (usize, (&f64, &[f64]))| {
            Some(distance(*x, row, 0.0)).filter(|distance| *distance < f64::INFINITY)
        };
        let distances = rows.filter(|(row, _)| active(*row)).filter_map(of);
        distances.fold(0.0, f64::max) / (1.0 + max_abs(at.as_slice()))
    };
    let (residual, rate) = (model.residual(state), model.velocity_residual(state));
    let distance = off(residual.as_slice(), state.q()).max(off(rate.as_slice(), state.u()));
    // A curvature of a hundred per unit of length is allowed for; beyond a tenth nothing is known any more.
    (100.0 * distance).clamp(system::RANK_TOLERANCE, 0.1)
}

/// The factored equations of a model at a state.
struct Factored<'w> {
    /// Q.
    force: &'w mut [f64],
    /// γ.
    gamma: &'w mut [f64],
    /// Σⱼ |Φ_q,ᵢⱼ| q̇ⱼ², the size of what γ is made of: where that cancels, what is left over of rounding and
    /// of states a little off the constraints is no contradiction.
    floor: &'w mut [f64],
    /// How far rows that repeat each other may differ.
    slack: f64,
    system: FactoredSystem<'w>,
}

impl<'w> Factored<'w> {
    /// With the rows that `active` admits. Where `forces` is not set Q is 0, whatever inputs that were not
    /// set make of it: for whoever brings forces of their own, or none. `None` where M or Q is not finite.
    fn new<M: Constraints>(
        model: &M,
        state: &M::State,
        active: &dyn Fn(usize) -> bool,
        forces: bool,
        workspace: &'w mut [f64],
    ) -> Result<Option<Self>, SolveError> {
        Self::in_memory(model, state, active, forces, lent(workspace, M::Vector::LEN, M::Rows::LEN))
    }

    fn in_memory<M: Constraints>(
        model: &M,
        state: &M::State,
        active: &dyn Fn(usize) -> bool,
        forces: bool,
        mut memory: WorkMemory<'w>,
    ) -> Result<Option<Self>, SolveError> {
        let usual = memory.take(M::Rows::LEN);
        let Some(read) = read(model, state, active, forces, usual, &mut memory)? else { return Ok(None) };
        let Read { mass, force, jacobian, gamma } = read;
        let floor = memory.take(M::Rows::LEN);
        for (floor, row) in floor.iter_mut().zip(jacobian.chunks_exact(M::Vector::LEN)) {
            *floor = row.iter().zip(state.u().as_slice()).map(|(x, u)| x.abs() * u * u).sum();
        }
        let slack = slack(model, state, jacobian, active);
        let system = FactoredSystem::factor(
            mass,
            jacobian,
            active,
            &is_redundant::<M>,
            (slack, usual),
            names::<M>(),
            &mut memory,
        )?;
        Ok(Some(Self { force, gamma, floor, slack, system }))
    }
}

/// Whether a row is declared to repeat others.
fn is_redundant<M: Constraints>(row: usize) -> bool {
    M::CONSTRAINTS.iter().any(|c| c.redundant && (c.first..c.first + c.rows).contains(&row))
}

fn contradiction(
    miss: Miss,
    size: f64,
    slack: f64,
    system: &FactoredSystem<'_>,
    names: Names,
) -> Result<(), SolveError> {
    if miss.size <= CONTRADICTION.max(100.0 * slack) * size {
        return Ok(());
    }
    let (row, rank) = (names.row(miss.row), system.rank());
    Err(SolveError::Contradiction { row, residual: miss.residual, rank })
}

fn names<M: Constraints>() -> Names {
    Names { rows: M::ROWS, coordinates: M::COORDINATES }
}

/// M, Q (0 unless `forces`), Φ_q and γ at a state, by [`gradients::terms`]; `None` where M or Q is not
/// finite, an error where Φ_q or γ is not.
fn read<'w, M: Constraints>(
    model: &M,
    state: &M::State,
    active: &dyn Fn(usize) -> bool,
    forces: bool,
    usual: &mut [f64],
    memory: &mut WorkMemory<'w>,
) -> Result<Option<Read<'w>>, SolveError> {
    let (n, r) = (M::Vector::LEN, M::Rows::LEN);
    let read = Read::new(n, r, memory);
    let terms = &mut Terms { mass: read.mass, force: read.force, jacobian: read.jacobian, gamma: read.gamma };
    gradients::terms(model, state, terms, usual);
    if !forces {
        terms.force.fill(0.0);
    }
    let row_is_finite =
        |i: usize| read.gamma[i].is_finite() && max_abs(&read.jacobian[i * n..(i + 1) * n]).is_finite();
    if let Some(row) = (0..r).find(|i| active(*i) && !row_is_finite(*i)) {
        return Err(SolveError::ConstraintNotFinite { row: names::<M>().row(row) });
    }
    let finite = max_abs(read.mass).is_finite() && max_abs(read.force).is_finite();
    Ok(finite.then_some(read))
}

fn not_a_number<V: Vector, R: Vector>() -> Outcome<V, R> {
    let mut outcome = Outcome { accelerations: V::zeros(), multipliers: R::zeros(), diagnosis: None };
    outcome.accelerations.as_mut_slice().fill(f64::NAN);
    outcome.multipliers.as_mut_slice().fill(f64::NAN);
    outcome
}
