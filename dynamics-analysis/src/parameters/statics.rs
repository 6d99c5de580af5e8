//! How equilibria and natural frequencies change with a parameter.
//!
//! *Equilibria*, by the implicit function theorem: the balance Eᵀ(Q + Φ_qᵀλ) = 0 on the constraints Φ = 0
//! goes on to hold, so that with δq = D δz + δq_Φ, where δq_Φ are the dependent coordinates that keep Φ = 0
//! while z stands still,
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

use dynamics_runtime::constrain::{project_positions, solve_once, with_workspace};
use dynamics_runtime::error::SolveError;
use dynamics_runtime::model::{ModelState, Parameters, Quantity, Vector};
use dynamics_runtime::simulate::Simulate;
use nalgebra::{Cholesky, DMatrix, DVector, SymmetricEigen};

use super::equations::{by_parameter, differences, step};
use super::sensitivity_error::SensitivityError;
use super::variable::{Variable, VariableError, moved};
use crate::equilibria::{EquilibriumOptions, find};
use crate::linearize::{Linearization, linearize};

/// Singular values of the stiffness, free of units, below this part of the largest: half the digits are lost
/// there.
const FOLD: f64 = 1e-8;
/// Parts by which parameters are moved to see what the stiffness is made of.
const PARAMETER_MOVES: f64 = 1e-6;
/// Terms below this part of the largest of their kind are what rounding leaves.
const ROUNDING: f64 = 1e-13;
/// Terms beside mass and stiffness up to this part count as none.
const CONSERVATIVE: f64 = 1e-10;
/// Frequencies count as equal where ω² differs by less than this part of the largest near them.
const EQUAL: f64 = 1e-8;

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
    /// ∂ω/∂parameter; NaN where ω is 0 or none.
    pub frequency_by: f64,
    /// How many frequencies are equal to this, itself included: above 1 this is one of the ways in which they
    /// part.
    pub multiplicity: usize,
}

fn parameter_of<M: Parameters>(name: &str) -> Result<usize, SensitivityError> {
    match Variable::of::<M>(name)? {
        Variable::Parameter(i) => Ok(i),
        _ => Err(VariableError::Unknown { name: name.into(), nearest: None }.into()),
    }
}

/// δq̇ and δλ have no part in it: the state is at rest.
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
        // Nonholonomic constraints leave whole families of equilibria.
        return Err(SensitivityError::Fold { coordinate: linear.coordinates[0].name, ratio: 0.0 });
    }
    let change = change_of(model, state, parameter, &linear)?;
    if M::EXPLICIT_TIME {
        check_times(model, state, parameter, &change)?;
    }
    Ok(change)
}

/// That forces do not change with time, with this value of the parameter and with values beside it: there may
/// be an equilibrium at this one alone.
fn check_times<M: Simulate + Parameters + Clone>(
    model: &M,
    state: &M::State,
    parameter: usize,
    change: &EquilibriumChange,
) -> Result<(), SensitivityError> {
    let moving = state.u().as_slice().iter().any(|u| *u != 0.0);
    let value = model.parameter(parameter);
    let h = step(value.ok_or(SensitivityError::NotTold { name: M::PARAMETERS[parameter].name })?);
    for by in [0.0, h, -h] {
        let Some(beside) = moved(model, parameter, by) else { continue };
        let mut start = *state;
        start.q_mut().as_mut_slice().iter_mut().zip(change.by.iter()).for_each(|(q, d)| *q += by * d);
        // What else ends a search beside it, as a value that is none, does not touch the derivative.
        match find(&beside, &start, EquilibriumOptions { moving, ..EquilibriumOptions::REST }) {
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
    // EᵀM E v̇ = −EᵀM… is what is out of balance once the parameter has moved: v̇ of the independent
    // velocities.
    let made_of = accelerations_made_of::<M>(state, linear, &rates);
    let by = by_parameter(model, parameter, &made_of, accelerations)?;
    let force = &linear.mass * by.select_rows(&rates);
    let (of_independent, conditioning) = resisted(model, state, linear, &force)?;
    let places = DVector::from_column_slice(state.q().as_slice()).abs();
    let following = by_parameter(model, parameter, &places, |model| {
        let at = on_constraints(model, state, &held, linear)?;
        Ok(DVector::from_column_slice(at.q().as_slice()))
    })?;
    let by = following + &linear.shape * of_independent;
    Ok(EquilibriumChange { by, coordinates: M::COORDINATES, conditioning })
}

/// Of what accelerations in balance are made: what the stiffness makes of the coordinates.
fn accelerations_made_of<M: Simulate>(
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

/// What the elements of K are made of: themselves, or what is left of them where all parameters are a little
/// different, each in its own way. Terms that cancel each other here do not there.
fn made_of<M: Simulate + Parameters + Clone>(
    model: &M,
    state: &M::State,
    linear: &Linearization,
) -> DMatrix<f64> {
    let names: Vec<&str> = linear.coordinates.iter().map(|q| q.name).collect();
    let beside = |by: f64| {
        let mut other = model.clone();
        for i in 0..M::PARAMETERS.len() {
            // Multiples of the golden section are far from each other.
            let part = 0.5 + (0.618_033_988_749_895 * (i + 1) as f64).fract();
            other.set_parameter(i, model.parameter(i)? * (1.0 + by * part));
        }
        let (constants, mut state) = (other.constants().ok()?, *state);
        with_workspace::<M, _>(|memory| project_positions(&other, &constants, &mut state, memory)).ok()?;
        Some((linearize(&other, &state, &names).ok()?.stiffness - &linear.stiffness) / by)
    };
    // Where the others are no models, K stands for itself.
    let n = linear.stiffness.nrows();
    [PARAMETER_MOVES, -PARAMETER_MOVES].into_iter().filter_map(beside).fold(
        linear.stiffness.abs(),
        |most, change| {
            DMatrix::from_fn(n, n, |i, j| {
                if change[(i, j)].is_finite() { most[(i, j)].max(change[(i, j)].abs()) } else { most[(i, j)] }
            })
        },
    )
}

/// K⁻¹ `force`, and the conditioning of K; its rows and columns free of units by what they are made of (D.
/// Ruiz, Report RAL-TR-2001-034).
fn resisted<M: Simulate + Parameters + Clone>(
    model: &M,
    state: &M::State,
    linear: &Linearization,
    force: &DVector<f64>,
) -> Result<(DVector<f64>, f64), SensitivityError> {
    let (n, sizes) = (linear.stiffness.nrows(), made_of(model, state, linear));
    let (mut rows, mut columns) = (DVector::repeat(n, 1.0), DVector::repeat(n, 1.0));
    let part = |x: f64| if x > 0.0 { 1.0 / x.sqrt() } else { 1.0 };
    for _ in 0..8 {
        let now = DMatrix::from_fn(n, n, |i, j| rows[i] * sizes[(i, j)] * columns[j]);
        rows = DVector::from_fn(n, |i, _| rows[i] * part(now.row(i).amax()));
        columns = DVector::from_fn(n, |j, _| columns[j] * part(now.column(j).amax()));
    }
    let svd = DMatrix::from_fn(n, n, |i, j| rows[i] * linear.stiffness[(i, j)] * columns[j]).svd(true, true);
    // What all rows are made of is now 1.
    let (least, most) = (svd.singular_values.min(), svd.singular_values.max());
    if least.is_nan() || least <= FOLD * most.max(1.0) {
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

/// The state moved onto the constraints of a model with another parameter, its independent coordinates held.
fn on_constraints<M: Simulate>(
    model: &M,
    state: &M::State,
    held: &[usize],
    linear: &Linearization,
) -> Result<M::State, SensitivityError> {
    let failed = |error| SensitivityError::Solve { time: state.t(), error };
    let constants = model.constants().map_err(SolveError::from).map_err(failed)?;
    let mut moved = *state;
    // Projections move all coordinates; what they did to the independent ones is taken back along the
    // constraints.
    for _ in 0..8 {
        with_workspace::<M, _>(|memory| project_positions(model, &constants, &mut moved, memory))
            .map_err(failed)?;
        let mut off = DVector::zeros(linear.coordinates.len());
        for (k, q) in linear.coordinates.iter().enumerate() {
            let i = index::<M>(q.name).filter(|i| held.contains(i));
            off[k] = i.map_or(0.0, |i| moved.q()[i] - state.q()[i]);
        }
        if off.amax() == 0.0 {
            break;
        }
        let back = &linear.shape * off;
        moved.q_mut().as_mut_slice().iter_mut().zip(back.iter()).for_each(|(q, d)| *q -= d);
    }
    with_workspace::<M, _>(|memory| project_positions(model, &constants, &mut moved, memory))
        .map_err(failed)?;
    Ok(moved)
}

pub(super) fn frequencies_by<M: Simulate + Parameters + Clone>(
    model: &M,
    state: &M::State,
    parameter: &str,
) -> Result<Vec<FrequencyChange>, SensitivityError> {
    let index = parameter_of::<M>(parameter)?;
    let linear = linearize(model, state, &[])?;
    conservative(&linear)?;
    let change = equilibrium_by(model, state, parameter)?;
    let names: Vec<&str> = linear.coordinates.iter().map(|q| q.name).collect();
    let value =
        model.parameter(index).ok_or(SensitivityError::NotTold { name: M::PARAMETERS[index].name })?;
    let h = step(value);
    let (rows, failed) = (linear.mass.nrows(), |error| SensitivityError::Solve { time: state.t(), error });
    let at = |by: f64| {
        let moved =
            moved(model, index, by).ok_or(SensitivityError::NotTold { name: M::PARAMETERS[index].name })?;
        let constants = moved.constants().map_err(SolveError::from).map_err(failed)?;
        let mut state = *state;
        let shift = change.by.iter().map(|x| x * by);
        state.q_mut().as_mut_slice().iter_mut().zip(shift).for_each(|(q, d)| *q += d);
        with_workspace::<M, _>(|memory| project_positions(&moved, &constants, &mut state, memory))
            .map_err(failed)?;
        // In balance to the second order of the step: to all of it by the model's own search.
        let state = crate::equilibria::equilibrium(&moved, &state)?.state;
        let beside = linearize(&moved, &state, &names)?;
        let both = beside.mass.iter().chain(beside.stiffness.iter()).copied();
        Ok::<_, SensitivityError>(DVector::from_iterator(2 * rows * rows, both))
    };
    let both = linear.mass.iter().chain(linear.stiffness.iter()).map(|x| x.abs());
    let by = differences(h, &DVector::from_iterator(2 * rows * rows, both), at)?;
    let matrix =
        |first: usize| DMatrix::from_column_slice(rows, rows, &by.as_slice()[first..first + rows * rows]);
    changes(&linear, &matrix(0), &matrix(rows * rows))
}

/// That mass and stiffness are all there is.
fn conservative(linear: &Linearization) -> Result<(), SensitivityError> {
    if let Some(reason) = &linear.unsteady {
        return Err(reason.clone().into());
    }
    let n = linear.mass.nrows();
    // By the masses, so that each is measured by what it stands beside, whatever the units: ω² and 2 ζ ω.
    let scaled = |matrix: &DMatrix<f64>| {
        let size = |i: usize| linear.mass[(i, i)].max(f64::MIN_POSITIVE).sqrt();
        DMatrix::from_fn(n, n, |i, j| (matrix[(i, j)] / (size(i) * size(j))).abs())
    };
    let stiffness = scaled(&linear.stiffness);
    let squares: Vec<f64> = stiffness.row_iter().map(|row| row.amax()).collect();
    let part_of = |matrix: &DMatrix<f64>, least: f64, power: f64| {
        let part = |i: usize, j: usize| {
            let beside = (squares[i] * squares[j]).powf(0.5 * power).max(f64::MIN_POSITIVE);
            if matrix[(i, j)] > least { matrix[(i, j)] / beside } else { 0.0 }
        };
        (0..n * n).map(|k| part(k / n, k % n)).fold(0.0, f64::max)
    };
    let circulatory = linear
        .circulatory()
        .map_or(f64::INFINITY, |turning| part_of(&scaled(&turning), ROUNDING * stiffness.amax(), 1.0));
    let damping = scaled(&linear.damping);
    let part = circulatory.max(part_of(&damping, ROUNDING * damping.amax(), 0.5));
    if part <= CONSERVATIVE { Ok(()) } else { Err(SensitivityError::NotConservative { part }) }
}

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
    let half = lower.solve_lower_triangular(&stiffness).ok_or_else(not_finite)?;
    let whole = lower.solve_lower_triangular(&half.transpose()).ok_or_else(not_finite)?;
    let eigen = SymmetricEigen::new(0.5 * (&whole + whole.transpose()));
    let modes = lower.tr_solve_lower_triangular(&eigen.eigenvectors).ok_or_else(not_finite)?;
    let mut order: Vec<usize> = (0..modes.ncols()).collect();
    order.sort_by(|a, b| eigen.eigenvalues[*a].total_cmp(&eigen.eigenvalues[*b]));
    let largest = eigen.eigenvalues.amax();
    let mut found = Vec::new();
    let mut rest = order.as_slice();
    while let Some(first) = rest.first() {
        let square = eigen.eigenvalues[*first];
        let near = |i: &&usize| {
            let other = eigen.eigenvalues[**i];
            (other - square).abs() <= EQUAL * other.abs().max(square.abs()).max(1e-6 * largest)
        };
        let count = rest.iter().take_while(near).count();
        let (group, after) = rest.split_at(count);
        rest = after;
        let modes = modes.select_columns(group);
        let by = modes.tr_mul(&((stiffness_by - mass_by * square) * &modes));
        let mut ways: Vec<f64> =
            SymmetricEigen::new(0.5 * (&by + by.transpose())).eigenvalues.iter().copied().collect();
        ways.sort_by(f64::total_cmp);
        for (i, square_by) in group.iter().zip(ways) {
            let square = eigen.eigenvalues[*i];
            let frequency = square.sqrt();
            let frequency_by = if frequency > 0.0 { square_by / (2.0 * frequency) } else { f64::NAN };
            found.push(FrequencyChange { frequency, square, square_by, frequency_by, multiplicity: count });
        }
    }
    Ok(found)
}
