//! Responses over time: to an impulse, a step, and any load that is straight between its points.
//!
//! ```text
//! x(t) = e^{At} x₀ + ∫ e^{A(t−τ)} B w(τ) dτ        (Duhamel)
//! ```
//!
//! Where w is straight, (x, w, ẇ) fulfils linear equations with constant coefficients, and one matrix
//! exponential leads from point to point without an error of the method (C. F. Van Loan, IEEE Trans. Autom.
//! Control 23 (1978) 395).

use alloc::string::String;
use alloc::vec::Vec;

use nalgebra::linalg::balancing::balance_parlett_reinsch;
use nalgebra::{DMatrix, DVector};

use super::state_space::Signal;
use super::{StateSpace, VibrationError};

/// Relative perturbation of the elements of A and B for the uncertainty: they are rounded results of sums.
const ELEMENT_PERTURBATION: f64 = 2.0 * f64::EPSILON;
/// Factor on the effect of that perturbation, because other signs of the perturbations may have a larger
/// effect.
const UNCERTAINTY_FACTOR: f64 = 4.0;
/// Terms of the series of the exponential of a matrix with norm ½: the next one is below
/// ½¹⁸/18! = 6e-22.
const EXPONENTIAL_SERIES_TERMS: u32 = 18;
/// Norm up to which the series is used; larger matrices are halved first.
const MAX_SERIES_NORM: f64 = 0.5;
/// An element is taken from E² only if its terms are smaller than those of 2F + F² by this factor. For
/// oscillations both have equal terms, and 2F + F² keeps the digits of slow components.
const CLEARLY_SMALLER: f64 = 0.125;
/// Times that differ by so many roundings have the same exponential.
const EQUAL_STEP_ROUNDINGS: f64 = 4.0;

/// A load over time: straight between its points, zero before the first and after the last. Two points at one
/// time are a jump.
#[derive(Clone, Debug, PartialEq)]
pub struct Load {
    input: String,
    points: Vec<(f64, f64)>,
}

impl Load {
    /// On an input, or along a coordinate, through points (t, value) with times that do not fall.
    pub fn new(input: impl Into<String>, points: impl IntoIterator<Item = (f64, f64)>) -> Self {
        Self { input: input.into(), points: points.into_iter().collect() }
    }

    /// The value just after a time, and its slope up to the next point.
    fn after(&self, t: f64) -> (f64, f64) {
        let next = self.points.partition_point(|(at, _)| *at <= t);
        match (next.checked_sub(1).and_then(|k| self.points.get(k)), self.points.get(next)) {
            (Some((from, value)), Some((to, then))) => {
                let slope = (then - value) / (to - from);
                (value + slope * (t - from), slope)
            }
            _ => (0.0, 0.0),
        }
    }
}

/// Outputs over time.
#[derive(Clone, Debug, PartialEq)]
pub struct TimeResponse {
    /// The times, in s.
    pub times: Vec<f64>,
    /// The outputs, in the order of the columns.
    pub outputs: Vec<Signal>,
    /// A row for each time, a column for each output; just after where a load jumps.
    pub values: DMatrix<f64>,
    /// The effect of rounding of the matrices' elements on each value. It is measured by the response with
    /// elements that are perturbed so. If a soft and a stiff part share one element, the soft one has no
    /// digits.
    pub uncertainty: DMatrix<f64>,
}

impl TimeResponse {
    /// (t, value) of an output.
    pub fn of(&self, output: &str) -> Option<Vec<(f64, f64)>> {
        let column = self.outputs.iter().position(|signal| signal.name == output)?;
        Some(self.times.iter().copied().zip(self.values.column(column).iter().copied()).collect())
    }
}

impl StateSpace {
    /// The response of an output to an impulse of size 1 on an input at time 0, which was at rest.
    ///
    /// # Errors
    /// Names that are not known, times that fall or are negative, and outputs that contain the input, and so
    /// the impulse itself.
    pub fn impulse_response(
        &self,
        input: &str,
        output: &str,
        times: &[f64],
    ) -> Result<TimeResponse, VibrationError> {
        let (row, column) = (self.output(output)?, self.input(input)?);
        if self.d[(row, column)] != 0.0 {
            return Err(VibrationError::Feedthrough { output: output.into(), input: input.into() });
        }
        self.march(&[], &[row], self.b.column(column).into_owned(), times)
    }

    /// The response of an output to an input that jumps from 0 to 1 at time 0, which was at rest.
    ///
    /// # Errors
    /// Names that are not known, and times that fall or are negative.
    pub fn step_response(
        &self,
        input: &str,
        output: &str,
        times: &[f64],
    ) -> Result<TimeResponse, VibrationError> {
        let end = times.last().copied().unwrap_or(0.0);
        let load = Load::new(input, [(0.0, 1.0), (2.0 * end + 1.0, 1.0)]);
        self.response(&[load], &[output], &[], times)
    }

    /// The response of outputs to loads, from deviations of the states at time 0, by name (none: from rest).
    ///
    /// # Errors
    /// Names that are not known, or come twice among the start, loads of fewer than two points, values that
    /// are not finite, and times that fall or are negative.
    pub fn response(
        &self,
        loads: &[Load],
        outputs: &[&str],
        start: &[(&str, f64)],
        times: &[f64],
    ) -> Result<TimeResponse, VibrationError> {
        let rows = outputs.iter().map(|name| self.output(name)).collect::<Result<Vec<_>, _>>()?;
        let mut x = DVector::zeros(self.states.len());
        for (k, (name, value)) in start.iter().enumerate() {
            finite("a start", *value)?;
            if start[..k].iter().any(|(other, _)| other == name) {
                let must_be = "given once for each state";
                return Err(VibrationError::Value { what: "a start", value: *value, must_be });
            }
            x[super::state_space::find(&self.states, name, "state")?] = *value;
        }
        self.march(loads, &rows, x, times)
    }

    /// The response from a state at time 0 to loads, at the times. It steps from each time, or point of a
    /// load, to the next by one matrix exponential.
    fn march(
        &self,
        loads: &[Load],
        rows: &[usize],
        x: DVector<f64>,
        times: &[f64],
    ) -> Result<TimeResponse, VibrationError> {
        let columns = loads.iter().map(|load| self.input(&load.input)).collect::<Result<Vec<_>, _>>()?;
        for load in loads {
            if load.points.len() < 2 {
                let what = "points of a load";
                return Err(VibrationError::TooFew { what, count: load.points.len(), needed: 2 });
            }
            ascending(load.points.iter().map(|point| point.0), f64::NEG_INFINITY)?;
            load.points.iter().try_for_each(|(_, value)| finite("a load", *value))?;
        }
        ascending(times.iter().copied(), 0.0)?;
        // Steps end at the requested times and at the points of the loads.
        let mut stops: Vec<f64> =
            loads.iter().flat_map(|load| load.points.iter().map(|point| point.0)).collect();
        let end = times.last().copied().unwrap_or(0.0);
        stops.retain(|t| *t > 0.0 && *t < end);
        stops.extend_from_slice(times);
        stops.sort_by(f64::total_cmp);
        stops.dedup();
        let (b, c) = (self.b.select_columns(&columns), self.c.select_rows(rows));
        let d = self.d.select_rows(rows).select_columns(&columns);
        // The march is made twice: with the matrices, and with perturbed elements for the uncertainty.
        let along = |a: &DMatrix<f64>, b: &DMatrix<f64>| {
            let mut steps = Steps { a, b, last: None };
            let (mut t, mut values, mut next) = (0.0, DMatrix::zeros(times.len(), rows.len()), 0);
            let mut x = x.clone();
            for stop in &stops {
                if *stop > t {
                    x = steps.advance(&x, loads, t, stop - t);
                    t = *stop;
                }
                while times.get(next) == Some(&t) {
                    let w = DVector::from_iterator(loads.len(), loads.iter().map(|load| load.after(t).0));
                    values.row_mut(next).copy_from(&(&c * &x + &d * w).transpose());
                    next += 1;
                }
            }
            values
        };
        let values = along(&self.a, &b);
        let uncertainty = (along(&perturbed(&self.a), &perturbed(&b)) - &values).abs() * UNCERTAINTY_FACTOR;
        if !values.iter().all(|value| value.is_finite()) {
            let must_be = "small enough for the growth to be representable";
            return Err(VibrationError::Value { what: "the last time", value: end, must_be });
        }
        let outputs = rows.iter().map(|row| self.outputs[*row].clone()).collect();
        Ok(TimeResponse { times: times.into(), outputs, values, uncertainty })
    }
}

/// Steps by matrix exponentials. The last exponential is kept, since times at equal distances have the same.
struct Steps<'a> {
    a: &'a DMatrix<f64>,
    b: &'a DMatrix<f64>,
    last: Option<(f64, DMatrix<f64>)>,
}

impl Steps<'_> {
    /// x(t + h) for loads that are straight from t to t + h.
    fn advance(&mut self, x: &DVector<f64>, loads: &[Load], t: f64, h: f64) -> DVector<f64> {
        let (n, w) = (self.a.nrows(), self.b.ncols());
        let same = |last: &f64| (last - h).abs() <= EQUAL_STEP_ROUNDINGS * f64::EPSILON * (t + h);
        if !self.last.as_ref().is_some_and(|(last, _)| same(last)) {
            let mut joined = DMatrix::zeros(n + 2 * w, n + 2 * w);
            joined.view_mut((0, 0), (n, n)).copy_from(&(self.a * h));
            joined.view_mut((0, n), (n, w)).copy_from(&(self.b * h));
            joined.view_mut((n, n + w), (w, w)).fill_diagonal(1.0);
            self.last = Some((h, exponential(joined)));
        }
        let Some((h, exponential)) = &self.last else { return x.clone() };
        let mut all = DVector::zeros(n + 2 * w);
        all.rows_mut(0, n).copy_from(x);
        for (k, load) in loads.iter().enumerate() {
            let (value, slope) = load.after(t);
            all[n + k] = value;
            all[n + w + k] = slope * h;
        }
        (exponential.rows(0, n) * all).into_owned()
    }
}

/// The matrix with perturbed elements, some up and some down.
fn perturbed(m: &DMatrix<f64>) -> DMatrix<f64> {
    let sign = |i: usize, j: usize| {
        if (2.4 * i as f64 + 1.3 * j as f64).sin() < 0.0 {
            -ELEMENT_PERTURBATION
        } else {
            ELEMENT_PERTURBATION
        }
    };
    DMatrix::from_fn(m.nrows(), m.ncols(), |i, j| m[(i, j)] * (1.0 + sign(i, j)))
}

/// e^m by scaling and squaring (N. J. Higham, *Functions of Matrices*, §10.3), as E = e^m and as
/// F = E − 1.
///
/// Slow components beside stiff ones change very little within m/2^s, ‖m‖/2^s ≤ ½. In E they would
/// lose their digits beside the 1; 2F + F² keeps them. Decaying components have F near −1, and in F the
/// small rest would lose its digits; E² keeps them. Each element is taken from the square whose terms are
/// smaller, because its rounding is smaller.
fn exponential(mut m: DMatrix<f64>) -> DMatrix<f64> {
    let n = m.nrows();
    // Balancing scales by powers of two and does not round.
    let scale = balance_parlett_reinsch(&mut m);
    let size = m.column_iter().map(|column| column.lp_norm(1)).fold(0.0, f64::max);
    let halvings = if size > MAX_SERIES_NORM { (2.0 * size).log2().ceil() } else { 0.0 };
    let m = m * (-halvings).exp2();
    let mut less_one = m.clone();
    let mut term = m.clone();
    for k in 2..=EXPONENTIAL_SERIES_TERMS {
        term = &term * &m / f64::from(k);
        less_one += &term;
    }
    let mut whole = &less_one + DMatrix::identity(n, n);
    for _ in 0..halvings as usize {
        (less_one, whole) = squared(&less_one, &whole);
    }
    DMatrix::from_fn(n, n, |i, j| whole[(i, j)] * scale[i] / scale[j])
}

/// F and E of twice the time.
fn squared(less_one: &DMatrix<f64>, whole: &DMatrix<f64>) -> (DMatrix<f64>, DMatrix<f64>) {
    let sizes = [less_one.abs(), whole.abs()];
    let terms = [&sizes[0] * 2.0 + &sizes[0] * &sizes[0], &sizes[1] * &sizes[1]];
    let (mut f, mut e) = (less_one * 2.0 + less_one * less_one, whole * whole);
    for j in 0..f.ncols() {
        for i in 0..f.nrows() {
            let one = if i == j { 1.0 } else { 0.0 };
            if terms[1][(i, j)] < CLEARLY_SMALLER * terms[0][(i, j)] {
                f[(i, j)] = e[(i, j)] - one;
            } else {
                e[(i, j)] = f[(i, j)] + one;
            }
        }
    }
    (f, e)
}

fn finite(what: &'static str, value: f64) -> Result<(), VibrationError> {
    if value.is_finite() {
        Ok(())
    } else {
        Err(VibrationError::Value { what, value, must_be: "a finite number" })
    }
}

fn ascending(times: impl Iterator<Item = f64>, from: f64) -> Result<(), VibrationError> {
    let mut before = from;
    for value in times {
        if !(value.is_finite() && value >= before) {
            let must_be = "a finite number, not before the one before, and not before 0 where results are \
                asked for";
            return Err(VibrationError::Value { what: "a time", value, must_be });
        }
        before = value;
    }
    Ok(())
}
