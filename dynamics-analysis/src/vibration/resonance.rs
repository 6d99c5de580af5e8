//! Peaks of a response and their sharpness.
//!
//! Peaks of |H(iω)| are zeros of d|H|²/dω, which is exact; they are bracketed on a frequency grid that is
//! dense near every eigenvalue, and bisected. The global maximum is certain by the theorem of Boyd,
//! Balakrishnan & Kabamba (Math. Control Signals Systems 2 (1989) 207): |H| stays below γ where the
//! Hamiltonian matrix of γ has no eigenvalue on the imaginary axis; where it has, their frequencies lead on
//! (Bruinsma & Steinbuch, Systems & Control Letters 14 (1990) 287).

use alloc::vec::Vec;

use nalgebra::{Complex, DMatrix};

use super::channel::{Channel, Excitation};
use super::{StateSpace, VibrationError};
use crate::linearize::matrix_eigenvalues;

/// Least real part of a growing mode, relative to the largest eigenvalue. The real part of a defective pair
/// may be as large as √ε.
const MIN_GROWTH: f64 = 1e-7;
/// Real part, relative to the largest eigenvalue, above whose negative a mode counts as not decaying:
/// rounding.
const MIN_DECAY: f64 = 1e-13;
/// d|H|²/dω, relative to |H| |H′|, up to which its sign is only rounding. Flat responses would otherwise
/// have peaks by rounding.
const FLAT_SLOPE: f64 = 1e-11;
/// Relative distance between the largest response that was found and the bound that is proved. A smaller
/// margin needs the Hamiltonian eigenvalues more accurately than they are.
const BOUND_MARGIN: f64 = 1e-6;
/// Most iterations for the largest response; the method converges quadratically.
const MAX_BOUND_ITERATIONS: usize = 100;
/// Real part, relative to the largest eigenvalue of the Hamiltonian matrix, up to which an eigenvalue counts
/// as imaginary. Too small a value misses crossings and would make the bound wrong; a larger one adds
/// frequencies that are evaluated in vain.
const IMAGINARY_AXIS_WIDTH: f64 = 1e-9;
/// The frequency grid begins three decades below the smallest eigenvalue.
const GRID_MARGIN_BELOW: f64 = 1e-3;
/// It ends three decades above the largest eigenvalue.
const GRID_MARGIN_ABOVE: f64 = 1e3;
/// Frequencies of the grid, besides those near eigenvalues. A larger grid finds closer pairs of extrema and
/// takes longer.
const GRID_SIZE: usize = 600;
/// Frequencies of the grid near each eigenvalue, on each side; they are a third of its half width apart.
const GRID_SIZE_PER_SIDE: i32 = 24;
/// Offset of these frequencies from the peak itself, where the sign of the slope would be rounding.
const GRID_OFFSET: f64 = 0.37;

/// A peak of a response.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Peak {
    /// ω, in rad/s.
    pub frequency: f64,
    /// |H| there.
    pub magnitude: f64,
    /// The frequencies below and above at which |H|² is half as large; `None` if it does not fall so far
    /// before the next minimum.
    pub half_power: Option<[f64; 2]>,
}

impl Peak {
    /// ω/(ω₂ − ω₁): the quality factor, 1/(2ζ) of one lightly damped mode.
    #[must_use]
    pub fn quality(&self) -> Option<f64> {
        self.half_power.map(|[below, above]| self.frequency / (above - below))
    }
}

/// The largest response over all frequencies: the H∞ norm of one channel.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Gain {
    /// ω, in rad/s; infinite if |D| is the largest response.
    pub frequency: f64,
    /// |H| there.
    pub magnitude: f64,
    /// The proved bound: |H| is not larger at any frequency.
    pub bound: f64,
}

impl StateSpace {
    /// All peaks of a response, by growing frequency; a largest value at frequency 0 is none.
    ///
    /// # Errors
    /// As [`StateSpace::frequency_response`], and if a controllable and observable mode does not decay: the
    /// peak of an undamped mode is infinite.
    pub fn resonances(
        &self,
        input: impl Into<Excitation>,
        output: &str,
    ) -> Result<Vec<Peak>, VibrationError> {
        let _watch = dynamics_runtime::slow_build::SlowBuildNote::start();
        let (channel, eigenvalues) = self.decaying_channel(&input.into(), output)?;
        let rise = |frequency: f64| self.response_at(&channel, frequency).map(|found| found.rise());
        let (mut grid, mut rises) = (Vec::new(), Vec::new());
        for frequency in grid_about(&eigenvalues) {
            let found = self.response_at(&channel, frequency)?;
            // Leave out frequencies at which the sign of the slope is rounding.
            if found.rise().abs() > FLAT_SLOPE * (found.value.norm() * found.slope.norm()) {
                grid.push(frequency);
                rises.push(found.rise());
            }
        }
        // Extrema of |H| between neighbours of the grid, and whether each is a peak.
        let mut extrema = Vec::new();
        for k in 1..grid.len() {
            if rises[k - 1] * rises[k] < 0.0 {
                extrema.push((bisect(grid[k - 1], grid[k], rise)?, rises[k] < 0.0));
            }
        }
        let [first, last] = [grid.first(), grid.last()].map(|at| at.copied().unwrap_or(0.0));
        let mut peaks = Vec::new();
        for (k, (frequency, _)) in extrema.iter().enumerate().filter(|(_, (_, is_peak))| *is_peak) {
            let below = if k == 0 { first } else { extrema[k - 1].0 };
            let above = extrema.get(k + 1).map_or(last, |extremum| extremum.0);
            peaks.push(self.peak(&channel, *frequency, [below, above])?);
        }
        Ok(peaks)
    }

    /// The largest response over all frequencies, with the proof that no frequency has a larger one.
    ///
    /// # Errors
    /// As [`StateSpace::resonances`].
    pub fn largest_response(&self, input: &str, output: &str) -> Result<Gain, VibrationError> {
        let (channel, _) = self.decaying_channel(&input.into(), output)?;
        let size = |frequency: f64| self.response_at(&channel, frequency).map(|found| found.value.norm());
        // A lower bound: at 0, at infinity (|D|), and at all peaks that were found.
        let direct = channel.d[0];
        let mut best = (0.0, size(0.0)?);
        if direct.abs() > best.1 {
            best = (f64::INFINITY, direct.abs());
        }
        for peak in self.resonances(input, output)? {
            if peak.magnitude > best.1 {
                best = (peak.frequency, peak.magnitude);
            }
        }
        // If the Hamiltonian matrix has imaginary eigenvalues, |H| exceeds the bound between two of them.
        for iterations in 0.. {
            let bound = best.1 * (1.0 + BOUND_MARGIN);
            if best.1 == 0.0 {
                break;
            }
            let crossings = level_crossings(&channel, bound)?;
            let mut found = best;
            for middle in crossings.windows(2).map(|pair| 0.5 * (pair[0] + pair[1])) {
                let there = size(middle)?;
                if there > found.1 {
                    found = (middle, there);
                }
            }
            if found.1 <= bound {
                break;
            }
            if iterations > MAX_BOUND_ITERATIONS {
                let residual = found.1 / best.1 - 1.0;
                return Err(VibrationError::NoConvergence {
                    what: "the largest response",
                    iterations,
                    residual,
                });
            }
            best = found;
        }
        Ok(Gain { frequency: best.0, magnitude: best.1, bound: best.1 * (1.0 + BOUND_MARGIN) })
    }

    /// The channel and its eigenvalues, all of which decay. Modes that do not decay, but are uncontrollable
    /// or unobservable, are removed.
    fn decaying_channel(
        &self,
        input: &Excitation,
        output: &str,
    ) -> Result<(Channel, Vec<Complex<f64>>), VibrationError> {
        let mut channel = Channel::new(self, input, self.output(output)?)?;
        let size = |of: &[Complex<f64>]| of.iter().map(|x| x.norm()).fold(0.0, f64::max);
        // A growing mode is an error even if it has no part in this response.
        let all = self.eigenvalues()?;
        if let Some(last) = all.last().filter(|last| last.re > MIN_GROWTH * size(&all)) {
            return Err(VibrationError::Unstable { eigenvalue: *last });
        }
        loop {
            let eigenvalues = channel.eigenvalues()?;
            let last = match eigenvalues.last() {
                Some(last) if last.re >= -MIN_DECAY * size(&eigenvalues) => *last,
                _ => return Ok((channel, eigenvalues)),
            };
            let rest = channel.without(Complex::new(0.0, last.im));
            channel = rest.ok_or(VibrationError::Unstable { eigenvalue: last })?;
        }
    }

    /// The peak at a frequency, between two minima.
    fn peak(&self, channel: &Channel, frequency: f64, between: [f64; 2]) -> Result<Peak, VibrationError> {
        let size = |frequency: f64| self.response_at(channel, frequency).map(|found| found.value.norm_sqr());
        let most = size(frequency)?;
        let excess = |frequency: f64| size(frequency).map(|found| found - 0.5 * most);
        let mut sides = [None; 2];
        for (side, trough) in sides.iter_mut().zip(between) {
            if excess(trough)? < 0.0 {
                *side = Some(bisect(trough, frequency, excess)?);
            }
        }
        let half_power = sides[0].zip(sides[1]).map(|(below, above)| [below, above]);
        Ok(Peak { frequency, magnitude: most.sqrt(), half_power })
    }
}

/// Frequencies at which |H| = `level`, level above |D|: those of imaginary eigenvalues of the Hamiltonian
/// matrix.
fn level_crossings(channel: &Channel, level: f64) -> Result<Vec<f64>, VibrationError> {
    let n = channel.a.nrows();
    // Scaled so that |H|/level is compared with 1.
    let (b, c) = (&channel.b[0] / level.sqrt(), channel.c.transpose() / level.sqrt());
    let d = channel.d[0] / level;
    let rest = 1.0 - d * d;
    let moved = &channel.a + &b * &c * (d / rest);
    let mut hamiltonian = DMatrix::zeros(2 * n, 2 * n);
    hamiltonian.view_mut((0, 0), (n, n)).copy_from(&moved);
    hamiltonian.view_mut((0, n), (n, n)).copy_from(&(&b * b.transpose() / rest));
    hamiltonian.view_mut((n, 0), (n, n)).copy_from(&(c.transpose() * &c * (-(1.0 + d * d / rest))));
    hamiltonian.view_mut((n, n), (n, n)).copy_from(&-moved.transpose());
    let found = matrix_eigenvalues(hamiltonian)?;
    let size = found.iter().map(|x| x.norm()).fold(0.0, f64::max);
    let on_axis = found.into_iter().filter(|x| x.im >= 0.0 && x.re.abs() <= IMAGINARY_AXIS_WIDTH * size);
    let mut on_axis: Vec<f64> = on_axis.map(|x| x.im).collect();
    on_axis.sort_by(f64::total_cmp);
    Ok(on_axis)
}

/// Frequencies for the search of peaks: dense near each eigenvalue, relative to its half width, and over all
/// decades.
fn grid_about(eigenvalues: &[Complex<f64>]) -> Vec<f64> {
    if eigenvalues.is_empty() {
        return Vec::new();
    }
    let sizes = || eigenvalues.iter().map(|x| x.norm());
    let (least, most) = (sizes().fold(f64::INFINITY, f64::min), sizes().fold(0.0, f64::max));
    let mut grid = super::frequencies(GRID_MARGIN_BELOW * least, GRID_MARGIN_ABOVE * most, GRID_SIZE);
    for eigenvalue in eigenvalues.iter().filter(|x| x.im > 0.0) {
        let near = (-GRID_SIZE_PER_SIDE..GRID_SIZE_PER_SIDE)
            .map(|k| eigenvalue.im + eigenvalue.re.abs() * (GRID_OFFSET + f64::from(k)) / 3.0);
        grid.extend(near.filter(|frequency| *frequency > 0.0));
    }
    grid.sort_by(f64::total_cmp);
    grid.dedup();
    grid
}

/// The zero of a function between two arguments at which its signs differ, to the last digit.
pub(super) fn bisect<E>(
    mut low: f64,
    mut high: f64,
    mut of: impl FnMut(f64) -> Result<f64, E>,
) -> Result<f64, E> {
    let sign = of(low)?.signum();
    loop {
        let middle = 0.5 * (low + high);
        if middle == low || middle == high || !middle.is_finite() {
            return Ok(middle);
        }
        if of(middle)?.signum() == sign { low = middle } else { high = middle }
    }
}
