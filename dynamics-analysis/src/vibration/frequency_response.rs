//! The response to a steady sine, H(iω) = C (iω − A)⁻¹ B + D (`channel.rs`).
//!
//! At the frequency of an undamped mode iω − A is singular. The mode is removed if it is uncontrollable or
//! unobservable (`uncontrollable_modes.rs`). Otherwise the result is an error.

use alloc::string::String;
use alloc::vec::Vec;

use nalgebra::Complex;

use super::channel::{Channel, Excitation, TransferValue};
use super::state_space::Signal;
use super::{StateSpace, VibrationError};

/// `count` frequencies from `from` to `to`, in rad/s and both positive, each greater than the one before by
/// the same factor.
pub fn frequencies(from: f64, to: f64, count: usize) -> Vec<f64> {
    let last = count.saturating_sub(1).max(1) as f64;
    let at =
        |k: usize| if k + 1 == count && count > 1 { to } else { from * (to / from).powf(k as f64 / last) };
    (0..count).map(at).collect()
}

/// A response over frequencies.
#[derive(Clone, Debug, PartialEq)]
pub struct FrequencyResponse {
    /// The excitation.
    pub input: Signal,
    /// The output.
    pub output: Signal,
    /// ω, in rad/s.
    pub frequencies: Vec<f64>,
    /// H(iω).
    pub values: Vec<Complex<f64>>,
    /// The bound |δH| of the rounding error of each value.
    pub uncertainty: Vec<f64>,
    /// Further values, by growing frequency, at and near resonances that are narrower than the spacing of the
    /// frequencies. Charts use them to show the height of peaks.
    pub peaks: Vec<(f64, Complex<f64>)>,
}

/// Samples on each side of a peak: distances from the damped frequency of its mode, relative to its half
/// width −Re σ. About even in the phase up to the half width, then wider.
const PEAK_SAMPLES: [f64; 8] = [0.0, 0.2, 0.42, 0.73, 1.0, 1.4, 2.4, 5.0];

/// A peak gets samples of its own if fewer than this many requested frequencies fall into its half width.
const SAMPLES_PER_RESOLVED_HALF_WIDTH: f64 = 4.0;

/// Least damping ratio of a mode with a peak of finite height. Smaller ones may be rounding.
const MIN_DAMPING_RATIO: f64 = 1e-9;

/// Distance of the nearest samples from an undamped peak, relative to the spacing of the requested
/// frequencies. It sets the height up to which the flanks are drawn.
const UNDAMPED_PEAK_GAP: f64 = 1.0 / 32.0;
/// Distance of the first flank samples of a damped peak, in half widths; the next ones are twice as far each.
const FIRST_FLANK_SAMPLE: f64 = 10.0;
/// Flank samples end at this distance, in spacings of the requested frequencies.
const LAST_FLANK_SAMPLE: f64 = 2.0;

impl FrequencyResponse {
    /// All values over frequencies, including those at the peaks.
    pub(super) fn drawn(&self) -> (Vec<f64>, Vec<Complex<f64>>) {
        let asked = self.frequencies.iter().copied().zip(self.values.iter().copied());
        // The curve follows the order of the frequencies. If they are not ascending, peaks have no place in
        // it.
        let mut all: Vec<(f64, Complex<f64>)> = asked.collect();
        if self.frequencies.is_sorted() {
            all.extend(self.peaks.iter().copied());
            all.sort_by(|a, b| a.0.total_cmp(&b.0));
        }
        all.into_iter().unzip()
    }

    /// |H|, the amplitude of the output divided by that of the input: the transmissibility
    /// if both have one unit.
    #[must_use]
    pub fn magnitude(&self) -> Vec<f64> {
        self.values.iter().map(|value| value.norm()).collect()
    }

    /// The phase of the output in rad, negative if it lags. From frequency to frequency it takes the shorter
    /// way, so it passes −π without a jump.
    #[must_use]
    pub fn phase(&self) -> Vec<f64> {
        phases(&self.values)
    }
}

/// The phases of values, unwrapped: each differs from the one before by at most π.
pub(super) fn phases(values: &[Complex<f64>]) -> Vec<f64> {
    let mut phases: Vec<f64> = Vec::with_capacity(values.len());
    for value in values {
        let phase = value.arg();
        let turns = phases.last().map_or(0.0, |before| ((before - phase) / core::f64::consts::TAU).round());
        phases.push(phase + turns * core::f64::consts::TAU);
    }
    phases
}

impl StateSpace {
    /// The response of an output (declared, coordinate, `x_rate` or `x_acceleration`) to a sine of an input,
    /// or of a force along a coordinate, at these frequencies in rad/s: receptance, mobility and accelerance
    /// are those of coordinates, rates and accelerations to forces.
    ///
    /// # Errors
    /// Names that are not known, frequencies that are not 0 or positive, and [`VibrationError::Resonance`] at
    /// the frequency of an undamped mode that is controllable and observable, and [`VibrationError::Free`] at
    /// 0 if a rigid-body mode is excited. An uncontrollable or unobservable mode leaves the response finite.
    pub fn frequency_response(
        &self,
        input: impl Into<Excitation>,
        output: &str,
        frequencies: &[f64],
    ) -> Result<FrequencyResponse, VibrationError> {
        let (input, row) = (input.into(), self.output(output)?);
        let channel = Channel::new(self, &input, row)?;
        let (mut values, mut uncertainty) = (Vec::new(), Vec::new());
        for frequency in frequencies {
            let found = self.response_at(&channel, *frequency)?;
            values.push(found.value);
            uncertainty.push(found.uncertainty);
        }
        Ok(FrequencyResponse {
            input: self.excitation_signal(&input)?,
            output: self.outputs[row].clone(),
            frequencies: frequencies.to_vec(),
            values,
            uncertainty,
            peaks: self.peaks(&channel, frequencies)?,
        })
    }

    /// Values at and near the resonances that are narrower than the spacing of these frequencies.
    fn peaks(
        &self,
        channel: &Channel,
        frequencies: &[f64],
    ) -> Result<Vec<(f64, Complex<f64>)>, VibrationError> {
        // Only an ascending sequence has gaps in which peaks can lie.
        if frequencies.len() < 2 || !frequencies.is_sorted() {
            return Ok(Vec::new());
        }
        let (from, to) = (frequencies[0], frequencies[frequencies.len() - 1]);
        // Frequencies near each lightly damped mode within the range.
        let mut at: Vec<f64> = Vec::new();
        for pole in channel.eigenvalues()? {
            let (omega, width) = (pole.im, pole.re.abs());
            if !(omega > from && omega < to) {
                continue;
            }
            let next = frequencies.partition_point(|frequency| *frequency < omega);
            let apart = frequencies[next] - frequencies[next - 1];
            if apart * SAMPLES_PER_RESOLVED_HALF_WIDTH < width {
                continue;
            }
            let damped = width > MIN_DAMPING_RATIO * omega;
            if damped {
                at.extend(PEAK_SAMPLES.iter().flat_map(|part| [omega - part * width, omega + part * width]));
            }
            // From the flanks of the peak out to the requested frequencies, with doubled distances.
            let mut far = if damped { FIRST_FLANK_SAMPLE * width } else { UNDAMPED_PEAK_GAP * apart };
            while far < LAST_FLANK_SAMPLE * apart {
                at.extend([omega - far, omega + far]);
                far *= 2.0;
            }
        }
        at.retain(|frequency| (from..=to).contains(frequency));
        at.sort_by(f64::total_cmp);
        at.dedup();
        // The chart leaves out inaccurate values. A request for that frequency returns the error.
        let value =
            |frequency: f64| self.response_at(channel, frequency).ok().map(|found| (frequency, found.value));
        Ok(at.into_iter().filter_map(value).collect())
    }

    /// The first input of an excitation, which gives it its name and unit.
    pub(super) fn excitation_signal(&self, input: &Excitation) -> Result<Signal, VibrationError> {
        let name = input.terms.iter().flatten().next().map_or("", String::as_str);
        Ok(self.inputs[self.input(name)?].clone())
    }

    /// The response at one frequency, with the modes removed that have no part in it if necessary. The error
    /// names the mode.
    pub(super) fn response_at(
        &self,
        channel: &Channel,
        frequency: f64,
    ) -> Result<TransferValue, VibrationError> {
        if !(frequency.is_finite() && frequency >= 0.0) {
            let must_be = "0 or a positive number of rad/s";
            return Err(VibrationError::Value { what: "a frequency", value: frequency, must_be });
        }
        let at = Complex::new(0.0, frequency);
        let found = channel.at(frequency);
        match found.or_else(|worst| channel.without(at).and_then(|rest| rest.at(frequency).ok()).ok_or(worst))
        {
            Ok(found) => Ok(found),
            // At 0 a rigid-body mode is the cause; its eigenvalue is 0 or rounding, and is not named.
            Err(conditioning) if frequency == 0.0 => Err(VibrationError::Free { conditioning }),
            Err(conditioning) => {
                let distance = |x: &Complex<f64>| (x - at).norm();
                let found = channel.eigenvalues()?;
                let nearest = found.into_iter().min_by(|x, y| distance(x).total_cmp(&distance(y)));
                let eigenvalue = nearest.unwrap_or_default();
                Err(VibrationError::Resonance { frequency, eigenvalue, conditioning })
            }
        }
    }
}
