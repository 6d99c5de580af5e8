//! The response to a steady sine.
//!
//! At the frequency of an undamped mode `Channel::at` has no digits. Such modes are removed if they are
//! uncontrollable or unobservable (`unreached.rs`). If they are both controllable and observable, the result
//! is an error.

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
    /// What shakes.
    pub input: Signal,
    /// What answers.
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

/// Where a peak is looked at, from the damped frequency of its mode in parts of its half width −Re λ: evenly
/// by the phase, then away from it.
const BESIDE_PEAK: [f64; 8] = [0.0, 0.2, 0.42, 0.73, 1.0, 1.4, 2.4, 5.0];

/// A peak is drawn where fewer than this many frequencies fall into its half width on each side.
const RESOLVED: f64 = 4.0;

/// A mode with less damping than this part of its frequency has none that could be told from rounding, and a
/// peak without a height.
const UNDAMPED: f64 = 1e-9;

/// The flanks of such a peak are drawn up to where this part of the distance between two frequencies is left.
const FLANKS: f64 = 1.0 / 32.0;

impl FrequencyResponse {
    /// Values over frequencies, those at the peaks among them.
    pub(super) fn drawn(&self) -> (Vec<f64>, Vec<Complex<f64>>) {
        let asked = self.frequencies.iter().copied().zip(self.values.iter().copied());
        // The chart goes the way that the frequencies go; where they go to and fro nothing can be put between
        // them.
        let mut all: Vec<(f64, Complex<f64>)> = asked.collect();
        if self.frequencies.is_sorted() {
            all.extend(self.peaks.iter().copied());
            all.sort_by(|a, b| a.0.total_cmp(&b.0));
        }
        all.into_iter().unzip()
    }

    /// |H|: the amplitude of the answer by that of the cause; where both have one unit, the transmissibility.
    #[must_use]
    pub fn magnitude(&self) -> Vec<f64> {
        self.values.iter().map(|value| value.norm()).collect()
    }

    /// The phase of the answer in rad, negative where it lags; from frequency to frequency on the shorter
    /// way, so that it passes −π without a jump.
    #[must_use]
    pub fn phase(&self) -> Vec<f64> {
        phases(&self.values)
    }
}

/// The phases of values, each on the shorter way from the one before.
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
            input: self.cause(&input)?,
            output: self.outputs[row].clone(),
            frequencies: frequencies.to_vec(),
            values,
            uncertainty,
            peaks: self.peaks(&channel, frequencies)?,
        })
    }

    /// Values at and beside the resonances that these frequencies miss.
    fn peaks(
        &self,
        channel: &Channel,
        frequencies: &[f64],
    ) -> Result<Vec<(f64, Complex<f64>)>, VibrationError> {
        // Between fewer there is no curve, and where they go to and fro no place for further ones.
        if frequencies.len() < 2 || !frequencies.is_sorted() {
            return Ok(Vec::new());
        }
        let (from, to) = (frequencies[0], frequencies[frequencies.len() - 1]);
        let mut at: Vec<f64> = Vec::new();
        for pole in channel.eigenvalues()? {
            let (omega, width) = (pole.im, pole.re.abs());
            if !(omega > from && omega < to) {
                continue;
            }
            let next = frequencies.partition_point(|frequency| *frequency < omega);
            let apart = frequencies[next] - frequencies[next - 1];
            if apart * RESOLVED < width {
                continue;
            }
            let damped = width > UNDAMPED * omega;
            if damped {
                at.extend(BESIDE_PEAK.iter().flat_map(|part| [omega - part * width, omega + part * width]));
            }
            // From the flanks of the peak out to the frequencies beside it, each time twice as far.
            let mut far = if damped { 10.0 * width } else { FLANKS * apart };
            while far < 2.0 * apart {
                at.extend([omega - far, omega + far]);
                far *= 2.0;
            }
        }
        at.retain(|frequency| (from..=to).contains(frequency));
        at.sort_by(f64::total_cmp);
        at.dedup();
        // A value without digits is left out of the chart. A request for that frequency returns the error.
        let value =
            |frequency: f64| self.response_at(channel, frequency).ok().map(|found| (frequency, found.value));
        Ok(at.into_iter().filter_map(value).collect())
    }

    /// The signal that an excitation is.
    pub(super) fn cause(&self, input: &Excitation) -> Result<Signal, VibrationError> {
        let name = input.terms.iter().flatten().next().map_or("", String::as_str);
        Ok(self.inputs[self.input(name)?].clone())
    }

    /// The response at one frequency, a failure with the mode that is its cause.
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
            // What is free has the eigenvalue 0, or what rounding leaves of it, which is no mode to be named.
            Err(conditioning) if frequency == 0.0 => Err(VibrationError::Free { conditioning }),
            Err(conditioning) => {
                let beside = |x: &Complex<f64>| (x - at).norm();
                let found = channel.eigenvalues()?;
                let nearest = found.into_iter().min_by(|x, y| beside(x).total_cmp(&beside(y)));
                let eigenvalue = nearest.unwrap_or_default();
                Err(VibrationError::Resonance { frequency, eigenvalue, conditioning })
            }
        }
    }
}
