//! The equations of a constrained system at one state, factored once and solved for as many right-hand sides
//! as are wanted.
//!
//! ```text
//! M a − Φ_qᵀ λ = Q        Φ_q a = γ        M n×n symmetric, Φ_q m×n of any rank k
//! ```
//!
//! by the null-space method: a = Y y + Z z with Y and Z orthonormal bases of the row space and the null space
//! of Φ_q (complete orthogonal decomposition, [`crate::linalg::orthogonal`]); y from Φ_q Y y = γ by least
//! squares, z from ZᵀMZ z = Zᵀ(Q − M Y y) by Cholesky, and λ of least norm from Φ_qᵀ λ = M a − Q. M may be
//! singular as long as it is positive definite on the null space. Benzi, Golub & Liesen, Acta Numerica 14
//! (2005), §6; García de Jalón & Gutiérrez-López, Multibody Syst. Dyn. 30 (2013) 311–341 for redundant
//! constraints with singular M.
//!
//! Nothing depends on the units that the user chose: coordinates are scaled by 1/√Mᵢᵢ (those without inertia,
//! or with almost none, to the size of what they share constraints with), and rows then to unit length. The
//! least norm of λ is taken in that scale: what is least is Σ (λᵢ ‖Φ_q,ᵢ M_d^-½‖)², M_d the diagonal of M:
//! the sum of squares of the accelerations that each reaction alone would give.
//!
//! Cost: about 2n³ + 2nm² operations for the factors, 4n² per right-hand side.

use crate::error::{SingularMassMatrix, SolveError};
use crate::linalg::PIVOT_TOLERANCE;
use crate::linalg::orthogonal::{self, Orthogonal};
use crate::linalg::{Indices, WorkMemory, dot, max_abs, norm};
use crate::math::sqrt;
use crate::model::Quantity;

/// A row whose distance from the span of the others is below this fraction of its length is taken to repeat
/// them.
///
/// Between what redundancy looks like on a drifting motion (1e-9 of drift leaves 1e-9 of distance) and the
/// nearness at which a mechanism passes a singular position: 1e-8 rad are crossed within one evaluation.
// Public for dynamics-analysis alone.
#[doc(hidden)]
pub const RANK_TOLERANCE: f64 = 1e-8;

/// Share of a row's length by which a coordinate with little inertia may outweigh the others in it.
const LIGHT: f64 = 1e3;

/// Rows that differ in length by more than this factor count alike even where some are declared redundant:
/// near a singular position a row that nearly vanishes decides less than those that repeat it.
const COMPARABLE: f64 = 30.0;

/// What the numbers belong to.
#[derive(Clone, Copy)]
pub(crate) struct Names {
    pub(crate) rows: &'static [Quantity],
    pub(crate) coordinates: &'static [Quantity],
}

impl Names {
    pub(crate) fn row(&self, i: usize) -> &'static str {
        self.rows.get(i).map_or("", |row| row.name)
    }
}

/// M, Q, Φ_q and γ as read from a model.
pub(crate) struct Read<'w> {
    pub(crate) mass: &'w mut [f64],
    pub(crate) force: &'w mut [f64],
    pub(crate) jacobian: &'w mut [f64],
    pub(crate) gamma: &'w mut [f64],
}

impl<'w> Read<'w> {
    pub(crate) fn new(n: usize, r: usize, memory: &mut WorkMemory<'w>) -> Self {
        let (mass, force) = (memory.zeros(n * n), memory.zeros(n));
        Self { mass, force, jacobian: memory.zeros(r * n), gamma: memory.zeros(r) }
    }
}

/// The factored system.
pub(crate) struct FactoredSystem<'w> {
    n: usize,
    /// Rows that hold.
    active: Indices<'w>,
    m: usize,
    /// Whether a row that holds is zero.
    pub(crate) vanished: bool,
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

/// Memory of a [`FactoredSystem`], besides what is [`Read`].
pub(crate) const fn memory(n: usize, r: usize) -> usize {
    n * n + 3 * n + 4 * r + orthogonal::memory(r)
}

/// By how much Φ_q a = γ cannot be satisfied.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Miss {
    /// Norm of what is left over, rows at unit length.
    pub(crate) size: f64,
    /// Norm of γ in the same scale.
    pub(crate) scale: f64,
    /// Norm of a in the same scale, or of what the forces alone would make it: what Φ_q a is rounded at.
    pub(crate) reach: f64,
    /// The row that is missed most.
    pub(crate) row: usize,
    /// Its Φ_q a − γ in the user's units.
    pub(crate) residual: f64,
}

impl<'w> FactoredSystem<'w> {
    /// Factors M (n×n) and the rows of Φ_q (r×n) that hold, which is overwritten. `redundant`: the rows that
    /// are declared so. `slack`: at least [`RANK_TOLERANCE`], the share of its length by which a row has to
    /// differ from the others. `usual`: the lengths of rows where they have not vanished.
    pub(crate) fn factor(
        mass: &[f64],
        jacobian: &'w mut [f64],
        holds: &dyn Fn(usize) -> bool,
        redundant: &dyn Fn(usize) -> bool,
        (slack, usual): (f64, &[f64]),
        names: Names,
        memory: &mut WorkMemory<'w>,
    ) -> Result<Self, SolveError> {
        let (n, r) = (names.coordinates.len(), names.rows.len());
        let scale = memory.take(n);
        let (x, y) = (memory.take(n), memory.take(n));
        let (weight, b, w) = (memory.take(r), memory.take(r), memory.take(r));
        let mut active = memory.indices(r);
        let m = gather(jacobian, n, r, holds, &mut active);
        for i in 0..m {
            if !jacobian[i * n..(i + 1) * n].iter().all(|x| x.is_finite()) {
                return Err(SolveError::ConstraintNotFinite { row: names.row(active.get(i)) });
            }
        }
        scale_coordinates(mass, &jacobian[..m * n], scale);
        let (mut vanished, widest) = (false, max_abs(scale));
        let (mut shortest, mut longest) = (f64::INFINITY, 0.0_f64);
        for (i, (row, weight)) in jacobian.chunks_exact_mut(n).zip(&mut *weight).take(m).enumerate() {
            row.iter_mut().zip(&*scale).for_each(|(x, s)| *x *= s);
            let length = norm(row);
            if length == 0.0 {
                // At a change point; or wherever the constraint holds, which the caller finds out.
                vanished = true;
                let usual = usual[active.get(i)] * widest;
                *weight = if usual > 0.0 && usual.is_finite() { 1.0 / usual } else { 1.0 };
                continue;
            }
            (shortest, longest) = (shortest.min(length), longest.max(length));
            *weight = 1.0 / length;
            row.iter_mut().for_each(|x| *x *= *weight);
        }
        let turned = memory.take(n * n);
        for (i, (to, from)) in turned.chunks_exact_mut(n).zip(mass.chunks_exact(n)).enumerate() {
            (0..n).for_each(|j| to[j] = scale[i] * from[j] * scale[j]);
        }
        let inertia = max_abs(turned);
        let rows = Orthogonal::new(
            &mut jacobian[..m * n],
            (m, n),
            &|i| longest <= COMPARABLE * shortest && redundant(active.get(i)),
            slack,
            memory,
        );
        rows.rotate_symmetric(turned, x);
        let mut it = Self { n, active, m, vanished, scale, weight, rows, mass: turned, x, y, b, w };
        it.factor_free(inertia, names)?;
        Ok(it)
    }

    /// Number of rows that hold.
    pub(crate) fn active(&self) -> usize {
        self.m
    }

    pub(crate) fn rank(&self) -> usize {
        self.rows.rank
    }

    /// From here on rows that are declared redundant count as much as the others.
    pub(crate) fn weigh_alike(&mut self) {
        self.rows.known = false;
    }

    pub(crate) fn condition(&self) -> f64 {
        self.rows.condition
    }

    /// ZᵀM̂Z = L Lᵀ, in place.
    fn factor_free(&mut self, inertia: f64, names: Names) -> Result<(), SolveError> {
        let (n, k) = (self.n, self.rows.rank);
        for j in k..n {
            for i in j..n {
                let inner = dot(&self.mass[i * n + k..i * n + j], &self.mass[j * n + k..j * n + j]);
                let rest = self.mass[i * n + j] - inner;
                if i == j {
                    // Not-a-number passes: it comes from the state or a force, and is reported as such.
                    if rest <= PIVOT_TOLERANCE * inertia {
                        return Err(self.singular(j, rest, names).into());
                    }
                    self.mass[j * n + j] = sqrt(rest);
                } else {
                    self.mass[i * n + j] = rest / self.mass[j * n + j];
                }
            }
        }
        Ok(())
    }

    /// Names the coordinate that moves most along the direction without inertia that column j completes.
    #[cold]
    fn singular(&mut self, j: usize, pivot: f64, names: Names) -> SingularMassMatrix {
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

    /// a and λ for a right-hand side Q (n) and γ (all rows; those of released constraints are not read). λ of
    /// released rows is 0.
    pub(crate) fn solve(&mut self, force: &[f64], gamma: &[f64], a: &mut [f64], lambda: &mut [f64]) -> Miss {
        let (n, k, m) = (self.n, self.rows.rank, self.m);
        for i in 0..m {
            self.b[i] = self.weight[i] * gamma[self.active.get(i)];
        }
        let scale = norm(&self.b[..m]);
        self.rows.fit(&mut self.b[..m], &mut self.y[..k], &mut self.w[..m]);
        let mut miss = self.miss(scale);
        // Qᵀ S Q, then its last part against ZᵀM̂Z z.
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
        // Yᵀ (M̂ a − Q̂): the reaction.
        for i in 0..k {
            self.x[i] = dot(&self.mass[i * n..(i + 1) * n], self.y) - self.x[i];
        }
        self.rows.least_norm(&self.x[..k], &mut self.b[..m], &mut self.w[..m]);
        lambda.fill(0.0);
        for i in 0..m {
            lambda[self.active.get(i)] = self.weight[i] * self.b[i];
        }
        miss.reach = norm(self.y).max(forced);
        a.copy_from_slice(self.y);
        self.rows.rotate_back(a);
        a.iter_mut().zip(&*self.scale).for_each(|(a, s)| *a *= s);
        miss
    }

    fn miss(&self, scale: f64) -> Miss {
        let left = &self.b[..self.m];
        let worst = left.iter().enumerate();
        let at = worst.fold((0, 0.0), |most, (i, x)| if x.abs() > most.1 { (i, x.abs()) } else { most }).0;
        let (row, residual) =
            if self.m > 0 { (self.active.get(at), -left[at] / self.weight[at]) } else { (0, 0.0) };
        Miss { size: norm(left), scale, reach: 0.0, row, residual }
    }

    /// Whether the multiplier of a row is the same in all solutions; true for rows that are released, where
    /// it is 0.
    pub(crate) fn is_unique(&mut self, row: usize) -> bool {
        let place = (0..self.m).find(|i| self.active.get(*i) == row);
        place.is_none_or(|i| self.rows.is_independent(i, self.w))
    }

    /// Norm over the rows that hold of numbers per row, rows at unit length.
    pub(crate) fn size_of_rows(&mut self, values: &[f64]) -> f64 {
        for i in 0..self.m {
            self.b[i] = self.weight[i] * values[self.active.get(i)];
        }
        norm(&self.b[..self.m])
    }
}

/// Moves the rows that hold to the front and lists them; returns their number.
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

/// sⱼ = 1/√Mⱼⱼ, less where that would let a light coordinate outweigh the others in its constraints a
/// thousandfold: the others would be lost in rounding.
pub(crate) fn scale_coordinates(mass: &[f64], jacobian: &[f64], scale: &mut [f64]) {
    let n = scale.len();
    for (j, s) in scale.iter_mut().enumerate() {
        let inertia = mass[j * n + j].abs();
        *s = if inertia > 0.0 && inertia.is_finite() { 1.0 / sqrt(inertia) } else { 0.0 };
    }
    // From the scales above alone, so that the order of coordinates does not matter; −1 marks what is to be
    // set.
    for j in 0..n {
        let (mut own, mut others) = (0.0_f64, 0.0_f64);
        for row in jacobian.chunks_exact(n).filter(|row| row[j] != 0.0) {
            own = own.max(row[j].abs());
            let partner = |l: usize| row[l].abs() * scale_before(mass, n, l);
            others = (0..n).filter(|l| *l != j).fold(others, |most, l| most.max(partner(l)));
        }
        let massless = scale[j] == 0.0;
        if own == 0.0 {
            if massless {
                scale[j] = 1.0;
            }
        } else if massless {
            scale[j] = if others > 0.0 { others / own } else { 1.0 / own };
        } else if scale[j] * own > LIGHT * others && scale[j] * own < 1e9 * others {
            scale[j] = LIGHT * others / own;
        }
    }
}

fn scale_before(mass: &[f64], n: usize, l: usize) -> f64 {
    let inertia = mass[l * n + l].abs();
    if inertia > 0.0 && inertia.is_finite() { 1.0 / sqrt(inertia) } else { 0.0 }
}
