//! A, B, C and D of ẋ = A x + B w, y = C x + D w at a state.
//!
//! With δq = D z, δq̇ = E v + F z, δq̈ = E v̇ + G v + H z the reactions follow from the equations before
//! they were projected:
//!
//! ```text
//! Φ_qᵀ δλ = M δq̈ + r_u δq̇ + r_q δq − Q_w δw        δy = y_q δq + y_u δq̇ + y_a δq̈ + y_λ δλ + y_w δw
//! ```
//!
//! all derivatives from the graph. Where rows repeat each other δλ is not unique; an output is there if it
//! depends on the unique part alone.

use alloc::vec::Vec;

use dynamics_runtime::constrain::active_rows;
use dynamics_runtime::model::{Constraints, ModelState, Outputs, Vector};
use nalgebra::{DMatrix, DVector};

use super::{VibrationError, Withheld};
use crate::linearize::{Linearization, ModelDerivatives, Tangent, scales};

/// ẋ = A x + B w, y = C x + D w at an instant.
pub(super) struct StateSpaceMatrices {
    pub(super) a: DMatrix<f64>,
    pub(super) b: DMatrix<f64>,
    pub(super) c: DMatrix<f64>,
    pub(super) d: DMatrix<f64>,
}

/// Deviations as linear functions of x and w.
struct LinearDeviation {
    x: DMatrix<f64>,
    w: DMatrix<f64>,
}

/// A, B, C and D at a state, and the outputs that have no row there.
pub(super) fn equations<M: Constraints + Outputs>(
    model: &M,
    state: &M::State,
    read: &ModelDerivatives,
    tangent: &Tangent,
    linear: &Linearization,
) -> Result<(StateSpaceMatrices, Vec<(usize, Withheld)>), VibrationError> {
    let a = linear.state_matrix()?;
    // Unit generalized forces along coordinates join the inputs.
    let n = M::Vector::LEN;
    let forces = join(&-&read.force_by_inputs, &DMatrix::identity(n, n));
    let b = by_forces(linear, tangent, &forces)?;
    let [q, u, accelerations] = motions(read, tangent, linear, &a, &b);
    let reactions = reactions(read, [&q, &u, &accelerations], &forces);
    let (declared, withheld) = declared(model, state, read, [&q, &u, &accelerations], &reactions)?;
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
    Ok((StateSpaceMatrices { a, b, c, d }, withheld))
}

/// B for generalized forces on all coordinates: mass⁻¹Eᵀ of them.
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
    read: &ModelDerivatives,
    tangent: &Tangent,
    linear: &Linearization,
    a: &DMatrix<f64>,
    b: &DMatrix<f64>,
) -> [LinearDeviation; 3] {
    let (d, e) = (&tangent.positions, &tangent.velocities);
    let (n, c, f) = (d.nrows(), linear.coordinates.len(), linear.velocities.len());
    let particular = tangent.particular(&(&read.velocity_by * d));
    let [gamma_q, gamma_u] = &read.gamma_by;
    let (g, h) =
        (tangent.particular(&(gamma_u * e)), tangent.particular(&(gamma_q * d + gamma_u * &particular)));
    let none = DMatrix::zeros(n, b.ncols());
    [
        LinearDeviation { x: join(d, &DMatrix::zeros(n, f)), w: none.clone() },
        LinearDeviation { x: join(&particular, e), w: none },
        LinearDeviation { x: e * a.rows(c, f) + join(&h, &g), w: e * b.rows(c, f) },
    ]
}

/// δλ of the rows that hold, where they are unique; and what λ is measured by, with the part of it that is
/// not unique.
fn reactions(
    read: &ModelDerivatives,
    [q, u, accelerations]: [&LinearDeviation; 3],
    forces: &DMatrix<f64>,
) -> (LinearDeviation, [DMatrix<f64>; 2]) {
    let rows = read.jacobian.nrows();
    if rows == 0 {
        let none = |of: &DMatrix<f64>| DMatrix::zeros(0, of.ncols());
        return (
            LinearDeviation { x: none(&q.x), w: none(&q.w) },
            [DMatrix::zeros(0, 0), DMatrix::zeros(0, 0)],
        );
    }
    // Rows of one length: their units decide nothing about which of them repeat others.
    let length = |i: usize| match read.jacobian.row(i).norm() {
        0.0 => 1.0,
        length => 1.0 / length,
    };
    let units = DMatrix::from_diagonal(&DVector::from_fn(rows, |i, _| length(i)));
    let columns = read.jacobian.transpose() * &units;
    let inverse = pseudo_inverse(&columns);
    let [r_q, r_u] = &read.force_by;
    let x = &units * &inverse * (&read.mass * &accelerations.x + r_u * &u.x + r_q * &q.x);
    let w = &units * &inverse * (&read.mass * &accelerations.w - forces);
    let open = &units * (DMatrix::identity(rows, rows) - inverse * columns);
    (LinearDeviation { x, w }, [units, open])
}

/// By singular values; those below 1e-10 of the largest count as zero.
fn pseudo_inverse(m: &DMatrix<f64>) -> DMatrix<f64> {
    let svd = m.clone().svd(true, true);
    let least = 1e-10 * svd.singular_values.amax();
    svd.pseudo_inverse(least).unwrap_or_else(|_| DMatrix::from_element(m.ncols(), m.nrows(), f64::NAN))
}

/// The declared outputs that have a corner at a state.
pub(super) fn corners<M: Constraints + Outputs>(
    model: &M,
    state: &M::State,
    read: &ModelDerivatives,
) -> Vec<(usize, Withheld)> {
    let corners = Arguments::<M>::of(state, read).corners(model).into_iter().enumerate();
    corners.filter(|(_, is_corner)| *is_corner).map(|(i, _)| (i, Withheld::Corner)).collect()
}

/// Rows of the declared outputs, and which of them have none.
#[allow(clippy::type_complexity)]
fn declared<M: Constraints + Outputs>(
    model: &M,
    state: &M::State,
    read: &ModelDerivatives,
    [q, u, accelerations]: [&LinearDeviation; 3],
    (lambda, [units, open]): &(LinearDeviation, [DMatrix<f64>; 2]),
) -> Result<(LinearDeviation, Vec<(usize, Withheld)>), VibrationError> {
    let (y, n) = (M::OUTPUTS.len(), M::Vector::LEN);
    let at = Arguments::<M>::of(state, read);
    let by = at.derivatives(model).ok_or(VibrationError::NoOutputDerivatives)?;
    let active: Vec<usize> = active_rows::<M>(state.modes(), false).collect();
    let by_lambda = by[3].select_columns(&active);
    let (beside, whole) = (&by_lambda * open, &by_lambda * units);
    let direct = join(&by[4], &DMatrix::zeros(y, n));
    let found = LinearDeviation {
        x: &by[0] * &q.x + &by[1] * &u.x + &by[2] * &accelerations.x + &by_lambda * &lambda.x,
        w: &by[2] * &accelerations.w + &by_lambda * &lambda.w + direct,
    };
    let why = |i: usize| {
        let all = found.x.row(i).iter().chain(found.w.row(i).iter()).all(|x| x.is_finite());
        match () {
            () if beside.row(i).norm() > 1e-9 * whole.row(i).norm() => Some(Withheld::NotUnique),
            () => (!all).then_some(Withheld::NotFinite),
        }
    };
    let withheld = (0..y).filter_map(|i| Some((i, why(i)?))).collect();
    Ok((found, withheld))
}

/// What outputs are functions of.
struct Arguments<M: Constraints> {
    state: M::State,
    accelerations: M::Vector,
    multipliers: M::Rows,
}

impl<M: Constraints + Outputs> Arguments<M> {
    fn of(state: &M::State, read: &ModelDerivatives) -> Self {
        let (mut accelerations, mut multipliers) = (M::Vector::zeros(), M::Rows::zeros());
        accelerations.as_mut_slice().copy_from_slice(read.accelerations.as_slice());
        multipliers.as_mut_slice().copy_from_slice(read.multipliers.as_slice());
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

    /// Of each output, whether its derivatives jump here: those on both sides differ as much for a step as
    /// for a sixteenth of it. A step changes everything that an output is a function of, by different parts,
    /// so that it crosses whatever corner there is.
    fn corners(&self, model: &M) -> Vec<bool> {
        let difference = |step: f64| {
            let sides = [step, -step].map(|step| self.beside(step).derivatives(model));
            let [Some(above), Some(below)] = sides else { return Vec::new() };
            let change =
                |i: usize| (0..5).map(|k| (above[k].row(i) - below[k].row(i)).abs().sum()).sum::<f64>();
            let size = |i: usize| {
                (0..5).map(|k| above[k].row(i).abs().sum() + below[k].row(i).abs().sum()).sum::<f64>()
            };
            (0..M::OUTPUTS.len()).map(|i| (change(i), size(i))).collect::<Vec<_>>()
        };
        let (far, near) = (difference(1e-9), difference(1e-9 / 16.0));
        let jumps =
            |((far, _), (near, size)): (&(f64, f64), &(f64, f64))| *near > 1e-7 * size && *near > 0.5 * far;
        far.iter().zip(&near).map(jumps).collect()
    }

    fn beside(&self, step: f64) -> Self {
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
