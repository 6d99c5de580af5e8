//! Independent coordinates near a state: a closed motion must close in them, and its start is varied in them.

use alloc::vec::Vec;

use dynamics_runtime::model::{Constraints, ModelState, Quantity, Vector};
use nalgebra::{DMatrix, DVector};

use super::PeriodicError;
use super::flow::Flow;
use crate::linearize::{ModelDerivatives, Tangent, scales};

/// The tangent space of what the constraints leave at a state.
#[derive(Clone)]
pub(super) struct Frame {
    /// Independent coordinates and velocities among all.
    pub(super) coordinates: Vec<usize>,
    pub(super) rates: Vec<usize>,
    /// 2N×(C + F): what all coordinates, and below all velocities, do where an independent coordinate or
    /// velocity moves by 1.
    pub(super) basis: DMatrix<f64>,
}

impl Frame {
    /// At a state; in the independent coordinates of another where that is asked for.
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

    pub(super) fn len(&self) -> usize {
        self.coordinates.len() + self.rates.len()
    }

    /// The independent ones among 2N rows: coordinates, then velocities.
    pub(super) fn rows(&self) -> Vec<usize> {
        let n = self.basis.nrows() / 2;
        self.coordinates.iter().copied().chain(self.rates.iter().map(|i| n + i)).collect()
    }

    /// The independent ones of a vector, or of vectors, of 2N.
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

    /// A state moved along independent directions, and put back onto the constraints.
    pub(super) fn moved<M: Constraints>(
        &self,
        flow: &mut Flow<'_, M>,
        state: &M::State,
        by: &DVector<f64>,
    ) -> Result<M::State, PeriodicError> {
        let n = M::Vector::LEN;
        let change = &self.basis * by;
        let mut moved = *state;
        moved.q_mut().as_mut_slice().iter_mut().zip(change.rows(0, n).iter()).for_each(|(q, d)| *q += d);
        moved.u_mut().as_mut_slice().iter_mut().zip(change.rows(n, n).iter()).for_each(|(u, d)| *u += d);
        if !M::ROWS.is_empty() {
            flow.place(&mut moved)?;
        }
        Ok(moved)
    }
}

/// q and q̇, one above the other.
pub(super) fn stacked<S: ModelState>(state: &S) -> DVector<f64> {
    let n = <S::Vector as Vector>::LEN;
    DVector::from_iterator(2 * n, state.q().as_slice().iter().chain(state.u().as_slice()).copied())
}

/// q̇ and q̈, one above the other: where the motion goes.
pub(super) fn direction<M: Constraints>(
    flow: &mut Flow<'_, M>,
    state: &M::State,
) -> Result<DVector<f64>, PeriodicError> {
    let accelerations = flow.accelerations(state)?;
    let both = state.u().as_slice().iter().chain(accelerations.as_slice()).copied();
    Ok(DVector::from_iterator(2 * M::Vector::LEN, both))
}

/// What coordinates and, for a period, velocities are measured by along a motion: 2N of them.
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
    // What hardly moves is measured as others of its unit, and at rest by what coordinates are measured by
    // anyway.
    let usual = scales(M::COORDINATES, &of_motion);
    let size = |i: usize| if largest > 1e-9 { of_motion[i].max(1e-3 * usual[i]) } else { usual[i] };
    DVector::from_fn(2 * n, |k, _| if k < n { size(k) } else { size(k - n) * rate })
}
