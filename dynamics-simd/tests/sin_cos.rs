//! The inlined sine and cosine against 70 digits.

use dashu_float::FBig;
use dashu_float::round::mode::HalfEven;
use dynamics_simd::sin_cos;
use proptest::prelude::*;

type Real = FBig<HalfEven, 2>;

/// Largest error that is promised, in units in the last place.
const PROMISED: f64 = 0.8;

/// |x − truth| in units in the last place of the truth.
fn ulps(x: f64, truth: &Real) -> f64 {
    let near = truth.to_f64().value();
    let last_place = (near.abs().next_up() - near.abs()).max(f64::MIN_POSITIVE * f64::EPSILON);
    let exact = Real::try_from(x).expect("finite").with_precision(260).value();
    let error = exact - truth;
    (error / Real::try_from(last_place).expect("finite").with_precision(260).value()).to_f64().value().abs()
}

fn errors(x: f64) -> [f64; 2] {
    let exact = Real::try_from(x).expect("finite").with_precision(260).value();
    let (s, c) = sin_cos::fast(x);
    [ulps(s, &exact.clone().sin()), ulps(c, &exact.cos())]
}

fn check(x: f64) -> f64 {
    let [s, c] = errors(x);
    assert!(s <= PROMISED && c <= PROMISED, "x = {x:e}: sine errs by {s} units, cosine by {c}");
    s.max(c)
}

#[test]
fn a_turn_and_more() {
    let worst = (0..2000).map(|i| check(f64::from(i - 1000) * 0.009_411)).fold(0.0, f64::max);
    // It is not exact either: a comparison of a function with itself would pass this test as well.
    assert!(worst > 0.5);
}

/// Where sine or cosine nearly vanish, errors of the reduction would show.
#[test]
fn beside_multiples_of_a_right_angle() {
    let mut k = 1u32;
    while k < 660_000 {
        let x = f64::from(k) * core::f64::consts::FRAC_PI_2;
        for x in [x.next_down(), x, x.next_up()] {
            check(x);
        }
        k += 1 + k / 60;
    }
    // The number below 2²⁰ next to a multiple of π/2 is among the convergents of 2/π: 573204/364913,
    // 354911/225944 and smaller ones.
    for k in [3.0, 355.0, 710.0, 312_689.0, 208_341.0, 573_204.0, 833_719.0] {
        check(k);
    }
}

#[test]
fn small_and_large() {
    for x in [1e-320, 1e-300, 1e-20, 1e-9, 2f64.powi(-27), 1e-4, 999_999.9, 1_048_576.0, 1_048_575.999_999_9]
    {
        check(x);
        check(-x);
    }
}

proptest! {
    #![proptest_config(ProptestConfig {
        cases: 1000,
        failure_persistence: None,
        ..ProptestConfig::default()
    })]

    #[test]
    fn anywhere(mantissa in -1.0f64..1.0, exponent in -8i32..21) {
        check(mantissa * 2f64.powi(exponent));
    }
}
