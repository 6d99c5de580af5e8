//! Consistent starts: checks of states against the constraints, and assembly of states that fulfil them.
//!
//! **Positions** that were not given solve Φ(q, t) = 0 by a damped Gauss–Newton method from their guesses.
//! Of all solutions of the linearised constraints each step takes the shortest in the norm ‖δ‖² = Σ
//! Mᵢᵢ δᵢ², so that nothing moves without need. The invariant test of Deuflhard's NLEQ-ERR controls
//! its length (P. Deuflhard, Newton Methods for Nonlinear Problems, Springer 2004, §3.3.3 and §4.4), so
//! that the iterates stay near the path from the guess to its own branch. Where that path ends at a singular
//! configuration, the Levenberg–Marquardt method looks for the closest approach. A gap that remains there
//! is an error with its size.
//!
//! **Velocities** that were not given are those of least kinetic energy among all that fulfil Φ_q
//! q̇ + Φ_t = 0 and A q̇ + b = 0 together with the given ones. In a singular position branches meet, and
//! the velocities of least energy belong to none of them. There the given velocities must determine the
//! branch, otherwise it is an error. Accelerations and multipliers follow from the equations of motion.
//!
//! Released constraints are ignored. Without the feature `alloc` the matrices are on the stack.

mod positions;
mod vanishing_gradient;
mod velocities;
mod workspace;

use super::active_set::active_rows;
use super::nearby::nearby_state;
use super::{Gradients, distance, solve_once, with_workspace};
use crate::declaration::Quantity;
use crate::error::StateError;
use crate::linalg::norm;
use crate::model::{ActiveSet, Constraint, ConstraintKind, Constraints, ModelState, StaticTraits, Vector};
pub use vanishing_gradient::check_gradients;
pub(super) use vanishing_gradient::check_workspace_len;
use vanishing_gradient::vanishing_row;
use workspace::AssemblyWorkspace;
#[cfg(feature = "alloc")]
pub(crate) use workspace::weigh;
pub(super) use workspace::workspace_len;

/// Largest violation with which a state counts as consistent: |Φ| / ‖Φ_q‖ in parts of the size of what
/// the row involves. Coordinates that are given with seven digits leave that much. Projection removes it
/// before a simulation begins.
///
/// The size depends on the purpose. For a start it is the largest value among coordinates of the same unit,
/// of angles at least 1 rad, so that a mechanism of micrometres may miss by millionths of a micrometre. For
/// its velocities it is the larger of the largest velocity and the largest value per unit of time, because a
/// rotation about a fixed point has no speed. Where contacts close and open it is that and the largest
/// parameter of the same unit, up to 1, together. Everywhere else it is 1 + |q|∞.
pub const CONSISTENT: f64 = 1e-6;

/// The same bound for the result of [`assemble`]: rounding, with a margin for residuals of long expressions.
const ASSEMBLY_TOLERANCE: f64 = 1e-10;

/// Checks that a state is finite and fulfils the active constraints, positions first, then velocities, each
/// to [`CONSISTENT`]. Checks also that released constraints slip to the side that the state declares.
///
/// # Errors
/// They name the row with the largest violation, its residual and its distance.
// Users call `build` and `assemble` of a start, which call this.
#[doc(hidden)]
pub fn check_start<M: Constraints>(model: &M, state: &M::State) -> Result<(), StateError> {
    check_active_constraints(model, state, ViolationScale::RowSize)?;
    StateError::check_bodies(model, state)?;
    check_sides(model, state)
}

/// The size that violations of constraints are compared with.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum ViolationScale {
    /// The size of what a row involves: for a start, which the user gave.
    RowSize,
    /// 1 + |q|∞: for a state within a motion, which has integration errors.
    OnePlusLargest,
}

/// [`check_start`] for the active constraints only.
pub(crate) fn check_active_constraints<M: Constraints>(
    model: &M,
    state: &M::State,
    scale: ViolationScale,
) -> Result<(), StateError> {
    StateError::check_parameters(model)?;
    StateError::check::<M>(state)?;
    if M::IS_UNCONSTRAINED {
        return Ok(());
    }
    with_workspace::<M, _>(|workspace| {
        check_positions(model, state, &Gradients::of(model, state, workspace), scale)?;
        reject_vanishing_gradient::<M>(vanishing_row(model, state, workspace))?;
        check_velocities(model, state, &Gradients::of(model, state, workspace), scale)
    })
}

/// The released nonholonomic constraints of one row: their rows and their indices among the switched ones.
/// Constraints of several rows have a side by declaration only.
fn released_slip_rows<M: Constraints>(active_set: ActiveSet) -> impl Iterator<Item = (usize, usize)> {
    let of_one_row = |c: &&Constraint| c.kind == ConstraintKind::Nonholonomic && c.rows == 1;
    let released = move |c: &Constraint| {
        c.switched.filter(|index| !active_set.holds(*index)).map(|index| (c.first, index))
    };
    M::CONSTRAINTS.iter().filter(of_one_row).filter_map(released)
}

/// Sets the sides of released nonholonomic constraints to those to which the velocities slip, except where
/// their bit is set in `given`. A constraint at rest goes to the side to which it is pushed: against the
/// reaction that it would have if it held. The side stays as it is where nothing pushes, where the reaction
/// is unknown (an input without value, a reaction that is not unique), and where the constraint has more than
/// one row.
// Users call `build` and `assemble` of a start, which call this.
#[doc(hidden)]
pub fn set_sides<M: Constraints>(model: &M, state: &mut M::State, given: u32) {
    let active_set = state.active_set();
    if active_set.all_hold() {
        return;
    }
    let slips = model.velocity_residual(state);
    let mut at_rest = 0u32;
    for (row, index) in released_slip_rows::<M>(active_set).filter(|(_, index)| given >> index & 1 == 0) {
        if slips[row].abs() > 0.0 {
            state.active_set_mut().release(index, slips[row]);
        } else {
            at_rest |= 1 << index;
        }
    }
    if at_rest != 0 {
        let mut held = *state;
        (0..ActiveSet::MAX)
            .filter(|index| at_rest >> index & 1 == 1)
            .for_each(|index| held.active_set_mut().engage(index));
        set_sides_at_rest(model, state, &held);
    }
}

/// Sets the sides of constraints that are released in `state` and engaged in `held`: against the reactions.
fn set_sides_at_rest<M: Constraints>(model: &M, state: &mut M::State, held: &M::State) {
    let Ok(constants) = model.constants() else { return };
    let Ok(solved) = solve_once(model, &constants, held) else { return };
    if solved.diagnosis.is_some_and(|diagnosis| !diagnosis.unique()) {
        return;
    }
    for (row, index) in
        released_slip_rows::<M>(state.active_set()).filter(|(_, index)| held.active_set().holds(*index))
    {
        if solved.multipliers[row].abs() > 0.0 {
            state.active_set_mut().release(index, -solved.multipliers[row]);
        }
    }
}

/// Checks that released nonholonomic constraints of one row do not slip against the side that the state
/// declares. Their friction would drive them.
///
/// # Errors
/// [`StateError::WrongSide`]
// Users call `build` and `assemble` of a start, which call this.
#[doc(hidden)]
pub fn check_sides<M: Constraints>(model: &M, state: &M::State) -> Result<(), StateError> {
    let active_set = state.active_set();
    if active_set.all_hold() {
        return Ok(());
    }
    let slips = model.velocity_residual(state);
    let at_rest = CONSISTENT * one_plus_largest(state.u().as_slice());
    with_workspace::<M, _>(|workspace| {
        let gradients = Gradients::of(model, state, workspace);
        let scale = |(row, index): &(usize, usize)| slips[*row] * active_set.side(*index) < 0.0;
        let mut wrong = released_slip_rows::<M>(active_set).filter(scale);
        let wrong = wrong.find(|(row, _)| gradients.distance(*row, slips[*row]) > at_rest);
        wrong.map_or(Ok(()), |(row, _)| {
            Err(StateError::WrongSide { row: M::ROWS[row].name, slip: slips[row] })
        })
    })
}

/// The error for a row whose gradient vanishes.
fn reject_vanishing_gradient<M: Constraints>(row: Option<usize>) -> Result<(), StateError> {
    row.map_or(Ok(()), |row| Err(StateError::VanishingGradient { row: M::ROWS[row].name }))
}

/// Completes a state: solves for the positions, then the velocities that were not given, so that the
/// constraints hold to rounding.
///
/// `state` contains the given values, guesses of other coordinates, and 0 elsewhere. `given_q` and `given_u`
/// have N elements each and mark what must not be changed. Velocities that were not given start from 0.
///
/// # Errors
/// Where a value is not finite, where no positions or no velocities fulfil the constraints together with the
/// given values, and where a guess does not select a branch.
///
/// # Panics
/// Where a slice has fewer than N elements.
pub fn assemble<M: Constraints>(
    model: &M,
    mut state: M::State,
    given_q: &[bool],
    given_u: &[bool],
) -> Result<M::State, StateError> {
    let n = M::COORDINATES.len();
    assert!(given_q.len() >= n && given_u.len() >= n, "one flag per coordinate");
    for (u, _) in state.u_mut().as_mut_slice().iter_mut().zip(given_u).filter(|(_, given)| !**given) {
        *u = 0.0;
    }
    StateError::check_parameters(model)?;
    StateError::check::<M>(&state)?;
    if M::IS_UNCONSTRAINED {
        return StateError::check_bodies(model, &state).map(|()| state);
    }
    with_workspace::<M, _>(|workspace| {
        positions::solve(
            model,
            &mut state,
            &given_q[..n],
            &mut AssemblyWorkspace::new(workspace, n, M::ROWS.len()),
        )?;
        reject_vanishing_gradient::<M>(vanishing_row(model, &state, workspace))?;
        let is_open = velocities::solve(
            model,
            &mut state,
            &given_u[..n],
            &mut AssemblyWorkspace::new(workspace, n, M::ROWS.len()),
        )?;
        if is_open { velocities::check_branch(model, &state, &given_u[..n], workspace) } else { Ok(()) }
    })?;
    StateError::check_bodies(model, &state)?;
    Ok(state)
}

/// Solves for the positions that are not given, and leaves velocities as they are.
#[cfg(feature = "alloc")]
pub fn positions_of<M: Constraints>(
    model: &M,
    mut state: M::State,
    given: &[bool],
) -> Result<M::State, StateError> {
    StateError::check_parameters(model)?;
    StateError::check::<M>(&state)?;
    with_workspace::<M, _>(|workspace| {
        positions::solve(
            model,
            &mut state,
            given,
            &mut AssemblyWorkspace::new(workspace, M::COORDINATES.len(), M::ROWS.len()),
        )?;
        reject_vanishing_gradient::<M>(vanishing_row(model, &state, workspace))
    })?;
    Ok(state)
}

/// A row whose distance |Φ| / ‖Φ_q‖ exceeds its tolerance.
struct Violation {
    row: usize,
    residual: f64,
    distance: f64,
}

/// The row that exceeds its tolerance by the largest factor. `jacobian`: Φ_q at the state, row by row;
/// `usual_lengths`: the usual lengths of its rows.
fn worst_violation<M: Constraints>(
    active_set: ActiveSet,
    holonomic: bool,
    values: &[f64],
    (jacobian, usual_lengths): (&[f64], &[f64]),
    tolerance: impl Fn(&[f64]) -> f64,
) -> Result<Option<Violation>, StateError> {
    let n = M::COORDINATES.len();
    let mut worst_violation: Option<Violation> = None;
    let mut largest_excess = 1.0;
    for row in active_rows::<M>(active_set, holonomic) {
        let (residual, gradient) = (values[row], &jacobian[row * n..][..n]);
        if !residual.is_finite() {
            return Err(StateError::ConstraintNotFinite { row: M::ROWS[row].name });
        }
        if !norm(gradient).is_finite() {
            return Err(StateError::GradientNotFinite { row: M::ROWS[row].name });
        }
        let distance = distance(residual, gradient, usual_lengths[row]);
        let excess = distance / tolerance(gradient);
        if excess > largest_excess {
            (largest_excess, worst_violation) = (excess, Some(Violation { row, residual, distance }));
        }
    }
    Ok(worst_violation)
}

/// Tolerance where all coordinates or velocities of a unit are zero, in parts of the model's own size.
/// Computed values leave rounding of that size.
const ZERO_SIZE_TOLERANCE: f64 = 1e-10;

/// Largest distance that a state with these coordinates or velocities may have from a row with a gradient, as
/// a function of that. Sizes are those of the largest value of a unit, of angles at least `least_angle_size`.
fn violation_tolerance<M: Constraints>(
    model: &M,
    values: &[f64],
    (scale, least_angle_size): (ViolationScale, f64),
) -> impl Fn(&[f64]) -> f64 {
    let own_sizes = sizes_by_unit::<M>(|quantity| model_size(model, quantity));
    let sizes = sizes_by_unit::<M>(|quantity| {
        let largest = largest_with_unit::<M>(values, quantity.unit);
        if quantity.is_angle() { f64::max(largest, least_angle_size) } else { largest }
    });
    let one_plus_largest = one_plus_largest(values);
    move |gradient| {
        if scale == ViolationScale::OnePlusLargest {
            return CONSISTENT * one_plus_largest;
        }
        // A vanishing gradient has no direction.
        CONSISTENT * row_size(gradient, &sizes).unwrap_or(one_plus_largest)
            + ZERO_SIZE_TOLERANCE * row_size(gradient, &own_sizes).unwrap_or(1.0)
    }
}

/// The size of every coordinate, from sizes by unit, which are looked up once for each unit.
fn sizes_by_unit<M: Constraints>(of_unit: impl Fn(&Quantity) -> f64) -> M::Vector {
    let mut sizes = M::Vector::zeros();
    for (i, coordinate) in M::COORDINATES.iter().enumerate() {
        let is_same = |of: &&Quantity| of.unit == coordinate.unit && of.dimension == coordinate.dimension;
        let known = M::COORDINATES[..i].iter().position(|of| is_same(&of));
        sizes[i] = known.map_or_else(|| of_unit(coordinate), |known| sizes[known]);
    }
    sizes
}

/// The largest of the values whose coordinates have this unit.
fn largest_with_unit<M: Constraints>(values: &[f64], unit: &str) -> f64 {
    let same = M::COORDINATES.iter().zip(values).filter(|(coordinate, _)| coordinate.unit == unit);
    same.fold(0.0, |largest, (_, value)| f64::max(largest, value.abs()))
}

/// The size of what a row involves, Σ |gⱼ| sⱼ / ‖g‖, from the sizes of the coordinates. `None` where
/// its gradient vanishes.
fn row_size<V: Vector>(gradient: &[f64], sizes: &V) -> Option<f64> {
    let steepness = norm(gradient);
    let involved = gradient.iter().zip(sizes.as_slice()).filter(|(g, _)| **g != 0.0);
    let sum: f64 = involved.map(|(g, size)| g.abs() * size).sum();
    (steepness > 0.0).then_some(sum / steepness)
}

/// The model's own size of values with the unit of a quantity: its largest parameter of this unit, up to 1.
/// It is 1 for angles, without units, and where there is no such parameter.
fn model_size<M: Constraints>(model: &M, quantity: &Quantity) -> f64 {
    if quantity.unit.is_empty() || quantity.is_angle() {
        return 1.0;
    }
    let same = M::PARAMETERS.iter().enumerate().filter(|(_, parameter)| parameter.unit == quantity.unit);
    let largest =
        same.filter_map(|(i, _)| model.parameter(i)).fold(0.0, |most, value| f64::max(most, value.abs()));
    if largest > 0.0 { largest.min(1.0) } else { 1.0 }
}

/// The size of a row with this gradient where contacts close and open, and for its drift; for coordinates or,
/// per unit of time, velocities. It is the model's own size and the largest value of the same unit together.
#[cfg(feature = "alloc")]
pub(crate) fn size_along<M: Constraints>(model: &M, values: &[f64], gradient: &[f64]) -> f64 {
    let of_unit =
        |quantity: &Quantity| model_size(model, quantity) + largest_with_unit::<M>(values, quantity.unit);
    row_size(gradient, &sizes_by_unit::<M>(of_unit)).unwrap_or_else(|| one_plus_largest(values))
}

/// A lower bound of the [size](size_along) of every row.
#[cfg(feature = "alloc")]
pub(crate) fn least_size<M: Constraints>(model: &M) -> f64 {
    M::COORDINATES.iter().map(|coordinate| model_size(model, coordinate)).fold(1.0, f64::min)
}

/// 1 + |v|∞.
fn one_plus_largest(values: &[f64]) -> f64 {
    values.iter().fold(1.0, |most, value| f64::max(most, 1.0 + value.abs()))
}

/// The name of a row, and that of its constraint if this is a switched one.
pub(crate) fn row_names<M: Constraints>(row: usize) -> (&'static str, Option<&'static str>) {
    let mut switched = M::CONSTRAINTS.iter().filter(|c| c.switched.is_some());
    let of_row = switched.find(|c| (c.first..c.first + c.rows).contains(&row));
    (M::ROWS[row].name, of_row.map(|c| c.name))
}

fn check_positions<M: Constraints>(
    model: &M,
    state: &M::State,
    gradients: &Gradients<'_>,
    scale: ViolationScale,
) -> Result<(), StateError> {
    let values = model.residual(state);
    let tolerance = violation_tolerance(model, state.q().as_slice(), (scale, 1.0));
    match worst_violation::<M>(
        state.active_set(),
        true,
        values.as_slice(),
        (gradients.rows, gradients.usual_lengths),
        tolerance,
    )? {
        Some(Violation { row, residual, distance }) => {
            let (row, switched) = row_names::<M>(row);
            Err(StateError::ConstraintViolated { row, residual, distance, switched })
        }
        None => Ok(()),
    }
}

fn check_velocities<M: Constraints>(
    model: &M,
    state: &M::State,
    gradients: &Gradients<'_>,
    scale: ViolationScale,
) -> Result<(), StateError> {
    let values = model.velocity_residual(state);
    // At rest, and in a rotation about a fixed point, there is no speed to compare with: the tolerance is
    // then that of the coordinates, per unit of time.
    let of_speed = violation_tolerance(model, state.u().as_slice(), (scale, 0.0));
    let of_position = violation_tolerance(model, state.q().as_slice(), (scale, 1.0));
    let tolerance = |gradient: &[f64]| of_speed(gradient).max(of_position(gradient));
    match worst_violation::<M>(
        state.active_set(),
        false,
        values.as_slice(),
        (gradients.rows, gradients.usual_lengths),
        tolerance,
    )? {
        Some(Violation { row, residual, distance }) => {
            let (row, switched) = row_names::<M>(row);
            Err(StateError::VelocityViolated { row, residual, distance, switched })
        }
        None => Ok(()),
    }
}

/// No coordinate is given. It has more elements than any generated model has coordinates.
const NOTHING_GIVEN: [bool; 4096] = [false; 4096];

/// A state on the constraints near this one (see [`nearby_state`]); `None` where none was found.
pub(crate) fn nearby_on_constraints<M: Constraints>(
    model: &M,
    state: &M::State,
    workspace: &mut [f64],
) -> Option<M::State> {
    let n = M::COORDINATES.len();
    let none = NOTHING_GIVEN.get(..n)?;
    let mut row_size = nearby_state::<M>(state);
    let placed = positions::solve(
        model,
        &mut row_size,
        none,
        &mut AssemblyWorkspace::new(workspace, n, M::ROWS.len()),
    );
    placed.ok().map(|()| row_size)
}
