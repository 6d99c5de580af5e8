//! Multipliers of a closed motion that are known to be 1 before they are computed.
//!
//! In an autonomous system a motion that starts a little later closes, too: M f = f along the motion, f =
//! (q̇, q̈). A cyclic coordinate gives another such vector. A conserved quantity I has the same value after a
//! period: ∇Iᵀ M = ∇Iᵀ. Together they make blocks [1 *; 0 1], whose eigenvalues rounding would move by its
//! square root. Therefore they are not computed but removed: with F all such f and G all such ∇I, M acts on
//! G^⊥/F, and what it does there are the other multipliers (Meyer, Hall & Offin, *Introduction to Hamiltonian
//! Dynamical Systems and the N-Body Problem*, §8).
//!
//! Where nothing dissipates, M leaves the form δq ∧ δp as it is, MᵀWM = W, and multipliers come in pairs μ,
//! 1/μ.

use alloc::vec::Vec;

use dynamics_runtime::constrain::at_time;
use dynamics_runtime::model::{ConservedKind, ConservedQuantity, Constraints, ModelState, Powers, Vector};
use nalgebra::{DMatrix, DVector};

use super::PeriodicError;
use super::corners::slope;
use super::flow::Flow;
use super::frame::{Frame, direction};
use crate::displacement::{displaced, moved_along};

/// Times at which accelerations are compared with those of a state, in periods. They are no simple fractions,
/// so that equations with a fraction of the period do not look autonomous.
const COMPARISON_PHASES: [f64; 3] = [0.137_035_9, 0.529_177_2, 0.866_025_4];
/// States along the motion at which equations are compared. More find rarer differences and take longer.
const COMPARED_STATES: usize = 12;
/// Distance from the motion of the states of comparison, relative to 1 plus each coordinate or velocity. It
/// must be visible beside rounding, and keep the state within the range of the model.
const OFF_MOTION: f64 = 0.01;
/// Time before and after a comparison, in periods, at which a difference must exist, too. A jump at the very
/// time of the comparison, whose side rounding decides, differs at that time only.
const JUMP_SIDE_DISTANCE: f64 = 1e-6;
/// Relative difference up to which accelerations are equal, in parts of the largest of their coordinate. Time
/// is known to rounding only, which limits how equal they can be.
pub(super) const EQUAL_ACCELERATIONS: f64 = 1e-9;
/// Least scale of the accelerations of a coordinate, relative to the largest of all, since small ones may be
/// rounding of large ones. With [`EQUAL_ACCELERATIONS`], differences below 1e-15 of the largest acceleration
/// do not count.
pub(super) const MIN_ACCELERATION_SCALE: f64 = 1e-6;
/// Least velocity added to a state to see whether forces do work off the motion.
const MIN_TRIAL_SPEED: f64 = 1e-3;
/// Step of differences of conserved quantities and momenta, in parts of the motion, by the formula of order
/// 6.
const GRADIENT_STEP: f64 = 0.01;
/// Relative error with which a known direction may miss M x = x, besides ten times the error of M. It is the
/// error of directions from differences, with a margin. With a smaller value known multipliers would be
/// computed, and lose half of their digits.
const KNOWN_DIRECTION_ERROR: f64 = 1e-7;
/// Least speed at the start, in parts of the motion, of a motion that is not at rest there. Below it the
/// direction of the motion is only rounding.
const MIN_SPEED: f64 = 1e-9;

/// Whether the equations do not depend on time. If they do, it is checked that they repeat after the period.
/// If coordinates advance in a period, it is checked that the equations are the same there: otherwise the
/// motion closes once but does not repeat.
pub(super) fn is_autonomous<M: Constraints>(
    flow: &mut Flow<'_, M>,
    passed: &[M::State],
    period: f64,
    advance: &DVector<f64>,
) -> Result<bool, PeriodicError> {
    let mut autonomous = true;
    // Each equation has its own scale. Otherwise a fast coordinate would hide a slow one.
    let (mut changes, mut largest): (Vec<f64>, Vec<f64>) = (Vec::new(), Vec::new());
    let stride = passed.len().div_ceil(COMPARED_STATES).max(1);
    for state in passed.iter().step_by(stride) {
        // Off the motion, because terms with the time may vanish on it.
        let mut nearby = *state;
        for (i, u) in nearby.u_mut().as_mut_slice().iter_mut().enumerate() {
            *u += OFF_MOTION * (1.0 + u.abs()) * (1.0 + i as f64).sin();
        }
        if M::ROWS.is_empty() {
            for (i, q) in nearby.q_mut().as_mut_slice().iter_mut().enumerate() {
                *q += OFF_MOTION * (1.0 + q.abs()) * (2.0 + i as f64).cos();
            }
        }
        let at = |flow: &mut Flow<'_, M>, nearby: &M::State, t: f64| -> Option<Vec<f64>> {
            let state = at_time(nearby, t);
            let accelerations = flow.accelerations(&state).ok()?;
            let rates = flow.model.velocity_residual(&state);
            Some(
                [accelerations.as_slice(), rates.as_slice(), flow.model.residual(&state).as_slice()].concat(),
            )
        };
        // If there are no accelerations off the motion, compare on it.
        let now = match at(flow, &nearby, state.t()) {
            Some(now) => now,
            None => {
                nearby = *state;
                let Some(now) = at(flow, &nearby, state.t()) else { continue };
                now
            }
        };
        autonomous &= COMPARISON_PHASES
            .iter()
            .all(|part| at(flow, &nearby, state.t() + part * period).as_ref() == Some(&now));
        // One period later, with the advance of the coordinates.
        let further = displaced(&nearby, advance);
        let Some(then) = at(flow, &further, state.t() + period) else { continue };
        let mut differs: Vec<f64> = now.iter().zip(&then).map(|(a, b)| (a - b).abs()).collect();
        // If something jumps at this very time, rounding decides the side of each. A real difference exists a
        // little before and after, too.
        for shift in [-JUMP_SIDE_DISTANCE * period, JUMP_SIDE_DISTANCE * period] {
            let sides =
                (at(flow, &nearby, state.t() + shift), at(flow, &further, state.t() + period + shift));
            let (Some(a), Some(b)) = sides else { continue };
            differs.iter_mut().zip(a.iter().zip(&b)).for_each(|(by, (a, b))| *by = by.min((a - b).abs()));
        }
        changes.resize(now.len(), 0.0);
        largest.resize(now.len(), 0.0);
        for (i, (a, b)) in now.iter().zip(&then).enumerate() {
            changes[i] = changes[i].max(differs[i]);
            largest[i] = largest[i].max(a.abs()).max(b.abs());
        }
    }
    // Scales of the differences. Residuals of constraints have none of their own.
    let most = largest.iter().fold(0.0, |most: f64, x| most.max(*x));
    let free = M::Vector::LEN;
    let size = |i: usize| if i < free { largest[i].max(MIN_ACCELERATION_SCALE * most) } else { most };
    let part = |i: usize| if changes[i] > 0.0 { changes[i] / size(i) } else { 0.0 };
    match (0..changes.len()).max_by(|a, b| part(*a).total_cmp(&part(*b))) {
        Some(worst) if part(worst) > EQUAL_ACCELERATIONS => {
            let coordinate = M::COORDINATES.get(worst).map_or("a constraint", |q| q.name);
            let change = part(worst);
            match M::COORDINATES.iter().zip(advance.iter()).find(|(_, by)| **by != 0.0) {
                Some((turned, by)) => {
                    Err(PeriodicError::NotAlike { turned: turned.name, by: *by, coordinate, change })
                }
                None => Err(PeriodicError::NotPeriodic { coordinate, change }),
            }
        }
        _ => Ok(autonomous),
    }
}

/// Why a multiplier is 1.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub enum Trivial {
    /// The system is autonomous: the same motion, started later.
    Time,
    /// A coordinate is cyclic.
    Coordinate {
        /// Its name.
        name: &'static str,
    },
    /// A quantity is conserved.
    Conserved {
        /// Its name.
        name: &'static str,
    },
}

/// Right and left directions in which M is 1, in independent coordinates, each with its reason.
pub(super) struct Known {
    pub(super) right: Vec<(DVector<f64>, Trivial)>,
    pub(super) left: Vec<(DVector<f64>, Trivial)>,
}

/// The conserved quantities of a motion: the indices of [`dynamics_runtime::model::Dynamics::CONSERVED`] that
/// hold, and the energy function if all powers vanish.
pub(super) struct Conserved {
    /// Those of the model, then the energy function, if it is conserved along this motion only.
    pub(super) quantities: Vec<ConservedQuantity>,
}

impl Conserved {
    pub(super) fn along<M: Powers>(model: &M, passed: &[M::State], autonomous: bool) -> Self {
        let mut quantities = M::CONSERVED.to_vec();
        let listed_energy = quantities.iter().any(|quantity| quantity.kind.is_energy());
        // The energy function is conserved if no force does work, also not at velocities off the motion.
        let mut powers = alloc::vec![0.0; M::POWERS.len()];
        let idle = |state: &M::State| {
            let mut nearby = *state;
            let speed = state.u().as_slice().iter().fold(MIN_TRIAL_SPEED, |most: f64, u| most.max(u.abs()));
            for (i, u) in nearby.u_mut().as_mut_slice().iter_mut().enumerate() {
                *u += speed * (0.7 + 1.3 * i as f64).sin();
            }
            model.powers(&nearby, &mut powers);
            powers.iter().all(|power| *power == 0.0)
        };
        let energy = !listed_energy && autonomous && !passed.is_empty() && passed.iter().all(idle);
        if energy {
            let kind = ConservedKind::EnergyFunction;
            quantities.push(ConservedQuantity { kind, name: "energy function", unit: "" });
        }
        Self { quantities }
    }

    /// Gradients along independent directions.
    pub(super) fn gradients<M: Constraints>(
        &self,
        model: &M,
        state: &M::State,
        frame: &Frame,
        sizes: &DVector<f64>,
    ) -> Vec<(DVector<f64>, ConservedQuantity)> {
        let listed = M::CONSERVED.len();
        let value = |index: usize, state: &M::State| {
            if index == listed {
                return model.energy_function(state);
            }
            let mut values = alloc::vec![0.0; listed];
            model.conserved(state, &mut values);
            values[index]
        };
        let gradient = |index: usize| {
            DVector::from_fn(frame.len(), |k, _| {
                let (along, step) = unit_step(&frame.basis.column(k).into_owned(), sizes);
                slope(step, |by| value(index, &moved_along(state, &along, by)))
            })
        };
        self.quantities.iter().enumerate().map(|(index, of)| (gradient(index), *of)).collect()
    }
}

/// A direction, and a step along it over which functions of the model are smooth.
fn unit_step(along: &DVector<f64>, sizes: &DVector<f64>) -> (DVector<f64>, f64) {
    let largest = along.iter().zip(sizes.iter()).fold(0.0, |most: f64, (x, size)| most.max(x.abs() / size));
    (along.clone(), GRADIENT_STEP / largest.max(f64::MIN_POSITIVE))
}

/// The directions in which the monodromy matrix has to be 1, and is, within its error.
pub(super) fn known<M: Constraints + Powers>(
    flow: &mut Flow<'_, M>,
    state: &M::State,
    frame: &Frame,
    (monodromy, uncertainty): (&DMatrix<f64>, &DMatrix<f64>),
    (autonomous, conserved): (bool, &Conserved),
    sizes: &DVector<f64>,
) -> Result<Known, PeriodicError> {
    let mut found = Known { right: Vec::new(), left: Vec::new() };
    let n = M::Vector::LEN;
    let scale = |k: usize| sizes[frame.rows()[k]];
    // In the scales of the coordinates. `uncertainty` contains the error of a motion that does not close
    // exactly.
    let missed = |x: &DVector<f64>, left: bool| {
        let m = if left { monodromy.transpose() } else { monodromy.clone() };
        let off = if left { uncertainty.transpose() } else { uncertainty.clone() };
        let weigh = |k: usize| if left { scale(k) } else { 1.0 / scale(k) };
        let miss = &m * x - x;
        let allowed =
            KNOWN_DIRECTION_ERROR * (0..x.len()).map(|k| (x[k] * weigh(k)).abs()).fold(0.0, f64::max);
        let by_matrix = &off * x.abs();
        (0..x.len()).all(|k| (miss[k] * weigh(k)).abs() <= allowed + 10.0 * by_matrix[k] * weigh(k))
    };
    let along = direction(flow, state)?;
    // The speed, or at a turning point the acceleration.
    let speed = |k: usize| {
        (along[k] / sizes[n + k]).abs().max((along[n + k] * sizes[k] / sizes[n + k].powi(2)).abs())
    };
    let moves = (0..n).any(|k| speed(k) > MIN_SPEED);
    if autonomous && moves {
        let along =
            frame.read(&DMatrix::from_column_slice(2 * n, 1, along.as_slice())).column(0).into_owned();
        if missed(&along, false) {
            found.right.push((along, Trivial::Time));
        }
    }
    for (k, coordinate) in frame.coordinates.iter().enumerate() {
        // The comparison is exact: if nothing depends on a coordinate, no rounding enters its column.
        let unit = DVector::from_fn(frame.len(), |i, _| if i == k { 1.0 } else { 0.0 });
        let alone = frame.basis.column(k).iter().filter(|x| **x != 0.0).count() == 1;
        if alone && monodromy.column(k) == unit {
            found.right.push((unit, Trivial::Coordinate { name: M::COORDINATES[*coordinate].name }));
        }
    }
    for (gradient, ConservedQuantity { kind, name, .. }) in
        conserved.gradients(flow.model, state, frame, sizes)
    {
        // At rest the gradient of the energy is only rounding.
        let is_known = moves || kind == ConservedKind::Momentum;
        if is_known && gradient.amax() > 0.0 && missed(&gradient, true) {
            found.left.push((gradient, Trivial::Conserved { name }));
        }
    }
    Ok(found)
}

/// The form δq ∧ δp on independent directions.
pub(super) fn form<M: Constraints>(
    model: &M,
    state: &M::State,
    frame: &Frame,
    sizes: &DVector<f64>,
) -> DMatrix<f64> {
    let n = M::Vector::LEN;
    let momenta: Vec<Vec<f64>> = (0..frame.len())
        .map(|k| {
            let (along, step) = unit_step(&frame.basis.column(k).into_owned(), sizes);
            (0..n).map(|i| slope(step, |by| model.momenta(&moved_along(state, &along, by))[i])).collect()
        })
        .collect();
    let half = |a: usize, b: usize| (0..n).map(|i| frame.basis[(i, a)] * momenta[b][i]).sum::<f64>();
    DMatrix::from_fn(frame.len(), frame.len(), |a, b| half(a, b) - half(b, a))
}
