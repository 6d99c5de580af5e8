//! Cubic splines through data: tracks, cam profiles, measured characteristics.
//!
//! Between two knots the curve is a cubic polynomial; f, f′ and f″ are continuous, f‴ jumps at the knots.
//! Four conditions at the ends are in use:
//!
//! | constructor | condition | error of f for knots h apart |
//! |---|---|---|
//! | [`CubicSpline::not_a_knot`] | f‴ continuous at the first and last inner knot | O(h⁴) |
//! | [`CubicSpline::clamped`] | f′ given at both ends | O(h⁴) |
//! | [`CubicSpline::periodic`] | f, f′, f″ agree at the ends | O(h⁴) |
//! | [`CubicSpline::natural`] | f″ = 0 at both ends | O(h⁴) inside, O(h²) near the ends |
//!
//! Source: C. de Boor, *A Practical Guide to Splines*, revised edition, Springer 2001, chapters IV and V.

mod slopes;

use alloc::vec::Vec;
use core::fmt;

use crate::smooth::{Outside, Pieces, SmoothFunction};

/// An interpolating cubic spline f(x) with exact derivatives, a [`SmoothFunction`].
///
/// Outside the first and the last knot there is no data, so f is NaN there, and a run that gets there ends
/// with an error. [`extrapolate_linearly`](Self::extrapolate_linearly) continues it by straight lines. A
/// periodic spline repeats itself.
///
/// A curve in the plane or in space is a pair or a triple of splines over one parameter:
///
/// ```
/// # use dynamics_vocabulary as dynamics;
/// use dynamics::{CubicSpline, Expr, SmoothFunction, SplineError, vec2};
///
/// # fn main() -> Result<(), SplineError> {
/// let s = [0.0, 1.0, 2.0, 3.5, 5.0];
/// let x = CubicSpline::not_a_knot(&s, &[0.0, 1.0, 1.9, 3.0, 4.0])?;
/// let y = CubicSpline::not_a_knot(&s, &[3.0, 2.5, 1.0, 0.2, 0.8])?;
/// let position = Expr::coordinate(1.2, 2.0, 0.0);
/// let car = vec2(x.at(position), y.at(position));
/// assert!(car.dt().value().y < 0.0);
/// # Ok(())
/// # }
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct CubicSpline {
    knots: Vec<f64>,
    /// Per interval f, f′, f″/2, f‴/6 at its left knot.
    pieces: Vec<[f64; 4]>,
    cells: Cells,
    outside: Outside,
}

/// Equal parts of the domain, as many as there are intervals, with the first interval that reaches into each:
/// a search among the few knots of one part instead of all. Measured at 100 even knots against one binary
/// search: 30 ns instead of 42 ns from x to f, 8 ns instead of 18 ns where evaluations overlap.
#[derive(Clone, Debug, PartialEq)]
struct Cells {
    per_unit: f64,
    first: Vec<usize>,
}

/// Why data do not make a spline.
#[derive(Clone, PartialEq)]
#[non_exhaustive]
pub enum SplineError {
    /// As many values as knots are needed.
    LengthsDiffer {
        /// Number of knots.
        knots: usize,
        /// Number of values.
        values: usize,
    },
    /// The end condition needs more points.
    TooFewPoints {
        /// Number of points.
        given: usize,
        /// Least number for this kind of spline.
        needed: usize,
    },
    /// A number is infinite or NaN.
    NotFinite {
        /// `knot`, `value` or `slope`.
        quantity: &'static str,
        /// Its index from 0.
        index: usize,
        /// The number.
        value: f64,
    },
    /// Knots have to increase strictly.
    NotIncreasing {
        /// Index of the knot that is not greater than the one before.
        index: usize,
        /// The knot before.
        previous: f64,
        /// The knot.
        knot: f64,
    },
    /// The last value of a periodic spline has to repeat the first.
    NotPeriodic {
        /// The first value.
        first: f64,
        /// The last value.
        last: f64,
    },
    /// The coefficients of an interval leave the range of `f64`: two knots nearly coincide, or values are
    /// enormous.
    OutOfRange {
        /// Index of the interval's left knot.
        index: usize,
        /// Its left knot.
        left: f64,
        /// Its right knot.
        right: f64,
    },
}

impl CubicSpline {
    /// The spline with f″ = 0 at both ends, the shape of a thin beam that passes through at least 2 points.
    pub fn natural(knots: &[f64], values: &[f64]) -> Result<Self, SplineError> {
        check(knots, values, 2)?;
        Self::from_slopes(knots, values, &slopes::natural(knots, values), Outside::Unknown)
    }

    /// The spline with given slopes f′ at the first and the last of at least 2 points.
    pub fn clamped(
        knots: &[f64],
        values: &[f64],
        first_slope: f64,
        last_slope: f64,
    ) -> Result<Self, SplineError> {
        check(knots, values, 2)?;
        check_finite("slope", &[first_slope, last_slope])?;
        let slopes = slopes::clamped(knots, values, [first_slope, last_slope]);
        Self::from_slopes(knots, values, &slopes, Outside::Unknown)
    }

    /// The spline whose first two and last two pieces are one cubic each, through at least 4 points: the
    /// choice if nothing is known about the ends.
    pub fn not_a_knot(knots: &[f64], values: &[f64]) -> Result<Self, SplineError> {
        check(knots, values, 4)?;
        Self::from_slopes(knots, values, &slopes::not_a_knot(knots, values), Outside::Unknown)
    }

    /// The spline that repeats itself with the period `last knot − first knot`, through at least 4 points of
    /// which the last repeats the first.
    pub fn periodic(knots: &[f64], values: &[f64]) -> Result<Self, SplineError> {
        check(knots, values, 4)?;
        let (first, last) = (values[0], values[values.len() - 1]);
        if first != last {
            return Err(SplineError::NotPeriodic { first, last });
        }
        Self::from_slopes(knots, values, &slopes::periodic(knots, values), Outside::Periodic)
    }

    /// Continues the spline beyond its ends by straight lines with the value and the slope it has there; f″
    /// jumps to 0.
    ///
    /// A periodic spline has no ends and stays as it is.
    #[must_use]
    pub fn extrapolate_linearly(mut self) -> Self {
        if self.outside == Outside::Unknown {
            self.outside = Outside::Linear;
        }
        self
    }

    /// The first and the last knot.
    #[must_use]
    pub fn domain(&self) -> [f64; 2] {
        [self.knots[0], self.knots[self.knots.len() - 1]]
    }

    /// The knots in increasing order.
    #[must_use]
    pub fn knots(&self) -> &[f64] {
        &self.knots
    }

    fn from_slopes(
        knots: &[f64],
        values: &[f64],
        slopes: &[f64],
        outside: Outside,
    ) -> Result<Self, SplineError> {
        let mut pieces = Vec::with_capacity(knots.len() - 1);
        for i in 0..knots.len() - 1 {
            let h = knots[i + 1] - knots[i];
            let secant = (values[i + 1] - values[i]) / h;
            let [left, right] = [slopes[i] - secant, slopes[i + 1] - secant];
            let piece = [values[i], slopes[i], -(2.0 * left + right) / h, (left + right) / h / h];
            if !piece.iter().all(|coefficient| coefficient.is_finite()) {
                return Err(SplineError::OutOfRange { index: i, left: knots[i], right: knots[i + 1] });
            }
            pieces.push(piece);
        }
        Ok(Self { knots: knots.to_vec(), pieces, cells: Cells::new(knots), outside })
    }

    /// f to f‴ for x between the first and the last knot; an inner knot belongs to the interval on its right.
    fn inside(&self, x: f64) -> [f64; 4] {
        let i = self.cells.interval(&self.knots, x);
        let ([a, b, c, d], s) = (self.pieces[i], x - self.knots[i]);
        [a + s * (b + s * (c + s * d)), b + s * (2.0 * c + s * (3.0 * d)), 2.0 * c + s * (6.0 * d), 6.0 * d]
    }
}

impl Cells {
    fn new(knots: &[f64]) -> Self {
        let intervals = knots.len() - 1;
        let per_unit = intervals as f64 / (knots[intervals] - knots[0]);
        // A domain too short to be divided is one part.
        let per_unit = if per_unit.is_finite() { per_unit } else { 0.0 };
        // By the very arithmetic of the look-up, so that rounding cannot put a knot into another part there
        // than here.
        let part = |knot: f64| ((knot - knots[0]) * per_unit) as usize;
        let inner = &knots[1..intervals];
        let first =
            (0..=intervals + 1).map(|cell| inner.partition_point(|&knot| part(knot) < cell)).collect();
        Self { per_unit, first }
    }

    /// The interval that contains x, the one on the right at an inner knot.
    #[inline]
    fn interval(&self, knots: &[f64], x: f64) -> usize {
        // At least 0 and at most the number of intervals: x lies between the first and the last knot.
        let cell = ((x - knots[0]) * self.per_unit) as usize;
        let (from, to) = (self.first[cell], self.first[cell + 1]);
        from + knots[1 + from..=to].partition_point(|&knot| knot <= x)
    }
}

impl SmoothFunction for CubicSpline {
    fn derivatives(&self, x: f64) -> [f64; 4] {
        let [first, last] = self.domain();
        if first <= x && x <= last {
            return self.inside(x);
        }
        match self.outside {
            _ if !x.is_finite() => [f64::NAN; 4],
            Outside::Unknown => [f64::NAN; 4],
            Outside::Linear => {
                let end = if x < first { first } else { last };
                let [f, slope, ..] = self.inside(end);
                [f + slope * (x - end), slope, 0.0, 0.0]
            }
            Outside::Periodic => {
                let period = last - first;
                let past = (x - first) % period;
                let wrapped = if past < 0.0 { last + past } else { first + past };
                self.inside(wrapped.clamp(first, last))
            }
        }
    }

    fn pieces(&self) -> Option<Pieces> {
        let (knots, coefficients) = (self.knots.clone(), self.pieces.clone());
        Some(Pieces { knots, coefficients, outside: self.outside })
    }

    /// Between two knots; beyond the first and the last knot, where a spline goes on as a line, up to there.
    fn piece(&self, x: f64) -> [f64; 2] {
        let [first, last] = self.domain();
        let (mut wrapped, mut shift) = (x, 0.0);
        if self.outside == Outside::Periodic {
            let period = last - first;
            // As `derivatives` wraps it.
            let past = (x - first) % period;
            wrapped = (if past < 0.0 { last + past } else { first + past }).clamp(first, last);
            shift = x - wrapped;
        }
        if wrapped < first {
            return [f64::NEG_INFINITY, first];
        }
        if wrapped > last {
            return [last, f64::INFINITY];
        }
        if wrapped.is_nan() {
            return [f64::NEG_INFINITY, f64::INFINITY];
        }
        let i = self.cells.interval(&self.knots, wrapped);
        [self.knots[i] + shift, self.knots[i + 1] + shift]
    }
}

fn check(knots: &[f64], values: &[f64], needed: usize) -> Result<(), SplineError> {
    if knots.len() != values.len() {
        return Err(SplineError::LengthsDiffer { knots: knots.len(), values: values.len() });
    }
    if knots.len() < needed {
        return Err(SplineError::TooFewPoints { given: knots.len(), needed });
    }
    check_finite("knot", knots)?;
    check_finite("value", values)?;
    for (i, pair) in knots.windows(2).enumerate() {
        if pair[0] >= pair[1] {
            return Err(SplineError::NotIncreasing { index: i + 1, previous: pair[0], knot: pair[1] });
        }
    }
    Ok(())
}

fn check_finite(quantity: &'static str, numbers: &[f64]) -> Result<(), SplineError> {
    match numbers.iter().enumerate().find(|(_, number)| !number.is_finite()) {
        Some((index, &value)) => Err(SplineError::NotFinite { quantity, index, value }),
        None => Ok(()),
    }
}

impl fmt::Display for SplineError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::LengthsDiffer { knots, values } => {
                write!(f, "{knots} knots but {values} values; a spline needs one value per knot")
            }
            Self::TooFewPoints { given, needed } => {
                write!(f, "{given} points; this kind of spline needs at least {needed}")
            }
            Self::NotFinite { quantity, index, value } => {
                write!(f, "{quantity} {index} is {value:?}; a spline needs finite numbers")
            }
            Self::NotIncreasing { index, previous, knot } => {
                write!(f, "knot {index} is {knot:?} after {previous:?}; knots have to increase strictly")
            }
            Self::NotPeriodic { first, last } => {
                write!(
                    f,
                    "the first value is {first:?}, the last {last:?}; a periodic spline ends where it begins"
                )
            }
            Self::OutOfRange { index, left, right } => write!(
                f,
                "the piece from knot {index} at {left:?} to {right:?} has coefficients beyond the range of \
                 f64; move nearly coincident knots apart or scale the values"
            ),
        }
    }
}

crate::sentence_for_debugging!(SplineError);
impl core::error::Error for SplineError {}
