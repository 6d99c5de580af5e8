//! The loop over steps: limits, frames, and values that are not finite.
//!
//! Looking at all values after every step would take a tenth of its time. They are looked at after every
//! [`LOOK`] steps and before every frame. Where one is not finite, the run goes back to the last state that
//! was looked at, and repeats the steps one by one up to the last good state.

use core::sync::atomic::{AtomicBool, Ordering};
use std::sync::Arc;
use std::time::Instant;

use dynamics_runtime::integrate::{Controller, Tolerances};

use crate::equations::Equations;
use crate::error::FamilyError;
use crate::failure::FamilyErrorKind;
use crate::integrate::embedded::ErrorNorm;
use crate::integrate::explicit::{Stages, Tableau};
use crate::integrate::hermite::quintic;
use crate::integrate::implicit::Implicit;
use crate::integrate::splitting::Splitting;
use crate::integrate::{FixedStep, Point};
use crate::mass::{Mass, coordinate_name};
use crate::methods::FamilyMethod;
use crate::model::{FamilyModel, FamilyState, Sizes, View};
use crate::record::{Record, Recorder};

/// Steps between two looks at all values.
const LOOK: u64 = 32;
/// The first adaptive step, in parts of the longest step of leapfrog: a fortieth of the shortest period.
const FIRST_STEP_SHARE: f64 = 0.1;
/// The first adaptive step where no such bound is known, in parts of the run.
const FIRST_STEP_OF_RUN: f64 = 1e-6;
/// Factor of an adaptive step after an attempt with values that are not finite.
const SHORTER: f64 = 0.25;
/// Rounding of times, in parts of a step or an interval.
const TIME_ROUNDING: f64 = 1e-9;
/// Steps are at the stability bound where their mean is above this part of the method's border.
pub(crate) const AT_BOUND: f64 = 0.7;

/// The options of a run, checked.
pub(crate) struct Plan<'m> {
    pub(crate) end: f64,
    pub(crate) method: FamilyMethod,
    pub(crate) reason: String,
    pub(crate) tolerances: Tolerances,
    pub(crate) scaled: bool,
    pub(crate) fixed: Option<f64>,
    pub(crate) first: Option<f64>,
    pub(crate) most: f64,
    pub(crate) max_steps: u64,
    pub(crate) cancel: Option<&'m AtomicBool>,
    pub(crate) longest: Option<f64>,
    pub(crate) begun: Instant,
}

/// Why a run ends before its time, and the step that was tried.
struct Failure {
    kind: FamilyErrorKind,
    step: f64,
}

impl From<FamilyErrorKind> for Failure {
    fn from(kind: FamilyErrorKind) -> Self {
        Self { kind, step: 0.0 }
    }
}

/// A run.
pub(crate) struct Run<'r, 'm, M: FamilyModel> {
    equations: Equations<'r, 'm, M>,
    recorder: Recorder<M>,
    plan: Plan<'m>,
    ends: Sizes,
    start: M::State,
    y: Point,
    steps: u64,
    rejected: u64,
    sizes: Option<[f64; 2]>,
    bytes: usize,
}

impl<'r, 'm, M: FamilyModel> Run<'r, 'm, M> {
    pub(crate) fn new(
        equations: Equations<'r, 'm, M>,
        recorder: Recorder<M>,
        plan: Plan<'m>,
        start: &M::State,
    ) -> Self {
        let y = Point { t: start.t(), q: start.q().to_vec(), u: start.u().to_vec() };
        Self {
            equations,
            recorder,
            plan,
            ends: start.ends().clone(),
            start: start.clone(),
            y,
            steps: 0,
            rejected: 0,
            sizes: None,
            bytes: 0,
        }
    }

    /// Runs to the end.
    pub(crate) fn go(mut self, mass: &Arc<Mass>) -> Result<Record<M>, FamilyError<M>> {
        let outcome = self.steps_and_frames();
        // The end is a frame, also that of a run that failed.
        let is_frame = self.recorder.frames.last().is_some_and(|frame| frame.t == self.y.t);
        let step = Some(self.steps);
        let recorded = match is_frame {
            true => Ok(()),
            false => self.recorder.push(&mut self.equations, &self.y, step, false),
        };
        let flushed = self.recorder.flush();
        let record = self.record(mass);
        let time = record.end.t();
        let outcome = outcome.and(recorded.map_err(Failure::from)).and(flushed.map_err(Failure::from));
        match outcome {
            Ok(()) => Ok(record),
            Err(Failure { kind, step }) => {
                Err(FamilyError { kind, time, step, record: Some(Arc::new(record)) })
            }
        }
    }

    fn steps_and_frames(&mut self) -> Result<(), Failure> {
        self.recorder.push(&mut self.equations, &self.y, Some(0), true)?;
        if self.plan.end == self.y.t {
            return Ok(());
        }
        let (method, n) = (self.plan.method, self.y.q.len());
        match self.plan.fixed {
            Some(h) if method.is_implicit() => {
                let model = self.equations.model;
                let mut scheme = Implicit::new(method, model, &self.y, &self.equations.inputs, &self.ends)?;
                self.fixed(h, &mut scheme)
            }
            Some(h) if method.is_splitting() => {
                self.fixed(h, &mut Splitting::new(method, &self.ends.clone()))
            }
            Some(h) => self.fixed(h, &mut Stages::new(Tableau::new(method).0, n)),
            None => self.adaptive(),
        }
    }

    fn record(mut self, mass: &Arc<Mass>) -> Record<M> {
        let constraints = self.equations.constraint_summary(self.y.t, &self.y.q, &self.y.u);
        let end = self.recorder.last().clone();
        Record {
            start: self.start,
            end,
            mass: Arc::clone(mass),
            constraints,
            method: self.plan.method,
            reason: self.plan.reason,
            energy: self.recorder.energy,
            fixed: self.plan.fixed,
            step_sizes: self.sizes,
            steps: self.steps,
            rejected: self.rejected,
            evaluations: self.equations.evaluations,
            wall_time: self.plan.begun.elapsed(),
            bytes: self.bytes
                + mass.bytes()
                + self.equations.rows.as_ref().map_or(0, |rows| rows.bytes())
                + 32 * self.y.q.len(),
            longest: self.plan.longest,
            frames: self.recorder.frames,
        }
    }

    fn check_limits(&self) -> Result<(), FamilyErrorKind> {
        if self.plan.cancel.is_some_and(|flag| flag.load(Ordering::Relaxed)) {
            return Err(FamilyErrorKind::Cancelled);
        }
        if self.steps + self.rejected >= self.plan.max_steps {
            let mean = (self.y.t - self.start.t()).abs() / self.steps.max(1) as f64;
            let border = self.plan.method.stability_border() * 0.5;
            let at_bound = |longest: &f64| self.plan.fixed.is_none() && mean > AT_BOUND * border * longest;
            let longest = self.plan.longest.filter(at_bound);
            return Err(FamilyErrorKind::TooManySteps { limit: self.plan.max_steps, longest });
        }
        Ok(())
    }

    fn count(&mut self, h: f64) {
        self.steps += 1;
        let [least, most] = self.sizes.unwrap_or([h.abs(); 2]);
        self.sizes = Some([least.min(h.abs()), most.max(h.abs())]);
    }

    fn not_finite(&self, unknown: usize) -> FamilyErrorKind {
        FamilyErrorKind::AccelerationNotFinite { coordinate: coordinate_name::<M>(&self.ends, unknown) }
    }

    /// Steps of one size.
    fn fixed(&mut self, size: f64, scheme: &mut dyn FixedStep<M>) -> Result<(), Failure> {
        let steps = FixedSteps::new(self.y.t, self.plan.end, size);
        let mut between = Between::new(self.y.q.len());
        // The last values that were looked at, as the method keeps them.
        let (mut safe, mut safe_step) = (self.y.clone(), 0);
        let mut one_by_one_until = 0;
        self.bytes += scheme.bytes() + between.bytes() + 16 * safe.q.len();
        scheme.begin(&mut self.equations, &mut self.y, steps.size(1))?;
        safe.copy_from(&self.y);
        while self.steps < steps.count {
            let k = self.steps + 1;
            let (h, next) = (steps.size(k), steps.size(k + 1));
            if let Err(kind) = self.check_limits() {
                self.back_to(&self.y.clone(), scheme, h)?;
                return Err(kind.into());
            }
            let (begin, end) = (self.y.t, steps.time(k));
            let frame = self.recorder.next_time();
            let frame_at_end = frame.is_some_and(|t| (t - end).abs() <= TIME_ROUNDING * h.abs());
            let frame_inside = !frame_at_end && frame.is_some_and(|t| (t - end) * h < 0.0);
            if frame_inside {
                scheme.state(&mut self.equations, &self.y, h, &mut between.start)?;
            }
            if let Err(kind) = scheme.advance(&mut self.equations, &mut self.y, h, next) {
                if !scheme.keeps_state() {
                    self.back_to(&safe, scheme, steps.size(safe_step + 1))?;
                    self.steps = safe_step;
                }
                return Err(Failure { kind, step: h });
            }
            self.y.t = end;
            let by_step = self.recorder.wants_step(k);
            let looks = frame_inside || frame_at_end || by_step || k.is_multiple_of(LOOK) || k == steps.count;
            if looks || k <= one_by_one_until {
                if let Some(unknown) = self.y.not_finite() {
                    if safe_step + 1 == k {
                        self.back_to(&safe, scheme, h)?;
                        return Err(Failure { kind: self.not_finite(unknown), step: h });
                    }
                    one_by_one_until = k;
                    self.y.copy_from(&safe);
                    self.steps = safe_step;
                    scheme.restart();
                    continue;
                }
                if frame_inside {
                    scheme.state(&mut self.equations, &self.y, next, &mut between.end)?;
                    self.frames_inside(&mut between, begin, h)?;
                }
                if frame_at_end || by_step {
                    scheme.state(&mut self.equations, &self.y, next, &mut between.end)?;
                    self.recorder.push(&mut self.equations, &between.end, Some(k), frame_at_end)?;
                }
                safe.copy_from(&self.y);
                safe_step = k;
            }
            self.count(h);
        }
        Ok(())
    }

    /// Makes what the method keeps the state of the run.
    fn back_to(
        &mut self,
        kept: &Point,
        scheme: &mut dyn FixedStep<M>,
        next: f64,
    ) -> Result<(), FamilyErrorKind> {
        scheme.state(&mut self.equations, kept, next, &mut self.y)
    }

    /// The frames between both ends of a step.
    fn frames_inside(&mut self, between: &mut Between, begin: f64, h: f64) -> Result<(), FamilyErrorKind> {
        between.start.t = begin;
        between.end.t = begin + h;
        for (point, a) in [(&between.start, &mut between.a0), (&between.end, &mut between.a1)] {
            self.equations.accelerations(point.t, &point.q, &point.u, a)?;
        }
        let Point { t, q, u } = &between.end;
        let at = View { t: *t, q, u, inputs: &self.equations.inputs };
        self.recorder.energy.see(self.equations.model.energies(at));
        while let Some(t) = self.recorder.next_time() {
            if (t - between.end.t) * h.signum() > -TIME_ROUNDING * h.abs() {
                break;
            }
            between.interpolate(t, h);
            self.recorder.push(&mut self.equations, &between.middle, None, true)?;
        }
        Ok(())
    }

    /// Steps by the error estimate.
    fn adaptive(&mut self) -> Result<(), Failure> {
        let (tableau, table) = Tableau::new(self.plan.method);
        let Some(table) = table else {
            return Err(FamilyErrorKind::NeedsFixedStep { method: self.plan.method }.into());
        };
        let mut stages = Stages::new(tableau, self.y.q.len());
        let mut norm = ErrorNorm::new(
            self.plan.tolerances,
            self.plan.scaled,
            &self.ends,
            M::FIELDS.iter().map(|field| field.unit),
        );
        let mut controller = Controller::new(table.control, table.error_order);
        self.bytes += stages.bytes();
        norm.see(&self.y);
        stages.start(&mut self.equations, &self.y)?;
        if let Some(longest) = self.plan.longest.filter(|longest| longest.is_finite()) {
            norm.see_growth(&self.y.u, &stages.k[0], longest);
        }
        let direction = (self.plan.end - self.y.t).signum();
        let mut h = self.first_step();
        // The rounding of the time, which is a long sum.
        let mut lost = 0.0;
        while self.y.t != self.plan.end {
            self.check_limits()?;
            let frame = self.recorder.next_time();
            let target = frame.unwrap_or(self.plan.end);
            let left = (target - self.y.t).abs();
            let clipped = clip(h, left);
            let signed = clipped * direction;
            let resolution = 4.0 * f64::EPSILON * self.y.t.abs().max(f64::MIN_POSITIVE);
            // Off the constraints, and where rows have no value, a shorter step may do.
            let attempted = stages.attempt(&mut self.equations, &self.y, signed);
            let attempted = match attempted {
                Err(kind) if !kind.is_of_constraints() => return Err(kind.into()),
                other => other,
            };
            let error = norm.of(&stages, &self.y, signed);
            if attempted.is_err() || error.is_nan() || stages.end.not_finite().is_some() {
                self.rejected += 1;
                controller.failed();
                h = clipped * SHORTER;
                if h <= resolution || h < 1e-30 * left {
                    attempted.map_err(|kind| Failure { kind, step: signed })?;
                    let bad = |k: &Vec<f64>| k.iter().position(|a| !a.is_finite());
                    let unknown = stages.k.iter().find_map(bad).or_else(|| stages.end.not_finite());
                    return Err(Failure { kind: self.not_finite(unknown.unwrap_or(0)), step: signed });
                }
                continue;
            }
            let (accepted, factor) = controller.judge(error);
            if !accepted {
                self.rejected += 1;
                h = clipped * factor;
                if h <= resolution {
                    let worst = norm.worst(&stages, &self.y, signed);
                    let coordinate = coordinate_name::<M>(&self.ends, worst);
                    return Err(Failure {
                        kind: FamilyErrorKind::StepSizeTooSmall { coordinate },
                        step: signed,
                    });
                }
                continue;
            }
            stages.accept(&mut self.y);
            norm.see(&self.y);
            if clipped == left {
                (self.y.t, lost) = (target, 0.0);
            } else {
                let step = signed - lost;
                let t = self.y.t + step;
                (self.y.t, lost) = (t, (t - self.y.t) - step);
            }
            self.count(signed);
            // A step that was cut short at a frame says little about the next.
            let proposed = clipped * factor;
            h = if clipped < h { proposed.max(h) } else { proposed }.min(self.plan.most);
            let by_time = frame.is_some() && clipped == left;
            if by_time || self.recorder.wants_step(self.steps) {
                self.recorder.push(&mut self.equations, &self.y, Some(self.steps), by_time)?;
            }
        }
        Ok(())
    }

    /// The size of the first adaptive step.
    fn first_step(&self) -> f64 {
        let span = (self.plan.end - self.y.t).abs();
        let by_waves = self.plan.longest.filter(|longest| longest.is_finite());
        let by_waves = by_waves.map_or(FIRST_STEP_OF_RUN * span, |longest| FIRST_STEP_SHARE * longest);
        self.plan.first.unwrap_or(by_waves).min(span).min(self.plan.most)
    }
}

/// A step no longer than what is left; of two last steps neither is short.
fn clip(h: f64, left: f64) -> f64 {
    if h >= left * (1.0 - TIME_ROUNDING) {
        left
    } else if h > 0.5 * left {
        0.5 * left
    } else {
        h
    }
}

/// Steps of one size from start to end, the last one shorter.
struct FixedSteps {
    start: f64,
    end: f64,
    h: f64,
    last: f64,
    count: u64,
}

impl FixedSteps {
    fn new(start: f64, end: f64, size: f64) -> Self {
        let span = end - start;
        let count = ((span.abs() / size) - TIME_ROUNDING).ceil().max(1.0);
        let last = span.abs() - (count - 1.0) * size;
        // Steps that fill the time are all alike: times are multiples and have no error that grows.
        let last = if (last - size).abs() <= 1e-6 * size { size } else { last };
        let direction = span.signum();
        Self { start, end, h: direction * size, last: direction * last, count: count as u64 }
    }

    /// The size of step k, from 1 on; 0 behind the last.
    fn size(&self, k: u64) -> f64 {
        match k.cmp(&self.count) {
            core::cmp::Ordering::Less => self.h,
            core::cmp::Ordering::Equal => self.last,
            core::cmp::Ordering::Greater => 0.0,
        }
    }

    /// The end of step k.
    fn time(&self, k: u64) -> f64 {
        if k == self.count { self.end } else { self.start + k as f64 * self.h }
    }
}

/// Both ends of a step, and a state between them: the quintic through q, q̇ and q̈ of both.
struct Between {
    start: Point,
    end: Point,
    middle: Point,
    a0: Vec<f64>,
    a1: Vec<f64>,
}

impl Between {
    fn new(n: usize) -> Self {
        let point = || Point { t: 0.0, q: vec![0.0; n], u: vec![0.0; n] };
        Self { start: point(), end: point(), middle: point(), a0: vec![0.0; n], a1: vec![0.0; n] }
    }

    fn bytes(&self) -> usize {
        64 * self.a0.len()
    }

    fn interpolate(&mut self, t: f64, h: f64) {
        self.middle.t = t;
        let s = (t - self.start.t) / h;
        let ends = [(&self.start, &self.a0), (&self.end, &self.a1)];
        quintic(s, h, ends, &mut self.middle);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn steps_fill_the_time() {
        let steps = FixedSteps::new(1.0, 0.0, 0.3);
        assert_eq!((steps.count, steps.time(4), steps.size(5)), (4, 0.0, 0.0));
        assert!((steps.size(4) + 0.1).abs() < 1e-15 && steps.size(1) == -0.3);
        let steps = FixedSteps::new(0.0, 1.0, 0.1);
        assert_eq!((steps.count, steps.size(10)), (10, 0.1));
    }
}
