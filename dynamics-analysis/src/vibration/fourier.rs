//! The spectrum of samples.
//!
//! The discrete Fourier transform X_k = Σ xⱼ wⱼ e^{−2πi jk/n} of n samples under a window w, by powers of two
//! (Cooley & Tukey, Math. Comp. 19 (1965) 297), of other lengths as a convolution of such (L. I. Bluestein,
//! IEEE Trans. Audio 18 (1970) 451). Amplitudes are 2|X_k|/Σw (half of that at 0 and at the highest frequency
//! of an even number), so that a sine of amplitude a in the middle of a bin shows a; beside it the window's
//! scalloping takes up to 36 % (rectangular), 15 % (Hann), 0.1 % (flat top). A window widens noise by its
//! equivalent noise bandwidth, n Σw²/(Σw)² bins: 1, 1.5, 3.77 (G. Heinzel, A. Rüdiger & R. Schilling,
//! *Spectrum and spectral density estimation by the DFT*, Albert-Einstein-Institut 2002). It is written here:
//! a hundred lines with tests are easier to maintain than a dependency.

use alloc::vec::Vec;
use core::f64::consts::{PI, TAU};

use dynamics_view::{Axis, Chart, Panel, Series};
use nalgebra::Complex;

use super::VibrationError;

/// The window, which lets samples fade in and out so that frequencies between bins do not leak into all
/// others.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Window {
    /// Rectangular, no fading: for samples of whole periods.
    Rectangular,
    /// ½ − ½ cos: the usual choice; resolves neighbours two bins apart.
    #[default]
    Hann,
    /// Four cosines (ISO 18431-2): right amplitudes wherever the frequency lies, neighbours five bins apart.
    FlatTop,
}

impl Window {
    /// Coefficients of Σ (−1)^k a_k cos(2πkj/n).
    fn cosines(self) -> &'static [f64] {
        match self {
            Self::Rectangular => &[1.0],
            Self::Hann => &[0.5, 0.5],
            Self::FlatTop => &[1.0, 1.933, 1.286, 0.388, 0.0322],
        }
    }

    /// Number of bins from 0 on in which the mean of the samples appears: half of the main lobe. Beyond it a
    /// sum of cosines is exactly 0.
    fn main_lobe_bins(self) -> usize {
        self.cosines().len()
    }

    /// n values, one period of the window.
    #[must_use]
    pub fn values(self, n: usize) -> Vec<f64> {
        let at =
            |j: usize| {
                let angle = TAU * j as f64 / n as f64;
                let terms = self.cosines().iter().enumerate();
                terms
                    .map(|(k, a)| {
                        if k % 2 == 0 { a * (k as f64 * angle).cos() } else { -a * (k as f64 * angle).cos() }
                    })
                    .sum()
            };
        (0..n).map(at).collect()
    }
}

/// Amplitudes over frequencies, of samples at equal distances.
#[derive(Clone, Debug, PartialEq)]
pub struct Spectrum {
    /// ω of each bin, from 0 to half the sampling rate, in rad/s.
    pub frequencies: Vec<f64>,
    /// The amplitude of a sine there: 2|X|/Σw. The first bins show the mean as well, 1 of a rectangular
    /// window, 2 of Hann's, 5 of the flat top.
    pub amplitudes: Vec<f64>,
    /// Its phase at the first sample in rad, of a cosine.
    pub phases: Vec<f64>,
    /// The arithmetic mean of the samples.
    pub mean: f64,
    /// Distance of the bins, in rad/s.
    pub resolution: f64,
    /// Equivalent noise bandwidth of the window, in rad/s.
    pub noise_bandwidth: f64,
    /// The window.
    pub window: Window,
}

impl Spectrum {
    /// Of samples, `interval` seconds apart.
    ///
    /// # Errors
    /// Fewer than four samples, one that is not finite, and an interval that is not positive.
    pub fn of(samples: &[f64], interval: f64, window: Window) -> Result<Self, VibrationError> {
        check_samples(samples, interval, 4)?;
        let n = samples.len();
        // The transform of the windowed samples.
        let weights = window.values(n);
        let sum: f64 = weights.iter().sum();
        let mut values: Vec<Complex<f64>> =
            samples.iter().zip(&weights).map(|(x, w)| Complex::new(x * w, 0.0)).collect();
        transform(&mut values);
        let resolution = TAU / (n as f64 * interval);
        let bins = n / 2 + 1;
        // All bins but the first and the last have a conjugate at the negative frequency.
        let sides = |k: usize| if k == 0 || 2 * k == n { 1.0 } else { 2.0 };
        Ok(Self {
            frequencies: (0..bins).map(|k| k as f64 * resolution).collect(),
            amplitudes: (0..bins).map(|k| sides(k) * values[k].norm() / sum).collect(),
            phases: (0..bins).map(|k| values[k].arg()).collect(),
            mean: samples.iter().map(|x| x / n as f64).sum(),
            resolution,
            noise_bandwidth: resolution * n as f64 * weights.iter().map(|w| w * w).sum::<f64>() / (sum * sum),
            window,
        })
    }

    /// The amplitude in the bin nearest to a frequency in rad/s; in the first bins the mean is part of it,
    /// see [`Self::amplitudes`].
    ///
    /// # Errors
    /// A frequency beyond half the sampling rate, and one that is not 0 or positive.
    pub fn amplitude_near(&self, frequency: f64) -> Result<f64, VibrationError> {
        if !(frequency.is_finite() && frequency >= 0.0) {
            let must_be = "0 or a positive number of rad/s";
            return Err(VibrationError::Value { what: "a frequency", value: frequency, must_be });
        }
        let bin = (frequency / self.resolution).round();
        match self.amplitudes.get(bin as usize) {
            Some(amplitude) => Ok(*amplitude),
            None => {
                let nyquist = self.frequencies.last().copied().unwrap_or(0.0);
                Err(VibrationError::BeyondNyquist { frequency, nyquist })
            }
        }
    }

    /// Frequencies and amplitudes of the `count` highest peaks, highest first; each is the bin at which it
    /// stands. The mean is not among them: peaks are sought beyond the bins in which it appears, the first 1
    /// of a rectangular window, 2 of Hann's, 5 of the flat top. Lower frequencies cannot be distinguished
    /// from the mean; sample for longer.
    #[must_use]
    pub fn highest(&self, count: usize) -> Vec<(f64, f64)> {
        let a = &self.amplitudes;
        let first = self.window.main_lobe_bins();
        let before = |k: usize| if k == first { self.without_mean(k - 1) } else { a[k - 1] };
        let is_peak = |k: &usize| a[*k] > before(*k) && (k + 1 == a.len() || a[*k] >= a[k + 1]);
        let mut peaks: Vec<usize> = (first..a.len()).filter(is_peak).collect();
        peaks.sort_by(|i, j| a[*j].total_cmp(&a[*i]));
        peaks.into_iter().take(count).map(|k| (self.frequencies[k], a[k])).collect()
    }

    /// The amplitude of a bin of the main lobe without the mean. Two estimates of the mean are subtracted:
    /// the arithmetic one, which contains a part of slow components unless whole periods were sampled, and
    /// the windowed one, which contains components within the lobe. The larger rest counts, so that the flank
    /// of a slow component is not taken for a peak.
    fn without_mean(&self, bin: usize) -> f64 {
        let cosines = self.window.cosines();
        let sign = if bin.is_multiple_of(2) { 1.0 } else { -1.0 };
        let window_factor = sign * cosines[bin] / cosines[0];
        let of = |k: usize| Complex::from_polar(self.amplitudes[k], self.phases[k]);
        [self.mean, of(0).re].iter().map(|mean| (of(bin) - window_factor * mean).norm()).fold(0.0, f64::max)
    }

    /// Amplitudes over frequency, both by their logarithms, from the first bin on in which no mean shows (see
    /// [`Self::highest`]), with a known curve for comparison (left out if it is empty).
    #[must_use]
    pub fn chart(&self, title: &str, known: impl IntoIterator<Item = (f64, f64)>) -> Chart {
        let points = self.frequencies.iter().copied().zip(self.amplitudes.iter().copied());
        let points = points.skip(self.window.main_lobe_bins());
        let panel = Panel::new(Axis::log("ω in rad/s"), Axis::log("amplitude"))
            .series(Series::new("samples", points));
        let known: Vec<(f64, f64)> = known.into_iter().collect();
        let panel = if known.is_empty() { panel } else { panel.series(Series::new("analytic", known)) };
        Chart::new(title).panel(panel)
    }
}

/// Checks samples at equal distances.
pub(super) fn check_samples(samples: &[f64], interval: f64, needed: usize) -> Result<(), VibrationError> {
    if samples.len() < needed {
        return Err(VibrationError::TooFew { what: "samples", count: samples.len(), needed });
    }
    if !(interval.is_finite() && interval > 0.0) {
        let (what, must_be) = ("the interval between samples", "a positive number of seconds");
        return Err(VibrationError::Value { what, value: interval, must_be });
    }
    match samples.iter().find(|x| !x.is_finite()) {
        Some(value) => {
            Err(VibrationError::Value { what: "a sample", value: *value, must_be: "a finite number" })
        }
        None => Ok(()),
    }
}

/// The discrete Fourier transform X_k = Σⱼ xⱼ e^{−2πi jk/n}, of any length, in O(n log n).
///
/// [`Spectrum`] scales it to amplitudes of a sampled motion.
#[must_use]
pub fn fourier_transform(samples: &[Complex<f64>]) -> Vec<Complex<f64>> {
    let mut values = samples.to_vec();
    transform(&mut values);
    values
}

/// Its inverse, xⱼ = 1/n Σ_k X_k e^{2πi jk/n}.
#[must_use]
pub fn inverse_fourier_transform(values: &[Complex<f64>]) -> Vec<Complex<f64>> {
    // The conjugate of the transform of the conjugate.
    let mut samples: Vec<Complex<f64>> = values.iter().map(Complex::conj).collect();
    transform(&mut samples);
    let n = values.len() as f64;
    samples.iter_mut().for_each(|x| *x = x.conj() / n);
    samples
}

/// The convolution Σᵢ aᵢ b_{k−i} of two sequences, as long as both together less one, in O(n log n):
/// the response of a filter, or of a system by its response to an impulse, which the interval of the samples
/// multiplies. Rounding is 1e-15 of the largest value, not of each. It is empty where one of them is.
#[must_use]
pub fn convolve(a: &[f64], b: &[f64]) -> Vec<f64> {
    if a.is_empty() || b.is_empty() {
        return Vec::new();
    }
    let count = a.len() + b.len() - 1;
    let length = count.next_power_of_two();
    let at = |x: &[f64], k: usize| x.get(k).copied().unwrap_or(0.0);
    // Both transforms at once: a is the even part of the transform of a + ib, b the odd one.
    let mut both: Vec<Complex<f64>> = (0..length).map(|k| Complex::new(at(a, k), at(b, k))).collect();
    by_powers_of_two(&mut both);
    let product = |k: usize| {
        let (here, there) = (both[k], both[(length - k) % length].conj());
        (here + there) * (here - there) * Complex::new(0.0, -0.25)
    };
    let products: Vec<Complex<f64>> = (0..length).map(product).collect();
    let mut out: Vec<f64> = inverse_fourier_transform(&products).iter().map(|x| x.re).collect();
    out.truncate(count);
    out
}

/// The transform in place, of any length: by powers of two, or as a convolution of such.
pub(super) fn transform(x: &mut [Complex<f64>]) {
    let n = x.len();
    if n.is_power_of_two() {
        by_powers_of_two(x);
        return;
    }
    // jk = ½ j² + ½ k² − ½ (k − j)²: a convolution with e^{iπ j²/n}; j² modulo 2n, so that no angle grows
    // large.
    let chirp = |j: usize| {
        let square = (j as u128 * j as u128 % (2 * n as u128)) as f64;
        Complex::from_polar(1.0, -PI * square / n as f64)
    };
    let length = (2 * n).next_power_of_two();
    let mut a = alloc::vec![Complex::new(0.0, 0.0); length];
    let mut b = a.clone();
    for j in 0..n {
        a[j] = x[j] * chirp(j);
        b[j] = chirp(j).conj();
        b[(length - j) % length] = b[j];
    }
    by_powers_of_two(&mut a);
    by_powers_of_two(&mut b);
    // The inverse transform is the conjugate of the transform of the conjugate.
    a.iter_mut().zip(&b).for_each(|(x, y)| *x = (*x * y).conj());
    by_powers_of_two(&mut a);
    for (k, x) in x.iter_mut().enumerate() {
        *x = a[k].conj() / length as f64 * chirp(k);
    }
}

/// The transform in place of 2^k samples: bit reversal, then butterflies.
fn by_powers_of_two(x: &mut [Complex<f64>]) {
    let n = x.len();
    let bits = n.trailing_zeros();
    for i in 0..n {
        let j = if bits == 0 { 0 } else { i.reverse_bits() >> (usize::BITS - bits) };
        if i < j {
            x.swap(i, j);
        }
    }
    // Each factor has its own sine and cosine. Products of factors would accumulate rounding.
    let factors: Vec<Complex<f64>> =
        (0..n / 2).map(|k| Complex::from_polar(1.0, -TAU * k as f64 / n as f64)).collect();
    let mut half = 1;
    while half < n {
        for start in (0..n).step_by(2 * half) {
            for k in 0..half {
                let turned = x[start + half + k] * factors[k * (n / (2 * half))];
                let own = x[start + k];
                (x[start + k], x[start + half + k]) = (own + turned, own - turned);
            }
        }
        half *= 2;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn transforms_of_every_length_are_the_sums_that_define_them() {
        for n in [1, 2, 3, 4, 5, 7, 8, 12, 30, 64, 97, 100, 128, 255] {
            let samples: Vec<Complex<f64>> = (0..n)
                .map(|j| Complex::new((1.3 * j as f64).sin() + 0.2, (0.7 * (j * j) as f64).cos()))
                .collect();
            let mut found = samples.clone();
            transform(&mut found);
            for (k, found) in found.iter().enumerate() {
                let term = |(j, x): (usize, &Complex<f64>)| {
                    x * Complex::from_polar(1.0, -TAU * ((j * k) % n) as f64 / n as f64)
                };
                let wanted: Complex<f64> = samples.iter().enumerate().map(term).sum();
                assert!((found - wanted).norm() < 2e-14 * (n as f64), "{n} {k}: {found} {wanted}");
            }
        }
    }

    #[test]
    fn inverse_transforms_give_the_samples_back() {
        for n in [0, 1, 2, 3, 8, 12, 97, 128] {
            let samples: Vec<Complex<f64>> = (0..n)
                .map(|j| Complex::new((1.3 * f64::from(j)).sin(), (0.7 * f64::from(j * j)).cos()))
                .collect();
            let again = inverse_fourier_transform(&fourier_transform(&samples));
            assert_eq!(again.len(), samples.len());
            for (x, y) in again.iter().zip(&samples) {
                assert!((x - y).norm() < 1e-14, "{n}: {x} {y}");
            }
        }
    }

    #[test]
    fn convolutions_are_the_sums_that_define_them() {
        for (m, n) in [(1, 1), (1, 7), (5, 3), (64, 64), (100, 17)] {
            let [a, b] = [(m, 1.3), (n, 0.4)].map(|(n, x): (i32, f64)| {
                (0..n).map(|k| (x * f64::from(k)).cos() + 0.1).collect::<Vec<f64>>()
            });
            let found = convolve(&a, &b);
            assert_eq!(found.len(), a.len() + b.len() - 1);
            for (k, found) in found.iter().enumerate() {
                let terms = a.iter().enumerate().filter(|(i, _)| *i <= k);
                let wanted: f64 = terms.filter_map(|(i, a)| Some(a * b.get(k - i)?)).sum();
                assert!((found - wanted).abs() < 1e-13, "{m} {n} {k}: {found} {wanted}");
            }
        }
        assert!(convolve(&[], &[1.0]).is_empty());
    }

    #[test]
    fn windows_have_their_noise_bandwidths() {
        for (window, wanted) in [
            (Window::Rectangular, 1.0),
            (Window::Hann, 1.5),
            (
                Window::FlatTop,
                1.0 + 0.5 * (1.933f64.powi(2) + 1.286f64.powi(2) + 0.388f64.powi(2) + 0.0322f64.powi(2)),
            ),
        ] {
            let spectrum = Spectrum::of(&[1.0; 64], 0.1, window).expect("samples");
            assert!((spectrum.noise_bandwidth / spectrum.resolution - wanted).abs() < 1e-13, "{spectrum:?}");
            // The mean shows as itself.
            assert!((spectrum.amplitudes[0] - 1.0).abs() < 1e-15);
        }
    }
}
