//! Corners of an integrand along a motion: steps of its quadrature end there.
//!
//! Where an output saturates, its derivatives jump. All nodes of Gauss's formulas lie inside a step. So they
//! miss a corner in its first or last twentieth, and steps become very short before a corner that they
//! detect. Therefore the derivatives are sampled at nine points between two knots of the motion. Their eighth
//! difference is h⁸ f⁽⁸⁾ if they are smooth, and as large as the jump if there is one. An interval that is
//! not smooth is halved until it is, or until the points on both sides of the jump are neighbouring numbers.

use alloc::vec::Vec;

use dynamics_runtime::model::{ModelState, Parameters, Vector};
use dynamics_runtime::simulate::Simulate;
use nalgebra::DVector;

use super::super::sensitivity::variational_equations::VariationalEquations;
use super::super::sensitivity_error::SensitivityError;
use super::objective::WeightedSum;

/// Coefficients of the eighth difference.
const EIGHTH_DIFFERENCE: [f64; 9] = [1.0, -8.0, 28.0, -56.0, 70.0, -56.0, 28.0, -8.0, 1.0];
/// Largest eighth difference of a smooth integrand, relative to the largest derivative. A jump of a
/// derivative of this part changes a gradient by as little.
const MAX_SMOOTH_DIFFERENCE: f64 = 1e-8;
/// Weight of derivatives by parameters, which are differences and less accurate. With 1 their errors would
/// look like jumps.
const PARAMETER_WEIGHT: f64 = 1e-2;
/// Width, in roundings of the time, within which a jump is located. Nearer times differ by rounding only.
const JUMP_WIDTH_IN_ROUNDINGS: f64 = 4.0;
/// Width, in widths of a jump, up to which an interval is too narrow to be sampled.
const NARROW_WIDTH: f64 = 8.0;
/// Ratio of the largest change between two samples to the other changes with which it may be a jump. A
/// smaller value starts searches at slopes, which end without a jump; a larger one halves intervals in vain.
const MIN_JUMP_RATIO: f64 = 4.0;
/// Part of a jump that one of both halves keeps; a slope leaves a half in each.
const SHARE_OF_ONE_HALF: f64 = 0.7;
/// Most samples between two knots. Beyond them the step size control handles an integrand that is rough
/// everywhere.
const MAX_SAMPLES: usize = 4000;

/// The search of corners of an integrand.
pub(super) struct IntegrandCorners<'w, 'a, 'm, M: Simulate> {
    pub(super) linear: &'w mut VariationalEquations<'a, 'm, M>,
    pub(super) integrand: &'w WeightedSum,
    /// The sizes of positions and velocities, by which derivatives are multiplied.
    pub(super) sizes: [f64; 2],
    /// The sizes of the parameters.
    pub(super) parameter_sizes: Vec<f64>,
    /// Whether derivatives by parameters are sampled, too.
    pub(super) with_parameters: bool,
    /// The largest derivative.
    pub(super) largest_derivative: f64,
    /// The largest value.
    pub(super) largest_value: f64,
    /// Samples between the present two knots.
    pub(super) samples: usize,
}

/// A time, the derivatives of the integrand, and its value.
type CornerSample = (f64, DVector<f64>, f64);

impl<M: Simulate + Parameters + Clone> IntegrandCorners<'_, '_, '_, M> {
    /// The times, by growing time, between which derivatives jump.
    pub(super) fn along(&mut self, knots: &[M::State]) -> Result<Vec<[f64; 2]>, SensitivityError> {
        let mut times: Vec<f64> = knots.iter().map(|state| state.t()).collect();
        times.sort_by(f64::total_cmp);
        let mut found = self.pass(times.windows(2).map(|pair| [pair[0], pair[1]]).collect())?;
        if !self.parameter_sizes.is_empty() {
            // Derivatives by parameters are expensive, and most of their corners are known by now.
            self.with_parameters = true;
            times.extend(found.iter().flatten());
            times.sort_by(f64::total_cmp);
            found.extend(self.pass(times.windows(2).map(|pair| [pair[0], pair[1]]).collect())?);
        }
        found.sort_by(|a: &[f64; 2], b| a[0].total_cmp(&b[0]));
        let mut end = f64::NEG_INFINITY;
        found.retain(|corner| {
            let is_next = corner[0] >= end;
            end = end.max(corner[1]);
            is_next
        });
        Ok(found)
    }

    /// The corners within some intervals.
    fn pass(&mut self, parts: Vec<[f64; 2]>) -> Result<Vec<[f64; 2]>, SensitivityError> {
        for [from, _] in &parts {
            self.sample(*from)?;
        }
        let mut found = Vec::new();
        // Intervals between both sides of a corner are left out.
        for [from, to] in parts.into_iter().filter(|part| !is_narrow(*part)) {
            self.samples = 0;
            self.search(from, to, &mut found)?;
        }
        Ok(found)
    }

    /// The integrand and its scaled derivatives at a time.
    fn sample(&mut self, t: f64) -> Result<CornerSample, SensitivityError> {
        let n = M::Vector::LEN;
        let state = self.linear.sampler.at(t);
        let (a, _) = self.linear.of(&state)?;
        let (of_state, parameters) = if self.with_parameters {
            let by = self.integrand.derivatives(self.linear, &state, &a)?;
            (by.state, by.parameters)
        } else {
            (self.integrand.by_state(self.linear, &state, &a)?, DVector::zeros(0))
        };
        let of_state = of_state.iter().enumerate().map(|(i, by)| by * self.sizes[i / n]);
        let of_parameters =
            parameters.iter().zip(&self.parameter_sizes).map(|(by, size)| PARAMETER_WEIGHT * by * size);
        let by = DVector::from_vec(of_state.chain(of_parameters).collect());
        let value = self.integrand.value(self.linear, &state)?;
        self.samples += 1;
        self.largest_derivative = self.largest_derivative.max(by.amax());
        self.largest_value = self.largest_value.max(value.abs());
        Ok((t, by, value))
    }

    /// Samples an interval at nine times. If it is not smooth, a jump in it is located, or it is halved.
    fn search(&mut self, from: f64, to: f64, found: &mut Vec<[f64; 2]>) -> Result<(), SensitivityError> {
        let mut open = alloc::vec![(from, to)];
        while let Some((a, b)) = open.pop() {
            if self.samples > MAX_SAMPLES || b <= a {
                continue;
            }
            let at = |k: usize| if k == 8 { b } else { a + (b - a) * k as f64 / 8.0 };
            let samples = (0..9).map(|k| self.sample(at(k))).collect::<Result<Vec<CornerSample>, _>>()?;
            let mut rough = DVector::zeros(samples[0].1.len());
            samples
                .iter()
                .zip(EIGHTH_DIFFERENCE)
                .for_each(|((_, by, _), factor)| rough.axpy(factor, by, 1.0));
            // A short pulse between two samples may leave the derivatives at both equal, but not the values.
            let of_values: f64 =
                samples.iter().zip(EIGHTH_DIFFERENCE).map(|((.., value), factor)| value * factor).sum();
            if rough.amax() <= MAX_SMOOTH_DIFFERENCE * self.largest_derivative
                && of_values.abs() <= MAX_SMOOTH_DIFFERENCE * self.largest_value
            {
                continue;
            }
            // The value jumps, but no derivative.
            if is_narrow([a, b]) {
                found.push([a, b]);
                continue;
            }
            let changes: Vec<f64> = samples.windows(2).map(|pair| (&pair[1].1 - &pair[0].1).amax()).collect();
            let k = (0..8).max_by(|i, j| changes[*i].total_cmp(&changes[*j])).unwrap_or(0);
            let others = changes.iter().enumerate().filter(|(i, _)| *i != k).map(|(_, change)| *change);
            let stands_out = changes[k] > MIN_JUMP_RATIO * others.fold(0.0, f64::max);
            match stands_out.then(|| self.locate(&samples[k], &samples[k + 1])).transpose()?.flatten() {
                Some(corner) => {
                    found.push(corner);
                    open.extend([(a, corner[0]), (corner[1], b)]);
                }
                None => open.extend([(a, at(4)), (at(4), b)]),
            }
        }
        Ok(())
    }

    /// The times on both sides of a jump, by bisection; `None` if there is only a steep slope.
    fn locate(
        &mut self,
        left: &CornerSample,
        right: &CornerSample,
    ) -> Result<Option<[f64; 2]>, SensitivityError> {
        let (mut left, mut right) = (left.clone(), right.clone());
        let size = |a: &CornerSample, b: &CornerSample| (&b.1 - &a.1).amax();
        let mut jump = size(&left, &right);
        loop {
            let width = JUMP_WIDTH_IN_ROUNDINGS * f64::EPSILON * left.0.abs().max(right.0.abs());
            let middle = 0.5 * (left.0 + right.0);
            if right.0 - left.0 <= width || middle <= left.0 || middle >= right.0 {
                return Ok(Some([left.0, right.0]));
            }
            let middle = self.sample(middle)?;
            let [before, after] = [size(&left, &middle), size(&middle, &right)];
            if before.max(after) < SHARE_OF_ONE_HALF * jump {
                return Ok(None);
            }
            jump = before.max(after);
            if before >= after { right = middle } else { left = middle }
        }
    }
}

/// Whether hardly any numbers lie between two times.
fn is_narrow([a, b]: [f64; 2]) -> bool {
    b - a <= NARROW_WIDTH * JUMP_WIDTH_IN_ROUNDINGS * f64::EPSILON * a.abs().max(b.abs())
}
