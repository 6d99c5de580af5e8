//! Stability of equilibria and steady motions.
//!
//! If energy is conserved, dead loads included (`energy_change.rs`), an equilibrium with positive definite
//! stiffness K is stable, whatever the gyroscopic terms are (Lagrange, Dirichlet). K belongs to the effective
//! potential, with rotating frames and reactions, in the directions that the constraints leave. Cyclic
//! coordinates are eliminated with their momenta held (Routh). In other cases the eigenvalues of small
//! motions decide. If dampers only take energy out, an equilibrium with positive definite K is stable, too.
//! It is asymptotically stable unless a mode is undamped (Kelvin, Tait & Chetaev: damping is pervasive if all
//! eigenvalues are clear of the axis; D. R. Merkin, *Introduction to the Theory of Stability*, §6.4). If
//! eigenvalues are not clear of the imaginary axis in other cases, linear theory does not decide:
//! I. G. Malkin, *Theory of Stability of Motion*; A. P. Seyranian & A. A. Mailybaev, *Multiparameter
//! Stability Theory with Mechanical Applications*, chapters 1 and 7.
//!
//! A value is called zero, or not zero, only if rounding could not have caused this. Stiffnesses are compared
//! with those of nearby positions, whose terms do not cancel, and with their change over the error of the
//! position: in a fold no stiffness is known. Eigenvalues are compared with the changes |yᵀ||A||x|
//! ε/|yᵀx| that rounding of each element could cause (D. J. Higham & N. J. Higham, SIAM J. Matrix Anal.
//! Appl. 20 (1998) 493).

mod energy_change;
mod show;
mod verdict;

use alloc::vec::Vec;
use core::ops::AddAssign;

use dynamics_runtime::error::SolveError;
use dynamics_runtime::model::{Constraints, ModelState, Powers, Quantity, Vector};
use nalgebra::{Complex, DMatrix, DVector};

use energy_change::{EnergyChange, energy_change};
pub use verdict::{Stability, StabilityVerdict, Undecided};

use super::newton::position_uncertainty;
use super::rounding::clear_rounding;
use super::statics::{Statics, model_terms, scales};
use super::{EquilibriumError, check_persists};
use crate::displacement::{displaced, projected};
use crate::linearize::{Linearization, LinearizeError, eigenvector, linearize, matrix_eigenvalues};

/// Displacements, in the scales of the coordinates, with whose inertia that of a state is compared to find a
/// pole.
const NO_INERTIA_PROBES: [f64; 2] = [0.1, -0.17];
/// Displacements of a coordinate at which its ignorability is tested: in rad for angles, no parts of a turn.
const IGNORABLE_PROBES: [f64; 3] = [0.37, -1.71, 2.93];
/// Terms that change by at most this share of their largest element do not depend on a coordinate.
const IGNORABLE_TOLERANCE: f64 = 1e-13;
/// Error of an element of a matrix from rounding, relative to the size of its terms: 16 rounding units.
const ELEMENT_ROUNDING: f64 = 16.0 * f64::EPSILON;
/// Rounding of a product of matrices, in units ε: elements are sums of rounded products.
const PRODUCT_ROUNDINGS: f64 = 8.0;
/// Factor on the bounds of two elements of K within which they are equal.
const ASYMMETRY_FACTOR: f64 = 4.0;
/// Rounding of a double zero eigenvalue per row of the matrix, in units ε of its norm.
const ZERO_EIGENVALUE_ROUNDINGS: f64 = 16.0;
/// Rounding of the symmetric QR iteration per row of the matrix, in units ε of its elements.
const ITERATION_ROUNDINGS: f64 = 4.0;
/// Relative displacements at which the size of the terms of K is measured, beside the full one.
const STIFFNESS_PROBES: [f64; 2] = [0.3, 0.01];

/// M v̇ + D v + K z = 0 with ż = v, and the coordinates z.
struct SecondOrderSystem {
    mass: DMatrix<f64>,
    damping: DMatrix<f64>,
    stiffness: DMatrix<f64>,
    /// The uncertainty of each element of the stiffness.
    uncertainty: DMatrix<f64>,
    names: Vec<Quantity>,
}

/// See [`Analyze::stability`](crate::Analyze::stability).
pub(crate) fn judge<M: Constraints + Powers>(
    model: &M,
    state: &M::State,
) -> Result<Stability, EquilibriumError> {
    let mut linear = linearize(model, state, &[])?;
    if let Some(reason) = linear.unsteady {
        return Err(reason.into());
    }
    clear_rounded_elements(model, state, &mut linear);
    check_persists(model, state)?;
    check_no_pole(model, state)?;
    let ignorable = ignorable(model, state, &linear);
    let mut found = match routh(model, state, &linear, &ignorable)? {
        Some(reduced) => judge_second_order(
            &reduced,
            energy_change(model, state, &indices::<M>(&linear), &linear.damping),
        )?,
        None => judge_first_order(&linear, &ignorable)?,
    };
    found.ignorable = ignorable.iter().map(|j| linear.coordinates[*j]).collect();
    if found.eigenvalues.is_empty() {
        // All coordinates are cyclic, or the constraints leave no freedom.
        found.verdict = match found.ignorable.first() {
            Some(free) => StabilityVerdict::Marginal(Undecided::NothingResists { coordinate: free.name }),
            None => StabilityVerdict::Stable,
        };
    }
    Ok(found)
}

/// Sets elements of stiffness and damping that are only rounding to 0, so that the result does not depend on
/// how the model is written.
fn clear_rounded_elements<M: Constraints>(model: &M, state: &M::State, linear: &mut Linearization) {
    let of_rows = linear.mass.diagonal();
    let of_columns = linear.coordinates.iter().map(|coordinate| {
        let rate = linear.velocities.iter().position(|velocity| velocity == coordinate);
        rate.map_or(0.0, |i| of_rows[i])
    });
    let of_columns = DVector::from_iterator(linear.coordinates.len(), of_columns);
    let names: Vec<&str> = linear.coordinates.iter().map(|coordinate| coordinate.name).collect();
    let linearized_at = |state: &M::State| {
        let there = linearize(model, state, &names).ok()?;
        (there.velocities == linear.velocities && there.coordinates == linear.coordinates).then_some(there)
    };
    let (mut stiffness, mut damping) = (linear.stiffness.clone(), linear.damping.clone());
    clear_rounding::<M>(&mut stiffness, [&of_rows, &of_columns], state, |at| {
        Some(linearized_at(at)?.stiffness)
    });
    clear_rounding::<M>(&mut damping, [&of_rows, &of_rows], state, |at| Some(linearized_at(at)?.damping));
    (linear.stiffness, linear.damping) = (stiffness, damping);
}

/// Refuses to judge rotation at a pole of the coordinates, or within rounding of it, such as an upright
/// spherical pendulum. The momentum of a coordinate without inertia has no effect, and the same position at
/// rest may be unstable.
fn check_no_pole<M: Constraints>(model: &M, state: &M::State) -> Result<(), EquilibriumError> {
    if state.u().as_slice().iter().all(|u| *u == 0.0) {
        return Ok(());
    }
    let here = Statics::of(model, state, &[])?;
    let constants = model.constants().map_err(SolveError::from)?;
    let scales = scales(M::COORDINATES, state.q().as_slice());
    for part in NO_INERTIA_PROBES {
        let spread = |i: usize| part * (1.0 + 0.618 * i as f64).sin();
        let step = DVector::from_fn(scales.len(), |i, _| scales[i] * spread(i));
        // Where no position fulfils the constraints, there is no sample.
        let there = projected(model, &constants, displaced(state, &step));
        let Some(there) = there.ok().and_then(|at| Statics::of(model, &at, &[]).ok()) else { continue };
        if let Some(along) = here.pole(&there) {
            return Err(EquilibriumError::Pole { coordinate: M::COORDINATES[along.iamax()].name });
        }
    }
    Ok(())
}

/// The indices of the independent coordinates among all.
fn indices<M: Constraints>(linear: &Linearization) -> Vec<usize> {
    let index = |q: &Quantity| M::COORDINATES.iter().position(|known| known == q);
    linear.coordinates.iter().filter_map(index).collect()
}

/// Independent coordinates that are cyclic, here and elsewhere: if one of them alone moves by a finite
/// amount, mass, forces and constraints do not change.
fn ignorable<M: Constraints>(model: &M, state: &M::State, linear: &Linearization) -> Vec<usize> {
    let order = indices::<M>(linear);
    // A nearby state in motion: no symmetry hides a dependence there.
    let mut nearby = *state;
    let spread = |i: usize| 0.1 + 0.7 * (1.0 + 0.618 * i as f64).sin();
    nearby
        .q_mut()
        .as_mut_slice()
        .iter_mut()
        .enumerate()
        .for_each(|(i, q)| *q += 0.01 * spread(i) * (1.0 + q.abs()));
    nearby.u_mut().as_mut_slice().iter_mut().enumerate().for_each(|(i, u)| *u += spread(2 * i + 1));
    // Terms that cancel here, such as forces in balance, do not cancel there and give the size of rounding.
    let most = |values: &[f64]| values.iter().fold(0.0, |most: f64, x| most.max(x.abs()));
    let (near, far) = (model_terms(model, state), model_terms(model, &nearby));
    let sizes: Vec<f64> = near.iter().zip(&far).map(|(a, b)| most(a).max(most(b))).collect();
    let depends = |at: &M::State, i: usize| {
        let here = model_terms(model, at);
        IGNORABLE_PROBES.into_iter().any(|by| {
            let mut moved = *at;
            moved.q_mut().as_mut_slice()[i] += by;
            here.iter().zip(&model_terms(model, &moved)).zip(&sizes).any(|((a, b), size)| {
                a.iter().zip(b).any(|(x, y)| (x - y).abs() > IGNORABLE_TOLERANCE * size || (x - y).is_nan())
            })
        })
    };
    let free = |j: &usize| {
        let i = order[*j];
        let alone = linear.shape.column(*j).iter().enumerate().all(|(k, x)| (k == i) == (*x != 0.0));
        let resists = linear.stiffness.column(*j).iter().any(|x| *x != 0.0);
        alone && !resists && !depends(state, i) && !depends(&nearby, i)
    };
    (0..linear.coordinates.len()).filter(free).collect()
}

/// The equations without the cyclic coordinates, with their momenta held. `None` if the momenta are not
/// conserved, or if velocities are not the rates of coordinates.
fn routh<M: Constraints>(
    model: &M,
    state: &M::State,
    linear: &Linearization,
    ignorable: &[usize],
) -> Result<Option<SecondOrderSystem>, EquilibriumError> {
    if linear.coordinates != linear.velocities {
        return Ok(None);
    }
    let kept: Vec<usize> = (0..linear.coordinates.len()).filter(|j| !ignorable.contains(j)).collect();
    let part =
        |m: &DMatrix<f64>, rows: &[usize], columns: &[usize]| m.select_rows(rows).select_columns(columns);
    let (m, d, k) = (&linear.mass, &linear.damping, &linear.stiffness);
    let is_lost = part(k, ignorable, &kept).amax() > 0.0 || part(d, ignorable, ignorable).amax() > 0.0;
    if !ignorable.is_empty() && is_lost {
        return Ok(None);
    }
    let mut uncertainty = stiffness_uncertainty(model, state, linear)?;
    uncertainty = part(&uncertainty, &kept, &kept);
    // Conserved momenta give the cyclic velocities: v_c = −M_cc⁻¹ (M_ck v_k + D_ck z_k), with c for
    // cyclic and k for kept coordinates.
    let inertia = part(m, ignorable, ignorable).cholesky().ok_or(LinearizeError::Inertia)?;
    let by_v = inertia.solve(&part(m, ignorable, &kept));
    let by_z = inertia.solve(&part(d, ignorable, &kept));
    let (m_out, d_out) = (part(m, &kept, ignorable), part(d, &kept, ignorable));
    Ok(Some(SecondOrderSystem {
        mass: part(m, &kept, &kept) - &m_out * &by_v,
        damping: part(d, &kept, &kept) - &m_out * &by_z - &d_out * &by_v,
        stiffness: part(k, &kept, &kept) - &d_out * &by_z,
        uncertainty: uncertainty + (d_out.abs() * by_z.abs()) * (PRODUCT_ROUNDINGS * f64::EPSILON),
        names: kept.iter().map(|j| linear.coordinates[*j]).collect(),
    }))
}

/// The uncertainty of the elements of K. It has two parts: rounding of terms that cancel here, measured at
/// nearby positions where they do not, and the uncertainty of the position.
fn stiffness_uncertainty<M: Constraints>(
    model: &M,
    state: &M::State,
    linear: &Linearization,
) -> Result<DMatrix<f64>, EquilibriumError> {
    let order = indices::<M>(linear);
    let here = Statics::of(model, state, &order)?;
    if here.tangent.coordinates != order {
        return Ok(linear.stiffness.abs() * ELEMENT_ROUNDING);
    }
    let distance = position_uncertainty(model, state, &here)?;
    let constants = model.constants().map_err(SolveError::from)?;
    let scales = scales(M::COORDINATES, state.q().as_slice());
    // The largest elements nearby are the sizes of the terms. The slope of the elements times the uncertainty
    // of the position is their drift.
    let (mut sizes, mut drift) = (here.stiffness.abs(), here.stiffness.map(|_| 0.0));
    for (j, coordinate) in order.iter().enumerate() {
        let mut slope = here.stiffness.map(|_| 0.0);
        // Half of a length: a radius does not reach zero, where forces have a pole.
        let reach = if M::COORDINATES[*coordinate].is_angle() { 1.0 } else { 0.5 };
        let [middle, near] = STIFFNESS_PROBES;
        for part in [-reach, -middle, -near, near, middle, reach] {
            let step = part * scales[*coordinate];
            let nearby = displaced(state, &(here.tangent.positions.column(j) * step));
            // Where no position fulfils the constraints, or no force is finite, there is no sample.
            let there = projected(model, &constants, nearby).ok();
            let Some(there) = there.and_then(|at| Statics::of(model, &at, &order).ok()) else { continue };
            if there.tangent.coordinates != order {
                continue;
            }
            sizes.zip_apply(&there.stiffness, |size, x| *size = size.max(x.abs()));
            if part.abs() == near {
                let change = (&there.stiffness - &here.stiffness).abs() / step.abs();
                slope.zip_apply(&change, |slope, x| *slope = f64::max(*slope, x));
            }
        }
        drift += slope * distance[j];
    }
    Ok(sizes * ELEMENT_ROUNDING + drift)
}

/// The verdict on M v̇ + D v + K z = 0, by energy or by eigenvalues.
fn judge_second_order(
    linear: &SecondOrderSystem,
    change: EnergyChange,
) -> Result<Stability, EquilibriumError> {
    let conservative = change == EnergyChange::Conserved;
    let n = linear.mass.nrows();
    let squares = squared_frequencies(linear)?;
    let is_undamped = linear.damping.iter().all(|x| *x == 0.0);
    // The state matrix A of (z, v), and the errors of its elements.
    let mut a = DMatrix::zeros(2 * n, 2 * n);
    let factors = linear.mass.clone().cholesky().ok_or(LinearizeError::Inertia)?;
    a.view_mut((0, n), (n, n)).fill_with_identity();
    a.view_mut((n, 0), (n, n)).copy_from(&-factors.solve(&linear.stiffness));
    a.view_mut((n, n), (n, n)).copy_from(&-factors.solve(&linear.damping));
    let mut errors = rounding_of_elements(&a);
    let inverse = factors.solve(&DMatrix::identity(n, n)).abs();
    errors.view_mut((n, 0), (n, n)).add_assign(inverse * &linear.uncertainty);
    let spectrum =
        if conservative && is_undamped { undamped_spectrum(&squares) } else { spectrum(&a, &errors)? };
    let along = |shape: &DVector<f64>| {
        let weigh = |i: usize| shape[i].abs() * linear.mass[(i, i)].sqrt();
        let most = (0..n).fold(0, |best, i| if weigh(i) > weigh(best) { i } else { best });
        linear.names[most].name
    };
    let least = squares.first().map(|one| one.value);
    // A direction without stiffness. With follower forces the symmetric part of K may vanish along a
    // direction although K does not. Then a zero eigenvalue of A is looked for.
    let skew = (&linear.stiffness - linear.stiffness.transpose()).abs();
    let is_symmetric =
        skew.iter().zip(linear.uncertainty.iter()).all(|(x, error)| *x <= ASYMMETRY_FACTOR * error);
    let without_stiffness = match is_symmetric {
        true => squares.iter().find(|one| one.value.abs() <= one.uncertainty).map(|one| along(&one.shape)),
        false => spectrum
            .iter()
            .find(|one| one.value.norm() <= one.uncertainty)
            .map(|one| along(&one.shape.rows(0, n).into())),
    };
    // A direction without stiffness has a double zero eigenvalue. The iteration leaves it at the rounding of
    // the whole matrix, which can be more than the errors of the elements say.
    let zero = if without_stiffness.is_some() {
        ZERO_EIGENVALUE_ROUNDINGS * n as f64 * f64::EPSILON * a.norm()
    } else {
        0.0
    };
    let growing = spectrum.iter().filter(|one| one.value.re > one.uncertainty.max(zero));
    let fastest_growth = growing.max_by(|x, y| x.value.re.total_cmp(&y.value.re));
    // The verdict: energy, then growth, then zero stiffness, then damping.
    let definite = squares.iter().all(|one| one.value > one.uncertainty);
    let verdict = if conservative && definite {
        StabilityVerdict::Stable
    } else if let Some(mode) = fastest_growth {
        let coordinate = along(&mode.shape.rows(0, n).into_owned());
        unstable(mode, coordinate)
    } else if let Some(coordinate) = without_stiffness {
        StabilityVerdict::Marginal(Undecided::NothingResists { coordinate })
    } else if let Some(one) =
        undamped_mode(&spectrum).filter(|_| definite && change == EnergyChange::Dissipated)
    {
        let coordinate = along(&one.shape.rows(0, n).into_owned());
        StabilityVerdict::PartlyDamped { frequency: one.value.im.abs(), coordinate }
    } else {
        judge_without_growth(&spectrum, conservative)
    };
    Ok(Stability::new(verdict, least, &spectrum))
}

/// The mode of least damping, if it does not certainly die out to first order.
fn undamped_mode(spectrum: &[Eigenvalue]) -> Option<&Eigenvalue> {
    let on_axis = spectrum.iter().filter(|one| one.value.re >= -one.uncertainty);
    on_axis.max_by(|x, y| (x.value.re / x.uncertainty).total_cmp(&(y.value.re / y.uncertainty)))
}

/// The verdict on ẋ = A x without cyclic coordinates.
fn judge_first_order(linear: &Linearization, ignorable: &[usize]) -> Result<Stability, EquilibriumError> {
    let c = linear.coordinates.len();
    let kept: Vec<usize> = (0..c + linear.velocities.len()).filter(|j| !ignorable.contains(j)).collect();
    let a = linear.state_matrix()?.select_rows(&kept).select_columns(&kept);
    // Elements that should cancel have errors of the size of the terms of others.
    let errors = rounding_of_elements(&a).add_scalar(ELEMENT_ROUNDING * a.amax());
    let spectrum = spectrum(&a, &errors)?;
    let name = |k: usize| match kept[k].checked_sub(c) {
        None => linear.coordinates[kept[k]].name,
        Some(v) => linear.velocities[v].name,
    };
    let worst = spectrum.iter().filter(|one| one.value.re > one.uncertainty);
    let worst = worst.max_by(|x, y| x.value.re.total_cmp(&y.value.re));
    let zero = spectrum.iter().find(|one| one.value.norm() <= one.uncertainty);
    let verdict = match (worst, zero) {
        (Some(one), _) => unstable(one, name(one.shape.iamax())),
        (None, Some(zero)) => {
            StabilityVerdict::Marginal(Undecided::NothingResists { coordinate: name(zero.shape.iamax()) })
        }
        (None, None) => judge_without_growth(&spectrum, false),
    };
    Ok(Stability::new(verdict, None, &spectrum))
}

/// The verdict of an eigenvalue that grows.
fn unstable(one: &Eigenvalue, coordinate: &'static str) -> StabilityVerdict {
    let Complex { re: growth, im } = one.value;
    match im.abs() <= one.uncertainty {
        true => StabilityVerdict::Divergence { growth, coordinate },
        false => StabilityVerdict::Flutter { growth, frequency: im.abs(), coordinate },
    }
}

/// The verdict if no eigenvalue certainly grows, and every direction has stiffness.
fn judge_without_growth(spectrum: &[Eigenvalue], conservative: bool) -> StabilityVerdict {
    if spectrum.iter().all(|one| one.value.re < -one.uncertainty) {
        return StabilityVerdict::AsymptoticallyStable;
    }
    let on_axis = spectrum.iter().filter(|one| one.value.re.abs() <= one.uncertainty);
    let worst = on_axis.max_by(|x, y| x.conditioning.total_cmp(&y.conditioning));
    let (frequency, conditioning) = worst.map_or((0.0, 1.0), |one| (one.value.im.abs(), one.conditioning));
    if conditioning > DEFECTIVE_CONDITIONING {
        return StabilityVerdict::Marginal(Undecided::FrequenciesMeet { frequency, conditioning });
    }
    match conservative {
        true => StabilityVerdict::GyroscopicallyStabilised,
        false => StabilityVerdict::Marginal(Undecided::Swings { frequency }),
    }
}

/// Eigenvalues that move by this many times more than the elements of the matrix belong to a defective pair:
/// two frequencies meet. Rounding of elements then moves them by more than 10⁻¹⁰ of their size.
const DEFECTIVE_CONDITIONING: f64 = 1e6;

/// An eigenvalue, or a square of a frequency, with its uncertainty.
struct EigenvalueEstimate<T> {
    value: T,
    uncertainty: f64,
    conditioning: f64,
    shape: DVector<f64>,
}

type Eigenvalue = EigenvalueEstimate<Complex<f64>>;

/// ω² of the symmetric part of K against M, ascending.
fn squared_frequencies(linear: &SecondOrderSystem) -> Result<Vec<EigenvalueEstimate<f64>>, EquilibriumError> {
    let n = linear.mass.nrows();
    if n == 0 {
        return Ok(Vec::new());
    }
    let lower = linear.mass.clone().cholesky().ok_or(LinearizeError::Inertia)?.unpack();
    let stiffness = 0.5 * (&linear.stiffness + linear.stiffness.transpose());
    let half = lower.solve_lower_triangular(&stiffness).ok_or(LinearizeError::Inertia)?;
    let reduced = lower.solve_lower_triangular(&half.transpose()).ok_or(LinearizeError::Inertia)?;
    let reduced = 0.5 * (&reduced + reduced.transpose());
    let sizes = reduced.abs();
    let eigen = reduced
        .try_symmetric_eigen(f64::EPSILON, 300 * n)
        .ok_or(LinearizeError::NoConvergence { size: n })?;
    let mut found = Vec::with_capacity(n);
    for (value, vector) in eigen.eigenvalues.iter().zip(eigen.eigenvectors.column_iter()) {
        let v = vector.abs();
        let shape = lower.tr_solve_lower_triangular(&vector.into_owned()).ok_or(LinearizeError::Inertia)?;
        // Rounding of the iteration, and the uncertainty of K, on shapes of unit inertia.
        let of_k = shape.abs().dot(&(&linear.uncertainty * shape.abs()));
        let uncertainty = n as f64 * ITERATION_ROUNDINGS * f64::EPSILON * v.dot(&(&sizes * &v)) + of_k;
        found.push(EigenvalueEstimate { value: *value, uncertainty, conditioning: 1.0, shape });
    }
    found.sort_by(|a, b| a.value.total_cmp(&b.value));
    Ok(found)
}

/// Eigenvalues ±√(−ω²), exact pairs.
fn undamped_spectrum(squares: &[EigenvalueEstimate<f64>]) -> Vec<Eigenvalue> {
    let pair = |one: &EigenvalueEstimate<f64>| {
        let root = one.value.abs().sqrt();
        // The error of √(ω² ± δ) is δ/2ω, and √δ at most.
        let uncertainty = (one.uncertainty / (2.0 * root).max(f64::MIN_POSITIVE)).min(one.uncertainty.sqrt());
        let value = if one.value < 0.0 { Complex::new(root, 0.0) } else { Complex::new(0.0, root) };
        [value, -value].map(|value| EigenvalueEstimate {
            value,
            uncertainty,
            conditioning: 1.0,
            shape: one.shape.clone(),
        })
    };
    squares.iter().flat_map(pair).collect()
}

/// The errors of the elements of a matrix that is known to rounding, with those of the iteration for its
/// eigenvalues.
fn rounding_of_elements(a: &DMatrix<f64>) -> DMatrix<f64> {
    a.abs() * (PRODUCT_ROUNDINGS * a.nrows() as f64 * f64::EPSILON)
}

/// The eigenvalues of a matrix with these errors of its elements.
fn spectrum(a: &DMatrix<f64>, errors: &DMatrix<f64>) -> Result<Vec<Eigenvalue>, EquilibriumError> {
    let n = a.nrows();
    let mut found = Vec::with_capacity(n);
    for (k, value) in matrix_eigenvalues(a.clone())?.into_iter().enumerate() {
        let right = eigenvector(a, value, k)?;
        let left = eigenvector(&a.transpose(), value.conj(), k)?;
        let product = left.dotc(&right).norm().max(f64::MIN_POSITIVE);
        let magnitudes = |x: &DVector<Complex<f64>>| x.map(|x| x.norm());
        let bound = magnitudes(&left).dot(&(errors * magnitudes(&right))) / product;
        // Where eigenvalues meet, this bound is infinite. Their error is at most a root of that of the matrix
        // (L. Elsner, Linear Algebra Appl. 71 (1985) 77).
        let part = 1.0 / n as f64;
        let uncertainty = bound.min(a.norm().powf(1.0 - part) * errors.norm().powf(part));
        let largest =
            right.iter().fold(Complex::new(0.0, 0.0), |m, x| if x.norm() > m.norm() { *x } else { m });
        let shape = right.map(|x| (x / largest).norm());
        // For relative changes of the elements, so that it does not depend on units.
        let size = magnitudes(&left).dot(&(a.abs() * magnitudes(&right)));
        let conditioning = size / (product * value.norm().max(f64::MIN_POSITIVE));
        found.push(EigenvalueEstimate { value, uncertainty, conditioning, shape });
    }
    Ok(found)
}
