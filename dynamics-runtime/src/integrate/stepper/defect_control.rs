//! Dense output that is as accurate as the ends of the steps, by defect control.
//!
//! Step control bounds the error at the end of a step. It says nothing of the interpolant, which has other
//! stages and a lower order, and which is not damped behind steps at the border of stability. So the
//! interpolant is inserted into the equations of motion: a polynomial with the error e leaves the defect
//! e′ − J e. Where the defect is too large, the step is made again in 2, 4, … parts of equal length, each
//! with dense output that is checked likewise. The last part misses the end of the step by a part of its
//! error; this difference is spread smoothly over the step. The ends of the steps stay as they are, and runs
//! that ask for no states between them cost nothing more.
//!
//! * **Cost** of a step that is asked for: one evaluation for each sample ([`Scheme::DEFECT_SAMPLES`]); where
//!   it is divided, the cost of as many steps with dense output.
//! * **Source**: defect control, W. H. Enright, *A new error-control for initial value solvers*, Appl. Math.
//!   Comput. 31 (1989) 288; Shampine, *Solving ODEs and DDEs with residual control*, Appl. Numer. Math. 52
//!   (2005) 113.

use alloc::vec::Vec;

use crate::integrate::dense::smootherstep;
use crate::integrate::phase::zip;
use crate::integrate::stepper::{Step, Stepper};
use crate::integrate::{Dense, Phase, Scheme, StepNode, System, Tolerances};
use crate::model::Vector;

/// Error of an interpolant as a part of its defect times the step length: the largest ratio of the
/// interpolants of Hermite, DOP853 and Verner, with the defect sampled where it is large.
const ERROR_PER_DEFECT: f64 = 0.25;
/// Largest error of an interpolant, in permitted errors of a step: no larger than that of the ends.
const MAX_INTERPOLATION_ERROR: f64 = 1.0;
/// Most parts of a step. Where accelerations jump within it, more parts would resolve the jump further, and
/// the error would not fall.
const MAX_STEP_PARTS: usize = 16;

/// The dense output of a step that was made again in equal parts.
pub(crate) struct SubdividedStep<V, D> {
    parts: Vec<D>,
    /// The end of the step less the end of the last part.
    end_error: Phase<V>,
}

/// The largest error of the parts in permitted errors, and the parts.
type JudgedSubdivision<V, D> = (f64, SubdividedStep<V, D>);

impl<V: Vector, D: Dense<V>> Dense<V> for SubdividedStep<V, D> {
    fn at(&self, theta: f64) -> Phase<V> {
        let along = theta * self.parts.len() as f64;
        // θ < 0 extrapolates the first part.
        let part = (along as usize).min(self.parts.len() - 1);
        let weight = smootherstep(theta);
        zip(&self.parts[part].at(along - part as f64), &self.end_error, |y, end_error| y + weight * end_error)
    }
}

impl<V: Vector, S: Scheme<V>> Stepper<V, S> {
    /// The dense output of a step in parts, where that of the whole step has a larger error than permitted
    /// and the parts have a smaller one.
    pub(crate) fn dense_in_parts<Y: System<V>>(
        scheme: &mut S,
        system: &mut Y,
        step: &Step<V>,
        dense: &S::Dense,
        tolerances: &Tolerances,
    ) -> Option<SubdividedStep<V, S::Dense>> {
        let whole =
            interpolation_error::<V, S, Y>(system, dense, (&step.start, &step.end.y, step.h), tolerances);
        if whole <= MAX_INTERPOLATION_ERROR {
            return None;
        }
        let (mut least, mut best) = (whole, None);
        let mut count = 2;
        // Errors of smooth motions fall with this power of the number of parts: numbers that cannot be enough
        // are left out.
        while count < MAX_STEP_PARTS
            && crate::math::powi(count as f64, S::ERROR_ORDER as i32) < whole
            && whole.is_finite()
        {
            count *= 2;
        }
        while count <= MAX_STEP_PARTS {
            // Where a part cannot be made, finer ones cannot either.
            let Ok(Some((error, parts))) = subdivide(scheme, system, step, count, tolerances) else { break };
            if error < least {
                (least, best) = (error, Some(parts));
            }
            if error <= MAX_INTERPOLATION_ERROR {
                break;
            }
            count *= 2;
        }
        best
    }
}

/// The error of dense output from its defect, in permitted errors; infinite where the accelerations do not
/// exist.
fn interpolation_error<V: Vector, S: Scheme<V>, Y: System<V>>(
    system: &mut Y,
    dense: &S::Dense,
    (start, end, h): (&StepNode<V>, &Phase<V>, f64),
    tolerances: &Tolerances,
) -> f64 {
    let mut most = 0.0f64;
    for theta in S::DEFECT_SAMPLES {
        let Some(slope) = dense.slope(*theta) else { continue };
        let Ok(rate) = system.derivative(start.t + theta * h, &dense.at(*theta)) else {
            return f64::INFINITY;
        };
        let defect = zip(&slope, &rate, |slope, rate| slope - h * rate);
        let size = ERROR_PER_DEFECT * tolerances.norm(&defect, &start.y, end);
        // `max` would drop NaN.
        most = if size.is_nan() { f64::INFINITY } else { most.max(size) };
    }
    most
}

/// A step in `count` parts, and the largest error of their dense output; `None` where time does not resolve
/// them, or one of them is not finite.
#[inline(never)]
fn subdivide<V: Vector, S: Scheme<V>, Y: System<V>>(
    scheme: &mut S,
    system: &mut Y,
    step: &Step<V>,
    count: usize,
    tolerances: &Tolerances,
) -> Result<Option<JudgedSubdivision<V, S::Dense>>, Y::Error> {
    let (mut start, mut most, mut parts) = (step.start, 0.0f64, Vec::with_capacity(count));
    system.project_stages(step.flags.stages, tolerances);
    system.hold_branches(&mut start, step.h, step.flags.branches)?;
    for part in 1..=count {
        let t = if part == count { step.end.t } else { step.start.t + step.h * (part as f64 / count as f64) };
        let h = t - start.t;
        if h == 0.0 {
            return Ok(None);
        }
        // Gains that follow the step size follow that of the whole step.
        system.begin_attempt(&mut start, step.h)?;
        let (mut y, _) = Stepper::<V, S>::replay_attempt(scheme, system, (&start, h), tolerances)?;
        let moved =
            if system.needs_projection() { system.project(t, &mut y, tolerances)?.is_some() } else { false };
        let a = if moved { system.accelerations(t, &y.q, &y.u)? } else { scheme.finish(system, t, &y)? };
        let end = StepNode { t, y, a };
        if !(y.is_finite() && a.as_slice().iter().all(|a| a.is_finite())) {
            return Ok(None);
        }
        let dense = scheme.dense(system, &start, &end, h)?;
        most = most.max(interpolation_error::<V, S, Y>(system, &dense, (&start, &y, h), tolerances));
        parts.push(dense);
        start = end;
    }
    let end_error = zip(&step.end.y, &start.y, |y, found| y - found);
    Ok(Some((most, SubdividedStep { parts, end_error })))
}
