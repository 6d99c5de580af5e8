//! Equilibria and steady motions, and their stability.
//!
//! ```text
//! // The one that Newton's method finds from a start.
//! let hanging = model.equilibrium(&start)?;
//! // From many starts, each once.
//! let all = model.equilibria(start).random(200).within("x", [-1.0, 1.0]).run()?;
//! // Motions that stay as they are.
//! let turns = model.steady_motions(riding).random(50).within("lean", [-1.0, 1.0]).run()?;
//! println!("{}", model.stability(&hanging.state)?);
//! ```
//!
//! In equilibrium Q(q, 0, t) + Φ_qᵀλ = 0 and Φ(q, t) = 0. The search moves along the constraints. It is
//! Newton's method on the residual forces in independent coordinates, with the exact derivatives of small
//! motions (`newton.rs`). Rows that repeat others are allowed. Unilateral constraints keep the on/off state
//! that they have at the start.

mod balanced_svd;
mod corner;
mod error;
mod newton;
mod rolling;
mod rounding;
mod search;
mod soft_directions;
mod stability;
mod statics;

use alloc::vec::Vec;
use core::fmt;

use dynamics_runtime::constrain::active_rows;
use dynamics_runtime::constrain::at_time;
use dynamics_runtime::constrain::{ConstraintReaction, reactions};
use dynamics_runtime::error::{SolveError, StateError};
use dynamics_runtime::model::{Constraints, ModelState, Powers, Quantity, Vector};
use nalgebra::DVector;

pub(crate) use balanced_svd::{Equilibrated, ZERO_SINGULAR_VALUE};
pub use error::EquilibriumError;
pub(crate) use rounding::FORCE_NOISE_FACTOR;
pub use search::{EquilibriumSearch, EquilibriumSet};
pub(crate) use stability::judge;
pub use stability::{Stability, StabilityVerdict, Undecided};

use crate::LinearizeError;
use crate::displacement::{displaced, fastest, project};
use crate::linearize::indices;
use newton::EquilibriumSolution;
pub(super) use search::periodic;
use statics::excess;
pub(super) use statics::{Statics, scales};

/// Residual forces that may be left at another time, as a multiple of those that the search left.
const RESIDUAL_FACTOR: f64 = 10.0;
/// Up to this time after a state, in s, forces are sampled densely.
const DENSE_UNTIL: u32 = 100;
/// Dense samples per second.
const DENSE_SAMPLES_PER_SECOND: u32 = 20;
/// The time between dense samples, in s: a twentieth of a second.
const DENSE_INTERVAL: f64 = 0.05;
/// Ratio of later sample times.
const LATE_RATIO: f64 = 1.02;
/// Up to about this time after a state, in s, forces are sampled.
const SAMPLED_UNTIL: f64 = 1e6;
/// Displacements along a direction without inertia at which balance is checked, for a largest element of 1:
/// in rad for polar angles, so that they are no symmetric positions.
const IGNORABLE_PROBES: [f64; 3] = [0.37, -1.71, 2.93];
/// Later times at which balance at rest is checked, in s. They are no multiples of usual periods, so that a
/// periodic force is at another phase.
const LATER_AT_REST: [f64; 3] = [0.7310, 97.31, 1.1317e4];
/// Later times at which a steady motion is checked, in the time in which its fastest coordinate moves by 1.
const LATER_IN_MOTION: [f64; 3] = [0.0173, 0.1731, 0.7310];
/// Residuals and rates of constraints up to this share of the sizes of their terms are rounding.
const ROW_TOLERANCE: f64 = 1e-9;

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

/// Options of a single search.
#[derive(Clone, Copy)]
pub(super) struct EquilibriumOptions {
    /// Velocities of the start are kept. Otherwise they are set to zero.
    pub(super) moving: bool,
    /// Forces are taken at the time of the start, and may change later.
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
    options: EquilibriumOptions,
) -> Result<Equilibrium<M::State>, EquilibriumError> {
    find_holding(model, start, options, &[])
}

/// As [`find`]. In rolling systems, the velocities of the `held` coordinates are kept, if any are given.
fn find_holding<M: Constraints>(
    model: &M,
    start: &M::State,
    options: EquilibriumOptions,
    held: &[usize],
) -> Result<Equilibrium<M::State>, EquilibriumError> {
    // Refuse models and starts for which there is no answer.
    if M::FRICTION {
        return Err(LinearizeError::Friction.into());
    }
    StateError::check_parameters(model)?;
    StateError::check::<M>(start)?;
    let mut start = *start;
    if !options.moving {
        start.u_mut().as_mut_slice().fill(0.0);
    }
    if has_nonholonomic_rows::<M>(&start) && start.u().as_slice().iter().any(|u| *u != 0.0) {
        return rolling::find(model, &start, held);
    }
    // Newton's method, from the start projected onto the constraints.
    let constants = model.constants().map_err(SolveError::from)?;
    project(model, &constants, &mut start)?;
    let first = Statics::of(model, &start, &[])?;
    let EquilibriumSolution { state, statics, iterations, uncertainty } = newton::solve(model, start)?;
    // Check that balance is real: no pole of the coordinates, no corner of the forces, and no change with
    // time.
    let allowed = allowed_forces(model, &state, &statics)?;
    if let Some(along) = statics.pole(&first) {
        check_pole(model, &state, &along, &allowed)?;
    }
    if let Some((i, force)) = statics.at_corners(model, &state, &allowed)? {
        return Err(EquilibriumError::Corner { coordinate: M::COORDINATES[i].name, force });
    }
    check_rest(model, &state)?;
    check_later(model, &state, options, &statics, &allowed)?;
    if M::EXPLICIT_TIME && !options.frozen {
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

/// The largest force on each coordinate at which balance still holds: a multiple of its noise and of what the
/// search left.
fn allowed_forces<M: Constraints>(
    model: &M,
    state: &M::State,
    statics: &Statics<M::Rows>,
) -> Result<DVector<f64>, EquilibriumError> {
    Ok(statics.noise(model, state)? * FORCE_NOISE_FACTOR + statics.force.abs() * RESIDUAL_FACTOR)
}

/// Whether a nonholonomic constraint is active, which leaves more positions than velocities.
pub(super) fn has_nonholonomic_rows<M: Constraints>(state: &M::State) -> bool {
    active_rows::<M>(state.active_set(), false).any(|row| row >= M::Residual::LEN)
}

/// Checks that a state is an equilibrium or a steady motion a little later, too.
fn check_persists<M: Constraints>(model: &M, state: &M::State) -> Result<(), EquilibriumError> {
    if has_nonholonomic_rows::<M>(state) && state.u().as_slice().iter().any(|u| *u != 0.0) {
        // Rolling motions were followed a little way when they were linearised.
        return check_rest(model, state);
    }
    let statics = Statics::of(model, state, &[])?;
    let allowed = allowed_forces(model, state, &statics)?;
    check_rest(model, state)?;
    check_later(model, state, EquilibriumOptions { moving: true, frozen: false }, &statics, &allowed)
}

/// Checks balance at a pole of the coordinates. Along the direction without inertia, coordinates differ but
/// the position does not. So the residual force has to be within the allowed one there, too.
fn check_pole<M: Constraints>(
    model: &M,
    state: &M::State,
    along: &DVector<f64>,
    allowed: &DVector<f64>,
) -> Result<(), EquilibriumError> {
    let coordinate = M::COORDINATES[along.iamax()].name;
    for part in IGNORABLE_PROBES {
        let moved = displaced(state, &(along * (part / along.amax())));
        let left = Statics::of(model, &moved, &[])?.force.amax();
        // The largest allowed force counts, because other coordinates may be independent there.
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
    let ratios = uncertainty.iter().zip(scales).map(|(error, scale)| error / (f64::EPSILON * scale));
    ratios.fold(1.0, f64::max)
}

/// Checks that the velocities fulfil the constraints. At rest, no constraint may move.
fn check_rest<M: Constraints>(model: &M, state: &M::State) -> Result<(), EquilibriumError> {
    let rates = model.velocity_residual(state);
    let size = fastest(state);
    let holds = |row: &usize| rates[*row].abs() <= ROW_TOLERANCE * size;
    match active_rows::<M>(state.active_set(), false).find(|row| !holds(row)) {
        Some(row) => Err(EquilibriumError::Moving { row: M::ROWS[row].name, rate: rates[row] }),
        None => Ok(()),
    }
}

/// Checks that the constraints hold and forces balance at three later times, at the positions that the motion
/// has reached by then.
fn check_later<M: Constraints>(
    model: &M,
    state: &M::State,
    options: EquilibriumOptions,
    statics: &Statics<M::Rows>,
    allowed: &DVector<f64>,
) -> Result<(), EquilibriumError> {
    let rate = fastest(state);
    let moving = rate > 0.0;
    let after = if moving { LATER_IN_MOTION.map(|after| after / rate) } else { LATER_AT_REST };
    for after in after {
        let later = after_time(state, after);
        // Constraints.
        if let Some((row, missed)) = violated_row::<M>(model, &later, rate) {
            return Err(match moving {
                true => EquilibriumError::NotSteady { name: row, left: missed },
                false => EquilibriumError::Moving { row, rate: missed / after },
            });
        }
        if options.frozen {
            continue;
        }
        // Forces, with the allowed ones of the coordinates that were independent at first.
        let there = Statics::of(model, &later, &statics.tangent.coordinates)?;
        let rates = &there.tangent.rates;
        let known = |i: &usize| statics.tangent.rates.iter().position(|j| j == i);
        let allowed = |i: &usize| known(i).map_or(allowed.amax(), |k| allowed[k]);
        let allowed = DVector::from_iterator(rates.len(), rates.iter().map(allowed));
        if excess(&there.force, &allowed).is_none() {
            continue;
        }
        // Terms that vanish here may cancel there, such as those with the sine of an angle that is 0 now. So
        // the noise there counts, too.
        let allowed = allowed + there.noise(model, &later)? * FORCE_NOISE_FACTOR;
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

/// The state after a time in which velocities stay as they are.
fn after_time<S: ModelState>(state: &S, after: f64) -> S {
    displaced(&at_time(state, state.t() + after), state.u().as_slice().iter().map(|u| after * u))
}

/// Times after a state, in s, at which forces are sampled: every twentieth of a second up to 100 s, then in
/// steps of a fiftieth of the time up to 10⁶ s.
fn sample_times() -> impl Iterator<Item = f64> {
    let late = core::iter::successors(Some(f64::from(DENSE_UNTIL)), |t: &f64| {
        (*t < SAMPLED_UNTIL).then_some(LATE_RATIO * t)
    });
    (1..DENSE_SAMPLES_PER_SECOND * DENSE_UNTIL).map(|k| DENSE_INTERVAL * f64::from(k)).chain(late)
}

/// Checks that forces balance at [`sample_times`], at the positions that the motion has reached by then.
fn check_all_times<M: Constraints>(
    model: &M,
    state: &M::State,
    statics: &Statics<M::Rows>,
    allowed: &DVector<f64>,
) -> Result<(), EquilibriumError> {
    let moving = state.u().as_slice().iter().any(|u| *u != 0.0);
    for after in sample_times() {
        let later = after_time(state, after);
        let force = statics.force_nearby(model, &later)?;
        let Some((i, force)) = excess(&force, allowed) else { continue };
        // Angles that have grown are rounded more coarsely.
        if moving && force.abs() <= allowed[i] + FORCE_NOISE_FACTOR * statics.noise(model, &later)?[i] {
            continue;
        }
        let coordinate = M::COORDINATES[statics.tangent.rates[i]].name;
        return Err(EquilibriumError::DependsOnTime { coordinate, force });
    }
    Ok(())
}

/// Checks that forces of a model with explicit time balance at later times: at three of them, or at `all`
/// times that [`find`] samples.
pub(super) fn check_time<M: Constraints>(
    model: &M,
    state: &M::State,
    statics: &Statics<M::Rows>,
    all: bool,
) -> Result<(), EquilibriumError> {
    if !M::EXPLICIT_TIME {
        return Ok(());
    }
    let allowed = allowed_forces(model, state, statics)?;
    check_rest(model, state)?;
    check_later(model, state, EquilibriumOptions { moving: true, frozen: false }, statics, &allowed)?;
    if all { check_all_times(model, state, statics, &allowed) } else { Ok(()) }
}

/// A constraint row that does not hold at a state, to rounding, and its residual.
fn violated_row<M: Constraints>(model: &M, state: &M::State, rate: f64) -> Option<(&'static str, f64)> {
    let sizes = scales(M::COORDINATES, state.q().as_slice());
    let (rows, rates, jacobian) =
        (model.residual(state), model.velocity_residual(state), model.jacobian(state));
    active_rows::<M>(state.active_set(), false).find_map(|row| {
        let position = if row < M::Residual::LEN { rows[row].abs() } else { 0.0 };
        let missed = position.max(rates[row].abs());
        let along: f64 =
            sizes.iter().enumerate().map(|(j, size)| jacobian[(row, j)].abs() * size.max(rate)).sum();
        let holds = missed <= ROW_TOLERANCE * along;
        (!holds).then_some((M::ROWS[row].name, missed))
    })
}
