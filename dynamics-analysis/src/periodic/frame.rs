//! Independent coordinates near a state: a closed motion must close in them, and its start is varied in them.

use alloc::vec::Vec;

use dynamics_runtime::model::{Constraints, ModelState, Quantity, Vector};
use nalgebra::{DMatrix, DVector};

use super::PeriodicError;
use super::flow::Flow;
use crate::displacement::moved_along;
use crate::linearize::{ModelDerivatives, Tangent, scales};

/// Largest size of a coordinate's motion, over all coordinates, at which a motion counts as at rest. The
/// usual scales of the coordinates are used then.
const REST_MOTION: f64 = 1e-9;
/// Least size of a coordinate's motion, relative to the largest of its unit. A smaller value makes rounding
/// of such a coordinate look large.
const MIN_RELATIVE_MOTION: f64 = 1e-3;

/// Independent coordinates and velocities at a state, with a basis of the tangent space of the constraints.
#[derive(Clone)]
pub(super) struct Frame {
    /// Independent coordinates and velocities among all.
    pub(super) coordinates: Vec<usize>,
    pub(super) rates: Vec<usize>,
    /// 2N×(C + F): the changes of all coordinates, and below of all velocities, if an independent coordinate
    /// or velocity changes by 1.
    pub(super) basis: DMatrix<f64>,
}

impl Frame {
    /// At a state. The independent coordinates are those of `like`, if it is given.
    pub(super) fn at<M: Constraints>(
        model: &M,
        state: &M::State,
        like: Option<&Self>,
    ) -> Result<Self, PeriodicError> {
        let n = M::Vector::LEN;
        if M::ROWS.is_empty() {
            let all: Vec<usize> = (0..n).collect();
            return Ok(Self { coordinates: all.clone(), rates: all, basis: DMatrix::identity(2 * n, 2 * n) });
        }
        let read = ModelDerivatives::of(model, state).map_err(PeriodicError::Derivatives)?;
        let preferred: [&[usize]; 2] = like.map_or([&[], &[]], |like| [&like.coordinates, &like.rates]);
        let tangent = Tangent::new(&read.jacobian, read.holonomic, &read.mass, preferred);
        let (c, f) = (tangent.coordinates.len(), tangent.rates.len());
        if c + f == 0 {
            return Err(PeriodicError::NoFreedom);
        }
        let mut basis = DMatrix::zeros(2 * n, c + f);
        basis.view_mut((0, 0), (n, c)).copy_from(&tangent.positions);
        basis
            .view_mut((n, 0), (n, c))
            .copy_from(&tangent.particular(&(&read.velocity_by * &tangent.positions)));
        basis.view_mut((n, c), (n, f)).copy_from(&tangent.velocities);
        Ok(Self { coordinates: tangent.coordinates, rates: tangent.rates, basis })
    }

    /// Number of independent coordinates and velocities.
    pub(super) fn len(&self) -> usize {
        self.coordinates.len() + self.rates.len()
    }

    /// The indices of the independent coordinates and velocities among the 2N rows.
    pub(super) fn rows(&self) -> Vec<usize> {
        let n = self.basis.nrows() / 2;
        self.coordinates.iter().copied().chain(self.rates.iter().map(|i| n + i)).collect()
    }

    /// The independent rows of vectors of length 2N.
    pub(super) fn read(&self, vectors: &DMatrix<f64>) -> DMatrix<f64> {
        vectors.select_rows(&self.rows())
    }

    /// The coordinates, then the rates of coordinates, by name.
    pub(super) fn names<M: Constraints>(&self) -> [Vec<Quantity>; 2] {
        [&self.coordinates, &self.rates].map(|indices| indices.iter().map(|i| M::COORDINATES[*i]).collect())
    }

    /// The coordinate of an independent direction, which may be its velocity.
    pub(super) fn name<M: Constraints>(&self, k: usize) -> &'static str {
        let c = self.coordinates.len();
        let i = if k < c { self.coordinates[k] } else { self.rates[k - c] };
        M::COORDINATES[i].name
    }

    /// A state moved along independent directions, then projected onto the constraints.
    pub(super) fn moved<M: Constraints>(
        &self,
        flow: &mut Flow<'_, M>,
        state: &M::State,
        by: &DVector<f64>,
    ) -> Result<M::State, PeriodicError> {
        let mut moved = moved_along(state, &(&self.basis * by), 1.0);
        if !M::ROWS.is_empty() {
            flow.project(&mut moved)?;
        }
        Ok(moved)
    }
}

/// q and q̇, one above the other.
pub(super) fn stacked<S: ModelState>(state: &S) -> DVector<f64> {
    let n = <S::Vector as Vector>::LEN;
    DVector::from_iterator(2 * n, state.q().as_slice().iter().chain(state.u().as_slice()).copied())
}

/// q̇ and q̈, one above the other: the direction of the motion.
pub(super) fn direction<M: Constraints>(
    flow: &mut Flow<'_, M>,
    state: &M::State,
) -> Result<DVector<f64>, PeriodicError> {
    let accelerations = flow.accelerations(state)?;
    let both = state.u().as_slice().iter().chain(accelerations.as_slice()).copied();
    Ok(DVector::from_iterator(2 * M::Vector::LEN, both))
}

/// The scales of coordinates and velocities along a motion, 2N. The scale of a coordinate is its reach from
/// the start, or its speed divided by 2π/period; that of its velocity is 2π/period times as large.
pub(super) fn sizes<M: Constraints>(passed: &[M::State], period: f64) -> DVector<f64> {
    let n = M::Vector::LEN;
    let mut reach = alloc::vec![0.0; n];
    let mut speed = alloc::vec![0.0; n];
    let first = passed.first().map(stacked);
    for state in passed {
        for i in 0..n {
            let from = first.as_ref().map_or(0.0, |first| first[i]);
            reach[i] = f64::max(reach[i], (state.q().as_slice()[i] - from).abs());
            speed[i] = f64::max(speed[i], state.u().as_slice()[i].abs());
        }
    }
    let rate = core::f64::consts::TAU / period;
    let by_speed: Vec<f64> = speed.iter().map(|speed| speed / rate).collect();
    let of_motion: Vec<f64> = reach.iter().zip(&by_speed).map(|(a, b)| a.max(*b)).collect();
    let largest = of_motion.iter().fold(0.0, |most: f64, x| most.max(*x));
    // A coordinate that hardly moves has a scale from the others of its unit; at rest the usual scales apply.
    let usual = scales(M::COORDINATES, &of_motion);
    let size = |i: usize| {
        if largest > REST_MOTION { of_motion[i].max(MIN_RELATIVE_MOTION * usual[i]) } else { usual[i] }
    };
    DVector::from_fn(2 * n, |k, _| if k < n { size(k) } else { size(k - n) * rate })
}
