//! The error of a step of an explicit method, in parts of what is permitted.
//!
//! Permitted is absolute + relative·|value|. The absolute part of `.tolerance(..)` is smaller for small
//! motions: where the coordinates of all fields of one unit, or their velocities, have stayed below 0.1, it
//! is the tolerance times ten times the largest of them, but no less than a millionth of the tolerance:
//! forces that come from small differences of lengths would be rounding. A bar that moves by micrometres
//! keeps its digits. What starts from rest has the size that its accelerations reach within the shortest
//! period.

use dynamics_runtime::integrate::Tolerances;

use crate::generated::{BLOCK, Sum, block_sum};
use crate::integrate::Point;
use crate::integrate::explicit::{Stages, sums};

/// Values below this make the absolute tolerance smaller.
const SMALL: f64 = 0.1;
/// The least part of the tolerance that it becomes.
const LEAST_PART: f64 = 1e-6;

/// The norm of the error, and the sizes that it is measured by.
pub(crate) struct ErrorNorm {
    tolerances: Tolerances,
    /// Whether the absolute tolerance follows the size of the motion.
    scaled: bool,
    ends: Vec<usize>,
    /// For each field the first one of the same unit.
    shares: Vec<usize>,
    /// Largest coordinate and velocity so far, of all fields that share a unit.
    largest: Vec<[f64; 2]>,
    /// The same with the end of the present attempt.
    present: Vec<[f64; 2]>,
}

impl ErrorNorm {
    /// For fields that end at `ends` and have these units.
    pub(crate) fn new<'u>(
        tolerances: Tolerances,
        scaled: bool,
        ends: &[usize],
        units: impl Iterator<Item = &'u str>,
    ) -> Self {
        let units: Vec<&str> = units.collect();
        let first = |unit: &&str| units.iter().position(|other| other == unit).unwrap_or(0);
        Self {
            tolerances,
            scaled,
            shares: units.iter().map(first).collect(),
            ends: ends.to_vec(),
            largest: vec![[0.0; 2]; ends.len()],
            present: vec![[0.0; 2]; ends.len()],
        }
    }

    fn fields(&self) -> impl Iterator<Item = (usize, core::ops::Range<usize>)> + '_ {
        let begin = |field: usize| if field == 0 { 0 } else { self.ends[field - 1] };
        self.ends.iter().enumerate().map(move |(field, &end)| (field, begin(field)..end))
    }

    /// Takes the sizes of a state of the motion into account.
    pub(crate) fn see(&mut self, y: &Point) {
        grow(&mut self.largest, &self.ends, &self.shares, &y.q, &y.u);
    }

    /// Takes into account what velocities and accelerations reach within a time.
    pub(crate) fn see_growth(&mut self, u: &[f64], a: &[f64], time: f64) {
        let mut reached = vec![[0.0; 2]; self.largest.len()];
        grow(&mut reached, &self.ends, &self.shares, u, a);
        for (largest, [u, a]) in self.largest.iter_mut().zip(reached) {
            let (q, u) = ((u + a * time) * time, a * time);
            // What is not finite is found by the first step.
            if q.is_finite() {
                *largest = [largest[0].max(q), largest[1].max(u)];
            }
        }
    }

    /// The error of the step from y that the stages have made: 1 is just permitted, NaN where values are not
    /// finite.
    pub(crate) fn of(&mut self, stages: &Stages, y: &Point, h: f64) -> f64 {
        self.present.copy_from_slice(&self.largest);
        if self.scaled {
            // A motion from rest has no size but that of its first attempts.
            grow(&mut self.present, &self.ends, &self.shares, &stages.end.q, &stages.end.u);
        }
        let n = y.q.len();
        let errors = &stages.tableau.errors;
        let mut squares = [0.0; 2];
        for (square, weights) in squares.iter_mut().zip(errors) {
            let mut total = Sum::new();
            let (mut q, mut u) = ([0.0; BLOCK], [0.0; BLOCK]);
            for (field, range) in self.fields() {
                let absolute = self.absolute(field);
                let mut from = range.start;
                while from < range.end {
                    let to = range.end.min(from + BLOCK);
                    let length = to - from;
                    sums(&stages.k, weights, from, &mut q[..length], &mut u[..length]);
                    for (error, (start, end), absolute, factor) in [
                        (&mut q[..length], (&y.q[from..to], &stages.end.q[from..to]), absolute[0], h),
                        (&mut u[..length], (&y.u[from..to], &stages.end.u[from..to]), absolute[1], 1.0),
                    ] {
                        for ((error, x), y) in error.iter_mut().zip(start).zip(end) {
                            let ratio = factor * *error / self.scale(absolute, *x, *y);
                            *error = ratio * ratio;
                        }
                        total.add(block_sum(error));
                    }
                    from = to;
                }
            }
            *square = total.total();
        }
        let count = (2 * n) as f64;
        match errors.len() {
            1 => h.abs() * (squares[0] / count).sqrt(),
            _ => {
                let both = squares[0] + 0.01 * squares[1];
                // 0 where both estimates vanish, NaN where they are NaN.
                if both > 0.0 { h.abs() * squares[0] / (count * both).sqrt() } else { both }
            }
        }
    }

    /// The unknown with the largest error of the step.
    pub(crate) fn worst(&self, stages: &Stages, y: &Point, h: f64) -> usize {
        let mut worst = (0, -1.0);
        let Some(weights) = stages.tableau.errors.first() else { return 0 };
        for (field, range) in self.fields() {
            let absolute = self.absolute(field);
            for i in range {
                let (mut q, mut u) = ([0.0], [0.0]);
                sums(&stages.k, weights, i, &mut q, &mut u);
                let of_q = (h * q[0] / self.scale(absolute[0], y.q[i], stages.end.q[i])).abs();
                let of_u = (u[0] / self.scale(absolute[1], y.u[i], stages.end.u[i])).abs();
                let size = of_q.max(of_u);
                if size > worst.1 {
                    worst = (i, size);
                }
            }
        }
        worst.0
    }

    fn absolute(&self, field: usize) -> [f64; 2] {
        self.present[self.shares[field]].map(|largest| {
            let part = if self.scaled { (largest / SMALL).clamp(LEAST_PART, 1.0) } else { 1.0 };
            self.tolerances.absolute * part
        })
    }

    #[inline(always)]
    fn scale(&self, absolute: f64, x: f64, y: f64) -> f64 {
        // Where nothing moves, an error of nothing is permitted.
        (absolute + self.tolerances.relative * x.abs().max(y.abs())).max(f64::MIN_POSITIVE)
    }
}

fn grow(largest: &mut [[f64; 2]], ends: &[usize], shares: &[usize], q: &[f64], u: &[f64]) {
    let mut begin = 0;
    for (&share, &end) in shares.iter().zip(ends) {
        let largest = &mut largest[share];
        largest[0] = largest[0].max(size(&q[begin..end]));
        largest[1] = largest[1].max(size(&u[begin..end]));
        begin = end;
    }
}

fn size(values: &[f64]) -> f64 {
    values.iter().fold(0.0f64, |most, value| most.max(value.abs()))
}
