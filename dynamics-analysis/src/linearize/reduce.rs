//! Reduction by constraints: independent coordinates and velocities, and how the others follow from them.

use alloc::vec::Vec;

use dynamics_runtime::constrain::RANK_TOLERANCE;
use dynamics_runtime::constrain::active_rows;
use dynamics_runtime::constrain::{project_positions, with_workspace};
use dynamics_runtime::model::{Constraints, ModelState, Quantity, Vector};
use dynamics_view::suggest;
use nalgebra::DMatrix;

use super::LinearizeError;

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
        // Who says it twice means it once.
        if !found.contains(&index) {
            found.push(index);
        }
    }
    Ok(found)
}

/// The coordinates whose velocities do not change.
pub(super) fn staying<S: ModelState>(state: &S, accelerations: &nalgebra::DVector<f64>) -> Vec<usize> {
    let fastest = state.u().as_slice().iter().fold(1.0, |most: f64, u| most.max(u.abs()));
    (0..accelerations.len()).filter(|i| accelerations[*i].abs() <= 1e-8 * fastest).collect()
}

/// What each coordinate is measured by: the largest value of its unit, of an angle at least 1 rad; 1 where
/// all are 0.
pub(crate) fn scales(coordinates: &[Quantity], values: &[f64]) -> Vec<f64> {
    let of = |unit: &str| {
        let same = coordinates.iter().zip(values).filter(|(coordinate, _)| coordinate.unit == unit);
        let most = same.fold(0.0, |most: f64, (_, value)| most.max(value.abs()));
        if unit == "rad" || most < 1e-12 { most.max(1.0) } else { most }
    };
    coordinates.iter().map(|coordinate| of(coordinate.unit)).collect()
}

/// The directions that constraints leave.
pub(crate) struct Tangent {
    /// Independent coordinates, ascending but for those that were asked for, which come first.
    pub(crate) coordinates: Vec<usize>,
    /// Those whose velocities are independent.
    pub(crate) rates: Vec<usize>,
    /// D, N×C.
    pub(crate) positions: DMatrix<f64>,
    /// E, N×F.
    pub(crate) velocities: DMatrix<f64>,
    pub(crate) conditioning: f64,
    /// Independent rows.
    pub(crate) rank: usize,
    /// Rows that hold.
    rows: usize,
    /// (N×R) takes right-hand sides of all rows to the dependent coordinates.
    solver: DMatrix<f64>,
}

impl Tangent {
    /// Of rows, the first `holonomic` of them conditions on coordinates, too; `preferred` coordinates and
    /// velocities become independent where they can.
    pub(crate) fn new(
        rows: &DMatrix<f64>,
        holonomic: usize,
        mass: &DMatrix<f64>,
        preferred: [&[usize]; 2],
    ) -> Self {
        let n = mass.nrows();
        let mut elimination = Elimination::new(rows, mass);
        elimination.run(0..holonomic, preferred[0]);
        let (coordinates, positions) = elimination.free(preferred[0]);
        elimination.run(0..rows.nrows(), preferred[1]);
        let (rates, velocities) = elimination.free(&coordinates);
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

    /// How many rows hold.
    pub(crate) fn row_count(&self) -> usize {
        self.rows
    }

    /// What dependent coordinates do for the rows' right-hand sides −`left`, while the independent ones stand
    /// still.
    pub(crate) fn particular(&self, left: &DMatrix<f64>) -> DMatrix<f64> {
        -(&self.solver * left)
    }
}

/// Gauss–Jordan elimination with complete pivoting, rows and columns scaled: [rows | 1] → [.. 1 ..|
/// transform].
struct Elimination {
    rows: DMatrix<f64>,
    transform: DMatrix<f64>,
    /// Factors that free columns of units, for the choice of pivots alone.
    scale: Vec<f64>,
    /// Rows and columns eliminated.
    pivots: Vec<(usize, usize)>,
    /// Least and greatest pivot.
    sizes: [f64; 2],
}

impl Elimination {
    fn new(rows: &DMatrix<f64>, mass: &DMatrix<f64>) -> Self {
        let (r, n) = rows.shape();
        let largest = (0..n).map(|i| mass[(i, i)]).fold(0.0, f64::max);
        // A coordinate without inertia counts like one with little.
        let inertia = |i: usize| mass[(i, i)].max(1e-6 * largest).max(f64::MIN_POSITIVE);
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

    /// Eliminates with these rows, as long as there are pivots.
    fn run(&mut self, among: core::ops::Range<usize>, preferred: &[usize]) {
        while let Some((i, j, size)) = self.pivot(among.clone(), preferred) {
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

    /// The largest pivot that is left; one of a preferred column only where there is no other.
    fn pivot(&self, among: core::ops::Range<usize>, preferred: &[usize]) -> Option<(usize, usize, f64)> {
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

    /// Columns that are not eliminated, and what a unit of each does to all.
    fn free(&self, first: &[usize]) -> (Vec<usize>, DMatrix<f64>) {
        let n = self.rows.ncols();
        let is_free = |j: &usize| self.pivots.iter().all(|(_, column)| column != j);
        let asked = first.iter().copied().filter(is_free);
        let free: Vec<usize> = asked.chain((0..n).filter(is_free).filter(|j| !first.contains(j))).collect();
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

/// Refuses positions in which rows become dependent that are independent nearby.
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
    let mut any = tangent.coordinates.is_empty();
    for (way, sign) in (0..tangent.coordinates.len().min(4)).flat_map(|way| [(way, 1.0), (way, -1.0)]) {
        let mut beside = *state;
        // A step that no symmetry of the model hides: mostly one independent coordinate, a little of the
        // others.
        let size = |k: usize| 1e-3 * scales[tangent.coordinates[k]];
        let step = |k: usize| sign * size(k) * if k == way { 1.0 } else { 0.31 / (1.0 + k as f64) };
        let weights = nalgebra::DVector::from_fn(tangent.coordinates.len(), |k, _| step(k));
        let change = &tangent.positions * weights;
        for (q, d) in beside.q_mut().as_mut_slice().iter_mut().zip(change.iter()) {
            *q += d;
        }
        // Where there is no position nearby on this side, or none but this one, the other side, or the other
        // coordinates, tell.
        let found =
            with_workspace::<M, _>(|memory| project_positions(model, &constants, &mut beside, memory));
        let moved = |k: usize| {
            let i = tangent.coordinates[k];
            (beside.q().as_slice()[i] - state.q().as_slice()[i]).abs() / size(k)
        };
        if found.is_err() || (0..tangent.coordinates.len()).map(moved).fold(0.0, f64::max) < 0.1 {
            continue;
        }
        any = true;
        let found = rank(model, &beside);
        if found > tangent.rank {
            return Err(LinearizeError::SingularPosition { rank: tangent.rank, beside: Some(found) });
        }
    }
    if any { Ok(()) } else { Err(LinearizeError::SingularPosition { rank: tangent.rank, beside: None }) }
}

/// Independent rows at a state.
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
        .select_rows(&active_rows::<M>(state.modes(), false).collect::<Vec<_>>());
    let count = rows.nrows();
    Tangent::new(&rows, count, &DMatrix::from_row_slice(n, n, &mass), [&[]; 2]).rank
}
