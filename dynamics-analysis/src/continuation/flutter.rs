//! Where flutter begins and ends.
//!
//! With damping a pair of eigenvalues passes the imaginary axis, a Hopf point. Without damping, two pairs on
//! the axis meet there and leave it. The growth rate begins as the square root of the distance. Rounding
//! causes growth of up to a millionth of the frequency; this corresponds to less than 10⁻¹² of the parameter
//! (A. P. Seyranian & A. A. Mailybaev, *Multiparameter Stability Theory with Mechanical Applications*,
//! chapters 2 and 7). Flutter ends in the same way, or becomes divergence if the pair meets on the real axis.

use alloc::vec::Vec;

use dynamics_runtime::model::{Constraints, Powers};
use nalgebra::{Complex, DMatrix};

use super::branch::SpecialKind;
use super::trace::{Sample, Tracer};
use crate::linearize::linearize;
use crate::{Stability, StabilityVerdict};

/// Growth below this part of the frequency is rounding, unless the verdicts on both ends of a step tell it
/// from that.
const GROWTH: f64 = 1e-6;
/// Growth is significant above this part of the growth at which flutter is certain.
const TOLD: f64 = 0.1;
/// Bits by which eigenvalues are off.
const ROUNDING: f64 = 16.0;
/// The distance along the branch within which the axis crossing is sought, from where growth is larger than
/// rounding.
const TO_AXIS: f64 = 0.2;

/// What is between two points where the number of growing pairs changes.
struct Enclosed<M: Constraints> {
    /// A place with flutter, next to where it begins or ends.
    flutter: Sample<M>,
    /// From there into flutter: the sign of s.
    inward: f64,
    /// Width of the bracket, along the branch.
    width: f64,
    /// Growth below this part of the frequency is none.
    least: f64,
}

/// How many pairs of eigenvalues grow swinging.
fn fluttering(eigenvalues: &[Complex<f64>], least: f64) -> usize {
    eigenvalues.iter().filter(|x| x.im > 0.0 && grows(x, least)).count()
}

fn grows(x: &Complex<f64>, least: f64) -> bool {
    x.re > least * x.norm() && x.im.abs() > GROWTH * x.norm()
}

/// What growth counts between two points: where a verdict is flutter, whatever told that from rounding.
fn least_growth(a: &Stability, b: &Stability) -> f64 {
    let flutters = |one: &&Stability| matches!(one.verdict, StabilityVerdict::Flutter { .. });
    let most = |of: &Stability| {
        let swings = of.eigenvalues.iter().filter(|x| x.im > GROWTH * x.norm());
        swings.map(|x| x.re / x.norm()).fold(0.0, f64::max)
    };
    let told = [a, b].into_iter().filter(flutters).map(most).filter(|most| *most > 0.0);
    told.map(|most| TOLD * most).fold(GROWTH, f64::min)
}

/// The swinging pair next to another one.
fn pair(eigenvalues: &[Complex<f64>], like: Complex<f64>) -> Option<Complex<f64>> {
    let swings = eigenvalues.iter().filter(|x| x.im > 0.5 * GROWTH * x.norm());
    swings.min_by(|a, b| (*a - like).norm().total_cmp(&(*b - like).norm())).copied()
}

fn spectrum<M: Constraints>(sample: &Sample<M>) -> Option<Vec<Complex<f64>>> {
    linearize(&sample.balance.model, &sample.place().state, &[]).ok()?.eigenvalues().ok()
}

impl<M: Constraints + Powers> Tracer<'_, M> {
    /// Looks for a beginning or an end of flutter between the last two points.
    pub(super) fn inspect_flutter(&mut self, a: &Sample<M>, b: &Sample<M>) {
        let [.., before, after] = &self.points[..] else { return };
        let (Ok(of_a), Ok(of_b)) = (&before.stability, &after.stability) else { return };
        let least = least_growth(of_a, of_b);
        let counts = [&of_a.eigenvalues, &of_b.eigenvalues].map(|all| fluttering(all, least));
        if counts[0] == counts[1] {
            return;
        }
        let Some(found) = self.enclose_flutter(a, b, counts, least) else { return };
        let Some(all) = spectrum(&found.flutter) else { return };
        let growing = || all.iter().filter(|x| x.im > 0.0 && grows(x, least));
        let to_axis = growing().map(|x| x.re / x.norm()).fold(f64::INFINITY, f64::min);
        let to_real = growing().min_by(|x, y| (x.im / x.norm()).total_cmp(&(y.im / y.norm())));
        let slope = found.flutter.tangent.p[0].abs();
        if let Some(real) = to_real.filter(|x| x.im / x.norm() < to_axis) {
            let kind = SpecialKind::FlutterDivergence { growth: real.re };
            let uncertainty = (found.width + self.root(&found, |x| x.im)) * slope;
            return self.add(kind, &found.flutter.balance, uncertainty, None, None);
        }
        // Of those that grow: others, that swing undamped or nearly so, may be nearer to the axis.
        let nearest = growing().min_by(|x, y| (x.re / x.norm()).total_cmp(&(y.re / y.norm())));
        let Some(first) = nearest.copied() else { return };
        if !is_damped(&found.flutter) {
            let kind = SpecialKind::FrequenciesMeet { frequency: first.im };
            let uncertainty = (found.width + self.root(&found, |x| x.re)) * slope;
            return self.add(kind, &found.flutter.balance, uncertainty, None, None);
        }
        let (sample, frequency, width) = self.on_axis(found, first);
        let uncertainty = width * slope + f64::EPSILON * sample.place().p[0].abs();
        self.add(SpecialKind::Hopf { frequency }, &sample.balance, uncertainty, None, None);
    }

    fn enclose_flutter(
        &self,
        a: &Sample<M>,
        b: &Sample<M>,
        counts: [usize; 2],
        least: f64,
    ) -> Option<Enclosed<M>> {
        let (mut lo, mut hi) = (0.0, self.ahead(a, b));
        let begins = counts[1] > counts[0];
        let mut flutter = self.copied(if begins { b } else { a })?;
        for _ in 0..50 {
            let s = 0.5 * (lo + hi);
            if s <= lo || s >= hi {
                break;
            }
            let Ok((sample, _)) = self.beside(a, s, hi) else { break };
            // Where two meet the iteration for eigenvalues may not settle: it is between these ends.
            let Some(all) = spectrum(&sample) else { break };
            let is_first = fluttering(&all, least) == counts[0];
            (lo, hi) = if is_first { (s, hi) } else { (lo, s) };
            if is_first != begins {
                flutter = sample;
            }
        }
        Some(Enclosed { flutter, inward: if begins { 1.0 } else { -1.0 }, width: hi - lo, least })
    }

    /// How far what begins as a root of the distance was from its beginning where it was told from rounding:
    /// by how it grows a little on.
    fn root(&self, found: &Enclosed<M>, of: impl Fn(&Complex<f64>) -> f64) -> f64 {
        let on = 1e-5;
        let at = |sample: &Sample<M>| {
            let all = spectrum(sample)?;
            all.iter().filter(|x| x.im > 0.0 && grows(x, found.least)).map(&of).reduce(f64::min)
        };
        let ends = self.beside(&found.flutter, found.inward * on, 1e-2).ok();
        let ends = ends.and_then(|(further, _)| Some([at(&found.flutter)?, at(&further)?]));
        ends.map_or(on, |[here, there]| {
            on * here * here / (there * there - here * here).max(f64::MIN_POSITIVE)
        })
    }

    /// The point where the real part of a pair is zero, by secants, with its frequency. Growth is larger than
    /// rounding only a little beside it.
    fn on_axis(&self, found: Enclosed<M>, first: Complex<f64>) -> (Sample<M>, f64, f64) {
        let from = found.flutter;
        let (mut x, mut f) = ([0.0, -1e-6 * found.inward], first.re);
        let mut best: Option<(Sample<M>, f64, f64)> = None;
        for _ in 0..12 {
            let Ok((sample, _)) = self.beside(&from, x[1], TO_AXIS) else { break };
            let Some(value) = spectrum(&sample).and_then(|all| pair(&all, first)) else { break };
            let slope = (value.re - f) / (x[1] - x[0]);
            let step = -value.re / slope;
            // Near the axis the slope of the last two is rounding; that from where flutter was seen is not.
            let whole = ((value.re - first.re) / x[1]).abs();
            let rounding = ROUNDING * f64::EPSILON * value.norm();
            best = Some((sample, value.im, (value.re.abs() + rounding) / whole));
            let is_there = value.re.abs() <= 0.1 * rounding || step.abs() <= 1e-15 || x[1] + step == x[1];
            if is_there || !(step.is_finite() && (x[1] + step).abs() < TO_AXIS) {
                break;
            }
            (x, f) = ([x[1], x[1] + step], value.re);
        }
        best.filter(|(.., width)| width.is_finite()).unwrap_or((from, first.im, TO_AXIS))
    }
}

/// Whether anything takes energy out or puts it in by velocities.
fn is_damped<M: Constraints>(sample: &Sample<M>) -> bool {
    let largest = |m: &DMatrix<f64>| m.iter().fold(0.0, |most: f64, x| most.max(x.abs()));
    let linear = linearize(&sample.balance.model, &sample.place().state, &[]);
    linear.is_ok_and(|linear| largest(&linear.dissipative()) > 1e-12 * largest(&linear.damping))
}
