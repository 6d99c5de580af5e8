//! A, B, C and D of ẋ = A x + B w, y = C x + D w at a state.
//!
//! With δq = D z, δq̇ = E v + F z, δq̈ = E v̇ + G v + H z the reactions follow from the equations before
//! they were projected:
//!
//! ```text
//! Φ_qᵀ δλ = M δq̈ + r_u δq̇ + r_q δq − Q_w δw        δy = y_q δq + y_u δq̇ + y_a δq̈ + y_λ δλ + y_w δw
//! ```
//!
//! All derivatives are generated from the model's equations. If rows repeat each other, δλ is not unique.
//! An output then has a linear equation if it depends on the unique part of δλ only.

use alloc::vec::Vec;

use dynamics_runtime::constrain::active_rows;
use dynamics_runtime::model::{Constraints, ModelState, Outputs, Vector};
use nalgebra::{DMatrix, DVector};

use super::{SignalUnavailable, VibrationError};
use crate::linearize::{Linearization, ModelDerivatives, Tangent, scales};

/// Singular values of Φ_qᵀ, rows scaled to length 1, up to this part of the largest count as zero: those
/// of rows that repeat others. Larger values would make nearly dependent rows repeat each other.
const RANK_TOLERANCE_OF_REACTIONS: f64 = 1e-10;
/// Part of an output's derivative by λ, in the directions in which λ is not unique, up to which the output
/// counts as unique. It lies above the accuracy of the pseudo-inverse at the rank tolerance.
const MAX_NONUNIQUE_SHARE: f64 = 1e-9;
/// Distance of the two sides at which derivatives of outputs are compared for corners, relative to the scale
/// of each argument. It is small against the distance of neighbouring corners, and large against rounding.
const CORNER_DISTANCE: f64 = 1e-9;
/// The comparison is repeated at this fraction of the distance. The difference over a corner stays, that of
/// smooth functions shrinks with the distance.
const CORNER_DISTANCE_REDUCTION: f64 = 16.0;
/// Least relative difference of derivatives at a corner; smaller differences are rounding. A larger value
/// would linearise over weak corners.
const MIN_CORNER: f64 = 1e-7;
/// Part of the difference that must be left at the reduced distance: a smooth function leaves a sixteenth.
const MIN_REMAINING_SHARE: f64 = 0.5;

/// ẋ = A x + B w, y = C x + D w at an instant.
pub(super) struct StateSpaceMatrices {
    pub(super) a: DMatrix<f64>,
    pub(super) b: DMatrix<f64>,
    pub(super) c: DMatrix<f64>,
    pub(super) d: DMatrix<f64>,
}

/// Deviations as linear functions of states and inputs: x δx + w δw.
struct LinearDeviation {
    x: DMatrix<f64>,
    w: DMatrix<f64>,
}

/// A, B, C and D at a state, and the outputs that have no row there.
pub(super) fn equations<M: Constraints + Outputs>(
    model: &M,
    state: &M::State,
    derivatives: &ModelDerivatives,
    tangent: &Tangent,
    linear: &Linearization,
) -> Result<(StateSpaceMatrices, Vec<(usize, SignalUnavailable)>), VibrationError> {
    let a = linear.state_matrix()?;
    // Unit generalized forces along coordinates join the inputs.
    let n = M::Vector::LEN;
    let forces = join(&-&derivatives.force_by_inputs, &DMatrix::identity(n, n));
    let b = by_forces(linear, tangent, &forces)?;
    let [q, u, accelerations] = motions(derivatives, tangent, linear, &a, &b);
    let reactions = reactions(derivatives, [&q, &u, &accelerations], &forces);
    let (declared, unavailable) = declared(model, state, derivatives, [&q, &u, &accelerations], &reactions)?;
    let stacked = |of: fn(&LinearDeviation) -> &DMatrix<f64>| {
        let rows = [&declared, &q, &u, &accelerations].map(of);
        DMatrix::from_fn(rows.iter().map(|m| m.nrows()).sum(), rows[1].ncols(), |i, j| {
            let (mut i, mut part) = (i, 0);
            while i >= rows[part].nrows() {
                i -= rows[part].nrows();
                part += 1;
            }
            rows[part][(i, j)]
        })
    };
    let (c, d) = (stacked(|by| &by.x), stacked(|by| &by.w));
    Ok((StateSpaceMatrices { a, b, c, d }, unavailable))
}

/// B for generalized forces on all coordinates, a column each: mass⁻¹Eᵀ `forces`.
fn by_forces(
    linear: &Linearization,
    tangent: &Tangent,
    forces: &DMatrix<f64>,
) -> Result<DMatrix<f64>, VibrationError> {
    let (c, f) = (linear.coordinates.len(), linear.velocities.len());
    let mut b = DMatrix::zeros(c + f, forces.ncols());
    b.view_mut((c, 0), (f, forces.ncols())).copy_from(&linear.solve(&tangent.velocities.tr_mul(forces))?);
    Ok(b)
}

/// δq, δq̇ and δq̈ of all coordinates.
fn motions(
    derivatives: &ModelDerivatives,
    tangent: &Tangent,
    linear: &Linearization,
    a: &DMatrix<f64>,
    b: &DMatrix<f64>,
) -> [LinearDeviation; 3] {
    let (d, e) = (&tangent.positions, &tangent.velocities);
    let (n, c, f) = (d.nrows(), linear.coordinates.len(), linear.velocities.len());
    let particular = tangent.particular(&(&derivatives.velocity_by * d));
    let [gamma_q, gamma_u] = &derivatives.gamma_by;
    let (g, h) =
        (tangent.particular(&(gamma_u * e)), tangent.particular(&(gamma_q * d + gamma_u * &particular)));
    let none = DMatrix::zeros(n, b.ncols());
    [
        LinearDeviation { x: join(d, &DMatrix::zeros(n, f)), w: none.clone() },
        LinearDeviation { x: join(&particular, e), w: none },
        LinearDeviation { x: e * a.rows(c, f) + join(&h, &g), w: e * b.rows(c, f) },
    ]
}

/// δλ of the active rows, its unique part; the diagonal matrix of the row scales; and the projector on the
/// directions in which λ is not unique.
fn reactions(
    derivatives: &ModelDerivatives,
    [q, u, accelerations]: [&LinearDeviation; 3],
    forces: &DMatrix<f64>,
) -> (LinearDeviation, [DMatrix<f64>; 2]) {
    let rows = derivatives.jacobian.nrows();
    if rows == 0 {
        let none = |of: &DMatrix<f64>| DMatrix::zeros(0, of.ncols());
        return (
            LinearDeviation { x: none(&q.x), w: none(&q.w) },
            [DMatrix::zeros(0, 0), DMatrix::zeros(0, 0)],
        );
    }
    // Rows are scaled to length 1, so that their units have no influence on the rank.
    let length = |i: usize| match derivatives.jacobian.row(i).norm() {
        0.0 => 1.0,
        length => 1.0 / length,
    };
    let units = DMatrix::from_diagonal(&DVector::from_fn(rows, |i, _| length(i)));
    let columns = derivatives.jacobian.transpose() * &units;
    let inverse = pseudo_inverse(&columns);
    let [r_q, r_u] = &derivatives.force_by;
    let x = &units * &inverse * (&derivatives.mass * &accelerations.x + r_u * &u.x + r_q * &q.x);
    let w = &units * &inverse * (&derivatives.mass * &accelerations.w - forces);
    let nonunique = &units * (DMatrix::identity(rows, rows) - inverse * columns);
    (LinearDeviation { x, w }, [units, nonunique])
}

/// The pseudo-inverse by singular values.
fn pseudo_inverse(m: &DMatrix<f64>) -> DMatrix<f64> {
    let svd = m.clone().svd(true, true);
    let least = RANK_TOLERANCE_OF_REACTIONS * svd.singular_values.amax();
    svd.pseudo_inverse(least).unwrap_or_else(|_| DMatrix::from_element(m.ncols(), m.nrows(), f64::NAN))
}

/// The declared outputs that have a corner at a state.
pub(super) fn corners<M: Constraints + Outputs>(
    model: &M,
    state: &M::State,
    derivatives: &ModelDerivatives,
) -> Vec<(usize, SignalUnavailable)> {
    let corners = Arguments::<M>::of(state, derivatives).corners(model).into_iter().enumerate();
    corners.filter(|(_, is_corner)| *is_corner).map(|(i, _)| (i, SignalUnavailable::Corner)).collect()
}

/// Rows of the declared outputs, and those that have none.
#[allow(clippy::type_complexity)]
fn declared<M: Constraints + Outputs>(
    model: &M,
    state: &M::State,
    derivatives: &ModelDerivatives,
    [q, u, accelerations]: [&LinearDeviation; 3],
    (lambda, [units, nonunique]): &(LinearDeviation, [DMatrix<f64>; 2]),
) -> Result<(LinearDeviation, Vec<(usize, SignalUnavailable)>), VibrationError> {
    let (y, n) = (M::OUTPUTS.len(), M::Vector::LEN);
    let at = Arguments::<M>::of(state, derivatives);
    let by = at.derivatives(model).ok_or(VibrationError::NoOutputDerivatives)?;
    let active: Vec<usize> = active_rows::<M>(state.active_set(), false).collect();
    let by_lambda = by[3].select_columns(&active);
    let (nonunique, whole) = (&by_lambda * nonunique, &by_lambda * units);
    let direct = join(&by[4], &DMatrix::zeros(y, n));
    let found = LinearDeviation {
        x: &by[0] * &q.x + &by[1] * &u.x + &by[2] * &accelerations.x + &by_lambda * &lambda.x,
        w: &by[2] * &accelerations.w + &by_lambda * &lambda.w + direct,
    };
    let why = |i: usize| {
        let all = found.x.row(i).iter().chain(found.w.row(i).iter()).all(|x| x.is_finite());
        match () {
            () if nonunique.row(i).norm() > MAX_NONUNIQUE_SHARE * whole.row(i).norm() => {
                Some(SignalUnavailable::NotUnique)
            }
            () => (!all).then_some(SignalUnavailable::NotFinite),
        }
    };
    let unavailable = (0..y).filter_map(|i| Some((i, why(i)?))).collect();
    Ok((found, unavailable))
}

/// The arguments of the output functions.
struct Arguments<M: Constraints> {
    state: M::State,
    accelerations: M::Vector,
    multipliers: M::Rows,
}

impl<M: Constraints + Outputs> Arguments<M> {
    fn of(state: &M::State, derivatives: &ModelDerivatives) -> Self {
        let (mut accelerations, mut multipliers) = (M::Vector::zeros(), M::Rows::zeros());
        accelerations.as_mut_slice().copy_from_slice(derivatives.accelerations.as_slice());
        multipliers.as_mut_slice().copy_from_slice(derivatives.multipliers.as_slice());
        Self { state: *state, accelerations, multipliers }
    }

    /// Derivatives by q, q̇, q̈, λ and inputs; `None` where there is no code for them.
    fn derivatives(&self, model: &M) -> Option<[DMatrix<f64>; 5]> {
        let (y, n, r, w) = (M::OUTPUTS.len(), M::Vector::LEN, M::Rows::LEN, M::Inputs::LEN);
        let mut values = alloc::vec![0.0; y * (3 * n + r + w)];
        if y > 0 && !model.output_variations(&self.state, &self.accelerations, &self.multipliers, &mut values)
        {
            return None;
        }
        let mut rest = values.as_slice();
        Some([n, n, n, r, w].map(|columns| {
            let (matrix, after) = rest.split_at(y * columns);
            rest = after;
            DMatrix::from_row_slice(y, columns, matrix)
        }))
    }

    /// Whether the derivatives of each output jump here: then those on both sides differ nearly as much at a
    /// sixteenth of the distance. A step changes all arguments by different parts, so that it crosses any
    /// corner.
    fn corners(&self, model: &M) -> Vec<bool> {
        let difference = |step: f64| {
            let sides = [step, -step].map(|step| self.moved(step).derivatives(model));
            let [Some(above), Some(below)] = sides else { return Vec::new() };
            let change =
                |i: usize| (0..5).map(|k| (above[k].row(i) - below[k].row(i)).abs().sum()).sum::<f64>();
            let size = |i: usize| {
                (0..5).map(|k| above[k].row(i).abs().sum() + below[k].row(i).abs().sum()).sum::<f64>()
            };
            (0..M::OUTPUTS.len()).map(|i| (change(i), size(i))).collect::<Vec<_>>()
        };
        let (far, near) =
            (difference(CORNER_DISTANCE), difference(CORNER_DISTANCE / CORNER_DISTANCE_REDUCTION));
        let jumps = |((far, _), (near, size)): (&(f64, f64), &(f64, f64))| {
            *near > MIN_CORNER * size && *near > MIN_REMAINING_SHARE * far
        };
        far.iter().zip(&near).map(jumps).collect()
    }

    /// All arguments moved by about `step` times their scale.
    fn moved(&self, step: f64) -> Self {
        let mut moved = Self { ..*self };
        let mut k = 0.0;
        let mut shift = |values: &mut [f64], scales: &[f64]| {
            for (i, value) in values.iter_mut().enumerate() {
                k += 1.0;
                let scale = scales.get(i).copied().unwrap_or_else(|| value.abs().max(1.0));
                *value += step * scale * (1.0 + 0.618 * f64::sin(2.4 * k));
            }
        };
        shift(moved.state.q_mut().as_mut_slice(), &scales(M::COORDINATES, self.state.q().as_slice()));
        shift(moved.state.u_mut().as_mut_slice(), &[]);
        shift(moved.state.inputs_mut().as_mut_slice(), &[]);
        shift(moved.accelerations.as_mut_slice(), &[]);
        shift(moved.multipliers.as_mut_slice(), &[]);
        moved
    }
}

/// [left right].
fn join(left: &DMatrix<f64>, right: &DMatrix<f64>) -> DMatrix<f64> {
    let mut joined = DMatrix::zeros(left.nrows(), left.ncols() + right.ncols());
    joined.columns_mut(0, left.ncols()).copy_from(left);
    joined.columns_mut(left.ncols(), right.ncols()).copy_from(right);
    joined
}
