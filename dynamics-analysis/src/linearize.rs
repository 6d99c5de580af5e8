//! Small motions about an equilibrium or a steady motion, constraints included.
//!
//! Near a motion of M q̈ = Q + Φ_qᵀλ with holonomic rows Φ = 0 and nonholonomic rows A q̇ + b = 0 the
//! deviations δq, δλ fulfil, to first order,
//!
//! ```text
//! M δq̈ + r_u δq̇ + r_q δq − Φ_qᵀ δλ = Q_w δw
//! r = M q̈ − Q − Φ_qᵀλ, differentiated at the q̈ and λ of the motion
//! Φ_q δq = 0        Φ_q δq̇ + Φ̇_q δq = 0        (A δq̇ + (A q̇ + b)_q δq = 0 likewise)
//! Φ_q δq̈ − γ_u δq̇ + (Φ_q q̈ − γ)_q δq = 0
//! ```
//!
//! All derivatives are symbolic, none are differences. The holonomic rows leave independent coordinates z.
//! All rows leave independent velocities v, a subset of the rates of z: δq = D z, δq̇ = E v + F z,
//! δq̈ = E v̇ + G v + H z. The projection on Eᵀ contains no δλ:
//!
//! ```text
//! EᵀM E v̇ + Eᵀ(M G + r_u E) v + Eᵀ(M H + r_q D + r_u F) z = EᵀQ_w δw        ż = S v + T z
//! mass         damping             stiffness                 input
//! ```
//!
//! Without nonholonomic rows S = 1 and T = 0. Rows that repeat others are allowed: D and E come from a
//! rank-revealing elimination. λ is then not unique, but only its unique part enters. J. P. Meijaard et al.,
//! Proc. R. Soc. A 463 (2007) 1955, appendix B; R. von Schwerin, *Multibody System Simulation*, §2.

mod error;
mod modes;
mod reduce;
mod spectrum;
mod steady;

use alloc::vec::Vec;

use dynamics_runtime::constrain::active_rows;
use dynamics_runtime::constrain::{check_start, solve_once};
use dynamics_runtime::model::{Branches, Constraints, Kink, MAX_KINKS, ModelState, Quantity, Terms, Vector};
use nalgebra::{Complex, DMatrix, DVector};

pub use error::LinearizeError;
pub use modes::Mode;

pub(super) use modes::eigenvector;
pub(super) use reduce::{Tangent, indices, scales};
pub(super) use spectrum::{drop_rounding, matrix_eigenvalues, potential_stiffness, undamped_modes};
pub(super) use steady::{COMPARISON_TIMES, MAX_COEFFICIENT_CHANGE, state_after};

/// Linear equations of small motions, in C independent coordinates z and F ≤ C independent velocities v,
/// with W inputs.
///
/// ```text
/// mass v̇ + damping v + stiffness z = input δw        ż = S v + T z        δq = shape z
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct Linearization {
    /// The independent coordinates z, by name and unit.
    pub coordinates: Vec<Quantity>,
    /// The coordinates whose rates are the independent velocities v.
    pub velocities: Vec<Quantity>,
    /// F×F, symmetric and positive definite.
    pub mass: DMatrix<f64>,
    /// F×F: damping and gyroscopic terms.
    pub damping: DMatrix<f64>,
    /// F×C: stiffness and circulatory terms.
    pub stiffness: DMatrix<f64>,
    /// F×W: generalized forces of unit inputs.
    pub input: DMatrix<f64>,
    /// S, C×F; the unit matrix without nonholonomic constraints.
    pub rates_by_velocities: DMatrix<f64>,
    /// T, C×C; zero without nonholonomic constraints.
    pub rates_by_coordinates: DMatrix<f64>,
    /// N×C: the motion of all coordinates if an independent one moves by 1.
    pub shape: DMatrix<f64>,
    /// All coordinates, N.
    pub all: &'static [Quantity],
    /// v̇ of the motion that was linearised: 0 in equilibria and in steady motions.
    pub accelerations: DVector<f64>,
    /// The conditioning of the constraints: the ratio of the largest to the smallest pivot of their
    /// elimination; 1 without constraints.
    pub conditioning: f64,
    /// Why the state is neither an equilibrium nor on a steady motion; `None` if it is one of them.
    pub unsteady: Option<LinearizeError>,
}

impl Linearization {
    /// The symmetric part of the damping matrix, C = ½(D + Dᵀ), which changes the energy.
    #[must_use]
    pub fn dissipative(&self) -> DMatrix<f64> {
        0.5 * (&self.damping + self.damping.transpose())
    }

    /// The skew part of the damping matrix, the gyroscopic terms G = ½(D − Dᵀ), which do no work.
    #[must_use]
    pub fn gyroscopic(&self) -> DMatrix<f64> {
        0.5 * (&self.damping - self.damping.transpose())
    }

    /// The symmetric part of the stiffness matrix, ½(K + Kᵀ); `None` if there are more coordinates than
    /// velocities.
    #[must_use]
    pub fn conservative(&self) -> Option<DMatrix<f64>> {
        self.stiffness.is_square().then(|| 0.5 * (&self.stiffness + self.stiffness.transpose()))
    }

    /// The skew part of the stiffness matrix, the circulatory terms N = ½(K − Kᵀ), as of follower
    /// forces; `None` if there are more coordinates than velocities.
    #[must_use]
    pub fn circulatory(&self) -> Option<DMatrix<f64>> {
        self.stiffness.is_square().then(|| 0.5 * (&self.stiffness - self.stiffness.transpose()))
    }

    /// A of ẋ = A x + B δw for x = (z, v), (C + F)×(C + F).
    ///
    /// # Errors
    /// A mass matrix that is not positive definite.
    pub fn state_matrix(&self) -> Result<DMatrix<f64>, LinearizeError> {
        let (c, f) = (self.coordinates.len(), self.velocities.len());
        let solve = |right: &DMatrix<f64>| self.solve(right);
        let (by_z, by_v) = (solve(&self.stiffness)?, solve(&self.damping)?);
        let mut a = DMatrix::zeros(c + f, c + f);
        a.view_mut((0, 0), (c, c)).copy_from(&self.rates_by_coordinates);
        a.view_mut((0, c), (c, f)).copy_from(&self.rates_by_velocities);
        a.view_mut((c, 0), (f, c)).copy_from(&-by_z);
        a.view_mut((c, c), (f, f)).copy_from(&-by_v);
        Ok(a)
    }

    /// B of ẋ = A x + B δw, (C + F)×W.
    ///
    /// # Errors
    /// A mass matrix that is not positive definite.
    pub fn input_matrix(&self) -> Result<DMatrix<f64>, LinearizeError> {
        let (c, f) = (self.coordinates.len(), self.velocities.len());
        let mut b = DMatrix::zeros(c + f, self.input.ncols());
        b.view_mut((c, 0), (f, self.input.ncols())).copy_from(&self.solve(&self.input)?);
        Ok(b)
    }

    /// The eigenvalues σ of small motions e^{σt}, in 1/s, C + F of them, by growing real part, then imaginary
    /// part.
    ///
    /// Cyclic coordinates, such as the place of a vehicle on a plane, have eigenvalues of exactly zero.
    ///
    /// # Errors
    /// A motion that is neither an equilibrium nor steady; a mass matrix that is not positive definite; an
    /// iteration that does not converge.
    pub fn eigenvalues(&self) -> Result<Vec<Complex<f64>>, LinearizeError> {
        if let Some(reason) = &self.unsteady {
            return Err(reason.clone());
        }
        spectrum::eigenvalues(self)
    }

    /// Eigenvalues with their mode shapes, one mode for a pair of complex conjugates, by growing frequency.
    ///
    /// # Errors
    /// As [`Linearization::eigenvalues`].
    pub fn modes(&self) -> Result<Vec<Mode>, LinearizeError> {
        modes::modes(self)
    }

    /// mass⁻¹ `right`. Elements that are only rounding become 0, for example those of a force that leaves
    /// a coordinate at rest: balancing would otherwise scale the rounding up. An element counts as rounding
    /// up to 4 n ε of Σ |mass⁻¹| |`right`|, n the number of velocities.
    pub(super) fn solve(&self, right: &DMatrix<f64>) -> Result<DMatrix<f64>, LinearizeError> {
        let factors = self.mass.clone().cholesky().ok_or(LinearizeError::Inertia)?;
        let terms = factors.inverse().abs() * right.abs();
        let least = 4.0 * self.mass.nrows() as f64 * f64::EPSILON;
        let found =
            factors.solve(right).zip_map(&terms, |x, size| if x.abs() <= least * size { 0.0 } else { x });
        if found.iter().all(|x| x.is_finite()) { Ok(found) } else { Err(LinearizeError::NotFinite) }
    }
}

/// The derivatives of the equations of motion at a state; matrices are N×N unless stated otherwise.
pub(super) struct ModelDerivatives {
    pub(super) mass: DMatrix<f64>,
    /// ∂r/∂q and ∂r/∂q̇.
    pub(super) force_by: [DMatrix<f64>; 2],
    /// ∂r/∂w, N×W.
    pub(super) force_by_inputs: DMatrix<f64>,
    /// Φ_q above A, active rows only, R×N.
    pub(super) jacobian: DMatrix<f64>,
    /// ∂Φ̈/∂q and ∂Φ̈/∂q̇ of the active rows, R×N.
    pub(super) gamma_by: [DMatrix<f64>; 2],
    /// ∂Φ̇/∂q of the active rows, R×N.
    pub(super) velocity_by: DMatrix<f64>,
    /// How many active rows are holonomic; they are the first ones.
    pub(super) holonomic: usize,
    /// q̈.
    pub(super) accelerations: DVector<f64>,
    /// λ of all rows, also of those that are not active.
    pub(super) multipliers: DVector<f64>,
}

impl ModelDerivatives {
    /// At a state; the error says which input has no value, if that is the reason for values that are not
    /// finite.
    pub(super) fn of<M: Constraints>(model: &M, state: &M::State) -> Result<Self, LinearizeError> {
        let solved =
            solve_once(model, &model.constants().map_err(dynamics_runtime::error::SolveError::from)?, state)?;
        let (n, r, w) = (M::Vector::LEN, M::Rows::LEN, M::Inputs::LEN);
        let mut values = alloc::vec![0.0; (n + r) * (2 * n + w) + r * n];
        if !model.variations(state, &solved.accelerations, &solved.multipliers, &mut values) {
            return Err(LinearizeError::NoDerivatives);
        }
        let (mut mass, mut force) = (alloc::vec![0.0; n * n], alloc::vec![0.0; n]);
        let (mut jacobian, mut gamma) = (alloc::vec![0.0; r * n], alloc::vec![0.0; r]);
        let mut terms =
            Terms { mass: &mut mass, force: &mut force, jacobian: &mut jacobian, gamma: &mut gamma };
        model.terms(state, &mut terms);
        let accelerations = solved.accelerations.as_slice();
        if !values.iter().chain(&mass).chain(&jacobian).chain(accelerations).all(|x| x.is_finite()) {
            let unset = state.inputs().as_slice().iter().position(|input| input.is_nan());
            return Err(unset.map_or(LinearizeError::NotFinite, |i| LinearizeError::InputNotSet {
                input: M::INPUTS[i].name,
            }));
        }
        // `variations` writes ∂/∂q, ∂/∂q̇ and ∂/∂w of (r, Φ̈), then ∂Φ̇/∂q, each by
        // rows.
        let mut rest = values.as_slice();
        let mut take = |rows: usize, columns: usize| {
            let (matrix, after) = rest.split_at(rows * columns);
            rest = after;
            DMatrix::from_row_slice(rows, columns, matrix)
        };
        let (by_q, by_u, by_w, velocity_by) = (take(n + r, n), take(n + r, n), take(n + r, w), take(r, n));
        let active: Vec<usize> = active_rows::<M>(state.active_set(), false).collect();
        let of_rows = |m: &DMatrix<f64>| m.rows(n, r).select_rows(&active);
        Ok(Self {
            mass: DMatrix::from_row_slice(n, n, &mass),
            force_by: [by_q.rows(0, n).into_owned(), by_u.rows(0, n).into_owned()],
            force_by_inputs: by_w.rows(0, n).into_owned(),
            jacobian: DMatrix::from_row_slice(r, n, &jacobian).select_rows(&active),
            gamma_by: [of_rows(&by_q), of_rows(&by_u)],
            velocity_by: velocity_by.select_rows(&active),
            holonomic: active.iter().filter(|row| **row < M::Residual::LEN).count(),
            accelerations: DVector::from_column_slice(accelerations),
            multipliers: DVector::from_column_slice(solved.multipliers.as_slice()),
        })
    }

    /// M, C and K projected onto the tangent space of the constraints, and F of δq̇ = E v + F z.
    fn project(&self, tangent: &Tangent) -> [DMatrix<f64>; 4] {
        let (d, e) = (&tangent.positions, &tangent.velocities);
        let f = tangent.particular(&(&self.velocity_by * d));
        let [gamma_q, gamma_u] = &self.gamma_by;
        let (g, h) = (tangent.particular(&(gamma_u * e)), tangent.particular(&(gamma_q * d + gamma_u * &f)));
        let [r_q, r_u] = &self.force_by;
        let mass = e.tr_mul(&(&self.mass * e));
        let damping = e.tr_mul(&(&self.mass * g + r_u * e));
        let stiffness = e.tr_mul(&(&self.mass * h + r_q * d + r_u * &f));
        [0.5 * (&mass + mass.transpose()), damping, stiffness, f]
    }
}

/// Relative difference of derivatives up to which both sides of a branch change count as equal: some thousand
/// roundings. A larger value would accept corners whose slopes differ by that much.
const EQUAL_DERIVATIVES: f64 = 1e-12;

/// Refuses states at which a branch of the model changes, unless both sides have the same derivatives there.
/// For example, drag −|v| v at rest has.
fn refuse_corner<M: Constraints>(model: &M, state: &M::State) -> Result<(), LinearizeError> {
    let mut kinks = [Kink::NONE; MAX_KINKS];
    model.kinks(state, &mut kinks);
    let at_zero = |(_, kink): &(usize, &Kink)| kink.decides && kink.value == 0.0;
    let side = |below: bool| {
        let (mut held, mut branches) = (*state, Branches::FREE);
        kinks.iter().enumerate().filter(at_zero).for_each(|(index, _)| branches.hold(index, below));
        held.hold(branches);
        ModelDerivatives::of(model, &held)
    };
    if !kinks.iter().enumerate().any(|kink| at_zero(&kink)) {
        return Ok(());
    }
    let (below, above) = (side(true)?, side(false)?);
    let same =
        |a: &DMatrix<f64>, b: &DMatrix<f64>| (a - b).amax() <= EQUAL_DERIVATIVES * a.amax().max(b.amax());
    let smooth = (0..2).all(|k| same(&below.force_by[k], &above.force_by[k]))
        && same(&below.force_by_inputs, &above.force_by_inputs)
        && (&below.accelerations - &above.accelerations).amax()
            <= EQUAL_DERIVATIVES * below.accelerations.amax();
    if smooth { Ok(()) } else { Err(LinearizeError::Corner) }
}

/// See [`Analyze::linearize_in`](crate::Analyze::linearize_in); `wanted` may be empty.
pub(crate) fn linearize<M: Constraints>(
    model: &M,
    state: &M::State,
    wanted: &[&str],
) -> Result<Linearization, LinearizeError> {
    if M::FRICTION {
        return Err(LinearizeError::Friction);
    }
    check_start(model, state)?;
    refuse_corner(model, state)?;
    let preferred = indices::<M>(wanted)?;
    let derivatives = ModelDerivatives::of(model, state)?;
    if !preferred.is_empty() {
        return in_coordinates(model, state, &derivatives, [&preferred; 2]);
    }
    // A motion is steady in velocities that are constant. On a circle the velocities of the position are not,
    // though one of them may have no acceleration for an instant. So without one of the velocities that seem
    // constant another choice may show that the motion is steady.
    let constant = reduce::constant_velocities(state, &derivatives.accelerations);
    let found = in_coordinates(model, state, &derivatives, [&[], &constant])?;
    if found.unsteady.is_some() && found.coordinates.len() > found.velocities.len() {
        for without in &found.velocities {
            let others: Vec<usize> =
                constant.iter().copied().filter(|i| M::COORDINATES[*i] != *without).collect();
            let other = in_coordinates(model, state, &derivatives, [&[], &others])?;
            if other.unsteady.is_none() {
                return Ok(other);
            }
        }
    }
    Ok(found)
}

/// The linear equations with these coordinates and velocities among the independent ones as far as possible.
fn in_coordinates<M: Constraints>(
    model: &M,
    state: &M::State,
    derivatives: &ModelDerivatives,
    preferred: [&[usize]; 2],
) -> Result<Linearization, LinearizeError> {
    let tangent = Tangent::new(&derivatives.jacobian, derivatives.holonomic, &derivatives.mass, preferred);
    if let Some(dependent) = preferred[0].iter().find(|i| !tangent.coordinates.contains(i)) {
        return Err(LinearizeError::Dependent { name: M::COORDINATES[*dependent].name });
    }
    reduce::refuse_singular(model, state, &tangent)?;
    let mut found = assemble::<M>(derivatives, &tangent);
    found.unsteady = steady::why_unsteady(model, state, &found, &tangent);
    Ok(found)
}

/// The linear equations in the independent coordinates and velocities of a tangent space.
pub(super) fn assemble<M: Constraints>(derivatives: &ModelDerivatives, tangent: &Tangent) -> Linearization {
    let [mass, damping, stiffness, particular] = derivatives.project(tangent);
    let named = |indices: &[usize]| indices.iter().map(|i| M::COORDINATES[*i]).collect::<Vec<_>>();
    Linearization {
        coordinates: named(&tangent.coordinates),
        velocities: named(&tangent.rates),
        mass,
        damping,
        stiffness,
        input: -tangent.velocities.tr_mul(&derivatives.force_by_inputs),
        rates_by_velocities: tangent.velocities.select_rows(&tangent.coordinates),
        rates_by_coordinates: particular.select_rows(&tangent.coordinates),
        shape: tangent.positions.clone(),
        all: M::COORDINATES,
        accelerations: derivatives.accelerations.select_rows(&tangent.rates),
        conditioning: tangent.conditioning,
        unsteady: None,
    }
}
