//! Integrals of outputs that saturate, by the adjoint equations: corners between and beside the nodes of
//! steps, in the state, in a parameter, and in time.

use dynamics::prelude::*;
use std::f64::consts::{PI, TAU};

/// x = x₀ cos ωt, and what is made of it.
#[derive(Clone, Debug, Dynamics)]
#[coordinates(x: m)]
#[units(m: kg, k: N / m, gain: 1 / m, limit: 1, fades: 1 / s)]
struct Meter {
    m: f64,
    k: f64,
    gain: f64,
    limit: f64,
    fades: f64,
}
#[dynamics]
impl Meter {
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * self.m * q.x.dt().powi(2)
    }
    #[potential]
    fn spring(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * self.k * q.x.powi(2)
    }
    #[output]
    fn saturated(&self, q: &Coordinates<Self>) -> Expr {
        (self.gain * q.x).min(self.limit).max(-self.limit)
    }
    #[output]
    fn rectified(&self, q: &Coordinates<Self>) -> Expr {
        (self.gain * q.x - 0.2 * self.limit).max(0.0)
    }
    #[output]
    fn fading(&self, q: &Coordinates<Self>) -> Expr {
        (self.limit - self.fades * q.t).max(0.0)
    }
}

const METER: Meter = Meter { m: 1.0, k: 4.0, gain: 2.0, limit: 0.5, fades: 0.1 };
const NAMES: [&str; 5] = ["m", "k", "gain", "limit", "x"];

/// ∫ f dt with f smooth between the times at which 2 cos 2t passes one of the levels.
fn integral(end: f64, levels: &[f64], f: impl Fn(f64) -> f64) -> f64 {
    let turns = (0..=(2.0 * end / TAU) as i32 + 1).map(|n| f64::from(n) * PI);
    let about = |at: f64| {
        levels
            .iter()
            .flat_map(move |level| [at - 0.5 * (level / 2.0).acos(), at + 0.5 * (level / 2.0).acos()])
    };
    let mut ends: Vec<f64> =
        turns.flat_map(about).filter(|t| *t > 0.0 && *t < end).chain([0.0, end]).collect();
    ends.sort_by(f64::total_cmp);
    let nodes = [
        (0.0, 0.568_888_888_888_888_9),
        (0.538_469_310_105_683_1, 0.478_628_670_499_366_5),
        (0.906_179_845_938_664, 0.236_926_885_056_189_1),
    ];
    let part = |a: f64, b: f64| {
        let at = |x: f64| f(0.5 * (a + b) + 0.5 * (b - a) * x);
        nodes.iter().map(|(x, w)| if *x == 0.0 { w * at(0.0) } else { w * (at(*x) + at(-x)) }).sum::<f64>()
            * 0.5
            * (b - a)
    };
    let pieces = ends.windows(2).map(|pair| {
        (0..10)
            .map(|i| {
                let at = |i: f64| pair[0] + (pair[1] - pair[0]) * i / 10.0;
                part(at(f64::from(i)), at(f64::from(i + 1)))
            })
            .sum::<f64>()
    });
    pieces.sum()
}

/// Seven and 64 corners: crawling up to them takes thousands of steps, and what lies in the blind ends of
/// steps makes per cents of a derivative.
#[test]
fn integrals_of_saturated_outputs_have_their_gradients() {
    for (end, most) in [(5.3, 70), (50.3, 600)] {
        let start = METER.state().x(1.0).build().unwrap();
        let x = |t: f64| (2.0 * t).cos();
        // ∂x/∂k = −t sin 2t/(2ωm), ∂x/∂m = k/m times the negative of it.
        let by_k = |t: f64| -t * (2.0 * t).sin() / 4.0;
        let found = METER.objective(start).integral("saturated", 1.0).by(NAMES).until(end).run().unwrap();
        let inside = |t: f64| if (2.0 * x(t)).abs() < 0.5 { 1.0 } else { 0.0 };
        let of = |f: &dyn Fn(f64) -> f64| integral(end, &[0.5, -0.5], f);
        let wanted = [
            of(&|t| -8.0 * by_k(t) * inside(t)),
            of(&|t| 2.0 * by_k(t) * inside(t)),
            of(&|t| x(t) * inside(t)),
            of(&|t| x(t).signum() * (1.0 - inside(t))),
            of(&|t| 2.0 * x(t) * inside(t)),
        ];
        let value = of(&|t| (2.0 * x(t)).clamp(-0.5, 0.5));
        assert!((found.value - value).abs() < 1e-9, "{} {value}", found.value);
        for ((name, by), wanted) in NAMES.iter().zip(found.derivatives()).zip(wanted) {
            assert!((by - wanted).abs() < 1e-8 * wanted.abs().max(1.0), "{end} {name}: {by} {wanted}");
        }
        assert!(found.steps < most, "{end}: {} steps", found.steps);

        let found = METER.objective(start).integral("rectified", 1.0).by(NAMES).until(end).run().unwrap();
        let above = |t: f64| if 2.0 * x(t) > 0.1 { 1.0 } else { 0.0 };
        let of = |f: &dyn Fn(f64) -> f64| integral(end, &[0.1], f);
        let wanted = [
            of(&|t| -8.0 * by_k(t) * above(t)),
            of(&|t| 2.0 * by_k(t) * above(t)),
            of(&|t| x(t) * above(t)),
            of(&|t| -0.2 * above(t)),
            of(&|t| 2.0 * x(t) * above(t)),
        ];
        for ((name, by), wanted) in NAMES.iter().zip(found.derivatives()).zip(wanted) {
            assert!((by - wanted).abs() < 1e-8 * wanted.abs().max(1.0), "{end} {name}: {by} {wanted}");
        }
        assert!(found.steps < most, "{end}: {} steps", found.steps);
    }
}

/// A corner of time alone, which no derivative by the state shows: ½ limit²/fades.
#[test]
fn corners_in_time_are_met() {
    let start = METER.state().x(1.0).build().unwrap();
    let found =
        METER.objective(start).integral("fading", 1.0).by(["limit", "fades"]).until(17.0).run().unwrap();
    let [limit, fades] = [found.get("limit").unwrap(), found.get("fades").unwrap()];
    assert!(
        (found.value - 1.25).abs() < 1e-9 && (limit - 5.0).abs() < 1e-8 && (fades + 12.5).abs() < 1e-8,
        "{found}"
    );
}

/// Saturated all the time it depends on the limit alone, though a gain three times as long, or none, would do
/// the same.
#[test]
fn what_is_saturated_does_not_depend_on_its_gain() {
    let start = METER.state().x(1.0).build().unwrap();
    let found =
        METER.objective(start).integral("saturated", 1.0).by(["gain", "limit"]).until(0.4).run().unwrap();
    assert_eq!(found.get("gain").unwrap(), 0.0);
    assert!((found.get("limit").unwrap() - 0.4).abs() < 1e-10);
    let forward = METER.sensitivities(start).by(["gain"]).until(0.4).output_times([0.4]).run().unwrap();
    assert_eq!(forward.series("saturated", "gain").unwrap()[0].1, 0.0);
}

/// Swinging a thousand times as far it passes through the unsaturated range within a few ten-thousandths of a
/// second, between the places that are looked at: what the value does tells.
#[test]
fn what_passes_quickly_is_met() {
    let start = METER.state().x(1e3).build().unwrap();
    let found =
        METER.objective(start).integral("saturated", 1.0).by(["k", "limit", "x"]).until(9.0).run().unwrap();
    // Zero crossings at t = (n + ½) π/2, through which x goes with 2·1000 m/s: each adds 0.5/2000 of gain
    // ∂x/∂k = −gain x₀ t sin(2t)/4.
    let crossings = (0..6).map(|n| (f64::from(n) + 0.5) * PI / 2.0).filter(|t| *t < 9.0);
    let by_k = crossings.map(|t| -2.0 * 1e3 * t * (2.0 * t).sin() / 4.0 * 0.5 / 2e3).sum::<f64>();
    let k = found.get("k").unwrap();
    assert!((k - by_k).abs() < 1e-6 * by_k.abs(), "{k} {by_k}");
    assert!(found.get("x").unwrap().abs() < 1e-9, "{found}");
    // Up, down, up: from crossing to crossing.
    let at = |n: i32| ((f64::from(n) + 0.5) * PI / 2.0).min(9.0);
    let part = |n: i32| if n == 0 { at(0) } else { at(n) - at(n - 1) };
    let signs = (0..7).map(|n| if n % 2 == 0 { part(n) } else { -part(n) });
    let limit = signs.sum::<f64>();
    assert!((found.get("limit").unwrap() - limit).abs() < 1e-6, "{found} {limit}");
}

/// A motion of micrometres has the digits of one of metres.
#[test]
fn small_motions_have_their_digits() {
    for x0 in [1e-2, 1e-4, 1e-6] {
        let start = METER.state().x(x0).build().unwrap();
        let found =
            METER.objective(start).integral("saturated", 1.0).by(["k", "x"]).until(5.3).run().unwrap();
        let wanted = [-0.5 * x0 * (0.25 * 10.6_f64.sin() - 2.65 * 10.6_f64.cos()), 10.6_f64.sin()];
        assert!((found.value / (x0 * 10.6_f64.sin()) - 1.0).abs() < 1e-8, "{x0:e} {found}");
        assert!(
            found.derivatives().iter().zip(wanted).all(|(by, wanted)| (by / wanted - 1.0).abs() < 1e-8),
            "{found}"
        );
        let forward = METER.sensitivities(start).by(["k"]).until(5.3).output_times([5.3]).run().unwrap();
        let wanted = -0.25 * x0 * 5.3 * 10.6_f64.sin();
        assert!((forward.series("x", "k").unwrap()[0].1 / wanted - 1.0).abs() < 1e-8, "{x0:e}");
    }
}
