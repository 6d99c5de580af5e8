//! Consistent starts: states checked against the constraints, and states completed so that they fulfil them.
//!
//! **Positions** that were not given solve Φ(q, t) = 0 by a damped Gauss–Newton method from their guesses. Of
//! all solutions of the linearised constraints each step takes the shortest in the norm ‖δ‖² = Σ Mᵢᵢ δᵢ², so
//! that nothing moves that need not, and its length is controlled by the invariant test of Deuflhard's
//! NLEQ-ERR (P. Deuflhard, Newton Methods for Nonlinear Problems, Springer 2004, §3.3.3 and §4.4), so that
//! the iterates stay near the path that leads from the guess to its own branch. Where that path ends (a
//! singular configuration lies across it), the Levenberg–Marquardt method looks for the closest approach;
//! what is then still open is an error that says by how much.
//!
//! **Velocities** that were not given are those of least kinetic energy among all that fulfil Φ_q q̇ + Φ_t =
//! 0 and A q̇ + b = 0 together with those given. In a singular position branches meet, and the velocities of
//! least energy belong to none of them: what is given has to decide, or it is an error. Accelerations and
//! multipliers follow from the equations of motion.
//!
//! Released constraints take no part. Nothing here allocates where the crate does not (`alloc` takes the
//! matrices off the stack).

mod positions;
mod room;
mod vanishing;
mod velocities;

use super::held::active_rows;
use super::nearby::beside;
use super::{Gradients, distance, solve_once, with_workspace};
use crate::error::StateError;
use crate::linalg::norm;
use crate::model::{Constraint, ConstraintKind, Constraints, Known, ModelState, Modes, Vector};
use room::Room;
pub(super) use room::memory;
#[cfg(feature = "alloc")]
pub(crate) use room::weigh;
pub use vanishing::check_gradients;
pub(super) use vanishing::check_memory;
use vanishing::vanishing_row;

/// Largest violation with which a state counts as consistent, |Φ| / ‖Φ_q‖ against the size of what it
/// involves: what is left when coordinates are given with seven digits. Projection removes it before a
/// simulation begins.
///
/// A start is judged by the largest value among coordinates of the same unit, an angle by 1 rad at least, so
/// that a mechanism of micrometres may miss by millionths of that; its velocities by the larger of the
/// largest velocity and the largest value, per unit of time, as what turns round has no speed. Where contacts
/// are met and left, what counts is that and the largest parameter of the same unit, up to 1, together; all
/// else is judged against 1 + |q|∞.
pub const CONSISTENT: f64 = 1e-6;

/// The same for what [`assemble`] returns: rounding, with a margin for residuals of long expressions.
const ASSEMBLED: f64 = 1e-10;

/// Checks that a state is finite and fulfils the constraints that hold: positions, then velocities, each to
/// [`CONSISTENT`]; and that what is released slips to the side that the state says.
///
/// # Errors
/// With the row that is violated most, its residual and the distance from fulfilling it.
// Users call `build` and `assemble` of a start, which call this.
#[doc(hidden)]
pub fn check_start<M: Constraints>(model: &M, state: &M::State) -> Result<(), StateError> {
    check_held(model, state, Against::ItsSize)?;
    StateError::check_bodies(model, state)?;
    check_sides(model, state)
}

/// What misses of constraints are judged against.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Against {
    /// The size of what a row involves: a start, which was given.
    ItsSize,
    /// 1 + |q|∞: a state within a motion, which has errors of its own.
    Unity,
}

/// [`check_start`] for the constraints that hold alone.
pub(crate) fn check_held<M: Constraints>(
    model: &M,
    state: &M::State,
    against: Against,
) -> Result<(), StateError> {
    StateError::check_parameters(model)?;
    StateError::check::<M>(state)?;
    if M::IS_FREE {
        return Ok(());
    }
    with_workspace::<M, _>(|memory| {
        check_positions(model, state, &Gradients::of(model, state, memory), against)?;
        refuse::<M>(vanishing_row(model, state, memory))?;
        check_velocities(model, state, &Gradients::of(model, state, memory), against)
    })
}

/// The released nonholonomic constraints of one row: their rows and their indices among the switched ones.
/// Those of more rows have a side by declaration only.
fn slipping<M: Constraints>(modes: Modes) -> impl Iterator<Item = (usize, usize)> {
    let of_one_row = |c: &&Constraint| c.kind == ConstraintKind::Nonholonomic && c.rows == 1;
    let released =
        move |c: &Constraint| c.switched.filter(|index| !modes.holds(*index)).map(|index| (c.first, index));
    M::CONSTRAINTS.iter().filter(of_one_row).filter_map(released)
}

/// Releases nonholonomic constraints that are released to the side to which the velocities slip, but for
/// those whose bit is set in `given`. What is at rest goes to the side to which it is pushed where it does
/// not rub: against its reaction if it held. What is not pushed, or not known to be (an input that has no
/// value yet, a reaction that is not unique), and what has more than one row stays as it is.
// Users call `build` and `assemble` of a start, which call this.
#[doc(hidden)]
pub fn set_sides<M: Constraints>(model: &M, state: &mut M::State, given: u32) {
    let modes = state.modes();
    if modes.all_hold() {
        return;
    }
    let slips = model.velocity_residual(state);
    let mut rest = 0u32;
    for (row, index) in slipping::<M>(modes).filter(|(_, index)| given >> index & 1 == 0) {
        if slips[row].abs() > 0.0 {
            state.modes_mut().release(index, slips[row]);
        } else {
            rest |= 1 << index;
        }
    }
    if rest != 0 {
        let mut held = *state;
        (0..Modes::MOST)
            .filter(|index| rest >> index & 1 == 1)
            .for_each(|index| held.modes_mut().engage(index));
        set_sides_at_rest(model, state, &held);
    }
}

/// The sides of what is released in a state and holds in the same one, `held`: against the reactions.
fn set_sides_at_rest<M: Constraints>(model: &M, state: &mut M::State, held: &M::State) {
    let Ok(constants) = model.constants() else { return };
    let Ok(solved) = solve_once(model, &constants, held) else { return };
    if solved.diagnosis.is_some_and(|diagnosis| !diagnosis.unique()) {
        return;
    }
    for (row, index) in slipping::<M>(state.modes()).filter(|(_, index)| held.modes().holds(*index)) {
        if solved.multipliers[row].abs() > 0.0 {
            state.modes_mut().release(index, -solved.multipliers[row]);
        }
    }
}

/// Checks that released nonholonomic constraints of one row do not slip to the other side than the state
/// says: friction would drive them.
///
/// # Errors
/// [`StateError::WrongSide`]
// Users call `build` and `assemble` of a start, which call this.
#[doc(hidden)]
pub fn check_sides<M: Constraints>(model: &M, state: &M::State) -> Result<(), StateError> {
    let modes = state.modes();
    if modes.all_hold() {
        return Ok(());
    }
    let slips = model.velocity_residual(state);
    let rest = CONSISTENT * size(state.u().as_slice());
    with_workspace::<M, _>(|memory| {
        let gradients = Gradients::of(model, state, memory);
        let against = |(row, index): &(usize, usize)| slips[*row] * modes.side(*index) < 0.0;
        let mut wrong = slipping::<M>(modes).filter(against);
        let wrong = wrong.find(|(row, _)| gradients.distance(*row, slips[*row]) > rest);
        wrong.map_or(Ok(()), |(row, _)| {
            Err(StateError::WrongSide { row: M::ROWS[row].name, slip: slips[row] })
        })
    })
}

fn refuse<M: Constraints>(row: Option<usize>) -> Result<(), StateError> {
    row.map_or(Ok(()), |row| Err(StateError::VanishingGradient { row: M::ROWS[row].name }))
}

/// Completes a state: solves the positions, then the velocities that were not given, so that the constraints
/// hold to rounding.
///
/// `state` holds what was given, guesses for other coordinates, and 0 elsewhere; `given_q` and `given_u` have
/// N elements each and say what must not be changed. Velocities that were not given start from nothing,
/// whatever the state says.
///
/// # Errors
/// Where a value is not finite, where no positions or no velocities fulfil the constraints together with what
/// was given, and where a guess does not decide between branches.
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
    if M::IS_FREE {
        return StateError::check_bodies(model, &state).map(|()| state);
    }
    with_workspace::<M, _>(|memory| {
        positions::solve(model, &mut state, &given_q[..n], &mut Room::new(memory, n, M::ROWS.len()))?;
        refuse::<M>(vanishing_row(model, &state, memory))?;
        let open =
            velocities::solve(model, &mut state, &given_u[..n], &mut Room::new(memory, n, M::ROWS.len()))?;
        if open { velocities::check_branch(model, &state, &given_u[..n], memory) } else { Ok(()) }
    })?;
    StateError::check_bodies(model, &state)?;
    Ok(state)
}

/// Solves the positions that are not given, and leaves velocities as they are.
#[cfg(feature = "alloc")]
pub fn positions_of<M: Constraints>(
    model: &M,
    mut state: M::State,
    given: &[bool],
) -> Result<M::State, StateError> {
    StateError::check_parameters(model)?;
    StateError::check::<M>(&state)?;
    with_workspace::<M, _>(|memory| {
        positions::solve(
            model,
            &mut state,
            given,
            &mut Room::new(memory, M::COORDINATES.len(), M::ROWS.len()),
        )?;
        refuse::<M>(vanishing_row(model, &state, memory))
    })?;
    Ok(state)
}

/// The row with the largest distance |value| / ‖Φ_q row‖, if that is above the tolerance against `size`.
struct Violation {
    row: usize,
    residual: f64,
    distance: f64,
}

/// `jacobian`: Φ_q at the state, row by row; `usual`: the usual lengths of its rows.
fn worst<M: Constraints>(
    modes: Modes,
    holonomic: bool,
    values: &[f64],
    (jacobian, usual): (&[f64], &[f64]),
    tolerance: impl Fn(&[f64]) -> f64,
) -> Result<Option<Violation>, StateError> {
    let n = M::COORDINATES.len();
    let mut worst: Option<Violation> = None;
    // By how many times more than permitted.
    let mut most = 1.0;
    for row in active_rows::<M>(modes, holonomic) {
        let (residual, gradient) = (values[row], &jacobian[row * n..][..n]);
        if !residual.is_finite() {
            return Err(StateError::ConstraintNotFinite { row: M::ROWS[row].name });
        }
        if !norm(gradient).is_finite() {
            return Err(StateError::GradientNotFinite { row: M::ROWS[row].name });
        }
        let distance = distance(residual, gradient, usual[row]);
        let times = distance / tolerance(gradient);
        if times > most {
            (most, worst) = (times, Some(Violation { row, residual, distance }));
        }
    }
    Ok(worst)
}

/// By how much coordinates of zero may miss, or their velocities: what computed ones leave of zero.
const OF_ZERO: f64 = 1e-10;

/// How far a state may miss a row with this gradient, where these are its coordinates or velocities; its size
/// is that of the largest of their unit, of an angle `least` at least.
fn permitted<M: Constraints>(
    model: &M,
    values: &[f64],
    gradient: &[f64],
    (against, least): (Against, f64),
) -> f64 {
    if against == Against::Unity {
        return CONSISTENT * size(values);
    }
    let of_unit = |unit: &str| {
        let most = largest_of::<M>(values, unit);
        if unit == "rad" { f64::max(most, least) } else { most }
    };
    // Where the gradient vanishes it has no direction.
    let scale = along::<M>(gradient, of_unit).unwrap_or_else(|| size(values));
    CONSISTENT * scale + OF_ZERO * along::<M>(gradient, |unit| own_size(model, unit)).unwrap_or(1.0)
}

/// The largest of the values whose coordinates have a unit.
fn largest_of<M: Constraints>(values: &[f64], unit: &str) -> f64 {
    let same = M::COORDINATES.iter().zip(values).filter(|(coordinate, _)| coordinate.unit == unit);
    same.fold(0.0, |most, (_, value)| f64::max(most, value.abs()))
}

/// The size of what a row involves, Σ |gⱼ| sⱼ / ‖g‖, from sizes by unit; `None` where its gradient vanishes.
fn along<M: Constraints>(gradient: &[f64], of_unit: impl Fn(&str) -> f64) -> Option<f64> {
    let steepness = norm(gradient);
    let involved = M::COORDINATES.iter().zip(gradient).filter(|(_, g)| **g != 0.0);
    let sum: f64 = involved.map(|(coordinate, g)| g.abs() * of_unit(coordinate.unit)).sum();
    (steepness > 0.0).then_some(sum / steepness)
}

/// What a model itself says of the size of values with a unit: its largest parameter of the same unit, up to
/// 1; 1 of angles, without units, and where there is none.
fn own_size<M: Constraints>(model: &M, unit: &str) -> f64 {
    if unit.is_empty() || unit == "rad" {
        return 1.0;
    }
    let same = M::PARAMETERS.iter().enumerate().filter(|(_, parameter)| parameter.unit == unit);
    let largest =
        same.filter_map(|(i, _)| model.parameter(i)).fold(0.0, |most, value| f64::max(most, value.abs()));
    if largest > 0.0 { largest.min(1.0) } else { 1.0 }
}

/// The size against which a row of this gradient is judged where contacts are met and left, and by what it
/// may drift, for coordinates or, per unit of time, velocities: that of the model and the largest value of
/// the same unit together.
#[cfg(feature = "alloc")]
pub(crate) fn size_along<M: Constraints>(model: &M, values: &[f64], gradient: &[f64]) -> f64 {
    let of_unit = |unit: &str| own_size(model, unit) + largest_of::<M>(values, unit);
    along::<M>(gradient, of_unit).unwrap_or_else(|| size(values))
}

/// No [size](size_along) of a row is less.
#[cfg(feature = "alloc")]
pub(crate) fn least_size<M: Constraints>(model: &M) -> f64 {
    M::COORDINATES.iter().map(|coordinate| own_size(model, coordinate.unit)).fold(1.0, f64::min)
}

/// 1 + |v|∞.
fn size(values: &[f64]) -> f64 {
    values.iter().fold(1.0, |most, value| f64::max(most, 1.0 + value.abs()))
}

/// The name of a row, and of its constraint where that is a switched one.
pub(crate) fn named<M: Constraints>(row: usize) -> (&'static str, Option<&'static str>) {
    let mut switched = M::CONSTRAINTS.iter().filter(|c| c.switched.is_some());
    let of_row = switched.find(|c| (c.first..c.first + c.rows).contains(&row));
    (M::ROWS[row].name, of_row.map(|c| c.name))
}

fn check_positions<M: Constraints>(
    model: &M,
    state: &M::State,
    gradients: &Gradients<'_>,
    against: Against,
) -> Result<(), StateError> {
    let values = model.residual(state);
    let tolerance = |gradient: &[f64]| permitted(model, state.q().as_slice(), gradient, (against, 1.0));
    match worst::<M>(state.modes(), true, values.as_slice(), (gradients.rows, gradients.usual), tolerance)? {
        Some(Violation { row, residual, distance }) => {
            let (row, switched) = named::<M>(row);
            Err(StateError::ConstraintViolated { row, residual, distance, switched })
        }
        None => Ok(()),
    }
}

fn check_velocities<M: Constraints>(
    model: &M,
    state: &M::State,
    gradients: &Gradients<'_>,
    against: Against,
) -> Result<(), StateError> {
    let values = model.velocity_residual(state);
    // What is at rest, or turns round, has no speed of its own: it misses by what it misses in its
    // coordinates, per unit of time.
    let tolerance = |gradient: &[f64]| {
        let of_speed = permitted(model, state.u().as_slice(), gradient, (against, 0.0));
        of_speed.max(permitted(model, state.q().as_slice(), gradient, (against, 1.0)))
    };
    match worst::<M>(state.modes(), false, values.as_slice(), (gradients.rows, gradients.usual), tolerance)? {
        Some(Violation { row, residual, distance }) => {
            let (row, switched) = named::<M>(row);
            Err(StateError::VelocityViolated { row, residual, distance, switched })
        }
        None => Ok(()),
    }
}

/// Nothing is given; more coordinates than any generated model has.
const NONE: [bool; 4096] = [false; 4096];

/// A state on the constraints [`beside`] this one; `None` where none was found.
pub(crate) fn beside_on_constraints<M: Constraints>(
    model: &M,
    state: &M::State,
    workspace: &mut [f64],
) -> Option<M::State> {
    let n = M::COORDINATES.len();
    let none = NONE.get(..n)?;
    let mut along = beside::<M>(state);
    let placed = positions::solve(model, &mut along, none, &mut Room::new(workspace, n, M::ROWS.len()));
    placed.ok().map(|()| along)
}
