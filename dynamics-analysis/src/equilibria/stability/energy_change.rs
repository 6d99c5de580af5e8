//! Whether energy is conserved near an equilibrium, or never grows, with the work of dead loads included.
//!
//! If no force is declared, the compiler knows the answer. If forces are declared, such as a dead load or a
//! spring written as a force, they are tested numerically at several generic positions nearby. Their power
//! must be linear in the velocities, so that they depend on positions alone. Their derivatives in independent
//! coordinates must be symmetric, so that they are gradients. A force field of smooth functions that passes
//! is a gradient, except by chance. Follower forces and explicit time do not pass. Nor do moving constraints,
//! unless they turn with a steady motion.
//!
//! Dampers take energy out: the rest of the power is then even in the velocities, and nowhere positive. The
//! pivots of the damping matrix, each relative to its own size, show that no direction gains energy, however
//! small. Samples show that this also holds near the equilibrium. Energy never grows (Kelvin, Tait &
//! Chetaev).

use alloc::vec::Vec;

use dynamics_runtime::constrain::active_rows;
use dynamics_runtime::constrain::at_time;
use dynamics_runtime::model::{Constraints, ModelState, Powers, Vector};
use nalgebra::{DMatrix, DVector};

use super::super::statics::{Statics, scales};
use crate::displacement::{displaced, fastest, projected};

/// Displacements of the positions at which forces are tested, in the scales of the coordinates: near and far,
/// to both sides. A model whose forces have no potential passes at all of them only by chance.
const POSITION_OFFSETS: [f64; 4] = [1e-2, -0.1, 0.4, -0.9];
/// Powers below this share of the largest one, and differences of elements below this share of their size,
/// are rounding. It is 450 rounding units. A smaller value refuses conservative models, a larger one
/// overlooks weak dampers beside strong ones.
const ROUNDING_SHARE: f64 = 1e-13;

/// The same for terms that are rotated: sums of sines and cosines that differ at each time.
const TURNED_ROUNDING_SHARE: f64 = 1e-12;
/// Magnitudes of the velocities, in 1/s, at which the power is tested: dampers of higher order than the first
/// matter at large ones only.
const SPEED_SAMPLES: [f64; 3] = [1e-3, 0.1, 1.0];

/// Number of corrections to the earlier position. They converge quadratically.
const MAX_CORRECTIONS: usize = 8;
/// Least number of positions that the mechanism can reach and at which forces have to pass the test.
const MIN_POSITIONS: usize = 2;

/// How energy changes along motions near a state.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum EnergyChange {
    /// Energy is conserved, with the work of dead loads included.
    Conserved,
    /// Energy is lost or conserved, and never gained.
    Dissipated,
    Unknown,
}

/// How energy changes near a state of a model, whose independent velocities are the rates of the coordinates
/// `order`, with the damping matrix of small motions.
pub(super) fn energy_change<M: Constraints + Powers>(
    model: &M,
    state: &M::State,
    order: &[usize],
    damping: &DMatrix<f64>,
) -> EnergyChange {
    if M::CONSERVED.iter().any(|quantity| quantity.kind.is_energy()) {
        return EnergyChange::Conserved;
    }
    let undamped = undamped_directions(damping);
    let mut found =
        if has_symmetry(damping, -1.0) { EnergyChange::Conserved } else { EnergyChange::Dissipated };
    // In a steady motion only the power of disturbances counts, and it cannot be separated from that of the
    // motion. With explicit time, a force that damps now may drive later.
    let changes = M::EXPLICIT_TIME || state.u().as_slice().iter().any(|u| *u != 0.0);
    if found == EnergyChange::Dissipated && (changes || undamped.is_none()) {
        return EnergyChange::Unknown;
    }
    let Ok(constants) = model.constants() else { return EnergyChange::Unknown };
    let scales = scales(M::COORDINATES, state.q().as_slice());
    let Ok(here) = Statics::of(model, state, order) else { return EnergyChange::Unknown };
    // Test forces at several positions.
    let mut tested = 0;
    for (sample, part) in POSITION_OFFSETS.into_iter().enumerate() {
        let step =
            DVector::from_fn(order.len(), |k, _| part * scales[order[k]] * fixed_number(7 * sample + k));
        let later = at_time(state, state.t() + 0.73 * (1 + sample) as f64);
        let nearby = displaced(&later, &(&here.tangent.positions * step));
        // Positions that the mechanism cannot reach are left out.
        let Ok(nearby) = projected(model, &constants, nearby) else { continue };
        let Ok(there) = Statics::of(model, &nearby, order) else { return EnergyChange::Unknown };
        let Ok(before) = Statics::of(model, &at_time(&nearby, state.t()), order) else {
            return EnergyChange::Unknown;
        };
        // They must not depend on time, and must have a potential.
        if !are_same(&before, &there) {
            return EnergyChange::Unknown;
        }
        let k = &there.stiffness;
        if there.tangent.coordinates != order || !k.is_square() {
            continue;
        }
        if !has_symmetry(k, 1.0)
            || (has_moving_rows(model, &nearby)
                && !has_jacobi_integral(model, state, (&nearby, &there), sample))
        {
            return EnergyChange::Unknown;
        }
        // Their power must be linear in the velocities, or dissipative.
        let velocities = &there.tangent.velocities;
        // The power of velocities that the damping matrix does not reach is tested separately.
        let undamped_basis = undamped.as_ref().map(|free| velocities * free);
        let power = Power { model, state: &nearby, velocities, undamped_basis, sample };
        // Damping of higher order than the first does not appear in the damping matrix.
        if found == EnergyChange::Conserved && !power.is_linear() {
            found = if changes { EnergyChange::Unknown } else { EnergyChange::Dissipated };
        }
        if found == EnergyChange::Unknown || (found == EnergyChange::Dissipated && !power.is_dissipative()) {
            return EnergyChange::Unknown;
        }
        tested += 1;
    }
    if tested >= MIN_POSITIONS { found } else { EnergyChange::Unknown }
}

/// The directions without damping, by columns, if the damping matrix takes out energy in all others. `None`
/// if it puts energy in: the symmetric part C needs diagonal elements that are positive, or zero with a row
/// of zeros, and C_ij/√(C_ii C_jj) no negative eigenvalue.
fn undamped_directions(damping: &DMatrix<f64>) -> Option<DMatrix<f64>> {
    let n = damping.nrows();
    let c = 0.5 * (damping + damping.transpose());
    // Gyroscopic terms cancel in the symmetric part, up to rounding.
    let rounding = |i: usize, j: usize| 4.0 * f64::EPSILON * damping[(i, j)].abs().max(damping[(j, i)].abs());
    let is_clean =
        |i: usize| c[(i, i)] > 0.0 || (c[(i, i)] == 0.0 && (0..n).all(|j| c[(i, j)].abs() <= rounding(i, j)));
    if !(0..n).all(is_clean) {
        return None;
    }
    let damped: Vec<usize> = (0..n).filter(|i| c[(*i, *i)] > 0.0).collect();
    let root = |i: usize| c[(damped[i], damped[i])].sqrt();
    let unit =
        DMatrix::from_fn(damped.len(), damped.len(), |i, j| c[(damped[i], damped[j])] / (root(i) * root(j)));
    let least = 64.0 * n as f64 * f64::EPSILON;
    let mut free: Vec<DVector<f64>> = Vec::new();
    for i in (0..n).filter(|i| !damped.contains(i)) {
        free.push(DVector::from_fn(n, |j, _| if i == j { 1.0 } else { 0.0 }));
    }
    if !unit.is_empty() {
        let eigen = unit.symmetric_eigen();
        for (k, value) in eigen.eigenvalues.iter().enumerate() {
            if *value < -least {
                return None;
            }
            if *value <= least {
                let mut along = DVector::zeros(n);
                damped.iter().enumerate().for_each(|(i, j)| along[*j] = eigen.eigenvectors[(i, k)] / root(i));
                free.push(along);
            }
        }
    }
    Some(if free.is_empty() { DMatrix::zeros(n, 0) } else { DMatrix::from_columns(&free) })
}

/// Whether a matrix is symmetric (sign 1) or skew (−1). Elements are compared one by one, so that soft ones
/// count beside stiff ones.
fn has_symmetry(m: &DMatrix<f64>, sign: f64) -> bool {
    let pair = |i: usize, j: usize| {
        let (x, y) = (m[(i, j)], sign * m[(j, i)]);
        let size = if i == j { m.row(i).amax() } else { x.abs().max(y.abs()) };
        (x - y).abs() <= ROUNDING_SHARE * size + 16.0 * f64::EPSILON * (m[(i, i)] * m[(j, j)]).abs().sqrt()
    };
    (0..m.nrows()).all(|i| (0..=i).all(|j| pair(i, j)))
}

/// Whether forces and stiffnesses at two times are the same, each element relative to its own size.
fn are_same<R: Vector>(one: &Statics<R>, other: &Statics<R>) -> bool {
    let force =
        |i: usize| (one.force[i] - other.force[i]).abs() <= 16.0 * (one.rounding[i] + other.rounding[i]);
    let (k, l) = (&one.stiffness, &other.stiffness);
    let stiffness =
        |(i, j): (usize, usize)| (k[(i, j)] - l[(i, j)]).abs() <= ROUNDING_SHARE * k.row(i).amax();
    let elements = (0..k.nrows()).flat_map(|i| (0..k.ncols()).map(move |j| (i, j)));
    one.force.len() == other.force.len()
        && k.shape() == l.shape()
        && (0..one.force.len()).all(force)
        && elements.into_iter().all(stiffness)
}

/// The k-th of a fixed sequence of numbers in ±(0.3, 1).
fn fixed_number(k: usize) -> f64 {
    let wave = (1.7 + 2.399_963 * k as f64).sin();
    (0.3 + 0.7 * wave.abs()).copysign(wave)
}

/// Whether a steady motion under moving constraints, such as φ − Ωt = 0, has Jacobi's energy integral
/// T₂ + V − T₀ (E. T. Whittaker, *Analytical Dynamics*, §41): whether time vanishes from the equations
/// in independent coordinates. Inertia, forces and stiffness at a position, at rest relative to the motion
/// and moving, are compared with those at the same position earlier.
fn has_jacobi_integral<M: Constraints>(
    model: &M,
    state: &M::State,
    (later, there): (&M::State, &Statics<M::Rows>),
    sample: usize,
) -> bool {
    let rates = model.velocity_residual(later);
    let fastest = fastest(state);
    if active_rows::<M>(state.active_set(), false)
        .any(|row| row >= M::Residual::LEN || rates[row].abs() > ROUNDING_SHARE * fastest)
    {
        return false;
    }
    // The earlier position with the same independent coordinates. The others follow from the constraints.
    let order = &there.tangent.coordinates;
    let mut before = at_time(later, state.t());
    for _ in 0..MAX_CORRECTIONS {
        let Ok(here) = Statics::of(model, &before, order) else { return false };
        let missed = model.residual(&before);
        let rows = active_rows::<M>(state.active_set(), false).map(|row| missed[row]);
        let change = here.tangent.particular(&DMatrix::from_iterator(here.tangent.row_count(), 1, rows));
        before = displaced(&before, &change.column(0).into_owned());
    }
    let moving = |at: &M::State| {
        let mut at = *at;
        let e = &there.tangent.velocities;
        let by = e * DVector::from_fn(e.ncols(), |k, _| fixed_number(13 * sample + k));
        at.u_mut().as_mut_slice().iter_mut().zip(by.iter()).for_each(|(u, d)| *u += d);
        Statics::of(model, &at, order)
    };
    let (Ok(here), Ok(swift), Ok(swift_later)) =
        (Statics::of(model, &before, order), moving(&before), moving(later))
    else {
        return false;
    };
    let scales = scales(M::COORDINATES, later.q().as_slice());
    let rows = model.residual(&before);
    let holds = active_rows::<M>(state.active_set(), false).all(|row| {
        let jacobian = model.jacobian(&before);
        let along: f64 = scales.iter().enumerate().map(|(j, size)| jacobian[(row, j)].abs() * size).sum();
        rows[row].abs() <= ROUNDING_SHARE * along
    });
    // Rotated terms are sums in which sines and cosines cancel, differently at each time. Their size is that
    // of a motion by at least 1 per second.
    let rate = fastest.max(1.0);
    let alike = |one: &Statics<M::Rows>, other: &Statics<M::Rows>| {
        let (k, size) = (&one.stiffness, |i: usize| one.mass.row(i).amax() * rate * rate);
        let resists = |i: usize| {
            k.row(i).amax().max(size(i)) * order.iter().fold(1.0, |most: f64, j| most.max(scales[*j]))
        };
        (0..order.len()).all(|i| {
            let inertia = (one.mass.row(i) - other.mass.row(i)).amax()
                <= TURNED_ROUNDING_SHARE * one.mass.row(i).amax();
            let stiffness = (k.row(i) - other.stiffness.row(i)).amax()
                <= TURNED_ROUNDING_SHARE * k.row(i).amax().max(size(i));
            inertia
                && stiffness
                && (one.force[i] - other.force[i]).abs() <= TURNED_ROUNDING_SHARE * resists(i)
        })
    };
    holds && alike(&here, there) && alike(&swift, &swift_later)
}

/// Whether an active constraint moves while all coordinates rest.
fn has_moving_rows<M: Constraints>(model: &M, state: &M::State) -> bool {
    let mut rest = *state;
    rest.u_mut().as_mut_slice().fill(0.0);
    let rates = model.velocity_residual(&rest);
    active_rows::<M>(state.active_set(), false).any(|row| rates[row] != 0.0)
}

/// The power of all forces that are not derived from energies, at a position.
struct Power<'a, M: Constraints + Powers> {
    model: &'a M,
    state: &'a M::State,
    /// A basis of admissible velocities.
    velocities: &'a DMatrix<f64>,
    /// A basis of those that the damping matrix does not reach.
    undamped_basis: Option<DMatrix<f64>>,
    /// Selects the numbers of the sampled velocities.
    sample: usize,
}

impl<M: Constraints + Powers> Power<'_, M> {
    /// A generic admissible velocity.
    fn velocity(&self, first: usize) -> DVector<f64> {
        let e = self.velocities;
        e * DVector::from_fn(e.ncols(), |k, _| fixed_number(31 * self.sample + first + k))
    }

    /// The power at a velocity, and the largest magnitude of its parts.
    fn at(&self, u: &DVector<f64>) -> (f64, f64) {
        let mut values = alloc::vec![0.0; M::POWERS.len()];
        let mut moving = *self.state;
        moving.u_mut().as_mut_slice().copy_from_slice(u.as_slice());
        self.model.powers(&moving, &mut values);
        // Moving constraints turn along with the motion. Their power is not that of a disturbance.
        let is_row = |name: &str| M::CONSTRAINTS.iter().any(|constraint| constraint.name == name);
        values
            .iter_mut()
            .zip(M::POWERS)
            .filter(|(_, power)| is_row(power.name))
            .for_each(|(value, _)| *value = 0.0);
        (values.iter().sum(), values.iter().fold(0.0, |most: f64, x| most.max(x.abs())))
    }

    /// Whether the power is linear in admissible velocities.
    fn is_linear(&self) -> bool {
        let (u, w) = (self.velocity(3), self.velocity(17));
        self.is_linear_function(&u, &w, |u| self.at(u)) && {
            let ((p, size), (q, _)) = (self.at(&u), self.at(&-&u));
            (p + q).abs() <= ROUNDING_SHARE * size
        }
    }

    /// Whether a function of velocities is linear, tested with two of them.
    fn is_linear_function(
        &self,
        u: &DVector<f64>,
        w: &DVector<f64>,
        power: impl Fn(&DVector<f64>) -> (f64, f64),
    ) -> bool {
        let ((of_u, a), (of_w, b), (of_both, c), (of_more, d)) =
            (power(u), power(w), power(&(u + w)), power(&(3.0 * w)));
        let size = a.max(b).max(c).max(d);
        (of_both - of_u - of_w).abs() <= ROUNDING_SHARE * size
            && (of_more - 3.0 * of_w).abs() <= ROUNDING_SHARE * size
    }

    /// Whether the odd part of the power is linear, as that of dead loads, and its even part never positive.
    fn is_dissipative(&self) -> bool {
        let odd = |u: &DVector<f64>| {
            let ((p, a), (q, b)) = (self.at(u), self.at(&-u));
            (0.5 * (p - q), a.max(b))
        };
        let is_taken_out = |u: &DVector<f64>| {
            let ((p, a), (q, b)) = (self.at(u), self.at(&-u));
            p + q <= ROUNDING_SHARE * a.max(b)
        };
        SPEED_SAMPLES.into_iter().enumerate().all(|(k, speed)| {
            let (u, w) = (self.velocity(3 + 5 * k) * speed, self.velocity(17 + 7 * k) * speed);
            let each = core::iter::once(self.velocities)
                .chain(&self.undamped_basis)
                .filter(|basis| basis.ncols() > 0);
            let each = each.flat_map(|basis| {
                let mixed =
                    basis * DVector::from_fn(basis.ncols(), |k, _| fixed_number(11 * self.sample + k));
                basis
                    .column_iter()
                    .map(|column| column / column.amax())
                    .chain([&mixed / mixed.amax()])
                    .collect::<Vec<_>>()
            });
            self.is_linear_function(&u, &w, odd)
                && is_taken_out(&u)
                && is_taken_out(&w)
                && each.into_iter().all(|u| is_taken_out(&(u * speed)))
        })
    }
}
