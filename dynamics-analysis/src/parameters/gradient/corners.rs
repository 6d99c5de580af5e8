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

use super::super::sensitivity::linear::VariationalEquations;
use super::super::sensitivity_error::SensitivityError;
use super::objective::Blend;

/// Coefficients of the eighth difference.
const EIGHTH: [f64; 9] = [1.0, -8.0, 28.0, -56.0, 70.0, -56.0, 28.0, -8.0, 1.0];
/// Eighth difference, in parts of the largest derivative, that is none: what a jump of that part does to a
/// gradient is as little.
const SMOOTH: f64 = 1e-8;
/// By how much jumps of derivatives by parameters count less: these are differences.
const COARSER: f64 = 1e-2;
/// Width, in roundings of the time, within which a jump is located.
const NEIGHBOURS: f64 = 4.0;
/// A jump is apart from the slope beside it where it is so many times as large, and goes on being one where
/// halves keep this part of it.
const APART: f64 = 4.0;
const PERSISTS: f64 = 0.7;
/// Most looks between two knots: what is rough everywhere is left to the steps.
const MOST_LOOKS: usize = 4000;

/// Looks at an integrand.
pub(super) struct IntegrandCorners<'w, 'a, 'm, M: Simulate> {
    pub(super) linear: &'w mut VariationalEquations<'a, 'm, M>,
    pub(super) integrand: &'w Blend,
    /// By what derivatives by positions and by velocities are multiplied: the sizes of these.
    pub(super) sizes: [f64; 2],
    /// Likewise those by parameters, which are differences.
    pub(super) of_parameters: Vec<f64>,
    pub(super) with_parameters: bool,
    /// The largest derivative.
    pub(super) largest: f64,
    /// The largest value.
    pub(super) highest: f64,
    pub(super) looks: usize,
}

/// A place, the derivatives there, and the value.
type Look = (f64, DVector<f64>, f64);

impl<M: Simulate + Parameters + Clone> IntegrandCorners<'_, '_, '_, M> {
    /// The times, by growing time, between which derivatives jump.
    pub(super) fn along(&mut self, knots: &[M::State]) -> Result<Vec<[f64; 2]>, SensitivityError> {
        let mut times: Vec<f64> = knots.iter().map(|state| state.t()).collect();
        times.sort_by(f64::total_cmp);
        let mut found = self.pass(times.windows(2).map(|pair| [pair[0], pair[1]]).collect())?;
        if !self.of_parameters.is_empty() {
            // Those by parameters take longer, and most of their corners are found by now.
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

    fn pass(&mut self, parts: Vec<[f64; 2]>) -> Result<Vec<[f64; 2]>, SensitivityError> {
        for [from, _] in &parts {
            self.look(*from)?;
        }
        let mut found = Vec::new();
        // Those between the sides of a corner are none.
        for [from, to] in parts.into_iter().filter(|part| !is_narrow(*part)) {
            self.looks = 0;
            self.between(from, to, &mut found)?;
        }
        Ok(found)
    }

    fn look(&mut self, t: f64) -> Result<Look, SensitivityError> {
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
        let of_parameters = parameters.iter().zip(&self.of_parameters).map(|(by, size)| COARSER * by * size);
        let by = DVector::from_vec(of_state.chain(of_parameters).collect());
        let value = self.integrand.value(self.linear, &state)?;
        self.looks += 1;
        self.largest = self.largest.max(by.amax());
        self.highest = self.highest.max(value.abs());
        Ok((t, by, value))
    }

    /// Looks at nine places, and more closely at what is not smooth between them.
    fn between(&mut self, from: f64, to: f64, found: &mut Vec<[f64; 2]>) -> Result<(), SensitivityError> {
        let mut open = alloc::vec![(from, to)];
        while let Some((a, b)) = open.pop() {
            if self.looks > MOST_LOOKS || b <= a {
                continue;
            }
            let at = |k: usize| if k == 8 { b } else { a + (b - a) * k as f64 / 8.0 };
            let looks = (0..9).map(|k| self.look(at(k))).collect::<Result<Vec<Look>, _>>()?;
            let mut rough = DVector::zeros(looks[0].1.len());
            looks.iter().zip(EIGHTH).for_each(|((_, by, _), factor)| rough.axpy(factor, by, 1.0));
            // What passes between two places may leave the derivatives at both alike, and not the values.
            let of_values: f64 = looks.iter().zip(EIGHTH).map(|((.., value), factor)| value * factor).sum();
            if rough.amax() <= SMOOTH * self.largest && of_values.abs() <= SMOOTH * self.highest {
                continue;
            }
            // A value that jumps, where no derivative does.
            if is_narrow([a, b]) {
                found.push([a, b]);
                continue;
            }
            let changes: Vec<f64> = looks.windows(2).map(|pair| (&pair[1].1 - &pair[0].1).amax()).collect();
            let k = (0..8).max_by(|i, j| changes[*i].total_cmp(&changes[*j])).unwrap_or(0);
            let others = changes.iter().enumerate().filter(|(i, _)| *i != k).map(|(_, change)| *change);
            let stands_out = changes[k] > APART * others.fold(0.0, f64::max);
            match stands_out.then(|| self.narrow(&looks[k], &looks[k + 1])).transpose()?.flatten() {
                Some(corner) => {
                    found.push(corner);
                    open.extend([(a, corner[0]), (corner[1], b)]);
                }
                None => open.extend([(a, at(4)), (at(4), b)]),
            }
        }
        Ok(())
    }

    /// The places on both sides of a jump; `None` where there is but a steep slope.
    fn narrow(&mut self, left: &Look, right: &Look) -> Result<Option<[f64; 2]>, SensitivityError> {
        let (mut left, mut right) = (left.clone(), right.clone());
        let size = |a: &Look, b: &Look| (&b.1 - &a.1).amax();
        let mut jump = size(&left, &right);
        loop {
            let width = NEIGHBOURS * f64::EPSILON * left.0.abs().max(right.0.abs());
            let middle = 0.5 * (left.0 + right.0);
            if right.0 - left.0 <= width || middle <= left.0 || middle >= right.0 {
                return Ok(Some([left.0, right.0]));
            }
            let middle = self.look(middle)?;
            let [before, after] = [size(&left, &middle), size(&middle, &right)];
            if before.max(after) < PERSISTS * jump {
                return Ok(None);
            }
            jump = before.max(after);
            if before >= after { right = middle } else { left = middle }
        }
    }
}

/// Whether next to no numbers lie between.
fn is_narrow([a, b]: [f64; 2]) -> bool {
    b - a <= 8.0 * NEIGHBOURS * f64::EPSILON * a.abs().max(b.abs())
}
