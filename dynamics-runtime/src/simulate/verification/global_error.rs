//! Global error of a motion: its differences from a second, more accurate run.
//!
//! A step control bounds the error of each step. What becomes of these errors depends on the motion: a stable
//! one damps them, in a pendulum or an orbit they grow with time or its square, in a chaotic motion they
//! double again and again. Only a second run shows it. Errors that both runs have in common, as a force
//! between the stages of both, are not seen.

pub(crate) mod events;

use alloc::vec::Vec;

use crate::simulate::verification::global_error::events::EventMatching;

use crate::math;
use crate::model::{ModelState, SimulationModel, Vector};
use crate::simulate::trajectory::global_error::{GlobalError, LargestDifference, ReferenceSettings};
use crate::simulate::trajectory::motion::Motion;
use crate::simulate::trajectory::record::Trajectory;
use crate::simulate::verification::reference_run::ReferenceRun;

/// Errors of this part of the range of a coordinate or velocity leave no digit: the motion is lost.
const LOST_SHARE: f64 = 0.1;
/// Errors above this part of the range no longer follow the linearised equations.
const LINEAR_RANGE: f64 = 0.01;
/// Smaller growth may be that of a power of time: over the last nine tenths of a motion t² grows a
/// hundredfold.
const MIN_GROWTH: f64 = 1e3;
/// Fewest points for a fit of exponential growth.
const MIN_POINTS: usize = 16;

/// The error of a trajectory by a second run; `order` of the method.
pub(crate) fn compare<M: SimulationModel>(
    first: &Trajectory<M>,
    second: &mut ReferenceRun<M>,
    order: u32,
) -> GlobalError {
    let EventMatching { shift, unmatched, between } = EventMatching::of(first, second);
    second.middles.retain(|state| !between.iter().any(|[a, b]| *a <= state.t() && state.t() <= *b));
    let fixed = matches!(second.run, ReferenceSettings::HalfStep(_));
    let factor = if fixed { 1.0 / (1.0 - math::powi(0.5, order as i32)) } else { 1.0 };
    let [of_q, of_u] = ranges(first);
    let mut differences = RunDifferences::new::<M>(first.first().state.t());
    for (record, other) in first.records.iter().zip(&second.states) {
        let (state, t) = (&record.state, record.state.t());
        if between.iter().any(|[a, b]| *a <= t && t <= *b) {
            continue;
        }
        let mut relative = 0.0f64;
        let parts = [(state.q(), other.q(), &of_q), (state.u(), other.u(), &of_u)];
        for (part, (ours, theirs, ranges)) in parts.into_iter().enumerate() {
            for (i, ((x, y), range)) in ours.as_slice().iter().zip(theirs.as_slice()).zip(ranges).enumerate()
            {
                let error = factor * (x - y).abs();
                differences.record(part, LargestDifference { name: M::COORDINATES[i].name, error, time: t });
                differences.ratio = differences.ratio.max(error / first.tolerances.scale(*x, *y));
                relative = relative.max(if *range > 0.0 { error / range } else { 0.0 });
            }
        }
        differences.history.push((t, relative));
    }
    let RunDifferences { largest: [coordinates, velocities], ratio, history } = differences;
    GlobalError {
        reference: second.run,
        coordinates,
        velocities,
        ratio: (!fixed).then_some(ratio),
        between: None,
        lost_at: history.iter().find(|(_, error)| *error >= LOST_SHARE).map(|(t, _)| *t),
        doubling_time: doubling_time(&history),
        shift,
        unmatched,
        history,
        evaluations: second.counts.evaluations,
        broken_off: second.broken_off.clone(),
    }
}

/// The largest error in the middle of steps in parts of what is permitted.
pub(crate) fn between<M: SimulationModel>(motion: &Motion<'_, M>, middles: &[M::State]) -> f64 {
    let (mut sampler, tolerances) = (motion.reader(), motion.trajectory.tolerances);
    middles.iter().fold(0.0, |most: f64, exact| {
        let state = sampler.at(exact.t());
        let parts = [(state.q(), exact.q()), (state.u(), exact.u())];
        let pairs = parts.into_iter().flat_map(|(x, y)| x.as_slice().iter().zip(y.as_slice()));
        pairs.fold(most, |most, (x, y)| {
            let error = (x - y).abs() / tolerances.scale(*x, *y);
            // NaN is no small error.
            if error.is_nan() { f64::INFINITY } else { most.max(error) }
        })
    })
}

/// Largest differences of two runs, and their history.
struct RunDifferences {
    /// Of a coordinate, of a velocity.
    largest: [LargestDifference; 2],
    ratio: f64,
    history: Vec<(f64, f64)>,
}

impl RunDifferences {
    fn new<M: SimulationModel>(start: f64) -> Self {
        let name = M::COORDINATES.first().map_or("", |coordinate| coordinate.name);
        Self {
            largest: [LargestDifference { name, error: 0.0, time: start }; 2],
            ratio: 0.0,
            history: Vec::new(),
        }
    }

    fn record(&mut self, part: usize, found: LargestDifference) {
        if found.error > self.largest[part].error {
            self.largest[part] = found;
        }
    }
}

/// Range of every coordinate and of every velocity.
fn ranges<M: SimulationModel>(trajectory: &Trajectory<M>) -> [Vec<f64>; 2] {
    let range = |of: fn(&M::State) -> &M::Vector| {
        (0..M::Vector::LEN).map(move |i| {
            let values = trajectory.records.iter().map(|record| of(&record.state).as_slice()[i]);
            let (lo, hi) = values.fold((f64::MAX, f64::MIN), |(lo, hi), x| (lo.min(x), hi.max(x)));
            // Values that change by rounding only have no range.
            if hi - lo > 1e-9 * hi.abs().max(lo.abs()) { hi - lo } else { 0.0 }
        })
    };
    [range(M::State::q).collect(), range(M::State::u).collect()]
}

/// The time in which small errors double, if they grow exponentially: a line through ln e over t fits better
/// than one over ln t.
fn doubling_time(history: &[(f64, f64)]) -> Option<f64> {
    let (start, _) = *history.first()?;
    let mut largest = 0.0f64;
    let grown = history.iter().map(|(t, error)| {
        largest = largest.max(*error);
        ((t - start).abs(), largest)
    });
    let small: Vec<(f64, f64)> = grown
        .filter(|(_, error)| *error > 16.0 * f64::EPSILON)
        .take_while(|(_, error)| *error < LINEAR_RANGE)
        .collect();
    let (last, most) = *small.last()?;
    let points: Vec<(f64, f64)> = small.into_iter().filter(|(t, _)| *t >= 0.1 * last).collect();
    if points.len() < MIN_POINTS || most < MIN_GROWTH * points[0].1 {
        return None;
    }
    let logarithms = |of: fn(f64) -> f64| points.iter().map(move |(t, error)| (of(*t), math::ln(*error)));
    let (rate, misfit) = fit_line(logarithms(|t| t));
    let (_, misfit_of_power) = fit_line(logarithms(math::ln));
    (rate > 0.0 && misfit < misfit_of_power).then(|| core::f64::consts::LN_2 / rate)
}

/// Slope of the straight line of least squares, and the sum of their squares.
fn fit_line(points: impl Iterator<Item = (f64, f64)> + Clone) -> (f64, f64) {
    let count = points.clone().count() as f64;
    let (x, y) = points.clone().fold((0.0, 0.0), |(x, y), point| (x + point.0 / count, y + point.1 / count));
    let sums = points.fold([0.0; 3], |[xx, xy, yy], (a, b)| {
        [xx + (a - x) * (a - x), xy + (a - x) * (b - y), yy + (b - y) * (b - y)]
    });
    let [xx, xy, yy] = sums;
    (xy / xx, yy - xy * xy / xx)
}
