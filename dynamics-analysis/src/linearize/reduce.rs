//! Reduction by constraints: independent coordinates z and velocities v, and how the others follow from them,
//! δq = D z and δq̇ = E v + F z.
//!
//! Gauss–Jordan elimination with complete pivoting of the rows [Φ_q; A]. The columns without a pivot are
//! independent; D and E are its null space. Columns are scaled by 1/√M_ii for the choice of pivots, so that
//! it does not depend on units. Φ_q alone is eliminated first and gives D; elimination of the other rows
//! goes on from there and gives E.

use alloc::vec::Vec;

use dynamics_runtime::constrain::RANK_TOLERANCE;
use dynamics_runtime::constrain::active_rows;
use dynamics_runtime::model::{Constraints, ModelState, Quantity, Vector};
use dynamics_view::suggest;
use nalgebra::DMatrix;

use super::LinearizeError;
use crate::displacement::{displaced, projected};

/// Coordinates by name.
pub(crate) fn indices<M: Constraints>(names: &[&str]) -> Result<Vec<usize>, LinearizeError> {
    let index = |name: &&str| {
        let found = M::COORDINATES.iter().position(|q| q.name == *name);
        found.ok_or_else(|| LinearizeError::UnknownCoordinate {
            name: (*name).into(),
            nearest: suggest(name, M::COORDINATES.iter().map(|q| q.name)),
        })
    };
    let mut found: Vec<usize> = Vec::with_capacity(names.len());
    for name in names {
        let index = index(name)?;
        // Names that occur twice count once.
        if !found.contains(&index) {
            found.push(index);
        }
    }
    Ok(found)
}

/// Acceleration, relative to the largest velocity (at least 1), up to which a velocity counts as constant:
/// the accuracy of states that were typed in with nine digits. The choice only sets which velocities are
/// tried first.
const CONSTANT_VELOCITY: f64 = 1e-8;

/// The coordinates whose velocities do not change.
pub(super) fn constant_velocities<S: ModelState>(
    state: &S,
    accelerations: &nalgebra::DVector<f64>,
) -> Vec<usize> {
    let fastest = state.u().as_slice().iter().fold(1.0, |most: f64, u| most.max(u.abs()));
    (0..accelerations.len()).filter(|i| accelerations[*i].abs() <= CONSTANT_VELOCITY * fastest).collect()
}

/// Largest value of a unit below which all its values count as 0. The scale is then 1, instead of a value
/// that is only rounding.
const MIN_SCALE: f64 = 1e-12;

/// The scale of each coordinate: the largest value among the coordinates of its unit; at least 1 rad for
/// angles; 1 if all are 0.
pub(crate) fn scales(coordinates: &[Quantity], values: &[f64]) -> Vec<f64> {
    let of_unit = |quantity: &Quantity| {
        let same = coordinates.iter().zip(values).filter(|(other, _)| other.unit == quantity.unit);
        let most = same.fold(0.0, |most: f64, (_, value)| most.max(value.abs()));
        if quantity.is_angle() || most < MIN_SCALE { most.max(1.0) } else { most }
    };
    coordinates.iter().map(of_unit).collect()
}

/// The tangent space of the constraints at a position.
pub(crate) struct Tangent {
    /// Independent coordinates: the requested ones first, then the others in ascending order.
    pub(crate) coordinates: Vec<usize>,
    /// The coordinates whose velocities are independent, a part of `coordinates`.
    pub(crate) rates: Vec<usize>,
    /// D, N×C.
    pub(crate) positions: DMatrix<f64>,
    /// E, N×F.
    pub(crate) velocities: DMatrix<f64>,
    /// Ratio of the largest to the smallest pivot; 1 without rows.
    pub(crate) conditioning: f64,
    /// Number of independent rows.
    pub(crate) rank: usize,
    /// Number of rows.
    rows: usize,
    /// N×R: the dependent coordinates that solve the rows for given right-hand sides.
    solver: DMatrix<f64>,
}

impl Tangent {
    /// The tangent space of rows, of which the first `holonomic` also hold for coordinates. The `preferred`
    /// coordinates and velocities become independent as far as the rows allow.
    pub(crate) fn new(
        rows: &DMatrix<f64>,
        holonomic: usize,
        mass: &DMatrix<f64>,
        preferred: [&[usize]; 2],
    ) -> Self {
        let n = mass.nrows();
        let mut elimination = Elimination::new(rows, mass);
        elimination.run(0..holonomic, preferred[0]);
        let (coordinates, positions) = elimination.null_space(preferred[0]);
        elimination.run(0..rows.nrows(), preferred[1]);
        let (rates, velocities) = elimination.null_space(&coordinates);
        let mut solver = DMatrix::zeros(n, rows.nrows());
        for (row, column) in &elimination.pivots {
            solver.row_mut(*column).copy_from(&elimination.transform.row(*row));
        }
        let [least, most] = elimination.sizes;
        Self {
            coordinates,
            rates,
            positions,
            velocities,
            conditioning: if elimination.pivots.is_empty() { 1.0 } else { most / least },
            rank: elimination.pivots.len(),
            rows: rows.nrows(),
            solver,
        }
    }

    /// Number of rows.
    pub(crate) fn row_count(&self) -> usize {
        self.rows
    }

    /// The changes of dependent coordinates that solve rows · δ = −`residuals` with the independent ones
    /// held.
    pub(crate) fn particular(&self, residuals: &DMatrix<f64>) -> DMatrix<f64> {
        -(&self.solver * residuals)
    }
}

/// Inertia of a coordinate without any, relative to the largest: it scales the column for the choice of
/// pivots like the column of a light coordinate. A smaller value would make such coordinates dependent more
/// often.
const MIN_INERTIA: f64 = 1e-6;

/// Gauss–Jordan elimination with complete pivoting, rows and columns scaled: [rows | 1] → [.. 1 ..|
/// transform].
struct Elimination {
    rows: DMatrix<f64>,
    transform: DMatrix<f64>,
    /// Column factors 1/√M_ii, used for the choice of pivots only.
    scale: Vec<f64>,
    /// Row and column of each pivot so far.
    pivots: Vec<(usize, usize)>,
    /// Smallest and largest pivot, scaled.
    sizes: [f64; 2],
}

impl Elimination {
    fn new(rows: &DMatrix<f64>, mass: &DMatrix<f64>) -> Self {
        let (r, n) = rows.shape();
        let largest = (0..n).map(|i| mass[(i, i)]).fold(0.0, f64::max);
        let inertia = |i: usize| mass[(i, i)].max(MIN_INERTIA * largest).max(f64::MIN_POSITIVE);
        let scale: Vec<f64> = (0..n).map(|i| 1.0 / inertia(i).sqrt()).collect();
        let mut transform = DMatrix::identity(r, r);
        let mut scaled = rows.clone();
        for i in 0..r {
            let size = (0..n).map(|j| (scaled[(i, j)] * scale[j]).abs()).fold(0.0, f64::max);
            if size > 0.0 {
                scaled.row_mut(i).scale_mut(1.0 / size);
                transform[(i, i)] = 1.0 / size;
            }
        }
        Self { rows: scaled, transform, scale, pivots: Vec::new(), sizes: [f64::INFINITY, 0.0] }
    }

    /// Eliminates with pivots in these rows, until none is left.
    fn run(&mut self, among: core::ops::Range<usize>, preferred: &[usize]) {
        while let Some((i, j, size)) = self.largest_pivot(among.clone(), preferred) {
            self.sizes = [self.sizes[0].min(size), self.sizes[1].max(size)];
            let pivot = self.rows[(i, j)];
            self.rows.row_mut(i).unscale_mut(pivot);
            self.transform.row_mut(i).unscale_mut(pivot);
            let (row, of_transform) = (self.rows.row(i).into_owned(), self.transform.row(i).into_owned());
            for k in (0..self.rows.nrows()).filter(|k| *k != i) {
                let factor = self.rows[(k, j)];
                if factor != 0.0 {
                    self.rows.row_mut(k).zip_apply(&row, |x, y| *x -= factor * y);
                    self.transform.row_mut(k).zip_apply(&of_transform, |x, y| *x -= factor * y);
                    self.rows[(k, j)] = 0.0;
                }
            }
            self.pivots.push((i, j));
        }
    }

    /// The largest pivot that is left. Preferred columns are to stay independent, so one of them has a pivot
    /// only if no other column has.
    fn largest_pivot(
        &self,
        among: core::ops::Range<usize>,
        preferred: &[usize],
    ) -> Option<(usize, usize, f64)> {
        let mut best: [Option<(usize, usize, f64)>; 2] = [None; 2];
        for i in among.filter(|i| self.pivots.iter().all(|(row, _)| row != i)) {
            for j in (0..self.rows.ncols()).filter(|j| self.pivots.iter().all(|(_, column)| column != j)) {
                let size = (self.rows[(i, j)] * self.scale[j]).abs();
                let of_kind = &mut best[usize::from(preferred.contains(&j))];
                if size > RANK_TOLERANCE && of_kind.is_none_or(|(.., most)| size > most) {
                    *of_kind = Some((i, j, size));
                }
            }
        }
        best[0].or(best[1])
    }

    /// The columns without a pivot, those of `first` first, and for each the solution of the homogeneous rows
    /// in which it is 1 and the other ones are 0.
    fn null_space(&self, first: &[usize]) -> (Vec<usize>, DMatrix<f64>) {
        let n = self.rows.ncols();
        let is_free = |j: &usize| self.pivots.iter().all(|(_, column)| column != j);
        let requested = first.iter().copied().filter(is_free);
        let free: Vec<usize> =
            requested.chain((0..n).filter(is_free).filter(|j| !first.contains(j))).collect();
        let mut basis = DMatrix::zeros(n, free.len());
        for (k, j) in free.iter().enumerate() {
            basis[(*j, k)] = 1.0;
            for (row, column) in &self.pivots {
                basis[(*column, k)] = -self.rows[(*row, *j)];
            }
        }
        (free, basis)
    }
}

/// Distance of the positions nearby at which the rank is compared, relative to the scales of the coordinates.
/// A smaller distance leaves pivots there below the rank tolerance; with a larger one the projection may
/// fail.
const RANK_COMPARISON_DISTANCE: f64 = 1e-3;
/// Motion of the other independent coordinates, relative to the first: no symmetry of a model has this ratio.
const OFF_AXIS_SHARE: f64 = 0.31;
/// A position nearby counts if an independent coordinate moved at least this part of the distance. Otherwise
/// the projection fell back to the singular position.
const MIN_MOVED_SHARE: f64 = 0.1;
/// Most independent coordinates that are tried, each in both directions. Each costs two projections.
const MAX_RANK_DIRECTIONS: usize = 4;

/// Refuses positions in which rows become dependent that are independent nearby. Rows that are dependent
/// nearby, too, only repeat others.
pub(super) fn refuse_singular<M: Constraints>(
    model: &M,
    state: &M::State,
    tangent: &Tangent,
) -> Result<(), LinearizeError> {
    if tangent.rank == tangent.rows {
        return Ok(());
    }
    let constants = model.constants().map_err(dynamics_runtime::error::SolveError::from)?;
    let scales = scales(M::COORDINATES, state.q().as_slice());
    let mut any_position = tangent.coordinates.is_empty();
    let directions = 0..tangent.coordinates.len().min(MAX_RANK_DIRECTIONS);
    for (main, sign) in directions.flat_map(|main| [(main, 1.0), (main, -1.0)]) {
        // Mostly one independent coordinate, and a little of the others, so that no symmetry of the model
        // hides the difference.
        let size = |k: usize| RANK_COMPARISON_DISTANCE * scales[tangent.coordinates[k]];
        let step =
            |k: usize| sign * size(k) * if k == main { 1.0 } else { OFF_AXIS_SHARE / (1.0 + k as f64) };
        let weights = nalgebra::DVector::from_fn(tangent.coordinates.len(), |k, _| step(k));
        let change = &tangent.positions * weights;
        // If there is no other position on this side, the other side or the other coordinates decide.
        let Ok(nearby) = projected(model, &constants, displaced(state, &change)) else { continue };
        let moved = |k: usize| {
            let i = tangent.coordinates[k];
            (nearby.q().as_slice()[i] - state.q().as_slice()[i]).abs() / size(k)
        };
        if (0..tangent.coordinates.len()).map(moved).fold(0.0, f64::max) < MIN_MOVED_SHARE {
            continue;
        }
        any_position = true;
        let found = rank(model, &nearby);
        if found > tangent.rank {
            return Err(LinearizeError::SingularPosition { rank: tangent.rank, rank_nearby: Some(found) });
        }
    }
    if any_position {
        Ok(())
    } else {
        Err(LinearizeError::SingularPosition { rank: tangent.rank, rank_nearby: None })
    }
}

/// Number of independent active rows at a state.
fn rank<M: Constraints>(model: &M, state: &M::State) -> usize {
    let (n, r) = (M::Vector::LEN, M::Rows::LEN);
    let (mut mass, mut force) = (alloc::vec![0.0; n * n], alloc::vec![0.0; n]);
    let (mut jacobian, mut gamma) = (alloc::vec![0.0; r * n], alloc::vec![0.0; r]);
    let terms = &mut dynamics_runtime::model::Terms {
        mass: &mut mass,
        force: &mut force,
        jacobian: &mut jacobian,
        gamma: &mut gamma,
    };
    model.terms(state, terms);
    let rows = DMatrix::from_row_slice(r, n, &jacobian)
        .select_rows(&active_rows::<M>(state.active_set(), false).collect::<Vec<_>>());
    let count = rows.nrows();
    Tangent::new(&rows, count, &DMatrix::from_row_slice(n, n, &mass), [&[]; 2]).rank
}
