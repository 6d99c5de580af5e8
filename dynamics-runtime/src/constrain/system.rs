//! The equations of a constrained system at one state, factored once and solved for any number of right-hand
//! sides.
//!
//! ```text
//! M a − Φ_qᵀ λ = Q        Φ_q a = γ        M n×n symmetric, Φ_q m×n of any rank k
//! ```
//!
//! The null-space method solves them: a = Y y + Z z with Y and Z orthonormal bases of the row space and the
//! null space of Φ_q (complete orthogonal decomposition, [`crate::linalg::orthogonal`]). y follows from Φ_q
//! Y y = γ by least squares, z from ZᵀMZ z = Zᵀ(Q − M Y y) by Cholesky, and λ of least norm from
//! Φ_qᵀ λ = M a − Q. M may be singular as long as it is positive definite on the null space. Sources:
//! Benzi, Golub & Liesen, Acta Numerica 14 (2005), §6; García de Jalón & Gutiérrez-López, Multibody
//! Syst. Dyn. 30 (2013) 311–341 for redundant constraints with singular M.
//!
//! The result does not depend on the units that the user chose. Coordinates are scaled by 1/√Mᵢᵢ, rows
//! then to unit length. Coordinates without inertia, or with almost none, get the size of the coordinates
//! that they share constraints with. The least norm of λ is taken in that scale: Σ (λᵢ ‖Φ_q,ᵢ
//! M_d^-½‖)² is least, M_d the diagonal of M. That is the sum of squares of the accelerations that each
//! reaction alone would give.
//!
//! Cost: about 2n³ + 2nm² operations for the factors, 4n² per right-hand side. The rank is decided at
//! [`RANK_TOLERANCE`]: a mechanism that is nearer than that to a singular position counts as singular.

use crate::error::{SingularMassMatrix, SolveError};
use crate::linalg::PIVOT_TOLERANCE;
use crate::linalg::orthogonal::{self, Orthogonal};
use crate::linalg::{Indices, WorkspaceSlices, dot, max_abs, norm};
use crate::math::sqrt;
use crate::model::Quantity;

/// A row repeats others where its distance from their span is below this part of its length.
///
/// The value lies between two sizes. On a drifting motion redundant rows differ by the drift: 10⁻⁹ of
/// drift leaves a distance of 10⁻⁹. And a mechanism moves across 10⁻⁸ rad around a singular position
/// within one evaluation.
// Public for dynamics-analysis alone.
#[doc(hidden)]
pub const RANK_TOLERANCE: f64 = 1e-8;

/// A coordinate with little inertia that outweighs the other coordinates of its rows by more than this
/// factor, and by less than [`MIN_MASSLESS_DOMINANCE`], is scaled down to this factor. With a larger one the
/// entries of the others lose more digits: 10³ leaves them thirteen of sixteen.
const MAX_LIGHT_DOMINANCE: f64 = 1e3;

/// A coordinate that outweighs the others by this factor or more keeps its scale by inertia. A smaller value
/// leaves fewer digits to the others of light coordinates, a larger one scales more of them down.
const MIN_MASSLESS_DOMINANCE: f64 = 1e9;

/// Rows that are declared redundant are set aside only where the lengths of all rows differ by less than this
/// factor. Near a singular position a row that nearly vanishes determines less than the rows that repeat it.
/// A larger value would drop good rows nearer to singular positions, a smaller one would keep redundant rows
/// in models whose rows differ in units.
const COMPARABLE_LENGTHS: f64 = 30.0;

/// Names of the rows and coordinates, for errors.
#[derive(Clone, Copy)]
pub(crate) struct SystemNames {
    pub(crate) rows: &'static [Quantity],
    pub(crate) coordinates: &'static [Quantity],
}

impl SystemNames {
    pub(crate) fn row(&self, i: usize) -> &'static str {
        self.rows.get(i).map_or("", |row| row.name)
    }
}

/// M, Q, Φ_q and γ of a model in a workspace, zeroed.
pub(crate) struct ModelTerms<'w> {
    pub(crate) mass: &'w mut [f64],
    pub(crate) force: &'w mut [f64],
    pub(crate) jacobian: &'w mut [f64],
    pub(crate) gamma: &'w mut [f64],
}

impl<'w> ModelTerms<'w> {
    pub(crate) fn new(n: usize, r: usize, workspace: &mut WorkspaceSlices<'w>) -> Self {
        let (mass, force) = (workspace.zeros(n * n), workspace.zeros(n));
        Self { mass, force, jacobian: workspace.zeros(r * n), gamma: workspace.zeros(r) }
    }
}

/// The factored system.
pub(crate) struct FactoredSystem<'w> {
    n: usize,
    /// The active rows, m of them.
    active: Indices<'w>,
    m: usize,
    /// Whether an active row is zero.
    pub(crate) has_vanished_row: bool,
    /// aⱼ = sⱼ âⱼ.
    scale: &'w mut [f64],
    /// Φ̂ᵢ = wᵢ Φᵢ S, λᵢ = wᵢ λ̂ᵢ.
    weight: &'w mut [f64],
    rows: Orthogonal<'w>,
    /// Qᵀ M̂ Q; below the diagonal of its last block the Cholesky factor of ZᵀM̂Z.
    mass: &'w mut [f64],
    x: &'w mut [f64],
    y: &'w mut [f64],
    b: &'w mut [f64],
    w: &'w mut [f64],
}

/// Length of the workspace of a [`FactoredSystem`], besides its [`ModelTerms`].
pub(crate) const fn workspace_len(n: usize, r: usize) -> usize {
    n * n + 3 * n + 4 * r + orthogonal::workspace_len(r)
}

/// Residual of Φ_q a = γ: by how much it cannot be satisfied.
#[derive(Clone, Copy, Debug)]
pub(crate) struct GammaResidual {
    /// Norm of the residual, rows at unit length.
    pub(crate) norm: f64,
    /// Norm of γ in the same scale.
    pub(crate) gamma_norm: f64,
    /// Norm of a in the same scale, or of the accelerations by forces alone if that is larger: the size at
    /// which Φ_q a is rounded.
    pub(crate) acceleration_norm: f64,
    /// The row with the largest residual.
    pub(crate) row: usize,
    /// Its Φ_q a − γ in the user's units.
    pub(crate) residual: f64,
}

impl<'w> FactoredSystem<'w> {
    /// Factors M (n×n) and the active rows of Φ_q (r×n), which is overwritten. `redundant`: the rows that
    /// are declared so. `redundancy_tolerance`: the part of its length by which a row has to differ from the
    /// others, at least [`RANK_TOLERANCE`]. `usual_lengths`: the usual lengths of the rows.
    pub(crate) fn factor(
        mass: &[f64],
        jacobian: &'w mut [f64],
        holds: &dyn Fn(usize) -> bool,
        redundant: &dyn Fn(usize) -> bool,
        (redundancy_tolerance, usual_lengths): (f64, &[f64]),
        names: SystemNames,
        workspace: &mut WorkspaceSlices<'w>,
    ) -> Result<Self, SolveError> {
        let (n, r) = (names.coordinates.len(), names.rows.len());
        let scale = workspace.take(n);
        let (x, y) = (workspace.take(n), workspace.take(n));
        let (weight, b, w) = (workspace.take(r), workspace.take(r), workspace.take(r));
        let mut active = workspace.indices(r);
        // The active rows, checked to be finite.
        let m = gather(jacobian, n, r, holds, &mut active);
        for i in 0..m {
            if !jacobian[i * n..(i + 1) * n].iter().all(|x| x.is_finite()) {
                return Err(SolveError::ConstraintNotFinite { row: names.row(active.get(i)) });
            }
        }
        // Coordinates are scaled by their inertia, rows then to unit length.
        scale_coordinates(mass, &jacobian[..m * n], scale);
        let (mut has_vanished_row, largest_scale) = (false, max_abs(scale));
        let (mut shortest, mut longest) = (f64::INFINITY, 0.0_f64);
        for (i, (row, weight)) in jacobian.chunks_exact_mut(n).zip(&mut *weight).take(m).enumerate() {
            row.iter_mut().zip(&*scale).for_each(|(x, s)| *x *= s);
            let length = norm(row);
            if length == 0.0 {
                // At a change point, or on the whole manifold; the caller tells the two apart.
                has_vanished_row = true;
                let usual_length = usual_lengths[active.get(i)] * largest_scale;
                *weight =
                    if usual_length > 0.0 && usual_length.is_finite() { 1.0 / usual_length } else { 1.0 };
                continue;
            }
            (shortest, longest) = (shortest.min(length), longest.max(length));
            *weight = 1.0 / length;
            row.iter_mut().for_each(|x| *x *= *weight);
        }
        // M in scaled coordinates, rotated into the bases of the row space and the null space.
        let rotated_mass = workspace.take(n * n);
        for (i, (to, from)) in rotated_mass.chunks_exact_mut(n).zip(mass.chunks_exact(n)).enumerate() {
            (0..n).for_each(|j| to[j] = scale[i] * from[j] * scale[j]);
        }
        let inertia = max_abs(rotated_mass);
        let rows = Orthogonal::new(
            &mut jacobian[..m * n],
            (m, n),
            &|i| longest <= COMPARABLE_LENGTHS * shortest && redundant(active.get(i)),
            redundancy_tolerance,
            workspace,
        );
        rows.rotate_symmetric(rotated_mass, x);
        let mut system =
            Self { n, active, m, has_vanished_row, scale, weight, rows, mass: rotated_mass, x, y, b, w };
        system.factor_free(inertia, names)?;
        Ok(system)
    }

    /// Number of active rows.
    pub(crate) fn active(&self) -> usize {
        self.m
    }

    pub(crate) fn rank(&self) -> usize {
        self.rows.rank
    }

    /// From here on redundant rows count as much as the others.
    pub(crate) fn ignore_redundancy(&mut self) {
        self.rows.has_redundant_rows = false;
    }

    pub(crate) fn condition(&self) -> f64 {
        self.rows.condition
    }

    /// ZᵀM̂Z = L Lᵀ, in place.
    fn factor_free(&mut self, inertia: f64, names: SystemNames) -> Result<(), SolveError> {
        let (n, k) = (self.n, self.rows.rank);
        for j in k..n {
            for i in j..n {
                let inner = dot(&self.mass[i * n + k..i * n + j], &self.mass[j * n + k..j * n + j]);
                let rest = self.mass[i * n + j] - inner;
                if i == j {
                    // NaN is accepted here. It comes from the state or a force, and is reported as such.
                    if rest <= PIVOT_TOLERANCE * inertia {
                        return Err(self.singular_mass_matrix(j, rest, names).into());
                    }
                    self.mass[j * n + j] = sqrt(rest);
                } else {
                    self.mass[i * n + j] = rest / self.mass[j * n + j];
                }
            }
        }
        Ok(())
    }

    /// The error for column j: it names the coordinate that moves most in the direction without inertia.
    #[cold]
    fn singular_mass_matrix(&mut self, j: usize, pivot: f64, names: SystemNames) -> SingularMassMatrix {
        let (n, k) = (self.n, self.rows.rank);
        self.x.fill(0.0);
        self.x[j] = 1.0;
        for i in (k..j).rev() {
            let later: f64 = (i + 1..=j).map(|l| self.mass[l * n + i] * self.x[l]).sum();
            self.x[i] = -later / self.mass[i * n + i];
        }
        self.rows.rotate_back(self.x);
        let along = self.x.iter().enumerate();
        let coordinate =
            along.fold((0, 0.0), |most, (i, x)| if x.abs() > most.1 { (i, x.abs()) } else { most }).0;
        let negative = pivot < -PIVOT_TOLERANCE * max_abs(self.mass);
        SingularMassMatrix {
            coordinate,
            name: names.coordinates.get(coordinate).map_or("", |q| q.name),
            pivot: pivot / (self.scale[coordinate] * self.scale[coordinate]),
            negative,
        }
    }

    /// Solves for a and λ with the right-hand sides Q (n) and γ (all rows; those of released constraints are
    /// not read). λ of released rows is 0.
    pub(crate) fn solve(
        &mut self,
        force: &[f64],
        gamma: &[f64],
        a: &mut [f64],
        lambda: &mut [f64],
    ) -> GammaResidual {
        let (n, k, m) = (self.n, self.rows.rank, self.m);
        // y: Φ_q Y y = γ by least squares.
        for i in 0..m {
            self.b[i] = self.weight[i] * gamma[self.active.get(i)];
        }
        let gamma_norm = norm(&self.b[..m]);
        self.rows.fit(&mut self.b[..m], &mut self.y[..k], &mut self.w[..m]);
        let mut residual = self.gamma_residual(gamma_norm);
        // z: ZᵀM̂Z z = Zᵀ(Q̂ − M̂ Y y) with the Cholesky factor.
        (0..n).for_each(|j| self.x[j] = self.scale[j] * force[j]);
        let forced = norm(self.x);
        self.rows.rotate(self.x);
        for i in k..n {
            let known = dot(&self.mass[i * n..i * n + k], &self.y[..k]);
            let inner = dot(&self.mass[i * n + k..i * n + i], &self.y[k..i]);
            self.y[i] = (self.x[i] - known - inner) / self.mass[i * n + i];
        }
        for i in (k..n).rev() {
            let later: f64 = (i + 1..n).map(|l| self.mass[l * n + i] * self.y[l]).sum();
            self.y[i] = (self.y[i] - later) / self.mass[i * n + i];
        }
        // The reaction Yᵀ (M̂ a − Q̂), and λ of least norm from it.
        for i in 0..k {
            self.x[i] = dot(&self.mass[i * n..(i + 1) * n], self.y) - self.x[i];
        }
        self.rows.least_norm(&self.x[..k], &mut self.b[..m], &mut self.w[..m]);
        lambda.fill(0.0);
        for i in 0..m {
            lambda[self.active.get(i)] = self.weight[i] * self.b[i];
        }
        // a in the user's coordinates.
        residual.acceleration_norm = norm(self.y).max(forced);
        a.copy_from_slice(self.y);
        self.rows.rotate_back(a);
        a.iter_mut().zip(&*self.scale).for_each(|(a, s)| *a *= s);
        residual
    }

    fn gamma_residual(&self, gamma_norm: f64) -> GammaResidual {
        let left = &self.b[..self.m];
        let entries = left.iter().enumerate();
        let at = entries.fold((0, 0.0), |most, (i, x)| if x.abs() > most.1 { (i, x.abs()) } else { most }).0;
        let (row, residual) =
            if self.m > 0 { (self.active.get(at), -left[at] / self.weight[at]) } else { (0, 0.0) };
        GammaResidual { norm: norm(left), gamma_norm, acceleration_norm: 0.0, row, residual }
    }

    /// Whether the multiplier of a row is the same in all solutions. It is for released rows, where it is 0.
    pub(crate) fn is_unique(&mut self, row: usize) -> bool {
        let place = (0..self.m).find(|i| self.active.get(*i) == row);
        place.is_none_or(|i| self.rows.is_independent(i, self.w))
    }

    /// Norm of one value per active row, rows at unit length.
    pub(crate) fn size_of_rows(&mut self, values: &[f64]) -> f64 {
        for i in 0..self.m {
            self.b[i] = self.weight[i] * values[self.active.get(i)];
        }
        norm(&self.b[..self.m])
    }
}

/// Moves the active rows to the front and lists them; returns their number.
fn gather(
    a: &mut [f64],
    n: usize,
    r: usize,
    holds: &dyn Fn(usize) -> bool,
    active: &mut Indices<'_>,
) -> usize {
    let mut m = 0;
    for i in (0..r).filter(|i| holds(*i)) {
        a.copy_within(i * n..(i + 1) * n, m * n);
        active.set(m, i);
        m += 1;
    }
    m
}

/// Scales of the coordinates: sⱼ = 1/√Mⱼⱼ. The scale is reduced where a light coordinate would
/// outweigh the others in its constraints a thousandfold, so that the others would be lost in rounding.
/// Coordinates without inertia get the size of their partners.
pub(crate) fn scale_coordinates(mass: &[f64], jacobian: &[f64], scale: &mut [f64]) {
    let n = scale.len();
    for (j, s) in scale.iter_mut().enumerate() {
        let inertia = mass[j * n + j].abs();
        *s = if inertia > 0.0 && inertia.is_finite() { 1.0 / sqrt(inertia) } else { 0.0 };
    }
    // Computed from the scales by inertia alone, so that the order of the coordinates does not matter.
    for j in 0..n {
        let (mut own, mut others) = (0.0_f64, 0.0_f64);
        for row in jacobian.chunks_exact(n).filter(|row| row[j] != 0.0) {
            own = own.max(row[j].abs());
            let partner = |l: usize| row[l].abs() * inertia_scale(mass, n, l);
            others = (0..n).filter(|l| *l != j).fold(others, |most, l| most.max(partner(l)));
        }
        let massless = scale[j] == 0.0;
        if own == 0.0 {
            if massless {
                scale[j] = 1.0;
            }
        } else if massless {
            scale[j] = if others > 0.0 { others / own } else { 1.0 / own };
        } else if scale[j] * own > MAX_LIGHT_DOMINANCE * others
            && scale[j] * own < MIN_MASSLESS_DOMINANCE * others
        {
            scale[j] = MAX_LIGHT_DOMINANCE * others / own;
        }
    }
}

/// 1/√Mₗₗ; 0 where there is no inertia.
fn inertia_scale(mass: &[f64], n: usize, l: usize) -> f64 {
    let inertia = mass[l * n + l].abs();
    if inertia > 0.0 && inertia.is_finite() { 1.0 / sqrt(inertia) } else { 0.0 }
}
