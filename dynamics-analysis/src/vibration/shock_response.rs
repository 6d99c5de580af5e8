//! The shock response spectrum: how far oscillators of all frequencies are driven by one motion of their
//! base.
//!
//! An oscillator on a base with the acceleration a(t) has z̈ + 2ζω ż + ω² z = −a, z its displacement
//! relative to the base. Between samples a is a straight line, for which the step from sample to sample is
//! exact: the transition of (z, ż) in closed form, and weights of the two samples (N. C. Nigam & P. C.
//! Jennings, Bull. Seismol. Soc. Am. 59 (1969) 909; as a filter: D. O. Smallwood, Shock Vib. Bull. 56 (1981)
//! 279; ISO 18431-4). The weights are integrals of the response to an impulse, by Gauss's rule of eight
//! points, which is exact to rounding for steps of at most [`LONGEST_ANGLE`] of the oscillation; longer ones
//! are divided. Largest values between samples are those of cubics through z and ż. After the last sample a
//! is 0, and the residual is the first extreme of the free decay, in closed form.

use alloc::vec::Vec;
use core::f64::consts::PI;

use dynamics_view::{Axis, Chart, Panel, Series};

use super::VibrationError;
use super::fourier::check_samples;

/// Longest step, in rad of the oscillation. A cubic then errs by (¼)⁴/384 = 1e-5 of the amplitude at most.
const LONGEST_ANGLE: f64 = 0.25;

/// Nodes and weights of Gauss's rule with eight points on (−1, 1), of the positive half.
const GAUSS: [(f64, f64); 4] = [
    (0.1834346424956498, 0.362683783378362),
    (0.525532409916329, 0.31370664587788727),
    (0.7966664774136267, 0.22238103445337448),
    (0.9602898564975362, 0.10122853629037626),
];

/// Largest responses of oscillators to one motion of their base.
#[derive(Clone, Debug, PartialEq)]
pub struct ShockResponseSpectrum {
    /// The frequencies without damping of the oscillators, in rad/s.
    pub frequencies: Vec<f64>,
    /// Their damping ratio ζ.
    pub damping_ratio: f64,
    /// The largest |z| while the base moves: the primary spectrum.
    pub primary: Vec<f64>,
    /// The largest |z| after the last sample, when the base moves evenly: the residual spectrum.
    pub residual: Vec<f64>,
}

impl ShockResponseSpectrum {
    /// Of accelerations of the base, `interval` seconds apart, the oscillators at rest relative to it at the
    /// first sample; ζ from 0 to below 1.
    ///
    /// # Errors
    /// Fewer than two samples, values that are not finite, an interval or a frequency that is not positive, a
    /// frequency beyond half the sampling rate, a damping ratio outside its range.
    pub fn of(
        accelerations: &[f64],
        interval: f64,
        frequencies: &[f64],
        damping_ratio: f64,
    ) -> Result<Self, VibrationError> {
        check_samples(accelerations, interval, 2)?;
        if !(0.0..1.0).contains(&damping_ratio) {
            let must_be = "from 0 to below 1";
            return Err(VibrationError::Value { what: "the damping ratio", value: damping_ratio, must_be });
        }
        let nyquist = PI / interval;
        for frequency in frequencies.iter().copied() {
            if !(frequency.is_finite() && frequency > 0.0) {
                let must_be = "a positive number of rad/s";
                return Err(VibrationError::Value { what: "a frequency", value: frequency, must_be });
            }
            if frequency > nyquist {
                return Err(VibrationError::BeyondNyquist { frequency, nyquist });
            }
        }
        let largest = frequencies.iter().map(|omega| {
            let oscillator = Oscillator::new(*omega, damping_ratio, interval);
            oscillator.largest(accelerations)
        });
        let (primary, residual) = largest.unzip();
        Ok(Self { frequencies: frequencies.to_vec(), damping_ratio, primary, residual })
    }

    /// The same with the quality factor Q = 1/(2ζ), above ½; 10 is usual for electronics.
    ///
    /// # Errors
    /// As [`Self::of`].
    pub fn with_quality(
        accelerations: &[f64],
        interval: f64,
        frequencies: &[f64],
        quality: f64,
    ) -> Result<Self, VibrationError> {
        if quality.is_nan() || quality <= 0.5 {
            let must_be = "above 1/2; 1/2 is critical damping";
            return Err(VibrationError::Value { what: "the quality factor", value: quality, must_be });
        }
        Self::of(accelerations, interval, frequencies, 0.5 / quality)
    }

    /// The largest |z| at any time, in the unit of the accelerations times s²: the maximax spectrum of
    /// relative displacements.
    #[must_use]
    pub fn relative_displacement(&self) -> Vec<f64> {
        self.primary.iter().zip(&self.residual).map(|(primary, residual)| primary.max(*residual)).collect()
    }

    /// ω times the largest |z|: the pseudo-velocity.
    #[must_use]
    pub fn pseudo_velocity(&self) -> Vec<f64> {
        self.times(|omega| omega)
    }

    /// ω² times the largest |z|: the pseudo-acceleration, which is the force in the spring divided by the
    /// mass. Without damping it is the largest acceleration of the mass.
    #[must_use]
    pub fn pseudo_acceleration(&self) -> Vec<f64> {
        self.times(|omega| omega * omega)
    }

    fn times(&self, factor: impl Fn(f64) -> f64) -> Vec<f64> {
        let largest = self.relative_displacement();
        self.frequencies.iter().zip(largest).map(|(omega, z)| factor(*omega) * z).collect()
    }

    /// The pseudo-acceleration over frequency, maximax and residual, both by their logarithms.
    #[must_use]
    pub fn chart(&self, title: &str) -> Chart {
        let points = |values: Vec<f64>| self.frequencies.clone().into_iter().zip(values);
        let residual: Vec<f64> =
            self.frequencies.iter().zip(&self.residual).map(|(omega, z)| omega * omega * z).collect();
        let panel = Panel::new(Axis::log("ω in rad/s"), Axis::log("pseudo-acceleration"))
            .series(Series::new("maximax", points(self.pseudo_acceleration())))
            .series(Series::new("residual", points(residual)));
        Chart::new(title).panel(panel)
    }
}

/// Steps of one oscillator.
struct Oscillator {
    omega: f64,
    zeta: f64,
    /// ω√(1 − ζ²).
    damped: f64,
    /// Steps from sample to sample, and their size.
    parts: usize,
    h: f64,
    /// (z, ż) at the end of a step by (z, ż) at its start and by a at its start and end.
    transition: [[f64; 2]; 2],
    weights: [[f64; 2]; 2],
}

impl Oscillator {
    fn new(omega: f64, zeta: f64, interval: f64) -> Self {
        let parts = (omega * interval / LONGEST_ANGLE).ceil().max(1.0);
        let h = interval / parts;
        let damped = omega * (1.0 - zeta * zeta).sqrt();
        let mut one = Self {
            omega,
            zeta,
            damped,
            parts: parts as usize,
            h,
            transition: [[0.0; 2]; 2],
            weights: [[0.0; 2]; 2],
        };
        let (impulse, rate) = one.impulse_response(h);
        // The response to a displacement 1 is ġ + 2ζω g, its rate −ω² g.
        one.transition = [[rate + 2.0 * zeta * omega * impulse, impulse], [-omega * omega * impulse, rate]];
        for (node, weight) in GAUSS.iter().flat_map(|(x, w)| [(*x, *w), (-*x, *w)]) {
            let part = 0.5 * (1.0 + node);
            let (g, g_rate) = one.impulse_response(h * (1.0 - part));
            for (row, response) in one.weights.iter_mut().zip([g, g_rate]) {
                row[0] -= 0.5 * h * weight * response * (1.0 - part);
                row[1] -= 0.5 * h * weight * response * part;
            }
        }
        one
    }

    /// g = e^{−ζωt} sin(ω_d t)/ω_d and its rate.
    fn impulse_response(&self, t: f64) -> (f64, f64) {
        let decay = (-self.zeta * self.omega * t).exp();
        let (sin, cos) = (self.damped * t).sin_cos();
        let g = decay * sin / self.damped;
        (g, decay * cos - self.zeta * self.omega * g)
    }

    /// The state one step later, with these accelerations of the base at both ends.
    fn step(&self, [z, rate]: [f64; 2], from: f64, to: f64) -> [f64; 2] {
        let row = |i: usize| {
            let [transition, weights] = [self.transition[i], self.weights[i]];
            transition[0] * z + transition[1] * rate + weights[0] * from + weights[1] * to
        };
        [row(0), row(1)]
    }

    /// The largest |z| while the base moves, and after it.
    fn largest(&self, accelerations: &[f64]) -> (f64, f64) {
        let (mut state, mut primary) = ([0.0; 2], 0.0_f64);
        for pair in accelerations.windows(2) {
            for part in 0..self.parts {
                let at = |part: usize| pair[0] + (pair[1] - pair[0]) * part as f64 / self.parts as f64;
                let end = self.step(state, at(part), at(part + 1));
                primary = primary.max(end[0].abs()).max(largest_within(state, end, self.h));
                state = end;
            }
        }
        (primary, self.residual(state))
    }

    /// The largest |z| of the free decay from a state.
    fn residual(&self, [z, rate]: [f64; 2]) -> f64 {
        // ż = e^{−ζωt}(ż₀ cos ω_d t − (ω² z₀ + ζω ż₀)/ω_d sin ω_d t) is zero first
        // within half a period.
        let (omega, zeta) = (self.omega, self.zeta);
        let angle = (rate * self.damped).atan2(omega * omega * z + zeta * omega * rate).rem_euclid(PI);
        let (g, g_rate) = self.impulse_response(angle / self.damped);
        let extreme = z * (g_rate + 2.0 * zeta * omega * g) + rate * g;
        extreme.abs().max(z.abs())
    }
}

/// The largest |z| between the ends of a step, of the cubic through z and ż there; 0 where it does not turn.
fn largest_within([z, rate]: [f64; 2], [end, end_rate]: [f64; 2], h: f64) -> f64 {
    if rate * end_rate >= 0.0 {
        return 0.0;
    }
    let (slope, end_slope, change) = (h * rate, h * end_rate, end - z);
    // z + s θ + c θ² + d θ³, and its slope s + 2cθ + 3dθ², which changes sign once.
    let (c, d) = (3.0 * change - 2.0 * slope - end_slope, slope + end_slope - 2.0 * change);
    let root = (c * c - 3.0 * d * slope).max(0.0).sqrt();
    // The form without cancellation; of both roots the one within the step.
    let sum = -(c + root.copysign(c));
    let theta = [slope / sum, sum / (3.0 * d)].into_iter().find(|theta| (0.0..=1.0).contains(theta));
    theta.map_or(0.0, |theta| (z + theta * (slope + theta * (c + theta * d))).abs())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::vibration::frequencies;

    /// A rectangular pulse has a closed form: 2/ω² while it lasts for half a period or more, 1 − cos ωT
    /// before, and 2|sin(ωT/2)| after it.
    #[test]
    fn rectangular_pulses_have_their_spectrum() {
        let interval = 0.01;
        let length = 100.0 * interval;
        let omegas = frequencies(0.05, 250.0, 60);
        let found = ShockResponseSpectrum::of(&[3.0; 101], interval, &omegas, 0.0).expect("a pulse");
        assert_eq!(found.primary.len(), omegas.len());
        for (k, omega) in omegas.iter().enumerate() {
            let angle = omega * length;
            let primary = 3.0 * if angle >= PI { 2.0 } else { 1.0 - angle.cos() };
            let residual = 3.0 * 2.0 * (0.5 * angle).sin().abs();
            let square = omega * omega;
            let [found_primary, found_residual] = [found.primary[k] * square, found.residual[k] * square];
            assert!((found_primary - primary).abs() < 6e-6 * primary, "{omega}: {found_primary} {primary}");
            assert!((found_residual - residual).abs() < 1e-9, "{omega}: {found_residual} {residual}");
            let maximax = found.pseudo_acceleration()[k];
            assert!((maximax - primary.max(residual)).abs() < 6e-6 * maximax, "{omega}");
            assert!((found.pseudo_velocity()[k] * omega - maximax).abs() < 1e-12 * maximax);
        }
    }

    /// A step that lasts: the overshoot 1 + e^{−πζ/√(1−ζ²)}, whatever the sampling.
    #[test]
    fn damped_oscillators_overshoot_a_step() {
        for zeta in [0.0, 0.01, 0.05, 0.3, 0.7, 0.9] {
            for interval in [0.001, 0.02, 0.2] {
                let samples = alloc::vec![-2.0; (8.0 / interval) as usize + 1];
                let found = ShockResponseSpectrum::of(&samples, interval, &[3.0], zeta).expect("a step");
                let overshoot = 1.0 + (-PI * zeta / (1.0 - zeta * zeta).sqrt()).exp();
                let relative = found.primary[0] * 9.0 / 2.0 / overshoot - 1.0;
                assert!(relative.abs() < 6e-6, "{zeta} {interval}: {relative:e}");
            }
        }
    }

    /// A half-sine pulse, residual without damping: |2 r cos(π/(2r))/(1 − r²)| with r = π/(ωT).
    #[test]
    fn half_sine_pulses_have_their_residual() {
        let (n, length) = (2000, 0.011);
        let interval = length / f64::from(n);
        let samples: Vec<f64> = (0..=n).map(|k| (PI * f64::from(k) / f64::from(n)).sin()).collect();
        let omegas = frequencies(20.0, 20_000.0, 40);
        let found = ShockResponseSpectrum::of(&samples, interval, &omegas, 0.0).expect("a pulse");
        for (omega, z) in omegas.iter().zip(&found.residual) {
            let r = PI / (omega * length);
            let expected = (2.0 * r * (0.5 * PI / r).cos() / (1.0 - r * r)).abs();
            let residual = z * omega * omega;
            assert!((residual - expected).abs() < 1e-5, "{omega}: {residual} {expected}");
        }
        // Stiff oscillators follow the base.
        let maximax = found.pseudo_acceleration();
        assert!((maximax.last().expect("many") - 1.0).abs() < 0.02);
    }

    /// The residual is that of a long record which ends in zeros.
    #[test]
    fn residuals_are_what_zeros_after_the_record_show() {
        let samples: Vec<f64> = (0..50).map(|k| (0.3 * f64::from(k)).sin() + 0.2).chain([0.0]).collect();
        let mut longer = samples.clone();
        longer.extend([0.0; 4000]);
        for zeta in [0.0, 0.05, 0.5] {
            let omegas = frequencies(1.0, 100.0, 30);
            let short = ShockResponseSpectrum::of(&samples, 0.01, &omegas, zeta).expect("samples");
            let long = ShockResponseSpectrum::of(&longer, 0.01, &omegas, zeta).expect("samples");
            for (a, b) in short.relative_displacement().iter().zip(long.relative_displacement()) {
                assert!((a / b - 1.0).abs() < 1e-5, "{zeta}: {a:e} {b:e}");
            }
        }
    }

    #[test]
    fn quality_is_half_the_reciprocal_of_damping() {
        let samples = [0.0, 1.0, 0.0, -1.0];
        let by_quality = ShockResponseSpectrum::with_quality(&samples, 0.1, &[5.0], 10.0).expect("samples");
        assert_eq!(by_quality, ShockResponseSpectrum::of(&samples, 0.1, &[5.0], 0.05).expect("samples"));
        let unlimited = ShockResponseSpectrum::with_quality(&samples, 0.1, &[5.0], f64::INFINITY);
        assert_eq!(unlimited.expect("samples").damping_ratio, 0.0);
    }

    #[test]
    fn bad_input_is_refused() {
        let of = ShockResponseSpectrum::of;
        assert!(matches!(of(&[1.0], 0.1, &[5.0], 0.05), Err(VibrationError::TooFew { .. })));
        assert!(matches!(of(&[1.0; 9], 0.0, &[5.0], 0.05), Err(VibrationError::Value { .. })));
        assert!(matches!(of(&[1.0; 9], 0.1, &[0.0], 0.05), Err(VibrationError::Value { .. })));
        assert!(matches!(of(&[1.0; 9], 0.1, &[50.0], 0.05), Err(VibrationError::BeyondNyquist { .. })));
        for damping in [-0.1, 1.0, f64::NAN] {
            assert!(matches!(of(&[1.0; 9], 0.1, &[5.0], damping), Err(VibrationError::Value { .. })));
        }
        let quality = ShockResponseSpectrum::with_quality(&[1.0; 9], 0.1, &[5.0], 0.5);
        assert!(matches!(quality, Err(VibrationError::Value { .. })));
    }
}
