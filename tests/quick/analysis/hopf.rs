//! Curves of Hopf points over two parameters, against Hurwitz determinants.

use dynamics::analysis::{BranchEnd, ContinuationError, SpecialKind, SpecialPoint, continuation, hopf_curve};
use dynamics::prelude::*;

use crate::ziegler::Ziegler;

fn column(p: f64, c: f64, follows: f64) -> Ziegler {
    Ziegler { follows, m: 1.0, l: 1.0, k: 1.0, c, p }
}

/// a₄ σ⁴ + … + a₀ of the upright column, from M, D and K by hand.
fn polynomial(p: f64, c: f64, follows: f64) -> [f64; 5] {
    let rest = 1.0 - follows;
    let a0 = (2.0 - p) * (1.0 - rest * p) - (1.0 - follows * p);
    [a0, c * (2.0 - 3.0 * rest * p), 7.0 - 4.0 * p + 2.0 * follows * p + c * c, 7.0 * c, 2.0]
}

/// The first flutter of the column by its load.
fn first(c: f64, follows: f64) -> SpecialPoint<State<Ziegler>> {
    let family = |p: f64| column(p, c, follows);
    let start = family(0.0).state().build().unwrap();
    let branch = continuation(family).from(&start, 0.0).until(0.0..=6.0).run().unwrap();
    let flutter = |one: &&SpecialPoint<_>| {
        matches!(one.kind, SpecialKind::Hopf { .. } | SpecialKind::FrequenciesMeet { .. })
    };
    branch.special.iter().find(flutter).cloned().unwrap()
}

#[test]
fn damping_moves_the_flutter_load() {
    // P = 41/28 + c²/2.
    let hopf = first(0.5, 1.0);
    let over = |p: f64, c: f64| column(p, c, 1.0);
    for back in [true, false] {
        let curve = hopf_curve(over, &hopf, 0.5).until(0.0..=6.0, 1e-3..=2.0);
        let curve = if back { curve.backward() } else { curve }.run().unwrap();
        assert!(curve.end == BranchEnd::Range && curve.points.len() > 5 && curve.points[0].0[1] == 0.5);
        assert_eq!(curve.points.last().unwrap().0[1], if back { 1e-3 } else { 2.0 });
        for (([p, c], _), frequency) in curve.points.iter().zip(&curve.frequencies) {
            assert!((p - (41.0 / 28.0 + 0.5 * c * c)).abs() < 1e-11, "{p} at {c}");
            // ω² = a₁/a₃.
            assert!((frequency * frequency - 2.0 / 7.0).abs() < 1e-11, "{frequency} at {c}");
        }
    }
}

#[test]
fn a_force_that_follows_less_ends_flutter_where_it_meets_divergence() {
    let c = 0.3;
    let over = |p: f64, follows: f64| column(p, c, follows);
    let curve = hopf_curve(over, &first(c, 1.0), 1.0).until(0.5..=6.0, 0.0..=1.2).backward().run().unwrap();
    for ([p, follows], _) in &curve.points {
        let [a0, a1, a2, a3, a4] = polynomial(*p, c, *follows);
        let hurwitz = a3 * a2 * a1 - a4 * a1 * a1 - a0 * a3 * a3;
        assert!(hurwitz.abs() < 1e-9, "{hurwitz:e} at {p}, {follows}");
    }
    // a₀ = a₁ = 0: P = 3/2, η = 5/9 (Bogdanov & Takens).
    assert_eq!(curve.end, BranchEnd::ZeroFrequency);
    let ([p, follows], _) = curve.points.last().unwrap();
    assert!((p - 1.5).abs() < 1e-2 && (follows - 5.0 / 9.0).abs() < 1e-2, "{p}, {follows}");
}

#[test]
fn without_damping_two_frequencies_stay_one() {
    // (ω²)² a₄ − ω² a₂ + a₀ has a double root: a₂² = 4 a₀ a₄.
    let over = |p: f64, follows: f64| column(p, 0.0, follows);
    let meet = first(0.0, 1.0);
    assert!(matches!(meet.kind, SpecialKind::FrequenciesMeet { .. }));
    let curve = hopf_curve(over, &meet, 1.0).until(0.5..=6.0, 0.7..=1.1).backward().run().unwrap();
    assert!(curve.end == BranchEnd::Range && curve.points.len() > 5, "{:?}", curve.end);
    for (([p, follows], _), frequency) in curve.points.iter().zip(&curve.frequencies) {
        let [a0, _, a2, _, a4] = polynomial(*p, 0.0, *follows);
        assert!((a2 * a2 - 4.0 * a0 * a4).abs() < 1e-10, "{p}, {follows}");
        assert!((frequency * frequency - a2 / (2.0 * a4)).abs() < 1e-6, "{frequency}");
    }
}

#[test]
fn what_is_no_hopf_point_is_refused() {
    let over = |p: f64, c: f64| column(p, c, 1.0);
    let hopf = first(0.5, 1.0);
    let mut other = hopf.clone();
    other.kind = SpecialKind::Fold;
    let error = hopf_curve(over, &other, 0.5).until(0.0..=6.0, 0.1..=2.0).run().unwrap_err();
    assert_eq!(error, ContinuationError::NoHopf);
    // Far from where it begins.
    let mut far = hopf.clone();
    far.parameter = 0.2;
    let error = hopf_curve(over, &far, 0.5).until(0.0..=6.0, 0.1..=2.0).run().unwrap_err();
    assert_eq!(error, ContinuationError::NoHopf);
    let error = hopf_curve(over, &hopf, 0.5).until(0.0..=6.0, 0.6..=2.0).run().unwrap_err();
    assert!(matches!(error, ContinuationError::Range { .. }), "{error}");
    // A model that ends on the way says so, with what there is.
    let ends = |p: f64, c: f64| column(if c > 0.8 { f64::NAN } else { p }, c, 1.0);
    let error = hopf_curve(ends, &hopf, 0.5).until(0.0..=6.0, 0.1..=2.0).run().unwrap_err();
    let ContinuationError::HopfCurve { at, reason: Some(_), ref curve } = error else { panic!("{error}") };
    assert!(at[1] <= 0.8 && at[1] > 0.7 && !curve.points.is_empty(), "{error}");
}

/// ẍ + (c − a) ẋ + k x + (x/size)² x = 0: flutter begins at a = c, whatever the size.
#[derive(Clone, Debug, Dynamics)]
#[coordinates(x)]
struct Driven {
    a: f64,
    k: f64,
    size: f64,
}
#[dynamics]
impl Driven {
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * q.x.dt().powi(2)
    }
    #[force]
    fn push(&self, q: &Coordinates<Self>) -> Force {
        Force::along(q.x, (self.a - 0.5) * q.x.dt() - self.k * q.x - (q.x / self.size).powi(2) * q.x)
    }
}

#[test]
fn hopf_points_are_followed_at_any_size() {
    for size in [1e-6, 1.0, 1e6] {
        let family = |a: f64| Driven { a, k: 1.0, size };
        let start = family(0.0).state().build().unwrap();
        let branch = continuation(family).from(&start, 0.0).until(0.0..=1.0).run().unwrap();
        let hopf = branch.special.iter().find(|one| matches!(one.kind, SpecialKind::Hopf { .. })).unwrap();
        let curve = hopf_curve(|a, k| Driven { a, k, size }, hopf, 1.0).until(0.0..=1.0, -1.0..=4.0);
        let curve = curve.run().unwrap_or_else(|error| panic!("{size:e}: {error}"));
        for (([a, k], _), frequency) in curve.points.iter().zip(&curve.frequencies) {
            assert!((a - 0.5).abs() < 1e-12 && (frequency - k.sqrt()).abs() < 1e-11, "{size:e}: {a}, {k}");
        }
    }
}
