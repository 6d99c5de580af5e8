//! Measured data and the values of the motion at the same times.

use alloc::borrow::ToOwned;
use alloc::format;
use alloc::string::String;
use alloc::vec::Vec;

use dynamics_runtime::model::{ModelState, Parameters};
use dynamics_runtime::simulate::{Motion, Simulate};
use nalgebra::{DMatrix, DVector};

use super::super::sensitivity::{MeasuredQuantity, Sensitivities};
use super::super::sensitivity_error::SensitivityError;
use super::FitError;

/// Largest measured value, in σ. The sum of squares of larger ones might overflow.
const MAX_VALUE_IN_SIGMA: f64 = 1e150;

/// A name with the number of its experiment, except for the first one (index 0).
pub(super) fn named(name: &str, index: usize) -> String {
    if index == 0 { name.to_owned() } else { format!("{name} (experiment {})", index + 1) }
}

/// Data as they were given.
pub(super) struct Given {
    pub(super) name: String,
    pub(super) points: Vec<(f64, f64)>,
    pub(super) sigma: Option<f64>,
}

/// Measured values of one quantity.
#[derive(Clone, Debug)]
pub(in super::super) struct Series {
    pub(in super::super) name: String,
    pub(in super::super) unit: String,
    pub(in super::super) quantity: MeasuredQuantity,
    pub(in super::super) points: Vec<(f64, f64)>,
    /// σ of the noise; 1 where it was not given.
    pub(in super::super) sigma: f64,
}

/// The data of the experiment of this index, checked, and the time at which they end.
pub(super) fn read<M: Simulate>(
    data: &[Given],
    start: f64,
    index: usize,
) -> Result<(Vec<Series>, f64), FitError> {
    let mut found = Vec::new();
    for Given { name, points, sigma } in data {
        let quantity = MeasuredQuantity::of::<M>(name).map_err(FitError::Motion)?;
        let name = named(name, index);
        if points.is_empty() {
            return Err(FitError::NoData { name: name.clone() });
        }
        for (row, (time, value)) in points.iter().enumerate() {
            if !time.is_finite() || !value.is_finite() {
                return Err(FitError::NotANumber { name: name.clone(), row, time: *time, value: *value });
            }
            if *time < start {
                return Err(FitError::BeforeStart { name: name.clone(), row, time: *time, start });
            }
        }
        if let Some(sigma) = sigma.filter(|sigma| !(*sigma > 0.0 && sigma.is_finite())) {
            return Err(FitError::Noise { name: name.clone(), sigma });
        }
        let too_large =
            |(_, (_, value)): &(usize, &(f64, f64))| value.abs() / sigma.unwrap_or(1.0) > MAX_VALUE_IN_SIGMA;
        if let Some((row, (time, value))) = points.iter().enumerate().find(too_large) {
            return Err(FitError::TooLarge { name: name.clone(), row, time: *time, value: *value });
        }
        let (points, sigma, unit) = (points.clone(), sigma.unwrap_or(1.0), quantity.unit::<M>());
        found.push(Series { name: name.clone(), unit, quantity, points, sigma });
    }
    let times = found.iter().flat_map(|s: &Series| &s.points).map(|(t, _)| *t);
    let end = times.fold(start, f64::max);
    if found.is_empty() {
        return Err(FitError::NoSeries);
    }
    if end == start { Err(FitError::OneInstant { time: start }) } else { Ok((found, end)) }
}

/// Whether σ is given. It must be given for all data or for none; otherwise only some weights would have
/// units.
pub(super) fn all_or_none<'a>(data: impl Iterator<Item = &'a Given>) -> Result<bool, FitError> {
    let (given, not): (Vec<_>, Vec<_>) = data.partition(|given| given.sigma.is_some());
    match not.first() {
        Some(without) if !given.is_empty() => Err(FitError::NoiseOfSome { without: without.name.clone() }),
        without => Ok(without.is_none()),
    }
}

/// The least root mean square of a measured coordinate or velocity; `None` if only outputs were measured.
pub(super) fn least_size(series: &[Series]) -> Option<f64> {
    let of_state = series.iter().filter(|s| !matches!(s.quantity, MeasuredQuantity::Output(_)));
    let size = |s: &Series| (s.points.iter().map(|(_, y)| y * y).sum::<f64>() / s.points.len() as f64).sqrt();
    of_state.map(size).filter(|size| *size > 0.0).reduce(f64::min)
}

/// (f − y)/σ of all data.
pub(super) fn residuals<M: Simulate>(
    series: &[Series],
    motion: &Motion<'_, M>,
) -> Result<DVector<f64>, SensitivityError> {
    let mut found = Vec::new();
    let (start, end) = (motion.start_time(), motion.end_time());
    for Series { quantity, points, sigma, .. } in series {
        let mut sampler = motion.sampler();
        for (t, value) in points {
            if !(start..=end).contains(t) {
                // An event has ended the motion.
                return Err(SensitivityError::OutOfRange { time: *t, start, end });
            }
            let state = sampler.at(*t);
            let modelled = match quantity {
                MeasuredQuantity::Position(i) => state.q()[*i],
                MeasuredQuantity::Velocity(i) => state.u()[*i],
                MeasuredQuantity::Output(i) => motion.outputs_of(&state)[*i],
            };
            if !modelled.is_finite() {
                return Err(SensitivityError::NotFinite { time: *t });
            }
            found.push((modelled - value) / sigma);
        }
    }
    Ok(DVector::from_vec(found))
}

/// ∂residuals/∂unknowns.
pub(super) fn jacobian<M: Simulate + Parameters + Clone>(
    series: &[Series],
    found: &Sensitivities<'_, M>,
) -> Result<DMatrix<f64>, SensitivityError> {
    let quantities: Vec<MeasuredQuantity> = series.iter().map(|s| s.quantity).collect();
    let rows = (0..found.times().len()).map(|k| found.rows(&quantities, k)).collect::<Result<Vec<_>, _>>()?;
    let count = series.iter().map(|s| s.points.len()).sum();
    let mut jacobian = DMatrix::zeros(count, found.variables().len());
    let mut row = 0;
    for (i, s) in series.iter().enumerate() {
        for (t, _) in &s.points {
            let not_there = SensitivityError::NotFinite { time: *t };
            // Times ascend along the motion.
            let k = found.times().partition_point(|time| time < t);
            let k = Some(k).filter(|k| found.times().get(*k) == Some(t)).ok_or(not_there)?;
            jacobian.set_row(row, &(rows[k].row(i) / s.sigma));
            row += 1;
        }
    }
    if jacobian.iter().all(|x| x.is_finite()) {
        Ok(jacobian)
    } else {
        Err(SensitivityError::NotFinite { time: found.motion.end_time() })
    }
}
