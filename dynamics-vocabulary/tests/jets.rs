//! Time jets against two independent routes along random motions: dual numbers of another library (tight),
//! and difference quotients of f64's own functions (which know nothing of derivatives).

use dynamics_vocabulary::{Expr, math};
use num_dual::{Dual2_64, DualNum};
use proptest::prelude::*;

/// The state of a motion x(t) at t = 0: x, ẋ, ẍ.
type Motion = [f64; 3];

fn jet([x, rate, acceleration]: Motion) -> Expr {
    Expr::coordinate(x, rate, acceleration)
}

fn dual([x, rate, acceleration]: Motion) -> Dual2_64 {
    Dual2_64::new(x, rate, acceleration)
}

fn at([x, rate, acceleration]: Motion, t: f64) -> f64 {
    x + t * (rate + 0.5 * t * acceleration)
}

/// |ours − theirs| within `tolerance` of the larger of `scale` and their size.
fn close(name: &str, ours: f64, theirs: f64, scale: f64, tolerance: f64) -> Result<(), TestCaseError> {
    let allowed = tolerance * scale.max(theirs.abs());
    prop_assert!(
        (ours - theirs).abs() <= allowed,
        "{name}: {ours:e}, by the other route {theirs:e} ± {allowed:e}"
    );
    Ok(())
}

fn compare_with_dual(name: &str, ours: Expr, theirs: Dual2_64) -> Result<(), TestCaseError> {
    // Terms of the chain rule cancel: their size is bounded through the largest of the derivatives.
    let scale = 1.0_f64.max(theirs.re.abs()).max(theirs.v1.abs());
    close(name, ours.value(), theirs.re, 1.0, 1e-13)?;
    close(name, ours.rate(), theirs.v1, scale, 1e-11)?;
    close(name, ours.acceleration(), theirs.v2, scale * scale, 1e-10)
}

/// First and second derivative of `f` at 0 by central differences of steps h, h/2, h/4, extrapolated twice:
/// O(h⁶).
fn differences(f: impl Fn(f64) -> f64, h: f64) -> [f64; 2] {
    let here = f(0.0);
    let [mut first, mut second] = [[0.0; 3]; 2];
    for (k, h) in [h, 0.5 * h, 0.25 * h].into_iter().enumerate() {
        let (after, before) = (f(h), f(-h));
        first[k] = (after - before) / (2.0 * h);
        second[k] = (after - 2.0 * here + before) / (h * h);
    }
    [first, second].map(|d| {
        let once = [(4.0 * d[1] - d[0]) / 3.0, (4.0 * d[2] - d[1]) / 3.0];
        (16.0 * once[1] - once[0]) / 15.0
    })
}

fn compare_with_differences(name: &str, ours: Expr, f: impl Fn(f64) -> f64) -> Result<(), TestCaseError> {
    let here = f(0.0);
    let [first, second] = differences(f, 4e-3);
    let scale = 1.0_f64.max(here.abs()).max(first.abs());
    close(name, ours.value(), here, 1.0, 1e-15)?;
    close(name, ours.rate(), first, scale, 1e-8)?;
    close(name, ours.acceleration(), second, scale * scale, 1e-5)
}

/// A function of one variable three times: on jets, on dual numbers, on f64, and the arguments it is tried
/// on.
struct Function {
    name: &'static str,
    jets: fn(Expr) -> Expr,
    duals: fn(Dual2_64) -> Dual2_64,
    numbers: fn(f64) -> f64,
    domain: [f64; 2],
}

macro_rules! functions {
    ($($name:literal, |$x:ident| $ours:expr, $theirs:expr, $range:expr;)*) => {
        [$(Function {
            name: $name,
            jets: |$x| $ours,
            duals: |$x| $theirs,
            numbers: |$x| $ours,
            domain: $range,
        }),*]
    };
}

const FUNCTIONS: &[Function] = &functions! {
    "sin", |x| x.sin(), DualNum::sin(&x), [-10.0, 10.0];
    "cos", |x| x.cos(), DualNum::cos(&x), [-10.0, 10.0];
    "sin_cos", |x| x.sin_cos().0 * x.sin_cos().1, DualNum::sin(&x) * DualNum::cos(&x), [-10.0, 10.0];
    "tan", |x| x.tan(), DualNum::tan(&x), [-1.2, 1.2];
    "asin", |x| x.asin(), DualNum::asin(&x), [-0.9, 0.9];
    "acos", |x| x.acos(), DualNum::acos(&x), [-0.9, 0.9];
    "atan", |x| x.atan(), DualNum::atan(&x), [-10.0, 10.0];
    "sinh", |x| x.sinh(), DualNum::sinh(&x), [-3.0, 3.0];
    "cosh", |x| x.cosh(), DualNum::cosh(&x), [-3.0, 3.0];
    "tanh", |x| x.tanh(), DualNum::sinh(&x) / DualNum::cosh(&x), [-3.0, 3.0];
    "exp", |x| x.exp(), DualNum::exp(&x), [-3.0, 3.0];
    "ln", |x| x.ln(), DualNum::ln(&x), [0.2, 10.0];
    "sqrt", |x| x.sqrt(), DualNum::sqrt(&x), [0.2, 10.0];
    "cbrt", |x| x.cbrt(), DualNum::cbrt(&x), [0.2, 10.0];
    "cbrt of a negative number", |x| x.cbrt(), -DualNum::cbrt(&-x), [-10.0, -0.2];
    "recip", |x| x.recip(), DualNum::recip(&x), [0.3, 10.0];
    "powi 0", |x| x.powi(0) * x, x, [-3.0, 3.0];
    "powi 1", |x| x.powi(1), x, [-3.0, 3.0];
    "powi 2", |x| x.powi(2), x * x, [-3.0, 3.0];
    "powi 3", |x| x.powi(3), x * x * x, [-3.0, 3.0];
    "powi 7", |x| x.powi(7), DualNum::powi(&x, 7), [-2.0, 2.0];
    "powi -1", |x| x.powi(-1), DualNum::recip(&x), [-3.0, -0.3];
    "powi -4", |x| x.powi(-4), DualNum::recip(&(x * x * x * x)), [0.3, 3.0];
    "powf 2.5", |x| x.powf(2.5), DualNum::exp(&(DualNum::ln(&x) * 2.5)), [0.3, 3.0];
    "powf -0.7", |x| x.powf(-0.7), DualNum::exp(&(DualNum::ln(&x) * -0.7)), [0.3, 3.0];
    "powf 1", |x| x.powf(1.0), x, [-3.0, 3.0];
    "powf 2", |x| x.powf(2.0), x * x, [-3.0, 3.0];
    "powf 3 of a negative number", |x| x.powf(3.0), x * x * x, [-3.0, -0.3];
    "mul_add", |x| x.mul_add(x, 2.0), x * x + 2.0, [-3.0, 3.0];
    "abs, positive", |x| x.abs() * x, x * x, [0.1, 3.0];
    "abs, negative", |x| x.abs() * x, -x * x, [-3.0, -0.1];
    "signum", |x| x.signum() * x, -x, [-3.0, -0.1];
    "quotient", |x| (1.0 + 2.0 * x) / (3.0 - x * x), (x * 2.0 + 1.0) / (-x * x + 3.0), [-1.5, 1.5];
    "composed", |x| (x.sin() * 0.5).asin().exp() - 1.0 / x,
        DualNum::exp(&DualNum::asin(&(DualNum::sin(&x) * 0.5))) - DualNum::recip(&x), [0.3, 3.0];
};

fn speed() -> core::ops::Range<f64> {
    -2.0..2.0
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(400))]

    #[test]
    fn functions_of_one_variable(part in 0.02..0.98_f64, rate in speed(), acceleration in speed()) {
        for f in FUNCTIONS {
            let motion = [f.domain[0] + part * (f.domain[1] - f.domain[0]), rate, acceleration];
            compare_with_dual(f.name, (f.jets)(jet(motion)), (f.duals)(dual(motion)))?;
            compare_with_differences(f.name, (f.jets)(jet(motion)), |t| (f.numbers)(at(motion, t)))?;
            let constant = (f.jets)(Expr::from(motion[0]));
            close(f.name, constant.value(), (f.numbers)(motion[0]), 1.0, 1e-15)?;
            prop_assert!(constant.is_constant(), "{}", f.name);
        }
    }

    /// f(x, y) with both moving, and with either held.
    #[test]
    fn functions_of_two_variables(
        x in [0.3..3.0_f64, speed(), speed()],
        y in [0.3..3.0_f64, speed(), speed()],
        signs in [any::<bool>(), any::<bool>()],
    ) {
        let signed = |[value, rate, acceleration]: Motion, sign: bool| {
            [if sign { value } else { -value }, rate, acceleration]
        };
        let (p, q) = (signed(x, signs[0]), signed(y, signs[1]));
        let held = |[value, ..]: Motion| [value, 0.0, 0.0];
        for (p, q, x, y) in [(p, q, x, y), (held(p), q, held(x), y), (p, held(q), x, held(y))] {
            // A jet from `coordinate` that rests now moves later; from a number it never does. Both have to
            // be right.
            let both = [(jet(p), jet(q), jet(x), jet(y)), (fixed(p), fixed(q), fixed(x), fixed(y))];
            for (pj, qj, xj, yj) in both {
                compare_with_differences("atan2", pj.atan2(qj), |t| at(p, t).atan2(at(q, t)))?;
                compare_with_differences("hypot", pj.hypot(qj), |t| at(p, t).hypot(at(q, t)))?;
                compare_with_differences("powf", xj.powf(yj), |t| at(x, t).powf(at(y, t)))?;
                compare_with_differences("product", pj * qj, |t| at(p, t) * at(q, t))?;
                compare_with_differences("quotient", pj / qj, |t| at(p, t) / at(q, t))?;
                let fused = |t| at(p, t).mul_add(at(q, t), at(x, t));
                compare_with_differences("mul_add", pj.mul_add(qj, xj), fused)?;
                let (pd, qd, xd, yd) = (dual(p), dual(q), dual(x), dual(y));
                let power = DualNum::exp(&(DualNum::ln(&xd) * yd));
                compare_with_dual("powf", xj.powf(yj), power)?;
                compare_with_dual("hypot", pj.hypot(qj), DualNum::sqrt(&(pd * pd + qd * qd)))?;
                compare_with_dual("product", pj * qj, pd * qd)?;
                compare_with_dual("quotient", pj / qj, pd / qd)?;
                compare_with_dual("difference", pj - qj + 2.0 - (-xj), pd - qd + 2.0 + xd)?;
                // The angle from its tangent, or from its cotangent: another formula, right up to a constant.
                let flat = pd.re.abs() < qd.re.abs();
                let angle = if flat { DualNum::atan(&(pd / qd)) } else { -DualNum::atan(&(qd / pd)) };
                let ours = pj.atan2(qj);
                compare_with_dual("atan2", ours - ours.value() + angle.re, angle)?;
            }
        }
    }

    /// The lesser and the greater with their derivatives, whatever the order of the arguments.
    #[test]
    fn minimum_and_maximum(p in [speed(), speed(), speed()], q in [speed(), speed(), speed()]) {
        prop_assume!(p[0] != q[0]);
        let (low, high) = if p[0] < q[0] { (p, q) } else { (q, p) };
        for (name, ours, expected) in [
            ("min", jet(p).min(jet(q)), low),
            ("max", jet(p).max(jet(q)), high),
            ("clamp below", jet(low).clamp(jet(high), 10.0), high),
            ("clamp above", jet(high).clamp(-10.0, jet(low)), low),
            ("clamp inside", jet(p).clamp(-2.0, 2.0), p),
        ] {
            prop_assert_eq!([ours.value(), ours.rate(), ours.acceleration()], expected, "{}", name);
        }
        let (a, b) = (jet(p), jet(q));
        prop_assert_eq!(a < b, p[0] < q[0]);
        prop_assert_eq!(a >= q[0], p[0] >= q[0]);
        prop_assert_eq!(p[0] > b, p[0] > q[0]);
    }

    /// x.dt() is what the difference quotient of the rate says, and unknown thereafter.
    #[test]
    fn the_time_derivative_shifts(x in [speed(), speed(), speed()]) {
        let f = |x: Expr| (0.3 * x).exp() * x.cos();
        let ours = f(jet(x)).dt();
        let [first, _] = differences(|t| f(jet([at(x, t), x[1] + x[2] * t, x[2]])).rate(), 4e-3);
        close("ẍ", ours.rate(), first, 1.0, 1e-8)?;
        prop_assert_eq!(ours.value(), f(jet(x)).rate());
        prop_assert!(ours.acceleration().is_nan() && ours.dt().dt().value().is_nan());
    }
}

/// A jet that never moves where the motion does not.
fn fixed(motion: Motion) -> Expr {
    if motion[1..] == [0.0, 0.0] { Expr::from(motion[0]) } else { jet(motion) }
}

#[test]
fn what_is_unknown_is_not_a_number() {
    let x = Expr::coordinate(1.0, 2.0, 3.0);
    let input = Expr::input(5.0);
    for (name, unknown) in [
        ("third derivative of a coordinate", x.dt().dt().dt()),
        ("third derivative of a coordinate at rest", Expr::coordinate(1.0, 0.0, 0.0).dt().dt().dt()),
        ("third derivative of a negation", (-x).dt().dt().dt()),
        ("third derivative of a product", (x * 2.0 + 1.0).dt().dt().dt()),
        ("rate of an input", input.dt()),
        ("rate of a function of an input", (x * input.sin()).dt()),
        ("acceleration without accelerations", Expr::coordinate(1.0, 2.0, f64::NAN).dt().dt()),
        ("third derivative of sin t", Expr::time(0.0).sin().dt().dt().dt()),
        ("third derivative of t³", Expr::time(0.0).powi(3).dt().dt().dt()),
        ("third derivative of t²·t", (Expr::time(0.0) * Expr::time(0.0) * Expr::time(0.0)).dt().dt().dt()),
        ("third derivative of 1/t", Expr::time(1.0).recip().dt().dt().dt()),
        ("third derivative of 1/t", (1.0 / Expr::time(1.0)).dt().dt().dt()),
        ("of NaN", Expr::from(f64::NAN).abs()),
        ("of NaN", Expr::from(f64::NAN).signum()),
        ("of NaN", Expr::from(f64::NAN).min(1.0)),
        ("of NaN", Expr::ONE.min(f64::NAN)),
        ("of NaN", Expr::ONE.max(f64::NAN)),
    ] {
        assert!(unknown.value().is_nan(), "{name} is {unknown:?}");
    }
    assert_eq!((x * input.sin()).value(), 5.0_f64.sin());
}

#[test]
fn what_is_known_for_good_stays_known() {
    let t = Expr::time(2.0);
    let fall = 10.0 + 3.0 * t - 0.5 * 9.81 * t * t;
    for (derivative, expected) in
        [10.0 + 6.0 - 2.0 * 9.81, 3.0 - 9.81 * 2.0, -9.81, 0.0, 0.0].into_iter().enumerate()
    {
        let found = (0..derivative).fold(fall, |x, _| x.dt());
        assert!((found.value() - expected).abs() < 1e-14 * 20.0, "derivative {derivative}: {found:?}");
    }
    let constants = [
        Expr::ZERO.sqrt(),
        Expr::ZERO.cbrt(),
        Expr::ZERO.hypot(0.0),
        Expr::ZERO.powf(0.5),
        Expr::ONE.asin(),
        Expr::from(2.0) / 3.0,
        t.powi(0),
        t.powf(0.0),
        t.dt(),
        t / 2.0 - 0.5 * t,
        Expr::from(-3.0).abs().min(4.0).max(-1.0).atan2(2.0),
        Expr::coordinate(1.0, 2.0, 3.0).signum(),
    ];
    for constant in constants {
        assert!(constant.is_constant() && constant.dt().dt().dt().value() == 0.0, "{constant:?}");
    }
    // A product that underflows is not a product that vanishes.
    let tiny = 1e-200 * t * t;
    assert_eq!((tiny * (1e-200 * t)).dt().value(), 0.0);
    assert!((tiny * (1e-200 * t)).dt().dt().dt().value().is_nan());
}

#[test]
fn branches_take_the_conventions_of_f64() {
    let at_zero = |zero: f64| Expr::coordinate(zero, 3.0, 5.0);
    assert_eq!((at_zero(0.0).abs().rate(), at_zero(-0.0).abs().rate()), (3.0, -3.0));
    assert_eq!((at_zero(0.0).signum().value(), at_zero(-0.0).signum().value()), (1.0, -1.0));
    let (first, second) = (Expr::coordinate(1.0, 2.0, 0.0), Expr::coordinate(1.0, -2.0, 0.0));
    assert_eq!((first.min(second).rate(), first.max(second).rate()), (2.0, 2.0));
    assert!(first == second && first <= second && first >= second);
    assert!(Expr::from(f64::NAN).partial_cmp(&Expr::ONE).is_none());
    assert_eq!(Expr::ONE.clamp(5.0, 3.0).value(), 3.0);
}

/// Generated code calls these functions where a model function calls the methods of jets.
#[test]
fn numbers_and_jets_share_their_conventions() {
    let samples = [0.0, -0.0, 1.0, -2.5, f64::NAN, f64::INFINITY];
    let same = |a: f64, b: f64| a.to_bits() == b.to_bits() || (a.is_nan() && b.is_nan());
    for a in samples {
        assert!(
            same(math::abs(a), Expr::from(a).abs().value())
                && same(math::signum(a), Expr::from(a).signum().value())
        );
        for b in samples {
            assert!(same(math::min(a, b), Expr::from(a).min(b).value()), "min({a}, {b})");
            assert!(same(math::max(a, b), Expr::from(a).max(b).value()), "max({a}, {b})");
        }
    }
    assert!(same(math::min(0.0, -0.0), 0.0) && same(math::max(-0.0, 0.0), -0.0), "the first of equals");
}

/// Where a textbook formula loses its digits or leaves the range of f64.
#[test]
fn extreme_arguments() {
    let x = |value: f64| Expr::coordinate(value, 1.0, 0.0);
    let relative = |ours: f64, exact: f64| ((ours - exact) / exact).abs();
    // tanh′ = 4e⁻²ˣ/(1 + e⁻²ˣ)²
    assert!(relative(x(25.0).tanh().rate(), 4.0 * (-50.0_f64).exp()) < 1e-14);
    assert_eq!(x(1e3).tanh().rate(), 0.0);
    // asin′ near 1: 1/√((1 − x)(1 + x)), with 1 − x = 2⁻⁴⁰ exactly
    let delta = 2.0_f64.powi(-40);
    assert!(relative(x(1.0 - delta).asin().rate(), 1.0 / (delta * (2.0 - delta)).sqrt()) < 1e-14);
    assert!(relative(x(1.0 - delta).acos().rate(), -1.0 / (delta * (2.0 - delta)).sqrt()) < 1e-14);
    for size in [1e-160, 1e160] {
        let (y, at) = (x(3.0 * size), Expr::from(4.0 * size));
        assert!(relative(y.atan2(at).rate(), 4.0 / (25.0 * size)) < 1e-14);
        assert!(relative(y.hypot(at).rate(), 0.6) < 1e-14);
        assert!(relative(y.hypot(at).acceleration(), 0.64 / (5.0 * size)) < 1e-14);
    }
    assert_eq!(x(2.0).powi(i32::MIN).value(), 0.0);
    assert_eq!(x(1.0).powi(i32::MAX).rate(), f64::from(i32::MAX));
    assert_eq!(x(1.0).powi(i32::MIN).rate(), f64::from(i32::MIN));
    assert_eq!((x(0.0).powi(3).rate(), x(0.0).powi(3).acceleration()), (0.0, 0.0));
    assert_eq!((x(0.0).powf(1.0).rate(), x(0.0).powf(3.0).rate()), (1.0, 0.0));
}

#[test]
fn jets_print_like_numbers() {
    let x = Expr::coordinate(1.5, 2.0, f64::NAN);
    assert_eq!(format!("{x} {x:8.3} {x:e}", x = x.value()), "1.5    1.500 1.5e0");
    assert_eq!(format!("{x}|{x:8.3}"), "1.5|   1.500");
    assert_eq!(format!("{x:?}"), "Expr { value: 1.5, rate: 2.0, acceleration: NaN }");
    assert_eq!([x, Expr::ONE].iter().sum::<Expr>().value(), 2.5);
    assert_eq!([0.5, 0.25].into_iter().sum::<Expr>().value(), 0.75);
}
