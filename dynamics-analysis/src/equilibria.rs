//! Where a system rests, and whether it stays there.
//!
//! ```text
//! let hanging = model.equilibrium(&start)?;                                              // the one that Newton's method finds from a start
//! let all = model.equilibria(start).random(200).within("x", [-1.0, 1.0]).run()?;         // from many starts, each once
//! let turns = model.steady_motions(riding).random(50).within("lean", [-1.0, 1.0]).run()?;  // motions that stay as they are
//! println!("{}", model.stability(&hanging.state)?);
//! ```
//!
//! In equilibrium Q(q, 0, t) + Φ_qᵀλ = 0 and Φ(q, t) = 0. The search moves along the constraints. It is
//! Newton's method on the residual forces in independent coordinates, with the exact derivatives of small
//! motions (`newton.rs`). Rows that repeat others are allowed. Unilateral constraints keep the on/off state
//! that they have at the start.

mod corner;
mod error;
mod factors;
mod newton;
mod rolling;
mod rounding;
mod search;
mod soft;
mod stability;
mod statics;

use alloc::vec::Vec;
use core::fmt;

use dynamics_runtime::constrain::active_rows;
use dynamics_runtime::constrain::at_time;
use dynamics_runtime::constrain::{ConstraintReaction, project_positions, reactions, with_workspace};
use dynamics_runtime::error::{SolveError, StateError};
use dynamics_runtime::model::{Constraints, ModelState, Powers, Quantity, Vector};
use nalgebra::DVector;

pub use error::EquilibriumError;
pub(crate) use factors::Equilibrated;
pub(crate) use rounding::FORCE_NOISE_FACTOR;
pub use search::{EquilibriumSearch, EquilibriumSet};
pub(crate) use stability::judge;
pub use stability::{Stability, StabilityVerdict, Undecided};

use crate::LinearizeError;
use crate::linearize::indices;
use newton::{Settled, settle};
pub(super) use search::periodic;
use statics::excess;
pub(super) use statics::{Statics, scales};

/// A position in which forces and reactions balance, or a steady motion.
#[derive(Clone, Debug, PartialEq)]
pub struct Equilibrium<S: ModelState> {
    /// The state; velocities are zero except in steady motions.
    pub state: S,
    /// The reaction of each constraint.
    pub reactions: Vec<ConstraintReaction<S::Vector>>,
    /// The largest residual generalized force.
    pub force_left: f64,
    /// Iterations made.
    pub iterations: usize,
    /// The error of each coordinate that rounding of forces may cause; 0 along directions without any
    /// stiffness.
    pub uncertainty: S::Vector,
    /// The error of the coordinates relative to their own rounding: 1 at best, 10⁸ in a fold.
    pub conditioning: f64,
    /// Whether time appears in the model. Forces were then sampled at 2,500 times up to 10⁶ s, most densely
    /// in the first hundred seconds, and did not change. A push between two of these times is missed.
    pub contains_time: bool,
    /// The coordinates.
    pub coordinates: &'static [Quantity],
}

/// One line for each coordinate, then one for each reaction.
impl<S: ModelState> fmt::Display for Equilibrium<S> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let of = |v: &S::Vector, i: usize| v.as_slice()[i];
        for (i, coordinate) in self.coordinates.iter().enumerate() {
            write!(f, "{:<16}{:>22.14e} {}", coordinate.name, of(self.state.q(), i) + 0.0, coordinate.unit)?;
            match of(self.state.u(), i) {
                0.0 => writeln!(f)?,
                rate => writeln!(f, ", moves by {rate:.6e} per second")?,
            }
        }
        self.reactions.iter().try_for_each(|reaction| writeln!(f, "{reaction}"))?;
        write!(
            f,
            "force left {:.1e}, conditioning {:.1e}, {} iterations",
            self.force_left, self.conditioning, self.iterations
        )?;
        match self.contains_time {
            true => f.write_str(
                "; time stands in the model: what lasts for less than 0.1 s, or for a 20th \
                of the time until then, may not have been seen",
            ),
            false => Ok(()),
        }
    }
}

/// What is asked for.
#[derive(Clone, Copy)]
pub(super) struct EquilibriumOptions {
    /// Velocities of the start stay.
    pub(super) moving: bool,
    /// Time stands still.
    pub(super) frozen: bool,
}

impl EquilibriumOptions {
    pub(super) const REST: Self = Self { moving: false, frozen: false };
}

/// See [`Analyze::equilibrium`](crate::Analyze::equilibrium).
pub(crate) fn equilibrium<M: Constraints + Powers>(
    model: &M,
    start: &M::State,
) -> Result<Equilibrium<M::State>, EquilibriumError> {
    find(model, start, EquilibriumOptions::REST)
}

/// See [`Analyze::steady`](crate::Analyze::steady).
pub(crate) fn steady<M: Constraints + Powers>(
    model: &M,
    start: &M::State,
) -> Result<Equilibrium<M::State>, EquilibriumError> {
    find(model, start, EquilibriumOptions { moving: true, ..EquilibriumOptions::REST })
}

/// See [`Analyze::steady_in`](crate::Analyze::steady_in).
pub(crate) fn steady_in<M: Constraints + Powers>(
    model: &M,
    start: &M::State,
    independent: &[&str],
) -> Result<Equilibrium<M::State>, EquilibriumError> {
    find_holding(
        model,
        start,
        EquilibriumOptions { moving: true, ..EquilibriumOptions::REST },
        &indices::<M>(independent)?,
    )
}

pub(super) fn find<M: Constraints>(
    model: &M,
    start: &M::State,
    asked: EquilibriumOptions,
) -> Result<Equilibrium<M::State>, EquilibriumError> {
    find_holding(model, start, asked, &[])
}

/// As [`find`]; of what rolls the velocities of these coordinates stay, if there are any.
fn find_holding<M: Constraints>(
    model: &M,
    start: &M::State,
    asked: EquilibriumOptions,
    held: &[usize],
) -> Result<Equilibrium<M::State>, EquilibriumError> {
    if M::FRICTION {
        return Err(LinearizeError::Friction.into());
    }
    StateError::check_parameters(model)?;
    StateError::check::<M>(start)?;
    let mut start = *start;
    if !asked.moving {
        start.u_mut().as_mut_slice().fill(0.0);
    }
    if rolls::<M>(&start) && start.u().as_slice().iter().any(|u| *u != 0.0) {
        return rolling::find(model, &start, held);
    }
    let constants = model.constants().map_err(SolveError::from)?;
    with_workspace::<M, _>(|memory| project_positions(model, &constants, &mut start, memory))?;
    let first = Statics::of(model, &start, &[])?;
    let Settled { state, statics, iterations, uncertainty } = settle(model, start)?;
    let allowed = allowed(model, &state, &statics)?;
    if let Some(along) = statics.pole(&first) {
        check_pole(model, &state, &along, &allowed)?;
    }
    if let Some((i, force)) = statics.at_corners(model, &state, &allowed)? {
        return Err(EquilibriumError::Corner { coordinate: M::COORDINATES[i].name, force });
    }
    check_rest(model, &state)?;
    check_later(model, &state, asked, &statics, &allowed)?;
    if M::EXPLICIT_TIME && !asked.frozen {
        check_all_times(model, &state, &statics, &allowed)?;
    }
    Ok(Equilibrium {
        reactions: if M::ROWS.is_empty() { Vec::new() } else { reactions(model, &state)? },
        force_left: statics.worst().1.abs(),
        iterations,
        conditioning: conditioning::<M>(&state, &uncertainty),
        uncertainty: vector(&uncertainty),
        contains_time: M::EXPLICIT_TIME,
        coordinates: M::COORDINATES,
        state,
    })
}

/// The forces up to which what was in balance still is, each beside what it is made of: rounding, and what
/// was left.
fn allowed<M: Constraints>(
    model: &M,
    state: &M::State,
    statics: &Statics<M::Rows>,
) -> Result<DVector<f64>, EquilibriumError> {
    Ok(statics.noise(model, state)? * rounding::FORCE_NOISE_FACTOR + statics.force.abs() * 10.0)
}

/// Whether a row on velocities holds.
fn rolls<M: Constraints>(state: &M::State) -> bool {
    active_rows::<M>(state.modes(), false).any(|row| row >= M::Residual::LEN)
}

/// That a state stays where it is, or goes on as it does, of models in which nothing else would say so.
fn check_stays<M: Constraints>(model: &M, state: &M::State) -> Result<(), EquilibriumError> {
    if rolls::<M>(state) && state.u().as_slice().iter().any(|u| *u != 0.0) {
        // What rolls was followed a little way when it was linearised.
        return check_rest(model, state);
    }
    let statics = Statics::of(model, state, &[])?;
    let allowed = allowed(model, state, &statics)?;
    check_rest(model, state)?;
    check_later(model, state, EquilibriumOptions { moving: true, frozen: false }, &statics, &allowed)
}

/// That what balances in a pole of the coordinates does so in truth: they are of one place all along the
/// direction without inertia, and at each of them no more than the allowed force may be left.
fn check_pole<M: Constraints>(
    model: &M,
    state: &M::State,
    along: &DVector<f64>,
    allowed: &DVector<f64>,
) -> Result<(), EquilibriumError> {
    let coordinate = M::COORDINATES[along.iamax()].name;
    for part in [0.37, -1.71, 2.93] {
        let mut moved = *state;
        let step = along * (part / along.amax());
        moved.q_mut().as_mut_slice().iter_mut().zip(step.iter()).for_each(|(q, d)| *q += d);
        let left = Statics::of(model, &moved, &[])?.force.amax();
        // Beside all that may be left here: which coordinates are independent is a matter of the place.
        if left > allowed.amax().max(f64::EPSILON * f64::EPSILON) {
            return Err(EquilibriumError::Pole { coordinate });
        }
    }
    Ok(())
}

fn vector<V: Vector>(values: &[f64]) -> V {
    let mut out = V::zeros();
    out.as_mut_slice().copy_from_slice(values);
    out
}

fn conditioning<M: Constraints>(state: &M::State, uncertainty: &[f64]) -> f64 {
    let scales = scales(M::COORDINATES, state.q().as_slice());
    let lost = uncertainty.iter().zip(scales).map(|(error, scale)| error / (f64::EPSILON * scale));
    lost.fold(1.0, f64::max)
}

/// That the velocities are those of the constraints: 0 where nothing moves.
fn check_rest<M: Constraints>(model: &M, state: &M::State) -> Result<(), EquilibriumError> {
    let rates = model.velocity_residual(state);
    let size = state.u().as_slice().iter().fold(0.0, |most: f64, u| most.max(u.abs()));
    let stays = |row: &usize| rates[*row].abs() <= 1e-9 * size;
    match active_rows::<M>(state.modes(), false).find(|row| !stays(row)) {
        Some(row) => Err(EquilibriumError::Moving { row: M::ROWS[row].name, rate: rates[row] }),
        None => Ok(()),
    }
}

/// That what balances does so later, too, where the motion has gone by then: that no more than the allowed
/// force is left there.
fn check_later<M: Constraints>(
    model: &M,
    state: &M::State,
    asked: EquilibriumOptions,
    statics: &Statics<M::Rows>,
    allowed: &DVector<f64>,
) -> Result<(), EquilibriumError> {
    let rate = state.u().as_slice().iter().fold(0.0, |most: f64, u| most.max(u.abs()));
    let moving = rate > 0.0;
    // In seconds, or in the time in which the fastest moves by 1: times that no period divides, from short to
    // long.
    let after =
        if moving { [0.0173, 0.1731, 0.7310].map(|after| after / rate) } else { [0.7310, 97.31, 1.1317e4] };
    for after in after {
        let mut later = at_time(state, state.t() + after);
        later.q_mut().as_mut_slice().iter_mut().zip(state.u().as_slice()).for_each(|(q, u)| *q += after * u);
        if let Some((row, missed)) = left::<M>(model, &later, rate) {
            return Err(match moving {
                true => EquilibriumError::NotSteady { name: row, left: missed },
                false => EquilibriumError::Moving { row, rate: missed / after },
            });
        }
        if asked.frozen {
            continue;
        }
        let there = Statics::of(model, &later, &statics.tangent.coordinates)?;
        let rates = &there.tangent.rates;
        let known = |i: &usize| statics.tangent.rates.iter().position(|j| j == i);
        let allowed = |i: &usize| known(i).map_or(allowed.amax(), |k| allowed[k]);
        let allowed = DVector::from_iterator(rates.len(), rates.iter().map(allowed));
        if excess(&there.force, &allowed).is_none() {
            continue;
        }
        // Terms that vanish here may cancel there, as those with the sine of an angle that is 0 now.
        let allowed = allowed + there.noise(model, &later)? * rounding::FORCE_NOISE_FACTOR;
        if let Some((i, force)) = excess(&there.force, &allowed) {
            let name = M::COORDINATES[rates[i]].name;
            return Err(match moving {
                true => EquilibriumError::NotSteady { name, left: force },
                false => EquilibriumError::DependsOnTime { coordinate: name, force },
            });
        }
    }
    Ok(())
}

/// How long after it balance is looked at: every twentieth of a second of the first hundred, then at a
/// fiftieth of the time more each up to 10⁶.
fn many_times() -> impl Iterator<Item = f64> {
    let late = core::iter::successors(Some(100.0), |t: &f64| (*t < 1e6).then_some(1.02 * t));
    (1..2000).map(|k| 0.05 * f64::from(k)).chain(late)
}

/// That forces which balance do so at many times, where the motion has gone by then.
fn check_all_times<M: Constraints>(
    model: &M,
    state: &M::State,
    statics: &Statics<M::Rows>,
    allowed: &DVector<f64>,
) -> Result<(), EquilibriumError> {
    let moving = state.u().as_slice().iter().any(|u| *u != 0.0);
    for after in many_times() {
        let mut later = at_time(state, state.t() + after);
        later.q_mut().as_mut_slice().iter_mut().zip(state.u().as_slice()).for_each(|(q, u)| *q += after * u);
        let force = statics.force_beside(model, &later)?;
        let Some((i, force)) = excess(&force, allowed) else { continue };
        // Angles that have grown are known to fewer digits.
        if moving && force.abs() <= allowed[i] + 1e3 * statics.noise(model, &later)?[i] {
            continue;
        }
        let coordinate = M::COORDINATES[statics.tangent.rates[i]].name;
        return Err(EquilibriumError::DependsOnTime { coordinate, force });
    }
    Ok(())
}

/// That what balances does so at other times, too, of models in which time stands: at three of them, or at
/// `all` that [`find`] looks at.
pub(super) fn check_time<M: Constraints>(
    model: &M,
    state: &M::State,
    statics: &Statics<M::Rows>,
    all: bool,
) -> Result<(), EquilibriumError> {
    if !M::EXPLICIT_TIME {
        return Ok(());
    }
    let allowed = allowed(model, state, statics)?;
    check_rest(model, state)?;
    check_later(model, state, EquilibriumOptions { moving: true, frozen: false }, statics, &allowed)?;
    if all { check_all_times(model, state, statics, &allowed) } else { Ok(()) }
}

/// A row that does not hold at a state, by more than rounding, and by how much.
fn left<M: Constraints>(model: &M, state: &M::State, rate: f64) -> Option<(&'static str, f64)> {
    let sizes = scales(M::COORDINATES, state.q().as_slice());
    let (rows, rates, jacobian) =
        (model.residual(state), model.velocity_residual(state), model.jacobian(state));
    active_rows::<M>(state.modes(), false).find_map(|row| {
        let position = if row < M::Residual::LEN { rows[row].abs() } else { 0.0 };
        let missed = position.max(rates[row].abs());
        let along: f64 =
            sizes.iter().enumerate().map(|(j, size)| jacobian[(row, j)].abs() * size.max(rate)).sum();
        let holds = missed <= 1e-9 * along;
        (!holds).then_some((M::ROWS[row].name, missed))
    })
}
