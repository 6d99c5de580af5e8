//! Onset and end of flutter along a branch.
//!
//! With damping a pair of eigenvalues passes the imaginary axis, a Hopf point. Without damping, two pairs on
//! the axis meet there and leave it. The growth rate then begins as the square root of the distance. Rounding
//! causes growth of up to a millionth of the frequency. This corresponds to less than 10⁻¹² of the
//! parameter (A. P. Seyranian & A. A. Mailybaev, *Multiparameter Stability Theory with Mechanical
//! Applications*, chapters 2 and 7). Flutter ends in the same way, or becomes divergence if the pair meets on
//! the real axis.

use alloc::vec::Vec;

use dynamics_runtime::model::{Constraints, Powers};
use nalgebra::{Complex, DMatrix};

use super::branch::SpecialKind;
use super::trace::{Sample, Tracer};
use crate::linearize::linearize;
use crate::{Stability, StabilityVerdict};

/// Growth rates below this share of the frequency are rounding, unless the verdicts at the ends of a step say
/// otherwise. A double eigenvalue is off by √ε = 1.5·10⁻⁸ of the frequency, times its conditioning.
const MIN_RELATIVE_GROWTH: f64 = 1e-6;
/// Where a verdict is flutter, growth counts from this share of the rate at that point. Damping may be so
/// light that the rate is below [`MIN_RELATIVE_GROWTH`] (10⁻⁹ of critical damping is tested).
const CERTAIN_GROWTH_SHARE: f64 = 0.1;
/// Error of an eigenvalue, in rounding units of its size. It enters the reported uncertainty of the
/// parameter.
const EIGENVALUE_ERROR_IN_EPSILONS: f64 = 16.0;
/// Distance from the enclosed onset at which growth is measured once more. The ratio of both growth rates
/// gives the distance of a square-root onset, so that it need not be small.
const ONSET_PROBE_DISTANCE: f64 = 1e-5;
/// Largest distance between the predictor and the point of that probe. The step is short, so that only a
/// sharp bend of the branch needs it.
const MAX_PROBE_CORRECTION: f64 = 1e-2;
/// Bisections that enclose an onset; 50 exhaust the digits of a step.
const MAX_BISECTIONS: usize = 50;
/// Largest number of secant steps to the imaginary axis. They converge superlinearly.
const MAX_SECANT_STEPS: usize = 12;
/// The first secant step, out of flutter.
const FIRST_SECANT_STEP: f64 = 1e-6;
/// Dissipative terms below this share of all velocity terms are rounding.
const DISSIPATION_ROUNDING: f64 = 1e-12;
/// Largest distance along the branch between the place where growth exceeds rounding and the crossing of the
/// imaginary axis. It is four of the longest default steps; a secant that leads farther has failed.
const MAX_DISTANCE_TO_AXIS: f64 = 0.2;

/// The enclosed change of the number of growing pairs between two points.
struct Enclosed<M: Constraints> {
    /// A point with flutter, next to where it begins or ends.
    flutter: Sample<M>,
    /// The sign of the distance along the branch that leads from there into flutter.
    inward: f64,
    /// The width of the enclosing interval along the branch.
    width: f64,
    /// Growth rates below this share of the frequency count as zero.
    least_growth: f64,
}

/// The number of pairs of eigenvalues that oscillate and grow.
fn growing_pairs(eigenvalues: &[Complex<f64>], least: f64) -> usize {
    eigenvalues.iter().filter(|x| x.im > 0.0 && grows(x, least)).count()
}

/// Whether an eigenvalue oscillates and grows by more than a share of its size.
fn grows(x: &Complex<f64>, least: f64) -> bool {
    x.re > least * x.norm() && x.im.abs() > MIN_RELATIVE_GROWTH * x.norm()
}

/// The least relative growth that counts between two points: smaller than usual if a verdict there is
/// flutter, which is decided by error bounds.
fn least_growth(a: &Stability, b: &Stability) -> f64 {
    let flutters = |one: &&Stability| matches!(one.verdict, StabilityVerdict::Flutter { .. });
    let most = |of: &Stability| {
        let swings = of.eigenvalues.iter().filter(|x| x.im > MIN_RELATIVE_GROWTH * x.norm());
        swings.map(|x| x.re / x.norm()).fold(0.0, f64::max)
    };
    let certain = [a, b].into_iter().filter(flutters).map(most).filter(|most| *most > 0.0);
    certain.map(|most| CERTAIN_GROWTH_SHARE * most).fold(MIN_RELATIVE_GROWTH, f64::min)
}

/// The oscillating eigenvalue nearest to another one.
fn nearest_pair(eigenvalues: &[Complex<f64>], like: Complex<f64>) -> Option<Complex<f64>> {
    let swings = eigenvalues.iter().filter(|x| x.im > 0.5 * MIN_RELATIVE_GROWTH * x.norm());
    swings.min_by(|a, b| (*a - like).norm().total_cmp(&(*b - like).norm())).copied()
}

/// The eigenvalues of small motions about a point.
fn spectrum<M: Constraints>(sample: &Sample<M>) -> Option<Vec<Complex<f64>>> {
    linearize(&sample.balance.model, &sample.point().state, &[]).ok()?.eigenvalues().ok()
}

impl<M: Constraints + Powers> Tracer<'_, M> {
    /// Looks for the beginning or the end of flutter between the last two points, and adds it.
    pub(super) fn find_flutter_onset(&mut self, a: &Sample<M>, b: &Sample<M>) {
        let [.., before, after] = &self.points[..] else { return };
        let (Ok(of_a), Ok(of_b)) = (&before.stability, &after.stability) else { return };
        let least = least_growth(of_a, of_b);
        let counts = [&of_a.eigenvalues, &of_b.eigenvalues].map(|all| growing_pairs(all, least));
        if counts[0] == counts[1] {
            return;
        }
        let Some(found) = self.enclose_flutter(a, b, counts, least) else { return };
        let Some(all) = spectrum(&found.flutter) else { return };
        let growing = || all.iter().filter(|x| x.im > 0.0 && grows(x, least));
        // Flutter becomes divergence if a growing pair is nearer to the real axis than to the imaginary one.
        let to_axis = growing().map(|x| x.re / x.norm()).fold(f64::INFINITY, f64::min);
        let to_real = growing().min_by(|x, y| (x.im / x.norm()).total_cmp(&(y.im / y.norm())));
        let slope = found.flutter.tangent.p[0].abs();
        if let Some(real) = to_real.filter(|x| x.im / x.norm() < to_axis) {
            let kind = SpecialKind::FlutterDivergence { growth: real.re };
            let uncertainty = (found.width + self.distance_to_onset(&found, |x| x.im)) * slope;
            return self.add(kind, &found.flutter.balance, uncertainty, None, None);
        }
        // The pair whose growth begins. Pairs that do not grow may be nearer to the axis and are left out.
        let nearest = growing().min_by(|x, y| (x.re / x.norm()).total_cmp(&(y.re / y.norm())));
        let Some(first) = nearest.copied() else { return };
        if !is_damped(&found.flutter) {
            let kind = SpecialKind::FrequenciesMeet { frequency: first.im };
            let uncertainty = (found.width + self.distance_to_onset(&found, |x| x.re)) * slope;
            return self.add(kind, &found.flutter.balance, uncertainty, None, None);
        }
        let (sample, frequency, width) = self.on_axis(found, first);
        let uncertainty = width * slope + f64::EPSILON * sample.point().p[0].abs();
        self.add(SpecialKind::Hopf { frequency }, &sample.balance, uncertainty, None, None);
    }

    /// Halves the step until the change of the number of growing pairs is enclosed to rounding.
    fn enclose_flutter(
        &self,
        a: &Sample<M>,
        b: &Sample<M>,
        counts: [usize; 2],
        least: f64,
    ) -> Option<Enclosed<M>> {
        let (mut lo, mut hi) = (0.0, self.distance_ahead(a, b));
        let begins = counts[1] > counts[0];
        let mut flutter = self.duplicate(if begins { b } else { a })?;
        for _ in 0..MAX_BISECTIONS {
            let s = 0.5 * (lo + hi);
            if s <= lo || s >= hi {
                break;
            }
            let Ok((sample, _)) = self.point_at(a, s, hi) else { break };
            // The iteration for eigenvalues may fail where two meet: the onset is then between these ends.
            let Some(all) = spectrum(&sample) else { break };
            let is_first = growing_pairs(&all, least) == counts[0];
            (lo, hi) = if is_first { (s, hi) } else { (lo, s) };
            if is_first != begins {
                flutter = sample;
            }
        }
        Some(Enclosed {
            flutter,
            inward: if begins { 1.0 } else { -1.0 },
            width: hi - lo,
            least_growth: least,
        })
    }

    /// The distance along the branch from the enclosed point back to the onset, of a quantity that begins as
    /// a square root of the distance, by its values there and a little farther on.
    fn distance_to_onset(&self, found: &Enclosed<M>, of: impl Fn(&Complex<f64>) -> f64) -> f64 {
        let least_value = |sample: &Sample<M>| {
            let all = spectrum(sample)?;
            all.iter().filter(|x| x.im > 0.0 && grows(x, found.least_growth)).map(&of).reduce(f64::min)
        };
        let ends =
            self.point_at(&found.flutter, found.inward * ONSET_PROBE_DISTANCE, MAX_PROBE_CORRECTION).ok();
        let ends = ends.and_then(|(further, _)| Some([least_value(&found.flutter)?, least_value(&further)?]));
        ends.map_or(ONSET_PROBE_DISTANCE, |[here, there]| {
            ONSET_PROBE_DISTANCE * here * here / (there * there - here * here).max(f64::MIN_POSITIVE)
        })
    }

    /// The point where the real part of a pair is zero, by the secant method, with the frequency and the
    /// error along the branch. It starts beside the axis, where growth exceeds rounding.
    fn on_axis(&self, found: Enclosed<M>, first: Complex<f64>) -> (Sample<M>, f64, f64) {
        let from = found.flutter;
        let (mut x, mut f) = ([0.0, -FIRST_SECANT_STEP * found.inward], first.re);
        let mut best: Option<(Sample<M>, f64, f64)> = None;
        for _ in 0..MAX_SECANT_STEPS {
            let Ok((sample, _)) = self.point_at(&from, x[1], MAX_DISTANCE_TO_AXIS) else { break };
            let Some(value) = spectrum(&sample).and_then(|all| nearest_pair(&all, first)) else { break };
            let slope = (value.re - f) / (x[1] - x[0]);
            let step = -value.re / slope;
            // The slope over the whole distance from the start is more accurate than that of the last step.
            let mean_slope = ((value.re - first.re) / x[1]).abs();
            let rounding = EIGENVALUE_ERROR_IN_EPSILONS * f64::EPSILON * value.norm();
            best = Some((sample, value.im, (value.re.abs() + rounding) / mean_slope));
            let is_there = value.re.abs() <= 0.1 * rounding || step.abs() <= 1e-15 || x[1] + step == x[1];
            if is_there || !(step.is_finite() && (x[1] + step).abs() < MAX_DISTANCE_TO_AXIS) {
                break;
            }
            (x, f) = ([x[1], x[1] + step], value.re);
        }
        best.filter(|(.., width)| width.is_finite()).unwrap_or((from, first.im, MAX_DISTANCE_TO_AXIS))
    }
}

/// Whether a force depends on velocities and changes the energy.
fn is_damped<M: Constraints>(sample: &Sample<M>) -> bool {
    let largest = |m: &DMatrix<f64>| m.iter().fold(0.0, |most: f64, x| most.max(x.abs()));
    let linear = linearize(&sample.balance.model, &sample.point().state, &[]);
    linear
        .is_ok_and(|linear| largest(&linear.dissipative()) > DISSIPATION_ROUNDING * largest(&linear.damping))
}
