//! The test function that is zero at a Hopf point, and where two frequencies meet.
//!
//! It is made of the eigenvalues σ of small motions that are nearest to those of the previous point,
//!
//! ```text
//! with damping:       Re σ = 0                                            a Hopf point
//! without any:        Re (σ₁ − σ₂)² = 0, which is −(ω₁ − ω₂)² before        where two frequencies meet
//! ```
//!
//! The second passes zero with a finite slope, but σ₁ − σ₂ itself begins as a square root
//! (A. P. Seyranian & A. A. Mailybaev, *Multiparameter Stability Theory with Mechanical Applications*,
//! chapters 2 and 4).

use alloc::vec::Vec;

use dynamics_runtime::model::Constraints;
use nalgebra::Complex;

use crate::linearize::{ModelDerivatives, Tangent, assemble, matrix_eigenvalues};

/// Eigenvalues farther from the frequency of the previous point than this share of it belong to other modes.
const EIGENVALUE_SEARCH_RADIUS: f64 = 0.5;

/// The eigenvalues whose test function vanishes on a curve of Hopf points.
#[derive(Clone, Copy, Debug)]
pub(super) struct HopfTest {
    /// The frequency at the previous point, in rad/s: eigenvalues near it are meant.
    pub(super) frequency: f64,
    /// Without damping two frequencies meet, with damping a real part vanishes.
    pub(super) undamped: bool,
}

impl HopfTest {
    /// The test function, in 1/s with damping and in 1/s² without.
    pub(super) fn test<M: Constraints>(&self, model: &M, state: &M::State) -> Option<f64> {
        let near = self.nearby_eigenvalues(model, state)?;
        match (self.undamped, &near[..]) {
            (false, [first, ..]) => Some(first.re),
            (true, [first, second, ..]) => Some(((first - second) * (first - second)).re),
            _ => None,
        }
    }

    /// The eigenvalues with positive imaginary part near the frequency, the nearest first.
    fn nearby_eigenvalues<M: Constraints>(&self, model: &M, state: &M::State) -> Option<Vec<Complex<f64>>> {
        let read = ModelDerivatives::of(model, state).ok()?;
        let tangent = Tangent::new(&read.jacobian, read.holonomic, &read.mass, [&[]; 2]);
        let all = matrix_eigenvalues(assemble::<M>(&read, &tangent).state_matrix().ok()?).ok()?;
        let to = Complex::new(0.0, self.frequency);
        let mut oscillating: Vec<_> = all
            .into_iter()
            .filter(|x| x.im > 0.0 && (x - to).norm() < EIGENVALUE_SEARCH_RADIUS * self.frequency)
            .collect();
        oscillating.sort_by(|a, b| (a - to).norm().total_cmp(&(b - to).norm()));
        Some(oscillating)
    }

    /// The frequency of these eigenvalues, in rad/s.
    pub(super) fn frequency<M: Constraints>(&self, model: &M, state: &M::State) -> Option<f64> {
        let near = self.nearby_eigenvalues(model, state)?;
        match (self.undamped, &near[..]) {
            (false, [first, ..]) => Some(first.im),
            (true, [first, second, ..]) => Some(0.5 * (first.im + second.im)),
            _ => None,
        }
    }
}
