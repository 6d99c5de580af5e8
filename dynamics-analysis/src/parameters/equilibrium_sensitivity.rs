//! How equilibria and natural frequencies change with a parameter.
//!
//! *Equilibria*, by the implicit function theorem: the balance Eᵀ(Q + Φ_qᵀλ) = 0 on the constraints
//! Φ = 0 stays fulfilled, so that with δq = D δz + δq_Φ, where δq_Φ are the dependent coordinates that
//! keep Φ = 0 while z stands still,
//!
//! ```text
//! K δz = −(Eᵀ r_p + Eᵀ r_q δq_Φ) δp
//! K = Eᵀ r_q D at the λ that leaves nothing on dependent coordinates
//! ```
//!
//! *Frequencies*: K φ = ω² M φ with φᵀM φ = 1 gives δ(ω²) = φᵀ(δK − ω² δM) φ (R. L. Fox & M. P. Kapoor, AIAA
//! J. 6 (1968) 2426), where δK and δM are total: the equilibrium moves with the parameter. They are
//! differences of order 4 of the exact matrices. Equal frequencies have no single derivatives. They split as
//! the eigenvalues of Φᵀ(δK − ω² δM)Φ, where Φ has all their modes; these eigenvalues are given.

use alloc::vec::Vec;

use dynamics_runtime::constrain::solve_once;
use dynamics_runtime::error::SolveError;
use dynamics_runtime::model::{ModelState, Parameters, Quantity, Vector};
use dynamics_runtime::simulate::Simulate;
use nalgebra::{Cholesky, DMatrix, DVector, SymmetricEigen};

use super::equations::{by_parameter, differences, step};
use super::sensitivity_error::SensitivityError;
use super::variable::{Variable, VariableError, moved};
use crate::displacement::{displaced, project, projected};
use crate::equilibria::{EquilibriumOptions, find};
use crate::linearize::{Linearization, linearize};
use crate::vibration::MIN_SQUARED_FREQUENCY;

/// Least singular value of the scaled stiffness, relative to the largest, at which an equilibrium has a
/// derivative. Below it, as in a fold, half of the digits are lost.
const RANK_TOLERANCE_OF_STIFFNESS: f64 = 1e-8;
/// Relative change of the parameters that shows the sizes of the terms of the stiffness. A smaller change
/// loses digits in the differences; a larger one may leave the valid range of a parameter.
const PARAMETER_PERTURBATION: f64 = 1e-6;
/// Elements of damping and circulatory matrices up to this part of the largest are rounding. A larger value
/// would ignore weak damping.
const ROUNDING_OF_ELEMENTS: f64 = 1e-13;
/// Largest damping, gyroscopic or circulatory terms, relative to stiffness (and mass), of a conservative
/// system. Larger terms would change frequencies by more than about this part.
const MAX_NONCONSERVATIVE_SHARE: f64 = 1e-10;
/// Relative difference of ω² up to which frequencies count as equal. Equal frequencies have no single
/// derivatives; those of nearly equal ones lose digits in proportion to 1/difference.
const EQUAL_FREQUENCIES_OF_DERIVATIVES: f64 = 1e-8;
/// Rounds of scaling rows and columns; each brings the largest elements nearer to 1 by a square root. After
/// eight rounds their logarithm is 2⁻⁸ of the first one.
const SCALING_ROUNDS: usize = 8;
/// Rounds of projection with the independent coordinates held; each is a Newton step.
const PROJECTION_ROUNDS: usize = 8;

/// How an equilibrium moves with a parameter.
#[derive(Clone, Debug, PartialEq)]
pub struct EquilibriumChange {
    /// ∂q/∂parameter, N, in the units of the coordinates by that of the parameter.
    pub by: DVector<f64>,
    /// The coordinates.
    pub coordinates: &'static [Quantity],
    /// The amplification of force errors in the coordinates: the largest over the smallest singular value of
    /// the scaled stiffness. It is large near folds.
    pub conditioning: f64,
}

/// How a natural frequency changes with a parameter.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FrequencyChange {
    /// ω, rad/s; 0 for a rigid-body mode, NaN for an unstable mode.
    pub frequency: f64,
    /// ω², 1/s².
    pub square: f64,
    /// ∂ω²/∂parameter.
    pub square_by: f64,
    /// ∂ω/∂parameter; NaN if ω is 0 or NaN.
    pub frequency_by: f64,
    /// How many frequencies are equal to this one, itself included. Above 1 this is one of the derivatives
    /// with which they split.
    pub multiplicity: usize,
}

/// The index of a parameter by its name.
fn parameter_of<M: Parameters>(name: &str) -> Result<usize, SensitivityError> {
    match Variable::of::<M>(name)? {
        Variable::Parameter(i) => Ok(i),
        _ => Err(VariableError::Unknown { name: name.into(), nearest: None }.into()),
    }
}

/// See [`Vary::equilibrium_by`](crate::Vary::equilibrium_by).
pub(super) fn equilibrium_by<M: Simulate + Parameters + Clone>(
    model: &M,
    state: &M::State,
    parameter: &str,
) -> Result<EquilibriumChange, SensitivityError> {
    let parameter = parameter_of::<M>(parameter)?;
    let linear = linearize(model, state, &[])?;
    if let Some(reason) = linear.unsteady {
        return Err(reason.into());
    }
    if linear.coordinates.len() != linear.velocities.len() {
        // With nonholonomic constraints equilibria form families.
        return Err(SensitivityError::Fold { coordinate: linear.coordinates[0].name, ratio: 0.0 });
    }
    let change = change_of(model, state, parameter, &linear)?;
    if M::EXPLICIT_TIME {
        check_time_dependence(model, state, parameter, &change)?;
    }
    Ok(change)
}

/// Checks that forces do not change with time, at this value of the parameter and at neighbouring ones. There
/// may be an equilibrium at this value only, for example if a drive has the amplitude 0.
fn check_time_dependence<M: Simulate + Parameters + Clone>(
    model: &M,
    state: &M::State,
    parameter: usize,
    change: &EquilibriumChange,
) -> Result<(), SensitivityError> {
    let moving = state.u().as_slice().iter().any(|u| *u != 0.0);
    let value = model.parameter(parameter);
    let h = step(value.ok_or(SensitivityError::NoParameterValue { name: M::PARAMETERS[parameter].name })?);
    for by in [0.0, h, -h] {
        let Some(neighbour) = moved(model, parameter, by) else { continue };
        let start = displaced(state, change.by.iter().map(|d| by * d));
        // Other errors of the search, for example of an invalid value, have no effect on the derivative.
        match find(&neighbour, &start, EquilibriumOptions { moving, ..EquilibriumOptions::REST }) {
            Err(error) if error.is_of_time() => return Err(error.into()),
            _ => {}
        }
    }
    Ok(())
}

fn change_of<M: Simulate + Parameters + Clone>(
    model: &M,
    state: &M::State,
    parameter: usize,
    linear: &Linearization,
) -> Result<EquilibriumChange, SensitivityError> {
    let n = M::Vector::LEN;
    // The dependent coordinates follow the constraints; the independent ones stand still.
    let mut names: Vec<&'static str> = Vec::new();
    names.extend(linear.coordinates.iter().map(|q| q.name));
    let held: Vec<usize> = (0..n).filter(|i| names.contains(&M::COORDINATES[*i].name)).collect();
    let accelerations = |model: &M| {
        let constants = model.constants().map_err(SolveError::from);
        let solve = |state: &M::State| {
            let solved = solve_once(model, constants.as_ref().map_err(Clone::clone)?, state)?;
            Ok::<_, SolveError>(solved.accelerations)
        };
        let at = on_constraints(model, state, &held, linear)?;
        let found = solve(&at).map_err(|error| SensitivityError::Solve { time: state.t(), error })?;
        Ok(DVector::from_column_slice(found.as_slice()))
    };
    let rates: Vec<usize> = linear.velocities.iter().filter_map(|v| index::<M>(v.name)).collect();
    // The unbalanced force after a change of the parameter is EᵀM E v̇.
    let sizes = acceleration_sizes::<M>(state, linear, &rates);
    let by = by_parameter(model, parameter, &sizes, accelerations)?;
    let force = &linear.mass * by.select_rows(&rates);
    let (of_independent, conditioning) = solve_stiffness(model, state, linear, &force)?;
    let places = DVector::from_column_slice(state.q().as_slice()).abs();
    let following = by_parameter(model, parameter, &places, |model| {
        let at = on_constraints(model, state, &held, linear)?;
        Ok(DVector::from_column_slice(at.q().as_slice()))
    })?;
    let by = following + &linear.shape * of_independent;
    Ok(EquilibriumChange { by, coordinates: M::COORDINATES, conditioning })
}

/// The scales of the accelerations at an equilibrium, where they are 0: the terms K z divided by the mass.
fn acceleration_sizes<M: Simulate>(
    state: &M::State,
    linear: &Linearization,
    rates: &[usize],
) -> DVector<f64> {
    let mut found = DVector::zeros(M::Vector::LEN);
    let places = linear.coordinates.iter().filter_map(|q| index::<M>(q.name)).map(|i| state.q()[i].abs());
    let force = linear.stiffness.abs() * DVector::from_iterator(linear.coordinates.len(), places);
    for (k, i) in rates.iter().enumerate() {
        found[*i] = force[k] / linear.mass[(k, k)].max(f64::MIN_POSITIVE);
    }
    found
}

/// The scales of the elements of K: their values, or their relative changes after different changes of all
/// parameters, if these are larger. Terms that cancel each other in K do not cancel after such a change.
fn stiffness_sizes<M: Simulate + Parameters + Clone>(
    model: &M,
    state: &M::State,
    linear: &Linearization,
) -> DMatrix<f64> {
    let names: Vec<&str> = linear.coordinates.iter().map(|q| q.name).collect();
    let relative_change = |by: f64| {
        let mut other = model.clone();
        for i in 0..M::PARAMETERS.len() {
            // Fractions of multiples of the golden section are well distributed.
            let part = 0.5 + (0.618_033_988_749_895 * (i + 1) as f64).fract();
            other.set_parameter(i, model.parameter(i)? * (1.0 + by * part));
        }
        let state = projected(&other, &other.constants().ok()?, *state).ok()?;
        Some((linearize(&other, &state, &names).ok()?.stiffness - &linear.stiffness) / by)
    };
    // If the changed models are invalid, |K| remains.
    let n = linear.stiffness.nrows();
    [PARAMETER_PERTURBATION, -PARAMETER_PERTURBATION].into_iter().filter_map(relative_change).fold(
        linear.stiffness.abs(),
        |most, change| {
            DMatrix::from_fn(n, n, |i, j| {
                if change[(i, j)].is_finite() { most[(i, j)].max(change[(i, j)].abs()) } else { most[(i, j)] }
            })
        },
    )
}

/// K⁻¹ `force`, and the conditioning of K, with rows and columns scaled by the sizes of the terms
/// (D. Ruiz, Report RAL-TR-2001-034).
fn solve_stiffness<M: Simulate + Parameters + Clone>(
    model: &M,
    state: &M::State,
    linear: &Linearization,
    force: &DVector<f64>,
) -> Result<(DVector<f64>, f64), SensitivityError> {
    let (n, sizes) = (linear.stiffness.nrows(), stiffness_sizes(model, state, linear));
    let (mut rows, mut columns) = (DVector::repeat(n, 1.0), DVector::repeat(n, 1.0));
    let part = |x: f64| if x > 0.0 { 1.0 / x.sqrt() } else { 1.0 };
    for _ in 0..SCALING_ROUNDS {
        let now = DMatrix::from_fn(n, n, |i, j| rows[i] * sizes[(i, j)] * columns[j]);
        rows = DVector::from_fn(n, |i, _| rows[i] * part(now.row(i).amax()));
        columns = DVector::from_fn(n, |j, _| columns[j] * part(now.column(j).amax()));
    }
    let svd = DMatrix::from_fn(n, n, |i, j| rows[i] * linear.stiffness[(i, j)] * columns[j]).svd(true, true);
    // The scale of all elements is now 1.
    let (least, most) = (svd.singular_values.min(), svd.singular_values.max());
    if least.is_nan() || least <= RANK_TOLERANCE_OF_STIFFNESS * most.max(1.0) {
        let along = svd.v_t.as_ref().map_or(0, |v| v.row(v.nrows() - 1).transpose().iamax());
        return Err(SensitivityError::Fold {
            coordinate: linear.coordinates[along].name,
            ratio: least / most.max(1.0),
        });
    }
    let not_finite = SensitivityError::NotFinite { time: state.t() };
    let found = svd.solve(&force.component_mul(&rows), 0.0).map_err(|_| not_finite)?;
    Ok((found.component_mul(&columns), most.max(1.0) / least))
}

fn index<M: Simulate>(name: &str) -> Option<usize> {
    M::COORDINATES.iter().position(|q| q.name == name)
}

/// The state projected onto the constraints of a model with another parameter, with its independent
/// coordinates held.
fn on_constraints<M: Simulate>(
    model: &M,
    state: &M::State,
    held: &[usize],
    linear: &Linearization,
) -> Result<M::State, SensitivityError> {
    let failed = |error| SensitivityError::Solve { time: state.t(), error };
    let constants = model.constants().map_err(SolveError::from).map_err(failed)?;
    let mut moved = *state;
    // A projection moves all coordinates. The change of the independent ones is undone along the constraints.
    for _ in 0..PROJECTION_ROUNDS {
        project(model, &constants, &mut moved).map_err(failed)?;
        let mut off = DVector::zeros(linear.coordinates.len());
        for (k, q) in linear.coordinates.iter().enumerate() {
            let i = index::<M>(q.name).filter(|i| held.contains(i));
            off[k] = i.map_or(0.0, |i| moved.q()[i] - state.q()[i]);
        }
        if off.amax() == 0.0 {
            break;
        }
        let back = &linear.shape * off;
        moved = displaced(&moved, &-back);
    }
    projected(model, &constants, moved).map_err(failed)
}

/// See [`Vary::frequencies_by`](crate::Vary::frequencies_by).
pub(super) fn frequencies_by<M: Simulate + Parameters + Clone>(
    model: &M,
    state: &M::State,
    parameter: &str,
) -> Result<Vec<FrequencyChange>, SensitivityError> {
    let index = parameter_of::<M>(parameter)?;
    let linear = linearize(model, state, &[])?;
    check_conservative(&linear)?;
    let change = equilibrium_by(model, state, parameter)?;
    let names: Vec<&str> = linear.coordinates.iter().map(|q| q.name).collect();
    let value = model
        .parameter(index)
        .ok_or(SensitivityError::NoParameterValue { name: M::PARAMETERS[index].name })?;
    let h = step(value);
    let (rows, failed) = (linear.mass.nrows(), |error| SensitivityError::Solve { time: state.t(), error });
    let at = |by: f64| {
        let moved = moved(model, index, by)
            .ok_or(SensitivityError::NoParameterValue { name: M::PARAMETERS[index].name })?;
        let constants = moved.constants().map_err(SolveError::from).map_err(failed)?;
        let nearby = displaced(state, change.by.iter().map(|x| x * by));
        let state = projected(&moved, &constants, nearby).map_err(failed)?;
        // The linear change is in balance to first order of the step only. The search removes the rest.
        let state = crate::equilibria::equilibrium(&moved, &state)?.state;
        let nearby = linearize(&moved, &state, &names)?;
        let both = nearby.mass.iter().chain(nearby.stiffness.iter()).copied();
        Ok::<_, SensitivityError>(DVector::from_iterator(2 * rows * rows, both))
    };
    let both = linear.mass.iter().chain(linear.stiffness.iter()).map(|x| x.abs());
    let by = differences(h, &DVector::from_iterator(2 * rows * rows, both), at)?;
    let matrix =
        |first: usize| DMatrix::from_column_slice(rows, rows, &by.as_slice()[first..first + rows * rows]);
    changes(&linear, &matrix(0), &matrix(rows * rows))
}

/// Checks that there are only mass and stiffness: no damping, gyroscopic or circulatory terms.
fn check_conservative(linear: &Linearization) -> Result<(), SensitivityError> {
    if let Some(reason) = &linear.unsteady {
        return Err(reason.clone().into());
    }
    let n = linear.mass.nrows();
    // Divided by the masses, elements are ω² and 2 ζ ω, and each is compared with those of its row and
    // column.
    let scaled = |matrix: &DMatrix<f64>| {
        let size = |i: usize| linear.mass[(i, i)].max(f64::MIN_POSITIVE).sqrt();
        DMatrix::from_fn(n, n, |i, j| (matrix[(i, j)] / (size(i) * size(j))).abs())
    };
    let stiffness = scaled(&linear.stiffness);
    let squares: Vec<f64> = stiffness.row_iter().map(|row| row.amax()).collect();
    let part_of = |matrix: &DMatrix<f64>, least: f64, power: f64| {
        let part = |i: usize, j: usize| {
            let scale = (squares[i] * squares[j]).powf(0.5 * power).max(f64::MIN_POSITIVE);
            if matrix[(i, j)] > least { matrix[(i, j)] / scale } else { 0.0 }
        };
        (0..n * n).map(|k| part(k / n, k % n)).fold(0.0, f64::max)
    };
    let circulatory = linear.circulatory().map_or(f64::INFINITY, |turning| {
        part_of(&scaled(&turning), ROUNDING_OF_ELEMENTS * stiffness.amax(), 1.0)
    });
    let damping = scaled(&linear.damping);
    let part = circulatory.max(part_of(&damping, ROUNDING_OF_ELEMENTS * damping.amax(), 0.5));
    if part <= MAX_NONCONSERVATIVE_SHARE { Ok(()) } else { Err(SensitivityError::NotConservative { part }) }
}

/// The changes of all frequencies from those of mass and stiffness.
fn changes(
    linear: &Linearization,
    mass_by: &DMatrix<f64>,
    stiffness_by: &DMatrix<f64>,
) -> Result<Vec<FrequencyChange>, SensitivityError> {
    let inertia = crate::LinearizeError::Inertia;
    let factors = Cholesky::new(linear.mass.clone()).ok_or(inertia)?;
    let lower = factors.l();
    let stiffness = 0.5 * (&linear.stiffness + linear.stiffness.transpose());
    let not_finite = || SensitivityError::NotFinite { time: 0.0 };
    // M = L Lᵀ reduces Kφ = ω²Mφ to a symmetric problem.
    let half = lower.solve_lower_triangular(&stiffness).ok_or_else(not_finite)?;
    let whole = lower.solve_lower_triangular(&half.transpose()).ok_or_else(not_finite)?;
    let eigen = SymmetricEigen::new(0.5 * (&whole + whole.transpose()));
    let modes = lower.tr_solve_lower_triangular(&eigen.eigenvectors).ok_or_else(not_finite)?;
    let mut order: Vec<usize> = (0..modes.ncols()).collect();
    order.sort_by(|a, b| eigen.eigenvalues[*a].total_cmp(&eigen.eigenvalues[*b]));
    let largest = eigen.eigenvalues.amax();
    // Group by group of equal frequencies.
    let mut found = Vec::new();
    let mut rest = order.as_slice();
    while let Some(first) = rest.first() {
        let square = eigen.eigenvalues[*first];
        let near = |i: &&usize| {
            let other = eigen.eigenvalues[**i];
            (other - square).abs()
                <= EQUAL_FREQUENCIES_OF_DERIVATIVES
                    * other.abs().max(square.abs()).max(MIN_SQUARED_FREQUENCY * largest)
        };
        let count = rest.iter().take_while(near).count();
        let (group, after) = rest.split_at(count);
        rest = after;
        let modes = modes.select_columns(group);
        let by = modes.tr_mul(&((stiffness_by - mass_by * square) * &modes));
        let mut squares_by: Vec<f64> =
            SymmetricEigen::new(0.5 * (&by + by.transpose())).eigenvalues.iter().copied().collect();
        squares_by.sort_by(f64::total_cmp);
        for (i, square_by) in group.iter().zip(squares_by) {
            let square = eigen.eigenvalues[*i];
            let frequency = square.sqrt();
            let frequency_by = if frequency > 0.0 { square_by / (2.0 * frequency) } else { f64::NAN };
            found.push(FrequencyChange { frequency, square, square_by, frequency_by, multiplicity: count });
        }
    }
    Ok(found)
}
