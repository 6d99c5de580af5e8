//! A frequency response from samples of its input and its output: the H₁ estimate with its coherence.
//!
//! Both signals are divided into segments that overlap by half. Each has its mean taken off and is multiplied
//! by a window; products of their transforms are averaged over the segments (P. D. Welch, IEEE Trans. Audio
//! 15 (1967) 70): S_xx = Σ|X|², S_yy = Σ|Y|², S_xy = Σ X̄Y. Then H₁ = S_xy/S_xx, which noise in the
//! output does not bias, and γ² = |S_xy|²/(S_xx S_yy), the share of the output's power that the input
//! explains (J. S. Bendat & A. G. Piersol, *Random Data*, 4th ed., §6.1 and §9.2). H₂ = S_yy/S̄_xy =
//! H₁/γ² is not biased by noise in the input.

use alloc::vec::Vec;
use core::f64::consts::TAU;

use dynamics_view::{Axis, Chart, Panel, Series};
use nalgebra::Complex;

use super::VibrationError;
use super::fourier::{Window, check_samples, transform};

/// A bin in which the input has less than this part of its largest power has rounding alone.
const LEAST_POWER: f64 = 1e-24;

/// An estimate of a frequency response H(iω).
#[derive(Clone, Debug, PartialEq)]
pub struct ResponseEstimate {
    /// ω of each bin, from the first above 0 to half the sampling rate, in rad/s.
    pub frequencies: Vec<f64>,
    /// H₁, with the sign of the phase that [`FrequencyResponse`](super::FrequencyResponse) has: an output
    /// that lags has a negative one. NaN where the input has no power.
    pub h1: Vec<Complex<f64>>,
    /// γ², from 0 to 1; 0 where the input has no power. Below 1 there is noise, another input, leakage
    /// between bins, or the system is not linear.
    pub coherence: Vec<f64>,
    /// The number of segments.
    pub segments: usize,
    /// Distance of the bins, in rad/s.
    pub resolution: f64,
    /// The window.
    pub window: Window,
}

impl ResponseEstimate {
    /// Of samples of input and output, `interval` seconds apart, in segments of `length` samples that overlap
    /// by half. Long segments resolve narrow resonances, many segments average noise. Samples at the end that
    /// fill no segment are left out.
    ///
    /// # Errors
    /// Input and output of different lengths, a sample that is not finite, an interval that is not positive,
    /// segments shorter than four samples, and fewer than two segments: the coherence of one is always 1.
    pub fn of(
        input: &[f64],
        output: &[f64],
        interval: f64,
        length: usize,
        window: Window,
    ) -> Result<Self, VibrationError> {
        check_samples(input, interval, 4)?;
        check_samples(output, interval, 4)?;
        if input.len() != output.len() {
            let must_be = "as many as those of the input";
            let value = output.len() as f64;
            return Err(VibrationError::Value { what: "the number of the output's samples", value, must_be });
        }
        if length < 4 {
            return Err(VibrationError::TooFew { what: "samples of a segment", count: length, needed: 4 });
        }
        let hop = length.div_ceil(2);
        let segments = if input.len() < length { 0 } else { (input.len() - length) / hop + 1 };
        if segments < 2 {
            return Err(VibrationError::TooFew { what: "segments", count: segments, needed: 2 });
        }
        let (bins, weights) = (length / 2 + 1, window.values(length));
        let (mut xx, mut yy) = (alloc::vec![0.0; bins], alloc::vec![0.0; bins]);
        let mut xy = alloc::vec![Complex::new(0.0, 0.0); bins];
        for segment in 0..segments {
            let part = segment * hop..segment * hop + length;
            let [x, y] = [&input[part.clone()], &output[part]].map(|samples| spectrum(samples, &weights));
            for (k, (x, y)) in x.iter().zip(&y).take(bins).enumerate() {
                xx[k] += x.norm_sqr();
                yy[k] += y.norm_sqr();
                xy[k] += x.conj() * y;
            }
        }
        let least = LEAST_POWER * xx.iter().copied().fold(0.0, f64::max);
        let resolution = TAU / (length as f64 * interval);
        let has_power = |k: usize| xx[k] > least;
        let h1 = |k: usize| if has_power(k) { xy[k] / xx[k] } else { Complex::new(f64::NAN, f64::NAN) };
        let coherence = |k: usize| {
            let whole = xx[k] * yy[k];
            if has_power(k) && whole > 0.0 { (xy[k].norm_sqr() / whole).min(1.0) } else { 0.0 }
        };
        // Without the bin at 0, of which the means were taken off.
        Ok(Self {
            frequencies: (1..bins).map(|k| k as f64 * resolution).collect(),
            h1: (1..bins).map(h1).collect(),
            coherence: (1..bins).map(coherence).collect(),
            segments,
            resolution,
            window,
        })
    }

    /// H₂ = H₁/γ²: not biased by noise in the input, but by noise in the output. |H| lies between
    /// |H₁| and
    /// |H₂| where noise is in both. Not finite where the coherence is 0.
    #[must_use]
    pub fn h2(&self) -> Vec<Complex<f64>> {
        self.h1.iter().zip(&self.coherence).map(|(h1, coherence)| h1 / *coherence).collect()
    }

    /// The standard deviation of |H₁| relative to itself, √((1 − γ²)/(2γ² n)) for n independent
    /// segments (Bendat & Piersol, §9.2.4). Segments that overlap by half are nearly independent under
    /// Hann's window, and less so under a rectangular one. Infinite where the coherence is 0: nothing is
    /// known of H₁ there.
    #[must_use]
    pub fn relative_spread(&self) -> Vec<f64> {
        let n = self.segments as f64;
        self.coherence.iter().map(|coherence| ((1.0 - coherence) / (2.0 * coherence * n)).sqrt()).collect()
    }

    /// |H₁| and the coherence over frequency.
    #[must_use]
    pub fn chart(&self, title: &str) -> Chart {
        let points = |values: Vec<f64>| self.frequencies.clone().into_iter().zip(values);
        let magnitude = self.h1.iter().map(|value| value.norm()).collect();
        let magnitude = Panel::new(Axis::log("ω in rad/s"), Axis::log("|H₁|"))
            .series(Series::new("estimate", points(magnitude)));
        let coherence = Panel::new(Axis::log("ω in rad/s"), Axis::new("γ²"))
            .series(Series::new("coherence", points(self.coherence.clone())));
        Chart::new(title).panel(magnitude).panel(coherence)
    }
}

/// The transform of a segment without its mean, under a window.
fn spectrum(samples: &[f64], weights: &[f64]) -> Vec<Complex<f64>> {
    let mean = samples.iter().sum::<f64>() / samples.len() as f64;
    let mut values: Vec<Complex<f64>> =
        samples.iter().zip(weights).map(|(x, w)| Complex::new((x - mean) * w, 0.0)).collect();
    transform(&mut values);
    values
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random_numbers::RandomNumbers;
    use crate::vibration::convolve;

    fn noise(seed: u64, count: usize) -> Vec<f64> {
        let mut random = RandomNumbers(seed);
        (0..count).map(|_| random.within([-1.0, 1.0])).collect()
    }

    /// H(iω) of a filter with these weights.
    fn filter(weights: &[f64], angle: f64) -> Complex<f64> {
        let term = |(j, w): (usize, &f64)| Complex::from_polar(*w, -angle * j as f64);
        weights.iter().enumerate().map(term).sum()
    }

    #[test]
    fn filters_have_their_response() {
        let (interval, weights) = (0.01, [1.0, 0.3, 0.0, -0.2]);
        let input = noise(3, 40_000);
        let mut output = convolve(&input, &weights);
        output.truncate(input.len());
        let found = ResponseEstimate::of(&input, &output, interval, 512, Window::Hann).expect("signals");
        assert_eq!((found.frequencies.len(), found.segments), (256, 155));
        for (k, omega) in found.frequencies.iter().enumerate() {
            let expected = filter(&weights, omega * interval);
            assert!((found.h1[k] - expected).norm() < 0.01, "{omega}: {} {expected}", found.h1[k]);
            assert!(found.coherence[k] > 0.99, "{omega}: {}", found.coherence[k]);
            assert!((found.h2()[k] - expected).norm() < 0.01, "{omega}");
        }
    }

    /// Noise of power p beside a signal of power 1: γ² = 1/(1 + p), H₁ without bias and H₂ too large.
    #[test]
    fn noise_lowers_the_coherence() {
        let (input, disturbance) = (noise(5, 200_000), noise(11, 200_000));
        let output: Vec<f64> = input.iter().zip(&disturbance).map(|(x, n)| 2.0 * x + 1.2 * n).collect();
        let found = ResponseEstimate::of(&input, &output, 0.1, 256, Window::Hann).expect("signals");
        let mean = |values: &[f64]| values.iter().sum::<f64>() / values.len() as f64;
        let expected = 1.0 / (1.0 + 0.36);
        assert!((mean(&found.coherence) - expected).abs() < 2e-3, "{}", mean(&found.coherence));
        let h1: Vec<f64> = found.h1.iter().map(|value| value.re).collect();
        assert!((mean(&h1) - 2.0).abs() < 5e-3, "{}", mean(&h1));
        let h2: Vec<f64> = found.h2().iter().map(|value| value.re).collect();
        assert!((mean(&h2) - 2.0 / expected).abs() < 1e-2, "{}", mean(&h2));
        // The spread told is the one seen.
        let seen = mean(&h1.iter().map(|x| (x - 2.0) * (x - 2.0)).collect::<Vec<_>>()).sqrt() / 2.0;
        let told = mean(&found.relative_spread());
        assert!((seen / told - 1.0).abs() < 0.15, "{seen} {told}");
    }

    /// A delay of three samples lags: its phase falls.
    #[test]
    fn outputs_that_lag_have_negative_phases() {
        let input = noise(9, 20_000);
        let output = [&[0.0; 3], &input[..input.len() - 3]].concat();
        let found = ResponseEstimate::of(&input, &output, 0.1, 1024, Window::Hann).expect("signals");
        let expected = -3.0 * 0.1 * found.frequencies[20];
        assert!((found.h1[20].arg() - expected).abs() < 0.02, "{} {expected}", found.h1[20].arg());
    }

    #[test]
    fn bins_without_input_have_no_response() {
        // Whole periods in every segment: bin 8 alone.
        let sine: Vec<f64> = (0..512).map(|k| (TAU * f64::from(k) / 16.0).sin()).collect();
        let found = ResponseEstimate::of(&sine, &sine, 0.1, 128, Window::Rectangular).expect("signals");
        assert!((found.h1[7] - Complex::new(1.0, 0.0)).norm() < 1e-14 && found.coherence[7] > 1.0 - 1e-14);
        assert!(found.h1[3].re.is_nan() && found.coherence[3] == 0.0, "{:?}", found.h1[3]);
        let silent = ResponseEstimate::of(&[0.0; 64], &sine[..64], 0.1, 16, Window::Hann).expect("signals");
        assert!(silent.h1.iter().all(|h| h.re.is_nan()) && silent.coherence.iter().all(|c| *c == 0.0));
    }

    #[test]
    fn bad_input_is_refused() {
        let x = noise(1, 100);
        let of = |y: &[f64], interval, length| ResponseEstimate::of(&x, y, interval, length, Window::Hann);
        assert!(matches!(of(&x[..99], 0.1, 32), Err(VibrationError::Value { .. })));
        assert!(matches!(of(&x, 0.0, 32), Err(VibrationError::Value { .. })));
        assert!(matches!(of(&x, 0.1, 3), Err(VibrationError::TooFew { .. })));
        assert!(matches!(of(&x, 0.1, 80), Err(VibrationError::TooFew { count: 1, .. })));
        assert!(matches!(of(&x, 0.1, 101), Err(VibrationError::TooFew { count: 0, .. })));
        let infinite = [&x[..99], &[f64::INFINITY]].concat();
        assert!(matches!(of(&infinite, 0.1, 32), Err(VibrationError::Value { .. })));
    }
}
