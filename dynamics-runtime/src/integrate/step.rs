//! A step, its options and its errors.
//!
//! From the option `.tolerance(1e-9)` to the error norm of a step:
//!
//! 1. `Simulation::tolerance` (`simulate/simulation.rs`) keeps it for absolute and relative errors alike.
//!    `Simulation::check_steps` (`simulation/check.rs`) checks it and makes [`StepOptions`].
//! 2. `RunSetup::make_pilot_run` (`simulation/execution.rs`) lowers the absolute one for small motions.
//! 3. The stepper gives [`Tolerances`] to `Scheme::attempt`. The method estimates its error and calls
//!    `Tolerances::norm` or `square_sum` below. A norm of 1 is just permitted.
//! 4. `Stepper::judge` (`stepper.rs`) accepts or rejects the step by this norm.

use crate::integrate::phase::{Phase, StepNode};
use crate::math;
use crate::model::Vector;

/// How steps are chosen.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct StepOptions {
    /// Permitted local error.
    pub tolerances: Tolerances,
    /// Size of every step, for methods without error estimate or to switch step control off.
    pub fixed: Option<f64>,
    /// Size of the first step; chosen from the problem where absent.
    pub first: Option<f64>,
    /// Largest step.
    pub most: f64,
}

/// An accepted step.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Step<V> {
    /// Where it starts.
    pub start: StepNode<V>,
    /// Where it ends.
    pub end: StepNode<V>,
    /// Its size, with sign.
    pub h: f64,
    /// How its stages, its states and its branches were treated.
    pub flags: StepFlags,
}

/// How a step was made, besides the projection of its end: a repetition of the step needs the same.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct StepFlags {
    /// Its stages were projected: near a position where the constraints nearly lose rank.
    pub stages: bool,
    /// States between its ends have to be projected: they have an error that the projection of the end
    /// removed.
    pub between: bool,
    /// Branches of the accelerations were held in it: see
    /// [`Switching::hold_branches`](crate::integrate::Switching::hold_branches).
    pub branches: bool,
}

/// Why there is no next step. The stepper then stands at the last accepted state.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum StepError<E> {
    /// The accelerations could not be evaluated, however short the step.
    Evaluation(E),
    /// An acceleration became infinite or not a number, however short the step.
    NotFinite {
        /// Index of the coordinate whose acceleration it is.
        coordinate: usize,
        /// Size of the last attempt.
        h: f64,
    },
    /// The tolerance asks for steps below the resolution of time.
    StepTooSmall {
        /// Index of the coordinate whose error is the largest; 0 where no step was tried because none is
        /// resolved.
        coordinate: usize,
        /// Size of the last attempt.
        h: f64,
    },
    /// Projection would have displaced the end of a fixed step by a considerable part of its way: the
    /// constraints would decide the motion instead of the method.
    Displaced {
        /// Index of the coordinate with the largest displacement.
        coordinate: usize,
        /// Size of the step.
        h: f64,
    },
    /// The equations of an implicit method could not be solved, however short the step; with a fixed step, at
    /// that step.
    NotSolved {
        /// Index of the coordinate whose last correction was the largest.
        coordinate: usize,
        /// Size of the last attempt.
        h: f64,
    },
}

/// How large an error may be: absolute + relative·max(|y₀|, |y₁|) per element of q and of u.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Tolerances {
    /// In the unit of each coordinate and velocity.
    pub absolute: f64,
    /// Dimensionless.
    pub relative: f64,
}

impl Tolerances {
    /// Absolute and relative alike.
    #[must_use]
    pub const fn both(tolerance: f64) -> Self {
        Self { absolute: tolerance, relative: tolerance }
    }

    /// The permitted error of an element that goes from x to y.
    #[inline(always)]
    pub(crate) fn scale(&self, x: f64, y: f64) -> f64 {
        self.absolute + self.relative * x.abs().max(y.abs())
    }

    /// Σ (eᵢ/scaleᵢ)² over all elements of q and u.
    #[inline(always)]
    pub(crate) fn square_sum<V: Vector>(&self, error: &Phase<V>, from: &Phase<V>, to: &Phase<V>) -> f64 {
        let part = |e: &V, x: &V, y: &V| {
            let mut sum = 0.0;
            for i in 0..V::LEN {
                let r = e.as_slice()[i] / self.scale(x.as_slice()[i], y.as_slice()[i]);
                sum += r * r;
            }
            sum
        };
        part(&error.q, &from.q, &to.q) + part(&error.u, &from.u, &to.u)
    }

    /// √(Σ (eᵢ/scaleᵢ)² / 2N): 1 where the error is just permitted.
    #[inline(always)]
    pub(crate) fn norm<V: Vector>(&self, error: &Phase<V>, from: &Phase<V>, to: &Phase<V>) -> f64 {
        math::sqrt(self.square_sum(error, from, to) / (2 * V::LEN) as f64)
    }

    /// Index of the coordinate whose error, in q or u, is the largest against its scale.
    pub(crate) fn worst<V: Vector>(&self, error: &Phase<V>, from: &Phase<V>, to: &Phase<V>) -> usize {
        let mut worst = (0, -1.0);
        for i in 0..V::LEN {
            let of_q = (error.q[i] / self.scale(from.q[i], to.q[i])).abs();
            let of_u = (error.u[i] / self.scale(from.u[i], to.u[i])).abs();
            let size = of_q.max(of_u);
            if size > worst.1 {
                worst = (i, size);
            }
        }
        worst.0
    }
}
