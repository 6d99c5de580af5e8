//! Balance at a position: the residual forces and their derivatives.

use alloc::vec::Vec;

use dynamics_runtime::constrain::active_rows;
use dynamics_runtime::model::{Branches, Constraints, Kink, MAX_KINKS, ModelState, Terms, Vector};
use nalgebra::{DMatrix, DVector};

use super::EquilibriumError;
use super::rounding::clear_rounding;
pub(crate) use crate::linearize::scales;
use crate::linearize::{LinearizeError, Tangent};

/// Balance in the independent coordinates z and velocities v of a position: F = Eᵀr, where
/// r = −Q − Φ_qᵀλ at q̈ = 0, and K = ∂F/∂z.
///
/// λ is chosen so that r vanishes on all dependent coordinates. What the change of E would contribute,
/// (∂E)ᵀr, is then 0, as E is constant on the independent ones: K is the exact derivative of F along the
/// constraints at every position, not only in equilibrium.
pub(crate) struct Statics<R> {
    pub(crate) tangent: Tangent,
    /// F, an element for each independent velocity.
    pub(crate) force: DVector<f64>,
    /// K: a row for each independent velocity, a column for each independent coordinate.
    pub(crate) stiffness: DMatrix<f64>,
    /// Eᵀ ∂r/∂q by all coordinates, also along those directions that violate the constraints.
    pub(crate) by_all: DMatrix<f64>,
    /// λ, zero in inactive rows.
    pub(super) multipliers: R,
    /// EᵀM E of the independent velocities.
    pub(crate) mass: DMatrix<f64>,
    /// The diagonal of EᵀM E.
    pub(super) inertia: DVector<f64>,
    /// The diagonal of M, of all coordinates. It makes forces of different units comparable.
    pub(super) masses: DVector<f64>,
    /// The error of Eᵀ(Q + Φ_qᵀλ) from rounding, by the magnitudes of its terms.
    pub(super) rounding: DVector<f64>,
}

/// Number of displaced states by which the noise of forces is measured: the eight combinations of signs of
/// three patterns.
const NOISE_SAMPLES: u32 = 8;
/// Largest displacement of a coordinate for the noise of forces, in units of its last bit.
const MAX_NOISE_BITS: u32 = 4;
/// Inertia along a direction below this share of its value where the search began has vanished: the direction
/// is a pole of the coordinates. Near a pole inertia is r², so that this is within 10⁻⁶ of it in the
/// scale of r. A larger value refuses equilibria close to a pole.
const VANISHED_INERTIA_SHARE: f64 = 1e-12;

/// M, Q, Φ_q and γ of a model at a state, matrices by rows.
pub(super) fn model_terms<M: Constraints>(model: &M, state: &M::State) -> [Vec<f64>; 4] {
    let (n, r) = (M::Vector::LEN, M::Rows::LEN);
    let (mut mass, mut force) = (alloc::vec![0.0; n * n], alloc::vec![0.0; n]);
    let (mut jacobian, mut gamma) = (alloc::vec![0.0; r * n], alloc::vec![0.0; r]);
    let mut terms = Terms { mass: &mut mass, force: &mut force, jacobian: &mut jacobian, gamma: &mut gamma };
    model.terms(state, &mut terms);
    [mass, force, jacobian, gamma]
}

/// M, Q and the active rows of Φ_q.
struct StaticTerms {
    mass: DMatrix<f64>,
    force: DVector<f64>,
    jacobian: DMatrix<f64>,
    rows: Vec<usize>,
}

impl StaticTerms {
    fn of<M: Constraints>(model: &M, state: &M::State) -> Result<Self, EquilibriumError> {
        let (n, r) = (M::Vector::LEN, M::Rows::LEN);
        let [mass, force, jacobian, _] = model_terms(model, state);
        check_finite::<M>(state, &force)?;
        if !mass.iter().chain(&jacobian).all(|x| x.is_finite()) {
            return Err(LinearizeError::NotFinite.into());
        }
        let rows: Vec<usize> = active_rows::<M>(state.active_set(), false).collect();
        Ok(Self {
            mass: DMatrix::from_row_slice(n, n, &mass),
            force: DVector::from_vec(force),
            jacobian: DMatrix::from_row_slice(r, n, &jacobian).select_rows(&rows),
            rows,
        })
    }
}

/// Refuses forces that are not finite, with the input that has no value if that is why.
fn check_finite<M: Constraints>(state: &M::State, force: &[f64]) -> Result<(), EquilibriumError> {
    let Some(bad) = force.iter().position(|x| !x.is_finite()) else { return Ok(()) };
    match state.inputs().as_slice().iter().position(|x| x.is_nan()) {
        Some(input) => Err(EquilibriumError::InputNotSet { input: M::INPUTS[input].name }),
        None => Err(EquilibriumError::NotFinite { coordinate: M::COORDINATES[bad].name }),
    }
}

impl<R: Vector> Statics<R> {
    /// The balance at a position on the constraints, at the velocities of the state. `preferred` coordinates
    /// are independent if possible. Stiffnesses that are rounding are set to 0.
    pub(crate) fn of<M: Constraints<Rows = R>>(
        model: &M,
        state: &M::State,
        preferred: &[usize],
    ) -> Result<Self, EquilibriumError> {
        let mut found = Self::as_computed(model, state, preferred)?;
        found.stiffness = found.without_rounding::<M>(found.stiffness.clone(), state, |nearby| {
            Self::as_computed(model, nearby, &found.tangent.coordinates).ok().map(|there| there.stiffness)
        });
        Ok(found)
    }

    /// A stiffness matrix in which elements that are rounding are 0. `stiffness_at` gives it at another
    /// state.
    fn without_rounding<M: Constraints>(
        &self,
        mut stiffness: DMatrix<f64>,
        state: &M::State,
        stiffness_at: impl Fn(&M::State) -> Option<DMatrix<f64>>,
    ) -> DMatrix<f64> {
        let of_columns = self.tangent.coordinates.iter().map(|i| self.masses[*i]);
        let of_columns = DVector::from_iterator(self.tangent.coordinates.len(), of_columns);
        clear_rounding::<M>(&mut stiffness, [&self.inertia, &of_columns], state, stiffness_at);
        stiffness
    }

    /// As [`Self::of`], with the stiffness as it is computed.
    fn as_computed<M: Constraints<Rows = R>>(
        model: &M,
        state: &M::State,
        preferred: &[usize],
    ) -> Result<Self, EquilibriumError> {
        let terms = StaticTerms::of(model, state)?;
        let holonomic = terms.rows.iter().filter(|row| **row < M::Residual::LEN).count();
        let tangent = Tangent::new(&terms.jacobian, holonomic, &terms.mass, [preferred, preferred]);
        let rows = terms.rows.len();
        let of_rows = tangent.particular(&DMatrix::identity(rows, rows)).tr_mul(&terms.force);
        let mut multipliers = M::Rows::zeros();
        terms.rows.iter().zip(of_rows.iter()).for_each(|(row, x)| multipliers[*row] = *x);
        let by_q = force_by_positions(model, state, &multipliers)?;
        let (d, e) = (&tangent.positions, &tangent.velocities);
        let sizes = terms.force.abs() + terms.jacobian.abs().tr_mul(&of_rows.abs());
        let mass = e.tr_mul(&(&terms.mass * e));
        let by_all = e.tr_mul(&by_q);
        Ok(Self {
            force: -e.tr_mul(&terms.force),
            stiffness: e.tr_mul(&(by_q * d)),
            by_all,
            inertia: mass.diagonal(),
            mass,
            masses: terms.mass.diagonal(),
            rounding: e.abs().tr_mul(&sizes) * f64::EPSILON,
            multipliers,
            tangent,
        })
    }

    /// The derivative K of F in a diagonal metric G, given by its diagonal. λ is chosen so that rᵀG⁻¹r
    /// is least. With A = EᵀG E this least value is FᵀA⁻¹F, and its derivative along δz is 2
    /// FᵀA⁻¹K δz, whichever coordinates are independent. In equilibrium K is [`Self::stiffness`].
    pub(super) fn covariant<M: Constraints<Rows = R>>(
        &self,
        model: &M,
        state: &M::State,
        metric: &[f64],
    ) -> Result<DMatrix<f64>, EquilibriumError> {
        let rows: Vec<usize> = active_rows::<M>(state.active_set(), false).collect();
        if rows.is_empty() {
            return Ok(self.stiffness.clone());
        }
        let here = self.covariant_as_computed(model, state, metric, &rows)?;
        Ok(self.without_rounding::<M>(here, state, |nearby| {
            let there = Self::as_computed(model, nearby, &self.tangent.coordinates).ok()?;
            there.covariant_as_computed(model, nearby, metric, &rows).ok()
        }))
    }

    /// As [`Self::covariant`], with the elements as they are computed.
    fn covariant_as_computed<M: Constraints<Rows = R>>(
        &self,
        model: &M,
        state: &M::State,
        metric: &[f64],
        rows: &[usize],
    ) -> Result<DMatrix<f64>, EquilibriumError> {
        let (d, e) = (&self.tangent.positions, &self.tangent.velocities);
        let metric = DMatrix::from_diagonal(&DVector::from_column_slice(metric));
        let square = e.tr_mul(&(&metric * e));
        let terms = StaticTerms::of(model, state)?;
        let held = DVector::from_iterator(rows.len(), rows.iter().map(|row| self.multipliers[*row]));
        let left = -(&terms.force + terms.jacobian.tr_mul(&held));
        let along = square.cholesky().ok_or(LinearizeError::Inertia)?.solve(&self.force);
        let tangential = metric * (e * along);
        let by =
            -self.tangent.particular(&DMatrix::identity(rows.len(), rows.len())).tr_mul(&(left - tangential));
        let mut multipliers = self.multipliers;
        rows.iter().zip(by.iter()).for_each(|(row, by)| multipliers[*row] += by);
        let by_q = force_by_positions(model, state, &multipliers)?;
        Ok(e.tr_mul(&(by_q * d)))
    }

    /// F at another state nearby, with E and λ of this one.
    pub(crate) fn force_nearby<M: Constraints<Rows = R>>(
        &self,
        model: &M,
        state: &M::State,
    ) -> Result<DVector<f64>, EquilibriumError> {
        let terms = StaticTerms::of(model, state)?;
        let held =
            DVector::from_iterator(terms.rows.len(), terms.rows.iter().map(|row| self.multipliers[*row]));
        Ok(-self.tangent.velocities.tr_mul(&(terms.force + terms.jacobian.tr_mul(&held))))
    }

    /// The uncertainty of F from rounding of the coordinates and of its terms, measured by moving the
    /// coordinates by their last bits (after J. J. Moré & S. M. Wild, SIAM J. Sci. Comput. 33 (2011) 1292).
    pub(crate) fn noise<M: Constraints<Rows = R>>(
        &self,
        model: &M,
        state: &M::State,
    ) -> Result<DVector<f64>, EquilibriumError> {
        self.noise_by(model, state, state.q().as_slice())
    }

    /// As [`Self::noise`], if coordinates are added to larger ones of their unit: each then moves by last
    /// bits of the largest one.
    pub(super) fn noise_of_sums<M: Constraints<Rows = R>>(
        &self,
        model: &M,
        state: &M::State,
    ) -> Result<DVector<f64>, EquilibriumError> {
        self.noise_by(model, state, &scales(M::COORDINATES, state.q().as_slice()))
    }

    /// The largest change of F if each coordinate moves by last bits of a number of this size.
    fn noise_by<M: Constraints<Rows = R>>(
        &self,
        model: &M,
        state: &M::State,
        sizes: &[f64],
    ) -> Result<DVector<f64>, EquilibriumError> {
        let here = self.force_nearby(model, state)?;
        let mut most = self.rounding.clone();
        for sample in 0..NOISE_SAMPLES {
            let mut nearby = *state;
            for (j, (q, size)) in nearby.q_mut().as_mut_slice().iter_mut().zip(sizes).enumerate() {
                // Signs of a Walsh function, so that no two samples are alike, and different numbers of bits.
                let sign = if (sample >> (j % 3)).is_multiple_of(2) { 1.0 } else { -1.0 };
                *q += sign * f64::from(1 + (sample + j as u32) % MAX_NOISE_BITS) * f64::EPSILON * size;
            }
            let change = (self.force_nearby(model, &nearby)? - &here).abs();
            most.zip_apply(&change, |most, change| *most = most.max(change));
        }
        Ok(most)
    }

    /// If a switching function of the model is zero at this very state, the residual force on one of its
    /// sides that exceeds the allowed one by most: the index of the coordinate, and the force.
    pub(super) fn at_corners<M: Constraints<Rows = R>>(
        &self,
        model: &M,
        state: &M::State,
        allowed: &DVector<f64>,
    ) -> Result<Option<(usize, f64)>, EquilibriumError> {
        let mut kinks = [Kink::NONE; MAX_KINKS];
        model.kinks(state, &mut kinks);
        for (index, _) in kinks.iter().enumerate().filter(|(_, kink)| kink.decides && kink.value == 0.0) {
            for below in [true, false] {
                let (mut held, mut branches) = (*state, Branches::FREE);
                branches.hold(index, below);
                held.hold(branches);
                let force = self.force_nearby(model, &held)?;
                if let Some((i, force)) = excess(&force, allowed) {
                    return Ok(Some((self.tangent.rates[i], force)));
                }
            }
        }
        Ok(None)
    }

    /// A direction in all coordinates along which inertia vanishes here, but not at `first`, where the search
    /// began. Generalized forces vanish along it, too, whatever forces act.
    pub(super) fn pole(&self, first: &Self) -> Option<DVector<f64>> {
        let had = |k: &usize| {
            let at = first.tangent.rates.iter().position(|i| *i == self.tangent.rates[*k]);
            at.is_some_and(|at| first.inertia[at] > 0.0)
        };
        let usual = |k: usize| first.tangent.rates.iter().position(|i| *i == self.tangent.rates[k]);
        let has_vanished = |k: &usize| {
            usual(*k).is_some_and(|at| self.inertia[*k] <= VANISHED_INERTIA_SHARE * first.inertia[at])
        };
        let heavy: Vec<usize> = (0..self.inertia.len()).filter(had).collect();
        if let Some(k) = heavy.iter().copied().find(has_vanished) {
            return Some(self.tangent.velocities.column(k).into_owned());
        }
        let scale = |k: usize| 1.0 / self.inertia[heavy[k]].sqrt();
        let scaled = DMatrix::from_fn(heavy.len(), heavy.len(), |i, j| {
            self.mass[(heavy[i], heavy[j])] * scale(i) * scale(j)
        });
        if scaled.is_empty() {
            return None;
        }
        let eigen = scaled.symmetric_eigen();
        let least = eigen.eigenvalues.imin();
        let mut along = DVector::zeros(self.inertia.len());
        heavy.iter().enumerate().for_each(|(i, k)| along[*k] = eigen.eigenvectors[(i, least)] * scale(i));
        (eigen.eigenvalues[least] <= VANISHED_INERTIA_SHARE).then(|| &self.tangent.velocities * along)
    }

    /// The largest |F| and the coordinate it acts on.
    pub(super) fn worst(&self) -> (usize, f64) {
        if self.force.is_empty() {
            return (0, 0.0);
        }
        let (i, force) = largest(&self.force);
        (self.tangent.rates[i], force)
    }
}

/// The element of the largest magnitude and its index.
fn largest(force: &DVector<f64>) -> (usize, f64) {
    let one = |best: (usize, f64), (i, x): (usize, &f64)| if x.abs() > best.1.abs() { (i, *x) } else { best };
    force.iter().enumerate().fold((0, 0.0), one)
}

/// ∂r/∂q at q̈ = 0 with these multipliers.
fn force_by_positions<M: Constraints>(
    model: &M,
    state: &M::State,
    multipliers: &M::Rows,
) -> Result<DMatrix<f64>, LinearizeError> {
    let (n, r, w) = (M::Vector::LEN, M::Rows::LEN, M::Inputs::LEN);
    let mut values = alloc::vec![0.0; (n + r) * (2 * n + w) + r * n];
    if !model.variations(state, &M::Vector::zeros(), multipliers, &mut values) {
        return Err(LinearizeError::NoDerivatives);
    }
    let by_q = DMatrix::from_row_slice(n, n, &values[..n * n]);
    if by_q.iter().all(|x| x.is_finite()) { Ok(by_q) } else { Err(LinearizeError::NotFinite) }
}

/// The element that exceeds its allowed magnitude by the largest factor: its index, and the force.
pub(super) fn excess(force: &DVector<f64>, allowed: &DVector<f64>) -> Option<(usize, f64)> {
    let beyond =
        force.iter().zip(allowed.iter()).enumerate().filter(|(_, (force, allowed))| force.abs() > **allowed);
    let most =
        beyond.max_by(|(_, (x, of_x)), (_, (y, of_y))| (x.abs() / **of_x).total_cmp(&(y.abs() / **of_y)));
    most.map(|(i, (force, _))| (i, *force))
}
