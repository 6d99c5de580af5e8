//! Damping from a free decay: the logarithmic decrement.
//!
//! A freely decaying oscillation x = x₀ + a e^{−ζωt} cos(ω_d t + φ) swings from one extreme to the
//! next by A_k, and A_k/A_{k+2} = e^δ with the logarithmic decrement δ = 2πζ/√(1 − ζ²). Swings are
//! differences of neighbouring extremes, so a constant offset x₀ drops out. The logarithms of all swings
//! are fitted by a straight line over k, whose slope is −δ/2; its scatter gives the spread. (S. S. Rao,
//! *Mechanical Vibrations*, 6th ed., §2.6.3; a fit to all swings in place of two: D. J. Ewins, *Modal
//! Testing*, 2nd ed., §4.)
//!
//! An extreme is that of the parabola of least squares through the samples within a sixth of half a period on
//! either side. The highest sample alone would be higher by the noise, whatever the swing, and damping would
//! seem too small. A parabola so wide is lower than the extreme by 3e-4 of the swing; of all swings that is
//! the same part, which leaves their ratios.

use alloc::vec::Vec;
use core::f64::consts::{PI, TAU};

use super::VibrationError;
use super::fourier::check_samples;

/// Fewest extremes: three swings, of which two fix the line and one shows the scatter.
const LEAST_EXTREMES: usize = 4;

/// Samples on either side of an extreme that its parabola goes through, in parts of half a period.
const WIDTH: f64 = 1.0 / 6.0;

/// Damping of a free decay.
#[derive(Clone, Debug, PartialEq)]
pub struct LogarithmicDecrement {
    /// δ, the logarithm of the ratio of amplitudes one period apart; negative where they grow.
    pub decrement: f64,
    /// Its standard error, from the scatter of the swings about the line.
    pub decrement_spread: f64,
    /// ζ = δ/√(4π² + δ²).
    pub damping_ratio: f64,
    /// Its standard error.
    pub damping_ratio_spread: f64,
    /// The frequency of the decay, ω_d, in rad/s.
    pub damped_frequency: f64,
    /// The frequency without damping, ω = ω_d/√(1 − ζ²), in rad/s.
    pub natural_frequency: f64,
    /// Times after the first sample, in s, and values of the extremes that were used, high and low in turn.
    pub extremes: Vec<(f64, f64)>,
}

impl LogarithmicDecrement {
    /// Of samples of a free decay, `interval` seconds apart. An extreme counts if the samples turn back by
    /// more than `least_swing` after it: noise needs a value above its own swings, without noise 0 uses all.
    ///
    /// Damping that is not viscous makes the logarithms of the swings a curve: compare the spread, and the
    /// results of the first and the last part of the samples.
    ///
    /// # Errors
    /// Fewer than four extremes, a sample that is not finite, an interval that is not positive, and a least
    /// swing that is negative or not finite. Extremes of noise that give a swing of 0, or that do not follow
    /// each other in time.
    pub fn of(samples: &[f64], interval: f64, least_swing: f64) -> Result<Self, VibrationError> {
        check_samples(samples, interval, 3)?;
        if !(least_swing.is_finite() && least_swing >= 0.0) {
            let must_be = "0 or a positive number";
            return Err(VibrationError::Value { what: "the least swing", value: least_swing, must_be });
        }
        let places = turning_points(samples, least_swing);
        let half_period = match &places[..] {
            [first, .., last] => (last - first) as f64 / (places.len() - 1) as f64,
            _ => 0.0,
        };
        let width = ((WIDTH * half_period).round() as usize).max(1);
        let found = places.iter().filter_map(|place| vertex(samples, *place, width));
        let extremes: Vec<(f64, f64)> = found.map(|(at, x)| (at * interval, x)).collect();
        if extremes.len() < LEAST_EXTREMES {
            let what = "extremes beyond the least swing";
            return Err(VibrationError::TooFew { what, count: extremes.len(), needed: LEAST_EXTREMES });
        }
        let swings: Vec<f64> = extremes.windows(2).map(|pair| (pair[1].1 - pair[0].1).abs()).collect();
        // Parabolas through noise may meet at one height, or far from the samples that turn back.
        if let Some(swing) = swings.iter().copied().find(|swing| !(*swing > 0.0 && swing.is_finite())) {
            let must_be = "a positive number; give a larger least swing";
            return Err(VibrationError::Value {
                what: "the swing from an extreme to the next",
                value: swing,
                must_be,
            });
        }
        let (slope, spread) = fitted_slope(&swings.iter().map(|swing| swing.ln()).collect::<Vec<_>>());
        let (decrement, decrement_spread) = (-2.0 * slope, 2.0 * spread);
        let length = TAU.hypot(decrement);
        let damping_ratio = decrement / length;
        let times: Vec<f64> = extremes.iter().map(|(t, _)| *t).collect();
        let half_period = fitted_slope(&times).0;
        if half_period.is_nan() || half_period <= 0.0 {
            let must_be = "a positive number; give a larger least swing";
            return Err(VibrationError::Value {
                what: "the time between extremes",
                value: half_period,
                must_be,
            });
        }
        let damped_frequency = PI / half_period;
        Ok(Self {
            decrement,
            decrement_spread,
            damping_ratio,
            // dζ/dδ = 4π²/(4π² + δ²)^{3/2}
            damping_ratio_spread: decrement_spread * TAU * TAU / (length * length * length),
            damped_frequency,
            // 1 − ζ² = 4π²/(4π² + δ²)
            natural_frequency: damped_frequency * length / TAU,
            extremes,
        })
    }
}

/// Indices of extremes after which the samples turn back by more than `least`. The first sample is none: the
/// decay may have begun before it.
fn turning_points(samples: &[f64], least: f64) -> Vec<usize> {
    let (mut low, mut high) = (0, 0);
    // Whether a maximum is sought; at first either.
    let mut rising = None;
    let mut found = Vec::new();
    for (i, x) in samples.iter().enumerate() {
        if *x > samples[high] {
            high = i;
        }
        if *x < samples[low] {
            low = i;
        }
        let falls = samples[high] - x > least;
        let rises = x - samples[low] > least;
        let extreme = match rising {
            None | Some(true) if falls => {
                rising = Some(false);
                low = i;
                high
            }
            None | Some(false) if rises => {
                rising = Some(true);
                high = i;
                low
            }
            _ => continue,
        };
        if extreme > 0 {
            found.push(extreme);
        }
    }
    found
}

/// The extreme of the parabola of least squares through a sample and `width` on either side: its place, in
/// samples, and its value; `None` near the ends of the samples.
fn vertex(samples: &[f64], mut at: usize, width: usize) -> Option<(f64, f64)> {
    let reach = width as f64;
    let mut moves = 2;
    loop {
        let near = samples.get(at.checked_sub(width)?..=at + width)?;
        let places = || near.iter().zip(0..).map(|(x, k)| (f64::from(k) - reach, *x));
        let n = 2.0 * reach + 1.0;
        let squares = reach * (reach + 1.0) * n / 3.0;
        let fourths = squares * (3.0 * reach * (reach + 1.0) - 1.0) / 5.0;
        let sum = |power: i32| places().map(|(k, x)| k.powi(power) * x).sum::<f64>();
        // x = c + s k + b k²; odd sums of places vanish.
        let (zeroth, slope, second) = (sum(0), sum(1) / squares, sum(2));
        let bend = (second - squares / n * zeroth) / (fourths - squares * squares / n);
        let constant = (zeroth - bend * squares) / n;
        // A plateau with noise may have its extreme far away.
        let shift = if bend == 0.0 { 0.0 } else { (-0.5 * slope / bend).clamp(-reach, reach) };
        // The highest sample stands beside the extreme where there is noise.
        if shift.abs() > 0.5 && moves > 0 {
            (at, moves) = ((at as f64 + shift).round() as usize, moves - 1);
            continue;
        }
        return Some((at as f64 + shift, constant + shift * (slope + bend * shift)));
    }
}

/// The slope of the line of least squares through values at 0, 1, 2, .., and its standard error.
fn fitted_slope(values: &[f64]) -> (f64, f64) {
    let n = values.len() as f64;
    let (center, mean) = (0.5 * (n - 1.0), values.iter().sum::<f64>() / n);
    let pairs = || values.iter().enumerate().map(|(k, y)| (k as f64 - center, y - mean));
    let squares: f64 = pairs().map(|(x, _)| x * x).sum();
    let slope = pairs().map(|(x, y)| x * y).sum::<f64>() / squares;
    let rest: f64 = pairs().map(|(x, y)| (y - slope * x) * (y - slope * x)).sum();
    (slope, (rest / (n - 2.0) / squares).sqrt())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random_numbers::RandomNumbers;

    const OMEGA: f64 = 12.0;
    const INTERVAL: f64 = 0.002;

    /// A decay about 0.3, sampled some 260 times per period.
    fn decay(zeta: f64, count: usize) -> Vec<f64> {
        let damped = OMEGA * (1.0 - zeta * zeta).sqrt();
        let at = |t: f64| 0.3 + 2.0 * (-zeta * OMEGA * t).exp() * (damped * t - 0.7).cos();
        (0..count).map(|k| at(k as f64 * INTERVAL)).collect()
    }

    #[test]
    fn decays_have_their_damping_ratio() {
        for zeta in [0.001, 0.02, 0.1, 0.3, -0.01] {
            let found = LogarithmicDecrement::of(&decay(zeta, 1000), INTERVAL, 0.0).expect("a decay");
            let decrement = TAU * zeta / (1.0 - zeta * zeta).sqrt();
            assert!((found.decrement - decrement).abs() < 1e-4, "{zeta}: {found:?}");
            assert!((found.damping_ratio - zeta).abs() < 2e-5, "{zeta}: {found:?}");
            assert!((found.natural_frequency / OMEGA - 1.0).abs() < 1e-5, "{zeta}: {found:?}");
            let damped = OMEGA * (1.0 - zeta * zeta).sqrt();
            assert!((found.damped_frequency / damped - 1.0).abs() < 1e-5, "{zeta}: {found:?}");
            assert!(found.damping_ratio_spread < 2e-5, "{zeta}: {found:?}");
        }
    }

    #[test]
    fn few_samples_per_period_err_little() {
        let every_13th: Vec<f64> = decay(0.02, 4000).into_iter().step_by(13).collect();
        let found = LogarithmicDecrement::of(&every_13th, 13.0 * INTERVAL, 0.0).expect("a decay");
        assert!((found.damping_ratio - 0.02).abs() < 5e-4, "{found:?}");
    }

    /// The true value lies within some spreads, and noise makes no extremes.
    #[test]
    fn noise_is_seen_in_the_spread() {
        let (zeta, mut random) = (0.03, RandomNumbers(7));
        let samples: Vec<f64> = decay(zeta, 2000).iter().map(|x| x + random.within([-0.01, 0.01])).collect();
        let found = LogarithmicDecrement::of(&samples, INTERVAL, 0.1).expect("a decay");
        let off = (found.damping_ratio - zeta).abs();
        assert!(off < 4.0 * found.damping_ratio_spread && off > 0.0, "{found:?}");
        assert!(found.damping_ratio_spread < 0.1 * zeta, "{found:?}");
        let swings = found.extremes.windows(2).map(|pair| (pair[1].1 - pair[0].1).abs());
        assert!(swings.into_iter().all(|swing| swing > 0.05) && found.extremes.len() < 20, "{found:?}");
    }

    #[test]
    fn noise_alone_gives_numbers_or_an_error() {
        let mut random = RandomNumbers(3);
        for _ in 0..2000 {
            let samples: Vec<f64> = (0..24).map(|_| random.within([0.0, 3.0]).floor()).collect();
            match LogarithmicDecrement::of(&samples, INTERVAL, 0.0) {
                Ok(found) => {
                    let numbers = [found.decrement, found.decrement_spread, found.damping_ratio_spread];
                    assert!(numbers.iter().all(|x| x.is_finite()), "{found:?} of {samples:?}");
                    assert!(found.damped_frequency > 0.0 && found.natural_frequency.is_finite(), "{found:?}");
                }
                Err(VibrationError::Value { value, .. }) => assert!(value <= 0.0, "{value}"),
                Err(_) => {}
            }
        }
    }

    /// The two extremes of one wrong sample are found at one place: a swing of zero.
    #[test]
    fn a_wrong_sample_asks_for_a_least_swing() {
        let mut samples: Vec<f64> = (0..240).map(|k| (PI * f64::from(k) / 30.0).cos()).collect();
        samples[63] += 0.5;
        let refused = LogarithmicDecrement::of(&samples, INTERVAL, 0.0);
        assert!(matches!(refused, Err(VibrationError::Value { value: 0.0, .. })), "{refused:?}");
        let found = LogarithmicDecrement::of(&samples, INTERVAL, 0.6).expect("an oscillation");
        assert!(found.decrement.abs() < 0.1 && found.extremes.len() > 5, "{found:?}");
    }

    #[test]
    fn what_is_no_decay_is_refused() {
        let of = LogarithmicDecrement::of;
        assert!(matches!(of(&[1.0, 2.0, 1.0, 2.0], 0.1, 0.0), Err(VibrationError::TooFew { count: 2, .. })));
        assert!(matches!(of(&[1.0, 2.0], 0.1, 0.0), Err(VibrationError::TooFew { needed: 3, .. })));
        assert!(matches!(of(&decay(0.01, 900), -0.1, 0.0), Err(VibrationError::Value { .. })));
        assert!(matches!(of(&decay(0.01, 900), 0.1, f64::NAN), Err(VibrationError::Value { .. })));
        assert!(matches!(of(&[f64::NAN; 9], 0.1, 0.0), Err(VibrationError::Value { .. })));
        assert!(matches!(of(&[1.0; 9], 0.1, 0.0), Err(VibrationError::TooFew { count: 0, .. })));
    }
}
