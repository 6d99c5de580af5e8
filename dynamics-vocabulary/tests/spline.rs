//! Cubic splines against known functions (observed order), against a second formulation, and against bad
//! data.
#![cfg(feature = "alloc")]

use dynamics_vocabulary::{CubicSpline, Expr, SmoothFunction, SplineError};
use nalgebra::{DMatrix, DVector};
use proptest::prelude::*;

/// f to f‴ of the function that the order of convergence is observed on; of period 2π.
fn smooth(x: f64) -> [f64; 4] {
    let e = x.sin().exp();
    let (s, c) = x.sin_cos();
    [e, c * e, (c * c - s) * e, (c * c * c - 3.0 * s * c - c) * e]
}

/// Uneven knots over one period: neighbouring spacings differ by up to a factor of about 1.6.
fn uneven(n: usize) -> Vec<f64> {
    let tau = core::f64::consts::TAU;
    let even = (0..=n).map(|i| tau * i as f64 / n as f64);
    even.map(|x| x + 0.2 * (x.sin() + 0.5 * (2.0 * x).sin())).collect()
}

/// Largest error of f … f‴ over points between the knots within a part of the domain.
fn errors(spline: &CubicSpline, part: [f64; 2]) -> [f64; 4] {
    let [first, last] = spline.domain();
    let mut worst = [0.0_f64; 4];
    for i in 0..1000 {
        let x = first + (last - first) * (part[0] + (part[1] - part[0]) * (f64::from(i) + 0.37) / 1000.0);
        for ((worst, ours), exact) in worst.iter_mut().zip(spline.derivatives(x)).zip(smooth(x)) {
            *worst = worst.max((ours - exact).abs());
        }
    }
    worst
}

/// What makes a spline from knots and values.
type Build = fn(&[f64], &[f64]) -> Result<CubicSpline, SplineError>;

#[test]
fn order_of_convergence() {
    const WHOLE: [f64; 2] = [0.0, 1.0];
    const MIDDLE: [f64; 2] = [0.3, 0.7];
    let clamped: Build = |x, y| CubicSpline::clamped(x, y, smooth(x[0])[1], smooth(x[x.len() - 1])[1]);
    let table: [(&str, Build, [f64; 2], [f64; 4]); 5] = [
        ("not-a-knot", CubicSpline::not_a_knot, WHOLE, [4.0, 3.0, 2.0, 1.0]),
        ("clamped", clamped, WHOLE, [4.0, 3.0, 2.0, 1.0]),
        ("periodic", CubicSpline::periodic, WHOLE, [4.0, 3.0, 2.0, 1.0]),
        ("natural, inside", CubicSpline::natural, MIDDLE, [4.0, 3.0, 2.0, 1.0]),
        // Known-bad: f″ is not 0 at these ends, and the natural spline takes it to be.
        ("natural, near the ends", CubicSpline::natural, WHOLE, [2.0, 1.0, 0.0, -1.0]),
    ];
    for (name, build, part, orders) in table {
        let error_of = |n: usize| {
            let knots = uneven(n);
            let mut values: Vec<f64> = knots.iter().map(|&x| smooth(x)[0]).collect();
            values[n] = values[0];
            errors(&build(&knots, &values).unwrap(), part)
        };
        let (coarse, fine) = (error_of(64), error_of(256));
        for (derivative, order) in orders.into_iter().enumerate() {
            let observed = (coarse[derivative] / fine[derivative]).ln() / 4.0_f64.ln();
            assert!(
                (observed - order).abs() < 0.35,
                "{name}, derivative {derivative}: order {observed:.2}, not {order}"
            );
        }
    }
}

/// Points with spacings from 0.1 to 10.
fn data(least: usize) -> impl Strategy<Value = (Vec<f64>, Vec<f64>)> {
    let point = (-1.0..1.0_f64, -5.0..5.0_f64);
    (-10.0..10.0_f64, proptest::collection::vec(point, least..12)).prop_map(|(start, points)| {
        let mut x = start;
        let knot = |(log, y): (f64, f64)| {
            x += 10_f64.powf(log);
            (x, y)
        };
        points.into_iter().map(knot).unzip()
    })
}

/// The second formulation: moments Mᵢ = f″(xᵢ) from hᵢ₋₁Mᵢ₋₁ + 2(hᵢ₋₁ + hᵢ)Mᵢ + hᵢMᵢ₊₁ = 6(δᵢ − δᵢ₋₁), solved
/// as a full system.
struct Moments {
    knots: Vec<f64>,
    values: Vec<f64>,
    moments: DVector<f64>,
}

enum Ends {
    Natural,
    Clamped(f64, f64),
    NotAKnot,
    Periodic,
}

impl Moments {
    fn new(knots: &[f64], values: &[f64], ends: &Ends) -> Self {
        let n = knots.len();
        let h = |i: usize| knots[i + 1] - knots[i];
        let secant = |i: usize| (values[i + 1] - values[i]) / h(i);
        let (mut matrix, mut right) = (DMatrix::zeros(n, n), DVector::zeros(n));
        for i in 1..n - 1 {
            (matrix[(i, i - 1)], matrix[(i, i)], matrix[(i, i + 1)]) =
                (h(i - 1), 2.0 * (h(i - 1) + h(i)), h(i));
            right[i] = 6.0 * (secant(i) - secant(i - 1));
        }
        match *ends {
            Ends::Natural => (matrix[(0, 0)], matrix[(n - 1, n - 1)]) = (1.0, 1.0),
            Ends::Clamped(first, last) => {
                (matrix[(0, 0)], matrix[(0, 1)]) = (2.0 * h(0), h(0));
                (matrix[(n - 1, n - 2)], matrix[(n - 1, n - 1)]) = (h(n - 2), 2.0 * h(n - 2));
                (right[0], right[n - 1]) = (6.0 * (secant(0) - first), 6.0 * (last - secant(n - 2)));
            }
            Ends::NotAKnot => {
                for (row, i) in [(0, 0), (n - 1, n - 3)] {
                    matrix[(row, i)] = 1.0 / h(i);
                    matrix[(row, i + 1)] = -1.0 / h(i) - 1.0 / h(i + 1);
                    matrix[(row, i + 2)] = 1.0 / h(i + 1);
                }
            }
            Ends::Periodic => {
                (matrix[(0, 0)], matrix[(0, n - 1)]) = (1.0, -1.0);
                matrix[(n - 1, n - 2)] = h(n - 2);
                matrix[(n - 1, n - 1)] = 2.0 * h(n - 2);
                (matrix[(n - 1, 0)], matrix[(n - 1, 1)]) = (2.0 * h(0), h(0));
                right[n - 1] = 6.0 * (secant(0) - secant(n - 2));
            }
        }
        let moments = matrix.full_piv_lu().solve(&right).unwrap();
        Self { knots: knots.to_vec(), values: values.to_vec(), moments }
    }

    fn derivatives(&self, x: f64) -> [f64; 4] {
        let i = (1..self.knots.len() - 1).rev().find(|&i| self.knots[i] <= x).unwrap_or(0);
        let (x0, x1, y0, y1) = (self.knots[i], self.knots[i + 1], self.values[i], self.values[i + 1]);
        let (m0, m1, h) = (self.moments[i], self.moments[i + 1], x1 - x0);
        let (a, b) = ((x1 - x) / h, (x - x0) / h);
        [
            a * y0 + b * y1 + ((a.powi(3) - a) * m0 + (b.powi(3) - b) * m1) * h * h / 6.0,
            (y1 - y0) / h + ((1.0 - 3.0 * a * a) * m0 + (3.0 * b * b - 1.0) * m1) * h / 6.0,
            a * m0 + b * m1,
            (m1 - m0) / h,
        ]
    }
}

/// Two splines agree in all derivatives at points of every interval, to rounding relative to the largest
/// there is.
fn assert_same(ours: &CubicSpline, theirs: &Moments) -> Result<(), TestCaseError> {
    let points =
        theirs.knots.windows(2).flat_map(|x| [0.1, 0.5, 0.85].map(|part| x[0] + part * (x[1] - x[0])));
    let pairs: Vec<_> = points.map(|x| (x, ours.derivatives(x), theirs.derivatives(x))).collect();
    for derivative in 0..4 {
        let scale = pairs.iter().fold(1.0_f64, |scale, (.., b)| scale.max(b[derivative].abs()));
        for (x, a, b) in &pairs {
            let error = (a[derivative] - b[derivative]).abs();
            prop_assert!(error < 1e-10 * scale, "derivative {derivative} at {x}: {a:?} and {b:?}");
        }
    }
    Ok(())
}

proptest! {
    #[test]
    fn slopes_and_moments_give_the_same_spline(
        (x, mut y) in data(4),
        first in -3.0..3.0_f64,
        last in -3.0..3.0_f64,
    ) {
        assert_same(&CubicSpline::natural(&x, &y).unwrap(), &Moments::new(&x, &y, &Ends::Natural))?;
        let clamped = Ends::Clamped(first, last);
        assert_same(&CubicSpline::clamped(&x, &y, first, last).unwrap(), &Moments::new(&x, &y, &clamped))?;
        assert_same(&CubicSpline::not_a_knot(&x, &y).unwrap(), &Moments::new(&x, &y, &Ends::NotAKnot))?;
        y[x.len() - 1] = y[0];
        assert_same(&CubicSpline::periodic(&x, &y).unwrap(), &Moments::new(&x, &y, &Ends::Periodic))?;
    }

    #[test]
    fn two_and_three_points_suffice_where_promised(
        (x, y) in data(2),
        first in -3.0..3.0_f64,
        last in -3.0..3.0_f64,
    ) {
        let (x, y) = (&x[..2], &y[..2]);
        let line = CubicSpline::natural(x, y).unwrap();
        let middle = 0.5 * (x[0] + x[1]);
        prop_assert!((line.derivatives(middle)[0] - 0.5 * (y[0] + y[1])).abs() < 1e-11);
        let hermite = CubicSpline::clamped(x, y, first, last).unwrap();
        prop_assert!((hermite.derivatives(x[0])[1] - first).abs() < 1e-12);
        prop_assert!((hermite.derivatives(x[1])[1] - last).abs() < 1e-10);
    }

    /// Within a piece the four derivatives belong to one cubic; at the knots all but the last are continuous.
    #[test]
    fn derivatives_belong_to_one_function((x, y) in data(4)) {
        let spline = CubicSpline::not_a_knot(&x, &y).unwrap();
        for (i, pair) in x.windows(2).enumerate() {
            let h = pair[1] - pair[0];
            let [f, f1, f2, f3] = spline.derivatives(pair[0]);
            let taylor =
                [f + h * (f1 + h * (f2 / 2.0 + h * f3 / 6.0)), f1 + h * (f2 + h * f3 / 2.0), f2 + h * f3];
            let scales = [
                f.abs() + h * (f1.abs() + h * (f2.abs() + h * f3.abs())),
                f1.abs() + h * (f2.abs() + h * f3.abs()),
                f2.abs() + h * f3.abs(),
            ];
            prop_assert!((spline.derivatives(pair[0])[0] - y[i]).abs() == 0.0, "passes through the data");
            let end = spline.derivatives(pair[1]);
            for ((taylor, end), scale) in taylor.iter().zip(end).zip(scales) {
                prop_assert!((taylor - end).abs() <= 1e-9 * scale, "{taylor} and {end}");
            }
        }
    }

    #[test]
    fn a_periodic_spline_repeats((x, mut y) in data(4), part in 0.0..1.0_f64, turns in -5..5_i32) {
        let n = x.len() - 1;
        y[n] = y[0];
        let spline = CubicSpline::periodic(&x, &y).unwrap();
        let (period, point) = (x[n] - x[0], x[0] + part * (x[n] - x[0]));
        let [here, there] = [point, point + f64::from(turns) * period].map(|x| spline.derivatives(x)[0]);
        let slope = |i: i32| spline.derivatives(x[0] + period * f64::from(i) / 100.0)[1].abs();
        let steepest = (0..100).map(slope).fold(1.0, f64::max);
        prop_assert!((here - there).abs() < 1e-11 * steepest * period, "{here} and {there}");
    }
}

/// The search for the interval is right however unevenly the knots lie: at every knot the piece on its right
/// counts.
#[test]
fn knots_may_be_spaced_wildly() {
    let powers = |exponents: core::ops::Range<i32>| exponents.map(|e| 10_f64.powi(e)).collect::<Vec<_>>();
    let mirrored: Vec<f64> = powers(-9..3).into_iter().rev().map(|x| 1.0 - x).collect();
    let lopsided: Vec<f64> = (0..50).map(|i| f64::from(i) * 1e-6).chain([1.0]).collect();
    let subnormal: Vec<f64> = (0..5).map(|i| f64::from(i) * 1e-310).collect();
    let huge = vec![-1e307, -1.0, 1.0, 1e307];
    for knots in [powers(-9..3), mirrored, lopsided, subnormal, huge] {
        let value = |i: usize| if knots[1] - knots[0] < 1e-300 { 2.0 } else { (i % 3) as f64 };
        let values: Vec<f64> = (0..knots.len()).map(value).collect();
        let spline = CubicSpline::natural(&knots, &values).unwrap();
        for i in 0..knots.len() - 1 {
            assert_eq!(spline.derivatives(knots[i])[0], values[i], "at knot {i} of {knots:?}");
            let middle = 0.5 * knots[i] + 0.5 * knots[i + 1];
            assert_eq!(
                spline.derivatives(middle)[3],
                spline.derivatives(knots[i])[3],
                "after knot {i} of {knots:?}"
            );
        }
    }
}

#[test]
fn outside_its_knots_a_spline_is_not_a_number_or_what_was_asked_for() {
    let (x, y) = ([0.0, 1.0, 2.0, 4.0], [0.0, 1.0, 0.0, 3.0]);
    let plain = CubicSpline::clamped(&x, &y, 0.5, -2.0).unwrap();
    for outside in [-1e-300, 4.000_000_000_000_001, f64::NAN, f64::INFINITY] {
        assert!(plain.derivatives(outside).iter().all(|d| d.is_nan()), "{outside}");
        assert!(plain.at(Expr::coordinate(outside, 1.0, 0.0)).value().is_nan());
    }
    assert_eq!((plain.domain(), plain.knots()), ([0.0, 4.0], &x[..]));
    let straight = plain.extrapolate_linearly();
    assert_eq!(straight.derivatives(-2.0), [-1.0, 0.5, 0.0, 0.0]);
    let beyond = straight.derivatives(4.5);
    assert!((beyond[0] - 2.0).abs() < 1e-14 && (beyond[1] + 2.0).abs() < 1e-14 && beyond[2..] == [0.0, 0.0]);
    assert!(straight.derivatives(f64::NEG_INFINITY).iter().all(|d| d.is_nan()));
    let round = CubicSpline::periodic(&x, &[0.0, 1.0, -1.0, 0.0]).unwrap().extrapolate_linearly();
    assert_eq!(round.derivatives(5.0), round.derivatives(1.0));
    assert_eq!(round.derivatives(-1e-300), round.derivatives(4.0));
}

#[test]
fn bad_data_are_errors_that_name_the_number() {
    let (x, y) = ([0.0, 1.0, 2.0, 3.0], [0.0, 1.0, 4.0, 9.0]);
    let table = [
        (CubicSpline::natural(&x, &y[..3]), "4 knots but 3 values; a spline needs one value per knot"),
        (CubicSpline::natural(&x[..1], &y[..1]), "1 points; this kind of spline needs at least 2"),
        (CubicSpline::not_a_knot(&x[..3], &y[..3]), "3 points; this kind of spline needs at least 4"),
        (CubicSpline::natural(&[], &[]), "0 points; this kind of spline needs at least 2"),
        (
            CubicSpline::natural(&[0.0, 2.0, 2.0, 3.0], &y),
            "knot 2 is 2.0 after 2.0; knots have to increase strictly",
        ),
        (CubicSpline::natural(&[0.0, f64::NAN], &y[..2]), "knot 1 is NaN; a spline needs finite numbers"),
        (
            CubicSpline::natural(&x[..2], &[f64::INFINITY, 0.0]),
            "value 0 is inf; a spline needs finite numbers",
        ),
        (CubicSpline::clamped(&x, &y, 0.0, f64::NAN), "slope 1 is NaN; a spline needs finite numbers"),
        (
            CubicSpline::periodic(&x, &y),
            "the first value is 0.0, the last 9.0; a periodic spline ends where it begins",
        ),
        (
            CubicSpline::natural(&[0.0, 1e-200, 1.0, 2.0], &[0.0, 1e200, 0.0, 1.0]),
            "the piece from knot 0 at 0.0 to 1e-200 has coefficients beyond the range of f64; \
             move nearly coincident knots apart or scale the values",
        ),
    ];
    for (result, expected) in table {
        assert_eq!(result.unwrap_err().to_string(), expected);
    }
}
