//! Störmer–Verlet (leapfrog, velocity Verlet) and its compositions of order 4, 6 and 8.
//!
//! * **Problem**: q̈ = a(t, q), forces without velocities; fixed step.
//! * **Formula**: kick u += h/2 a, drift q += h u, kick u += h/2 a. Compositions make 5, 9 or 17 such steps
//!   of γᵢ h. Kicks that follow one another are one. A drift and the kick behind it are one pass over memory
//!   where the forces of a node depend on nodes nearby.
//! * **Order** 2, 4, 6, 8; symplectic and reversible.
//! * **Stability**: oscillations to hω = 2; 2.7, 2.5 and 3.1 for the compositions.
//! * **Between steps** the velocities are half a kick ahead; states that are asked for get their own kick, so
//!   that asking changes no bit of the motion.
//! * **Source**: Hairer, Lubich, Wanner, *Geometric Numerical Integration*, 2nd ed., §I.1, §V.3.2;
//!   coefficients are those of the ordinary runtime.

use dynamics_runtime::integrate::tables;

use crate::equations::Equations;
use crate::failure::FamilyErrorKind;
use crate::integrate::{FixedStep, Point};
use crate::methods::FamilyMethod;
use crate::model::FamilyModel;

/// The shares γᵢ of a step.
#[derive(Clone, Debug)]
pub(crate) struct Splitting {
    shares: Vec<f64>,
    /// Where every field ends.
    ends: Vec<usize>,
}

impl Splitting {
    /// The method, which has to be one of this file.
    pub(crate) fn new(method: FamilyMethod, ends: &[usize]) -> Self {
        let half = match method {
            FamilyMethod::Composition4 => tables::composition(5),
            FamilyMethod::Composition6 => tables::composition(9),
            FamilyMethod::Composition8 => tables::composition(17),
            _ => &[1.0],
        };
        let mirrored = half.iter().rev().skip(1);
        Self { shares: half.iter().chain(mirrored).copied().collect(), ends: ends.to_vec() }
    }
}

impl<M: FamilyModel> FixedStep<M> for Splitting {
    fn begin(
        &mut self,
        equations: &mut Equations<'_, '_, M>,
        y: &mut Point,
        h: f64,
    ) -> Result<(), FamilyErrorKind> {
        equations.kick(y.t, &y.q, 0.5 * self.shares[0] * h, &mut y.u)
    }

    fn advance(
        &mut self,
        equations: &mut Equations<'_, '_, M>,
        y: &mut Point,
        h: f64,
        next: f64,
    ) -> Result<(), FamilyErrorKind> {
        let mut done = 0.0;
        for (i, &share) in self.shares.iter().enumerate() {
            let drift = share * h;
            done += share;
            let after = self.shares.get(i + 1).map_or(self.shares[0] * next, |share| share * h);
            // The last stage lies at the end of the step, whatever the shares sum up to by rounding.
            let t = y.t + if i + 1 == self.shares.len() { h } else { done * h };
            let both = [drift, 0.5 * (drift + after)];
            equations.drift_and_kick(t, &mut y.q, &mut y.u, &self.ends, both)?;
        }
        Ok(())
    }

    fn state(
        &mut self,
        equations: &mut Equations<'_, '_, M>,
        y: &Point,
        next: f64,
        into: &mut Point,
    ) -> Result<(), FamilyErrorKind> {
        into.copy_from(y);
        if next != 0.0 {
            equations.kick(y.t, &y.q, -0.5 * self.shares[0] * next, &mut into.u)?;
        }
        Ok(())
    }

    fn keeps_state(&self) -> bool {
        false
    }

    fn bytes(&self) -> usize {
        0
    }
}
