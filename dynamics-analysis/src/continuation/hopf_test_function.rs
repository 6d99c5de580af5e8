//! The test function that is zero at a Hopf point, and where two frequencies meet.
//!
//! It is made of the eigenvalues σ of small motions that are nearest to those of the previous point,
//!
//! ```text
//! with damping:       Re σ = 0                                            a Hopf point
//! without any:        Re (σ₁ − σ₂)² = 0, which is −(ω₁ − ω₂)² before        where two frequencies meet
//! ```
//!
//! The second passes zero with a finite slope, but σ₁ − σ₂ itself begins as a square root (A. P. Seyranian &
//! A. A. Mailybaev, *Multiparameter Stability Theory with Mechanical Applications*, chapters 2 and 4).

use alloc::vec::Vec;

use dynamics_runtime::model::Constraints;
use nalgebra::Complex;

use crate::linearize::{ModelDerivatives, Tangent, assemble, matrix_eigenvalues};

/// A pair next to another one may be so far from it, as a part of its frequency.
const NEXT: f64 = 0.5;

/// Which eigenvalues are asked for, and what of them.
#[derive(Clone, Copy, Debug)]
pub(super) struct Swings {
    /// The frequency nearby.
    pub(super) frequency: f64,
    /// Whether two frequencies meet: without damping.
    pub(super) meet: bool,
}

impl Swings {
    /// What vanishes on the curve, in 1/s or 1/s².
    pub(super) fn test<M: Constraints>(&self, model: &M, state: &M::State) -> Option<f64> {
        let near = self.near(model, state)?;
        match (self.meet, &near[..]) {
            (false, [first, ..]) => Some(first.re),
            (true, [first, second, ..]) => Some(((first - second) * (first - second)).re),
            _ => None,
        }
    }

    /// The eigenvalues that swing, nearest to the frequency first.
    fn near<M: Constraints>(&self, model: &M, state: &M::State) -> Option<Vec<Complex<f64>>> {
        let read = ModelDerivatives::of(model, state).ok()?;
        let tangent = Tangent::new(&read.jacobian, read.holonomic, &read.mass, [&[]; 2]);
        let all = matrix_eigenvalues(assemble::<M>(&read, &tangent).state_matrix().ok()?).ok()?;
        let to = Complex::new(0.0, self.frequency);
        let mut swing: Vec<_> =
            all.into_iter().filter(|x| x.im > 0.0 && (x - to).norm() < NEXT * self.frequency).collect();
        swing.sort_by(|a, b| (a - to).norm().total_cmp(&(b - to).norm()));
        Some(swing)
    }

    /// The frequency at a place.
    pub(super) fn frequency<M: Constraints>(&self, model: &M, state: &M::State) -> Option<f64> {
        let near = self.near(model, state)?;
        match (self.meet, &near[..]) {
            (false, [first, ..]) => Some(first.im),
            (true, [first, second, ..]) => Some(0.5 * (first.im + second.im)),
            _ => None,
        }
    }
}
