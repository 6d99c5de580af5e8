//! Zero crossings within a step.
//!
//! An event function g is sampled at the ends of a few equal parts of the step. In a part of length H between
//! samples gₐ and g_b, let |g″|H² ≤ c. Then g stays on the side of its chord that a parabola of that
//! curvature bounds, and it
//!
//! * has no zero where gₐ and g_b have one sign and ½c < (√|gₐ| + √|g_b|)², when even that parabola stays off
//!   zero,
//! * has one zero where their signs differ and ½c < |g_b − gₐ|, when it cannot turn.
//!
//! c is taken from the second differences at both ends of the part, with a factor of safety. A part that
//! passes neither test is divided into four, until it does or only rounding is left of it. The smoothness of
//! g between samples is checked, too: where a new sample differs from what the curvature of its neighbours
//! predicts, the parts around it are judged with a larger c; and where samples look rough, one part is
//! divided as a test. So functions that oscillate faster than the samples are followed. Between parts that
//! show the slopes on both sides of a kink, c bounds the kink. In the first and the last part it may not;
//! there the slope of the neighbouring part decides whether the part is divided. A dip between samples that
//! no sample shows is missed: two kinks or more in one part can make one.
//!
//! [`root`] locates the crossings.

use crate::integrate::events::root::root;
use crate::integrate::events::root::sign;
use crate::math;

/// Which crossings count. Rising and falling refer to the direction of the motion, also backwards in time.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Direction {
    /// From negative to positive.
    Rising,
    /// From positive to negative.
    Falling,
    /// Both.
    Any,
}

impl Direction {
    /// Whether a crossing in direction `found` counts.
    #[must_use]
    pub fn admits(self, found: Direction) -> bool {
        self == Direction::Any || self == found
    }
}

/// A crossing within a step.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Crossing {
    /// Index of the event function.
    pub index: usize,
    /// Where in the step, 0 to 1.
    pub theta: f64,
    /// Rising or falling.
    pub direction: Direction,
}

/// Why an event function cannot be followed through a step.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum ScanError<E> {
    /// It changes too fast for the evaluations that a step may take.
    Unresolved,
    /// It has no value somewhere.
    Function(E),
}

/// A sample (θ, g).
type Sample = (f64, f64);

/// Most parts of a panel: parts that are judged together.
const PANEL_PARTS: usize = 8;
/// Samples that divide a part. They are not equidistant, for the reason of [`sample_position`].
const DIVISION: [f64; 3] = [0.22, 0.53, 0.76];
/// Most evaluations of a function in a step besides those of [`root`]: enough for an oscillation of some
/// 2,000 radians.
const MAX_EVALUATIONS: u32 = 16_384;
/// A part narrower than so many resolutions is not divided further.
const MIN_PART_RESOLUTIONS: f64 = 8.0;
/// A panel is rough where the curvature changes from sample to sample by more than this part of its largest
/// value.
const ROUGH_CHANGE: f64 = 0.3;

/// How the parts of a panel are judged.
#[derive(Clone, Copy, PartialEq)]
enum Refinement {
    /// For the first time, by their samples alone.
    First,
    /// As parts of a divided part. The number is added to the bound of |g″|H²: by so much samples near them
    /// exceeded what was predicted.
    Closer(f64),
}

/// Follows one event function through a step and finds its crossings.
#[derive(Clone, Copy, Debug)]
pub struct Scan {
    /// The last sign that was not 0; 0 while unknown.
    sign: f64,
    /// Parts that begin beyond this θ are left out.
    horizon: f64,
    /// Accuracy of crossings in θ.
    resolution: f64,
    /// Changes of g up to this are rounding.
    noise: f64,
    evaluations: u32,
    reached: f64,
}

/// An event function of θ; `None` where it has no value.
type Value<'g> = &'g mut dyn FnMut(f64) -> Option<f64>;
/// Receives the crossings; returns whether the scan goes on.
type OnCrossing<'g> = &'g mut dyn FnMut(f64, Direction) -> bool;
/// The function has no value, or changes too fast.
struct Stopped;

impl Scan {
    /// A scan that begins where the function has the given sign (0: unknown; the next sample decides it
    /// without a crossing). Crossings are located to within `resolution` in θ; changes of g by less than
    /// `noise` count as rounding.
    #[must_use]
    pub fn new(sign: f64, resolution: f64, noise: f64) -> Self {
        Self { sign, horizon: f64::INFINITY, resolution, noise, evaluations: 0, reached: 0.0 }
    }

    /// Leaves out parts that begin beyond a θ.
    #[must_use]
    pub fn up_to(self, horizon: f64) -> Self {
        Self { horizon, ..self }
    }

    /// The last sign that was not 0.
    #[must_use]
    pub fn sign(&self) -> f64 {
        self.sign
    }

    /// θ up to which the function was followed.
    #[must_use]
    pub fn reached(&self) -> f64 {
        self.reached
    }

    /// Follows the function from the first of some samples (θ, g) to the last. Calls `found(θ, direction)`
    /// for every crossing, in order, until it returns `false`, which ends the scan. `g` evaluates the
    /// function.
    ///
    /// # Errors
    /// What `g` returns; [`ScanError::Unresolved`] where it changes too fast.
    pub fn follow<E>(
        &mut self,
        samples: &[(f64, f64)],
        mut g: impl FnMut(f64) -> Result<f64, E>,
        mut found: impl FnMut(f64, Direction) -> bool,
    ) -> Result<(), ScanError<E>> {
        let mut fault = None;
        let mut value = |theta| g(theta).map_err(|error| fault = Some(error)).ok();
        let followed = self.follow_panels(samples, &mut value, &mut found);
        followed.map_err(|Stopped| fault.map_or(ScanError::Unresolved, ScanError::Function))
    }

    /// [`Scan::follow`] without generic parameters, so that it is compiled once.
    fn follow_panels(
        &mut self,
        samples: &[Sample],
        g: Value<'_>,
        found: OnCrossing<'_>,
    ) -> Result<(), Stopped> {
        let mut rest = samples;
        while rest.len() >= 2 {
            let parts = (rest.len() - 1).min(PANEL_PARTS);
            self.panel(&rest[..=parts], Refinement::First, g, found)?;
            rest = &rest[parts..];
        }
        Ok(())
    }

    /// Finds the crossings in the parts between samples.
    fn panel(
        &mut self,
        samples: &[Sample],
        look: Refinement,
        g: Value<'_>,
        found: OnCrossing<'_>,
    ) -> Result<(), Stopped> {
        let parts = samples.len() - 1;
        let at = curvatures(samples);
        // 1. Divide the parts that may hide zeros, and one that looks rough. `surprise`: the largest bound
        //    that
        // a new sample demands.
        let (rough, doubt) = match look {
            Refinement::First => (roughest(&at[1..parts]), 0.0),
            Refinement::Closer(doubt) => (None, doubt),
        };
        let mut inner = [None; PANEL_PARTS];
        let mut surprise = 0.0f64;
        for part in 0..parts {
            let (from, to, bending) = (samples[part], samples[part + 1], bending(samples, &at, part));
            let bound = bound(bending);
            let fine = self.is_fine(from, to) || bound <= self.noise;
            let turns = || !is_resolved(from, to, bound + doubt) || may_turn(samples, &at, part, self.noise);
            if !fine && (rough == Some(part) || turns()) {
                let fresh = self.divide(from, to, g)?;
                surprise = surprise.max(surprising(from, to, &fresh, bending, self.noise));
                inner[part] = Some(fresh);
            }
        }
        // 2. Divide others for which that bound is too large, and go on within the parts, in order.
        for part in 0..parts {
            let (from, to) = (samples[part], samples[part + 1]);
            let settled = inner[part].is_some() || surprise == 0.0 || self.is_fine(from, to);
            if !settled && !is_resolved(from, to, bound(bending(samples, &at, part)) + surprise) {
                inner[part] = Some(self.divide(from, to, g)?);
            }
            match inner[part] {
                Some([a, b, c]) => {
                    self.panel(&[from, a, b, c, to], Refinement::Closer(surprise), g, found)?
                }
                None => self.part(from, to, g, found)?,
            }
        }
        Ok(())
    }

    /// Whether a part is not divided in any case: it lies beyond the horizon or is very narrow.
    fn is_fine(&self, from: Sample, to: Sample) -> bool {
        from.0 > self.horizon || to.0 - from.0 <= MIN_PART_RESOLUTIONS * self.resolution
    }

    /// Evaluates the samples that divide a part.
    fn divide(&mut self, from: Sample, to: Sample, g: Value<'_>) -> Result<[Sample; 3], Stopped> {
        let mut fresh = [(0.0, 0.0); 3];
        for (sample, part) in fresh.iter_mut().zip(DIVISION) {
            let theta = from.0 + part * (to.0 - from.0);
            *sample = (theta, g(theta).ok_or(Stopped)?);
        }
        self.evaluations += 3;
        if self.evaluations > MAX_EVALUATIONS {
            return Err(Stopped);
        }
        Ok(fresh)
    }

    /// Locates the crossing of a part in which the function has one zero at most.
    fn part(&mut self, from: Sample, to: Sample, g: Value<'_>, found: OnCrossing<'_>) -> Result<(), Stopped> {
        if from.0 > self.horizon {
            return Ok(());
        }
        self.reached = to.0;
        let now = sign(to.1);
        if now == 0.0 || now == self.sign {
            return Ok(());
        }
        if self.sign != 0.0 {
            // If rounding has the first sample on the far side already, or at zero, the crossing is there.
            let from = if sign(from.1) == self.sign { from } else { (from.0, 0.0) };
            let mut failed = false;
            let value = |theta| {
                let value = g(theta);
                failed |= value.is_none();
                value.unwrap_or(f64::NAN)
            };
            let theta = root(value, from, to, self.resolution);
            if failed {
                return Err(Stopped);
            }
            if !found(theta, direction(now)) {
                self.horizon = f64::NEG_INFINITY;
            }
        }
        self.sign = now;
        Ok(())
    }
}

fn direction(sign: f64) -> Direction {
    if sign > 0.0 { Direction::Rising } else { Direction::Falling }
}

/// θ of the sample at the end of a part of a step. Samples are nearly equidistant, but not quite: equidistant
/// ones would show an oscillation slow that they sample once a period.
#[must_use]
pub fn sample_position(part: usize, parts: usize) -> f64 {
    if part == 0 || part == parts {
        return (part / parts.max(1)) as f64;
    }
    /// φ − 1 with the golden ratio φ: its multiples are spread evenly modulo 1.
    const GOLDEN_RATIO_PART: f64 = 0.618_033_988_749_895;
    let turns = part as f64 * GOLDEN_RATIO_PART;
    (part as f64 + 0.4 * (turns - turns as u32 as f64 - 0.5)) / parts as f64
}

/// g″ at the inner samples by divided differences; 0 at the first and the last.
fn curvatures(samples: &[Sample]) -> [f64; PANEL_PARTS] {
    let mut out = [0.0; PANEL_PARTS];
    let slope = |k: usize| (samples[k + 1].1 - samples[k].1) / (samples[k + 1].0 - samples[k].0);
    let mut past = slope(0);
    for k in 1..samples.len() - 1 {
        let now = slope(k);
        out[k] = 2.0 * (now - past) / (samples[k + 1].0 - samples[k - 1].0);
        past = now;
    }
    out
}

/// g″H² at both ends of a part, infinite where there are too few samples. At the first and the last sample g″
/// is extrapolated linearly.
fn bending(samples: &[Sample], at: &[f64; PANEL_PARTS], part: usize) -> [f64; 2] {
    let last = samples.len() - 2;
    let width = samples[part + 1].0 - samples[part].0;
    let ends = match part {
        _ if last == 0 => [f64::INFINITY; 2],
        _ if last == 1 => [at[1]; 2],
        0 => [2.0 * at[1] - at[2], at[1]],
        _ if part == last => [at[last], 2.0 * at[last] - at[last - 1]],
        _ => [at[part], at[part + 1]],
    };
    ends.map(|end| end * width * width)
}

/// Bound of |g″|H²: four times the mean of both ends. It also bounds a kink, if the parts on both sides have
/// none; for the first and the last part see [`may_turn`].
fn bound([left, right]: [f64; 2]) -> f64 {
    2.0 * (left.abs() + right.abs())
}

/// The part over which the curvature changes most, if the panel is rough: see [`ROUGH_CHANGE`].
fn roughest(curvatures: &[f64]) -> Option<usize> {
    let largest = curvatures.iter().fold(0.0f64, |largest, curvature| largest.max(curvature.abs()));
    let changes = curvatures.windows(2).map(|pair| (pair[1] - pair[0]).abs());
    let (at, most) = changes.enumerate().fold((0, 0.0), |most, now| if now.1 > most.1 { now } else { most });
    (most > ROUGH_CHANGE * largest).then_some(at + 1)
}

/// Whether a function has no zero between samples of one sign, or one between those of different signs.
fn is_resolved((_, a): Sample, (_, b): Sample, bound: f64) -> bool {
    let (a_size, b_size) = (a.abs(), b.abs());
    match sign(a) * sign(b) > 0.0 {
        true => bound < a_size + b_size + 2.0 * math::sqrt(a_size * b_size),
        false => bound <= (b - a).abs(),
    }
}

/// Whether a kink may hide two zeros in the first or the last part, where the slope is known on one side
/// only. It may if the function, extrapolated from that side linearly or with its curvature, is on the other
/// side of zero at the outer sample, by more than `noise`.
fn may_turn(samples: &[Sample], at: &[f64; PANEL_PARTS], part: usize, noise: f64) -> bool {
    let last = samples.len() - 2;
    let (outer, near, far, bend) = match part {
        _ if last < 1 => return false,
        0 => (samples[0], samples[1], samples[2], at[2]),
        _ if part == last => (samples[last + 1], samples[last], samples[last - 1], at[last - 1]),
        _ => return false,
    };
    let slope = (near.1 - far.1) / (near.0 - far.0);
    let straight = near.1 + slope * (outer.0 - near.0);
    let bent = straight + 0.5 * bend * (outer.0 - near.0) * (outer.0 - far.0);
    let side = sign(outer.1);
    side * sign(near.1) > 0.0 && (side * straight).min(side * bent) < -noise
}

/// The bound of |g″|H² that new samples in a part demand, where they differ from the prediction by the
/// curvature at its ends by more than half of its effect; else 0.
fn surprising(from: Sample, to: Sample, inner: &[Sample; 3], [left, right]: [f64; 2], noise: f64) -> f64 {
    DIVISION.iter().zip(inner).fold(0.0, |most, (part, (_, value))| {
        let off = value - (from.1 + part * (to.1 - from.1));
        let weight = 0.5 * part * (1.0 - part);
        let miss = (off + weight * ((1.0 - part) * left + part * right)).abs();
        let expected = miss <= 0.5 * weight * (left.abs() + right.abs()) + noise;
        // NaN was not predicted either.
        if expected {
            most
        } else {
            most.max(if miss.is_finite() { 4.0 * off.abs() / weight } else { f64::INFINITY })
        }
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn count_root(g: impl Fn(f64) -> f64, a: f64, b: f64) -> (f64, u32) {
        let mut calls = 0;
        let x = root(
            |x| {
                calls += 1;
                g(x)
            },
            (a, g(a)),
            (b, g(b)),
            1e-14,
        );
        (x, calls)
    }

    #[test]
    fn finds_roots_of_smooth_steep_and_flat_functions_within_the_cost_of_bisection() {
        let bisection = 47 + 2;
        for (x, calls, exact) in [
            (count_root(|x| x - 0.3, 0.0, 1.0), 0.3),
            (count_root(|x| x * x - 0.5, 0.0, 1.0), 0.5f64.sqrt()),
            (count_root(|x| (x - 0.7).powi(9), 0.0, 1.0), 0.7),
            (count_root(|x| (50.0 * (x - 0.123)).tanh(), 0.0, 1.0), 0.123),
            (count_root(|x| (x - 0.9).exp() - 1.0, 1.0, 0.0), 0.9),
            (count_root(|x| if x < 0.25 { -1.0 } else { 1e9 }, 0.0, 1.0), 0.25),
        ]
        .map(|((x, calls), exact)| (x, calls, exact))
        {
            assert!((x - exact).abs() < 2e-14, "{x} for {exact}");
            assert!(calls <= bisection, "{calls} evaluations for {exact}");
        }
        assert!(count_root(|x| x * x - 0.5, 0.0, 1.0).1 <= 10);
    }

    /// Crossings on a step sampled at the ends of equal parts, and the evaluations that they took besides
    /// those.
    fn follow(g: impl Fn(f64) -> f64, parts: usize, sign: f64) -> (Vec<(f64, Direction)>, u32) {
        let samples: Vec<_> =
            (0..=parts).map(|j| sample_position(j, parts)).map(|theta| (theta, g(theta))).collect();
        let (mut out, mut calls) = (Vec::new(), 0);
        let value = |theta| {
            calls += 1;
            Ok::<f64, ()>(g(theta))
        };
        let found = |theta, direction| {
            out.push((theta, direction));
            true
        };
        Scan::new(sign, 1e-14, 1e-15).follow(&samples, value, found).unwrap();
        (out, calls)
    }

    fn crossings(g: impl Fn(f64) -> f64, parts: usize, initial: f64) -> Vec<(f64, Direction)> {
        follow(g, parts, initial).0
    }

    #[test]
    fn sees_two_crossings_between_samples() {
        for (first, second) in
            [(0.55, 0.56), (0.5, 0.51), (0.49, 0.5), (0.01, 0.02), (0.98, 0.99), (0.3, 0.3 + 1e-6)]
        {
            let found = crossings(|x| (x - first) * (x - second), 4, 1.0);
            assert_eq!(found.len(), 2, "{first} {second}: {found:?}");
            assert!((found[0].0 - first).abs() < 1e-9 && found[0].1 == Direction::Falling);
            assert!((found[1].0 - second).abs() < 1e-9 && found[1].1 == Direction::Rising);
        }
    }

    #[test]
    fn sees_three_crossings_between_samples() {
        for middle in [0.05, 0.37, 0.5, 0.61, 0.96] {
            let found = crossings(|x| (x - middle + 0.01) * (x - middle) * (x - middle - 0.013), 4, -1.0);
            let expected = [
                (middle - 0.01, Direction::Rising),
                (middle, Direction::Falling),
                (middle + 0.013, Direction::Rising),
            ];
            assert_eq!(found.len(), 3, "{middle}: {found:?}");
            assert!(found.iter().zip(expected).all(|(a, b)| (a.0 - b.0).abs() < 1e-10 && a.1 == b.1));
        }
    }

    #[test]
    fn what_oscillates_faster_than_the_samples_is_followed() {
        let cases = (0..350).flat_map(|k| [4, 8].map(|parts| (parts, 3.0 * 1.0171f64.powi(k))));
        for (parts, omega) in cases {
            for k in 0..5 {
                let phase = 1.31 * f64::from(k);
                let found = crossings(|x| (omega * x + phase).sin(), parts, sign(phase.sin()));
                let half_turns = |angle: f64| (angle / core::f64::consts::PI) as usize;
                assert_eq!(
                    found.len(),
                    half_turns(omega + phase) - half_turns(phase),
                    "{parts} {omega} {phase}"
                );
            }
        }
    }

    #[test]
    fn what_cannot_be_followed_is_an_error() {
        let g = |x: f64| (1e6 * x).sin();
        let samples: Vec<_> = (0..=8).map(|j| f64::from(j) / 8.0).map(|theta| (theta, g(theta))).collect();
        let mut scan = Scan::new(0.0, 1e-14, 1e-15);
        assert_eq!(scan.follow(&samples, |x| Ok::<f64, ()>(g(x)), |_, _| true), Err(ScanError::Unresolved));
        assert!(scan.reached() < 1.0);
        let nowhere = |_| Err("nowhere");
        let found = Scan::new(0.0, 1e-14, 1e-15).follow(&samples, nowhere, |_, _| true);
        assert_eq!(found, Err(ScanError::Function("nowhere")));
    }

    /// Parts that cannot have a zero cost nothing; a touch is divided down to rounding.
    #[test]
    fn only_what_is_at_risk_costs() {
        assert_eq!(follow(|x| 1.0 + x + x * x, 8, 1.0).1, 0);
        assert_eq!(follow(|x| (2.0 * x).sin() + 0.5, 8, 1.0).1, 0);
        let calls = follow(|x| (x - 0.5) * (x - 0.5), 8, 1.0).1;
        assert!(calls > 20 && calls < 120, "{calls}");
        // A crossing alone.
        let calls = follow(|x| x * x - 0.5, 8, -1.0).1;
        assert!(calls <= 12, "{calls}");
    }

    #[test]
    fn jumps_and_poles_are_crossed_once() {
        assert_eq!(crossings(|x| if x < 0.3 { 1.0 } else { -2.0 }, 8, 1.0).len(), 1);
        assert_eq!(crossings(|x| 1.0 / (x - 0.3), 8, -1.0).len(), 1);
        assert!(crossings(|x| if x < 0.3 { 5.0 } else { 1e-6 }, 8, 1.0).is_empty());
        // Kinks far from zero cost few evaluations.
        let (found, calls) = follow(|x| 1.001 - (40.0 * x).cos().abs(), 8, 1.0);
        assert!(found.is_empty() && calls < 2000, "{found:?} {calls}");
        assert_eq!(crossings(|x| (x - 0.3).abs() - 1e-3, 8, 1.0).len(), 2);
    }

    /// Behind the crossing that ends it, the scan does not evaluate the function.
    #[test]
    fn nothing_is_looked_for_beyond_the_last_crossing_that_is_wanted() {
        let g = |x: f64| (20.0 * x).cos();
        let samples: Vec<_> = (0..=8).map(|j| f64::from(j) / 8.0).map(|theta| (theta, g(theta))).collect();
        let value = |x| if x > 0.5 { Err(()) } else { Ok(g(x)) };
        let mut count = 0;
        let mut scan = Scan::new(1.0, 1e-14, 1e-15).up_to(0.2);
        scan.follow(&samples, value, |_, _| {
            count += 1;
            false
        })
        .unwrap();
        assert_eq!(count, 1);
    }

    /// Dips with a kink at the bottom, wherever it is between the samples: two zeros, and none where they
    /// stay above.
    #[test]
    fn kinked_dips_are_seen() {
        for parts in [4, 8] {
            for k in 1..2000 {
                let (center, width) = (f64::from(k) / 2000.0, 10f64.powi(-2 - k % 3));
                if center - width < 0.0 || center + width > 1.0 {
                    continue;
                }
                let (left, right) = (0.3 + f64::from(k % 7), 0.3 + f64::from(k % 11));
                let dip = |x: f64| if x < center { left * (center - x) } else { right * (x - center) };
                let case = format!("{parts} parts, {width} around {center}");
                let found = crossings(|x| dip(x) - width, parts, 1.0);
                let first = (center - width / left, Direction::Falling);
                let second = (center + width / right, Direction::Rising);
                let inside: Vec<_> =
                    [first, second].into_iter().filter(|x| (0.0..=1.0).contains(&x.0)).collect();
                if first.0 > 0.0 {
                    assert_eq!(found.len(), inside.len(), "{case}: {found:?}");
                    assert!(
                        found.iter().zip(&inside).all(|(a, b)| (a.0 - b.0).abs() < 1e-12 && a.1 == b.1),
                        "{case}"
                    );
                }
                assert!(crossings(|x| dip(x) + 1e-9, parts, 1.0).is_empty(), "{case}");
                // The same where the function is curved besides.
                let bent = |x: f64| (1.5 * (x - center)).sin().abs() * (1.5 + (2.0 * x).cos()) - 10.0 * width;
                let found = crossings(bent, parts, sign(bent(0.0)));
                let ends = usize::from(bent(0.0) > 0.0) + usize::from(bent(1.0) > 0.0);
                assert_eq!(found.len(), ends, "{case}: {found:?}");
            }
        }
    }

    #[test]
    fn a_touch_without_change_of_sign_is_no_crossing() {
        assert!(crossings(|x| (x - 0.5) * (x - 0.5), 4, 1.0).is_empty());
        assert!(crossings(|x| x * (1.0 - x), 4, 0.0).is_empty(), "zero at both ends");
    }

    #[test]
    fn a_zero_on_a_sample_is_found_once() {
        let found = crossings(|x| x - 0.5, 4, -1.0);
        assert_eq!(found, [(0.5, Direction::Rising)]);
    }

    #[test]
    fn unknown_sign_at_the_start_is_settled_without_a_crossing() {
        assert!(crossings(|x| x, 4, 0.0).is_empty());
        assert_eq!(crossings(|x| x * (0.6 - x), 4, 0.0).len(), 1);
    }
}
