//! Dense output that is as good as the ends of its steps.
//!
//! A step control bounds what the end of a step is off, and says nothing of the interpolant, which has other
//! stages, a lower order, and behind steps at the border of stability no damping. So the interpolant is held
//! against the equations of motion: a polynomial that is off by e changes by another rate than they say, by
//! e′ − J e, its defect. Where that is too large, the step is made again in parts, 2, 4, … of equal length,
//! each with dense output of its own, which is held against the equations likewise. What the last part misses
//! of the end of the step, part of its error, is spread over it. The ends of the steps stay as they are, and
//! so does the cost of runs that ask for nothing between them.
//!
//! * **Cost** of a step that is asked for: an evaluation for each place at which it is looked at, and where
//!   it is made again as much as that many steps with dense output.
//! * **Source**: defect control, W. H. Enright, *A new error-control for initial value solvers*, Appl. Math.
//!   Comput. 31 (1989) 288; Shampine, *Solving ODEs and DDEs with residual control*, Appl. Numer. Math. 52
//!   (2005) 113.

use alloc::vec::Vec;

use crate::integrate::dense::smoothly;
use crate::integrate::phase::zip;
use crate::integrate::stepper::{Step, Stepper};
use crate::integrate::{Dense, Phase, Scheme, StepNode, System, Tolerances};
use crate::model::Vector;

/// Error of an interpolant in parts of its defect times the step length: what those of Hermite, of DOP853 and
/// of Verner's method have at most, with the defect taken where it is large.
const OVER_DEFECT: f64 = 0.25;
/// Permitted errors that an interpolant may be off.
const PERMITTED: f64 = 1.0;
/// Most parts of a step. Where accelerations jump within it, more of them would only show the jump more
/// closely.
const MOST_STEP_PARTS: usize = 16;

/// A step that was made again in equal parts.
pub(crate) struct Parts<V, D> {
    parts: Vec<D>,
    /// What the end of the last one misses of the end of the step.
    miss: Phase<V>,
}

/// What the dense output of parts is off at most, in permitted errors, and the parts.
type Judged<V, D> = (f64, Parts<V, D>);

impl<V: Vector, D: Dense<V>> Dense<V> for Parts<V, D> {
    fn at(&self, theta: f64) -> Phase<V> {
        let along = theta * self.parts.len() as f64;
        // A negative number is none of them: the first one goes on to the left.
        let part = (along as usize).min(self.parts.len() - 1);
        let smoothly = smoothly(theta);
        zip(&self.parts[part].at(along - part as f64), &self.miss, |y, miss| y + smoothly * miss)
    }
}

impl<V: Vector, S: Scheme<V>> Stepper<V, S> {
    /// Dense output of a step in parts, where that of the whole step is off by more than is permitted and the
    /// parts are better.
    pub(crate) fn in_parts<Y: System<V>>(
        scheme: &mut S,
        system: &mut Y,
        step: &Step<V>,
        dense: &S::Dense,
        tolerances: &Tolerances,
    ) -> Option<Parts<V, S::Dense>> {
        let whole = off::<V, S, Y>(system, dense, (&step.start, &step.end.y, step.h), tolerances);
        if whole <= PERMITTED {
            return None;
        }
        let (mut least, mut best) = (whole, None);
        let mut count = 2;
        // Errors of smooth motions fall by this power of the number.
        while count < MOST_STEP_PARTS
            && crate::math::powi(count as f64, S::ERROR_ORDER as i32) < whole
            && whole.is_finite()
        {
            count *= 2;
        }
        while count <= MOST_STEP_PARTS {
            // Where a part cannot be made, finer ones are no better.
            let Ok(Some((off, parts))) = parts(scheme, system, step, count, tolerances) else { break };
            if off < least {
                (least, best) = (off, Some(parts));
            }
            if off <= PERMITTED {
                break;
            }
            count *= 2;
        }
        best
    }
}

/// What dense output is off, in permitted errors, as the equations of motion say; infinite where they say
/// nothing.
fn off<V: Vector, S: Scheme<V>, Y: System<V>>(
    system: &mut Y,
    dense: &S::Dense,
    (start, end, h): (&StepNode<V>, &Phase<V>, f64),
    tolerances: &Tolerances,
) -> f64 {
    let mut most = 0.0f64;
    for theta in S::PROBES {
        let Some(slope) = dense.slope(*theta) else { continue };
        let Ok(rate) = system.derivative(start.t + theta * h, &dense.at(*theta)) else {
            return f64::INFINITY;
        };
        let defect = zip(&slope, &rate, |slope, rate| slope - h * rate);
        let size = OVER_DEFECT * tolerances.norm(&defect, &start.y, end);
        // What is not a number is not small.
        most = if size.is_nan() { f64::INFINITY } else { most.max(size) };
    }
    most
}

/// A step in so many parts, and what their dense output is off at most; `None` where time does not resolve
/// them, or one of them is not finite.
#[inline(never)]
fn parts<V: Vector, S: Scheme<V>, Y: System<V>>(
    scheme: &mut S,
    system: &mut Y,
    step: &Step<V>,
    count: usize,
    tolerances: &Tolerances,
) -> Result<Option<Judged<V, S::Dense>>, Y::Error> {
    let (mut start, mut most, mut parts) = (step.start, 0.0f64, Vec::with_capacity(count));
    system.hold_stages(step.kept.stages, tolerances);
    system.hold_branches(&mut start, step.h, step.kept.branches)?;
    for part in 1..=count {
        let t = if part == count { step.end.t } else { step.start.t + step.h * (part as f64 / count as f64) };
        let h = t - start.t;
        if h == 0.0 {
            return Ok(None);
        }
        // What is tied to the size of the step is tied to that of the whole.
        system.attempting(&mut start, step.h)?;
        let (mut y, _) = Stepper::<V, S>::attempt_again(scheme, system, (&start, h), tolerances)?;
        let moved = if system.projects() { system.project(t, &mut y, tolerances)?.is_some() } else { false };
        let a = if moved { system.accelerations(t, &y.q, &y.u)? } else { scheme.finish(system, t, &y)? };
        let end = StepNode { t, y, a };
        if !(y.is_finite() && a.as_slice().iter().all(|a| a.is_finite())) {
            return Ok(None);
        }
        let dense = scheme.dense(system, &start, &end, h)?;
        most = most.max(off::<V, S, Y>(system, &dense, (&start, &y, h), tolerances));
        parts.push(dense);
        start = end;
    }
    let miss = zip(&step.end.y, &start.y, |y, found| y - found);
    Ok(Some((most, Parts { parts, miss })))
}
