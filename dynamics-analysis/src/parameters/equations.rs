//! The linear equations for the effect of small changes of parameters and state on a motion.
//!
//! With r = M q̈ − Q − Φ_qᵀλ and Φ̈ = Φ_q q̈ − γ, both zero along the motion, small changes δp, δq, δu make
//!
//! ```text
//! ⎡ M   −Φ_qᵀ ⎤ ⎡ δq̈ ⎤     ⎡ r_q  ⎤      ⎡ r_u  ⎤      ⎡ r_p  ⎤
//! ⎢           ⎥ ⎢     ⎥ = − ⎢      ⎥ δq − ⎢      ⎥ δu − ⎢      ⎥ δp
//! ⎣ Φ_q    0  ⎦ ⎣ δλ ⎦     ⎣ Φ̈_q ⎦      ⎣ Φ̈_u ⎦      ⎣ Φ̈_p ⎦
//! ```
//!
//! Derivatives by q and u are exact. They come from the generated solution if there is one. Otherwise they
//! come from the unsolved equations, which are solved here by least squares, so that rows may repeat others.
//! Derivatives by parameters are exact where the solution was generated; else they are differences of order 4
//! of r and Φ̈ at the q̈ and λ of the motion, good to about 12 digits, 9 where a parameter is near zero
//! ([`Sensitivities::exact`](super::Sensitivities::exact) says which).

use alloc::vec::Vec;

use dynamics_runtime::constrain::active_rows;
use dynamics_runtime::constrain::solve_once;
use dynamics_runtime::error::SolveError;
use dynamics_runtime::model::{Constraints, ModelState, Parameters, Terms, Vector};
use nalgebra::{DMatrix, DVector};

use super::sensitivity_error::SensitivityError;
use super::variable::moved;

/// First step of differences, relative to the parameter. The error of order 4 and rounding are then both near
/// 1e-12.
const RELATIVE_STEP: f64 = 1e-3;
/// Singular values of the scaled system up to this part of the largest count as zero: those of rows that
/// repeat others. A larger value would drop rows that are nearly dependent, a smaller one would keep
/// rounding.
const RANK_TOLERANCE_OF_SYSTEM: f64 = 1e-10;
/// Largest residual of a row after a correction, relative to its terms. A larger residual means that the row
/// contradicts others.
const MAX_ROW_RESIDUAL: f64 = 1e-6;
/// Inertia of a coordinate without any as a scale, relative to the largest. A smaller value lets such a
/// coordinate dominate the scaled system.
const MIN_INERTIA: f64 = 1e-6;

/// The scale of a parameter or a start: its absolute value, or 1 if it is 0.
pub(super) fn size(value: f64) -> f64 {
    if value == 0.0 { 1.0 } else { value.abs() }
}

/// The step by which a parameter is first moved for differences.
pub(super) fn step(value: f64) -> f64 {
    RELATIVE_STEP * size(value)
}

/// (8 (f₁ − f₋₁) − (f₂ − f₋₂)) / 12 h, of vectors at h, −h, 2 h, −2 h.
pub(super) fn fourth_order(values: [DVector<f64>; 4], h: f64) -> DVector<f64> {
    let [right, left, far_right, far_left] = values;
    ((right - left) * 8.0 - (far_right - far_left)) / (12.0 * h)
}

/// Least change of a value over a step, relative to its terms. Smaller changes are too near to rounding, and
/// longer steps are tried.
const MIN_CHANGE: f64 = 1e-6;
/// Largest relative distance of the differences of order 2 and 4 with which a derivative is believed. With a
/// larger one a corner within the step would be believed.
const MAX_ORDER_DISTANCE: f64 = 1e-3;
/// Distance of the orders at which a derivative has 10 digits, since the error of order 4 is about the square
/// of that of order 2. At larger distances shorter steps are tried.
const ACCURATE_ORDER_DISTANCE: f64 = 1e-5;
/// Derivative, in roundings of the difference, whose change of the value a shorter step would still show. A
/// smaller value would take rounding for a change.
const VISIBLE_DERIVATIVE: f64 = 1e3;
/// Ratio of a longer step to the one before.
const STEP_GROWTH: f64 = 1e3;
/// Most longer steps. The last one is 1e15 times the parameter.
const MAX_LONGER_STEPS: usize = 6;
/// Ratio of a shorter step to the one before. Rounding grows with it, so steps become no shorter than
/// necessary.
const STEP_REDUCTION: f64 = 1.0 / 32.0;
/// Most shorter steps. The last one is 1e-12 of the parameter; shorter ones would change little but rounding.
const MAX_SHORTER_STEPS: usize = 6;
/// A longer step is confirmed by one that is shorter by this factor.
const CONFIRMATION_RATIO: f64 = 3.0;

/// Differences with one step.
struct Differences {
    /// The derivatives by order 4.
    found: DVector<f64>,
    /// Their error estimate: the distance of order 2 from order 4, plus rounding.
    errors: DVector<f64>,
    /// Values that hardly changed.
    weak: Vec<bool>,
    /// Values that did not change at all.
    unmoved: Vec<bool>,
    /// Rounding of the derivatives.
    rounding: DVector<f64>,
}

/// f′(0) by differences of order 4, beginning with the step `first`. `sizes` are the scales of the values
/// of f.
///
/// The step is relative to a parameter, and may fail in two ways. If the parameter is near zero, the step may
/// change only rounding: values that change by less than [`MIN_CHANGE`] of their scale try longer steps. If
/// it is zero, it has no scale, and the step may be too long: values whose orders do not agree try shorter
/// steps. Each value takes the derivative with the smallest error estimate.
pub(super) fn differences(
    first: f64,
    sizes: &DVector<f64>,
    f: impl Fn(f64) -> Result<DVector<f64>, SensitivityError>,
) -> Result<DVector<f64>, SensitivityError> {
    let stage = |h: f64| {
        let values = [f(h)?, f(-h)?, f(2.0 * h)?, f(-2.0 * h)?];
        let size = |i: usize| values.iter().map(|v| v[i].abs()).fold(sizes[i], f64::max);
        let [moved, farther] = [&values[0] - &values[1], &values[2] - &values[3]];
        // If only the values at ±2h change, there is a corner in between, and the value needs shorter steps.
        let change = |i: usize| moved[i].abs().max(farther[i].abs());
        let weak = (0..sizes.len()).map(|i| change(i) <= MIN_CHANGE * size(i)).collect();
        let unmoved = (0..sizes.len()).map(|i| change(i) == 0.0).collect();
        let rounding = DVector::from_fn(sizes.len(), |i, _| f64::EPSILON * size(i) / h);
        let found = fourth_order(values, h);
        let errors = (&found - moved / (2.0 * h)).abs() + &rounding;
        Ok::<_, SensitivityError>(Differences { found, errors, weak, unmoved, rounding })
    };
    let mut best: Differences = stage(first)?;
    let all = 0..sizes.len();
    let weak: Vec<usize> = all.clone().filter(|i| best.weak[*i]).collect();
    let is_coarse = |i: usize, of: &Differences| of.errors[i] > ACCURATE_ORDER_DISTANCE * of.found[i].abs();
    let coarse: Vec<usize> = all.filter(|i| !best.weak[*i] && is_coarse(*i, &best)).collect();
    let improves = |factor: f64, i: usize, next: &Differences, best: &Differences| {
        let part = |of: &Differences| of.errors[i] / of.found[i].abs();
        // The value changed over the longer step, and does not over the shorter one, though the change would
        // be visible: a corner was in between, and the derivative is 0.
        let is_flat = next.unmoved[i] && best.found[i].abs() > VISIBLE_DERIVATIVE * next.rounding[i];
        // Shorter steps must agree in relative terms, because rounding makes the derivative itself larger.
        if factor > 1.0 {
            next.errors[i] < best.errors[i]
        } else {
            part(next) < part(best).min(MAX_ORDER_DISTANCE) || is_flat
        }
    };
    let searches = [(weak, STEP_GROWTH, MAX_LONGER_STEPS), (coarse, STEP_REDUCTION, MAX_SHORTER_STEPS)];
    for (mut open, factor, count) in searches {
        let mut h = first;
        for _ in 0..count {
            h *= factor;
            // The model may not exist at so long a step.
            let Some(next) = Some(h).filter(|_| !open.is_empty()).and_then(|h| stage(h).ok()) else { break };
            // Both orders agree by chance if a function saturates on both sides. So a second step must
            // confirm a longer one.
            let other = if factor > 1.0 { stage(h / CONFIRMATION_RATIO).ok() } else { None };
            let agrees = |i: usize, other: &Differences| {
                (other.found[i] - next.found[i]).abs() <= MAX_ORDER_DISTANCE * next.found[i].abs()
            };
            let believed = |i: usize| factor < 1.0 || other.as_ref().is_some_and(|other| agrees(i, other));
            let taken: Vec<usize> =
                open.iter().copied().filter(|i| improves(factor, *i, &next, &best) && believed(*i)).collect();
            for i in &taken {
                (best.found[*i], best.errors[*i]) = (next.found[*i], next.errors[*i]);
            }
            if factor > 1.0 {
                open.retain(|i| next.weak[*i]);
            } else {
                open.retain(|i| is_coarse(*i, &best) && !(taken.contains(i) && next.unmoved[*i]));
            }
        }
    }
    Ok(best.found)
}

/// Differences of a function of the model by one of its parameters; `sizes` as in [`differences`].
pub(super) fn by_parameter<M: Parameters + Clone>(
    model: &M,
    parameter: usize,
    sizes: &DVector<f64>,
    f: impl Fn(&M) -> Result<DVector<f64>, SensitivityError>,
) -> Result<DVector<f64>, SensitivityError> {
    let name = M::PARAMETERS[parameter].name;
    let value = model.parameter(parameter).ok_or(SensitivityError::NoParameterValue { name })?;
    differences(step(value), sizes, |by| {
        f(&moved(model, parameter, by).ok_or(SensitivityError::NoParameterValue { name })?)
    })
}

/// The equations at one state.
pub(super) struct EquationsAtState {
    n: usize,
    rows: Vec<usize>,
    /// Pseudo-inverse of the system above.
    inverse: DMatrix<f64>,
    jacobian: DMatrix<f64>,
    mass: DMatrix<f64>,
}

impl EquationsAtState {
    /// M and Φ_q at a state, and the pseudo-inverse.
    pub(super) fn of<M: Constraints>(model: &M, state: &M::State) -> Result<Self, SensitivityError> {
        let (mass, jacobian) = terms(model, state)?;
        let rows: Vec<usize> = active_rows::<M>(state.active_set(), false).collect();
        let jacobian = jacobian.select_rows(&rows);
        Self::with(mass, jacobian, rows).ok_or(SensitivityError::NotFinite { time: state.t() })
    }

    fn with(mass: DMatrix<f64>, jacobian: DMatrix<f64>, rows: Vec<usize>) -> Option<Self> {
        let (n, r) = (mass.nrows(), rows.len());
        // Scale coordinates and rows, so that their units have no influence on the rank.
        let largest = mass.diagonal().amax();
        let scale = DVector::from_fn(n, |i, _| {
            1.0 / mass[(i, i)].max(MIN_INERTIA * largest).max(f64::MIN_POSITIVE).sqrt()
        });
        let sizes = DVector::from_fn(r, |i, _| {
            let size =
                jacobian.row(i).iter().zip(scale.iter()).map(|(x, s)| (x * s).abs()).fold(0.0, f64::max);
            if size > 0.0 { 1.0 / size } else { 1.0 }
        });
        let all = DVector::from_iterator(n + r, scale.iter().chain(sizes.iter()).copied());
        let mut system = DMatrix::zeros(n + r, n + r);
        system.view_mut((0, 0), (n, n)).copy_from(&mass);
        system.view_mut((0, n), (n, r)).copy_from(&-jacobian.transpose());
        system.view_mut((n, 0), (r, n)).copy_from(&jacobian);
        let scaled = DMatrix::from_fn(n + r, n + r, |i, j| all[i] * system[(i, j)] * all[j]);
        let svd = scaled.svd(true, true);
        let cut = RANK_TOLERANCE_OF_SYSTEM * svd.singular_values.amax();
        let inverse = svd.pseudo_inverse(cut).ok()?;
        let inverse = DMatrix::from_fn(n + r, n + r, |i, j| all[i] * inverse[(i, j)] * all[j]);
        inverse.iter().all(|x| x.is_finite()).then_some(Self { n, rows, inverse, jacobian, mass })
    }

    /// δq̈ for right-hand sides of r and Φ̈.
    fn accelerations(&self, right: &DMatrix<f64>) -> DMatrix<f64> {
        (&self.inverse * right).rows(0, self.n).into_owned()
    }

    /// Checks that a correction solves all rows. Rows that repeat each other contradict each other after a
    /// change of a parameter that is in one and not in the other. `sizes`: the scales of the right-hand
    /// sides.
    fn check<M: Constraints>(
        &self,
        correction: &DMatrix<f64>,
        right: &DMatrix<f64>,
        sizes: &DMatrix<f64>,
        parameters: &[Option<usize>],
    ) -> Result<(), SensitivityError> {
        let left = &self.jacobian * correction - right;
        // A row with a residual of 0 has the rounding of the terms of the others.
        let rounding = self.jacobian.abs() * correction.abs() * RANK_TOLERANCE_OF_SYSTEM;
        for (i, row) in self.rows.iter().enumerate() {
            for (k, parameter) in parameters.iter().enumerate() {
                let left = left[(i, k)].abs();
                if left.is_nan() || left > MAX_ROW_RESIDUAL * sizes[(i, k)] + rounding[(i, k)] {
                    let parameter = parameter.map(|p| M::PARAMETERS[p].name);
                    return Err(SensitivityError::Contradicts { parameter, row: M::ROWS[*row].name });
                }
            }
        }
        Ok(())
    }

    /// The smallest change with Φ_q δ = `right`, measured by M, as simulations put starts onto their
    /// constraints.
    fn correction(&self, right: &DMatrix<f64>) -> DMatrix<f64> {
        let mut all = DMatrix::zeros(self.n + self.rows.len(), right.ncols());
        all.rows_mut(self.n, self.rows.len()).copy_from(right);
        self.accelerations(&all)
    }
}

/// M and Φ_q of all rows.
fn terms<M: Constraints>(
    model: &M,
    state: &M::State,
) -> Result<(DMatrix<f64>, DMatrix<f64>), SensitivityError> {
    let (n, r) = (M::Vector::LEN, M::Rows::LEN);
    let (mut mass, mut force) = (alloc::vec![0.0; n * n], alloc::vec![0.0; n]);
    let (mut jacobian, mut gamma) = (alloc::vec![0.0; r * n], alloc::vec![0.0; r]);
    let mut terms = Terms { mass: &mut mass, force: &mut force, jacobian: &mut jacobian, gamma: &mut gamma };
    model.terms(state, &mut terms);
    if !mass.iter().chain(&jacobian).all(|x| x.is_finite()) {
        return Err(SensitivityError::NotFinite { time: state.t() });
    }
    Ok((DMatrix::from_row_slice(n, n, &mass), DMatrix::from_row_slice(r, n, &jacobian)))
}

/// The residuals r and Φ̈ of the given rows, at given q̈ and λ, and the sizes of their largest terms.
fn residuals_with_sizes<M: Constraints>(
    model: &M,
    state: &M::State,
    rows: &[usize],
    accelerations: &DVector<f64>,
    multipliers: &[f64],
) -> Result<(DVector<f64>, DVector<f64>), SensitivityError> {
    let (n, r) = (M::Vector::LEN, M::Rows::LEN);
    let (mut mass, mut force) = (alloc::vec![0.0; n * n], alloc::vec![0.0; n]);
    let (mut jacobian, mut gamma) = (alloc::vec![0.0; r * n], alloc::vec![0.0; r]);
    let mut terms = Terms { mass: &mut mass, force: &mut force, jacobian: &mut jacobian, gamma: &mut gamma };
    model.terms(state, &mut terms);
    let mut found = DVector::zeros(n + rows.len());
    let mut sizes = found.clone();
    for i in 0..n {
        let moved: f64 = (0..n).map(|j| mass[i * n + j] * accelerations[j]).sum();
        let held: f64 = rows.iter().map(|row| jacobian[row * n + i] * multipliers[*row]).sum();
        found[i] = moved - force[i] - held;
        sizes[i] = moved.abs().max(force[i].abs()).max(held.abs());
    }
    for (k, row) in rows.iter().enumerate() {
        let moved: f64 = (0..n).map(|j| jacobian[row * n + j] * accelerations[j]).sum();
        found[n + k] = moved - gamma[*row];
        sizes[n + k] = moved.abs().max(gamma[*row].abs());
    }
    if found.iter().all(|x| x.is_finite()) {
        Ok((found, sizes))
    } else {
        Err(SensitivityError::NotFinite { time: state.t() })
    }
}

/// δq̈ = by_q δq + by_u δu + by_p δp at a state, inputs held; a column of `by_p` for each of the given
/// parameters, and whether all of it is exact.
pub(super) struct Coefficients {
    pub(super) by_q: DMatrix<f64>,
    pub(super) by_u: DMatrix<f64>,
    pub(super) by_p: DMatrix<f64>,
    pub(super) exact: bool,
}

/// The coefficients at a state of a motion.
pub(super) fn coefficients<M: Constraints + Parameters + Clone>(
    model: &M,
    constants: &M::Constants,
    state: &M::State,
    parameters: &[usize],
) -> Result<Coefficients, SensitivityError> {
    let (n, p) = (M::Vector::LEN, M::PARAMETERS.len());
    let (mut by_q, mut by_u) = (alloc::vec![0.0; n * n], alloc::vec![0.0; n * n]);
    let finite = |values: &[f64]| values.iter().all(|x| x.is_finite());
    let generated =
        model.acceleration_derivatives(state, &mut by_q, &mut by_u) && finite(&by_q) && finite(&by_u);
    let mut values = alloc::vec![0.0; n * p];
    let exact =
        parameters.is_empty() || (model.acceleration_by_parameters(state, &mut values) && finite(&values));
    // From the generated solution, as far as there is one.
    let matrix = |values: &[f64]| DMatrix::from_row_slice(n, n, values);
    let mut found = Coefficients {
        by_q: matrix(&by_q),
        by_u: matrix(&by_u),
        by_p: DMatrix::from_row_slice(n, p, &values).select_columns(parameters),
        exact,
    };
    if generated && exact {
        return Ok(found);
    }
    // The rest from the unsolved equations: by q and q̇ exactly, by parameters from differences of the
    // residuals.
    let equations = EquationsAtState::of(model, state)?;
    let solved = solve_once(model, constants, state).map_err(|error| not_solved::<M>(state, error))?;
    let accelerations = DVector::from_column_slice(solved.accelerations.as_slice());
    let multipliers = solved.multipliers.as_slice();
    if !generated {
        let (r, w) = (M::Rows::LEN, M::Inputs::LEN);
        let mut values = alloc::vec![0.0; (n + r) * (2 * n + w) + r * n];
        if !model.variations(state, &solved.accelerations, &solved.multipliers, &mut values) {
            return Err(SensitivityError::NoDerivatives);
        }
        let kept: Vec<usize> = (0..n).chain(equations.rows.iter().map(|row| n + row)).collect();
        let size = (n + r) * n;
        let of = |values: &[f64]| DMatrix::from_row_slice(n + r, n, values).select_rows(&kept);
        found.by_q = -equations.accelerations(&of(&values[..size]));
        found.by_u = -equations.accelerations(&of(&values[size..2 * size]));
    }
    if !exact {
        let left =
            |model: &M| residuals_with_sizes(model, state, &equations.rows, &accelerations, multipliers);
        let (_, sizes) = left(model)?;
        for (k, parameter) in parameters.iter().enumerate() {
            let by = by_parameter(model, *parameter, &sizes, |model| Ok(left(model)?.0))?;
            let change = -equations.accelerations(&DMatrix::from_columns(&[by]));
            found.by_p.set_column(k, &change.column(0));
        }
    }
    let all = [&found.by_q, &found.by_u, &found.by_p];
    if all.iter().all(|m| finite(m.as_slice())) {
        Ok(found)
    } else {
        Err(SensitivityError::NotFinite { time: state.t() })
    }
}

/// The error of a state at which there are no accelerations.
pub(super) fn not_solved<M: Constraints>(state: &M::State, error: SolveError) -> SensitivityError {
    SensitivityError::Solve { time: state.t(), error }
}

/// Puts changes of a state onto the constraints, Φ_q δq + Φ_p δp = 0 and Φ̇_q δq + Φ̇_u δu + Φ̇_p δp = 0, by
/// the smallest correction measured by M. The columns are those of `parameters`, `None` where the parameters
/// stay.
pub(super) fn project_changes<M: Constraints + Parameters + Clone>(
    model: &M,
    state: &M::State,
    parameters: &[Option<usize>],
    changes: &mut DMatrix<f64>,
) -> Result<(), SensitivityError> {
    let n = M::Vector::LEN;
    if M::Rows::LEN == 0 {
        return Ok(());
    }
    let equations = EquationsAtState::of(model, state)?;
    let rows = &equations.rows;
    let holonomic: Vec<usize> = rows.iter().copied().filter(|row| *row < M::Residual::LEN).collect();
    let h = holonomic.len();
    let (positions, velocities) = (changes.rows(0, n).into_owned(), changes.rows(n, n).into_owned());
    // First the positions, with the holonomic rows only.
    let first = equations.jacobian.rows(0, h).into_owned();
    let places = EquationsAtState::with(equations.mass.clone(), first, holonomic.clone());
    let places = places.ok_or(SensitivityError::NotFinite { time: state.t() })?;
    let mut missed = &places.jacobian * &positions;
    let made_of = places.jacobian.abs() * DVector::from_column_slice(state.q().as_slice()).abs();
    let mut sizes = places.jacobian.abs() * positions.abs();
    for (k, parameter) in parameters.iter().enumerate() {
        let Some(parameter) = parameter else { continue };
        let residual = |model: &M| {
            let all = model.residual(state);
            Ok(DVector::from_iterator(h, holonomic.iter().map(|row| all[*row])))
        };
        let by = by_parameter(model, *parameter, &made_of, residual)?;
        sizes.column_mut(k).zip_apply(&by, |size, by| *size += by.abs());
        missed.column_mut(k).axpy(1.0, &by, 1.0);
    }
    let correction = places.correction(&missed);
    places.check::<M>(&correction, &missed, &sizes, parameters)?;
    let positions = positions - correction;
    changes.rows_mut(0, n).copy_from(&positions);
    // Then the velocities, with all rows and the corrected positions.
    let by_q = velocity_by_q(model, state, rows)?;
    let mut missed = &equations.jacobian * &velocities + &by_q * &positions;
    let made_of = equations.jacobian.abs() * DVector::from_column_slice(state.u().as_slice()).abs();
    let mut sizes = equations.jacobian.abs() * velocities.abs() + by_q.abs() * positions.abs();
    for (k, parameter) in parameters.iter().enumerate() {
        let Some(parameter) = parameter else { continue };
        let rates = |model: &M| {
            let all = model.velocity_residual(state);
            Ok(DVector::from_iterator(rows.len(), rows.iter().map(|row| all[*row])))
        };
        let by = by_parameter(model, *parameter, &made_of, rates)?;
        sizes.column_mut(k).zip_apply(&by, |size, by| *size += by.abs());
        missed.column_mut(k).axpy(1.0, &by, 1.0);
    }
    let correction = equations.correction(&missed);
    equations.check::<M>(&correction, &missed, &sizes, parameters)?;
    let velocities = velocities - correction;
    changes.rows_mut(n, n).copy_from(&velocities);
    if changes.iter().all(|x| x.is_finite()) {
        Ok(())
    } else {
        Err(SensitivityError::NotFinite { time: state.t() })
    }
}

/// ∂Φ̇/∂q of the given rows: exact where variations are generated.
fn velocity_by_q<M: Constraints>(
    model: &M,
    state: &M::State,
    rows: &[usize],
) -> Result<DMatrix<f64>, SensitivityError> {
    let (n, r, w) = (M::Vector::LEN, M::Rows::LEN, M::Inputs::LEN);
    let mut values = alloc::vec![0.0; (n + r) * (2 * n + w) + r * n];
    // This part does not depend on q̈ and λ.
    if !model.variations(state, &M::Vector::zeros(), &M::Rows::zeros(), &mut values) {
        return Err(SensitivityError::NoDerivatives);
    }
    let first = values.len() - r * n;
    Ok(DMatrix::from_row_slice(r, n, &values[first..]).select_rows(rows))
}
